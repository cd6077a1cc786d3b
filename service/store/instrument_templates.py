"""Rig descriptions by instrument; all are stored, and the latest is offered."""

from sqlalchemy import Connection, insert, select

from service.store.tables import AnyRow, instrument_templates
from service.store.times import now


def keep(connection: Connection, instrument: str, document: str, kept_from: str | None) -> None:
    """Keep a rig description (`rig/1` as JSON) of an instrument, unless it is the latest already."""
    before = latest(connection, instrument)
    if before is None or before.document != document:
        row = {"instrument": instrument, "document": document, "kept_at": now(), "kept_from": kept_from}
        connection.execute(insert(instrument_templates), row)


def latest(connection: Connection, instrument: str) -> AnyRow | None:
    """The latest of an instrument, with when and from whom it came; None where there is none."""
    query = select(instrument_templates).where(instrument_templates.c.instrument == instrument)
    return connection.execute(query.order_by(instrument_templates.c.number.desc()).limit(1)).first()
