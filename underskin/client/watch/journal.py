"""The journal of a watched folder: what became of each content that was sent, kept in the folder itself.

`.underskin-watch.json` is replaced whole, so that it is never half written. A file without an entry is sent again,
which the service answers as before and keeps once, as long as name, rig and estimator are the same.
"""

import fcntl
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from underskin.errors import UnderskinError

NAME = ".underskin-watch.json"
_LOCK = ".underskin-watch.lock"
_SCHEMA = "watch/1"


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
        document = {"schema": _SCHEMA, "entries": list(map(asdict, self._entries))}
        text = json.dumps(document, indent=1)  # in ASCII: a name may hold letters that have no encoding
        part = self._path.with_name(f"{NAME}.part")
        try:
            with part.open("w", encoding="utf-8") as written:
                written.write(text)
                written.flush()
                os.fsync(written.fileno())
            part.replace(self._path)
        except OSError as error:
            raise UnderskinError(f"the journal {self._path} cannot be written: {error.strerror}") from error

    def _read(self) -> list[Entry]:
        try:
            document: Any = json.loads(self._path.read_text(encoding="utf-8"))
            if document["schema"] != _SCHEMA:
                raise ValueError(f"it is {document['schema']}, not {_SCHEMA}")
            return [Entry(**entry) for entry in document["entries"]]
        except FileNotFoundError:
            return []
        except (OSError, ValueError, KeyError, TypeError) as error:
            again = "move it away; what was sent is sent again then, and kept once"
            raise UnderskinError(f"the journal {self._path} cannot be read: {error}; {again}") from error
