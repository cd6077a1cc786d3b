"""Names of mechanisms in truths and reports of any age."""

from collections.abc import Iterable

from underskin.mechanisms.registry import current_name


def distinct_names(names: Iterable[str]) -> tuple[str, ...]:
    """A set of mechanisms, sorted, in which a law has one name, whatever older reports and rigs call it."""
    return tuple(sorted({current_name(name) for name in names}))
