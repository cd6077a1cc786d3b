"""Checks of an export before import: only data that the service could have stored itself are accepted.

Every check raises InvalidInput, or pydantic's ValidationError, KeyError or TypeError for a row of another shape.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import orjson
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from service.schemas.campaigns import RecordingResult
from service.schemas.changes import Action
from service.store import codec, times
from service.store.skins import require_usable
from underskin.errors import conflicting, unreadable
from underskin.recordings import rig_description, validation
from underskin.recordings.campaign import SCHEMA, Campaign, parse
from underskin.recordings.skin_export import ExportedCampaign, Overview

Text = Annotated[str, StringConstraints(max_length=1000, pattern=r"^[^\x00]*$")]
CampaignId = Annotated[str, StringConstraints(pattern=r"^c-[0-9a-f]{16}$")]
ChangeId = Annotated[str, StringConstraints(pattern=r"^ch-[0-9a-f]{16}$")]
Remark = Annotated[str, StringConstraints(max_length=10_000, pattern=r"^[^\x00]*$")]
_TIME = r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z$"
Time = Annotated[str, StringConstraints(pattern=_TIME), AfterValidator(times.checked)]


NEWER = (  # columns that files of older versions lack
    "withdrawn_from", "excluded_from", "joined_from", "title", "remark", "tags", "discarded_at"
)  # fmt: skip


class ImportedRow(BaseModel):
    """A row as an export has it."""

    model_config = ConfigDict(extra="forbid", strict=True)


class SkinRow(ImportedRow):
    """A row of skins."""

    id: str
    root_id: str
    created_at: Time
    joined_to: str | None
    joined_at: Time | None
    join_reason: Text | None
    joined_from: Text | None = None
    title: Text | None = None
    remark: Remark | None = None
    tags: Text | None = None
    discarded_at: Time | None = None


class RigRow(ImportedRow):
    """A row of rigs."""

    skin_id: str
    document: str
    created_at: Time


class CampaignRow(ImportedRow):
    """A row of campaigns, but for its number and what its recordings say."""

    id: CampaignId
    skin_id: str
    name: str
    about: dict[str, Any]
    notes: list[str]
    refused: list[dict[str, Any]]
    source: Text | None
    received_at: Time
    received_from: Text | None
    recorded_at: Time | None
    recordings: int = Field(ge=1)
    excluded: int = Field(ge=0)
    corrects: CampaignId | None
    correct_reason: Text | None
    corrected_by: CampaignId | None
    withdrawn_at: Time | None
    withdraw_reason: Text | None
    withdrawn_from: Text | None = None
    remark: Remark | None = None
    tags: Text | None = None
    discarded_at: Time | None = None


class ExclusionRow(ImportedRow):
    """Whether a recording is excluded."""

    excluded_at: Time | None
    exclude_reason: Text | None
    excluded_from: Text | None = None


class ChangeRow(ImportedRow):
    """A row of changes, but for its number."""

    id: ChangeId
    action: Action
    skin_id: str
    campaign_id: CampaignId | None
    recording: str | None
    at: Time
    made_from: Text | None
    reason: Text | None
    before: dict[str, Any]
    after: dict[str, Any]
    undoes: ChangeId | None


class OfCampaign(ImportedRow):
    """What an annotation of a campaign changes, before or after."""

    name: Text = ""
    remark: Remark | None = None
    tags: Text | None = None


class OfSkin(ImportedRow):
    """The same of a skin."""

    title: Text | None = None
    remark: Remark | None = None
    tags: Text | None = None


class Listed(ImportedRow):
    """A skin before it is put away."""

    discarded_at: None


class PutAway(ImportedRow):
    """A skin afterwards."""

    discarded_at: Time


class ListedCampaign(Listed):
    """A campaign before it is put away."""

    withdrawn_at: None = None
    withdraw_reason: None = None
    withdrawn_from: None = None


class PutAwayCampaign(PutAway):
    """A campaign afterwards; withdrawn with it, where it was in use."""

    withdrawn_at: Time | None = None
    withdraw_reason: Text | None = None
    withdrawn_from: Text | None = None


class Joining(ImportedRow):
    """A skin before it is joined to another, with all that count as it."""

    skin_id: str
    members: list[str]


class Nothing(ImportedRow):
    """No values: the columns that the change sets are empty before."""


_Values = dict[str, tuple[type[ImportedRow], type[ImportedRow]]]  # by action: before and after
_OF_SKIN: _Values = {"annotate": (OfSkin, OfSkin), "discard": (Listed, PutAway), "join": (Joining, Nothing)}
_OF_CAMPAIGN: _Values = {
    "annotate": (OfCampaign, OfCampaign),
    "withdraw": (Nothing, Nothing),
    "exclude": (Nothing, Nothing),
    "correct": (Nothing, Nothing),
    "discard": (ListedCampaign, PutAwayCampaign),
}


@dataclass(frozen=True)
class CheckedOverview:
    """Rows of the skins, their rigs and what was changed, ready to be kept."""

    skins: list[SkinRow]
    rigs: list[RigRow]
    changes: list[ChangeRow]


@dataclass(frozen=True)
class ImportedCampaign:
    """A campaign with its row and its exclusions, ready to be kept."""

    row: dict[str, Any]
    campaign: Campaign
    exclusions: list[ExclusionRow]


def overview(exported: Overview) -> CheckedOverview:
    """The skins, one of them the root of all, and rigs of theirs."""
    rows = [SkinRow.model_validate(row) for row in exported.skins]
    rigs = [RigRow.model_validate(row) for row in exported.rigs]
    _require_joined(exported.skin, rows)
    ids = {row.id for row in rows}
    for rig in rigs:
        _require(rig.skin_id in ids, "rigs", rig.skin_id, "must be of a skin in the file")
        try:
            rig_description.from_dict(orjson.loads(rig.document))
        except orjson.JSONDecodeError as error:
            raise unreadable("rigs", None, f"must be JSON: {error.msg}") from None
    changes = [ChangeRow.model_validate(row) for row in exported.changes]
    undone = {change.undoes for change in changes}
    for change in changes:
        _require(change.skin_id in ids, "changes", change.skin_id, "must be of a skin in the file")
        _require_of(change, exported.campaigns)
        if change.action == "join" and change.id not in undone:
            joined = {change.before["skin_id"], *change.before["members"]}
            _require(joined <= ids, "changes", change.id, "must join skins in the file")
    return CheckedOverview(rows, rigs, changes)


def campaign(exported: ExportedCampaign, name: str, skins: Sequence[SkinRow]) -> ImportedCampaign:
    """The campaign that the file has under `name`, checked as an upload is."""
    state = CampaignRow.model_validate(exported.about)
    _require(state.id == name, "id", state.id, f"must be {name}, as the file names it")
    _require(state.skin_id in {row.id for row in skins}, "skin_id", state.skin_id, "must be a skin in the file")
    _require_together(state, "corrects", "correct_reason")
    _require_together(state, "withdrawn_at", "withdraw_reason")
    for refused_recording in state.refused:
        RecordingResult.model_validate(refused_recording)
    columns = ("excluded_at", "exclude_reason", "excluded_from")
    exclusions = [ExclusionRow(**{key: row.get(key) for key in columns}) for row in exported.recordings]
    for exclusion in exclusions:
        _require_together(exclusion, "excluded_at", "exclude_reason")
    entries = [{**row["scalars"], **arrays} for row, arrays in zip(exported.recordings, exported.arrays, strict=True)]
    parsed = parse({**state.about, "schema": SCHEMA, "recordings": entries})
    validation.name("name", state.name, False)
    row = {
        **state.model_dump(),
        "about": codec.about(parsed),
        "recordings": len(parsed.recordings),
        "excluded": sum(exclusion.excluded_at is not None for exclusion in exclusions),
        "recorded_at": codec.earliest(parsed),
        "revision": 0,
    }
    return ImportedCampaign(row, parsed, exclusions)


def _require_of(change: ChangeRow, campaigns: Sequence[str]) -> None:
    """Check the type and the values of a change of a skin or of one of the campaigns."""
    campaign_id = change.campaign_id
    _require(
        campaign_id is None or campaign_id in campaigns, "changes", campaign_id, "must be of a campaign in the file"
    )
    named = change.recording is not None
    _require(change.action != "exclude" or named, "changes", change.id, "must name the recording")
    values = (_OF_SKIN if campaign_id is None else _OF_CAMPAIGN) | {"undo": (Nothing, Nothing)}
    _require(change.action in values, "changes", change.id, "must be of what can be changed")
    before, after = values[change.action]
    before.model_validate(change.before)
    after.model_validate(change.after)
    for held in (change.before, change.after):
        if "name" in held:
            validation.name("name", held["name"], False)


def _require_joined(root: str, rows: Sequence[SkinRow]) -> None:
    """Each skin once, with a valid id; all but the root joined to another, and so in the end to the root."""
    joined_to = {row.id: row.joined_to for row in rows}
    _require(root in joined_to, "skin", root, "must be one of the file's skins")
    _require(len(joined_to) == len(rows), "skins", len(rows), "must have ids that differ")
    for row in rows:
        require_usable("skins.id", row.id)
        _require(row.root_id == root, "skins.root_id", row.root_id, f"must be {root!r}")
        _require((row.joined_to is None) == (row.id == root), "skins.joined_to", row.joined_to, "must lead to the skin")
        _require_together(row, "joined_to", "joined_at", "join_reason")
    leading = {root}
    for row in rows:
        passed: dict[str | None, None] = {}
        name: str | None = row.id
        while name not in leading:
            _require(name in joined_to and name not in passed, "skins.joined_to", row.id, "must lead to the skin")
            passed[name] = None
            name = joined_to[str(name)]
        leading |= {str(passed_id) for passed_id in passed}


def _require_together(row: BaseModel, *names: str) -> None:
    given = {getattr(row, name) is None for name in names}
    _require(len(given) == 1, names[-1], getattr(row, names[-1]), f"goes together with {names[0]}")


def _require(holds: bool, field: str, value: Any, allowed: str) -> None:
    if not holds:
        raise conflicting(field, value, allowed)
