"""All that is kept of a skin into one file (underskin/recordings/skin_export.py).

Derived figures are not in it: they are computed again. Neither are answers kept for Idempotency-Key.
"""

from pathlib import Path
from typing import Any

from sqlalchemy import Connection, select

from service.store import campaigns, diagnosis_export, skins
from service.store.codec import unpack
from service.store.tables import AnyRow, recordings, rigs
from service.store.tables import skins as skins_table
from underskin.recordings.skin_export import ExportedCampaign, Overview, write_campaign, writing


def export(connection: Connection, root: str, file: Path) -> None:
    """Write the skin `root`, and all joined to it, one campaign in memory at a time."""
    of_root = select(skins_table).where(skins_table.c.root_id == root).order_by(skins_table.c.id)
    of_rigs = select(rigs).where(rigs.c.skin_id.in_(skins.members(root))).order_by(rigs.c.number)
    rows = campaigns.of_skin(connection, root)
    diagnoses, models = diagnosis_export.exported(connection, root)
    overview = Overview(
        skin=root,
        skins=[_without(row) for row in connection.execute(of_root)],
        rigs=[_without(row, "number") for row in connection.execute(of_rigs)],
        campaigns=[row.id for row in rows],
        diagnoses=diagnoses,
        models=models,
    )
    with writing(file, overview) as target:
        for row in rows:
            write_campaign(target, row.id, exported(connection, row))


def exported(connection: Connection, row: AnyRow) -> ExportedCampaign:
    """A campaign of the store as its file has it."""
    query = select(recordings).where(recordings.c.campaign == row.number).order_by(recordings.c.position)
    rows = connection.execute(query).all()
    return ExportedCampaign(
        about=_without(row, "number", "revision"),
        recordings=[_without(kept, "campaign", "position", "arrays") for kept in rows],
        arrays=[unpack(kept.arrays) for kept in rows],
    )


def _without(row: AnyRow, *names: str) -> dict[str, Any]:
    """A row by its columns' names, as plain text: SQLAlchemy's own are of a type that JSON writers refuse."""
    return {str(name): value for name, value in row._mapping.items() if name not in names}
