"""Models of skins, adopted from diagnoses; all are stored, and the latest is in force unless it was withdrawn."""

import secrets
from collections.abc import Sequence
from typing import Any

from sqlalchemy import Connection, Select, func, insert, select, update

from service.store import diagnoses as kept
from service.store import skins, times
from service.store.errors import Conflict, Missing
from service.store.tables import AnyRow, diagnoses, models
from service.store.tables import skins as skin_rows
from service.store.times import now

_MODEL_COLUMNS = [column.label(f"model_{column.name}") for column in models.c]  # next to the columns of the diagnosis


def adopt(connection: Connection, root: str, diagnosis: AnyRow, adopted_from: str | None) -> AnyRow:
    """Make a diagnosis the model of the skin `root`; the one in force, where it is that one already.

    Raises Conflict where the diagnosis is of another skin, or not of its campaign as it is now.
    """
    skins.lock(connection, [root])
    if skins.require_root(connection, diagnosis.skin_id) != root:
        raise Conflict(f"Diagnosis {diagnosis.id!r} is of skin {diagnosis.skin_id!r}, not of {root!r}.")
    why = kept.outdated(diagnosis)
    if why is not None:
        raise Conflict(f"Campaign {diagnosis.campaign_id!r} of diagnosis {diagnosis.id!r} was {why}.")
    before = in_force(connection, root)
    if before is not None and before.id == diagnosis.id:
        return before
    last = connection.execute(select(func.max(models.c.version)).where(_of_root(root))).scalar() or 0
    row = {
        "id": f"m-{secrets.token_hex(8)}",
        "skin_id": root,
        "version": last + 1,
        "diagnosis": diagnosis.number,
        "adopted_at": times.next_of(connection, [root]),
        "adopted_from": adopted_from,
    }
    connection.execute(insert(models), row)
    adopted = in_force(connection, root)
    assert adopted is not None
    return adopted


def withdraw(connection: Connection, root: str, reason: str, withdrawn_from: str | None) -> AnyRow:
    """Have no model in force; the one that was, with who withdrew it. Raises Missing where there is none."""
    skins.lock(connection, [root])
    before = in_force(connection, root)
    if before is None:
        raise Missing(f"Skin {root!r} has no adopted model.")
    values = {"withdrawn_at": now(), "withdrawn_from": withdrawn_from, "withdraw_reason": reason}
    connection.execute(update(models).where(models.c.number == before.model_number).values(**values))
    withdrawn = last(connection, root)
    assert withdrawn is not None
    return withdrawn


def last(connection: Connection, root: str) -> AnyRow | None:
    """The model adopted last for a skin or for one joined to it, withdrawn or not; None where there is none."""
    return connection.execute(_rows(root).limit(1)).first()


def in_force(connection: Connection, root: str) -> AnyRow | None:
    """The same unless it was withdrawn: those before it do not come back."""
    row = last(connection, root)
    return None if row is None or row.model_withdrawn_at is not None else row


def all_in_force(connection: Connection) -> list[AnyRow]:
    """As `in_force`, of every skin that has one."""
    roots = connection.execute(select(skin_rows.c.root_id).distinct()).scalars().all()
    return list(in_force_of(connection, roots).values())


def in_force_of(connection: Connection, roots: Sequence[str]) -> dict[str, AnyRow]:
    """As `in_force`, of each of these skins that has one."""
    query = (
        kept.rows()
        .add_columns(*_MODEL_COLUMNS, skin_rows.c.root_id)
        .join(models, models.c.diagnosis == diagnoses.c.number)
    )
    query = query.join(skin_rows, skin_rows.c.id == models.c.skin_id).where(skin_rows.c.root_id.in_(roots))
    rows = connection.execute(query.order_by(models.c.adopted_at, models.c.number))
    latest = {row.root_id: row for row in rows}
    return {root: row for root, row in latest.items() if row.model_withdrawn_at is None}


def of_skin(connection: Connection, root: str) -> Sequence[AnyRow]:
    """All models of a skin and of those joined to it, the latest first."""
    return connection.execute(_rows(root)).all()


def _rows(root: str) -> Select[Any]:
    """Rows of diagnoses as `diagnoses.rows` has them, with their models."""
    query = kept.rows().add_columns(*_MODEL_COLUMNS).join(models, models.c.diagnosis == diagnoses.c.number)
    return query.where(_of_root(root)).order_by(models.c.adopted_at.desc(), models.c.number.desc())


def _of_root(root: str) -> Any:
    return models.c.skin_id.in_(skins.members(root))
