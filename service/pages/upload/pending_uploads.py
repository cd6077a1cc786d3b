"""Uploads that were read but not stored: each in a folder of its own, of one session, for an hour.

They lie in the server's folder of uploads, which is removed with the server. A session has a few at a time, and all
together take at most the room of one upload; discarded ones are removed first, then the oldest.
"""

import hashlib
import secrets
import shutil
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Depends, Request

from service.auth import session
from service.ingest.uploads import Upload
from service.pages.shared.figures import Drawn
from service.pages.upload.file_summary import FileSummary
from service.store import Missing
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.rig_description import RigDescription

if TYPE_CHECKING:
    from service.pages.upload.exported_skin import SkinSummary

LASTS_S = 3600.0
_MOST_UPLOADS = 50
_MOST_OF_SESSION = 5
_MOST_DRAWN = 6  # files whose figures are cached
_GONE = (
    "This upload is not here any more: an upload that is not kept goes after an hour, when room is needed for others, "
    "or when the server is restarted. Nothing of it was kept; send it again."
)


@dataclass(frozen=True)
class Remembered:
    """The origin of a rig description taken from earlier files: the instrument's name, when and by whom it was
    stored, its skin, and its file; None if unknown."""

    instrument: str | None
    kept_at: str
    kept_from: str | None = None
    skin: str | None = None
    file: str | None = None


@dataclass
class PendingUpload:
    """One upload, and what was read of it so far."""

    id: str
    session: str  # digest of the cookie
    folder: Path
    files: Sequence[Upload]
    size: int
    used: float
    shelf: "PendingUploads"  # which holds it
    skin: str | None = None
    rig: RigDescription | None = None
    rig_label: str | None = None  # the file that a request would send it as; None where none need be sent
    remembered: Remembered | None = None  # origin of `rig`, unless it was sent or entered in the form
    lacking: Remembered | None = None  # a stored rig description of the skin that needs channels which these files lack
    draft: dict[str, Any] | None = None  # the rig description as the form had it, usable or not
    of_files: Mapping[int, Mapping[str, str]] = field(default_factory=dict)  # typed values of single files
    refused: list[dict[str, Any]] = field(default_factory=list)  # errors of the form, or errors that prevented storing
    seen: list[FileSummary] = field(default_factory=list)
    drawn: dict[int, list[Drawn]] = field(default_factory=dict)
    estimator: Estimator | None = None  # of FRFs from time series, whatever files or rig say
    corrects: str | None = None  # the campaign that it replaces
    reason: str = ""  # why it does
    who: str = ""  # that says so, as typed
    skin_summary: "SkinSummary | None" = None  # where it is an exported skin
    negative: bool = False  # whether curves of it count pressing negative
    turned: bool = False  # whether those were turned
    kept_at: str | None = None  # the page of the stored data
    discarded: bool = False  # it can be taken back while it is here
    users: int = 0  # that read its files now
    given_up: bool = False  # whether its files are removed once nobody reads them
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def is_stale(self) -> bool:
        """Whether the form has invalid values, so that the reading does not correspond to it."""
        return self.draft is not None

    @property
    def is_depth_composed(self) -> bool:
        """Whether the displacement is computed from several channels: inverting the sum would invert each term."""
        mapping = None if self.rig is None else self.rig.channels.get("displacement_mm")
        if self.rig is None or mapping is None:
            return False
        formula = self.rig.derived.get(mapping.channel)
        return mapping.deflection is not None or (formula is not None and formula.is_sum)

    def start_afresh(self) -> None:
        """Forget the assignment of channels, also of earlier files."""
        self.rig = self.rig_label = self.draft = self.remembered = None
        self.turned, self.refused = False, []
        self.state_of_files({}, {})

    def state_of_files(self, typed: Mapping[int, Mapping[str, str]], values: Mapping[int, Mapping[str, Any]]) -> None:
        """Read single files by the fields of their recordings that were `typed`, which are these `values`."""
        self.of_files = typed
        self.files = [replace(file, said=values.get(number)) for number, file in enumerate(self.files)]

    def draw(self, number: int, figures: list[Drawn]) -> None:
        """Keep the figures of a file."""
        if len(self.drawn) >= _MOST_DRAWN:
            self.drawn.pop(next(iter(self.drawn)))
        self.drawn[number] = figures


