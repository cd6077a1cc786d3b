"""Campaigns and skins through the client: `client.campaigns` and `client.skins`.

Answers are the documents of the HTTP interface (docs/store.md, /openapi.json): their fields are attributes with
types, and as a mapping each is the JSON object itself (`underskin.client.documents`). An Idempotency-Key is computed
from names and contents of files, so that files sent twice are stored once.
"""

import hashlib
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar
from uuid import uuid4

import orjson

from underskin.client.documents import (
    D33,
    Asked,
    CampaignDetail,
    CampaignEntry,
    CampaignResult,
    Change,
    History,
    Imported,
    ModelEntry,
    ModelVersion,
    SkinDetail,
    SkinEntry,
)
from underskin.client.http_session import Resource, path_of
from underskin.errors import Unreachable, too_few
from underskin.recordings.campaign import Campaign, parse, to_dict
from underskin.recordings.frf.estimators import Estimator


def content_key(files: Sequence[Path], terms: Mapping[str, Any]) -> str:
    """A key that is the same for the same files and options; `terms` as `client.campaigns.post_files` takes them.

    Raises OSError where a file cannot be read.
    """
    inputs = [*files] if terms.get("rig") is None else [*files, Path(terms["rig"])]
    digests = [(file.name, content_sha256(file)) for file in inputs]
    options: list[Any] = [terms.get("skin"), terms.get("all_or_nothing", False), terms.get("together")]
    options.append(terms.get("rig") is None)
    # Later options only where given, so that keys of earlier versions stay valid.
    options += [(name, terms[name]) for name in ("corrects", "reason", "estimator") if terms.get(name) is not None]
    return f"content {hashlib.sha256(repr([options, digests]).encode()).hexdigest()}"


def label_of(file: Path) -> str:
    """The name under which a file is sent; undecodable letters become question marks."""
    return file.name.encode("utf-8", "replace").decode("utf-8")


def content_sha256(file: Path) -> str:
    """The digest of a file's content; raises OSError."""
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


class CountedFile(io.FileIO):
    """A file opened for reading; `progress` is called with the bytes of each read, and with less than 0 for a seek
    back."""

    def __init__(self, path: Path, progress: Callable[[int], object]) -> None:
        super().__init__(path)
        self._progress = progress

    def read(self, size: int | None = -1, /) -> Any:
        """As `FileIO.read`."""
        data = super().read(size)
        self._progress(len(data or b""))
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """As `FileIO.seek`: a repeated request starts at the beginning."""
        before = self.tell()
        position = super().seek(offset, whence)
        if whence == io.SEEK_SET and position != before:
            self._progress(position - before)
        return position


ModelName = Literal["paper", "adopted"]
Progress = Callable[[int], object]  # of bytes
_TRIES = 3
_path, _skin = partial(path_of, "campaigns"), partial(path_of, "skins")
_Answer = TypeVar("_Answer")


@dataclass(frozen=True, eq=False, kw_only=True)
class SentFile(CampaignResult):
    """The outcome of one campaign in files that were sent."""

    repeated: bool
    """Whether it had been stored before, under the same `idempotency_key`."""


def _uncounted(_: int) -> None:
    pass


