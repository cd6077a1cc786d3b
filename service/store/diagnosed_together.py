"""The campaigns of a diagnosis of several, as they were when it was requested, and the skins of which all campaigns
were requested."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import orjson
from sqlalchemy import ColumnElement, Connection, Select, and_, case, exists, func, insert, select
from sqlalchemy.sql.selectable import ScalarSelect

from service.schemas.diagnoses import DiagnosisKind
from service.store import skins
from service.store.campaigns import CURRENT
from service.store.tables import AnyRow, campaigns, diagnosed_campaigns, diagnosed_skins, diagnoses, recordings
from service.store.tables import skins as skin_rows


@dataclass(frozen=True)
class Member:
    """A campaign of a diagnosis: its number and id, the requested skin, and how many recordings are excluded."""

    number: int
    campaign_id: str
    name: str
    skin_id: str
    excluded: int


@dataclass(frozen=True)
class Together:
    """Campaigns to diagnose together; `all_of`: the skins of which all campaigns are meant."""

    kind: DiagnosisKind
    name: str
    members: Sequence[Member]
    all_of: Sequence[str]

    @property
    def sha256(self) -> str:
        """Equal for the same campaigns in the same state, requested in the same way."""
        members = [[diagnosed.skin_id, diagnosed.campaign_id, diagnosed.excluded] for diagnosed in self.members]
        content = orjson.dumps([self.kind, self.name, members, sorted(self.all_of)])
        return hashlib.sha256(content).hexdigest()


def usable(connection: Connection, skin_id: str) -> list[Member]:
    """The current campaigns with recordings of a skin and of those joined to it, by arrival; locked until the
    transaction ends."""
    query = select(campaigns).where(_usable(skin_id)).order_by(campaigns.c.number).with_for_update()
    return [member(row, skin_id) for row in connection.execute(query)]


def count_usable(connection: Connection, skin_id: str) -> int:
    """How many there are."""
    return int(connection.execute(select(func.count()).select_from(campaigns).where(_usable(skin_id))).scalar_one())


def have_frfs(connection: Connection, members: Sequence[Member]) -> bool:
    """Whether one of these campaigns has FRFs that are not excluded."""
    of_these = recordings.c.campaign.in_([diagnosed.number for diagnosed in members])
    frfs = select(recordings.c.kind).where(of_these, recordings.c.kind == "frf", recordings.c.excluded_at.is_(None))
    return connection.execute(frfs.limit(1)).first() is not None


def _usable(skin_id: str) -> ColumnElement[bool]:
    of_skin = campaigns.c.skin_id.in_(skins.members(skins.root_of(skin_id)))
    return and_(of_skin, CURRENT, campaigns.c.recordings > campaigns.c.excluded)


def member(row: AnyRow, skin_id: str) -> Member:
    """A campaign's row as a part of a diagnosis of a skin."""
    return Member(row.number, row.id, row.name, skin_id, row.excluded)


def keep(connection: Connection, diagnosis: int, together: Together) -> None:
    """Store the members of the diagnosis with this number."""
    rows = [
        {"diagnosis": diagnosis, "position": position, "campaign": diagnosed.number, "skin_id": diagnosed.skin_id,
         "excluded": diagnosed.excluded}
        for position, diagnosed in enumerate(together.members)
    ]  # fmt: skip
    connection.execute(insert(diagnosed_campaigns), rows)
    if together.all_of:
        connection.execute(
            insert(diagnosed_skins), [{"diagnosis": diagnosis, "skin_id": skin_id} for skin_id in together.all_of]
        )


