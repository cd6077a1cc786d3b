"""The runner's end of a worker process (worker.py)."""

import os
import subprocess
import sys
import threading
from contextlib import suppress
from types import TracebackType
from typing import Any, BinaryIO, Self

import orjson

from service.jobs.worker import Job

_INHERITED = ("PATH", "LD_LIBRARY_PATH", "TMPDIR")
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LAST_WORDS = 2000


class Worker:
    """A running worker that writes its errors to `stderr`, a file that can be read. `news` is set when it has ended.

    Leaving the block ends it in any case.
    """

    def __init__(self, job: Job, campaign: bytes, stderr: BinaryIO) -> None:
        self.progress = 0.0
        self.report: dict[str, Any] | None = None
        self.figures: dict[str, str] | None = None
        self.plan: dict[str, Any] | None = None
        self.error: str | None = None
        self.news = threading.Event()
        self.ended = False
        self._stderr = stderr
        environment = {key: os.environ[key] for key in _INHERITED if key in os.environ} | _ONE_THREAD
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))  # the packages of this process
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "service.jobs.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            env=environment,
        )
        threading.Thread(target=self._send, args=(job, campaign), daemon=True).start()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._listener.join()
        assert self._process.stdin is not None
        with suppress(OSError):  # what it had not read is lost with it
            self._process.stdin.close()

    @property
    def failure(self) -> str:
        """Why there is no report, once it has ended."""
        status = self._process.returncode
        if self.error is not None:
            return self.error
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
                    message = orjson.loads(line)
                except orjson.JSONDecodeError:  # killed in the midst of a line
                    break
                self.progress = message.get("progress", self.progress)
                self.report = message.get("report", self.report)
                self.figures = message.get("figures", self.figures)
                self.plan = message.get("plan", self.plan)
                self.error = message.get("error", self.error)
        self._process.wait()
        self.ended = True
        self.news.set()
