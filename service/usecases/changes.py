"""Changes of a skin or a campaign: names, notes and tags in stored form, and every change in words: who, when, why, and
whether it can be undone."""

from collections.abc import Iterable, Sequence

from sqlalchemy import Connection

from service.schemas.changes import Change
from service.store import AnyRow, changes, models, undo
from underskin.errors import out_of_range
from underskin.recordings import validation

_LONGEST_REMARK, _LONGEST_TAGS = 10_000, 500
_MOST = 20  # the latest, for which it is stated whether they can be undone
_NAMES = ("name", "title")
_DONE = {"withdraw": "withdrawn", "discard": "discarded", "correct": "put in the place of another campaign"}
_STORED_FIELDS = set(Change.model_fields) - {"statement", "undone", "may_be_undone"}


def name(typed: str) -> str:
    """The name of a campaign; raises InvalidInput where there is none, or it cannot be one."""
    return validation.name("name", typed.strip(), False)


def title(typed: str | None) -> str | None:
    """The name of a skin beside its id, None where empty; raises InvalidInput."""
    return validation.name("title", typed.strip(), False) if typed and typed.strip() else None


def remark(typed: str | None) -> str | None:
    """Notes, None where empty; raises InvalidInput."""
    return _bounded("remark", (typed or "").replace("\r\n", "\n").strip(), _LONGEST_REMARK)


def tags(typed: Iterable[str] | None) -> str | None:
    """Each tag once, with commas between them, None where there is none; raises InvalidInput."""
    words = (" ".join(tag.split()) for part in typed or () for tag in part.split(","))
    return _bounded("tags", ", ".join(dict.fromkeys(word for word in words if word)), _LONGEST_TAGS)


def words(stored: str | None) -> list[str]:
    """The stored tags as a list."""
    return stored.split(", ") if stored else []


def _bounded(field: str, typed: str, most: int) -> str | None:
    if len(typed) > most or "\x00" in typed:
        allowed = f"must have at most {most} characters, none of them null"
        raise out_of_range(field, f"{len(typed)} characters", allowed)
    return typed or None


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
            statement=f"undone: {_in_words(by_id[row.undoes])}" if row.undoes in by_id else _in_words(row),
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


def _in_words(row: AnyRow) -> str:
    """What was done."""
    if row.action == "exclude":
        return f"recording {row.recording} excluded"
    if row.action == "join":
        return f"skin {row.before['skin_id']} joined"
    if row.action != "annotate":
        return _DONE.get(row.action, row.action)
    renamed = [f"renamed from “{row.before[name] or row.skin_id}”" for name in _NAMES if name in row.before]
    return ", ".join(renamed + [f"{name} changed" for name in ("remark", "tags") if name in row.before])
