"""A rig description as a form: the meaning of each channel of a file, values that the file does not contain, derived
channels, zeroing and trim, springs, and what differs from file to file."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from datetime import datetime
from typing import Any

from service.ingest.reading import InspectedFile
from service.ingest.rig_words import CHANNELS, RECORDING, SKIN
from service.ingest.uploads import Upload
from service.pages.shared.forms import number_or_text
from service.pages.upload.file_summary import ChannelSummary, FileSummary
from underskin.errors import FileError, InvalidInput, not_unique, required, wrong_type
from underskin.recordings import rig_description, rig_mapping
from underskin.recordings.campaign import KINDS, SkinDescription
from underskin.recordings.readers import channel_arithmetic
from underskin.recordings.readers.channel_arithmetic import FIELD
from underskin.recordings.readers.text import in_lab, time_zone, with_zone
from underskin.recordings.readers.unit_labels import in_brackets, unit
from underskin.recordings.rig_description import AUTOMATIC, SCHEMA, RigDescription
from underskin.recordings.rig_guess import guessed, likely
from underskin.recordings.rig_mapping import MappedFile
from underskin.recordings.validation import check_fields

RECORDED_AT = "recorded_at"
_OF_SKIN = {name for name, *_ in SKIN}
_OF_RECORDING = {name for name, *_ in RECORDING} - {RECORDED_AT}  # which is read in the lab's time zone
DEFLECTION = "deflection"  # roles of a channel in the form besides a campaign's fields
SPRING = "spring_constant_n_per_m"
CURVES = {
    "": "each part of the file",
    "file": "the whole file",
    "groups": "each group of rows, apart by blank or comment lines",
    "channel": "the rows with one value in a channel:",
    "segments": "the rows until a channel of segments falls:",
}
_SIGNAL = ("channel", "unit", "labelled", "sign", "sensitivity", "sensitivity_unit")
_DIGITS = 12  # that the conversion between N/m and N/mm leaves
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
WORKBENCH_WORDS = {
    **{f"trim.{name}": words for name, words in TRIM.items()},
    **{f"{field}.{_TARE}": f"zero of the {words}" for field, (words, _) in TARES.items()},
}
MOST_ROWS = 100  # files that the form has a row for
_DIFFERING = (
    *("sensor", "indenter_radius_mm", "preload_n", "sample_height_mm", "sample_diameter_mm"),
    RECORDED_AT,
)
FIELDS_OF_FILES = tuple(field for field in RECORDING if field[0] in _DIFFERING)
_FIELD_WORDS = {name: words for name, words, *_ in FIELDS_OF_FILES}
Typed = Mapping[int, Mapping[str, str]]  # by the number of the file, by field, as it was typed
CHOICES = {**CHANNELS, DEFLECTION: "deflection of the spring"}  # of the form
RATE = "sample_rate_hz"
COLUMN = "column:"  # before the name of a column that holds a field of the recording, in the form
_TEXTS = ("sensor", RECORDED_AT)
_SEPARATORS = (";", "\t", ",", None)  # of a line of the layout, as tried; None: blanks
_PARTS = 3  # of it: name, x, y


def time_zone_name() -> str:
    """The name of the lab's time zone."""
    return str(time_zone())


def time_said(typed: str) -> str:
    """A typed time as ISO 8601 with its zone; raises InvalidInput."""
    try:
        return with_zone(typed, time_zone())
    except ValueError as error:
        why = f" ({error})" if "two days" in str(error) else ""
        must = f"must be a date, or a date and time, such as 2026-05-03 14:30{why}"
        raise wrong_type(f"recording.{RECORDED_AT}", typed.strip()[:80], must) from None


def time_shown(value: Any) -> str:
    """A time of a campaign or a rig description as it is typed here; what is none as it is."""
    try:
        moment = datetime.fromisoformat(value)
    except (TypeError, ValueError):
        return str(value)
    moment = in_lab(moment).replace(tzinfo=None)
    return moment.isoformat(" ", "minutes" if moment.second == moment.microsecond == 0 else "auto")


def wrong_values(document: Mapping[str, Any]) -> list[InvalidInput]:
    """Of the rig description that a form says, those of its skin and of its recordings."""
    units_checked = bool(document.get("units_checked"))
    skin = {name: value for name, value in document.get("skin", {}).items() if name in _OF_SKIN}
    of_skin = _wrong_fields(SkinDescription, skin, units_checked=units_checked)
    of_recordings = wrong_of_recording(document["kind"], document.get("recording", {}), units_checked=units_checked)
    return [
        *(invalid.at(f"skin.{invalid.field}") for invalid in of_skin),
        *(invalid.at(f"recording.{invalid.field}") for invalid in of_recordings),
    ]


