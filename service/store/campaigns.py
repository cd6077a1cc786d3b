"""Campaigns and their recordings: stored, listed, loaded, withdrawn, corrected; recordings excluded."""

import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, case, exists, func, insert, select, update

from service.schemas.campaigns import State
from service.store import changes, codec, skins
from service.store.engine import Database
from service.store.errors import Conflict, Missing
from service.store.tables import AnyRow, campaigns, recording_digests, recordings
from service.store.times import now
from underskin.recordings.campaign import Campaign, Recording
from underskin.recordings.reading import digest

# All that lists show of a recording: not its arrays.
_LISTED = [column for column in recordings.c if column.name not in ("campaign", "position", "arrays")]
_AT_A_TIME = 8  # recordings read at once for a document
TIME = func.coalesce(campaigns.c.recorded_at, campaigns.c.received_at)  # of recording; of arrival without one
LISTED = campaigns.c.discarded_at.is_(None)
CURRENT = campaigns.c.withdrawn_at.is_(None) & campaigns.c.corrected_by.is_(None)
_IN_STATE = {
    "current": CURRENT,
    "corrected": campaigns.c.withdrawn_at.is_(None) & campaigns.c.corrected_by.is_not(None),
    "withdrawn": campaigns.c.withdrawn_at.is_not(None),
}


@dataclass(frozen=True)
class NewCampaign:
    """A new campaign: its rejected recordings, the reader's notes, its source, and the sender of a correction."""

    campaign: Campaign
    skin_id: str | None
    refused: Sequence[dict[str, Any]] = ()
    notes: Sequence[str] = ()
    source: str | None = None
    received_from: str | None = None
    corrected_from: str | None = None


@dataclass(frozen=True)
class CampaignFilters:
    """Filters of a list of campaigns; None does not filter. Times in the store's form."""

    skin: str | None = None
    state: State | None = None
    name_contains: str | None = None
    recorded_from: str | None = None
    recorded_to: str | None = None


@dataclass(frozen=True)
class Excluded:
    """An excluded recording and the reason."""

    recording: str
    reason: str
    at: str


def add(
    connection: Connection, arrival: NewCampaign, *, corrects: str | None = None, reason: str | None = None
) -> tuple[str, str]:
    """Store a campaign; returns its id and its skin's. A correction replaces the other campaign, on its skin unless
    `arrival.skin_id` names another, whatever the campaign itself says."""
    replaced = None if corrects is None else _changeable(connection, corrects)
    campaign = arrival.campaign
    named = arrival.skin_id or (replaced.skin_id if replaced else campaign.skin.id)
    campaign_id, skin_id = f"c-{secrets.token_hex(8)}", skins.require(connection, named)
    row = {
        "id": campaign_id,
        "skin_id": skin_id,
        "name": campaign.name,
        "about": codec.about(campaign),
        "notes": list(arrival.notes),
        "refused": list(arrival.refused),
        "source": arrival.source,
        "received_at": now(),
        "received_from": arrival.received_from,
        "recorded_at": codec.earliest(campaign),
        "recordings": len(campaign.recordings),
        "excluded": 0,
        "revision": 0,
        "corrects": corrects,
        "correct_reason": reason,
    }
    keep(connection, row, campaign.recordings, [{}] * len(campaign.recordings))
    if replaced is not None:
        _change(connection, replaced.number, corrected_by=campaign_id)
        changes.record(connection, "correct", skin_id, arrival.corrected_from, campaign_id=campaign_id, reason=reason)
    return campaign_id, skin_id


def keep(
    connection: Connection,
    row: Mapping[str, Any],
    held: Sequence[Recording],
    exclusions: Sequence[Mapping[str, str | None]],
) -> None:
    """Store a campaign by its row with its recordings in order; `exclusions`: when and why each was excluded."""
    number = connection.execute(insert(campaigns).returning(campaigns.c.number), row).scalar_one()
    rows = [
        {"campaign": number, "position": position, **codec.recording_columns(recording), **exclusion}
        for position, (recording, exclusion) in enumerate(zip(held, exclusions, strict=True))
    ]
    connection.execute(insert(recordings), rows)
    keep_digests(connection, number, held)


def keep_digests(connection: Connection, number: int, held: Sequence[Recording]) -> None:
    """Store the digests of the recordings of the campaign `number`; not all have one."""
    rows = [
        {"campaign": number, "position": position, "digest": made}
        for position, recording in enumerate(held)
        if (made := digest(recording)) is not None
    ]
    if rows:
        connection.execute(insert(recording_digests), rows)