class Campaigns(Resource):
    """Campaigns: send, read, withdraw, correct; exclude recordings; d33."""

    def post(
        self,
        campaign: Campaign | Mapping[str, Any],
        *,
        skin: str | None = None,
        corrects: str | None = None,
        reason: str | None = None,
        all_or_nothing: bool = False,
        estimator: Estimator | None = None,
        idempotency_key: str | None = None,
    ) -> CampaignResult:
        """Send a campaign, or its document; the answer says of each recording whether it was accepted.

        `estimator`: how FRFs are estimated from time series, whatever the campaign says.

        Without an answer the request is repeated up to three times under one `idempotency_key`, so the campaign is
        stored once. With a key of your own this holds also when your program is restarted.
        """
        document = to_dict(campaign) if isinstance(campaign, Campaign) else dict(campaign)
        content = orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)
        options = {"corrects": corrects, "reason": reason, "estimator": estimator}
        query = {"skin": skin, "all_or_nothing": all_or_nothing, **options}
        headers = {"Content-Type": "application/json", "Idempotency-Key": idempotency_key or uuid4().hex}

        def send() -> CampaignResult:
            answer = self._session.json("POST", "/v1/campaigns", query, headers=headers, content=content)
            return CampaignResult.from_json(answer)

        return _with_retries(send)

    def post_files(
        self,
        files: Sequence[str | Path],
        *,
        skin: str | None = None,
        rig: str | Path | None = None,
        corrects: str | None = None,
        reason: str | None = None,
        all_or_nothing: bool = False,
        together: str | None = None,
        estimator: Estimator | None = None,
        idempotency_key: str | None = None,
        progress: Progress = _uncounted,
    ) -> list[SentFile]:
        """Send files as written by instruments; the answer has one item per campaign. `rig` describes their channels.

        `together` joins the files, for instance one file for each press, into one campaign of that name. `estimator`
        is how FRFs are estimated from time series, whatever the files or the rig say. `progress` is called with the
        bytes of each part that was read to be sent, less than 0 where a request is repeated.
        """
        if not files:
            raise too_few("files", [], "must name at least one file")
        headers = {"Idempotency-Key": idempotency_key or uuid4().hex}
        options = {"corrects": corrects, "reason": reason, "together": together, "estimator": estimator}
        query = {"skin": skin, "all_or_nothing": all_or_nothing, **options}

        def send() -> list[SentFile]:
            with ExitStack() as opened:
                sources = [("file", Path(file), progress) for file in files]
                sources += [] if rig is None else [("rig", Path(rig), _uncounted)]
                parts = [
                    (name, (label_of(path), opened.enter_context(CountedFile(path, on_read))))
                    for name, path, on_read in sources
                ]
                answer, received = self._session.answered("POST", "/v1/campaigns", query, headers=headers, files=parts)
            repeated = "Idempotency-Replayed" in received
            return [SentFile.from_json({**result, "repeated": repeated}) for result in answer["campaigns"]]

        return _with_retries(send)

    def all(
        self,
        *,
        skin: str | None = None,
        state: str = "current",
        name_contains: str | None = None,
        recorded_from: str | None = None,
        recorded_to: str | None = None,
    ) -> Iterator[CampaignEntry]:
        """Campaigns, the latest arrival first, without their recordings."""
        filters = {"skin": skin, "name_contains": name_contains, "state": state}
        moments = {"recorded_from": recorded_from, "recorded_to": recorded_to}
        return self._session.pages(CampaignEntry, "campaigns", **filters, **moments)

    def get(self, campaign_id: str) -> CampaignDetail:
        """A campaign and its recordings, without their arrays."""
        return self._asked(CampaignDetail, "GET", _path(campaign_id))

    def load(self, campaign_id: str) -> Campaign:
        """A campaign as it was sent, with its arrays."""
        return parse(self._session.json("GET", _path(campaign_id, "document")))

    def d33(self, campaign_id: str, band_hz: tuple[float, float] | None = None, *, model: ModelName = "paper") -> D33:
        """d33 by sensor, indenter and preload, over the flat zone or a given band, and what is left out."""
        low, high = (None, None) if band_hz is None else band_hz
        query = {"band_low_hz": low, "band_high_hz": high, "model": model}
        return self._asked(D33, "GET", _path(campaign_id, "d33"), query)

    def withdraw(self, campaign_id: str, reason: str) -> CampaignDetail:
        """Exclude a campaign from all results; it can still be read."""
        return self._asked(CampaignDetail, "POST", _path(campaign_id, "withdraw"), json={"reason": reason})

    def exclude(self, campaign_id: str, recording: str, reason: str) -> CampaignDetail:
        """Exclude a recording from all results; it can still be read."""
        body = {"recording": recording, "reason": reason}
        return self._asked(CampaignDetail, "POST", _path(campaign_id, "exclusions"), json=body)

    def annotate(self, campaign_id: str, **fields: str | Sequence[str] | None) -> CampaignDetail:
        """Rename a campaign or change its notes or tags: `name`, `remark`, `tags`; what is not given stays."""
        return self._asked(CampaignDetail, "PATCH", _path(campaign_id), json=fields)

    def discard(self, campaign_id: str, reason: str) -> CampaignDetail:
        """Discard a trial that nothing builds on: withdrawn and in no list; it can still be read."""
        return self._asked(CampaignDetail, "POST", _path(campaign_id, "discard"), json={"reason": reason})

    def changes(self, campaign_id: str) -> list[Change]:
        """What was changed of a campaign, the latest first; `client.undo` takes a change back."""
        return list(map(Change.from_json, self._session.json("GET", _path(campaign_id, "changes"))["changes"]))


