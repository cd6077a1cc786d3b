"""Errors that differ only in numbers and names: listed once, with their number and the entries."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.pages.upload.file_summary import FileSummary

_FEWEST = 3  # that are listed together
_NUMBER = re.compile(r"\d+(?:[.,]\d+)*")

Errors = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class SimilarErrors:
    """Entries, as (index in the list, name), and the errors of the first; the numbers of the others may differ."""

    entries: Sequence[tuple[int, str]]
    errors: Errors

    @property
    def first(self) -> int:
        """Place of the first."""
        return self.entries[0][0]

    def holds(self, index: int) -> bool:
        """Whether the entry of that place is among them."""
        return any(index == index_of_file for index_of_file, _ in self.entries)


def of_files(files: Sequence[FileSummary]) -> list[SimilarErrors]:
    """Groups of files; files that were rejected for the same reasons are one group."""
    return _together([(file.label, [] if file.recordings else _reasons(file)) for file in files])


def of_recordings(file: FileSummary) -> list[SimilarErrors]:
    """The refused recordings of a file."""
    return _together([(refused["id"], refused["errors"]) for refused in file.refused])


def _reasons(file: FileSummary) -> Errors:
    return [*file.errors, *(error for refused in file.refused for error in refused["errors"])]


def _together(entries: Sequence[tuple[str, Errors]]) -> list[SimilarErrors]:
    """By their first entries; fewer than three similar ones, and those without errors, are groups of one."""
    by_reason: dict[Any, list[int]] = {}
    for index, (name, errors) in enumerate(entries):
        reason = tuple(_what(name, error) for error in errors) or index
        by_reason.setdefault(reason, []).append(index)
    groups = [
        part
        for places in by_reason.values()
        for part in ([places] if len(places) >= _FEWEST else [[index] for index in places])
    ]
    return [
        SimilarErrors([(index, entries[index][0]) for index in places], entries[places[0]][1])
        for places in sorted(groups)
    ]


def _what(name: str, error: Mapping[str, Any]) -> tuple[str, str]:
    """An error without its numbers and names."""
    field, allowed = (_NUMBER.sub("#", str(error[part]).replace(name, "")) for part in ("field", "allowed"))
    return field, allowed