def find(connection: Connection, campaign_id: str, *, lock: bool = False) -> AnyRow:
    """The row of a campaign, optionally locked until the transaction ends; raises Missing."""
    query = select(campaigns).where(campaigns.c.id == campaign_id)
    row = connection.execute(query.with_for_update() if lock else query).first()
    if row is None:
        raise Missing(f"There is no campaign {campaign_id!r}.")
    return row


def listed(connection: Connection, filters: CampaignFilters, before: int | None, limit: int) -> Sequence[AnyRow]:
    """Rows of campaigns, the latest arrival first, those that arrived before the number `before`."""
    query = select(campaigns).where(LISTED)
    if filters.skin is not None:
        query = query.where(campaigns.c.skin_id.in_(skins.members(skins.root_of(filters.skin))))
    if filters.state is not None:
        query = query.where(_IN_STATE[filters.state])
    if filters.name_contains is not None:
        query = query.where(func.lower(campaigns.c.name).contains(filters.name_contains.lower(), autoescape=True))
    if filters.recorded_from is not None:
        query = query.where(campaigns.c.recorded_at >= filters.recorded_from)
    if filters.recorded_to is not None:
        query = query.where(campaigns.c.recorded_at < filters.recorded_to)
    if before is not None:
        query = query.where(campaigns.c.number < before)
    return connection.execute(query.order_by(campaigns.c.number.desc()).limit(limit)).all()


def by_time(connection: Connection, root: str, before: int | None, limit: int) -> Sequence[AnyRow]:
    """Rows of all campaigns of a skin, the one recorded last first, those before the campaign numbered `before`."""
    query = select(campaigns).where(campaigns.c.skin_id.in_(skins.members(root)), LISTED)
    if before is not None:
        time_before = select(TIME).where(campaigns.c.number == before).scalar_subquery()
        query = query.where((time_before > TIME) | ((time_before == TIME) & (campaigns.c.number < before)))
    return connection.execute(query.order_by(TIME.desc(), campaigns.c.number.desc()).limit(limit)).all()


def current_by_time(
    connection: Connection, skin_id: str | None, limit: int, *, kind: str | None = None, oldest_first: bool = False
) -> Sequence[AnyRow]:
    """Rows of current campaigns, of one skin or all, with recordings of a kind or any, the one recorded last first."""
    query = select(campaigns).where(CURRENT)
    if kind is not None:
        query = query.where(_has(kind))
    if skin_id is not None:
        query = query.where(_counting_as(skin_id))
    by = (TIME, campaigns.c.number) if oldest_first else (TIME.desc(), campaigns.c.number.desc())
    return connection.execute(query.order_by(*by).limit(limit)).all()


def latest(connection: Connection, skin_id: str) -> AnyRow | None:
    """The row of a skin's current campaign that was recorded last; None where none is current."""
    return next(iter(current_by_time(connection, skin_id, 1)), None)


def describing(connection: Connection, skin_id: str, *, alone: bool = False) -> AnyRow | None:
    """The row of the current campaign that describes a skin: the latest with FRFs, which need geometry and sensors;
    else the latest with indentations, whose thickness may be known; else the latest. None without a current campaign.
    `alone`: only campaigns sent for this id, not for skins joined with it."""
    of_skin = campaigns.c.skin_id == skin_id if alone else _counting_as(skin_id)
    rank = case((_has("frf"), 0), (_has("indentation"), 1), else_=2)
    query = select(campaigns).where(of_skin, CURRENT).order_by(rank, TIME.desc(), campaigns.c.number.desc())
    return connection.execute(query.limit(1)).first()


def _counting_as(skin_id: str) -> ColumnElement[bool]:
    return campaigns.c.skin_id.in_(skins.members(skins.root_of(skin_id)))


def _has(kind: str) -> ColumnElement[bool]:
    recordings_of_kind = (recordings.c.campaign == campaigns.c.number) & (recordings.c.kind == kind)
    return exists(select(recordings.c.kind).where(recordings_of_kind).correlate(campaigns))


def state(row: AnyRow) -> State:
    """Whether figures use it."""
    if row.withdrawn_at is not None:
        return "withdrawn"
    return "current" if row.corrected_by is None else "corrected"


def unused(row: AnyRow) -> str | None:
    """Why figures do not use it: withdrawn or corrected; None if it is current."""
    if row.withdrawn_at is not None:
        return f"withdrawn: {row.withdraw_reason}"
    return None if row.corrected_by is None else f"corrected by {row.corrected_by}"


