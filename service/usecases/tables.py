"""The tables in use: domain and origin of each; those other than σ's are read when a request first needs them."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from service.problems import Refusal
from service.schemas.tables import TableAxis, TableEntry, Tables
from underskin.errors import TableError
from underskin.surrogate.hdf5_format import CONTACT_TABLE, ContactTable, load_contact
from underskin.surrogate.influence_table import INFLUENCE_TABLE, InfluenceTable, load_influence
from underskin.surrogate.sigma_table import ContactModel, ContactName, SigmaTable
from underskin.surrogate.solved_contact import contact_model

_Table = TypeVar("_Table")
_NAMED = {"schema", "data_sha256", "default"}


@cache
def influence_table(folder: Path) -> InfluenceTable:
    """γ_n and γ_t; raises Refusal 503 with the reason when the table cannot be read."""
    return _read(load_influence, folder / INFLUENCE_TABLE)


@cache
def _contact_table(folder: Path) -> ContactTable:
    """The finite-strain contact; raises Refusal 503 with the reason when the table cannot be read."""
    return _read(load_contact, folder / CONTACT_TABLE)


def requested_contact(table: SigmaTable, name: ContactName) -> ContactModel:
    """The contact of this name; raises Refusal 503 with the reason when its table cannot be read."""
    try:
        return contact_model(table, name)
    except TableError as error:
        raise Refusal(503, str(error)) from error


def _read(load: Callable[[Path], _Table], file: Path) -> _Table:
    try:
        return load(file)
    except TableError as error:
        raise Refusal(503, str(error)) from error


def tables(sigma_table: SigmaTable, folder: Path) -> Tables:
    """The tables that answers come from; those of `folder` beside that of σ."""
    return Tables(tables=[_entry(sigma_table), _entry(influence_table(folder)), _entry(_contact_table(folder))])


def _entry(table: SigmaTable | InfluenceTable | ContactTable) -> TableEntry:
    axes = [
        TableAxis(name=name, low=low, high=high, nodes=len(nodes))
        for (name, (low, high)), nodes in zip(table.domain.items(), table.axes, strict=True)
    ]
    about = {name: np.asarray(value).tolist() for name, value in table.attributes.items() if name not in _NAMED}
    schema = str(table.attributes["schema"])
    name = str(table.attributes["quantity"])
    return TableEntry(name=name, table_schema=schema, table_sha256=table.sha256, axes=axes, about=about)
