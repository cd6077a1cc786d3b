"""Annotations of a skin or a campaign in stored form: names, notes and tags."""

from collections.abc import Iterable

from underskin.errors import out_of_range
from underskin.recordings import validation

_LONGEST_REMARK, _LONGEST_TAGS = 10_000, 500


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