def recordings_of(connection: Connection, number: int) -> Sequence[AnyRow]:
    """The recordings of a campaign without their arrays, in order."""
    query = select(*_LISTED).where(recordings.c.campaign == number)
    return connection.execute(query.order_by(recordings.c.position)).all()


def excluded_of(connection: Connection, number: int) -> list[Excluded]:
    """The excluded recordings of a campaign."""
    query = select(recordings.c.id, recordings.c.exclude_reason, recordings.c.excluded_at)
    query = query.where(recordings.c.campaign == number, recordings.c.excluded_at.is_not(None))
    return [Excluded(*row) for row in connection.execute(query.order_by(recordings.c.position))]


def load(connection: Connection, row: AnyRow, *, with_excluded: bool = True) -> Campaign:
    """The complete campaign with arrays, optionally without excluded recordings."""
    query = select(recordings.c.kind, recordings.c.scalars, recordings.c.arrays)
    query = query.where(recordings.c.campaign == row.number).order_by(recordings.c.position)
    if not with_excluded:
        query = query.where(recordings.c.excluded_at.is_(None))
    return codec.campaign_of(row.about, tuple(map(codec.recording_of, connection.execute(query))))


def documents(store: Database, number: int) -> Iterator[dict[str, Any]]:
    """The recordings of a campaign in the form of campaign/1, in order, a few in memory at a time.

    No connection is held between them: a stored recording's document never changes.
    """
    query = select(recordings.c.kind, recordings.c.scalars, recordings.c.arrays)
    query = query.where(recordings.c.campaign == number).order_by(recordings.c.position).limit(_AT_A_TIME)
    start = 0
    while True:
        with store.reading() as connection:
            rows = connection.execute(query.where(recordings.c.position >= start)).all()
        yield from map(codec.document_of, rows)
        if len(rows) < _AT_A_TIME:
            return
        start += _AT_A_TIME


def withdraw(connection: Connection, campaign_id: str, reason: str, withdrawn_from: str | None) -> None:
    """Remove a campaign from all figures; raises Missing, Conflict."""
    row = _changeable(connection, campaign_id)
    _change(connection, row.number, withdrawn_at=now(), withdraw_reason=reason, withdrawn_from=withdrawn_from)
    changes.record(connection, "withdraw", row.skin_id, withdrawn_from, campaign_id=campaign_id, reason=reason)


def exclude(connection: Connection, campaign_id: str, recording_id: str, reason: str, made_from: str | None) -> None:
    """Exclude a recording from all figures; raises Missing, Conflict."""
    row = _changeable(connection, campaign_id)
    this = (recordings.c.campaign == row.number) & (recordings.c.id == recording_id)
    recording = connection.execute(select(recordings.c.excluded_at, recordings.c.exclude_reason).where(this)).first()
    if recording is None:
        raise Missing(f"Campaign {campaign_id!r} has no recording {recording_id!r}.")
    if recording.excluded_at is not None:
        raise Conflict(f"Recording {recording_id!r} is excluded already: {recording.exclude_reason}")
    values = {"excluded_at": now(), "exclude_reason": reason, "excluded_from": made_from}
    connection.execute(update(recordings).where(this).values(**values))
    _change(connection, row.number, excluded=campaigns.c.excluded + 1)
    changes.record(
        connection, "exclude", row.skin_id, made_from, campaign_id=campaign_id, recording=recording_id, reason=reason
    )


def of_skin(connection: Connection, root: str) -> Sequence[AnyRow]:
    """Rows of all campaigns of a skin and of those joined to it, in order of arrival."""
    query = select(campaigns).where(campaigns.c.skin_id.in_(skins.members(root))).order_by(campaigns.c.number)
    return connection.execute(query).all()


def _changeable(connection: Connection, campaign_id: str) -> AnyRow:
    """The row, locked until the transaction ends; raises Missing, or Conflict where it is no longer current."""
    row = find(connection, campaign_id, lock=True)
    if row.withdrawn_at is not None:
        raise Conflict(f"Campaign {campaign_id!r} was withdrawn: {row.withdraw_reason}")
    if row.corrected_by is not None:
        raise Conflict(f"Campaign {campaign_id!r} was corrected: change its newer version, {row.corrected_by!r}.")
    return row


def _change(connection: Connection, number: int, **values: Any) -> None:
    values["revision"] = campaigns.c.revision + 1
    connection.execute(update(campaigns).where(campaigns.c.number == number).values(**values))
