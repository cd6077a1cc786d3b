"""Storing the campaigns of uploads in one transaction; a repeated request is answered as before."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import orjson
from sqlalchemy import Connection

from service.ingest import instruments, repeats
from service.ingest.held_arrays import HeldArrays
from service.ingest.reading import CheckedCampaign, ReadCampaign, checked, joined, look, require_few
from service.ingest.rig_words import said_of
from service.ingest.uploads import Upload
from service.problems import Refusal
from service.store import Database, answers, campaigns, instrument_templates, skins
from underskin.errors import FileError, InvalidInput, conflicting, required
from underskin.findings.alike import grouped_by_reason, recordings_called, why_refused
from underskin.recordings import plausibility, validation
from underskin.recordings.campaign import Campaign
from underskin.recordings.frf.estimators import Estimator
from underskin.recordings.rig_description import LARGEST_BYTES, RigDescription, from_dict
from underskin.recordings.rig_description import parse as parse_rig
from underskin.several_errors import SeveralInvalid, errors_of

RIG = "rig"  # name of the form's part that is a rig description
_MOST_ERRORS = 100  # in the problem of a request of which nothing is kept
_MOST_TOLD = 3  # of them in its sentence


@dataclass(frozen=True)
class IngestOptions:
    """What a client says about its uploads."""

    skin: str | None
    corrects: str | None
    reason: str | None
    all_or_nothing: bool
    together: str | None
    idempotency_key: str | None
    sender: str | None
    most_json_bytes: int
    most_unfolded_bytes: int
    estimator: Estimator | None = None
    turn_curves: bool = False  # that count pressing negative
    by_kept_rig: bool = True  # whether the rig description kept with the skin counts where none is sent
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
        """What makes a repetition of this request recognisable."""
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
    """Keep what is good; the answer is a CampaignResult, or a BatchResult for a form or a list; True: it is repeated.

    Raises Refusal where nothing is kept.
    """
    request = options.request(uploads)
    if request is not None:
        before = store.read(answers.replayed, request)
        if before is not None:
            return dict(before), True
    rig = _rig(store, uploads, options)
    arrived = _arrived(uploads, rig, options)
    _require_keepable(arrived, options)

    def keep(connection: Connection) -> dict[str, Any]:
        results = [_kept(connection, campaign, options, rig) for campaign in arrived]
        return {"campaigns": results} if uploads[0].in_form or arrived[0].in_list else results[0]

    return store.write(answers.once, request, keep)


def _rig(store: Database, uploads: Sequence[Upload], options: IngestOptions) -> RigDescription | None:
    """The rig description that was sent, or else the one kept with the skin or with that of the corrected campaign."""
    for upload in uploads:
        if upload.field == RIG:
            try:
                return sent_rig(upload)
            except FileError as error:
                raise error.of_field(RIG, upload.label) from None
            except InvalidInput as error:
                label = f"{upload.label}: " if upload.label else f"{RIG}."
                raise SeveralInvalid([one.at(f"{label}{one.field}") for one in errors_of(error)]) from None
    if not options.by_kept_rig:
        return None
    with store.reading() as connection:
        names = [options.skin] if options.skin is not None else []
        if options.corrects is not None:
            names.append(campaigns.find(connection, options.corrects).skin_id)
        rigs = (kept_rig(connection, name) for name in names)
        return next((rig for rig in rigs if rig is not None), None)


def sent_rig(upload: Upload) -> RigDescription:
    """The rig description in an uploaded file; raises FileError, InvalidInput."""
    size = upload.path.stat().st_size
    if size > LARGEST_BYTES:
        raise FileError(upload.label or RIG, "", f"has {size} bytes; a rig description may have up to {LARGEST_BYTES}")
    return parse_rig(upload.start(LARGEST_BYTES), upload.label or RIG)


def kept_rig(connection: Connection, skin_id: str) -> RigDescription | None:
    """The rig description that is kept with a skin."""
    document = skins.rig_of(connection, skin_id)
    return None if document is None else from_dict(orjson.loads(document))


def _arrived(uploads: Sequence[Upload], rig: RigDescription | None, options: IngestOptions) -> list[CheckedCampaign]:
    """The campaigns of all files; one of them all where they go together."""
    files: list[ReadCampaign] = []
    recordings = 0
    held = HeldArrays(options.most_unfolded_bytes)
    for upload in uploads:
        if upload.field != RIG:
            more = look(upload, rig, options.most_json_bytes).campaigns
            more = [one.with_curves_turned() for one in more] if options.turn_curves else more
            files += [one.with_estimator(options.estimator) for one in more]
            held.add(more)
            recordings += sum(one.recordings for one in more)
            require_few(len(files), recordings)
    if options.together is None or not files:
        return [checked(one) for one in files]
    return [joined(files, options.together, options.skin)]


def _require_keepable(arrived: Sequence[CheckedCampaign], options: IngestOptions) -> None:
    good = [entry for entry in arrived if entry.campaign is not None]
    if options.corrects is not None and len(arrived) > 1:
        raise conflicting("corrects", options.corrects, f"needs one campaign in its place, not {len(arrived)}")
    spoilt = any(entry.campaign is None or entry.refused for entry in arrived)
    if good and not (options.all_or_nothing and spoilt):
        return
    errors = [error for entry in arrived for error in _flat(entry, many=len(arrived) > 1)]
    raise Refusal(422, _in_words(arrived), title="Invalid input", errors=errors[:_MOST_ERRORS])


def _in_words(arrived: Sequence[CheckedCampaign]) -> str:
    """The first errors; those alike of many recordings are one."""
    told = [line for entry in arrived for line in _lines(entry)]
    if not told:
        return "No campaign was sent."
    more = max(0, len(told) - _MOST_TOLD) + sum(entry.unlisted for entry in arrived)
    return "; ".join([f"Nothing was kept: {told[0]}", *told[1:_MOST_TOLD], *([f"and {more} more"] if more else [])])


def _lines(campaign: CheckedCampaign) -> list[str]:
    file = f"{campaign.file}: " if campaign.file else ""
    alike = grouped_by_reason(
        (entry["id"], why_refused(error)) for entry in campaign.refused for error in entry["errors"]
    )
    lines = [f"{file}{recordings_called(names)}: {why}" for names, why in alike]
    return lines or [f"{file}{why_refused(error)}" for error in campaign.errors]


def _flat(campaign: CheckedCampaign, *, many: bool) -> list[dict[str, Any]]:
    """All errors of a campaign as a problem lists them."""
    prefix = f"{campaign.file}: " if many and campaign.file else ""
    placed = [(f"{_place(entry['id'])}.", error) for entry in campaign.refused for error in entry["errors"]]
    if not placed:  # or they say no more than that every recording is refused
        placed = [("", error) for error in campaign.errors]
    return [{**error, "index": None, "field": f"{prefix}{place}{error['field']}"} for place, error in placed]


def _place(recording: str) -> str:
    return recording if recording.startswith("recordings[") else f"recordings[{recording}]"


def _kept(
    connection: Connection, checked: CheckedCampaign, options: IngestOptions, rig: RigDescription | None
) -> dict[str, Any]:
    campaign = checked.campaign
    notes = [*(said_of(rig) if checked.by_rig and rig is not None else []), *checked.notes]
    refused = [{"id": entry["id"], "status": "refused", "errors": entry["errors"]} for entry in checked.refused]
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
    """What is said of a correction that changes nothing, or names another skin than the campaign it corrects is on."""
    same = repeats.changes_nothing(connection, campaign, options.skin, options.corrects)
    notes = ["it says the same as the campaign that it corrects"] if same else []
    kept_on = None if options.skin else repeats.otherwise_named(connection, campaign, options.corrects)
    if kept_on is not None:
        named = f"it names skin {campaign.skin.id!r}"
        notes.append(f"{named}, and was kept on skin {kept_on!r}, as the campaign that it corrects")
    return notes


def _repeats(connection: Connection, campaign: Campaign, options: IngestOptions) -> list[str]:
    """What is said of recordings that are here already."""
    earlier = repeats.already_kept(connection, campaign, options.skin, options.corrects)
    if earlier is None:
        return []
    sentence, campaign_id = earlier
    return [f"{sentence} That is {campaign_id}; in the history of a skin, identical recordings count once."]
