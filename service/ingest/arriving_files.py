"""Uploaded files, written outside the event loop, one megabyte at a time.

A slow or hanging disk delays only uploads, which have their own threads.
"""

import hashlib
import tempfile
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import BinaryIO, Self, TypeVar

from anyio import CancelScope, CapacityLimiter, to_thread

_AT_ONCE_BYTES = 1 << 20  # that are written in one go: a thread for each chunk of a body would cost more than it writes
_THREADS = 8

_Result = TypeVar("_Result")


class DiskThreads:
    """A small thread pool for writing uploads, separate from the threads that answer other requests."""

    def __init__(self) -> None:
        """Within the event loop."""
        self._limiter = CapacityLimiter(_THREADS)

    async def run(self, work: Callable[[], _Result]) -> _Result:
        """The result of `work`, or its exception."""
        return await to_thread.run_sync(work, limiter=self._limiter)


class ArrivingFile:
    """A file being received; data are buffered until written."""

    def __init__(self, path: Path) -> None:
        """Empty; the file is created at the first write."""
        self.path = path
        self.held = bytearray()
        self.ended = False
        self._file: BinaryIO | None = None
        self._digest = hashlib.sha256()

    @property
    def sha256(self) -> str:
        """SHA-256 digest of the written data."""
        return self._digest.hexdigest()

    def write(self) -> None:
        """Write the buffer, and close the file if it is complete."""
        if self._file is None:
            self._file = self.path.open("xb")
        self._file.write(self.held)
        self._digest.update(self.held)
        self.held = bytearray()
        if self.ended:
            self._file.close()

    def close(self) -> None:
        """Discard the file if it is incomplete."""
        if self._file is not None:
            self._file.close()


class ArrivingFiles:
    """The files of a request, one after the other, in a folder of their own."""

    def __init__(self, folder: Path, threads: DiskThreads) -> None:
        """An empty folder."""
        self._folder = folder
        self._threads = threads
        self._count = 0
        self._unwritten: list[ArrivingFile] = []  # the last of them is the one that comes
        self._held_bytes = 0

    @classmethod
    @asynccontextmanager
    async def below(cls, parent: Path, threads: DiskThreads) -> AsyncIterator[Self]:
        """In a new folder, removed at the end of the block."""
        folder = await threads.run(partial(tempfile.TemporaryDirectory, dir=parent))
        files = cls(Path(folder.name), threads)

        def remove() -> None:
            for file in files._unwritten:
                file.close()
            folder.cleanup()

        try:
            yield files
        finally:
            with CancelScope(shield=True):
                await threads.run(remove)

    def begin(self) -> ArrivingFile:
        """Start the next file."""
        file = ArrivingFile(self._folder / str(self._count))
        self._count += 1
        self._unwritten.append(file)
        return file

    def take(self, data: bytes | memoryview) -> None:
        """Append data to the current file."""
        self._unwritten[-1].held += data
        self._held_bytes += len(data)

    def end(self) -> None:
        """The current file is complete."""
        self._unwritten[-1].ended = True

    async def write_much(self) -> None:
        """Write the buffers if they are large."""
        if self._held_bytes >= _AT_ONCE_BYTES:
            await self.write()

    async def write(self) -> None:
        """Write the buffers."""
        await self._threads.run(self._write)

    def _write(self) -> None:
        for file in self._unwritten:
            file.write()
        self._unwritten = [file for file in self._unwritten if not file.ended]
        self._held_bytes = 0
