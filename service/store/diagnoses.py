"""Diagnoses in the store: requested, claimed by one server, kept alive while they run, ended once.

A server that runs a diagnosis reports every few seconds that it is alive. After HEARTBEAT_TIMEOUT_S without a report it
is considered dead, and the diagnosis is claimed again, by the same server after a restart or by another.
"""

import json
import secrets
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, insert, select, text, update

from service.schemas.diagnoses import DiagnosisKind, State
from service.store import campaigns as kept_campaigns
from service.store import changes, diagnosed_together, skins, times
from service.store.campaigns import Excluded
from service.store.codec import compressed, decompressed
from service.store.diagnosed_together import Member, Together
from service.store.errors import Conflict, Missing
from service.store.tables import AnyRow, campaigns, diagnoses
from service.store.times import now
from underskin.recordings.campaign import Campaign

HEARTBEAT_TIMEOUT_S = 10.0
_USABLE = ("queued", "running", "done")

# All but the report and its figures, with columns of its campaign, of several the latest of them.
_LISTED = (
    *[column for column in diagnoses.c if column.name not in ("report", "figures")],
    campaigns.c.id.label("campaign_id"),
    campaigns.c.skin_id,
    campaigns.c.withdrawn_at,
    campaigns.c.withdraw_reason,
    campaigns.c.corrected_by,
    campaigns.c.excluded.label("excluded_now"),
    diagnosed_together.changed().label("member_changed"),
    diagnosed_together.added().label("member_added"),
)


@dataclass(frozen=True)
class DiagnosisFilters:
    """Filters of a list of diagnoses; None does not filter."""

    campaign: str | None = None
    skin: str | None = None
    state: State | None = None
    kind: DiagnosisKind | None = None


def rows() -> Select[Any]:
    """Diagnoses without their reports, each with columns of its campaign."""
    return select(*_LISTED).join(campaigns, campaigns.c.number == diagnoses.c.campaign)


@dataclass(frozen=True)
class Basis:
    """The versions that a server diagnoses with: hash of the table of σ, version of underskin, hash of the lab's own
    mechanisms."""

    table_sha256: str
    version: str
    own_sha256: str = ""


def ask(
    connection: Connection, campaign_id: str, basis: Basis, asked_from: str | None, without: Sequence[str] = ()
) -> AnyRow:
    """The diagnosis of a campaign in its present state: the existing one, or a new one in the queue, without the
    mechanisms `without`.

    Raises Missing, and Conflict if the campaign is not current. A failed or cancelled diagnosis is queued anew.
    """
    campaign = kept_campaigns.find(connection, campaign_id, lock=True)
    why = kept_campaigns.unused(campaign)
    if why is not None:
        raise Conflict(f"Campaign {campaign_id!r} is not diagnosed: it was {why}.")
    wanted = {"campaign": campaign.number, "excluded": campaign.excluded, "kind": "campaign", "together_sha256": ""}
    wanted |= _basis(basis, without)
    return _same(connection, wanted) or _queued(connection, [campaign.skin_id], {**wanted, "asked_from": asked_from})


def ask_together(
    connection: Connection, together: Together, basis: Basis, asked_from: str | None, without: Sequence[str] = ()
) -> AnyRow:
    """As `ask`, for several campaigns, whose rows are locked."""
    wanted = {
        "campaign": max(member.number for member in together.members),
        "excluded": sum(member.excluded for member in together.members),
        "kind": together.kind,
        "name": together.name,
        "together_sha256": together.sha256,
        **_basis(basis, without),
    }
    same = _same(connection, wanted)
    if same is not None:
        return same
    of_skins = {member.skin_id for member in together.members}
    row = _queued(connection, of_skins, {**wanted, "asked_from": asked_from})
    diagnosed_together.keep(connection, row.number, together)
    return find(connection, row.id)


def _basis(basis: Basis, without: Sequence[str]) -> dict[str, Any]:
    return {"without": json.dumps(sorted(set(without))), **asdict(basis)}


def _same(connection: Connection, wanted: Mapping[str, Any]) -> AnyRow | None:
    """The first equal diagnosis that neither failed nor was cancelled."""
    same = [diagnoses.c[name] == value for name, value in wanted.items()]
    return connection.execute(rows().where(*same, diagnoses.c.state.in_(_USABLE)).order_by(diagnoses.c.number)).first()


