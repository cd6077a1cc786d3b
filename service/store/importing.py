"""An export (service/store/export.py) into the store: to the same state, checked as any upload is.

Campaign by campaign: an import that was cut short is finished by importing the file again. What is there already and
the same is left as it is; what is there and differs refuses the file before anything is kept.
"""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints
from sqlalchemy import Connection, insert, select

from service.store import codec
from service.store.campaigns import find, rows_of
from service.store.engine import Database
from service.store.errors import Conflict
from service.store.export import exported
from service.store.tables import campaigns as campaigns_table
from service.store.tables import recordings, rigs
from service.store.tables import skins as skins_table
from underskin.recordings.campaign import SCHEMA, parse
from underskin.recordings.skin_export import ExportedCampaign, Overview

Text = Annotated[str, StringConstraints(max_length=1000)]
Id = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^/\x00-\x1f]+$")]
Time = Annotated[str, StringConstraints(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z$")]


class _Row(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class SkinRow(_Row):
    """A row of skins."""

    id: Id
    root_id: Id
    created_at: Time
    joined_to: Id | None
    joined_at: Time | None
    join_reason: Text | None


class RigRow(_Row):
    """A row of rigs."""

    skin_id: Id
    document: str
    created_at: Time


class CampaignRow(_Row):
    """A row of campaigns, but for its number and what its recordings say."""

    id: Annotated[str, StringConstraints(pattern=r"^c-[0-9a-f]{16}$")]
    skin_id: Id
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
    corrects: Id | None
    correct_reason: Text | None
    corrected_by: Id | None
    withdrawn_at: Time | None
    withdraw_reason: Text | None


class ExclusionRow(_Row):
    """Whether a recording is excluded."""

    excluded_at: Time | None
    exclude_reason: Text | None


def known(connection: Connection, overview: Overview) -> list[str]:
    """Ids of the file's campaigns that the store has; raises Conflict where a skin was joined otherwise here."""
    for row in _skin_rows(overview):
        found = connection.execute(select(skins_table).where(skins_table.c.id == row.id)).first()
        if found is not None and (found.root_id, found.joined_to) != (row.root_id, row.joined_to):
            raise Conflict(f"Skin {row.id!r} is there already and was joined otherwise; nothing was imported.")
    query = select(campaigns_table.c.id).where(campaigns_table.c.id.in_(overview.campaigns))
    return list(connection.execute(query).scalars())


def require_same(connection: Connection, campaign: ExportedCampaign) -> None:
    """Raises Conflict where a campaign that is there already says something else."""
    row = find(connection, campaign.about["id"])
    if not exported(connection, row).same_as(campaign):
        raise Conflict(f"Campaign {row.id!r} is there already and differs; nothing was imported.")


def add_skins(store: Database, overview: Overview) -> None:
    """Keep the skins, joined as they were, and their rigs."""
    rows = sorted(_skin_rows(overview), key=lambda row: row.id != row.root_id)
    rig_rows = [RigRow.model_validate(row).model_dump() for row in overview.rigs]
    with store.writing() as connection:
        for row in rows:
            if connection.execute(select(skins_table.c.id).where(skins_table.c.id == row.id)).first() is None:
                connection.execute(insert(skins_table), row.model_dump())
        for rig in rig_rows:
            same = [rigs.c[name] == value for name, value in rig.items()]
            if connection.execute(select(rigs.c.number).where(*same)).first() is None:
                connection.execute(insert(rigs), rig)


def add(store: Database, exported_campaign: ExportedCampaign) -> None:
    """Keep a campaign that is not there."""
    state = CampaignRow.model_validate(exported_campaign.about)
    exclusions = [
        ExclusionRow(excluded_at=row["excluded_at"], exclude_reason=row["exclude_reason"])
        for row in exported_campaign.recordings
    ]
    entries = [
        {**row["scalars"], **arrays}
        for row, arrays in zip(exported_campaign.recordings, exported_campaign.arrays, strict=True)
    ]
    campaign = parse({"schema": SCHEMA, **state.about, "recordings": entries})
    times = [time for recording in campaign.recordings if (time := codec.recorded_at(recording))]
    row = {
        **state.model_dump(),
        "about": codec.about(campaign),
        "recordings": len(campaign.recordings),
        "excluded": sum(entry.excluded_at is not None for entry in exclusions),
        "recorded_at": min(times, default=None),
        "revision": 0,
    }
    with store.writing() as connection:
        number = connection.execute(insert(campaigns_table).returning(campaigns_table.c.number), row).scalar_one()
        kept = [
            {**columns, **entry.model_dump()}
            for columns, entry in zip(rows_of(number, campaign.recordings), exclusions, strict=True)
        ]
        connection.execute(insert(recordings), kept)


def _skin_rows(overview: Overview) -> list[SkinRow]:
    return [SkinRow.model_validate(row) for row in overview.skins]
