"""A watched folder: its complete files are sent to the service once each, again after an outage, never after a refusal.

Instruments write for a while and leave temporary files; a file is complete when it no longer changes. The journal,
`.underskin-watch.json` in the folder, holds a line for its schema and one for each content that was sent or refused,
appended; an unfinished last line after a power cut is ignored. A file without an entry is sent again, which the
service answers as before and stores once, as long as name, rig and estimator are the same.
"""

import fcntl
import hashlib
import json
import os
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from http import HTTPStatus
from pathlib import Path
from typing import Any, TextIO

from underskin.client.campaigns import content_key, content_sha256
from underskin.client.service_client import Client
from underskin.errors import FileError, ServiceError, UnderskinError, Unreachable
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.readers.parsing_limits import MEMORY_MB, SECONDS
from underskin.recordings.reading import read_contents

_PATIENCE = 12  # times as long as a file must be unchanged, before one that no reader opens is taken as it is
_RETRIES = 5  # of a file whose refusal may pass
_LONGER = 4  # times the last wait is the next one
_TEMPORARY = (".part", ".partial", ".tmp", ".temp", ".crdownload", ".lock", "~")
_INDEX_FILES = (".tdms_index",)  # LabVIEW's index of a file, without data


@dataclass
class _FileState:
    """The last observed version of a file (time of change and size), since when (monotonic, s), whether a reader opens
    it, how often it was postponed, and until when."""

    version: tuple[int, int]
    since: float
    opens: bool | None = None
    retries: int = 0
    not_before: float = 0.0
    done: bool = False


class WatchedFolder:
    """The files of a folder and its subfolders; hidden, temporary and empty ones are left out.

    A file is complete when its size and its time have not changed for `settle_s` and a reader of its format opens
    it; one that no reader opens is complete after a further while, so that the service can report its error.
    """

    def __init__(self, path: Path, settle_s: float) -> None:
        self.path = path
        self._settle_s = settle_s
        self._states: dict[Path, _FileState] = {}
        self.unreadable: dict[Path, OSError] = {}  # skipped by `settled`

    def settled(self) -> list[Path]:
        """Files that no longer change and are not done, the oldest first; OSError where the folder is gone."""
        now = time.monotonic()
        states = {}
        self.unreadable = {}
        for path, status in self._files():
            state = self._states.get(path)
            if state is None or state.version != _version(status):
                state = _FileState(_version(status), now)
            states[path] = state
        self._states = states
        settled = [
            path
            for path, state in states.items()
            if not state.done and now - state.since >= self._settle_s and now >= state.not_before
        ]
        return sorted(settled, key=lambda path: states[path].version)

    def is_complete(self, path: Path) -> bool:
        """Whether a settled file is complete."""
        state = self._states[path]
        if state.opens is None:
            state.opens = _opens(path)
        return state.opens or time.monotonic() - state.since >= (1 + _PATIENCE) * self._settle_s

    def is_unchanged(self, path: Path) -> bool:
        """Whether a file is as it was when it settled."""
        try:
            return _version(path.stat()) == self._states[path].version
        except OSError:
            return False

    def done(self, path: Path) -> None:
        """Ignore a file until it changes."""
        self._states[path].done = True

    def postpone(self, path: Path) -> None:
        """Treat a file as just changed."""
        self._states[path].since = time.monotonic()

    def retry_later(self, path: Path) -> float | None:
        """Leave a file for a while, longer each time; the delay (s), or None after the last retry: the file is done."""
        state = self._states[path]
        if state.retries == _RETRIES:
            self.done(path)
            return None
        wait_s = self._settle_s * _PATIENCE * float(_LONGER**state.retries)
        state.retries += 1
        state.not_before = time.monotonic() + wait_s
        return wait_s

    def _files(self) -> Iterator[tuple[Path, os.stat_result]]:
        for folder, folders, names in os.walk(self.path, onerror=self._leave_out):
            folders[:] = [name for name in folders if not name.startswith(".")]
            for name in names:
                if name.startswith(".") or name.lower().endswith((*_TEMPORARY, *_INDEX_FILES)):
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
        """Skip a file or folder; raises the error where it is the watched folder itself."""
        path = Path(error.filename)
        if path == self.path:
            raise error
        if not isinstance(error, FileNotFoundError):  # a folder that was renamed meanwhile
            self.unreadable[path] = error


