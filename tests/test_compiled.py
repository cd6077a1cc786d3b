"""Compiled functions come from the cache that set-up made, also where nothing can be written."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

_LOADED = """
import tempfile
def refuse(*args, **kwargs):
    raise PermissionError("read-only")
tempfile.TemporaryFile = refuse
from underskin.compiled import load_all
load_all()
from underskin.diagnosis.kernels import log_likelihoods
from underskin.surrogate.spline_kernel import sigma_rows
for function in (log_likelihoods, sigma_rows):
    assert sum(function.stats.cache_hits.values()) == 1, function.stats
    assert not function.stats.cache_misses, function.stats
"""


def test_what_set_up_compiled_is_loaded_and_not_compiled_again() -> None:
    subprocess.run([sys.executable, "-m", "underskin.compiled"], check=True)
    subprocess.run([sys.executable, "-c", _LOADED], check=True)
