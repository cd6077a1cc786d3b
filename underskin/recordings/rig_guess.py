"""A first rig description of a file, guessed from the names and units of its channels and properties.

It is to be looked over: a heading may mislead, and what the file does not state is missing. Of a table with a row a
line, columns such as `Sensor`, `Preload [N]` and `Sphere diameter [mm]` are fields of the recording; columns that are
called alike but for their first word (`s01 |H|`, `s01 phase`, `s02 |H|`, …) are one recording for each of these words.
"""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from underskin.recordings.channels import Block, Channel, Contents
from underskin.recordings.field_words import (
    OF_CHANNELS,
    OF_SENSORS,
    RECORDED_AT,
    TIMES,
    WHEN,
    field_by_words,
    field_of,
    is_about,
    is_diameter,
    stated_rate,
)
from underskin.recordings.readers.text import time_zone, with_zone
from underskin.recordings.readers.unit_labels import DECIBEL, decibel_reference, in_brackets, labelled_unit, unit
from underskin.recordings.rig_description import AXES, COMPLEX_FRF, MAGNITUDE, PHASE, SCHEMA, channel_fields

_RATE = "sample_rate_hz"
_MAGNITUDES = ("mag", "modulus", "|")  # as analysers call the absolute value of an FRF
_OF_COMPRESSION = ("compress", "engineering strain", "true strain")  # as testing machines call their columns
_OF_SPRINGS = ("deflection", "piezo", "cantilever")  # as instruments that press with a spring call their channels
_DEFLECTIONS = ("deflection", "cantilever", "durchbiegung")
_OPTIONAL_OF_SKIN = ("id", "width_mm", "length_mm")
OF_SKIN = ("thickness_mm", "youngs_modulus_mpa", "poisson_ratio", "sensor_radius_mm")
_D33 = "d33_pc_per_n"
_ONE_SENSOR = {"id": "s01", "x_mm": 0, "y_mm": 0}
_OF_ROWS = ("dynamic_force_n", "preload_n", "indenter_radius_mm")  # fields that may be columns
_RADIUS = "radius"  # the derived channel
_IMAGINARY = re.compile(r"imag|\bim\b")
_QUOTED = re.compile(r"'([^']*)'")
_FIRST_WORD = re.compile(r"(?P<first>[^\s_:]+)[\s_:]+(?P<rest>\S.*)")


@dataclass(frozen=True)
class _KindFields:
    """The fields of one kind of recording.

    `by_dimension`: the channel that a dimension suggests; `of_recording`: asked for, as are those `of_skin`;
    `skin_by_words`: fields of the skin that any property may state, not only one of their own name; `is_on_sensors`:
    whether it has a sensor and a position, and a table of it may hold fields of the recording in columns.
    """

    by_dimension: Mapping[str, str]
    of_recording: tuple[str, ...]
    of_skin: tuple[str, ...] = ("poisson_ratio",)
    skin_by_words: tuple[str, ...] = ()  # of curves few: instruments report moduli
    is_on_sensors: bool = False


_OF_CURVES = {"force": "force_n", "length": "displacement_mm", "time": "time_s"}
_OF_KIND = {
    "frf": _KindFields(
        {
            "force": "force_n",
            "charge": "charge_pc",
            "frequency": "frequency_hz",
            "charge/force": "frf_re_pc_per_n",
            "time": "time_s",
            "angle": PHASE,
        },
        ("sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", _RATE, "load_cycles", "dwell_s"),
        of_skin=OF_SKIN,
        skin_by_words=(*OF_SKIN, _D33),
        is_on_sensors=True,
    ),
    "indentation": _KindFields(
        _OF_CURVES, ("sensor", "indenter_radius_mm", "stage_stiffness_n_per_mm"), skin_by_words=("thickness_mm",)
    ),
    "compression": _KindFields(_OF_CURVES, ("sample_height_mm", "sample_diameter_mm")),
}


class Column(Protocol):
    """A channel, without its values."""

    @property
    def name(self) -> str:
        """As the file has it."""

    @property
    def unit(self) -> str:
        """As labelled; empty without one."""

    @property
    def is_complex(self) -> bool:
        """Whether its values are complex."""


