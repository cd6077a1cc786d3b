"""Reads uploaded files as campaigns, with the errors in each."""

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import orjson

from service.ingest import instruments
from service.ingest.rig_words import template_sentence
from service.ingest.uploads import Upload
from service.middleware import json_bodies
from service.middleware.json_bodies import require_unique_keys
from service.problems import Refusal
from service.store import Database, skins
from underskin.errors import ErrorCode, FileError, InvalidInput, Mention, Requirement
from underskin.recordings import join
from underskin.recordings.campaign import Campaign, from_dict
from underskin.recordings.channels import Contents, Document
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.joined_files import files_to_join, is_of_another
from underskin.recordings.readers import formats
from underskin.recordings.reading import Reading, read_contents, understood
from underskin.recordings.rig_description import RigDescription

_BOM = b"\xef\xbb\xbf"
_UNLABELLED = "the upload"
_LISTED = ("code", "field", "value", "allowed")  # of an error

# Reading a campaign takes memory many times its size: few at a time, the others wait. What is kept as soon as it was
# read may wait for other writers, which what is only read must not.
READING_SLOTS = asyncio.Semaphore(2)
_KEEPING_SLOTS = asyncio.Semaphore(2)

MOST_CAMPAIGNS = 1000  # a request
MOST_RECORDINGS = 50_000  # a request, good or not
_MOST_ERRORS = 100  # listed of each campaign


@asynccontextmanager
async def keeping(store: Database) -> AsyncIterator[None]:
    """A slot for reading data that is stored at once; raises OperationalError if writers have just waited in vain."""
    async with _KEEPING_SLOTS:
        store.require_hope()
        yield


@dataclass(frozen=True)
class ReadCampaign:
    """A campaign as read, or the reason why it is rejected as a whole."""

    file: str | None
    reading: Reading | None = None
    errors: list[dict[str, Any]] = field(default_factory=list)
    by_rig: bool = False  # whether a rig description was needed to read it
    in_list: bool = False  # whether it came in a JSON list
    instrument: str | None = None  # that wrote the file, as `instruments.recognised` has it

    @property
    def recordings(self) -> int:
        """Number of recordings sent, valid or not."""
        if self.reading is None:
            return 0
        refused = {problem.recording for problem in self.reading.problems}
        return len(refused) + len(self.reading.campaign.recordings)

    def with_estimator(self, estimator: Estimator | None) -> "ReadCampaign":
        """The same with the FRFs of its time series estimated by this estimator."""
        return replace(self, reading=None if self.reading is None else self.reading.with_estimator(estimator))

    def with_curves_turned(self) -> "ReadCampaign":
        """The same with the sign of curves reversed that count pressing negative."""
        return replace(self, reading=None if self.reading is None else self.reading.with_curves_turned())


@dataclass(frozen=True)
class CheckedCampaign:
    """A checked campaign, None if it was rejected as a whole; `refused` has one entry per rejected recording."""

    file: str | None
    campaign: Campaign | None = None
    errors: list[dict[str, Any]] = field(default_factory=list)
    refused: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    by_rig: bool = False
    in_list: bool = False
    unlisted: int = 0  # errors beyond those listed
    instruments: tuple[str, ...] = ()  # that wrote its files


@dataclass(frozen=True)
class InspectedFile:
    """A file that was read but not stored: its format, its channels if any, and its campaigns."""

    kind: str
    contents: Contents | None
    campaigns: list[ReadCampaign]


