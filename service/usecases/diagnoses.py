"""Diagnoses of campaigns: asked for, and described."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection

from service.jobs.runner import basis
from service.schemas.diagnoses import DiagnosisEntry
from service.store import AnyRow, diagnoses
from service.usecases.mechanisms import catalogue
from underskin.errors import not_one_of
from underskin.surrogate.sigma_table import SigmaTable


def ask(
    connection: Connection, campaign_id: str, table: SigmaTable, sender: str | None, without: Sequence[str] = ()
) -> AnyRow:
    """Queue the diagnosis of a campaign, with this table, version and catalogue; the one that it has already, where it
    has one. Raises InvalidInput where `without` names a mechanism that is not in the catalogue."""
    known = catalogue()
    for name in without:
        if name not in known:
            raise not_one_of("without", name, known)
    return diagnoses.ask(connection, campaign_id, basis(table.sha256), sender, without)


def entry(row: AnyRow) -> dict[str, Any]:
    """The fields of DiagnosisEntry from a row of the store."""
    names = [name for name in DiagnosisEntry.model_fields if name not in ("outdated", "without")]
    values = {name: getattr(row, name) for name in names}
    return values | {"outdated": diagnoses.outdated(row), "without": diagnoses.without(row)}
