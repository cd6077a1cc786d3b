"""Overview of skins: number of campaigns, the latest one, d33 over the last few, and the latest diagnosis; and a mark
that tells whether anything that a skin's page shows has changed."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from sqlalchemy import Connection, Select, and_, case, func, or_, select

from service.store import campaigns as kept
from service.store import diagnoses as kept_diagnoses
from service.store import inversions
from service.store import models as adopted_models
from service.store import skins as kept_skins
from service.store.diagnosed_together import has_one_of
from service.store.tables import AnyRow, campaigns, changes, diagnosed_campaigns, diagnoses, models, sensor_d33, skins
from service.store.tables import inversions as derived

_OF_CAMPAIGNS = ("id", "number", "name", "recordings", "excluded", "revision", "recorded_at", "refused")
_LATELY = 12  # campaigns of a trend


def numbers_of(root: str) -> Select[Any]:
    """Numbers of all campaigns of a skin and of those joined to it."""
    return select(campaigns.c.number).where(campaigns.c.skin_id.in_(kept_skins.members(root)))


def mark(connection: Connection, root: str, table_sha256: str) -> str:
    """Another one after an arrival, a withdrawal, a correction, an exclusion, a join, a computed d33, a step of a
    diagnosis, an adoption and any other change that is recorded."""
    of_skin = campaigns.c.skin_id.in_(kept_skins.members(root))
    numbers = numbers_of(root)
    of_campaigns = diagnoses.c.campaign.in_(numbers) | has_one_of(numbers)
    queries = (
        select(func.count(), func.max(campaigns.c.number), func.sum(campaigns.c.revision)).where(of_skin),
        select(func.count()).select_from(campaigns).join(derived, inversions.fresh(table_sha256)).where(of_skin),
        select(diagnoses.c.state, func.count(), func.max(diagnoses.c.number))
        .where(of_campaigns)
        .group_by(diagnoses.c.state)
        .order_by(diagnoses.c.state),
        select(func.count(), func.count(models.c.withdrawn_at)).where(models.c.skin_id.in_(kept_skins.members(root))),
        select(func.count()).select_from(skins).where(skins.c.root_id == root),
        select(func.count()).where(changes.c.skin_id.in_(kept_skins.members(root))),
    )
    counts = [[tuple(row) for row in connection.execute(query)] for query in queries]
    return hashlib.sha256(repr(counts).encode()).hexdigest()[:16]


@dataclass
class Glance:
    """One skin; `d33`: (time, median over the sensors [pC/N]) of the last few campaigns, by time."""

    skin_id: str
    campaigns: int
    last: AnyRow | None  # campaign; None where none is current
    cursor: int
    d33: list[tuple[str, float]] = field(default_factory=list)
    # the latest of the last campaign that has one, of it alone, else of it with others; and that campaign, where it is
    # not the last
    diagnosis: AnyRow | None = None
    diagnosed: AnyRow | None = None
    model: AnyRow | None = None  # in force
    # d33 of the array in the last campaign that has one, as `D33.array` has it, by the model in force, and by the
    # paper's; None where not kept
    adopted_array: Mapping[str, Any] | None = None
    paper_array: Mapping[str, Any] | None = None
    by_paper: Mapping[str, Any] | None = None  # the whole answer
    # of how many sensors that campaign tells d33, and how many the skin has
    measured: tuple[int, int] | None = None
    title: str | None = None
    tags: str | None = None


def glances(
    connection: Connection, contains: str | None, before: int | None, limit: int, table_sha256: str
) -> list[Glance]:
    """Skins by their latest campaign in use, as `Glance.last` has it, without one by what was withdrawn; those behind
    the one with the campaign of the number `before`."""
    last = func.max(campaigns.c.number)
    latest = func.coalesce(func.max(case((kept.CURRENT, kept.TIME))), func.max(kept.TIME))
    listed = func.count(case((kept.LISTED, campaigns.c.number)))  # not discarded ones
    query = select(skins.c.root_id, listed, last).join(skins, skins.c.id == campaigns.c.skin_id)
    put_away = select(skins.c.id).where(skins.c.discarded_at.is_not(None)).correlate(None)
    query = query.where(skins.c.root_id.not_in(put_away))
    query = query.group_by(skins.c.root_id).order_by(latest.desc(), last.desc()).limit(limit)
    if contains is not None:
        named = select(skins.c.id).where(kept_skins.called(contains)).correlate(None)
        query = query.where(skins.c.root_id.in_(named))
    if before is not None:
        root = (
            select(skins.c.root_id)
            .join(campaigns, skins.c.id == campaigns.c.skin_id)
            .where(campaigns.c.number == before)
        )
        its = select(latest).join(skins, skins.c.id == campaigns.c.skin_id)
        its_latest = connection.execute(its.where(skins.c.root_id == root.scalar_subquery())).scalar()
        query = query.having(or_(latest < its_latest, and_(latest == its_latest, last < before)))
    by_skin = {row[0]: Glance(row[0], row[1], None, row[2]) for row in connection.execute(query)}
    recent = _recent(connection, list(by_skin))
    values = medians(connection, [row.number for row in recent], table_sha256)
    numbers = [row.number for row in recent]
    diagnosed = _latest_together(connection, numbers) | latest_diagnoses(connection, numbers)
    for row in recent:
        glance = by_skin[row.root_id]
        glance.last = row
        if row.number in values:
            glance.d33.append((row.time, values[row.number]))
        if row.number in diagnosed:
            glance.diagnosis, glance.diagnosed = diagnosed[row.number], row
    adopted = adopted_models.in_force_of(connection, list(by_skin))
    recent_by_root = {row.root_id: row for row in recent if row.number in values}
    sensors = measured_sensors(connection, [row.number for row in recent_by_root.values()], table_sha256)
    for root, glance in by_skin.items():
        glance.model = adopted.get(root)
        if glance.last is not None:
            glance.diagnosed = None if glance.diagnosed == glance.last else glance.diagnosed
            _add_d33(connection, glance, recent_by_root.get(root, glance.last), table_sha256)
        if root in recent_by_root:
            glance.measured = sensors.get(recent_by_root[root].number)
    titles = select(skins.c.id, skins.c.title, skins.c.tags).where(skins.c.id.in_(by_skin))
    for skin_id, title, tags in connection.execute(titles):
        by_skin[skin_id].title, by_skin[skin_id].tags = title, tags
    return list(by_skin.values())


def _add_d33(connection: Connection, glance: Glance, campaign: AnyRow, table_sha256: str) -> None:
    """Add d33 of the array in a campaign, by the paper's model and by the one in force."""
    glance.by_paper = by_paper = inversions.find(connection, campaign, table_sha256)
    glance.paper_array = None if by_paper is None else by_paper["array"]
    if glance.model is not None:
        by_model = inversions.find_adopted(connection, campaign, glance.model.model_id, table_sha256)
        glance.adopted_array = None if by_model is None else by_model["array"]


