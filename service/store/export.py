"""Export of all stored data of a skin to one file (underskin/recordings/skin_export.py), and import to the same
state.

Derived figures and answers kept for Idempotency-Keys are not exported. The import proceeds campaign by campaign: an
interrupted one is completed by importing the file again. Identical data are left as they are; differing data reject the
file before anything is stored.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, insert, select, update

from service.store import campaigns, diagnosis_export, import_checks, skins
from service.store.codec import unpack
from service.store.engine import Database, holds
from service.store.errors import Conflict
from service.store.import_checks import CheckedOverview, ImportedCampaign, SkinRow
from service.store.tables import AnyRow, changes, recordings, rigs
from service.store.tables import campaigns as campaigns_table
from service.store.tables import skins as skins_table
from underskin.recordings.skin_export import ExportedCampaign, Overview, write_campaign, writing

_AT_A_TIME = 1000  # names in one query: databases limit their number


def export(connection: Connection, root: str, file: Path) -> None:
    """Write the skin `root` and all skins joined to it, one campaign in memory at a time."""
    of_root = select(skins_table).where(skins_table.c.root_id == root).order_by(skins_table.c.id)
    of_rigs = select(rigs).where(rigs.c.skin_id.in_(skins.members(root))).order_by(rigs.c.number)
    of_changes = select(changes).where(changes.c.skin_id.in_(skins.members(root))).order_by(changes.c.number)
    rows = campaigns.of_skin(connection, root)
    diagnoses, models = diagnosis_export.exported(connection, root)
    overview = Overview(
        skin=root,
        skins=[_without(row) for row in connection.execute(of_root)],
        rigs=[_without(row, "number") for row in connection.execute(of_rigs)],
        campaigns=[row.id for row in rows],
        diagnoses=diagnoses,
        models=models,
        changes=[_without(row, "number") for row in connection.execute(of_changes)],
    )
    with writing(file, overview) as target:
        for row in rows:
            write_campaign(target, row.id, exported(connection, row))


def exported(connection: Connection, row: AnyRow) -> ExportedCampaign:
    """A stored campaign in the form of the file."""
    query = select(recordings).where(recordings.c.campaign == row.number).order_by(recordings.c.position)
    rows = connection.execute(query).all()
    return ExportedCampaign(
        about=_without(row, "number", "revision"),
        recordings=[_without(recording_row, "campaign", "position", "arrays") for recording_row in rows],
        arrays=[unpack(recording_row.arrays) for recording_row in rows],
    )


def _without(row: AnyRow, *names: str) -> dict[str, Any]:
    """A row by its columns' names, as plain text: SQLAlchemy's own string type is rejected by JSON writers. Columns
    that older files lack are included if they hold something."""
    held = {str(name): value for name, value in row._mapping.items() if name not in names}
    return {name: value for name, value in held.items() if name not in import_checks.NEWER or value is not None}


def otherwise_joined(connection: Connection, skins: Sequence[SkinRow]) -> list[str]:
    """Conflicts: skins in the store that were joined differently."""
    clashes = []
    for row in skins:
        stored = connection.execute(select(skins_table).where(skins_table.c.id == row.id)).first()
        if stored is not None and (stored.root_id, stored.joined_to) != (row.root_id, row.joined_to):
            clashes.append(f"Skin {row.id!r} is there already and was joined otherwise")
    return clashes


def stored_rows(connection: Connection, names: Sequence[str]) -> dict[str, AnyRow]:
    """Rows, by id, of those of the file's campaigns that are in the store."""
    rows: dict[str, AnyRow] = {}
    for start in range(0, len(names), _AT_A_TIME):
        these = campaigns_table.c.id.in_(names[start : start + _AT_A_TIME])
        rows.update((row.id, row) for row in connection.execute(select(campaigns_table).where(these)))
    return rows


def differs(connection: Connection, row: AnyRow, campaign: ExportedCampaign) -> bool:
    """Whether a stored campaign, by its row, differs."""
    return not exported(connection, row).same_as(campaign)


def add_skins(store: Database, checked: CheckedOverview) -> None:
    """Store the skins with their joins and rigs; a skin discarded here but not in the file is restored. Raises
    Conflict, because others may have joined them meanwhile."""
    with store.writing() as connection:
        clashes = otherwise_joined(connection, checked.skins)
        if clashes:
            raise Conflict(f"{clashes[0]}; nothing was imported.")
        for row in sorted(checked.skins, key=lambda row: row.id != row.root_id):  # the root first: others refer to it
            if not holds(connection, skins_table, id=row.id):
                connection.execute(insert(skins_table), {**row.model_dump(), "joined_to": None})
        for row in checked.skins:  # and to each other
            this = update(skins_table).where(skins_table.c.id == row.id)
            connection.execute(this.values(joined_to=row.joined_to))
        for rig in (row.model_dump() for row in checked.rigs):
            if not holds(connection, rigs, **rig):
                connection.execute(insert(rigs), rig)
        for change in checked.changes:
            if not holds(connection, changes, id=change.id):
                connection.execute(insert(changes), change.model_dump())
        for root in (row.id for row in checked.skins if row.id == row.root_id and row.discarded_at is None):
            skins.bring_back(connection, root)


def add(store: Database, checked: ImportedCampaign) -> None:
    """Store a missing campaign; if figures use it, its skin is listed again."""
    exclusions = [exclusion.model_dump() for exclusion in checked.exclusions]
    with store.writing() as connection:
        if checked.row["withdrawn_at"] is None and checked.row["corrected_by"] is None:
            skins.bring_back(connection, skins.require_root(connection, checked.row["skin_id"]))
        campaigns.keep(connection, checked.row, checked.campaign.recordings, exclusions)
