"""Errors of an upload in the words of its form (for files without a form, in those of the request); those that differ
only in numbers and names are listed once."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from service.ingest.accept import RIG
from service.ingest.rig_words import CHANNELS, RECORDING, SKIN
from service.pages.shared.forms import UNLIKELY, labels_of, unsigned, worded
from service.pages.upload.file_summary import ChannelSummary, FileSummary
from service.pages.upload.mapping import CHOICES, RATE, SPRING, WORKBENCH_WORDS
from underskin.errors import ErrorCode

_WORDS = {
    **CHOICES,
    SPRING: "spring constant [N/m]",
    **labels_of((*SKIN, *RECORDING)),
    "sensors": "layout",
    "sign": "“automatic” as the sign",
    RATE: "sample rate [Hz]",
    **WORKBENCH_WORDS,
}
_OF_CHANNEL = {"unit": "true unit", "sensitivity": "sensitivity", "sensitivity_unit": "unit of the sensitivity"}
Error = Mapping[str, Any]
Channels = Sequence[ChannelSummary]  # of the file with the error: the form is for one that has any
_FEWEST = 3  # that are listed together
_NUMBER = re.compile(r"\d+(?:[.,]\d+)*")
Errors = Sequence[Mapping[str, Any]]


def field_words(field: str) -> str:
    """A field as the form calls it; others as they are."""
    if field.startswith("derived."):
        return f"formula of {field.removeprefix('derived.')}"
    part, _, of_channel = field.removeprefix("channels.").partition(".")
    if part in CHOICES and of_channel in _OF_CHANNEL:
        return f"{_OF_CHANNEL[of_channel]} of the {CHOICES[part]}"
    if field in _OF_CHANNEL:
        return _OF_CHANNEL[field]
    return _WORDS.get(field.removeprefix("skin.").removeprefix("recording.").removeprefix("channels."), field)


def field_of(error: Error, channels: Channels) -> str:
    """The field that is wrong."""
    return field_words(error["field"]) if channels else str(error["field"])


def ids_of(refused: Sequence[Error], field: str) -> str:
    """HTML ids of the errors of a form field, separated by blanks; none for errors in a rig description that was
    sent."""
    places = [error["field"].removeprefix("skin.").removeprefix("recording.") for error in refused if RIG not in error]
    return " ".join(f"refused-{number}" for number, refused_field in enumerate(places, 1) if refused_field == field)


def what_came(error: Error, channels: Channels) -> Any:
    """The rejected value; None if the form has no field for it, such as a channel that its kind of recording lacks."""
    return None if channels and _is_of_other_kind(error) else error["value"]


def what_to_do(error: Error, channels: Channels) -> str:
    """What is allowed; for fields of the form, where to enter it."""
    if not channels:
        return str(error["allowed"])
    if _is_of_other_kind(error):
        words = field_words(error["field"])
        return f"the kind of recording that is chosen has no {words}: choose another kind, or set it to “not used”"
    if error["code"] == ErrorCode.NOT_ONE_OF and error["field"] == "sensor":
        return "must be the name of a sensor in the layout: fill in the layout below, a line for each sensor"
    if error["code"] != ErrorCode.REQUIRED or field_words(error["field"]) == error["field"]:
        return unsigned(error["field"], worded(error["allowed"], field_words, UNLIKELY))
    if error["field"] == RATE:
        return "required: fill it in below, or say which channel is the time"
    if error["field"] in CHANNELS:
        return "required: say below which channel it is"
    return "required: fill it in below"


def _is_of_other_kind(error: Error) -> bool:
    """Whether a channel was rejected because recordings of the chosen kind have none."""
    part, _, field = str(error["field"]).partition(".")
    return error["code"] == ErrorCode.NOT_ONE_OF and part == "channels" and field in CHOICES


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