def look(
    upload: Upload, rig: RigDescription | None, most_json_bytes: int, sent: Sequence[Upload] = ()
) -> InspectedFile:
    """The campaigns of a file, by its content, with its format and channels; JSON may hold one or a list of them.

    The other files of a recording, which the rig description names, are among those `sent` with it, each name once;
    they hold no campaign of their own.
    """
    beside = {other.label: other.path for other in sent if other.label is not None}
    label = upload.label or _UNLABELLED
    kind, contents = "", None
    try:
        with upload.path.open("rb") as stream:
            kind = formats.detect(stream, label)
        if kind == "JSON":
            return InspectedFile(kind, None, _read_json(upload, most_json_bytes))
        if rig is not None and rig.join is not None:
            if is_of_another(label, beside, rig.join):
                return InspectedFile(kind, None, [])
            _require_sent_once(label, [other.label for other in sent], rig.join)
        held = read_contents(upload.path, label, rig, beside)
        contents = held if isinstance(held, Contents) else None
        reading = _understood(held, label, rig, upload.said)
        _require_usable(reading.campaign)
        campaign = ReadCampaign(upload.label, reading, by_rig=rig is not None)
    except FileError as error:
        allowed = Requirement(Mention(error.place), ": ", error.reason) if error.place else error.reason
        campaign = ReadCampaign(upload.label, errors=[field_error("file", upload.label, allowed, error.code)])
    except InvalidInput as error:
        campaign = ReadCampaign(upload.label, errors=[_invalid(error)])
    instrument = None if contents is None else instruments.recognised(kind, contents)
    return InspectedFile(kind, contents, [replace(campaign, instrument=instrument)])


def _require_sent_once(label: str, sent: Sequence[str | None], join: tuple[str, tuple[str, ...]]) -> None:
    """Raise FileError where a name of the files of a recording is that of several files sent, of which none can be told
    to belong to it."""
    for file in (Path(label), *files_to_join(Path(label), join)):
        if sent.count(file.name) > 1:
            reason = f"{file.name} was sent twice, and is to be joined (join): send the folders one by one"
            raise FileError(label, "", reason)


def _understood(
    held: Contents | Document, label: str, rig: RigDescription | None, stated: Mapping[str, Any] | None
) -> Reading:
    """A file read by its rig description and by the values stated for this file alone, which are reported as a note."""
    if rig is None or not stated or not isinstance(held, Contents):
        return understood(held, label, rig)
    reading = understood(held, label, rig.with_recording(stated))
    return replace(reading, warnings=[template_sentence(stated), *reading.warnings])


def checked(read: ReadCampaign) -> CheckedCampaign:
    """A campaign with its rejected recordings; a campaign without a valid recording is rejected as a whole."""
    written_by = () if read.instrument is None else (read.instrument,)
    campaign_checked = CheckedCampaign(
        read.file, errors=read.errors, by_rig=read.by_rig, in_list=read.in_list, instruments=written_by
    )
    if read.reading is None:
        return campaign_checked
    campaign, notes = read.reading.campaign, read.reading.warnings
    refused: dict[str, list[Mapping[str, Any]]] = {}
    for number, problem in enumerate(read.reading.problems):
        errors = refused.setdefault(problem.recording, [])
        if number < _MOST_ERRORS:
            errors.append(field_error(problem.field, problem.value, problem.allowed, problem.code))
    count = len(read.reading.problems)
    unlisted = max(0, count - _MOST_ERRORS)
    if unlisted:
        notes = [*notes, f"{len(refused)} recordings have {count} errors; the first {_MOST_ERRORS} are listed"]
    entries = [{"id": name, "errors": errors} for name, errors in refused.items()]
    campaign_checked = replace(campaign_checked, refused=entries, notes=notes, unlisted=unlisted)
    if campaign.recordings:
        return replace(campaign_checked, campaign=campaign)
    return replace(campaign_checked, errors=[_nothing(len(entries))])