def _version(status: os.stat_result) -> tuple[int, int]:
    return status.st_mtime_ns, status.st_size


def _opens(path: Path) -> bool:
    try:
        read_contents(path, path.name)
    except FileError:
        return False
    return True


NAME = ".underskin-watch.json"
_LOCK = ".underskin-watch.lock"
_SCHEMA = "watch/2"
_HEADING = json.dumps({"schema": _SCHEMA}) + "\n"


@dataclass(frozen=True)
class JournalEntry:
    """The outcome of a content (its SHA-256) at a service, for a skin: the ids of its campaigns, none where it was
    refused. `terms` is a digest of rig and estimator, with which a refused content may become valid."""

    sha256: str
    file: str
    url: str
    skin: str
    terms: str
    campaigns: Sequence[str]
    at: str


@dataclass(frozen=True)
class Target:
    """The service and skin that contents are sent to, and the digest `terms` (see `JournalEntry`)."""

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

    def find(self, target: Target, sha256: str) -> JournalEntry | None:
        """The entry of a content: sent for this skin, or refused on these terms; None without one."""
        for record in reversed(self._entries):
            same = (record.sha256, record.url, record.skin) == (sha256, target.url, target.skin)
            if same and (record.campaigns or record.terms == target.terms):
                return record
        return None

    def add(self, target: Target, sha256: str, file: str, campaigns: Sequence[str]) -> None:
        """Record the outcome of a content; it is on the disk afterwards. Raises UnderskinError."""
        at = datetime.now(UTC).isoformat(timespec="seconds")
        self._entries.append(JournalEntry(sha256, file, target.url, target.skin, target.terms, list(campaigns), at))
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

    def _read(self) -> list[JournalEntry]:
        try:
            text = self._path.read_text(encoding="utf-8")
            if not text.startswith(_HEADING):
                raise ValueError(f"it is no {_SCHEMA}")
            *lines, unfinished = text.removeprefix(_HEADING).split("\n")
            self._has_whole_lines = not unfinished
            return [JournalEntry(**json.loads(line)) for line in lines]
        except FileNotFoundError:
            return []
        except (OSError, ValueError, TypeError) as error:
            self.close()
            advice = "move it away; what was sent is sent again then, and kept once"
            raise UnderskinError(f"the journal {self._path} cannot be read: {error}; {advice}") from error


def _line(record: JournalEntry) -> str:
    return json.dumps(asdict(record)) + "\n"  # in ASCII: a name may hold letters that have no encoding


def _write(journal: TextIO, lines: Iterable[str]) -> None:
    """Write lines, and flush them to the disk."""
    journal.writelines(lines)
    journal.flush()
    os.fsync(journal.fileno())


LOOK_S = 1.0  # between two looks at the folder
_LONGEST_WAIT_S = 60.0  # between two tries of an outage
# Refusals of the file; any other failure is of the service, the network or the key, and may be temporary.
_OF_THE_FILE = frozenset(
    {
        HTTPStatus.BAD_REQUEST,
        HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
        HTTPStatus.UNSUPPORTED_MEDIA_TYPE,
        HTTPStatus.UNPROCESSABLE_ENTITY,
    }
)

Results = Sequence[Mapping[str, Any]]


