"""Processes of `underskin` that begin where its modules are loaded.

A test starts hundreds of servers and commands, and each would spend most of its time on the same imports. One process
imports them once and forks for each command, which then is a process of its own, with its own environment, files and
signals, and runs the entry point of the console script to the same exit status.
"""

import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

UNDERSKIN = Path(sys.executable).with_name("underskin")
_MODULES = (  # of the server, and of commands that ask it or invert files
    *("service.cli.serve", "service.cli.keys", "service.cli.backup", "alembic.runtime.migration", "psycopg"),
    "service.store.migrations",
    # With the first campaign and the first pages
    *("underskin.surrogate.spline_kernel", "underskin.physics.contact_kernel", "underskin.inversion.elastomer"),
    *("underskin.figures.campaign_figures", "underskin.figures.frf", "underskin.figures.history", "plotly.subplots"),
    *("underskin.cli.app", "underskin.client.service_client", "underskin.inversion.invert"),
    *("rich.progress", "rich.table"),
)
_LONGEST = 1 << 17  # bytes of a request
_LIMIT = 300.0  # s, for a command to end by itself
_STATUS = struct.Struct("i")
# Read when a process starts: what has them otherwise is forked from another one.
_AT_THE_START = ("PYTHON", "LD_", "MALLOC_")


class Process:
    """As subprocess.Popen, of a process that another one forked."""

    def __init__(self, pid: int, status: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._status = status

    def poll(self) -> int | None:
        """The exit status, or the negative number of the signal that ended it; None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """The exit status; subprocess.TimeoutExpired after so many seconds."""
        if self.returncode is None:
            if not select.select([self._status], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(str(UNDERSKIN), timeout or 0)
            self.returncode = _STATUS.unpack(os.read(self._status, _STATUS.size))[0]
            os.close(self._status)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


def start(
    arguments: Sequence[str], environment: Mapping[str, str], files: tuple[int, int, int], folder: Path | None = None
) -> Process:
    """`underskin` with these arguments, and files as standard input, output and error, in a folder (here)."""
    order = json.dumps(
        {"arguments": arguments, "environment": dict(environment), "folder": str(folder or Path.cwd())}
    ).encode()
    assert len(order) < _LONGEST
    sys.audit("tests.underskin", *arguments)
    reading, writing = os.pipe()
    try:
        forking = _forking_process(
            tuple((name, environment[name]) for name in sorted(filter(_at_the_start, environment)))
        )
        socket.send_fds(forking, [order], [*files, writing])
        pid = _STATUS.unpack(forking.recv(_STATUS.size))[0]
    finally:
        os.close(writing)
    return Process(pid, reading)


def run(
    *arguments: str | Path,
    given: str = "",
    environment: Mapping[str, str] | None = None,
    folder: Path | None = None,
) -> "subprocess.CompletedProcess[str]":
    """Run `underskin` to its end; `given` is its standard input; environment and folder are those of this process."""
    words = [str(argument) for argument in arguments]
    with tempfile.TemporaryFile("w+") as told, tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        told.write(given)
        told.seek(0)
        process = start(words, environment or os.environ, (told.fileno(), out.fileno(), err.fileno()), folder)
        try:
            status = process.wait(_LIMIT)
        finally:
            process.kill()
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(words, status, out.read(), err.read())


def _at_the_start(name: str) -> bool:
    return name.startswith(_AT_THE_START)


@functools.cache
def _forking_process(at_the_start: tuple[tuple[str, str], ...]) -> socket.socket:
    """The connection to the process that forks, with these variables, which ends when this one does."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ordinary = {name: value for name, value in os.environ.items() if not _at_the_start(name)}
    environment = ordinary | dict(at_the_start) | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with its:
        command = [sys.executable, "-P", __file__, str(its.fileno())]
        process = subprocess.Popen(command, pass_fds=[its.fileno()], env=environment)
    atexit.register(process.wait)
    atexit.register(ours.close)
    return ours


def _fork_as_asked(connection: socket.socket) -> None:
    """Fork for each order and tell how each command ended, until there are no more orders.

    A command ends as processes of `multiprocessing` do, without an interpreter that is taken apart: that would copy all
    that is loaded, and take as long again as most commands do.
    """
    waiting: dict[BaseProcess, int] = {}  # where to tell the status, by process
    ended, wakeup = os.pipe()
    os.set_blocking(wakeup, False)
    signal.set_wakeup_fd(wakeup)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C ends the tests, and with them this
    while True:
        ready = select.select([connection.fileno(), ended], [], [])[0]
        if ended in ready:
            os.read(ended, 1024)
            _tell_the_ended(waiting)
        if connection.fileno() in ready:
            order, files, _, _ = socket.recv_fds(connection, _LONGEST, 4)
            if not order:
                return
            process = get_context("fork").Process(target=_run, args=(json.loads(order), files))
            process.start()
            *streams, waiting[process] = files
            for file in streams:
                os.close(file)
            connection.send(_STATUS.pack(process.pid))


def _tell_the_ended(waiting: dict[BaseProcess, int]) -> None:
    for process, file in list(waiting.items()):
        if process.exitcode is not None:
            del waiting[process]
            with contextlib.suppress(BrokenPipeError):  # who asked may not wait for it
                os.write(file, _STATUS.pack(process.exitcode))
            os.close(file)
            process.close()


def _run(order: dict[str, Any], files: list[int]) -> None:
    """Take on the environment, folder, files and arguments of the command, and run it."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for descriptor, file in enumerate(files[:-1]):
        os.dup2(file, descriptor)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    sys.stdin = os.fdopen(0, encoding=sys.stdout.encoding, closefd=False)
    os.environ.clear()
    os.environ.update(order["environment"])
    time.tzset()
    tempfile.tempdir = None  # which the environment names
    os.chdir(order["folder"])
    sys.argv = [str(UNDERSKIN), *order["arguments"]]
    importlib.import_module("underskin.cli.app").main()


def _load() -> None:
    """Import what servers and commands do, and read the table that a server reads with its first campaign."""
    for module in _MODULES:
        importlib.import_module(module)
    from underskin.surrogate.hdf5_format import CONTACT_TABLE, tables_folder
    from underskin.surrogate.solved_contact import solved_contact

    solved_contact(tables_folder() / CONTACT_TABLE)


if __name__ == "__main__":
    _load()
    gc.freeze()  # or every command would copy and free all of it at its end
    with socket.socket(fileno=int(sys.argv[1])) as orders:
        _fork_as_asked(orders)
    os.kill(os.getpid(), signal.SIGKILL)  # an ordinary end would wait for commands that a test left running
