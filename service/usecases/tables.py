"""The tables in use: domain and origin of each."""

from pathlib import Path

import numpy as np

from service.schemas.tables import TableAxis, TableEntry, Tables
from service.usecases.table_loader import contact_table, influence_table
from underskin.surrogate.contact_table import ContactTable
from underskin.surrogate.influence_table import InfluenceTable
from underskin.surrogate.sigma_table import SigmaTable

_NAMED = {"schema", "data_sha256", "default"}


def tables(sigma_table: SigmaTable, folder: Path) -> Tables:
    """The tables that answers come from; those of `folder` beside that of σ."""
    return Tables(tables=[_entry(sigma_table), _entry(influence_table(folder)), _entry(contact_table(folder))])


def _entry(table: SigmaTable | InfluenceTable | ContactTable) -> TableEntry:
    axes = [
        TableAxis(name=name, low=low, high=high, nodes=len(nodes))
        for (name, (low, high)), nodes in zip(table.domain.items(), table.axes, strict=True)
    ]
    about = {name: np.asarray(value).tolist() for name, value in table.attributes.items() if name not in _NAMED}
    schema = str(table.attributes["schema"])
    name = str(table.attributes["quantity"])
    return TableEntry(name=name, table_schema=schema, table_sha256=table.sha256, axes=axes, about=about)