def wrong_of_recording(kind: str, values: Mapping[str, Any], *, units_checked: bool) -> list[InvalidInput]:
    """Of fields of recordings of a kind."""
    typed = {name: value for name, value in values.items() if name in _OF_RECORDING and not isinstance(value, Mapping)}
    return _wrong_fields(KINDS[kind], typed, units_checked=units_checked) if kind in KINDS else []


def _wrong_fields(model: Any, typed: Mapping[str, Any], *, units_checked: bool) -> list[InvalidInput]:
    """In the form's order, without what is missing, which a file may state."""
    wrong = {invalid.field: invalid for invalid in check_fields(model, typed, units_checked=units_checked)[1]}
    return [wrong[name] for name in typed if name in wrong]


def shown_as(document: Mapping[str, Any], name: str) -> tuple[str, Mapping[str, Any]]:
    """What a channel is in the form, and how it is read; empty where it is not used."""
    for field, how in document.get("channels", {}).items():
        if how.get(DEFLECTION, {}).get("channel") == name:
            return DEFLECTION, how[DEFLECTION]
        if how.get("channel") == name:
            return (DEFLECTION if SPRING in how else field), how
    return "", {}


def spring_constant(document: Mapping[str, Any]) -> Any:
    """The constant [N/m] that the form shows: a number, `{property: NAME}`, or None."""
    channels = document.get("channels", {})
    stated = channels.get("force_n", {}).get(SPRING)
    stiffness = channels.get("displacement_mm", {}).get("stiffness_n_per_mm")
    if isinstance(stiffness, Mapping):
        return stiffness
    return stated if stiffness is None else _rounded(1e3 * stiffness)


def is_travel(document: Mapping[str, Any]) -> bool:
    """Whether the displacement is a stage's travel, from which a deflection is subtracted."""
    how = document.get("channels", {}).get("displacement_mm", {})
    return DEFLECTION in how or "stiffness_n_per_mm" in how


def with_spring(
    channels: dict[str, Any], form: Mapping[str, str], constant: Any, base: Mapping[str, Any]
) -> tuple[dict[str, Any], list[InvalidInput]]:
    """The channels with the deflection inserted, and errors; `constant` as in the form. A form that does not define
    the displacement leaves it as in `base`."""
    channels = {field: dict(how) for field, how in channels.items()}
    deflection = channels.pop(DEFLECTION, None)
    displacement = channels.get("displacement_mm")
    if "travel" not in form:
        for field, name in (("displacement_mm", DEFLECTION), ("force_n", SPRING)):
            before = base.get(field, {})
            if name in before and channels.get(field, {}).get("channel") == before.get("channel"):
                channels[field][name] = before[name]
        return channels, []
    if deflection is not None and constant is not None and "force_n" not in channels:
        channels["force_n"] = {**_signal(deflection), SPRING: constant}
    if displacement is None:
        return channels, []
    displacement.pop("stiffness_n_per_mm", None)
    if not form["travel"]:
        return channels, []
    if deflection is not None:
        displacement[DEFLECTION] = _signal(deflection)
    elif isinstance(constant, float):
        displacement["stiffness_n_per_mm"] = _rounded(1e-3 * constant)
    elif isinstance(constant, Mapping):
        displacement["stiffness_n_per_mm"] = constant
    else:
        must = "must be a number where the force is measured, or say which channel is the deflection"
        return channels, [wrong_type(SPRING, constant and str(constant), must)]
    return channels, []


def _signal(how: Mapping[str, Any]) -> dict[str, Any]:
    return {name: how[name] for name in _SIGNAL if name in how}


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def curves_of(form: Mapping[str, str], base: Any) -> Any:
    """What a curve is, as the form says; as in `base` where it does not."""
    typed = form.get("curves")
    if typed is None:
        return base
    return {typed: form.get("curves-by", "")} if typed in ("channel", "segments") else typed or None


def sign_of(text: str) -> int | str | None:
    """A sign as a rig description has it; None for one that is not stated."""
    return text if text == AUTOMATIC else {"1": 1, "-1": -1}.get(text)


def derived_rows(document: Mapping[str, Any]) -> list[tuple[str, Any, str]]:
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
        text, name = form[f"{FIELD}-formula-{number}"].strip(), _derived_name(form, number, words)
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
            name = _derived_name(form, number, words)
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
        name, field = _derived_name(form, number, words), form.get(f"{FIELD}-is-{number}", "")
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


def formula_errors(refused: Sequence[Mapping[str, Any]], file: FileSummary) -> dict[str, str]:
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


def _derived_name(form: Mapping[str, str], number: int, words: Mapping[str, str]) -> str:
    field = form.get(f"{FIELD}-is-{number}", "")
    return form.get(f"{FIELD}-name-{number}", "").strip() or f"derived {words.get(field, str(number + 1))}"


