"""The journal of a watched folder: what became of each content that was sent, kept in the folder itself.

`.underskin-watch.json` has a line for its schema, and one for each entry, which is appended; a last line that a power
cut left unfinished is ignored. A file without an entry is sent again, which the service answers as before and keeps
once, as long as name, rig and estimator are the same.
"""

import fcntl
import json
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TextIO

from underskin.errors import UnderskinError

NAME = ".underskin-watch.json"
_LOCK = ".underskin-watch.lock"
_SCHEMA = "watch/2"
_FIRST_SCHEMA = "watch/1"  # one JSON document with all entries
_HEADING = json.dumps({"schema": _SCHEMA}) + "\n"


@dataclass(frozen=True)
class Entry:
    """What became of a content (its SHA-256) at a service, for a skin: the campaigns that it is kept as, none where it
    was refused. `terms` is a digest of what else was said of it: another rig may make sense of what was refused."""

    sha256: str
    file: str
    url: str
    skin: str
    terms: str
    campaigns: Sequence[str]
    at: str

    @property
    def is_sent(self) -> bool:
        """Whether the service keeps it."""
        return bool(self.campaigns)


@dataclass(frozen=True)
class Target:
    """Where contents go, and what is said of them, as `Entry` has it."""

    url: str
    skin: str
    terms: str


class Journal:
    """The journal of one folder, locked against a second process; raises UnderskinError where it cannot be used."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        try:
            self._lock = (folder / _LOCK).open("w")
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise UnderskinError(f"{folder} is watched by another process already") from None
        except OSError as error:
            raise UnderskinError(f"{folder / _LOCK} cannot be written and locked: {error.strerror}") from error
        self._has_whole_lines = False  # of this schema, so that a line can be appended
        self._entries = self._read()

    def close(self) -> None:
        """Let another process watch the folder."""
        self._lock.close()

    def known(self, target: Target, sha256: str) -> Entry | None:
        """What became of a content: sent for this skin, or refused on these terms."""
        for entry in reversed(self._entries):
            same = (entry.sha256, entry.url, entry.skin) == (sha256, target.url, target.skin)
            if same and (entry.is_sent or entry.terms == target.terms):
                return entry
        return None

    def add(self, target: Target, sha256: str, file: str, campaigns: Sequence[str]) -> None:
        """Keep what became of a content; it is on the disk afterwards. Raises UnderskinError."""
        at = datetime.now(UTC).isoformat(timespec="seconds")
        self._entries.append(Entry(sha256, file, target.url, target.skin, target.terms, list(campaigns), at))
        try:
            if self._has_whole_lines and self._path.exists():
                with self._path.open("a", encoding="utf-8") as journal:
                    _write(journal, [_line(self._entries[-1])])
            else:
                self._replace()
                self._has_whole_lines = True
        except OSError as error:
            raise UnderskinError(f"the journal {self._path} cannot be written: {error.strerror}") from error

    def _replace(self) -> None:
        part = self._path.with_name(f"{NAME}.part")
        with part.open("w", encoding="utf-8") as journal:
            _write(journal, [_HEADING, *map(_line, self._entries)])
        part.replace(self._path)
        folder = os.open(self._path.parent, os.O_RDONLY)
        try:
            with suppress(OSError):  # of a network share, which may not have it
                os.fsync(folder)  # which holds the name
        finally:
            os.close(folder)

    def _read(self) -> list[Entry]:
        try:
            text = self._path.read_text(encoding="utf-8")
            if text.startswith(_HEADING):
                *lines, unfinished = text.removeprefix(_HEADING).split("\n")
                self._has_whole_lines = not unfinished
                return [Entry(**json.loads(line)) for line in lines]
            document: Any = json.loads(text)
            if document["schema"] != _FIRST_SCHEMA:
                raise ValueError(f"it is {document['schema']}, not {_SCHEMA}")
            return [Entry(**entry) for entry in document["entries"]]
        except FileNotFoundError:
            return []
        except (OSError, ValueError, KeyError, TypeError) as error:
            self.close()
            again = "move it away; what was sent is sent again then, and kept once"
            raise UnderskinError(f"the journal {self._path} cannot be read: {error}; {again}") from error


def _line(entry: Entry) -> str:
    return json.dumps(asdict(entry)) + "\n"  # in ASCII: a name may hold letters that have no encoding


def _write(journal: TextIO, lines: Iterable[str]) -> None:
    """Write lines, onto the disk."""
    journal.writelines(lines)
    journal.flush()
    os.fsync(journal.fileno())