class Skins(Resource):
    """Skins: list, join, d33 over time, campaigns diagnosed together, adopted models, export."""

    def all(self, *, id_contains: str | None = None) -> Iterator[SkinEntry]:
        """Skins by id."""
        return self._session.pages(SkinEntry, "skins", id_contains=id_contains)

    def get(self, skin_id: str) -> SkinDetail:
        """A skin, and the skins that were joined to it."""
        return self._asked(SkinDetail, "GET", _skin(skin_id))

    def join(self, skin_id: str, other: str, reason: str) -> SkinDetail:
        """Count the skin `other` as `skin_id` from now on."""
        body = {"skin_id": other, "reason": reason}
        return self._asked(SkinDetail, "POST", _skin(skin_id, "join"), json=body)

    def annotate(self, skin_id: str, **fields: str | Sequence[str] | None) -> SkinDetail:
        """Name a skin or change its notes or tags: `title`, `remark`, `tags`; what is not given stays."""
        return self._asked(SkinDetail, "PATCH", _skin(skin_id), json=fields)

    def discard(self, skin_id: str, reason: str) -> SkinDetail:
        """Discard a skin without campaigns in use: in no list until a campaign arrives for it."""
        return self._asked(SkinDetail, "POST", _skin(skin_id, "discard"), json={"reason": reason})

    def changes(self, skin_id: str) -> list[Change]:
        """What was changed of a skin itself, the latest first; `client.undo` takes a change back."""
        return list(map(Change.from_json, self._session.json("GET", _skin(skin_id, "changes"))["changes"]))

    def history(self, skin_id: str, *, model: ModelName = "paper") -> History:
        """d33 of each sensor over time, its trend, and what is left out."""
        return self._asked(History, "GET", _skin(skin_id, "history"), {"model": model})

    def diagnose(
        self,
        skin_id: str,
        campaigns: Sequence[str] | None = None,
        name: str | None = None,
        *,
        without: Sequence[str] = (),
    ) -> Asked:
        """Start one diagnosis of several campaigns of the skin together; its `id` and `state`.

        Without `campaigns` it is of all that are in use. `name` is what the report is called, without one the skin's
        id. `without` as in `client.diagnoses.start`. The same request on campaigns that have not changed is answered
        with the diagnosis that there is.
        """
        body = {"campaigns": None if campaigns is None else list(campaigns), "name": name, "without": list(without)}
        return self._asked(Asked, "POST", _skin(skin_id, "diagnosis"), json=body)

    def adopt(self, skin_id: str, diagnosis_id: str) -> ModelEntry:
        """Adopt the model of an explained diagnosis for the skin; requests with the model `adopted` use it."""
        return self._asked(ModelEntry, "POST", _skin(skin_id, "model"), json={"diagnosis_id": diagnosis_id})

    def withdraw_model(self, skin_id: str, reason: str) -> ModelVersion:
        """Withdraw the adopted model; its version stays on record with date and reason."""
        return self._asked(ModelVersion, "DELETE", _skin(skin_id, "model"), {"reason": reason})

    def model(self, skin_id: str) -> ModelEntry:
        """The model in force, with the campaign and the evidence that it comes from."""
        return self._asked(ModelEntry, "GET", _skin(skin_id, "model"))

    def models(self, skin_id: str) -> list[ModelEntry]:
        """All models that the skin ever had, the latest adoption first."""
        answer = self._session.json("GET", _skin(skin_id, "model", "versions"))
        return [ModelEntry.from_json(version) for version in answer["models"]]

    def export(self, skin_id: str, file: str | Path, progress: Progress = _uncounted) -> None:
        """Write everything stored of a skin into one HDF5 file; `progress` is called with the bytes of each chunk."""
        part = Path(file).with_name(Path(file).name + ".part")
        try:
            with self._session.stream("GET", _skin(skin_id, "export")) as response, part.open("wb") as target:
                for chunk in response.iter_bytes():
                    target.write(chunk)
                    progress(len(chunk))
            part.replace(file)
        finally:
            part.unlink(missing_ok=True)

    def load(self, file: str | Path, progress: Progress = _uncounted) -> Imported:
        """Import a file that `export` wrote; `progress` is called with the bytes of each part that is sent."""
        headers = {"Content-Type": "application/octet-stream"}
        with CountedFile(Path(file), progress) as source:
            return self._asked(Imported, "POST", "/v1/skins/import", headers=headers, content=source)


def _with_retries(send: Callable[[], _Answer]) -> _Answer:
    """Repeat a request, under its one Idempotency-Key, until an answer comes; three times at most."""
    for _ in range(_TRIES - 1):
        try:
            return send()
        except Unreachable:
            continue
    return send()