class PendingUploads:
    """All uploads of this server that were read and not stored yet."""

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self._folder = folder
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._held: dict[str, PendingUpload] = {}
        self._remover = ThreadPoolExecutor(1, "removes-uploads")

    def put(self, cookie: str, sent: Sequence[Upload]) -> PendingUpload:
        """Add the files of an upload; a session with too many loses the oldest, discarded ones first."""
        name = secrets.token_urlsafe(16)
        folder = self._folder / f"shelf-{name}"
        folder.mkdir()
        files = [replace(file, path=file.path.rename(folder / str(number))) for number, file in enumerate(sent)]
        size = sum(file.path.stat().st_size for file in files)
        added = PendingUpload(name, _digest(cookie), folder, files, size, time.monotonic(), self)
        with self._lock:
            gone = self._of_session(added.session)[_MOST_OF_SESSION - 1 :]
            for old in gone:
                del self._held[old.id]
            gone += self._swept(size)
            self._held[name] = added
        wait(self._remove_files(gone))
        return added

    def find(self, cookie: str, name: str) -> PendingUpload:
        """The session's own upload; raises Missing if it is gone or another's."""
        self._sweep()
        with self._lock:
            upload = self._held.get(name)
            if upload is None or upload.session != _digest(cookie):
                raise Missing(_GONE)
            upload.used = time.monotonic()
            return upload

    def waiting(self, cookie: str) -> list[PendingUpload]:
        """The session's own uploads that were neither stored nor discarded, the last used first."""
        return [held for held in self._not_stored(cookie) if not held.discarded]

    def discarded(self, cookie: str) -> list[PendingUpload]:
        """The session's own that were discarded and can be taken back, the one used last first."""
        return [held for held in self._not_stored(cookie) if held.discarded]

    def _not_stored(self, cookie: str) -> list[PendingUpload]:
        self._sweep()
        with self._lock:
            return [held for held in self._of_session(_digest(cookie)) if held.kept_at is None]

    @contextmanager
    def in_use(self, pending: PendingUpload) -> Iterator[None]:
        """While its files are read they stay, even if it is removed meanwhile. Raises Missing if they are gone."""
        with self._lock:
            if pending.given_up and not pending.users:
                raise Missing(_GONE if pending.kept_at is None else "There is no such file in this upload.")
            pending.users += 1
        try:
            yield
        finally:
            with self._lock:
                pending.users -= 1
            if pending.given_up:
                self._remove_files([pending])

    def empty(self, pending: PendingUpload) -> None:
        """Remove the files; the page that says where they went stays for a while."""
        self._remove_files([pending])
        pending.size = 0

    def remove(self, pending: PendingUpload) -> None:
        """Remove it whole."""
        with self._lock:
            self._held.pop(pending.id, None)
        self._remove_files([pending])

    def _of_session(self, session: str) -> list[PendingUpload]:
        of_session = [held for held in self._held.values() if held.session == session]
        return sorted(of_session, key=_worth, reverse=True)

    def _sweep(self) -> None:
        """Remove what is too old."""
        with self._lock:
            gone = self._swept(0)
        self._remove_files(gone)

    def _swept(self, coming: int) -> list[PendingUpload]:
        """Expired uploads and discarded ones, then the oldest, until there is room: dropped here, with their files
        still on disk."""
        gone = []
        by_age = sorted(self._held.values(), key=_worth)
        total = coming + sum(held.size for held in by_age)
        for held in by_age:
            too_old = time.monotonic() - held.used > LASTS_S
            if too_old or total > self._most_bytes or len(self._held) >= _MOST_UPLOADS:
                total -= held.size
                gone.append(self._held.pop(held.id))
        return gone

    def _remove_files(self, gone: Sequence[PendingUpload]) -> list[Future[None]]:
        """Remove each as soon as nobody reads it, in the background."""
        with self._lock:
            for upload in gone:
                upload.given_up = True
            unused = [upload.folder for upload in gone if not upload.users]
        return [self._remover.submit(shutil.rmtree, folder, ignore_errors=True) for folder in unused]


def _worth(held: PendingUpload) -> tuple[bool, float]:
    """The order in which uploads are removed."""
    return not held.discarded, held.used


def _digest(cookie: str) -> str:
    return hashlib.sha256(cookie.encode()).hexdigest()


def _upload(request: Request, upload_id: str) -> PendingUpload:
    """The upload of an address; raises Missing if it is not the session's own."""
    held: PendingUploads = request.app.state.pending_uploads
    return held.find(session.cookie_of(request), upload_id)


UploadOfSession = Annotated[PendingUpload, Depends(_upload)]


def _pending(upload: UploadOfSession) -> PendingUpload:
    """The same unless it was discarded; raises Missing if it was."""
    if upload.discarded:
        raise Missing("This upload was discarded. For an hour it can be taken back on the page “Upload”.")
    return upload


Pending = Annotated[PendingUpload, Depends(_pending)]
