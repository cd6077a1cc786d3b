"""A folder whose disk loses its power: what was not synced is gone.

Processes that run with `Disk.environment` write to the folder as ever, and a small C library in them (`synced.c`, built
here) keeps apart what they sync. A cut then puts in the place of the folder what the disk would have: names and
contents as they were synced last, or, since a disk may be ahead of what it was asked for, with some of what was not,
sector by sector.
"""

import os
import random
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tests.support import preloadable

_SOURCE = Path(__file__).with_name("synced.c")
_SECTOR = 512  # bytes that a disk writes whole

Entries = dict[str, tuple[str, str]]  # of a folder: by name, the identity and the type, `d` or `f`


@contextmanager
def powered(folder: Path) -> Iterator["Disk"]:
    """The disk of a folder that is there already; what is in it at first counts as synced."""
    with tempfile.TemporaryDirectory(prefix="underskin-disk-") as synced:
        yield Disk(folder.resolve(), Path(synced))


class Disk:
    """The disk of `folder`; what was synced is kept in the folder `synced`."""

    def __init__(self, folder: Path, synced: Path) -> None:
        self.folder, self._synced = folder, synced
        self._begin()

    @property
    def environment(self) -> Mapping[str, str]:
        """For processes that write to the folder."""
        return self._environment(self._synced)

    def cut(self, partly: random.Random | None = None) -> None:
        """Make the folder what it is after a power cut, once every process that writes to it has ended.

        With `partly`, each folder's names are at random those synced or those of the end, and each sector of a file
        likewise; else nothing of what was not synced is there.
        """
        with tempfile.TemporaryDirectory() as end:
            written = Path(end)
            self._sync_all(written)
            inode = self.folder.stat().st_ino
            (root,) = (file.name for file in written.glob(f"{inode}-*"))
            after = _After(self._synced, written, partly)
            with tempfile.TemporaryDirectory(dir=self.folder.parent) as new:
                after.put_folder(root, Path(new))
                for old in self.folder.iterdir():
                    if old.is_dir():
                        shutil.rmtree(old)
                    else:
                        old.unlink()
                for entry in Path(new).iterdir():
                    entry.rename(self.folder / entry.name)
        self._own()
        for file in self._synced.iterdir():
            file.unlink()
        self._begin()

    def _begin(self) -> None:
        """All that is there is synced, by the folder's owner, who may be another than we are."""
        owner = self.folder.stat()
        os.chown(self._synced, owner.st_uid, owner.st_gid)
        self._sync_all(self._synced)

    def _sync_all(self, to: Path) -> None:
        """Have all files and folders kept in `to`."""
        found = [str(path) for path in (self.folder, *self.folder.rglob("*")) if path.is_dir() or path.is_file()]
        for start in range(0, len(found), 500):
            command = ["sync", *found[start : start + 500]]
            subprocess.run(command, env=os.environ | self._environment(to), check=True)
        lock = to / ".lock"
        owner = self.folder.stat()
        os.chown(lock, owner.st_uid, owner.st_gid)

    def _environment(self, to: Path) -> dict[str, str]:
        return {"LD_PRELOAD": str(preloadable.built(_SOURCE)), "POWER_LIVE": str(self.folder), "POWER_DISK": str(to)}

    def _own(self) -> None:
        owner = self.folder.stat()
        for path in self.folder.rglob("*"):
            os.chown(path, owner.st_uid, owner.st_gid)
            path.chmod(0o700 if path.is_dir() else 0o600)


class _After:
    """Puts together what a disk has of what was synced and of what was written."""

    def __init__(self, synced: Path, written: Path, partly: random.Random | None) -> None:
        self._synced, self._written, self._partly = synced, written, partly

    def put_folder(self, identity: str, place: Path) -> None:
        """Fill the folder `place`."""
        source = self._written if self._partly is not None and self._partly.random() < 0.5 else self._synced
        for name, (entry, kind) in _entries(source / identity).items():
            if kind == "d":
                (place / name).mkdir()
                self.put_folder(entry, place / name)
            else:
                (place / name).write_bytes(self._content(entry))

    def _content(self, identity: str) -> bytes:
        synced, end = _read(self._synced / identity), self._written / identity
        if self._partly is None or not end.exists():  # it was removed, which nothing kept
            return synced
        written = end.read_bytes()
        longer = max(len(synced), len(written))
        sources = (synced.ljust(longer, b"\0"), written.ljust(longer, b"\0"))
        sectors = (self._partly.choice(sources)[at : at + _SECTOR] for at in range(0, longer, _SECTOR))
        return b"".join(sectors)[: self._partly.choice((len(synced), len(written)))]


def _entries(listing: Path) -> Entries:
    """Of a folder; none where it was never synced."""
    lines = [line.split(" ", 2) for line in _read(listing).decode().splitlines()]
    return {name: (identity, kind) for identity, kind, name in lines}


def _read(file: Path) -> bytes:
    return file.read_bytes() if file.exists() else b""
