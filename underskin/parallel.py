"""Processes for many computations that do not depend on each other.

Each is a fresh interpreter with one BLAS thread: the same numbers whatever the number of cores. They end with the
process that started them, however that one ends.
"""

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_blas_thread() -> None:
    """For the processes to come, and for this one where NumPy has not been imported yet."""
    for name in _THREADS:
        os.environ[name] = "1"


@contextmanager
def processes(count: int) -> Iterator[Executor]:
    """So many. Where the block is left by an exception, Ctrl-C among them, they are killed with what they are at."""
    one_blas_thread()
    others = set(active_children())
    with ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_end_with_the_parent) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in set(active_children()) - others:
                child.kill()
            raise


def _end_with_the_parent() -> None:
    """A killed parent says nothing, and its pipes stay open in its other children; Ctrl-C is the parent's to hear."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_await_the_parent, daemon=True).start()


def _await_the_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
