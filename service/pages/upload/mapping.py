"""A rig description as a form: the meaning of each channel of a file, and values that the file does not contain."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

from service.ingest.field_words import CHANNELS, RECORDING, SKIN
from service.ingest.reading import InspectedFile
from service.pages.shared.forms import number_or_text
from service.pages.upload import recorded_time, spring_mapping, typed_values, workbench
from service.pages.upload.file_summary import ChannelSummary, FileSummary
from underskin.errors import FileError, InvalidInput, not_unique, wrong_type
from underskin.recordings import rig_description, rig_mapping
from underskin.recordings.readers.unit_labels import unit
from underskin.recordings.rig_description import SCHEMA, RigDescription
from underskin.recordings.rig_guess import guessed, likely
from underskin.recordings.rig_mapping import MappedFile

CHOICES = {**CHANNELS, spring_mapping.DEFLECTION: "deflection of the spring"}  # of the form
RATE = "sample_rate_hz"
COLUMN = "column:"  # before the name of a column that holds a field of the recording, in the form
_TEXTS = ("sensor", recorded_time.FIELD)
_SEPARATORS = (";", "\t", ",", None)  # of a line of the layout, as tried; None: blanks
_PARTS = 3  # of it: name, x, y


def columns_of(file: FileSummary, document: Mapping[str, Any], chosen: str) -> list[str]:
    """The columns that may hold a field of the recording: words, channels, derived ones, and the chosen one."""
    names = [*file.texts, *(channel.name for channel in file.channels), *document.get("derived", {}), chosen]
    return [name for name in dict.fromkeys(names) if name]


def passed_over(channels: Sequence[ChannelSummary], document: Mapping[str, Any]) -> list[str]:
    """In words, which channels a guessed rig description does not use, and what they could replace."""
    by_field: dict[str, list[str]] = {}
    for channel, field in zip(channels, likely(channels)[1], strict=True):
        if spring_mapping.shown_as(document, channel.name)[0] in ("", field):
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
    travel = {"travel": ""} if "travel" in form and "displacement_mm" in workbench.derived_fields(form) else {}
    channels, unsaid = spring_mapping.with_spring(
        channels, {**form, **travel}, _typed_value(form, spring_mapping.SPRING), base.get("channels", {})
    )
    channels = workbench.with_derived(channels, form, CHANNELS, base)
    document["channels"] = workbench.with_tare(channels, form, base)
    remaining = {
        "name": form.get("name", base.get("name", "")).strip() or None,
        "derived": workbench.formulas(form, CHANNELS, base),
        "curves": spring_mapping.curves_of(form, base.get("curves")),
        "trim": workbench.trim_of(form, base.get("trim")),
    }
    document = _replaced(document, remaining)
    document.pop("units_checked", None)
    if form.get("units_checked"):
        document["units_checked"] = True
    rows = workbench.wrong_rows(form, CHANNELS)
    return document, [*typed_values.refused(document), *strange, *twice, *unsaid, *mistimed, *rows]


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
    typed = values[recorded_time.FIELD]
    if not isinstance(typed, str):
        return []
    try:
        values[recorded_time.FIELD] = recorded_time.said(typed)
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
        "sign": workbench.sign_of(form.get(f"sign-{number}", "")),
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
