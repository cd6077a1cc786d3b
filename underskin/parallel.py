"""Processes for independent computations, and limits of a process.

Each process of a pool is a new interpreter with one BLAS thread, so results do not depend on the number of cores.
They end with the process that started them, however it ends.
"""

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_blas_thread() -> None:
    """Set one BLAS thread for new processes, and for this one if NumPy has not been imported yet."""
    for name in _THREADS:
        os.environ[name] = "1"


@contextmanager
def processes(count: int) -> Iterator[Executor]:
    """A pool of `count` processes; if the block is left by an exception, such as Ctrl-C, they are killed."""
    # Here, since a process that is limited alone loads in half the time without them
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, get_context

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


def limit_process(memory_bytes: int, *, file_bytes: int | None = None, cpu_seconds: int | None = None) -> None:
    """Limit this process for good: address space beyond its present one, size of written files, CPU time [s].

    For Linux. No core dump is written; SIGXCPU signals that time is up.
    """
    import resource  # not on Windows, where no server runs

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limits = {resource.RLIMIT_AS: used + memory_bytes, resource.RLIMIT_CORE: 0}
    if file_bytes is not None:
        limits[resource.RLIMIT_FSIZE] = file_bytes
    for kind, most in limits.items():
        resource.setrlimit(kind, (most, most))
    if cpu_seconds is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))  # at the second it is killed


def _end_with_the_parent() -> None:
    """End this process with its parent, also if that is killed; Ctrl-C is handled by the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_await_the_parent, daemon=True).start()


def _await_the_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
