"""The server's end of worker processes (worker.py): one is kept ready, so that a job does not wait for it to load."""

import os
import subprocess
import sys
import tempfile
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

import orjson

from service.jobs.worker import Job
from underskin.recordings.campaign import Campaign
from underskin.recordings.readers import json_file

_INHERITED = ("PATH", "LD_LIBRARY_PATH", "TMPDIR")
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LAST_WORDS = 2000


@dataclass(frozen=True)
class WorkerProcess:
    """A process that waits for a job, and the file that it writes its errors to."""

    process: "subprocess.Popen[bytes]"
    stderr: BinaryIO
    _shared: ExitStack

    @classmethod
    def started(cls, table: Path) -> Self:
        """A new one, which loads this table; raises OSError where the system has no room for a process."""
        environment = {key: os.environ[key] for key in _INHERITED if key in os.environ} | _ONE_THREAD
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))  # the packages of this process
        with ExitStack() as shared:
            stderr = shared.enter_context(tempfile.TemporaryFile())
            command = [sys.executable, "-P", "-m", "service.jobs.worker", str(table)]
            pipe = subprocess.PIPE
            process = shared.enter_context(
                subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=stderr, env=environment)
            )
            return cls(process, stderr, shared.pop_all())

    def end(self) -> None:
        """Kill it, whatever it does, and close what is shared with it."""
        self.process.kill()
        with suppress(OSError):  # what it had not read is lost with it
            self._shared.close()


class WorkerProcesses:
    """Worker processes for jobs; once `keep_ready` was called, one more waits for the next job, until `stop`."""

    def __init__(self, table: Path, table_sha256: str, memory_bytes: int) -> None:
        """`memory_bytes`: what a job may take beyond its program."""
        self.table_sha256 = table_sha256
        self._table = table
        self._memory_bytes = memory_bytes
        self._ready: WorkerProcess | None = None
        self._keeps = False
        self._lock = threading.Lock()

    def keep_ready(self) -> None:
        """See to it that one is ready, from now on."""
        with self._lock:
            self._keeps = True
            self._start()

    def at_work(
        self, campaign: Campaign, excluded: tuple[tuple[str, str], ...] = (), limits: dict[str, Any] | None = None
    ) -> "Worker":
        """A worker at its job, on a campaign."""
        content = json_file.write(campaign)
        job = Job(len(content), self.table_sha256, self._memory_bytes, excluded, limits)
        return Worker(job, content, self._take())

    def _take(self) -> WorkerProcess:
        """The one that is ready, or a new one."""
        with self._lock:
            ready, self._ready = self._ready, None
            if ready is not None and ready.process.poll() is not None:
                ready.end()
                ready = None
            taken = ready or WorkerProcess.started(self._table)
            if self._keeps:
                self._start()
            return taken

    def stop(self) -> None:
        """End the one that is ready."""
        with self._lock:
            self._keeps = False
            if self._ready is not None:
                self._ready.end()
                self._ready = None

    def _start(self) -> None:
        """Without room for it now, the next job has to wait for its own process to load."""
        if self._ready is None:
            with suppress(OSError):
                self._ready = WorkerProcess.started(self._table)


class Worker:
    """A worker at its job. `news` is set when it has ended. Leaving the block ends it in any case."""

    def __init__(self, job: Job, campaign: bytes, worker: WorkerProcess) -> None:
        self.said: dict[str, Any] = {"progress": 0.0}  # the latest of each message, by its name
        self.news = threading.Event()
        self.ended = False
        self._worker, self._process, self._stderr = worker, worker.process, worker.stderr
        threading.Thread(target=self._send, args=(job, campaign), daemon=True).start()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._listener.join()
        self._worker.end()

    @property
    def failure(self) -> str:
        """Why there is no report, once it has ended."""
        status = self._process.returncode
        if "error" in self.said:
            return str(self.said["error"])
        if status < 0:
            return f"its process was killed by signal {-status}; where nobody did that, memory was short"
        last = self.last_words.strip().splitlines()[-1:]
        return f"its process ended with status {status}" + "".join(f": {line[:500]}" for line in last)

    @property
    def last_words(self) -> str:
        """The end of what it wrote to stderr."""
        self._stderr.seek(max(0, self._stderr.seek(0, os.SEEK_END) - _LAST_WORDS))
        return self._stderr.read().decode("utf-8", "replace")

    def _send(self, job: Job, campaign: bytes) -> None:
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):  # it has ended already
            self._process.stdin.write(job.line() + campaign)
            self._process.stdin.flush()  # and stays open: its end is the runner's

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                try:
                    self.said |= orjson.loads(line)
                except orjson.JSONDecodeError:  # killed in the midst of a line
                    break
        self._process.wait()
        self.ended = True
        self.news.set()
