"""Files that a request brings, written beside the event loop, a megabyte at a time.

A disk may hang, or be slow: who then waits are uploads alone, in threads of their own.
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
    """The few threads that wait for the disk of uploads; those that answer other requests are not among them."""

    def __init__(self) -> None:
        """Within the event loop."""
        self._limiter = CapacityLimiter(_THREADS)

    async def run(self, work: Callable[[], _Result]) -> _Result:
        """What `work` gives, or raises."""
        return await to_thread.run_sync(work, limiter=self._limiter)


class ArrivingFile:
    """A file under way: what came of it is held until it is written."""

    def __init__(self, path: Path) -> None:
        """Nothing came yet; it is made when it is first written."""
        self.path = path
        self.held = bytearray()
        self.ended = False
        self._file: BinaryIO | None = None
        self._digest = hashlib.sha256()

    @property
    def sha256(self) -> str:
        """Of what was written."""
        return self._digest.hexdigest()

    def write(self) -> None:
        """Write what is held, and close it where it has ended."""
        if self._file is None:
            self._file = self.path.open("xb")
        self._file.write(self.held)
        self._digest.update(self.held)
        self.held = bytearray()
        if self.ended:
            self._file.close()

    def close(self) -> None:
        """Give it up where it has not ended."""
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
        """In a new folder, which is gone at the end of the block."""
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
        """The next file comes."""
        file = ArrivingFile(self._folder / str(self._count))
        self._count += 1
        self._unwritten.append(file)
        return file

    def take(self, data: bytes | memoryview) -> None:
        """More of the file that comes."""
        self._unwritten[-1].held += data
        self._held_bytes += len(data)

    def end(self) -> None:
        """That file has ended."""
        self._unwritten[-1].ended = True

    async def write_much(self) -> None:
        """Write what is held where that is much."""
        if self._held_bytes >= _AT_ONCE_BYTES:
            await self.write()

    async def write(self) -> None:
        """Write what is held."""
        await self._threads.run(self._write)

    def _write(self) -> None:
        for file in self._unwritten:
            file.write()
        self._unwritten = [file for file in self._unwritten if not file.ended]
        self._held_bytes = 0