def typed_of_files(form: Mapping[str, str], files: Sequence[Upload]) -> dict[int, dict[str, str]]:
    """What a form says of each file."""
    names = [name for name, *_ in FIELDS_OF_FILES]
    rows = {
        number: {name: text for name in names if (text := form.get(f"file-{number}-{name}", "").strip())}
        for number in range(min(len(files), MOST_ROWS))
    }
    return {number: row for number, row in rows.items() if row}


def values_of_files(
    rows: Typed, files: Sequence[Upload], kind: str, *, units_checked: bool
) -> tuple[dict[int, dict[str, Any]], list[InvalidInput]]:
    """The fields among them that recordings of a kind have, and what is wrong with them, each with its file's name."""
    names = {name for name, _, _, kinds in FIELDS_OF_FILES if kind in kinds}
    values: dict[int, dict[str, Any]] = {}
    wrong: list[InvalidInput] = []
    for number, typed_of_it in rows.items():
        row = {name: text for name, text in typed_of_it.items() if name in names}
        values[number] = {name: text if name in _TEXTS else number_or_text(text) for name, text in row.items()}
        refused = wrong_of_recording(kind, values[number], units_checked=units_checked)
        wrong += [error.at(field_of_file(files[number].label, error.field)) for error in refused]
        try:
            values[number] |= {name: time_said(row[name]) for name in row.keys() & {RECORDED_AT}}
        except InvalidInput as error:
            wrong.append(error.at(field_of_file(files[number].label, RECORDED_AT)))
    return values, wrong


def field_of_file(file: str | None, name: str) -> str:
    """What errors call a field of one file."""
    return f"{file}: {_FIELD_WORDS[name]}"


def columns_of(file: FileSummary, document: Mapping[str, Any], chosen: str) -> list[str]:
    """The columns that may hold a field of the recording: words, channels, derived ones, and the chosen one."""
    names = [*file.texts, *(channel.name for channel in file.channels), *document.get("derived", {}), chosen]
    return [name for name in dict.fromkeys(names) if name]


def passed_over(channels: Sequence[ChannelSummary], document: Mapping[str, Any]) -> list[str]:
    """In words, which channels a guessed rig description does not use, and what they could replace."""
    by_field: dict[str, list[str]] = {}
    for channel, field in zip(channels, likely(channels)[1], strict=True):
        if shown_as(document, channel.name)[0] in ("", field):
            by_field.setdefault(field, []).append(channel.name)
    return [
        f"{', '.join(names[1:])} may be {CHANNELS[field]} as well as {names[0]}, which was taken for it: "
        "choose the one that is meant"
        for field, names in by_field.items()
        if field and len(names) > 1
    ]


def document_of(form: Mapping[str, str], base: Mapping[str, Any]) -> tuple[dict[str, Any], list[InvalidInput]]:
    """The rig description of a form and its errors: invalid values, layout lines, two channels for one field.

    Everything outside the form stays as in `base`; invalid text is kept for correction.
    """
    kind = form.get("kind", "frf")
    sensors, strange = _sensors(form.get("sensors", ""))
    channels, twice = _channels(form, base.get("channels", {}))
    document: dict[str, Any] = {"schema": SCHEMA, **deepcopy(dict(base)), "kind": kind}
    document["skin"] = _replaced(base.get("skin", {}), {name: number_or_text(form.get(name, "")) for name, *_ in SKIN})
    document["skin"] = _replaced(document["skin"], {"sensors": sensors})
    before = base.get("recording", {})
    values = {
        name: _typed_value(form, name, before.get(name)) if kind in kinds else None for name, _, _, kinds in RECORDING
    }
    mistimed = _in_zone(values)
    document["recording"] = _replaced(base.get("recording", {}), values)
    travel = {"travel": ""} if "travel" in form and "displacement_mm" in derived_fields(form) else {}
    channels, unsaid = with_spring(channels, {**form, **travel}, _typed_value(form, SPRING), base.get("channels", {}))
    channels = with_derived(channels, form, CHANNELS, base)
    document["channels"] = with_tare(channels, form, base)
    remaining = {
        "name": form.get("name", base.get("name", "")).strip() or None,
        "derived": formulas(form, CHANNELS, base),
        "curves": curves_of(form, base.get("curves")),
        "trim": trim_of(form, base.get("trim")),
    }
    document = _replaced(document, remaining)
    document.pop("units_checked", None)
    if form.get("units_checked"):
        document["units_checked"] = True
    rows = wrong_rows(form, CHANNELS)
    return document, [*wrong_values(document), *strange, *twice, *unsaid, *mistimed, *rows]


def sensors_text(document: Mapping[str, Any]) -> str:
    """The layout, one sensor per line."""
    sensors = document.get("skin", {}).get("sensors") or []
    rows = [[sensor[name] for name in ("id", "x_mm", "y_mm") if name in sensor] for sensor in sensors]
    return "\n".join(
        ", ".join(f"{part:g}" if isinstance(part, float | int) else part for part in cells) for cells in rows
    )