def main_blocks(contents: Contents) -> list[Block]:
    """The blocks with the channels of the longest one: beside the data, a file may hold a table of results."""
    longest = max(
        contents.blocks, key=lambda block: sum(len(channel.values) for channel in block.channels), default=None
    )
    names = {channel.name for channel in longest.channels} if longest is not None else set()
    return [block for block in contents.blocks if names == {channel.name for channel in block.channels}]


def _columns(blocks: Sequence[Block]) -> list[Channel]:
    """The channels of the blocks, with the units that their names say; of those of one name the last."""
    named = {channel.name: channel for block in blocks for channel in block.channels}
    return [replace(channel, unit=channel.label) for channel in named.values()]


def of_contents(contents: Contents) -> dict[str, Any]:
    """The rig description that the contents of a file suggest, as a document; `None` stands for what is missing."""
    blocks = main_blocks(contents)
    columns = _columns(blocks)
    texts = dict.fromkeys(column.name for block in blocks for column in block.texts)
    dated = any(block.recorded_at is not None for block in contents.blocks)
    document = guessed(columns, contents.properties, {}, list(texts), dated=dated)
    of_kind = _OF_KIND[document["kind"]]
    document = {**document, **_entries(columns, document)}
    document["recording"] = {
        name: source for name, source in document["recording"].items() if not _is_measured(source, blocks)
    }
    rated = "time_s" in document["channels"] or any(
        block.sample_rate_hz is not None or stated_rate(contents.properties, block.name) for block in contents.blocks
    )
    optional = ["stage_stiffness_n_per_mm", "load_cycles", "dwell_s"]
    optional += [_RATE] if rated or "force_n" not in document["channels"] else []
    optional += ["dynamic_force_n"] if "force_n" in document["channels"] else []
    optional += ["sensor"] if not of_kind.is_on_sensors or "recordings" in document else []
    needed = [name for name in of_kind.of_recording if name not in optional]
    sensors = _sensors(contents, document)
    if of_kind.is_on_sensors and not sensors:
        document["recording"] = {"sensor": _ONE_SENSOR["id"], **document["recording"]}
    return {
        **document,
        "skin": {
            **{name: document["skin"].get(name) for name in of_kind.of_skin},
            **_of_skin(contents.properties, of_kind),
            **({"sensors": sensors or [dict(_ONE_SENSOR)]} if of_kind.is_on_sensors else {}),
        },
        "recording": {**dict.fromkeys(needed), **document["recording"]},
    }


def _is_measured(source: Any, blocks: Sequence[Block]) -> bool:
    """Whether a field of the recording would come from a column of numbers most of which differ: it is measured."""
    columns = [block.headed(source["channel"]) for block in blocks if "channel" in source]
    return any(column is not None and 2 * len(np.unique(column.values)) > len(column.values) for column in columns)