class Watcher:
    """Sends the complete files of a folder to a service, for a skin.

    `on_stored` is called with the file's name and the results once they are in the journal, `on_message` with other
    events: whether all is well, and the text. All methods raise UnderskinError where the journal cannot be written.
    """

    def __init__(
        self,
        client: Client,
        folder: WatchedFolder,
        journal: Journal,
        *,
        url: str,
        skin: str,
        rig: Path | None,
        estimator: Estimator | None,
        on_stored: Callable[[str, Results], object],
        on_message: Callable[[bool, str], object],
    ) -> None:
        self._client, self._folder, self._journal = client, folder, journal
        self._url, self._skin, self._rig, self._estimator = url, skin, rig, estimator
        self._on_stored, self._on_message = on_stored, on_message
        self._outage_s = 0.0  # to wait before the next try; 0 while all is well
        self._unopened: set[Path] = set()  # reported as unreadable

    def step(self) -> float:
        """Send complete files; returns the seconds to wait until the next step."""
        try:
            target = self._target()
            settled = self._folder.settled()
            for path, reason in self._folder.unreadable.items():
                self._cannot_be("read", path, reason)
            for path in settled:
                if self._rig is None or path.resolve() != self._rig.resolve():
                    self._take(path, target)
        except (ServiceError, Unreachable, OSError) as error:
            return self._outage(error)
        self._goes_on()
        return LOOK_S

    def _take(self, path: Path, target: Target) -> None:
        """Send one file, if it is complete and new; raises ServiceError, Unreachable for an outage."""
        name = str(path.relative_to(self._folder.path))
        try:
            sha256 = content_sha256(path)
            record = self._journal.find(target, sha256)
            if record is not None:
                if record.file != name:
                    self._on_message(True, f"{name}: has the content of {record.file}, and is not sent")
                self._folder.done(path)
            elif self._folder.is_complete(path):
                self._send(path, name, target, sha256)
        except FileNotFoundError:  # renamed meanwhile: found by its new name
            return
        except OSError as error:
            self._cannot_be("opened", path, error)
            self._folder.postpone(path)

    def _send(self, path: Path, name: str, target: Target, sha256: str) -> None:
        terms: dict[str, Any] = {"skin": self._skin, "rig": self._rig, "estimator": self._estimator}
        key = content_key([path], terms)
        if not self._folder.is_unchanged(path):  # since it was listed, others were sent and this one was read
            return
        results: Results = []
        refusal = ""
        try:
            results = self._client.campaigns.post_files([path], **terms, idempotency_key=key)
        except ServiceError as error:
            if error.status not in _OF_THE_FILE:
                raise
            if _may_pass(error):
                self._retry_later(path, name, error)
                return
            refusal = str(error)
        self._goes_on()
        unchanged = self._folder.is_unchanged(path)  # else what it is now is sent once it is complete
        if unchanged:
            self._journal.add(target, sha256, name, [result["id"] for result in results if result["id"] is not None])
            self._folder.done(path)
        if results:
            self._on_stored(name, results)
        elif unchanged:
            self._on_message(False, f"{name}: {refusal}; it is left, and sent again once it has changed")

    def _retry_later(self, path: Path, name: str, error: ServiceError) -> None:
        """Leave a file that may be accepted later; it is not in the journal, so a restart sends it again."""
        self._goes_on()
        wait_s = self._folder.retry_later(path)
        instruction = "it is left, and sent again once it has changed or at the next start"
        self._on_message(
            False, f"{name}: {error}; {instruction if wait_s is None else f'it is sent again in {wait_s:.0f} s'}"
        )

    def _cannot_be(self, what: str, path: Path, error: OSError) -> None:
        """Report once that a file or folder cannot be read or opened."""
        if path not in self._unopened:
            self._unopened.add(path)
            name = path.relative_to(self._folder.path)
            self._on_message(False, f"{name}: cannot be {what}: {error.strerror}; it is tried again")

    def _target(self) -> Target:
        rig = None if self._rig is None else content_sha256(self._rig)
        terms = hashlib.sha256(repr([rig, self._estimator]).encode()).hexdigest()
        return Target(self._url, self._skin, terms)

    def _outage(self, error: Exception) -> float:
        """The wait, longer from try to try; reported at the first."""
        if not self._outage_s:
            self._on_message(False, f"{error}; it is tried again until that is over")
        self._outage_s = min(2 * self._outage_s, _LONGEST_WAIT_S) or LOOK_S
        return self._outage_s

    def _goes_on(self) -> None:
        if self._outage_s:
            self._on_message(True, "sending goes on")
        self._outage_s = 0.0


def _may_pass(error: ServiceError) -> bool:
    """Whether a refusal may be temporary: by a proxy, for size, or for time or memory of a busy server."""
    if error.is_foreign or error.status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
        return True
    return any(
        setting in error_entry["allowed"] for error_entry in error.problem["errors"] for setting in (SECONDS, MEMORY_MB)
    )
