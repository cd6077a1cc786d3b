"""Stores the campaigns of uploads in one transaction; a repeated request gets the earlier answer."""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray
from sqlalchemy import Connection

from service.ingest import instruments, repeats
from service.ingest.reading import CheckedCampaign, ReadCampaign, checked, joined, look, require_few
from service.ingest.rig_words import rig_sentences
from service.ingest.uploads import Upload
from service.problems import Refusal
from service.settings import Settings
from service.store import Database, answers, campaigns, instrument_templates, skins
from underskin.errors import FileError, InvalidInput, SeveralInvalid, conflicting, errors_of, required
from underskin.findings.formatting import grouped_by_reason, recordings_called, why_refused
from underskin.recordings import plausibility, validation
from underskin.recordings.campaign import Campaign
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.rig_description import LARGEST_BYTES, RigDescription, from_dict
from underskin.recordings.rig_description import parse as parse_rig

RIG = "rig"  # name of the form's part that is a rig description
_MOST_ERRORS = 100  # in the problem of a request of which nothing is stored
_MOST_LISTED_ERRORS = 3  # of them in its sentence


class HeldArrays:
    """Total size of the arrays of the campaigns read so far; at most `most_bytes`."""

    def __init__(self, most_bytes: int) -> None:
        """Nothing was read yet."""
        self._most_bytes = most_bytes
        self._bytes = 0
        self._counted: set[int] = set()  # arrays that own their numbers: recordings may share one, or parts of it

    def add(self, campaigns: Iterable[ReadCampaign]) -> None:
        """Add the arrays of a campaign; raises Refusal (413) beyond the limit."""
        for array in _arrays(campaigns):
            owner = array
            while isinstance(owner.base, np.ndarray):
                owner = owner.base
            if id(owner) not in self._counted:
                self._counted.add(id(owner))
                self._bytes += owner.nbytes
        if self._bytes > self._most_bytes:
            raise Refusal(
                413,
                f"Unfolded, the files have more than the {self._most_bytes / 1e6:g} MB that one request may bring: "
                "four times UNDERSKIN_MAX_UPLOAD_MB, or UNDERSKIN_READING_MEMORY_MB where that is more. Send them in "
                "several requests, or raise UNDERSKIN_MAX_UPLOAD_MB. Nothing was kept.",
            )


def _arrays(campaigns: Iterable[ReadCampaign]) -> Iterator[NDArray[np.generic]]:
    for campaign in campaigns:
        if campaign.reading is not None:
            for recording in campaign.reading.campaign.recordings:
                yield from (value for value in vars(recording).values() if isinstance(value, np.ndarray))


@dataclass(frozen=True)
class IngestOptions:
    """Options of an upload request."""

    settings: Settings
    sender: str | None
    skin: str | None = None
    corrects: str | None = None
    reason: str | None = None
    all_or_nothing: bool = False
    together: str | None = None
    idempotency_key: str | None = None
    estimator: Estimator | None = None
    turn_curves: bool = False  # that count pressing negative
    use_stored_rig: bool = True  # whether the stored rig description of the skin is used if none is sent
    signed: str | None = None  # who corrects a campaign, as typed on a page; None: the sender

    def __post_init__(self) -> None:
        """Raises InvalidInput."""
        if (self.corrects is None) != (self.reason is None):
            missing = "reason" if self.reason is None else "corrects"
            raise required(missing, "corrects and reason go together")
        if self.skin is not None:
            skins.require_usable("skin", self.skin)
        if self.together is not None:
            validation.name("together", self.together, False)

    def request(self, uploads: Sequence[Upload]) -> answers.KnownRequest | None:
        """Identity of this request, by which a repetition is recognised."""
        if self.idempotency_key is None:
            return None
        options: list[Any] = [self.skin, self.corrects, self.reason, self.all_or_nothing]
        if self.together is not None:  # otherwise as it always was: keys hold for as long as the store
            options.append(self.together)
        if self.estimator is not None:
            options.append({"estimator": self.estimator})
        sent = [[upload.field, upload.label, upload.sha256] for upload in uploads]
        digest = hashlib.sha256(repr([options, sent]).encode()).hexdigest()
        return answers.KnownRequest(self.sender or "", self.idempotency_key, digest)


