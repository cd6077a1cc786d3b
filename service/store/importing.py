"""An export (service/store/export.py) into the store: to the same state, after every part of it was checked.

Campaign by campaign: an import that was cut short is finished by importing the file again. What is there already and
the same is left as it is; what is there and differs refuses the file before anything is kept.
"""

from collections.abc import Sequence

from sqlalchemy import Connection, insert, select, update

from service.store.campaigns import find, rows_of
from service.store.engine import Database
from service.store.errors import Conflict
from service.store.export import exported
from service.store.import_checks import CheckedCampaign, CheckedOverview, SkinRow
from service.store.tables import campaigns as campaigns_table
from service.store.tables import recordings, rigs
from service.store.tables import skins as skins_table
from underskin.recordings.skin_export import ExportedCampaign

_AT_A_TIME = 1000  # names in one query: databases limit their number


def require_joined_alike(connection: Connection, skins: Sequence[SkinRow]) -> None:
    """Raises Conflict where a skin is there already and was joined otherwise."""
    for row in skins:
        found = connection.execute(select(skins_table).where(skins_table.c.id == row.id)).first()
        if found is not None and (found.root_id, found.joined_to) != (row.root_id, row.joined_to):
            raise Conflict(f"Skin {row.id!r} is there already and was joined otherwise; nothing was imported.")


def known(connection: Connection, names: Sequence[str]) -> set[str]:
    """Those of the file's campaigns that the store has."""
    found: set[str] = set()
    for start in range(0, len(names), _AT_A_TIME):
        these = campaigns_table.c.id.in_(names[start : start + _AT_A_TIME])
        found.update(connection.execute(select(campaigns_table.c.id).where(these)).scalars())
    return found


def require_same(connection: Connection, name: str, campaign: ExportedCampaign) -> None:
    """Raises Conflict where a campaign that is there already says something else."""
    if not exported(connection, find(connection, name)).same_as(campaign):
        raise Conflict(f"Campaign {name!r} is there already and differs; nothing was imported.")


def add_skins(store: Database, checked: CheckedOverview) -> None:
    """Keep the skins, joined as they were, and their rigs."""
    with store.writing() as connection:
        require_joined_alike(connection, checked.skins)
        for row in sorted(checked.skins, key=lambda row: row.id != row.root_id):  # the root first: others refer to it
            if connection.execute(select(skins_table.c.id).where(skins_table.c.id == row.id)).first() is None:
                connection.execute(insert(skins_table), {**row.model_dump(), "joined_to": None})
        for row in checked.skins:  # and to each other
            this = update(skins_table).where(skins_table.c.id == row.id)
            connection.execute(this.values(joined_to=row.joined_to))
        for rig in (row.model_dump() for row in checked.rigs):
            same = [rigs.c[name] == value for name, value in rig.items()]
            if connection.execute(select(rigs.c.number).where(*same)).first() is None:
                connection.execute(insert(rigs), rig)


def add(store: Database, checked: CheckedCampaign) -> None:
    """Keep a campaign that is not there."""
    with store.writing() as connection:
        number = connection.execute(insert(campaigns_table).returning(campaigns_table.c.number), checked.row)
        kept = [
            {**columns, **entry.model_dump()}
            for columns, entry in zip(
                rows_of(number.scalar_one(), checked.campaign.recordings), checked.exclusions, strict=True
            )
        ]
        connection.execute(insert(recordings), kept)