def _replaced(base: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    remaining = {name: value for name, value in base.items() if name not in values}
    return remaining | {name: value for name, value in values.items() if value is not None}


def _typed_value(form: Mapping[str, str], name: str, before: Any = None) -> Any:
    """A typed value, or else the property or the column of the file that holds it; a column's other settings are those
    that it had `before`."""
    text = form.get(name, "").strip()
    source = form.get(f"{name}-from", "")
    if not text and source.startswith(COLUMN):
        column = source.removeprefix(COLUMN)
        return before if isinstance(before, Mapping) and before.get("channel") == column else {"channel": column}
    if not text and source:
        return {"property": source}
    return (text or None) if name in _TEXTS else number_or_text(text)


def _in_zone(values: dict[str, Any]) -> list[InvalidInput]:
    """Converts a typed time to the lab's time zone; returns the errors, and keeps invalid text."""
    typed = values[RECORDED_AT]
    if not isinstance(typed, str):
        return []
    try:
        values[RECORDED_AT] = time_said(typed)
    except InvalidInput as error:
        return [error]
    return []


def _sensors(layout: str) -> tuple[list[dict[str, Any]] | None, list[InvalidInput]]:
    """The sensors, and the invalid lines, which are kept as names without a position."""
    sensors: list[dict[str, Any]] = []
    strange = []
    for number, line in enumerate(layout.splitlines(), start=1):
        text = line.strip()
        if not text:
            continue
        # A comma separates, or is a decimal comma between semicolons, tabs or blanks: as three parts come out.
        parts = next((parts for by in _SEPARATORS if len(parts := text.split(by)) == _PARTS), None)
        if parts is None:
            must = f"line {number} must be: name, x [mm], y [mm]; such as s{number}, 8, 0"
            strange.append(wrong_type("skin.sensors", text[:80], must))
            sensors.append({"id": text})
        else:
            name, x, y = parts
            sensors.append({"id": name.strip(), "x_mm": number_or_text(x), "y_mm": number_or_text(y)})
    return sensors or None, strange


def _channels(form: Mapping[str, str], base: Mapping[str, Any]) -> tuple[dict[str, Any], list[InvalidInput]]:
    """What each field's channel is, and the channels that a field has beside its first."""
    by_field: dict[str, Any] = {}
    twice = []
    number = 0
    while f"channel-{number}" in form:
        field = form.get(f"is-{number}", "")
        if field in by_field:
            first = by_field[field]["channel"]
            allowed = f"{first[:80]} is {CHOICES.get(field, field)} already: set one of the two to “not used”"
            twice.append(not_unique(f"channels.{field}", form[f"channel-{number}"], allowed))
        elif field:
            by_field[field] = _channel(form, number, base.get(field, {}))
        number += 1
    return by_field, twice


def _channel(form: Mapping[str, str], number: int, base: Mapping[str, Any]) -> dict[str, Any]:
    """One channel; a unit that differs from the file's label overrides the label."""
    name, label = form[f"channel-{number}"], form.get(f"label-{number}", "")
    true_unit = form.get(f"unit-{number}", "").strip()
    wrong = bool(label and true_unit and unit(true_unit) != unit(label))
    stiffness = base.get("stiffness_n_per_mm") if base.get("channel") == name else None
    values = {
        "channel": name,
        "unit": true_unit if true_unit and (wrong or not label or "unit" in base) else None,
        "labelled": label if wrong else None,
        "sign": sign_of(form.get(f"sign-{number}", "")),
        "sensitivity": number_or_text(form.get(f"sensitivity-{number}", "")),
        "sensitivity_unit": form.get(f"sensitivity_unit-{number}", "").strip() or None,
        "stiffness_n_per_mm": stiffness,
    }
    return {key: value for key, value in values.items() if value is not None}


def rig_of(summary: FileSummary, rig: RigDescription | None) -> RigDescription | None:
    """The rig description in use or, without one, the guessed one; None if it is invalid."""
    try:
        dated = summary.began is not None
        guess = guessed(summary.channels, summary.properties, {}, summary.texts, dated=dated)
        return rig or rig_description.from_dict(guess)
    except InvalidInput:
        return None


def mapped_file(look: InspectedFile, summary: FileSummary, rig: RigDescription | None) -> MappedFile | None:
    """The campaign document of a file and how its columns were read, by the rig description in use or, without one,
    the guessed one; None if it is invalid."""
    used = rig_of(summary, rig)
    if look.contents is None or used is None:
        return None
    try:
        return rig_mapping.apply(used, look.contents, summary.label)
    except (FileError, InvalidInput):
        return None
