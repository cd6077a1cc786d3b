"""C libraries that take the place of some of the system's calls, for processes with LD_PRELOAD."""

import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest


@functools.cache
def built(source: Path) -> Path:
    """The library of a source, built for this run; skips the test where no C compiler is."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip(f"{source.name} needs a C compiler (Debian's package gcc)")
    library = Path(tempfile.mkdtemp(prefix="underskin-preload-")) / source.with_suffix(".so").name
    library.parent.chmod(0o755)  # for PostgreSQL's user, too
    subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"], check=True)
    return library
