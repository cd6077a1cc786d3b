"""A process with the program and the table loaded, which forks a worker for each job (worker.py).

A fork takes 10 ms where loading takes 1 to 2 s, and shares the loaded memory. The process is called `underskin-ready`
in process lists, its workers `underskin-works`.

Standard input is a socket: each byte comes with four file descriptors, a worker's standard input, output and error, and
one to which its exit status is written. The answer is a byte with a process descriptor of the worker. This process ends
when the socket closes; workers end with the server, whose end of their input closes.
"""

import os
import selectors
import socket
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from service.jobs import worker

_NICENESS = 10
_LOADED = "underskin.diagnosis.pipeline", "underskin.diagnosis.reporting.figures"  # ahead of any job
_DESCRIPTORS = 4


def main() -> None:
    """Entry point; the argument is the table's path."""
    os.nice(_NICENESS)
    be_called("underskin-ready")
    for module in _LOADED:
        import_module(module)
    from underskin.compiled import load_all
    from underskin.errors import UnderskinError
    from underskin.surrogate.sigma_table import load_table

    load_all()
    try:
        table, problem = load_table(Path(sys.argv[1])), ""
        worker.warm_up(table)
    except UnderskinError as error:
        table, problem = None, str(error)

    def work() -> None:
        be_called("underskin-works")
        worker.work(table, problem)

    with socket.socket(fileno=os.dup(0)) as connection:
        _serve(connection, work)


def be_called(name: str) -> None:
    """Set this process's name in process lists; at most 15 characters."""
    with suppress(OSError):
        Path("/proc/self/comm").write_text(name)


def _serve(connection: socket.socket, work: Callable[[], None]) -> None:
    """Fork workers on request and report their exit status."""
    with selectors.DefaultSelector() as waiting:
        waiting.register(connection, selectors.EVENT_READ)
        while True:
            for key, _ in waiting.select():
                if key.fileobj is not connection:
                    pid, status = key.data
                    _report_exit(pid, status)
                    waiting.unregister(key.fd)
                    os.close(key.fd)
                    continue
                message, descriptors, _, _ = socket.recv_fds(connection, 1, _DESCRIPTORS)
                if not message:
                    return
                pid = os.fork()
                if pid == 0:
                    _become(descriptors, work)
                process = os.pidfd_open(pid)
                for descriptor in descriptors[:-1]:
                    os.close(descriptor)
                socket.send_fds(connection, [b"f"], [process])
                waiting.register(process, selectors.EVENT_READ, (pid, descriptors[-1]))


def _become(descriptors: list[int], work: Callable[[], None]) -> NoReturn:
    """Run a worker in the forked process, with only these descriptors open."""
    code = 1
    try:
        for number, descriptor in enumerate(descriptors[:-1]):
            os.dup2(descriptor, number)
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        work()
        code = 0
    except BaseException:  # whatever it is, this process must not go on as the one that forks
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _report_exit(pid: int, status: int) -> None:
    """Write how a worker ended to the descriptor `status`: its exit code, or −signal."""
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    with suppress(OSError):  # the server has ended
        os.write(status, b"%d" % code)
    os.close(status)


if __name__ == "__main__":
    main()
