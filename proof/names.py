"""Names of mechanisms in truths and reports of any age."""

from collections.abc import Iterable

from underskin.mechanisms.registry import current_name


def distinct_names(names: Iterable[str]) -> tuple[str, ...]:
    """A sorted set of mechanisms under their current names, whatever older reports and rigs call them."""
    return tuple(sorted({current_name(name) for name in names}))