def accept(store: Database, uploads: Sequence[Upload], options: IngestOptions) -> tuple[dict[str, Any], bool]:
    """Store the valid campaigns. Returns a CampaignResult, or a BatchResult for a form or a list, and whether the
    request is a repetition. Raises Refusal if nothing is stored."""
    request = options.request(uploads)
    if request is not None:
        before = store.read(answers.replayed, request)
        if before is not None:
            return dict(before), True
    rig = _rig(store, uploads, options)
    arrived = _arrived(uploads, rig, options)
    _require_keepable(arrived, options)

    def keep(connection: Connection) -> dict[str, Any]:
        results = [_store_campaign(connection, campaign, options, rig) for campaign in arrived]
        return {"campaigns": results} if uploads[0].in_form or arrived[0].in_list else results[0]

    return store.write(answers.once, request, keep)


def _rig(store: Database, uploads: Sequence[Upload], options: IngestOptions) -> RigDescription | None:
    """The rig description of the request, or else the one stored with the skin or the corrected campaign."""
    for upload in uploads:
        if upload.field == RIG:
            try:
                return sent_rig(upload)
            except FileError as error:
                raise error.of_field(RIG, upload.label) from None
            except InvalidInput as error:
                label = f"{upload.label}: " if upload.label else f"{RIG}."
                raise SeveralInvalid([invalid.at(f"{label}{invalid.field}") for invalid in errors_of(error)]) from None
    if not options.use_stored_rig:
        return None
    with store.reading() as connection:
        names = [options.skin] if options.skin is not None else []
        if options.corrects is not None:
            names.append(campaigns.find(connection, options.corrects).skin_id)
        rigs = (stored_rig(connection, name) for name in names)
        return next((rig for rig in rigs if rig is not None), None)


def sent_rig(upload: Upload) -> RigDescription:
    """The rig description in an uploaded file; raises FileError, InvalidInput."""
    size = upload.path.stat().st_size
    if size > LARGEST_BYTES:
        raise FileError(upload.label or RIG, "", f"has {size} bytes; a rig description may have up to {LARGEST_BYTES}")
    return parse_rig(upload.start(LARGEST_BYTES), upload.label or RIG)


def stored_rig(connection: Connection, skin_id: str) -> RigDescription | None:
    """The rig description stored with a skin."""
    document = skins.rig_of(connection, skin_id)
    return None if document is None else from_dict(orjson.loads(document))


def _arrived(uploads: Sequence[Upload], rig: RigDescription | None, options: IngestOptions) -> list[CheckedCampaign]:
    """The campaigns of all files; a single one if the files belong together."""
    files: list[ReadCampaign] = []
    recordings = 0
    held = HeldArrays(options.settings.max_unfolded_bytes)
    for upload in uploads:
        if upload.field != RIG:
            more = look(upload, rig, options.settings.max_body_bytes, uploads).campaigns
            more = [file.with_curves_turned() for file in more] if options.turn_curves else more
            files += [file.with_estimator(options.estimator) for file in more]
            held.add(more)
            recordings += sum(file.recordings for file in more)
            require_few(len(files), recordings)
    if options.together is None or not files:
        return [checked(file) for file in files]
    return [joined(files, options.together, options.skin)]


def _require_keepable(arrived: Sequence[CheckedCampaign], options: IngestOptions) -> None:
    good = [campaign_file for campaign_file in arrived if campaign_file.campaign is not None]
    if options.corrects is not None and len(arrived) > 1:
        raise conflicting("corrects", options.corrects, f"needs one campaign in its place, not {len(arrived)}")
    spoilt = any(campaign_file.campaign is None or campaign_file.refused for campaign_file in arrived)
    if good and not (options.all_or_nothing and spoilt):
        return
    errors = [error for campaign_file in arrived for error in _flat(campaign_file, many=len(arrived) > 1)]
    raise Refusal(422, _in_words(arrived), title="Invalid input", errors=errors[:_MOST_ERRORS])


