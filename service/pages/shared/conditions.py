"""Conditions that a lab noted under names of its own, as columns of a table."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

Noted = Mapping[str, float | str]

_MOST = 8  # columns


@dataclass(frozen=True)
class ConditionColumn:
    """A name, and whether all that was noted under it are numbers."""

    name: str
    numeric: bool


@dataclass(frozen=True)
class ConditionColumns:
    """The shown columns, and the names of those without room."""

    shown: Sequence[ConditionColumn]
    others: Sequence[str]


def condition_columns(recordings: Iterable[Noted | None]) -> ConditionColumns:
    """Every name that any of the recordings has, in the order of their appearance."""
    numeric: dict[str, bool] = {}
    for noted in recordings:
        for name, value in (noted or {}).items():
            numeric[name] = numeric.get(name, True) and not isinstance(value, str)
    columns = [ConditionColumn(name, all_numbers) for name, all_numbers in numeric.items()]
    return ConditionColumns(columns[:_MOST], [column.name for column in columns[_MOST:]])
