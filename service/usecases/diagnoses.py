"""Diagnoses of campaigns: asked for, and described."""

from typing import Any

from sqlalchemy import Connection

from service.schemas.diagnoses import DiagnosisEntry
from service.store import AnyRow, diagnoses
from underskin import __version__
from underskin.surrogate.sigma_table import SigmaTable


def ask(connection: Connection, campaign_id: str, table: SigmaTable, sender: str | None) -> AnyRow:
    """Queue the diagnosis of a campaign, with this table and version; the one that it has already, where it has one."""
    return diagnoses.ask(connection, campaign_id, table.sha256, __version__, sender)


def entry(row: AnyRow) -> dict[str, Any]:
    """The fields of DiagnosisEntry from a row of the store."""
    names = [name for name in DiagnosisEntry.model_fields if name != "outdated"]
    return {name: getattr(row, name) for name in names} | {"outdated": diagnoses.outdated(row)}