def _queued(connection: Connection, skin_ids: Collection[str], wanted: Mapping[str, Any]) -> AnyRow:
    """A new diagnosis, of campaigns of these skins."""
    diagnosis_id = f"d-{secrets.token_hex(8)}"
    values = {"id": diagnosis_id, "state": "queued", "progress": 0.0, "asked_at": times.next_of(connection, skin_ids)}
    connection.execute(insert(diagnoses), {**wanted, **values})
    return find(connection, diagnosis_id)


def without(row: AnyRow) -> list[str]:
    """The mechanisms that a diagnosis does not use."""
    return list(json.loads(row.without))


def find(connection: Connection, diagnosis_id: str) -> AnyRow:
    """The row of a diagnosis; raises Missing."""
    row = connection.execute(rows().where(diagnoses.c.id == diagnosis_id)).first()
    if row is None:
        raise Missing(f"There is no diagnosis {diagnosis_id!r}.")
    return row


def report_of(connection: Connection, number: int) -> dict[str, Any] | None:
    """Its report/1 if it is done."""
    return reports_of(connection, [number]).get(number)


def reports_of(connection: Connection, numbers: Sequence[int]) -> dict[int, dict[str, Any]]:
    """The reports of those diagnoses that are done."""
    query = select(diagnoses.c.number, diagnoses.c.report).where(diagnoses.c.number.in_(numbers))
    rows = connection.execute(query.where(diagnoses.c.report.is_not(None))).all()
    return {row.number: dict(decompressed(row.report)) for row in rows}


def figures_of(connection: Connection, number: int) -> dict[str, str]:
    """JSON of the figures made with its report, by name; none if they were not stored."""
    blob = connection.execute(select(diagnoses.c.figures).where(diagnoses.c.number == number)).scalar()
    return {} if blob is None else dict(decompressed(blob))


def listed(connection: Connection, filters: DiagnosisFilters, before: int | None, limit: int) -> Sequence[AnyRow]:
    """Rows of diagnoses, the latest first, those asked for before the number `before`."""
    query = rows()
    if filters.campaign is not None:
        query = query.where(_with_one_of(campaigns.c.id == filters.campaign))
    if filters.skin is not None:
        query = query.where(_with_one_of(campaigns.c.skin_id.in_(skins.members(skins.root_of(filters.skin)))))
    if filters.kind is not None:
        query = query.where(diagnoses.c.kind == filters.kind)
    if filters.state is not None:
        query = query.where(diagnoses.c.state == filters.state)
    if before is not None:
        query = query.where(diagnoses.c.number < before)
    return connection.execute(query.order_by(diagnoses.c.number.desc()).limit(limit)).all()


def _with_one_of(these: ColumnElement[bool]) -> ColumnElement[bool]:
    """Whether a diagnosis is of one of these campaigns, alone or together with others."""
    return these | diagnosed_together.has_one_of(select(campaigns.c.number).where(these))


def outdated(row: AnyRow) -> str | None:
    """Why a diagnosis no longer fits its campaigns; None if it is up to date."""
    if row.kind != "campaign":
        return diagnosed_together.outdated(row)
    changed = "changed: recordings were excluded since" if row.excluded != row.excluded_now else None
    return kept_campaigns.unused(row) or changed


def cancel(connection: Connection, diagnosis_id: str) -> None:
    """End a diagnosis before it is done; raises Missing, and Conflict if it is done or has failed."""
    this = diagnoses.c.id == diagnosis_id
    state = connection.execute(select(diagnoses.c.state).where(this).with_for_update()).scalar()
    if state is None:
        raise Missing(f"There is no diagnosis {diagnosis_id!r}.")
    if state in ("done", "failed"):
        raise Conflict(f"Diagnosis {diagnosis_id!r} cannot be cancelled: its state is {state}.")
    if state != "cancelled":
        values = {"state": "cancelled", "ended_at": now(), "claimed_by": None, "alive_at": None}
        connection.execute(update(diagnoses).where(this).values(**values))


