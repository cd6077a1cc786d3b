"""The part of a mapping form that makes curves of raw channels: derived channels, zeroing, trim."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from service.pages.shared.forms import number_or_text
from service.pages.upload.file_summary import ChannelSummary, FileSummary
from underskin.errors import InvalidInput, not_unique, required
from underskin.recordings.readers import channel_arithmetic
from underskin.recordings.readers.channel_arithmetic import FIELD
from underskin.recordings.readers.unit_labels import in_brackets
from underskin.recordings.rig_description import AUTOMATIC

SIGNS = {"": "as it is", "1": "+", "-1": "−", AUTOMATIC: "automatic"}
TARES = {
    "force_n": ("force", ("frf", "indentation", "compression")),
    "displacement_mm": ("displacement", ("indentation", "compression")),
    "charge_pc": ("charge", ("frf",)),
}  # each in words, and the kinds that have it
TRIM = {"first_sample": "first sample used", "last_sample": "last sample used"}
_ROWS_FREE = 2  # of derived channels
_ROW = re.compile(rf"{FIELD}-formula-(0|[1-9][0-9]{{0,5}})")
_TARE = "tare_percent"
WORDS = {
    **{f"trim.{name}": words for name, words in TRIM.items()},
    **{f"{field}.{_TARE}": f"zero of the {words}" for field, (words, _) in TARES.items()},
}


def sign_of(text: str) -> int | str | None:
    """A sign as a rig description has it; None for one that is not stated."""
    return text if text == AUTOMATIC else {"1": 1, "-1": -1}.get(text)


def rows(document: Mapping[str, Any]) -> list[tuple[str, Any, str]]:
    """Name, formula and field of each derived channel, and some empty rows."""
    by_channel = {str(how.get("channel")): field for field, how in document.get("channels", {}).items()}
    derived = document.get(FIELD) or {}
    return [*((name, text, by_channel.get(name, "")) for name, text in derived.items()), *[("", "", "")] * _ROWS_FREE]


def in_formulas(document: Mapping[str, Any], channels: Sequence[ChannelSummary]) -> set[str]:
    """The channels, by name, that derived ones are made of, with or without the unit in their heading."""
    names: set[str] = set()
    for name, text in (document.get(FIELD) or {}).items():
        with suppress(InvalidInput):  # which is told beside it
            names |= set(channel_arithmetic.parse(name, text).names)
    return {channel.name for channel in channels if {channel.name, (in_brackets(channel.name) or ("",))[0]} & names}


def formulas(form: Mapping[str, str], words: Mapping[str, str], base: Mapping[str, Any]) -> dict[str, str] | None:
    """The derived channels of a form, by name; one without a name is called after what it is. As in `base` where the
    form has none; None where there are none."""
    if f"{FIELD}-formula-0" not in form:
        return base.get(FIELD)
    formula_by_field: dict[str, str] = {}
    for number in _rows_in(form):
        text, name = form[f"{FIELD}-formula-{number}"].strip(), _name(form, number, words)
        if _is_filled(form, number):
            while name in formula_by_field:  # refused by `wrong_rows`, and there to be put right
                name += " again"
            formula_by_field[name] = text
    return formula_by_field or None


def with_derived(
    channels: Mapping[str, Any], form: Mapping[str, str], words: Mapping[str, str], base: Mapping[str, Any]
) -> dict[str, Any]:
    """The channels, where a derived one is for a field that one instead."""
    before = base.get("channels", {})
    if f"{FIELD}-formula-0" not in form:
        derived = base.get(FIELD) or {}
        return {**channels, **{field: how for field, how in before.items() if str(how.get("channel")) in derived}}
    result = dict(channels)
    for number in _rows_in(form):
        field = form.get(f"{FIELD}-is-{number}", "")
        if field and _is_filled(form, number):
            name = _name(form, number, words)
            previous = before.get(field, {})
            result[field] = {**previous, "channel": name} if previous.get("channel") == name else {"channel": name}
    return result


def wrong_rows(form: Mapping[str, str], words: Mapping[str, str]) -> list[InvalidInput]:
    """The derived channels of a form that have a name and no formula, or whose name, or the field that they are for,
    another one has already."""
    wrong = []
    names: set[str] = set()
    fields: dict[str, str] = {}
    for number in _rows_in(form):
        if not form[f"{FIELD}-formula-{number}"].strip():
            if named := form.get(f"{FIELD}-name-{number}", "").strip():
                wrong.append(required(f"{FIELD}.{named}", "it has a name and no formula: write one, or clear its name"))
            continue
        name, field = _name(form, number, words), form.get(f"{FIELD}-is-{number}", "")
        if name in names:
            wrong.append(not_unique(f"{FIELD}.{name}", name, "another formula has this name: choose another one"))
        elif field in fields:
            allowed = f"{fields[field][:80]} is {words.get(field, field)} already: one of the two is for other formulas"
            wrong.append(not_unique(f"{FIELD}.{name}", name, allowed))
        names.add(name)
        if field:
            fields.setdefault(field, name)
    return wrong


def derived_fields(form: Mapping[str, str]) -> set[str]:
    """The fields that derived channels are for."""
    return {form.get(f"{FIELD}-is-{number}", "") for number in _rows_in(form)} - {""}


def with_tare(channels: Mapping[str, Any], form: Mapping[str, str], base: Mapping[str, Any]) -> dict[str, Any]:
    """The channels with the part of the curve over which each is zeroed; as in the rig description `base` if the
    form does not say. The values of curves are not carried over to FRFs, whose preload they would remove, nor back."""
    before = base.get("channels", {})
    other_kind = "kind" in base and (base["kind"] == "frf") != (form.get("kind", "frf") == "frf")
    result = {}
    for field, how in channels.items():
        remaining = {name: value for name, value in how.items() if name != _TARE}
        typed = form.get(f"tare-{field}", "").strip().removesuffix("%")
        previous = before.get(field, {}).get(_TARE)
        tare = number_or_text(typed) if f"tare-{field}" in form else previous
        tare = None if other_kind and tare == previous else tare
        result[field] = remaining if tare is None else {**remaining, _TARE: tare}
    return result


def with_guesses(document: Mapping[str, Any], base: Mapping[str, Any], guess: Mapping[str, Any]) -> dict[str, Any]:
    """A rig description in which what a formula of `base` was for, which is cleared now, is guessed again."""
    channels = document["channels"]
    cleared = set(base.get(FIELD) or {}) - set(document.get(FIELD) or {})
    if document["kind"] != guess["kind"]:
        return dict(document)
    again = {
        field: guess["channels"][field]
        for field, how in base.get("channels", {}).items()
        if str(how.get("channel")) in cleared and field not in channels and field in guess["channels"]
    }
    return {**document, "channels": {**again, **channels}}


def tares_of(channels: Mapping[str, Any]) -> dict[str, float]:
    """Over how much of a curve [%] each quantity is 0, by its words."""
    return {words: channels[field][_TARE] for field, (words, _) in TARES.items() if _TARE in channels.get(field, {})}


def trim_of(form: Mapping[str, str], base: Any) -> Any:
    """The samples that are used; as in `base` where the form does not say."""
    if not any(name in form for name in TRIM):
        return base
    typed = {name: number_or_text(form.get(name, "")) for name in TRIM}
    trim = {
        name: int(value) if isinstance(value, float) and value.is_integer() else value for name, value in typed.items()
    }
    return {name: value for name, value in trim.items() if value is not None} or None


def errors_of(refused: Sequence[Mapping[str, Any]], file: FileSummary) -> dict[str, str]:
    """What is wrong with each derived channel, by its name."""
    message_by_field: dict[str, str] = {}
    for error in (*refused, *file.errors):
        refused_field, message = error["field"], str(error["allowed"])
        if refused_field == "file":
            refused_field, _, message = message.partition(": ")
        if refused_field.startswith(f"{FIELD}."):
            message_by_field.setdefault(refused_field.removeprefix(f"{FIELD}."), message)
    return message_by_field


def _rows_in(form: Mapping[str, str]) -> list[int]:
    """The numbers of the rows of derived channels, as the page writes them; other names are none of its rows."""
    return sorted(int(row[1]) for row in map(_ROW.fullmatch, form) if row)


def _is_filled(form: Mapping[str, str], number: int) -> bool:
    """Whether a row has a formula, or a name at least."""
    return any(form.get(f"{FIELD}-{part}-{number}", "").strip() for part in ("formula", "name"))


def _name(form: Mapping[str, str], number: int, words: Mapping[str, str]) -> str:
    field = form.get(f"{FIELD}-is-{number}", "")
    return form.get(f"{FIELD}-name-{number}", "").strip() or f"derived {words.get(field, str(number + 1))}"
