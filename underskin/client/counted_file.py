"""A file that says how much of it was read, for the progress of what is sent."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any


class CountedFile(io.FileIO):
    """A file opened to be read; `progress` is called with the bytes of each read, and with less than 0 for a return."""

    def __init__(self, path: Path, progress: Callable[[int], object]) -> None:
        super().__init__(path)
        self._progress = progress

    def read(self, size: int | None = -1, /) -> Any:
        """As any file."""
        data = super().read(size)
        self._progress(len(data or b""))
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """As any file: a request that is repeated begins anew."""
        before = self.tell()
        place = super().seek(offset, whence)
        if whence == io.SEEK_SET and place != before:
            self._progress(place - before)
        return place