def _in_words(arrived: Sequence[CheckedCampaign]) -> str:
    """The first errors in words; equal errors of many recordings are merged."""
    messages = [line for file in arrived for line in _lines(file)]
    if not messages:
        return "No campaign was sent."
    more = max(0, len(messages) - _MOST_LISTED_ERRORS) + sum(file.unlisted for file in arrived)
    return "; ".join(
        [f"Nothing was kept: {messages[0]}", *messages[1:_MOST_LISTED_ERRORS], *([f"and {more} more"] if more else [])]
    )


def _lines(campaign: CheckedCampaign) -> list[str]:
    file = f"{campaign.file}: " if campaign.file else ""
    alike = grouped_by_reason(
        (refused["id"], why_refused(error)) for refused in campaign.refused for error in refused["errors"]
    )
    lines = [f"{file}{recordings_called(names)}: {why}" for names, why in alike]
    return lines or [f"{file}{why_refused(error)}" for error in campaign.errors]


def _flat(campaign: CheckedCampaign, *, many: bool) -> list[dict[str, Any]]:
    """All errors of a campaign, in the form of a problem document."""
    prefix = f"{campaign.file}: " if many and campaign.file else ""
    placed = [
        (f"{_recording_prefix(refused['id'])}.", error) for refused in campaign.refused for error in refused["errors"]
    ]
    if not placed:  # or they say no more than that every recording is refused
        placed = [("", error) for error in campaign.errors]
    return [
        {**error, "index": None, "field": f"{prefix}{prefix_of_recording}{error['field']}"}
        for prefix_of_recording, error in placed
    ]


def _recording_prefix(recording: str) -> str:
    return recording if recording.startswith("recordings[") else f"recordings[{recording}]"


def _store_campaign(
    connection: Connection, checked: CheckedCampaign, options: IngestOptions, rig: RigDescription | None
) -> dict[str, Any]:
    campaign = checked.campaign
    notes = [*(rig_sentences(rig) if checked.by_rig and rig is not None else []), *checked.notes]
    refused = [{"id": refusal["id"], "status": "refused", "errors": refusal["errors"]} for refusal in checked.refused]
    result: dict[str, Any] = {"file": checked.file, "errors": checked.errors, "notes": notes, "findings": []}
    if campaign is None:
        return {**result, "status": "refused", "id": None, "skin_id": None, "recordings": refused}
    result["findings"] = [finding.sentence for finding in plausibility.at_reading(campaign)]
    notes += [*_of_corrected(connection, campaign, options), *_repeats(connection, campaign, options)]
    corrected_from = options.signed or options.sender
    arrival = campaigns.NewCampaign(
        campaign, options.skin, refused, notes, checked.file, options.sender, corrected_from
    )
    campaign_id, skin_id = campaigns.add(connection, arrival, corrects=options.corrects, reason=options.reason)
    if checked.by_rig and rig is not None:
        skins.keep_rig(connection, skin_id, instruments.of_skin(rig))
        for instrument in checked.instruments:
            instrument_templates.keep(connection, instrument, instruments.template_of(rig), options.sender)
    stored = [{"id": recording.id, "status": "ok", "errors": []} for recording in campaign.recordings]
    return {**result, "status": "ok", "id": campaign_id, "skin_id": skin_id, "recordings": stored + refused}


def _of_corrected(connection: Connection, campaign: Campaign, options: IngestOptions) -> list[str]:
    """Notes on a correction that changes nothing, or that names another skin than the corrected campaign's."""
    same = repeats.changes_nothing(connection, campaign, options.skin, options.corrects)
    notes = ["it says the same as the campaign that it corrects"] if same else []
    stored_skin = None if options.skin else repeats.otherwise_named(connection, campaign, options.corrects)
    if stored_skin is not None:
        named = f"it names skin {campaign.skin.id!r}"
        notes.append(f"{named}, and was kept on skin {stored_skin!r}, as the campaign that it corrects")
    return notes


def _repeats(connection: Connection, campaign: Campaign, options: IngestOptions) -> list[str]:
    """Notes on recordings that are already stored."""
    earlier = repeats.earlier_campaign(connection, campaign, options.skin, options.corrects)
    if earlier is None:
        return []
    sentence, campaign_id = earlier
    return [f"{sentence} That is {campaign_id}; in the history of a skin, identical recordings count once."]
