"""Which files of a folder are complete: instruments write for a while, and leave temporary files beside."""

import os
import stat
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from underskin.errors import FileError
from underskin.recordings.reading import read_contents

_PATIENCE = 12  # times as long as a file must be unchanged, before one that no reader opens is taken as it is
_RETRIES, _LONGER = (
    5,
    4,
)  # of a file whose refusal may pass, and how many times as long the wait is from one to the next
_TEMPORARY = (".part", ".partial", ".tmp", ".temp", ".crdownload", ".lock", "~")
_BESIDE = (".tdms_index",)  # LabVIEW's index of a file, which holds nothing of its own


@dataclass
class _Seen:
    """A file as it was: size, time of change, since when (monotonic, s), whether a reader opens it as it is, how often
    it was postponed, and until when."""

    size: int
    changed_ns: int
    since: float
    opens: bool | None = None
    retries: int = 0
    not_before: float = 0.0
    done: bool = False


class WatchedFolder:
    """The files of a folder and of the folders in it; hidden, temporary and empty ones are left out.

    A file is complete when its size and its time have not changed for `settle_s` and a reader of its format opens it;
    one that none opens is complete after a further while, for the service to say what is wrong with it.
    """

    def __init__(self, path: Path, settle_s: float) -> None:
        self.path = path
        self._settle_s = settle_s
        self._seen: dict[Path, _Seen] = {}
        self.unreadable: dict[Path, OSError] = {}  # what `settled` could not look at, and left out

    def settled(self) -> list[Path]:
        """Files that do not change any more and are not done, the oldest first; OSError where the folder is gone."""
        now = time.monotonic()
        seen = {}
        self.unreadable = {}
        for path, status in self._files():
            known = self._seen.get(path)
            if known is None or (known.size, known.changed_ns) != (status.st_size, status.st_mtime_ns):
                known = _Seen(status.st_size, status.st_mtime_ns, now)
            seen[path] = known
        self._seen = seen
        settled = [
            path
            for path, one in seen.items()
            if not one.done and now - one.since >= self._settle_s and now >= one.not_before
        ]
        return sorted(settled, key=lambda path: seen[path].changed_ns)

    def is_complete(self, path: Path) -> bool:
        """Whether a settled file is complete."""
        seen = self._seen[path]
        if seen.opens is None:
            seen.opens = _opens(path)
        return seen.opens or time.monotonic() - seen.since >= (1 + _PATIENCE) * self._settle_s

    def is_unchanged(self, path: Path) -> bool:
        """Whether a file still is as it was when it was found settled."""
        try:
            status = path.stat()
        except OSError:
            return False
        seen = self._seen[path]
        return (status.st_size, status.st_mtime_ns) == (seen.size, seen.changed_ns)

    def done(self, path: Path) -> None:
        """A file is of no more interest until it changes."""
        self._seen[path].done = True

    def postpone(self, path: Path) -> None:
        """Take a file for one that has just changed."""
        self._seen[path].since = time.monotonic()

    def retry_later(self, path: Path) -> float | None:
        """Leave a file for a while, longer each time; the while (s), or None after the last time: the file is done."""
        seen = self._seen[path]
        if seen.retries == _RETRIES:
            self.done(path)
            return None
        wait_s = self._settle_s * _PATIENCE * float(_LONGER**seen.retries)
        seen.retries += 1
        seen.not_before = time.monotonic() + wait_s
        return wait_s

    def _files(self) -> Iterator[tuple[Path, os.stat_result]]:
        for folder, folders, names in os.walk(self.path, onerror=self._leave_out):
            folders[:] = [name for name in folders if not name.startswith(".")]
            for name in names:
                if name.startswith(".") or name.lower().endswith((*_TEMPORARY, *_BESIDE)):
                    continue
                path = Path(folder, name)
                try:
                    status = path.stat()
                except FileNotFoundError:  # renamed meanwhile
                    continue
                except OSError as error:  # such as a link to itself
                    self._leave_out(error)
                    continue
                if stat.S_ISREG(status.st_mode) and status.st_size:
                    yield path, status

    def _leave_out(self, error: OSError) -> None:
        """Go on without a file or folder; raises the error where it is of the watched folder itself."""
        path = Path(error.filename)
        if path == self.path:
            raise error
        if not isinstance(error, FileNotFoundError):  # a folder that was renamed meanwhile
            self.unreadable[path] = error


def _opens(path: Path) -> bool:
    try:
        read_contents(path, path.name)
    except FileError:
        return False
    return True
