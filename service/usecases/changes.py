"""Changes of a skin or a campaign in words: who, when, why, and whether they can be undone."""

from collections.abc import Sequence

from sqlalchemy import Connection

from service.schemas.changes import Change
from service.store import AnyRow, changes, models, undo

_MOST = 20  # the latest, for which it is stated whether they can be undone
_NAMES = ("name", "title")
_DONE = {"withdraw": "withdrawn", "discard": "discarded", "correct": "put in the place of another campaign"}
_STORED_FIELDS = set(Change.model_fields) - {"statement", "undone", "may_be_undone"}


def of_campaign(connection: Connection, campaign_id: str) -> list[Change]:
    """The latest changes of a campaign and of its recordings."""
    return _shown(connection, changes.of_campaign(connection, campaign_id))


def of_skin(connection: Connection, root: str) -> list[Change]:
    """The latest changes of a skin itself, and its models that were withdrawn, of which rows of models tell."""
    withdrawn = [_withdrawn(row) for row in models.of_skin(connection, root) if row.model_withdrawn_at is not None]
    recorded = _shown(connection, changes.of_skin(connection, root))
    return sorted([*recorded, *withdrawn], key=lambda change: change.at, reverse=True)[:_MOST]


def one(connection: Connection, change_id: str) -> Change:
    """A change by its id; raises Missing."""
    row = changes.find(connection, change_id)
    rows = undo.of_same(connection, row)
    return next(change for change in _shown(connection, rows, len(rows)) if change.id == change_id)


def _shown(connection: Connection, rows: Sequence[AnyRow], most: int = _MOST) -> list[Change]:
    by_id = {row.id: row for row in rows}
    undone = {row.undoes for row in rows}
    return [
        Change(
            **{name: getattr(row, name) for name in _STORED_FIELDS},
            statement=f"undone: {_words(by_id[row.undoes])}" if row.undoes in by_id else _words(row),
            undone=row.id in undone,
            may_be_undone=undo.standing(connection, row, rows) is None,
        )
        for row in rows[:most]
    ]


def _withdrawn(row: AnyRow) -> Change:
    """An adopted model withdrawn: it returns by another adoption, not by an undo."""
    return Change(
        id=row.model_id,
        action="withdraw",
        statement=f"adopted model, version {row.model_version}, withdrawn",
        skin_id=row.model_skin_id,
        campaign_id=None,
        recording=None,
        at=row.model_withdrawn_at,
        made_from=row.model_withdrawn_from,
        reason=row.model_withdraw_reason,
        before={},
        after={},
        undoes=None,
        undone=False,
        may_be_undone=False,
    )


def _words(row: AnyRow) -> str:
    """What was done."""
    if row.action == "exclude":
        return f"recording {row.recording} excluded"
    if row.action == "join":
        return f"skin {row.before['skin_id']} joined"
    if row.action != "annotate":
        return _DONE.get(row.action, row.action)
    renamed = [f"renamed from “{row.before[name] or row.skin_id}”" for name in _NAMES if name in row.before]
    return ", ".join(renamed + [f"{name} changed" for name in ("remark", "tags") if name in row.before])