def joined(files_read: Sequence[ReadCampaign], name: str, skin_id: str | None) -> CheckedCampaign:
    """All files as one campaign; an unreadable file counts as a rejected recording with the file's name. Raises
    InvalidInput if the files are of several skins."""
    files = [(file.file or _UNLABELLED, file.reading) for file in files_read if file.reading is not None]
    unread = [{"id": file.file or _UNLABELLED, "errors": file.errors} for file in files_read if file.reading is None]
    in_list = files_read[0].in_list
    if not files:
        return CheckedCampaign(None, errors=[_nothing(len(unread))], refused=unread, in_list=in_list)
    by_rig = any(file.by_rig for file in files_read)
    together = checked(ReadCampaign(None, join(name, files, skin_id), by_rig=by_rig, in_list=in_list))
    origin = f"joined from {files[0][0]}" + (f" to {files[-1][0]}, {len(files)} files" if len(files) > 1 else "")
    written_by = tuple(dict.fromkeys(file.instrument for file in files_read if file.instrument is not None))
    notes = [origin, *together.notes]
    return replace(together, refused=unread + together.refused, notes=notes, instruments=written_by)


def require_few(campaigns: int, recordings: int) -> None:
    """Rejects a request with more recordings than one answer can hold."""
    for count, most, noun in ((campaigns, MOST_CAMPAIGNS, "campaigns"), (recordings, MOST_RECORDINGS, "recordings")):
        if count > most:
            raise Refusal(413, f"A request may bring up to {most} {noun}; send more in several requests.")


def _require_usable(campaign: Campaign) -> None:
    if campaign.skin.id is not None:
        skins.require_usable("skin.id", campaign.skin.id)


def _read_json(upload: Upload, most_bytes: int) -> list[ReadCampaign]:
    size = upload.path.stat().st_size
    if size > most_bytes:
        limit = f"{most_bytes / 1e6:g} MB (UNDERSKIN_MAX_BODY_MB)"
        raise Refusal(413, f"JSON may have up to {limit}; send more in several requests, or as HDF5.")
    try:
        document = _long_document(upload) if size > json_bodies.LONG_BYTES else _document(upload)
    except json_bodies.NotJson as wrong:
        if not upload.in_form:
            raise Refusal(400, f"The body is not JSON: {wrong}.") from None
        unreadable = field_error("file", upload.label, f"must be JSON; {wrong}", ErrorCode.UNREADABLE_FILE)
        return [ReadCampaign(upload.label, errors=[unreadable])]
    except Refusal as twice:
        if not twice.errors:
            raise
        errors = [{name: error[name] for name in _LISTED} for error in twice.errors]
        return [ReadCampaign(upload.label, errors=errors)]
    if not isinstance(document, list):
        require_few(1, _recordings_in(document))
        return [_checked(upload.label, document)]
    require_few(len(document), sum(map(_recordings_in, document)))
    return [replace(_checked(upload.label, campaign), in_list=True) for campaign in document]


def _document(upload: Upload) -> Any:
    content = upload.path.read_bytes().removeprefix(_BOM)
    try:
        document = orjson.loads(content)
    except orjson.JSONDecodeError as error:
        raise json_bodies.NotJson(f"line {error.lineno}, column {error.colno}: {error.msg}") from None
    require_unique_keys(content)
    return document


def _long_document(upload: Upload) -> Any:
    with upload.path.open("rb") as stream:
        return json_bodies.read(stream)


def _recordings_in(document: Any) -> int:
    recordings = document.get("recordings") if isinstance(document, dict) else None
    return len(recordings) if isinstance(recordings, list) else 0


def _checked(label: str | None, document: Any) -> ReadCampaign:
    try:
        campaign, problems = from_dict(document)
        _require_usable(campaign)
    except InvalidInput as error:
        return ReadCampaign(label, errors=[_invalid(error)])
    return ReadCampaign(label, Reading(campaign, problems, []))


def _nothing(refused: int) -> dict[str, Any]:
    return field_error(
        "recordings", f"{refused} refused", "must hold at least one recording without errors", ErrorCode.TOO_FEW
    )


def _invalid(error: InvalidInput) -> dict[str, Any]:
    return field_error(error.place, error.value, error.allowed, error.code)


def field_error(name: str, value: Any, allowed: str, code: ErrorCode) -> dict[str, Any]:
    """An error in the form of answers and pages."""
    return dict(zip(_LISTED, (str(code), name, value, allowed), strict=True))
