"""The server's end of a worker process."""

import fcntl
import os
import resource
import subprocess
from contextlib import ExitStack
from io import BytesIO

from service.jobs.process import WorkerProcess


def test_the_end_of_a_worker_is_seen_where_a_thousand_files_are_open() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    reads, writes = os.pipe()
    os.write(writes, b"0")
    os.close(writes)
    with ExitStack() as shared, subprocess.Popen(["true"]) as process, os.fdopen(reads, "rb") as status:
        low = os.pidfd_open(process.pid)
        shared.callback(os.close, low)
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        shared.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        high = fcntl.fcntl(low, fcntl.F_DUPFD_CLOEXEC, 1500)
        shared.callback(os.close, high)
        worker = WorkerProcess(high, BytesIO(), BytesIO(), BytesIO(), status, ExitStack())
        assert worker.wait() == 0
