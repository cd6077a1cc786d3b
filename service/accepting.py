"""POST /v1/campaigns: from uploads to what is kept, in one transaction, answered the same when asked again."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import orjson
from sqlalchemy import Connection

from service import repeats
from service.problems import Refusal
from service.reading import Arrived, Found, arrived_as, joined, read, require_few
from service.store import answers, campaigns, skins
from service.store.engine import Database
from service.uploads import Upload
from underskin import InvalidInput
from underskin.errors import FileError
from underskin.recordings import plausibility, validation
from underskin.recordings.campaign import Campaign
from underskin.recordings.rig_description import LARGEST_BYTES, RigDescription, from_dict
from underskin.recordings.rig_description import parse as parse_rig

RIG = "rig"  # name of the form's part that is a rig description
_MOST_ERRORS = 100  # in the problem of a request of which nothing is kept


@dataclass(frozen=True)
class Terms:
    """What the client says about its uploads beside them."""

    skin: str | None
    corrects: str | None
    reason: str | None
    all_or_nothing: bool
    together: str | None
    idempotency_key: str | None
    sender: str | None
    most_json_bytes: int

    def __post_init__(self) -> None:
        """Raises InvalidInput."""
        if (self.corrects is None) != (self.reason is None):
            missing = "reason" if self.reason is None else "corrects"
            raise InvalidInput(missing, None, "corrects and reason go together")
        if self.skin is not None:
            skins.require_usable("skin", self.skin)
        if self.together is not None:
            validation.name("together", self.together, False)

    def request(self, uploads: Sequence[Upload]) -> answers.Request | None:
        """What makes a repetition of this request recognisable."""
        if self.idempotency_key is None:
            return None
        told = [self.skin, self.corrects, self.reason, self.all_or_nothing]
        if self.together is not None:  # otherwise as it always was: keys hold for as long as the store
            told.append(self.together)
        sent = [[upload.field, upload.label, upload.sha256] for upload in uploads]
        digest = hashlib.sha256(repr([told, sent]).encode()).hexdigest()
        return answers.Request(self.sender or "", self.idempotency_key, digest)


def accept(store: Database, uploads: Sequence[Upload], terms: Terms) -> tuple[dict[str, Any], bool]:
    """Keep what is good; the answer is a CampaignResult, or a BatchResult for a form or a list; True: it is repeated.

    Raises Refusal where nothing is kept.
    """
    request = terms.request(uploads)
    if request is not None:
        with store.reading() as connection:
            before = answers.replayed(connection, request)
        if before is not None:
            return dict(before), True
    rig = _rig(store, uploads, terms)
    arrived = _arrived(uploads, rig, terms)
    _require_keepable(arrived, terms)
    with store.writing() as connection:
        if request is not None and not answers.claim(connection, request):
            return dict(answers.replayed(connection, request) or {}), True
        results = [_kept(connection, found, terms, rig) for found in arrived]
        answer = {"campaigns": results} if uploads[0].in_form or arrived[0].in_list else results[0]
        if request is not None:
            answers.keep(connection, request, answer)
    return answer, False


def _rig(store: Database, uploads: Sequence[Upload], terms: Terms) -> RigDescription | None:
    """The rig description that was sent, or else the one kept with the skin or with that of the corrected campaign."""
    for upload in uploads:
        if upload.field == RIG:
            try:
                with upload.path.open("rb") as file:
                    return parse_rig(file.read(LARGEST_BYTES + 1), upload.label or RIG)
            except FileError as error:
                raise InvalidInput(RIG, upload.label, f"{error.place}: {error.reason}".lstrip(": ")) from None
            except InvalidInput as error:
                label = f"{upload.label}: " if upload.label else f"{RIG}."
                raise error.at(f"{label}{error.field}") from None
    with store.reading() as connection:
        names = [terms.skin] if terms.skin is not None else []
        if terms.corrects is not None:
            names.append(campaigns.find(connection, terms.corrects).skin_id)
        kept = [rig for name in names if (rig := skins.rig_of(connection, name)) is not None]
    return from_dict(orjson.loads(kept[0])) if kept else None


def _arrived(uploads: Sequence[Upload], rig: RigDescription | None, terms: Terms) -> list[Arrived]:
    """The campaigns of all files; one of them all where they go together."""
    found: list[Found] = []
    recordings = 0
    for upload in uploads:
        if upload.field != RIG:
            more = read(upload, rig, terms.most_json_bytes)
            found += more
            recordings += sum(one.recordings for one in more)
            require_few(len(found), recordings)
    if terms.together is None or not found:
        return [arrived_as(one) for one in found]
    return [joined(found, terms.together, terms.skin)]


def _require_keepable(arrived: Sequence[Arrived], terms: Terms) -> None:
    good = [found for found in arrived if found.campaign is not None]
    if terms.corrects is not None and len(arrived) > 1:
        raise InvalidInput("corrects", terms.corrects, f"needs one campaign in its place, not {len(arrived)}")
    spoilt = any(found.campaign is None or found.refused for found in arrived)
    if good and not (terms.all_or_nothing and spoilt):
        return
    errors = [error for found in arrived for error in _flat(found, many=len(arrived) > 1)]
    detail = f"Nothing was kept: {errors[0]['field']} {errors[0]['allowed']}" if errors else "No campaign was sent."
    more = len(errors) - 1 + sum(found.untold for found in arrived)
    if more > 0:
        detail += f"; and {more} more"
    raise Refusal(422, detail, title="Invalid input", errors=errors[:_MOST_ERRORS])


def _flat(found: Arrived, *, many: bool) -> list[dict[str, Any]]:
    """All errors of a campaign as a problem lists them."""
    prefix = f"{found.file}: " if many and found.file else ""
    own = [{**error, "index": None, "field": prefix + error["field"]} for error in found.errors]
    nested = [
        {**error, "index": None, "field": f"{prefix}{_place(entry['id'])}.{error['field']}"}
        for entry in found.refused
        for error in entry["errors"]
    ]
    return nested + own


def _place(recording: str) -> str:
    return recording if recording.startswith("recordings[") else f"recordings[{recording}]"


def _kept(connection: Connection, found: Arrived, terms: Terms, rig: RigDescription | None) -> dict[str, Any]:
    refused = [{"id": entry["id"], "status": "refused", "errors": entry["errors"]} for entry in found.refused]
    findings = [] if found.campaign is None else [one.sentence for one in plausibility.implausible(found.campaign)]
    result: dict[str, Any] = {"file": found.file, "errors": found.errors, "notes": found.notes, "findings": findings}
    if found.campaign is None:
        return {**result, "status": "refused", "id": None, "skin_id": None, "recordings": refused}
    notes = [*found.notes, *_stays(connection, found.campaign, terms), *_repeats(connection, found.campaign, terms)]
    result["notes"] = notes
    arrival = campaigns.Arrival(
        found.campaign, terms.skin, refused, notes, source=found.file, received_from=terms.sender
    )
    campaign_id, skin_id = campaigns.add(connection, arrival, corrects=terms.corrects, reason=terms.reason)
    if found.by_rig and rig is not None:
        skins.keep_rig(connection, skin_id, orjson.dumps(rig.document).decode())
    kept = [{"id": recording.id, "status": "ok", "errors": []} for recording in found.campaign.recordings]
    return {**result, "status": "ok", "id": campaign_id, "skin_id": skin_id, "recordings": kept + refused}


def _stays(connection: Connection, campaign: Campaign, terms: Terms) -> list[str]:
    """What is said of a correction that names another skin than that of the campaign it corrects."""
    named = campaign.skin.id
    if terms.corrects is None or terms.skin is not None or named is None:
        return []
    skin_id = campaigns.find(connection, terms.corrects).skin_id
    if skins.are_one(connection, named, skin_id):
        return []
    return [f"it names skin {named!r}, and was kept on skin {skin_id!r}, as the campaign that it corrects"]


def _repeats(connection: Connection, campaign: Campaign, terms: Terms) -> list[str]:
    """What is said of recordings that are here already."""
    earlier = repeats.already_kept(connection, campaign, terms.skin, terms.corrects)
    if earlier is None:
        return []
    said, campaign_id = earlier
    return [f"{said} That is {campaign_id}; in the history of a skin, identical recordings count once."]
