"""Functions compiled by numba at set-up; later processes load them from its cache.

`python -m underskin.compiled` fills the cache. Modules of compiled functions (named in `KERNELS`) are imported where
they are called, since importing numba takes half a second and 100 MB, which a command that computes nothing does not
need.
"""

import gc
import hashlib
import importlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import CacheImpl, InTreeCacheLocator

KERNELS = (
    "underskin.diagnosis.kernels",
    "underskin.mechanisms.models.sphere_kernels",
    "underskin.mechanisms.models.sigma_kernels",
    "underskin.physics.contact_kernel",
    "underskin.surrogate.spline_kernel",
)

# Every processor of a kind runs the same code, so that a cache made on one serves another, and gives the same bytes.
vars(config).update(CPU_NAME="generic", CPU_FEATURES="")

Function = Callable[..., Any]


class _SourceCacheLocator(InTreeCacheLocator):
    """The cache in `__pycache__`, also where it was made at set-up and is read-only now."""

    def ensure_cache_path(self) -> None:
        """Ask for a folder that can be written only where it holds no cache yet."""
        if not any(Path(self._cache_path).glob(f"{Path(self._py_file).stem}.*.nbi")):
            super().ensure_cache_path()  # type: ignore[no-untyped-call]

    def get_source_stamp(self) -> bytes:
        """A digest of all kernels, since one may hold functions of another."""
        return _digest()


@cache
def _digest() -> bytes:
    files = [Path(__file__).parents[1].joinpath(*name.split(".")).with_suffix(".py") for name in KERNELS]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()


CacheImpl._locator_classes.insert(0, _SourceCacheLocator)


def compiled(signature: str | None = None) -> Callable[[Function], Function]:
    """A decorator: compiled for this signature when its module is imported, or within its callers where there is none.

    Errors are those of NumPy: a division by zero is infinite. Other threads run meanwhile.
    """

    def decorate(function: Function) -> Function:
        if signature is None:
            return numba.njit(function, error_model="numpy", inline="never")
        return numba.njit(signature, cache=True, error_model="numpy", nogil=True)(function)

    return decorate


def load_all() -> None:
    """Load all compiled functions, and compile those that the cache does not hold.

    The modules' objects are permanent, so garbage collection ignores them: with them one takes a tenth of a second.
    """
    for name in KERNELS:
        importlib.import_module(name)
    gc.freeze()


if __name__ == "__main__":
    load_all()
