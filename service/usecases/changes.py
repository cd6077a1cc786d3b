"""What was changed of a skin or a campaign, in words: who, when, why, and whether it can be undone."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from service.store import AnyRow, changes, undo

_MOST = 20  # the latest, of which it is said whether they can be undone
_NAMES = ("name", "title")


@dataclass(frozen=True)
class ShownChange:
    """A change in words; `undone`: by a later one."""

    id: str
    words: str
    at: str
    made_from: str | None
    reason: str | None
    undone: bool
    may_be_undone: bool


def of_campaign(connection: Connection, campaign_id: str) -> list[ShownChange]:
    """The latest changes of a campaign and of its recordings."""
    return _shown(connection, changes.of_campaign(connection, campaign_id))


def of_skin(connection: Connection, root: str) -> list[ShownChange]:
    """The latest changes of a skin itself."""
    return _shown(connection, changes.of_skin(connection, root))


def _shown(connection: Connection, rows: Sequence[AnyRow]) -> list[ShownChange]:
    by_id = {row.id: row for row in rows}
    undone = {row.undoes for row in rows}
    return [
        ShownChange(
            row.id,
            f"undone: {_words(by_id[row.undoes])}" if row.undoes in by_id else _words(row),
            row.at,
            row.made_from,
            row.reason,
            row.id in undone,
            undo.standing(connection, row, rows) is None,
        )
        for row in rows[:_MOST]
    ]


def _words(row: AnyRow) -> str:
    """What was done."""
    if row.action == "exclude":
        return f"recording {row.recording} excluded"
    if row.action == "join":
        return f"skin {row.before['skin_id']} joined"
    if row.action != "annotate":
        return {"withdraw": "withdrawn", "discard": "discarded"}.get(row.action, row.action)
    renamed = [f"renamed from “{row.before[name] or row.skin_id}”" for name in _NAMES if name in row.before]
    return ", ".join(renamed + [f"{name} changed" for name in ("remark", "tags") if name in row.before])