def _recent(connection: Connection, roots: Sequence[str]) -> Sequence[AnyRow]:
    """The last few current campaigns of each skin, the oldest first."""
    order = (kept.TIME.desc(), campaigns.c.number.desc())
    rank = func.row_number().over(partition_by=skins.c.root_id, order_by=order)
    columns = [campaigns.c[name] for name in _OF_CAMPAIGNS]
    ranked = (
        select(skins.c.root_id, kept.TIME.label("time"), rank.label("place"), *columns)
        .join(skins, skins.c.id == campaigns.c.skin_id)
        .where(kept.CURRENT, skins.c.root_id.in_(roots))
        .subquery()
    )
    query = select(ranked).where(ranked.c.place <= _LATELY).order_by(ranked.c.time, ranked.c.number)
    return connection.execute(query).all()


def medians(connection: Connection, numbers: Sequence[int], table_sha256: str) -> dict[int, float]:
    """Median over the sensors of d33 [pC/N], of those campaigns of which it is kept."""
    query = (
        select(sensor_d33.c.campaign, sensor_d33.c.d33_pc_per_n)
        .join(campaigns, campaigns.c.number == sensor_d33.c.campaign)
        .join(derived, inversions.fresh(table_sha256))
        .where(campaigns.c.number.in_(numbers))
    )
    by_campaign: dict[int, list[float]] = {}
    for number, value in connection.execute(query):
        by_campaign.setdefault(number, []).append(value)
    return {number: median(values) for number, values in by_campaign.items()}


def measured_sensors(connection: Connection, numbers: Sequence[int], table_sha256: str) -> dict[int, tuple[int, int]]:
    """How many sensors have a stored d33, and how many the skin has, by campaign."""
    counted = (
        select(sensor_d33.c.campaign, func.count().label("measured"))
        .join(campaigns, campaigns.c.number == sensor_d33.c.campaign)
        .join(derived, inversions.fresh(table_sha256))
        .where(campaigns.c.number.in_(numbers))
        .group_by(sensor_d33.c.campaign)
        .subquery()
    )
    query = select(counted, campaigns.c.about).join(campaigns, campaigns.c.number == counted.c.campaign)
    return {row.campaign: (row.measured, len(row.about["skin"]["sensors"])) for row in connection.execute(query)}


def of_array(answer: Mapping[str, Any] | None) -> float | None:
    """d33 of the array [pC/N] of an answer that is kept."""
    return None if answer is None or answer["array"] is None else float(answer["array"]["d33_pc_per_n"])


def latest_diagnoses(connection: Connection, numbers: Sequence[int]) -> dict[int, AnyRow]:
    """The latest diagnosis of each of these campaigns that has one of it alone."""
    query = (
        kept_diagnoses.rows()
        .where(diagnoses.c.campaign.in_(numbers), diagnoses.c.kind == "campaign")
        .order_by(diagnoses.c.number)
    )
    return {row.campaign: row for row in connection.execute(query)}


def _latest_together(connection: Connection, numbers: Sequence[int]) -> dict[int, AnyRow]:
    """The latest diagnosis of each of these campaigns together with others, of one skin or of a fleet."""
    query = (
        kept_diagnoses.rows()
        .add_columns(diagnosed_campaigns.c.campaign.label("member"))
        .join(diagnosed_campaigns, diagnosed_campaigns.c.diagnosis == diagnoses.c.number)
        .where(diagnosed_campaigns.c.campaign.in_(numbers))
        .order_by(diagnoses.c.number)
    )
    return {row.member: row for row in connection.execute(query)}