def claim(
    connection: Connection, server: str, basis: Basis, not_these: Collection[int] = (), *, smallest: bool = False
) -> AnyRow | None:
    """Claim the next diagnosis, or the one whose campaign has the fewest recordings: a queued one, or one whose
    server is considered dead; None if there is none. `not_these`: numbers of diagnoses that this server already
    runs.

    Servers that claim at the same time get different diagnoses. A diagnosis runs with the versions of the server that
    claimed it, whatever they were when it was requested.
    """
    moment = clock(connection)
    _set_back(connection, moment)
    abandoned = (diagnoses.c.state == "running") & (diagnoses.c.alive_at < moment - HEARTBEAT_TIMEOUT_S)
    waiting = ((diagnoses.c.state == "queued") | abandoned) & diagnoses.c.number.not_in(not_these)
    size = select(campaigns.c.recordings).where(campaigns.c.number == diagnoses.c.campaign).scalar_subquery()
    order = (size, diagnoses.c.number) if smallest else (diagnoses.c.number,)
    query = select(diagnoses.c.number, diagnoses.c.id).where(waiting).order_by(*order).limit(1)
    row = connection.execute(query.with_for_update(skip_locked=True)).first()
    if row is None:
        return None
    values = {"state": "running", "claimed_by": server, "alive_at": moment, "progress": 0.0, "started_at": now()}
    connection.execute(update(diagnoses).where(diagnoses.c.number == row.number).values(**values, **asdict(basis)))
    return find(connection, row.id)


def _set_back(connection: Connection, moment: float) -> None:
    """After the clock was set back, count servers as alive now: a running one reports again, a dead one times out."""
    ahead = (diagnoses.c.state == "running") & (diagnoses.c.alive_at > moment)
    connection.execute(update(diagnoses).where(ahead).values(alive_at=moment))


def keep_alive(connection: Connection, number: int, server: str, progress: float) -> bool:
    """Report that it still runs here, and its progress; False if it is no longer this server's."""
    return _mine(connection, number, server, progress=progress, alive_at=clock(connection))


def finish(
    connection: Connection, number: int, server: str, report: dict[str, Any], figures: dict[str, str] | None = None
) -> bool:
    """Store the report and JSON of its figures; False if it is no longer this server's."""
    outcome = {"verdict": report["verdict"], "probability": report["probability"], "report": compressed(report)}
    drawn = None if figures is None else compressed(figures)
    return _end(connection, number, server, state="done", progress=1.0, figures=drawn, **outcome)


def fail(connection: Connection, number: int, server: str, reason: str) -> bool:
    """Store why there is no report; False if it is no longer this server's."""
    return _end(connection, number, server, state="failed", reason=reason)


def release(connection: Connection, number: int, server: str) -> bool:
    """Put it back into the queue."""
    queued = {"state": "queued", "progress": 0.0, "started_at": None, "claimed_by": None, "alive_at": None}
    return _mine(connection, number, server, **queued)


def members(connection: Connection, row: AnyRow) -> list[Member]:
    """The campaigns that a diagnosis is of."""
    if row.kind == "campaign":
        name = kept_campaigns.find(connection, row.campaign_id).name
        return [Member(row.campaign, row.campaign_id, name, row.skin_id, row.excluded)]
    return diagnosed_together.members_of(connection, [row.number])[row.number]


def campaign_of(connection: Connection, row: AnyRow) -> tuple[Campaign, list[Excluded]]:
    """The campaign of a diagnosis of one, as in `as_diagnosed`."""
    (only,) = members(connection, row)
    return as_diagnosed(connection, only)


def as_diagnosed(connection: Connection, member: Member) -> tuple[Campaign, list[Excluded]]:
    """A campaign as it was when its diagnosis was requested, and the recordings excluded by then."""
    campaign = kept_campaigns.load(connection, kept_campaigns.find(connection, member.campaign_id))
    excluded = kept_campaigns.excluded_of(connection, member.number)
    order = changes.order_of_exclusions(connection, member.campaign_id)
    # one without a change was made by an earlier underskin, before all others
    excluded = sorted(excluded, key=lambda exclusion: (order.get(exclusion.recording, 0), exclusion.at))[
        : member.excluded
    ]
    names = {exclusion.recording for exclusion in excluded}
    return replace(
        campaign, recordings=tuple(recording for recording in campaign.recordings if recording.id not in names)
    ), excluded


def _end(connection: Connection, number: int, server: str, **values: Any) -> bool:
    return _mine(connection, number, server, ended_at=now(), claimed_by=None, alive_at=None, **values)


def _mine(connection: Connection, number: int, server: str, **values: Any) -> bool:
    this = (diagnoses.c.number == number) & (diagnoses.c.claimed_by == server) & (diagnoses.c.state == "running")
    return bool(connection.execute(update(diagnoses).where(this).values(**values)).rowcount)


def clock(connection: Connection) -> float:
    """Seconds since 1970 by the database's clock, which all servers of the store share."""
    sqlite = connection.dialect.name == "sqlite"
    moment = "(julianday('now') - 2440587.5) * 86400" if sqlite else "extract(epoch FROM clock_timestamp())"
    return float(connection.execute(text(f"SELECT {moment}")).scalar_one())
