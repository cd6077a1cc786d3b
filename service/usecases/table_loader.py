"""The tables beside σ's, each read when a request first needs it: the start does not wait for them."""

from functools import cache
from pathlib import Path

from service.problems import Refusal
from underskin.errors import TableError
from underskin.surrogate.contact_table import CONTACT_TABLE, ContactTable, load_contact
from underskin.surrogate.influence_table import INFLUENCE_TABLE, InfluenceTable, load_influence


@cache
def influence_table(folder: Path) -> InfluenceTable:
    """γ_n and γ_t; raises Refusal 503 with the reason when the table cannot be read."""
    try:
        return load_influence(folder / INFLUENCE_TABLE)
    except TableError as error:
        raise Refusal(503, str(error)) from error


@cache
def contact_table(folder: Path) -> ContactTable:
    """The finite-strain contact; raises Refusal 503 with the reason when the table cannot be read."""
    try:
        return load_contact(folder / CONTACT_TABLE)
    except TableError as error:
        raise Refusal(503, str(error)) from error
