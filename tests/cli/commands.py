"""The command `underskin` as a user runs it."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.support import preloaded

COMMAND = Path(sys.executable).with_name("underskin")
PRESSED: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
}
SKIN = [part for name, value in PRESSED.items() for part in ("--" + name.replace("_", "-"), str(value))]
FRF = ["frf", *SKIN, "--d33-pc-per-n", "14"]


def run(*arguments: str, given: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """The command's result; `given` is its standard input."""
    plain = {**os.environ, "COLUMNS": "120", **environment}
    if any(name.startswith("PYTHON") for name in environment):  # read at the start of the interpreter
        return subprocess.run([COMMAND, *arguments], input=given, env=plain, capture_output=True, text=True)
    return preloaded.run(*arguments, given=given, environment=plain)


def refused(*arguments: str, given: str = "", **environment: str) -> str:
    """The one line on stderr of a command that ends with status 2."""
    answer = run(*arguments, given=given, **environment)
    assert (answer.returncode, answer.stdout) == (2, "")
    (line,) = answer.stderr.splitlines()
    return line
