"""All that is kept of a skin in one HDF5 file, `skin-export/1` (docs/store.md), and back.

    /                     attributes schema, skin
    /skins, /rigs         JSON text: rows of the tables
    /campaigns/<id>       JSON text `about` (row of the campaign) and `recordings` (rows, no arrays); for each array
                          all recordings' values one behind another in `arrays/<name>`, their numbers in `lengths/<name>`

Derived figures are not in it: they are computed again. Neither are answers kept for Idempotency-Key.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import orjson
from sqlalchemy import Connection, Row, select

from service.store import campaigns, skins
from service.store.arrays import unpack
from service.store.tables import recordings, rigs
from service.store.tables import skins as skins_table

SCHEMA = "skin-export/1"
_UNKEPT = ("number", "revision", "skin_id")


def write(connection: Connection, root: str, file: Path) -> None:
    """Write the skin `root`, and all joined to it, one campaign in memory at a time."""
    members = skins.members(root)
    with h5py.File(file, "w", libver="latest") as target:
        target.attrs["schema"], target.attrs["skin"] = SCHEMA, root
        of_root = select(skins_table).where(skins_table.c.root_id == root).order_by(skins_table.c.id)
        of_rigs = select(rigs).where(rigs.c.skin_id.in_(members)).order_by(rigs.c.number)
        _text(target, "skins", [dict(row._mapping) for row in connection.execute(of_root)])
        _text(target, "rigs", [_without(row, "number") for row in connection.execute(of_rigs)])
        group = target.create_group("campaigns", track_order=True)
        for row in list(campaigns.of_skin(connection, root)):
            _write_campaign(connection, row, group.create_group(row.id))


def _write_campaign(connection: Connection, row: Row[Any], group: Any) -> None:
    rows = connection.execute(
        select(recordings).where(recordings.c.campaign == row.number).order_by(recordings.c.position)
    ).all()
    _text(group, "about", _without(row, "number", "revision"))
    _text(group, "recordings", [_without(kept, "campaign", "position", "arrays") for kept in rows])
    arrays = [unpack(kept.arrays) for kept in rows]
    for name in dict.fromkeys(name for kept in arrays for name in kept):
        columns = [kept.get(name, _NOTHING) for kept in arrays]
        group[f"lengths/{name}"] = np.array([len(column) for column in columns], dtype=np.int64)
        group.create_dataset(f"arrays/{name}", data=np.concatenate(columns), compression="gzip", shuffle=True)


_NOTHING = np.empty(0)


def _text(group: Any, name: str, document: Any) -> None:
    group[name] = np.frombuffer(orjson.dumps(document), np.uint8)


def _without(row: Row[Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in row._mapping.items() if name not in names}
