"""Sending what is complete in a folder: once each, again after an outage, never again what was refused."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import Any

from underskin.client.content_key import content_key, content_sha256
from underskin.client.service_client import Client
from underskin.client.watch.folder import WatchedFolder
from underskin.client.watch.journal import Journal, Target
from underskin.errors import ServiceError, Unreachable
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.readers.parsing_limits import MEMORY_MB, SECONDS

LOOK_S = 1.0  # between two looks at the folder
_LONGEST_WAIT_S = 60.0  # between two tries of an outage
# Answers that are about what was sent; any other failure is the service's, the network's or the key's, and may pass.
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

    `kept` is called with the file's name and the results once they are in the journal, `told` with what else happens:
    whether it is well, and the words. All methods raise UnderskinError where the journal cannot be written.
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
        kept: Callable[[str, Results], object],
        told: Callable[[bool, str], object],
    ) -> None:
        self._client, self._folder, self._journal = client, folder, journal
        self._url, self._skin, self._rig, self._estimator = url, skin, rig, estimator
        self._kept, self._told = kept, told
        self._outage_s = 0.0  # to wait before the next try; 0 while all is well
        self._unopened: set[Path] = set()  # of which was told that they cannot be opened or looked at

    def step(self) -> float:
        """Send what is complete; the seconds to wait until the next step."""
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
            known = self._journal.known(target, sha256)
            if known is not None:
                if known.file != name:
                    self._told(True, f"{name}: has the content of {known.file}, and is not sent")
                self._folder.done(path)
            elif self._folder.is_complete(path):
                self._send(path, name, target, sha256)
        except FileNotFoundError:  # renamed meanwhile: found by its new name
            return
        except OSError as error:
            self._cannot_be("opened", path, error)
            self._folder.postpone(path)

    def _send(self, path: Path, name: str, target: Target, sha256: str) -> None:
        terms: dict[str, Any] = {
            "skin": self._skin,
            "rig": self._rig,
            "estimator": self._estimator,
            "all_or_nothing": False,
            "together": None,
        }
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
            self._kept(name, results)
        elif unchanged:
            self._told(False, f"{name}: {refusal}; it is left, and sent again once it has changed")

    def _retry_later(self, path: Path, name: str, error: ServiceError) -> None:
        """Leave a file that may be taken another time; it is not in the journal, so that a restart sends it again."""
        self._goes_on()
        wait_s = self._folder.retry_later(path)
        left = "it is left, and sent again once it has changed or at the next start"
        self._told(False, f"{name}: {error}; {left if wait_s is None else f'it is sent again in {wait_s:.0f} s'}")

    def _cannot_be(self, what: str, path: Path, error: OSError) -> None:
        """Tell once of a file or folder that cannot be read or opened."""
        if path not in self._unopened:
            self._unopened.add(path)
            name = path.relative_to(self._folder.path)
            self._told(False, f"{name}: cannot be {what}: {error.strerror}; it is tried again")

    def _target(self) -> Target:
        rig = None if self._rig is None else content_sha256(self._rig)
        terms = hashlib.sha256(repr([rig, self._estimator]).encode()).hexdigest()
        return Target(self._url, self._skin, terms)

    def _outage(self, error: Exception) -> float:
        """Wait longer from try to try; told at the first one."""
        if not self._outage_s:
            self._told(False, f"{error}; it is tried again until that is over")
        self._outage_s = min(2 * self._outage_s, _LONGEST_WAIT_S) or LOOK_S
        return self._outage_s

    def _goes_on(self) -> None:
        if self._outage_s:
            self._told(True, "sending goes on")
        self._outage_s = 0.0


def _may_pass(error: ServiceError) -> bool:
    """Whether a refusal of a file may be another one next time: by a proxy, for its size, or since reading it took
    longer or more memory than a busy server had."""
    if error.is_foreign or error.status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
        return True
    return any(setting in entry["allowed"] for entry in error.problem["errors"] for setting in (SECONDS, MEMORY_MB))