def members_of(connection: Connection, numbers: Sequence[int]) -> dict[int, list[Member]]:
    """The members of those of these diagnoses that are of several campaigns, by the diagnosis' number."""
    columns = (campaigns.c.number, campaigns.c.id, campaigns.c.name)
    of_diagnosis = (diagnosed_campaigns.c.diagnosis, diagnosed_campaigns.c.skin_id, diagnosed_campaigns.c.excluded)
    query = select(*columns, *of_diagnosis).join(campaigns, campaigns.c.number == diagnosed_campaigns.c.campaign)
    query = query.where(diagnosed_campaigns.c.diagnosis.in_(numbers))
    members: dict[int, list[Member]] = {}
    for row in connection.execute(query.order_by(diagnosed_campaigns.c.diagnosis, diagnosed_campaigns.c.position)):
        members.setdefault(row.diagnosis, []).append(member(row, row.skin_id))
    return members


def all_of(connection: Connection, number: int) -> list[str]:
    """The skins of which a diagnosis has all campaigns that existed."""
    query = select(diagnosed_skins.c.skin_id).where(diagnosed_skins.c.diagnosis == number)
    return list(connection.execute(query.order_by(diagnosed_skins.c.skin_id)).scalars())


def has_one_of(numbers: Select[Any]) -> ColumnElement[bool]:
    """Whether a diagnosis of several has one of these campaigns, given by a query of their numbers."""
    these = select(diagnosed_campaigns.c.diagnosis).where(diagnosed_campaigns.c.campaign.in_(numbers))
    return diagnoses.c.number.in_(these)


def has_other_than(numbers: Select[Any]) -> ColumnElement[bool]:
    """Whether a diagnosis of several has a campaign that is none of these, given by a query of numbers."""
    these = select(diagnosed_campaigns.c.diagnosis).where(diagnosed_campaigns.c.campaign.not_in(numbers))
    return diagnoses.c.number.in_(these)


def changed() -> ScalarSelect[str]:
    """What became of the first campaign that is no longer as a diagnosis of several used it; null if none changed."""
    of_diagnosis = diagnosed_campaigns.alias("own")
    its = campaigns.alias("its")
    differs = its.c.excluded != of_diagnosis.c.excluded
    how = case(
        (its.c.withdrawn_at.is_not(None), "withdrawn: " + its.c.withdraw_reason),
        (its.c.corrected_by.is_not(None), "corrected by " + its.c.corrected_by),
        else_="changed: recordings were excluded since",
    )
    return (
        select("campaign " + its.c.id + " was " + how)
        .join(of_diagnosis, of_diagnosis.c.campaign == its.c.number)
        .where(of_diagnosis.c.diagnosis == diagnoses.c.number)
        .where(its.c.withdrawn_at.is_not(None) | its.c.corrected_by.is_not(None) | differs)
        .order_by(of_diagnosis.c.position)
        .limit(1)
        .correlate(diagnoses)
        .scalar_subquery()
    )


def added() -> ScalarSelect[str]:
    """The first campaign in use that a diagnosis of all campaigns lacks because it came later; null if there is
    none."""
    skin_diagnosed, its, new = skin_rows.alias("asked"), skin_rows.alias("counting"), campaigns.alias("new")
    has = diagnosed_campaigns.alias("has")
    there = exists().where(has.c.diagnosis == diagnoses.c.number, has.c.campaign == new.c.number)
    there = there.correlate(diagnoses, new)  # or a campaign would count as there that another diagnosis has
    return (
        select(func.min(new.c.id))
        .select_from(diagnosed_skins)
        .join(skin_diagnosed, skin_diagnosed.c.id == diagnosed_skins.c.skin_id)
        .join(its, its.c.root_id == skin_diagnosed.c.root_id)
        .join(new, new.c.skin_id == its.c.id)
        .where(diagnosed_skins.c.diagnosis == diagnoses.c.number)
        .where(new.c.withdrawn_at.is_(None), new.c.corrected_by.is_(None), new.c.recordings > new.c.excluded, ~there)
        .correlate(diagnoses)
        .scalar_subquery()
    )


def outdated(row: AnyRow) -> str | None:
    """Why a diagnosis of several campaigns, by its row, is outdated; None if it is up to date."""
    if row.member_changed is not None:
        return str(row.member_changed)
    return None if row.member_added is None else f"campaign {row.member_added} was added"
