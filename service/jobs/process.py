"""The server's side of worker processes: a fork server (fork_server.py) and the workers that it forks."""

import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

import orjson

from service.jobs.worker import Job, Part
from service.schemas.diagnoses import DiagnosisKind
from underskin.recordings.campaign import Campaign
from underskin.recordings.readers import json_file

_INHERITED = ("PATH", "LD_LIBRARY_PATH", "TMPDIR", "UNDERSKIN_MECHANISMS", "UNDERSKIN_TIME_ZONE")
_SINGLE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LAST_WORDS = 2000
_WAIT_TIMES = 5  # as long by the clock as on a processor: a busy machine is no reason to end a diagnosis
_LOADING_S = (
    300.0  # within which a fork server must have loaded everything: 4 s, at low priority on a busy machine far more
)


class ForkServer:
    """A process that forks workers after loading the program and a table."""

    def __init__(self, table: Path) -> None:
        """Start it; raises OSError where the system has no room for a process."""
        environment = {key: os.environ[key] for key in _INHERITED if key in os.environ} | _SINGLE_THREAD
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))  # the packages of this process
        command = [sys.executable, "-P", "-m", "service.jobs.fork_server", str(table)]
        with ExitStack() as shared:
            self._stderr = shared.enter_context(tempfile.TemporaryFile())
            self._socket, theirs = map(shared.enter_context, socket.socketpair())
            self._process = subprocess.Popen(
                command, stdin=theirs.fileno(), stdout=subprocess.DEVNULL, stderr=self._stderr, env=environment
            )
            theirs.close()
            self._socket.settimeout(_LOADING_S)
            self._shared = shared.pop_all()

    @property
    def runs(self) -> bool:
        """Whether the process is alive."""
        return self._process.poll() is None

    def fork(self) -> "WorkerProcess":
        """A new worker; raises OSError with the process's last message if it has ended or does not answer."""
        with ExitStack() as ours, ExitStack() as theirs:

            def pipe(*, to_worker: bool) -> BinaryIO:
                reads, writes = os.pipe()
                of_server, of_worker = (writes, reads) if to_worker else (reads, writes)
                descriptors.append(of_worker)
                theirs.callback(os.close, of_worker)
                return ours.enter_context(os.fdopen(of_server, "wb" if to_worker else "rb"))

            descriptors: list[int] = []
            stdin, stdout = pipe(to_worker=True), pipe(to_worker=False)
            stderr = ours.enter_context(tempfile.TemporaryFile())
            descriptors.append(stderr.fileno())
            status = pipe(to_worker=False)
            try:
                socket.send_fds(self._socket, [b"f"], descriptors)
                _, forked, _, _ = socket.recv_fds(self._socket, 1, 1)
            except ConnectionError:
                forked = []
            except TimeoutError as error:
                raise OSError(
                    f"no process for the diagnosis could be started within {_LOADING_S:g} s, because this computer is "
                    "too busy: diagnose it again when other work on it has ended"
                ) from error
            if not forked:
                raise OSError(f"no process for the diagnosis could be started: {_end_of(self._stderr) or 'it ended'}")
            ours.callback(os.close, forked[0])
            return WorkerProcess(forked[0], stdin, stdout, stderr, status, ours.pop_all())

    def end(self) -> None:
        """Kill it; its workers go on."""
        self._process.kill()
        self._process.wait()
        self._shared.close()