def _sensors(contents: Contents, document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The sensors that the file names; of several, without columns of them, the positions are missing."""
    names = [one["sensor"] for one in document.get("recordings", [])]
    named = document["recording"].get("sensor", {})
    names += [str(contents.properties[named["property"]])] if "property" in named else []
    column = named.get("channel")
    for block in contents.blocks if column else ():
        words, channel = block.words(column), block.headed(column)
        names += list(words.texts) if words is not None else []
        names += [f"{number:g}" for number in np.unique(channel.values.real)] if words is None and channel else []
    places = _places(contents, column) if column else {}
    distinct = list(dict.fromkeys(filter(None, names)))
    unknown = (None, None) if len(distinct) > 1 else (0, 0)
    return [{"id": name, **dict(zip(("x_mm", "y_mm"), places.get(name, unknown), strict=True))} for name in distinct]


def _places(contents: Contents, sensor: str) -> dict[str, tuple[float, float]]:
    """The positions [mm] of sensors in columns `x` and `y` with a unit of length that have one value for each."""
    found: dict[str, set[tuple[float, float]]] = {}
    for block in contents.blocks:
        words, axes = block.words(sensor), [block.headed(axis) for axis in ("x", "y")]
        lengths = [unit(axis.label) for axis in axes if axis is not None]
        to_mm = [1e3 * length.to_si for length in lengths if length is not None and length.dimension == "length"]
        if words is None or len(to_mm) < 2:
            continue
        columns = [axis.values.real * scale for axis, scale in zip(axes, to_mm, strict=True) if axis is not None]
        for code, *place in zip(words.codes.tolist(), *(column.tolist() for column in columns), strict=False):
            found.setdefault(words.texts[code], set()).add((round(place[0], 9), round(place[1], 9)))
    return {name: next(iter(places)) for name, places in found.items() if len(places) == 1}


def unclear(contents: Contents) -> list[str]:
    """Fields that several columns or several properties of a file may be, each with these, in words."""
    columns = _columns(main_blocks(contents)[:1])
    by_field: dict[str, list[str]] = {}
    if not _entries(columns, guessed(columns, {}, {})):
        for column, field in zip(columns, likely(columns)[1], strict=True):
            by_field.setdefault(field, []).append(column.name)
    document = of_contents(contents)
    stated = {**document["skin"], **document["recording"]}
    by_field |= {
        field: names
        for field, names in _stated_names(contents.properties).items()
        if isinstance(stated.get(field), Mapping) and "property" in stated[field] and field not in by_field
    }
    return [f"{field} ({' or '.join(map(repr, names))})" for field, names in by_field.items() if field and names[1:]]


def said(document: Mapping[str, Any]) -> str:
    """What a guessed rig description takes for what, in words."""
    columns = ", ".join(f"{column!r} as {field}" for column, field in taken(document).items())
    both = {**document["skin"], **document["recording"]}
    stated = [
        f"{one['property']!r} as {name}" for name, one in both.items() if isinstance(one, Mapping) and "property" in one
    ]
    assumed = [f"{name} {one:g}" for name, one in both.items() if isinstance(one, float)]
    parts = [columns, *stated, *(f"{one} assumed" for one in assumed)]
    return f"read without a rig description, by headings and units: {', '.join(parts)}"


def guessed(
    columns: Sequence[Column],
    properties: Mapping[str, Any],
    skin: Mapping[str, Any],
    texts: Sequence[str] = (),
    *,
    dated: bool = False,
) -> dict[str, Any]:
    """A first rig description from units and names of channels, columns of words and properties; `skin`: its known
    values; `dated`: whether each part of the file has its own time of recording."""
    kind, fields = likely(columns, properties)
    channels: dict[str, Any] = {}
    for column, field in zip(columns, fields, strict=True):
        if field and field not in channels:
            channels[field] = {"channel": column.name}
    of_kind = _OF_KIND[kind]
    in_columns, derived = _row_fields(columns, texts, of_kind, fields)
    skin_values = {name: skin[name] for name in (*OF_SKIN, "sensors") if skin.get(name) is not None}
    return {
        "schema": SCHEMA,
        "kind": kind,
        "skin": {"poisson_ratio": 0.5, **skin_values},
        "recording": {**_stated(properties, of_kind, dated=dated), **in_columns},
        **({"derived": derived} if derived else {}),
        "channels": _with_spring(channels, columns, properties) if kind == "indentation" else channels,
    }


def likely(columns: Sequence[Column], properties: Mapping[str, Any] = MappingProxyType({})) -> tuple[str, list[str]]:
    """The kind of recording, and the likely field of each channel; empty if there is no indication.

    A file that states a sample's size, and no sphere, is of a sample between plates or clamps.
    """
    dimensions = [_dimension(column) for column in columns]
    kind = "frf"
    charged = any("charge" in dimension for dimension in dimensions) or any(
        "charge" in column.name.lower() for column in columns
    )
    if "length" in dimensions and not charged:
        named = any(words in column.name.lower() for column in columns for words in _OF_COMPRESSION)
        stated = _stated_names(properties)
        sized = not stated.keys().isdisjoint(("sample_height_mm", "sample_diameter_mm"))
        kind = "compression" if named or (sized and "indenter_radius_mm" not in stated) else "indentation"
    elif not charged and any(word in column.name.lower() for column in columns for word in _OF_SPRINGS):
        kind = "indentation"
    phases = "angle" in dimensions or any("phase" in column.name.lower() for column in columns)
    is_spectrum = "frequency" in dimensions
    fields, of_kind = [], _OF_KIND[kind]
    for column, dimension in zip(columns, dimensions, strict=True):
        name = column.name.lower()
        word = next((field for field, words in OF_CHANNELS.items() if re.search(words, name)), "")
        field = COMPLEX_FRF if column.is_complex else of_kind.by_dimension.get(dimension) or word
        if decibel_reference(column.unit) is not None or (dimension == DECIBEL and is_spectrum and phases):
            field = MAGNITUDE
        if field == "frf_re_pc_per_n" and _IMAGINARY.search(name):
            field = "frf_im_pc_per_n"
        if field == "frf_re_pc_per_n" and (phases or any(part in name for part in _MAGNITUDES)):
            field = MAGNITUDE
        if is_spectrum and of_kind.is_on_sensors and field in ("force_n", "charge_pc", "time_s"):
            field = ""  # of the recording
        fields.append(field if field in channel_fields(kind) and not is_about(name) else "")
    if not of_kind.is_on_sensors or is_spectrum:
        return kind, fields
    of_rows = [_row_field(column) != "" for column in columns]
    sampled = {field for field, is_of_row in zip(fields, of_rows, strict=True) if not is_of_row}
    return kind, [
        "" if is_of_row and field in sampled else field for field, is_of_row in zip(fields, of_rows, strict=True)
    ]


def _dimension(column: Column) -> str:
    column_unit = unit(column.unit)
    return "" if column_unit is None else column_unit.dimension


def _row_field(column: Column) -> str:
    """The field of the recording that a column may hold, by its words and unit; empty for none."""
    field = field_by_words(column.name, _dimension(column))
    return field if field in _OF_ROWS else ""


def _row_fields(
    columns: Sequence[Column], texts: Sequence[str], of_kind: _KindFields, fields: Sequence[str]
) -> tuple[dict[str, Any], dict[str, str]]:
    """The fields of the recording that columns hold, and the formulas that these need."""
    found: dict[str, Any] = {}
    derived: dict[str, str] = {}
    for name in texts:
        if OF_SENSORS.search(name):
            found.setdefault("sensor", {"channel": name})
        elif any(word in WHEN for word in name.lower().split()):
            found.setdefault(RECORDED_AT, {"channel": name})
    for column, field in zip(columns, fields, strict=True):
        if field or not of_kind.is_on_sensors:
            continue
        row_field = _row_field(column)
        is_length = _dimension(column) == "length" and ("frequency_hz" in fields or row_field == "indenter_radius_mm")
        if is_length and is_diameter(column.name) and "'" not in column.name:
            found.setdefault("indenter_radius_mm", {"channel": _RADIUS})
            derived[_RADIUS] = f"'{column.name}' / 2"
        elif "frequency_hz" in fields and not _dimension(column) and OF_SENSORS.search(column.name):
            found.setdefault("sensor", {"channel": column.name})
        elif row_field:
            found.setdefault(row_field, {"channel": column.name})
    return found, derived


def _entries(columns: Sequence[Column], document: Mapping[str, Any]) -> dict[str, Any]:
    """`recordings` and the common `channels` of a table with the same columns for each sensor; empty of another."""
    common = [column for column in columns if document["channels"].get("frequency_hz") == {"channel": column.name}]
    by_sensor: dict[str, dict[str, Column]] = {}
    for column in columns:
        parts = _FIRST_WORD.fullmatch((in_brackets(column.name) or (column.name,))[0])
        if parts is not None and column not in common:
            by_sensor.setdefault(parts["first"], {})[parts["rest"]] = column
    alike = {tuple(of_sensor) for of_sensor in by_sensor.values()}
    if not common or len(by_sensor) < 2 or len(alike) != 1:
        return {}
    entries = []
    for sensor, of_sensor in by_sensor.items():
        fields = likely([*common, *of_sensor.values()])[1][len(common) :]
        channels = {
            field: {"channel": one.name} for field, one in zip(fields, of_sensor.values(), strict=True) if field
        }
        entries.append({"sensor": sensor, "channels": channels})
    return {"channels": {"frequency_hz": {"channel": common[0].name}}, "recordings": entries}


def _stated(properties: Mapping[str, Any], of_kind: _KindFields, *, dated: bool) -> dict[str, Any]:
    """The recording's fields that the file itself states."""
    named = {field: {"property": names[0]} for field, names in _stated_names(properties).items()}
    when = None if dated else _time_stated(properties)
    found = {name: named[name] for name in of_kind.of_recording if name in named}
    position = [named[f"position_{axis}"] for axis in AXES if f"position_{axis}" in named]
    return {
        **found,
        **({} if when is None else {RECORDED_AT: {"property": when}}),
        **({"position_mm": position} if len(position) == len(AXES) and of_kind.is_on_sensors else {}),
    }


def _stated_names(properties: Mapping[str, Any], *, own_only: bool = False) -> dict[str, list[str]]:
    """The properties that may state a field, by field: those called as it is, else those that their words suggest."""
    by_name: dict[str, list[str]] = {}
    by_words: dict[str, list[str]] = {}
    for name in properties:
        field, is_own = field_of(name)
        if field and (is_own or not own_only):
            (by_name if is_own else by_words).setdefault(field, []).append(name)
    return by_words | by_name


def _of_skin(properties: Mapping[str, Any], of_kind: _KindFields) -> dict[str, Any]:
    """The skin's fields that the file states."""
    by_words = {name: given for name, given in _stated_names(properties).items() if name in of_kind.skin_by_words}
    names = by_words | _stated_names(properties, own_only=True)
    of_skin = {name: {"property": names[name][0]} for name in (*OF_SKIN, _D33) if name in names}
    own = {name: {"property": f"skin.{name}"} for name in _OPTIONAL_OF_SKIN if f"skin.{name}" in properties}
    return of_skin | own


def _time_stated(properties: Mapping[str, Any]) -> str | None:
    """The property of a file with its time of recording; None if no usable one exists."""
    by_name = {name.lower().replace("_", " ").strip(): name for name in properties}
    for name in (by_name[words] for words in TIMES if words in by_name):
        with suppress(ValueError):
            with_zone(str(properties[name]), time_zone())
            return name
    return None


def _with_spring(channels: dict[str, Any], columns: Sequence[Column], properties: Mapping[str, Any]) -> dict[str, Any]:
    """The channels by field, with a deflection if no channel is a force.

    Deflection gives the force, and the stage's travel the depth; the constant is a property of the file in N/m, if
    there is one.
    """
    lengths = [column for column in columns if (label := unit(column.unit)) and label.dimension == "length"]
    springs = [column.name for column in lengths if any(word in column.name.lower() for word in _DEFLECTIONS)]
    travel = next((column.name for column in lengths if column.name not in springs), None)
    if "force_n" in channels or not springs or travel is None:
        return channels
    deflection = {"channel": springs[0]}
    labels = {name: unit(labelled_unit(name)) for name in properties}
    constant = next((name for name, label in labels.items() if label and label.dimension == "force/length"), None)
    force = {"force_n": {**deflection, "spring_constant_n_per_m": {"property": constant}}} if constant else {}
    return {**channels, "displacement_mm": {"channel": travel, "deflection": deflection}, **force}


def missing(document: Mapping[str, Any]) -> list[str]:
    """The fields of a guessed document that are `None`, by their places."""
    sensors = document["skin"].get("sensors") or []
    places = ["skin.sensors: x_mm and y_mm of each"] if any(sensor["x_mm"] is None for sensor in sensors) else []
    lacking = [
        f"{part}.{name}" for part in ("skin", "recording") for name, value in document[part].items() if value is None
    ]
    return [*lacking, *places, *([] if document["channels"] else ["channels"])]


def taken(document: Mapping[str, Any]) -> dict[str, str]:
    """What a rig description, as a document, takes each column for."""
    given: Sequence[Mapping[str, Any]] = [document, *document.get("recordings", [])]
    held = [one.get(part, {}) for one in given for part in ("recording", "channels")]
    by_channel: dict[str, str] = {}
    for field, how in (pair for fields in held for pair in fields.items()):
        names = how.get("channel", []) if isinstance(how, Mapping) else []
        by_channel |= dict.fromkeys([names] if isinstance(names, str) else names, field)
    for name, formula in reversed(document.get("derived", {}).items()):
        by_channel |= dict.fromkeys(_QUOTED.findall(str(formula)), by_channel.get(name, name))
    return by_channel


def holds_frfs(document: Mapping[str, Any]) -> bool:
    """Whether a guessed rig description is one of a table of FRFs."""
    return any(field.startswith("frf_") for field in taken(document).values())
