"""An interrupted soak goes on where it was."""

import os
import subprocess
import sys

import pytest

from tests.support.repository import ROOT


@pytest.mark.slow
def test_a_soak_that_is_run_again_skips_what_has_passed() -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs", "tests/physics/test_response.py"]
    for _ in range(2):
        environment = os.environ | {"UNDERSKIN_SOAK": "1"}
        environment.pop("PYTEST_XDIST_WORKER", None)
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert "passed on this code already" in done.stdout
    assert " passed" not in done.stdout.splitlines()[-1]