@dataclass(frozen=True)
class WorkerProcess:
    """A worker's process descriptor and pipes; its exit code can be read from `status` when it has ended."""

    descriptor: int
    stdin: BinaryIO
    stdout: BinaryIO
    stderr: BinaryIO
    status: BinaryIO
    _shared: ExitStack

    def kill(self) -> None:
        """Kill the worker."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self.descriptor, signal.SIGKILL)

    def wait(self) -> int | None:
        """Its exit code, or −signal, once it has ended; None if the process that forked it ended before."""
        ended = select.poll()  # select() takes no descriptor beyond 1,023
        ended.register(self.descriptor, select.POLLIN)
        ended.poll()
        code = self.status.read()
        return int(code) if code else None

    def close(self) -> None:
        """Close its pipes."""
        with suppress(OSError):  # unread input is lost with it
            self._shared.close()


@dataclass(frozen=True)
class CampaignInput:
    """A campaign for a worker: its document, its skin, and the excluded recordings, each with the reason."""

    document: bytes
    skin_id: str
    excluded: Sequence[tuple[str, str]] = ()

    @classmethod
    def of(cls, campaign: Campaign, skin_id: str, excluded: Sequence[tuple[str, str]] = ()) -> Self:
        """From a campaign without its excluded recordings."""
        return cls(json_file.write(campaign), skin_id, excluded)


def _end_of(stderr: BinaryIO) -> str:
    stderr.seek(max(0, stderr.seek(0, os.SEEK_END) - _LAST_WORDS))
    return stderr.read().decode("utf-8", "replace")


class WorkerProcesses:
    """Workers for jobs. Their fork server starts with the first worker, or by `get_ready`, and runs until `stop` or, if
    none is to be kept ready, until the last worker has ended."""

    def __init__(
        self, table: Path, table_sha256: str, memory_bytes: int, cpu_seconds: float, *, keeps_ready: bool
    ) -> None:
        """`memory_bytes`: what a job may take beyond its program; `cpu_seconds`: on a processor."""
        self.table_sha256 = table_sha256
        self.longest_s = _WAIT_TIMES * cpu_seconds
        self._cpu_seconds = cpu_seconds
        self._table = table
        self._memory_bytes = memory_bytes
        self._keeps_ready = keeps_ready
        self._server: ForkServer | None = None
        self._at_work = 0
        self._lock = threading.Lock()

    def get_ready(self) -> None:
        """Start the fork server if it is to be kept ready; if the system has no room now, a job starts it."""
        if self._keeps_ready:
            with self._lock, suppress(OSError):
                self._running()

    def at_work(
        self,
        campaigns: Sequence[CampaignInput],
        limits: dict[str, Any] | None = None,
        without: Sequence[str] = (),
        kind: DiagnosisKind = "campaign",
        name: str | None = None,
    ) -> "Worker":
        """A worker for a job on campaigns; see `Job`."""
        parts = [Part(campaign.skin_id, len(campaign.document), campaign.excluded) for campaign in campaigns]
        job = Job(parts, self.table_sha256, self._memory_bytes, self._cpu_seconds, limits, without, kind, name)
        content = [campaign.document for campaign in campaigns]
        with self._lock:
            try:
                process = self._running().fork()
            except OSError:  # it was killed just now, or hangs: a new one may not
                self._end()
                process = self._running().fork()
            self._at_work += 1
        return Worker(job, content, process, self._is_done)

    def stop(self) -> None:
        """End the fork server."""
        with self._lock:
            self._end()

    def _running(self) -> ForkServer:
        if self._server is not None and not self._server.runs:
            self._end()
        if self._server is None:
            self._server = ForkServer(self._table)
        return self._server

    def _is_done(self) -> None:
        """Count a worker that has ended."""
        with self._lock:
            self._at_work -= 1
            if not self._at_work and not self._keeps_ready:
                self._end()

    def _end(self) -> None:
        if self._server is not None:
            self._server.end()
            self._server = None


class Worker:
    """A running worker. `news` is set when it has ended. Leaving the block kills it if it still runs."""

    def __init__(
        self, job: Job, documents: Sequence[bytes], process: WorkerProcess, is_done: Callable[[], None]
    ) -> None:
        """`is_done` is called once the process has ended and nothing is shared with it any more."""
        self.messages: dict[str, Any] = {"progress": 0.0}  # the latest of each message, by its name
        self.news = threading.Event()
        self.ended = False
        self.too_long = f"it takes more than {job.cpu_seconds:g} s on a processor (UNDERSKIN_DIAGNOSIS_SECONDS)"
        self._process, self._is_done = process, is_done
        self._code: int | None = None
        threading.Thread(target=self._send, args=(job, documents), daemon=True).start()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._listener.join()
        self._process.close()
        self._is_done()

    @property
    def failure(self) -> str:
        """Why there is no report, once it has ended."""
        if "error" in self.messages:
            return str(self.messages["error"])
        if self._code is None:
            return "its process ended with the one that had started it"
        if self._code == -signal.SIGXCPU:
            return self.too_long
        if self._code < 0:
            return f"its process was killed by signal {-self._code}; where nobody did that, memory was short"
        last = self.last_words.strip().splitlines()[-1:]
        return f"its process ended with status {self._code}" + "".join(f": {line[:500]}" for line in last)

    @property
    def last_words(self) -> str:
        """The end of its stderr."""
        return _end_of(self._process.stderr)

    def _send(self, job: Job, documents: Sequence[bytes]) -> None:
        with suppress(OSError, ValueError):  # it has ended already
            self._process.stdin.write(job.line())
            for document in documents:
                self._process.stdin.write(document)
            self._process.stdin.flush()  # and stays open: its end is the runner's

    def _listen(self) -> None:
        for line in self._process.stdout:
            try:
                self.messages |= orjson.loads(line)
            except orjson.JSONDecodeError:  # killed in the midst of a line
                break
        self._code = self._process.wait()
        self.ended = True
        self.news.set()
