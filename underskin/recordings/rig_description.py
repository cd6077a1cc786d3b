"""The rig description (`rig/1`): what a lab's instrument files do not state, written once by the user as YAML or JSON.

    schema: rig/1
    kind: indentation
    skin: {thickness_mm: 8.0, poisson_ratio: 0.5}
    recording: {indenter_radius_mm: 2.5, id: {property: Well}}
    channels:
      displacement_mm: {channel: Z_Position(mm), sign: -1}
      force_n: {channel: Corrected_Force(N), sign: -1}

`skin` and `recording` hold campaign fields common to all files; `{property: ...}` takes one from the properties that
the file or the block states, `{channel: ...}` one of the recording from a column: rows with the same values in all such
columns are one recording. `channels` maps each campaign field to a channel and its conversion; a list of channels is
one, one after the other. `recordings` lists the fields and channels of several recordings in the same rows (a column a
sensor). `curves` says how the curves of a file are separated, `estimator` how FRFs are estimated from time series (H1,
H2 or Hv), `derived` defines channels by formulas (`depth: Piezo - Deflection`), `trim` selects the samples of each
curve, `join` names the other files of a recording (`{_force: [_charge]}`).

Also here: the values of properties, converted to the unit of their campaign field.
"""

import dataclasses
import re
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, Any, Literal, TypeVar

from underskin.errors import (
    ErrorCode,
    FileError,
    InvalidInput,
    Mention,
    Requirement,
    SeveralInvalid,
    all_of,
    conflicting,
    errors_of,
    not_one_of,
    noting,
    out_of_range,
    required,
    too_few,
    wrong_type,
)
from underskin.recordings import validation as field
from underskin.recordings.campaign import COLUMNS, DEFAULT_KIND, KINDS, SkinDescription
from underskin.recordings.field_words import is_diameter, number_of
from underskin.recordings.frf.estimators import Estimator, checked_estimator
from underskin.recordings.readers import channel_arithmetic, json_file, text
from underskin.recordings.readers.expressions import Expression
from underskin.recordings.readers.sandbox import call_apart
from underskin.recordings.readers.text import time_zone, with_zone
from underskin.recordings.readers.unit_labels import field_unit, labelled_unit, unit
from underskin.recordings.validation import mapping, named, shown
from underskin.units import LAB

_FULL_PERCENT = 100.0  # %


@dataclass(frozen=True)
class Property:
    """A field's value that the file itself states under the name `property`."""

    property: field.Name


AUTOMATIC: Literal["auto"] = "auto"  # a sign determined from the curve itself
Sign = Literal[1, -1, "auto"]


def _sign(name: str, value: Any, units_checked: bool) -> Sign:
    if value == AUTOMATIC:
        return AUTOMATIC
    if isinstance(value, str) or field.number(name, value, units_checked) not in (1, -1):
        raise InvalidInput(name, shown(value), "must be 1, -1 or auto", code=ErrorCode.NOT_ONE_OF)
    return 1 if value == 1 else -1


def _percent(name: str, value: Any, units_checked: bool) -> float:
    result = field.positive(name, value, units_checked)
    if result > _FULL_PERCENT:
        raise out_of_range(name, result, "must be a part of the curve, greater than 0 and up to 100 (%)")
    return result


@dataclass(frozen=True)
class SignalMapping:
    """A channel and the conversion of its values.

    `channel` is the name in the file. `unit` is its true unit, which the file's label must not contradict; `labelled`
    repeats a label that is wrong, and no other is accepted. `sign` -1 reverses the values, `auto` does so where they
    fall during loading. `sensitivity` converts a signal to a quantity: in signal over quantity (mV/N) it divides the
    signal, in quantity over signal (nm/V) it multiplies it.
    """

    channel: field.Name
    unit: field.Name | None = None
    labelled: field.Name | None = None
    sign: Annotated[Sign, _sign] | None = None
    sensitivity: field.Positive | None = None
    sensitivity_unit: field.Name | None = None


def _or_property(name: str, value: Any, units_checked: bool) -> float | Property:
    if isinstance(value, Mapping):
        return field.build(Property, name, value, units_checked)
    return field.positive(name, value, units_checked)


@dataclass(frozen=True)
class ChannelMapping(SignalMapping):
    """The source of a field's values.

    For `displacement_mm`: `stiffness_n_per_mm` of the instrument (the deflection is force over it), a number or a
    property of the file, or the channel
    `deflection`; either deflection is subtracted. For `force_n`: `spring_constant_n_per_m`, by which a deflection
    channel is multiplied, or the property of the file that states it. `tare_percent` is the initial part of each curve
    over which the mean of the field is set to 0.
    """

    stiffness_n_per_mm: Annotated[float | Property, _or_property] | None = None
    deflection: Annotated[SignalMapping, partial(field.build, SignalMapping)] | None = None
    spring_constant_n_per_m: Annotated[float | Property, _or_property] | None = None
    tare_percent: Annotated[float, _percent] | None = None

    @property
    def signals(self) -> tuple[SignalMapping, ...]:
        """All channels that the field is made of."""
        return (self,) if self.deflection is None else (self, self.deflection)


SCHEMA = "rig/1"
LARGEST_BYTES = 64_000
_READ_YAML = "underskin.recordings.readers.plain_yaml:document"
BLOCK_NAME = "block"  # a property that every part of a file has: a TDMS group, a MATLAB structure
_MOST_UNKNOWN = 20  # unknown fields of one object that are listed
_TARED = ("force_n", "charge_pc", "displacement_mm")
_OF_CURVES = ("displacement_mm", "force_n")
_OF_PARTS = ("position_mm", "conditions")  # fields of the recording with several values
CURVE_EXTENTS = ("file", "groups")  # what may make one curve, besides values of a channel
_FIELDS = (
    *("schema", "name", "kind", "units_checked", "skin", "recording", "recordings"),
    *("derived", "channels", "curves", "trim", "estimator", "join"),
)
_Model = TypeVar("_Model")
COMPLEX_FRF = "frf_pc_per_n"  # a channel of complex numbers, both parts of the FRF
MAGNITUDE, PHASE = "frf_magnitude_pc_per_n", "frf_phase_deg"  # channels that together give both parts


@dataclass(frozen=True)
class CurveChannel:
    """A channel that separates the curves of a file: each value of `channel` is one curve, or each restart of
    `segments`, which counts the segments of a curve (approach 0, hold 1, withdrawal 2)."""

    channel: field.Name | None = None
    segments: field.Name | None = None


def _sample(name: str, value: Any, units_checked: bool) -> int:
    number = field.count(name, value, units_checked)
    if number < 1:
        raise out_of_range(name, number, "must be 1 or greater: samples are counted from 1")
    return number


@dataclass(frozen=True)
class Trim:
    """The samples of each curve that are used, from the first to the last, both counted from 1 and used too."""

    first_sample: Annotated[int, _sample] | None = None
    last_sample: Annotated[int, _sample] | None = None

    @property
    def words(self) -> str:
        """`samples 3 to 80`, `samples from 3 on`."""
        if self.last_sample is None:
            return f"samples from {self.first_sample or 1} on"
        return f"samples {self.first_sample or 1} to {self.last_sample}"


@dataclass(frozen=True)
class RigDescription:
    """A rig: the kind of its recordings, the fields common to them, the mapping of channels, and what makes one curve:
    `"file"`, `"groups"`, a channel that separates curves, or None (each block is one). `derived` holds formulas by the
    names of the channels that they define, in their order; `joined` the channels that are joined to one, by its name.
    `entries` are the descriptions of each of several recordings in the same rows, `join` the part of a file's name
    and what stands in its place in those of the other files of a recording. `document` is as given."""

    kind: str
    skin: Mapping[str, Any]
    recording: Mapping[str, Any | Property | SignalMapping]
    channels: Mapping[str, ChannelMapping]
    units_checked: bool
    document: Mapping[str, Any]
    curves: str | CurveChannel | None = None
    estimator: Estimator | None = None
    derived: Mapping[str, Expression] = dataclasses.field(default_factory=dict)
    trim: Trim | None = None
    joined: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    entries: "tuple[RigDescription, ...]" = ()
    join: tuple[str, tuple[str, ...]] | None = None

    @property
    def has_stated_signs(self) -> bool:
        """Whether it states the signs of force and displacement of a curve, each of one channel, as 1 or -1."""
        stated = [self.channels[name] for name in _OF_CURVES if name in self.channels]
        is_composed = any(mapping.deflection is not None for mapping in stated)
        return len(stated) == len(_OF_CURVES) and not is_composed and {mapping.sign for mapping in stated} <= {1, -1}

    @property
    def row_fields(self) -> Iterator[SignalMapping]:
        """The columns that hold fields of the recording, each value once for all rows of one."""
        for value in self.recording.values():
            parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else [value]
            yield from (part for part in parts if isinstance(part, SignalMapping))

    def with_recording(self, values: Mapping[str, Any]) -> "RigDescription":
        """The rig description with some fields of the recordings set for one file; `document` is unchanged."""
        entries = tuple(entry.with_recording(values) for entry in self.entries)
        return dataclasses.replace(self, recording={**self.recording, **values}, entries=entries)


def parse(data: bytes, file: str) -> RigDescription:
    """The rig description in a YAML or JSON file.

    YAML is parsed in a separate process, under the limits of reading a file. Raises FileError where the text is neither
    or too long, SeveralInvalid with all invalid fields.
    """
    if len(data) > LARGEST_BYTES:
        raise FileError(file, "", f"has {len(data)} bytes; a rig description may have up to {LARGEST_BYTES}")
    if data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{":
        return from_dict(json_file.document(data, file))
    with tempfile.TemporaryFile() as stream:
        stream.write(data)
        stream.flush()
        return from_dict(call_apart(_READ_YAML, stream, file, what="a rig description")["document"])


def from_dict(document: Any) -> RigDescription:
    """The rig description of a document; raises SeveralInvalid with all invalid fields."""
    document = field.of_schema("rig description", document, SCHEMA, _FIELDS)
    if "recordings" in document:
        return _with_entries(document)
    kind, get = document.get("kind", DEFAULT_KIND), document.get
    if not isinstance(kind, str) or kind not in KINDS:
        raise not_one_of("kind", shown(kind), KINDS)
    of_skin = {model_field.name for model_field in fields(SkinDescription)}
    of_recording = {model_field.name for model_field in fields(KINDS[kind])} - {"kind", "estimator"}
    given_channels, joined = _joined(get("channels"), kind)
    readings: dict[str, Callable[[], Any]] = {
        "name": lambda: field.name("name", get("name", SCHEMA), False),
        "skin": lambda: _stated_by_file("skin", _require_known_fields("skin", get("skin"), of_skin)),
        "recording": lambda: _stated_by_file(
            "recording", _require_known_fields("recording", get("recording", {}), of_recording), in_columns=True
        ),
        "channels": lambda: _channels(_require_known_fields("channels", given_channels, channel_fields(kind))),
        "units_checked": lambda: field.flag("units_checked", get("units_checked", False), False),
        "curves": lambda: _curves(get("curves")),
        "estimator": lambda: _estimator(get("estimator"), get("channels")),
        "derived": lambda: _derived(get("derived")),
        "trim": lambda: _trim(get("trim")),
        "join": lambda: _join(get("join")),
    }
    values = all_of(readings)
    del values["name"]  # that of the document
    rig = RigDescription(kind=kind, document=document, joined=joined, **values)
    all_of({name: partial(_check_automatic_sign, rig, name) for name in rig.channels})
    return rig


def _with_entries(document: Mapping[str, Any]) -> RigDescription:
    """The rig description of several recordings in the same rows: the fields and channels of each entry of `recordings`
    add to those common to all."""
    given = document["recordings"]
    if not isinstance(given, list) or not given:
        raise too_few("recordings", shown(given), "must be a list of recordings, such as {sensor: s01, channels: {…}}")
    common = {name: value for name, value in document.items() if name != "recordings"}

    def merged(place: str, entry: Any) -> RigDescription:
        fields_of_entry = dict(mapping(place, entry))
        channels = mapping(f"{place}.channels", fields_of_entry.pop("channels", {}))
        recording = {**mapping("recording", common.get("recording", {})), **fields_of_entry}
        both = {**mapping("channels", common.get("channels", {})), **channels}
        try:
            return from_dict({**common, "recording": recording, "channels": both})
        except InvalidInput as error:
            raise SeveralInvalid([one.at(f"{place}: {one.field}") for one in errors_of(error)]) from None

    places = [f"recordings[{index}]" for index in range(len(given))]
    entries = all_of({place: partial(merged, place, entry) for place, entry in zip(places, given, strict=True)})
    first = entries[places[0]]
    return dataclasses.replace(first, document=document, entries=tuple(entries.values()))


_FURTHER_CHANNELS = {"frf": {COMPLEX_FRF, MAGNITUDE, PHASE, "time_s"}}  # beside the columns of a kind


def channel_fields(kind: str) -> set[str]:
    """The fields of a kind that channels may hold; `time_s` of an frf defines its sample rate."""
    columns = {model_field.name for model_field in fields(KINDS[kind])} & set(COLUMNS)
    return columns | _FURTHER_CHANNELS.get(kind, set())


def _built(model: type[_Model], prefix: str, value: Any) -> _Model:
    """A model of an object; raises SeveralInvalid with all its invalid fields."""
    values, refused = field.check_fields(model, mapping(prefix, value), units_checked=False)
    if refused:
        raise SeveralInvalid([error.at(f"{prefix}.{error.field}") for error in refused])
    return model(**values)


def _require_known_fields(prefix: str, document: Any, field_names: set[str]) -> Mapping[str, Any]:
    unknown = [name for name in mapping(prefix, document) if name not in field_names][:_MOST_UNKNOWN]
    if unknown:
        errors = [not_one_of(f"{prefix}.{named(name)}", shown(document[name]), sorted(field_names)) for name in unknown]
        raise SeveralInvalid(errors)
    return mapping(prefix, document)


def _joined(channels: Any, kind: str) -> tuple[Any, dict[str, tuple[str, ...]]]:
    """The channels with one name in place of each list of channels, and these lists by their names."""
    joined: dict[str, tuple[str, ...]] = {}

    def named_once(value: Any, place: str) -> Any:
        if not isinstance(value, Mapping):
            return value
        plain = {key: named_once(item, f"{place}.{key}") for key, item in value.items()}
        parts = plain.get("channel")
        if not isinstance(parts, list):
            return plain
        if kind == "frf":
            raise conflicting(f"{place}.channel", shown(parts), "is for curves: an FRF has one channel for each field")
        if len(parts) < 2:
            raise too_few(f"{place}.channel", shown(parts), "must be a name, or a list of two or more")
        names = tuple(field.name(f"{place}.channel[{index}]", part, False) for index, part in enumerate(parts))
        name = " and ".join(names)[: field.LONGEST_NAME]
        joined[name] = names
        return {**plain, "channel": name}

    return named_once(channels, "channels"), joined


def _stated_by_file(prefix: str, given: Mapping[str, Any], *, in_columns: bool = False) -> Mapping[str, Any]:
    """The fields, with a Property for each whose value the file states, and a SignalMapping for each in a column."""
    return all_of(
        {
            name: partial(_source, f"{prefix}.{name}", value, in_columns, name in _OF_PARTS)
            for name, value in given.items()
            if name != "tolerances"
        }
    ) | {name: value for name, value in given.items() if name == "tolerances"}


def _source(place: str, value: Any, in_columns: bool, has_parts: bool = False) -> Any:
    """A value, or where it is found."""
    if has_parts and isinstance(value, list):
        return [_source(f"{place}[{index}]", part, in_columns) for index, part in enumerate(value)]
    if has_parts and isinstance(value, Mapping):
        return {key: _source(f"{place}.{key}", part, in_columns) for key, part in value.items()}
    if not isinstance(value, Mapping):
        return value
    if not in_columns or "channel" not in value:
        return _built(Property, place, value)
    signal = _built(SignalMapping, place, value)
    _require_complete(place, signal)
    if signal.sign == AUTOMATIC:
        raise conflicting(f"{place}.sign", AUTOMATIC, "is found from curves: must be 1 or -1 here")
    return signal


def _curves(document: Any) -> str | CurveChannel | None:
    if document is None or document in CURVE_EXTENTS:
        return document
    if not isinstance(document, Mapping):
        raise not_one_of("curves", shown(document), (*CURVE_EXTENTS, "{channel: NAME}", "{segments: NAME}"))
    curves = _built(CurveChannel, "curves", document)
    if (curves.channel is None) == (curves.segments is None):
        raise conflicting("curves", shown(list(document)), "must name either a channel or segments")
    return curves


def _derived(document: Any) -> dict[str, Expression]:
    given = mapping("derived", {} if document is None else document)
    return all_of({name: partial(_formula, name, text) for name, text in given.items()})


def _formula(name: Any, text: Any) -> Expression:
    place = f"derived.{named(name)}"
    field.name(place, name, False)
    return channel_arithmetic.parse(place, field.name(place, text, False))


def _trim(document: Any) -> Trim | None:
    if document is None:
        return None
    trim = _built(Trim, "trim", document)
    if trim.first_sample and trim.last_sample and trim.last_sample <= trim.first_sample:
        above = Requirement("must be above ", Mention("trim.first_sample", "first_sample"), f", {trim.first_sample}")
        raise conflicting("trim.last_sample", trim.last_sample, above)
    return trim


def _join(document: Any) -> tuple[str, tuple[str, ...]] | None:
    if document is None:
        return None
    if not isinstance(document, Mapping) or len(document) != 1:
        allowed = "must be one part of a file's name with those of the others, such as {_force: [_charge]}"
        raise wrong_type("join", shown(document), allowed)
    ((part, given),) = document.items()
    others = given if isinstance(given, list) else [given]
    for name in (part, *others):
        field.name("join", name, False)
        if not {"/", "\\"}.isdisjoint(name):
            raise out_of_range("join", name, "must be a part of the name of a file in the same folder")
    if part in others:
        raise out_of_range("join", part, "must be replaced by another part of a name")
    return part, tuple(others)


def _estimator(value: Any, channels: Any) -> Estimator | None:
    if value is None:
        return None
    if not isinstance(channels, Mapping) or "charge_pc" not in channels:
        raise conflicting("estimator", shown(value), Requirement("is for time series: ", Mention("charge_pc")))
    return checked_estimator("estimator", shown(value))


def _channels(given: Mapping[str, Any]) -> dict[str, ChannelMapping]:
    if not given:
        raise too_few("channels", "none", "must name at least one channel")
    errors: list[InvalidInput] = []
    for part, counterpart in ((MAGNITUDE, PHASE), (PHASE, MAGNITUDE)):
        if part in given and counterpart not in given:
            errors.append(required(f"channels.{counterpart}", Requirement("required with ", Mention(part))))
    channels = {}
    with noting(errors):
        channels = all_of({name: partial(_channel, name, value, given.keys()) for name, value in given.items()})
    if errors:
        raise SeveralInvalid(errors)
    return channels


def _channel(name: str, value: Any, fields_given: Collection[str]) -> ChannelMapping:
    channel_mapping = _built(ChannelMapping, f"channels.{name}", value)
    _require_complete(f"channels.{name}", channel_mapping)
    if channel_mapping.deflection is not None:
        _require_complete(f"channels.{name}.deflection", channel_mapping.deflection)
    _require_fitting_field(name, channel_mapping, fields_given)
    return channel_mapping


def _check_automatic_sign(rig: RigDescription, name: str) -> None:
    """Reject an automatic sign where curves cannot determine it, or where reversing the whole channel would be
    wrong."""
    channel_mapping = rig.channels[name]
    if AUTOMATIC not in [signal.sign for signal in channel_mapping.signals]:
        return
    place = f"channels.{name}.sign"
    if name not in _OF_CURVES or not all(column in rig.channels for column in _OF_CURVES):
        both = Requirement(Mention(_OF_CURVES[0]), " and ", Mention(_OF_CURVES[1]))
        raise conflicting(place, AUTOMATIC, Requirement("is found from curves, which need ", both))
    formula = rig.derived.get(channel_mapping.channel)
    if name == "displacement_mm" and formula is not None and formula.is_sum:
        turned = f"cannot be found for {formula.text}, whose terms have signs of their own: say them in the formula"
        raise conflicting(place, AUTOMATIC, turned)


def _require_complete(place: str, signal: SignalMapping) -> None:
    """Reject a sensitivity without its unit, a unit without its sensitivity, or `labelled` without `unit`."""
    if (signal.sensitivity is None) != (signal.sensitivity_unit is None):
        belong = Requirement("needs a ", Mention("sensitivity_unit"), ", and it one")
        raise conflicting(f"{place}.sensitivity", signal.sensitivity, belong)
    if signal.labelled is not None and signal.unit is None:
        raise required(f"{place}.unit", "required where labelled says that the label is wrong")


def _require_fitting_field(name: str, channel_mapping: ChannelMapping, fields_given: Collection[str]) -> None:
    """Reject conversions on fields that they do not apply to."""
    given = channel_mapping.stiffness_n_per_mm, channel_mapping.spring_constant_n_per_m
    stiffness, spring = (value.property if isinstance(value, Property) else value for value in given)
    if channel_mapping.tare_percent is not None and name not in _TARED:
        fields_with_tare = Requirement(
            "is for ", Mention("force_n"), ", ", Mention("charge_pc"), " and ", Mention("displacement_mm")
        )
        raise conflicting(f"channels.{name}.tare_percent", channel_mapping.tare_percent, fields_with_tare)
    deflection = None if channel_mapping.deflection is None else channel_mapping.deflection.channel
    is_stiff = name == "displacement_mm" and "force_n" in fields_given
    for field_name, value, is_fitting, meant in (
        ("stiffness_n_per_mm", stiffness, is_stiff, "displacement_mm"),
        ("deflection", deflection, name == "displacement_mm", "displacement_mm"),
        ("spring_constant_n_per_m", spring, name == "force_n", "force_n"),
    ):
        if value is not None and not is_fitting:
            raise conflicting(f"channels.{name}.{field_name}", value, Requirement("is for ", Mention(meant)))
    if deflection is not None and stiffness is not None:
        both = "must not be given with a deflection, which is subtracted already"
        raise conflicting(f"channels.{name}.stiffness_n_per_mm", stiffness, both)


Stated = Mapping[str, str | float]
TEXTS = ("id", "sensor")  # fields that are texts, whatever a file states
AXES = ("x_mm", "y_mm")  # of a position


def common_value(name: str, value: Any | Property, stated: Stated, file: str) -> Any:
    """The value of a field from the rig description, or from the property that it names, in the field's unit."""
    if not isinstance(value, Property):
        return value
    given = _property_value(value, stated, file)
    converted = text_value(name, str(given)) if isinstance(given, str) or name == "recorded_at" else given
    number = number_of(given)
    if number is None or name in TEXTS or name == "recorded_at":
        return converted
    if name not in LAB:
        return number
    label = labelled_unit(value.property)
    number *= 0.5 if name.endswith("radius_mm") and is_diameter(value.property) else 1.0
    return number * factor(label, name, file, f"property {value.property!r}") if label else number


class UnreadableTime(ValueError):
    """A time that an instrument wrote and that cannot be read; the message is a note on it."""


def text_value(name: str, given: str) -> str | float:
    """The value of a field that a file states as a text: a time in the lab's zone where it states none.

    Raises UnreadableTime.
    """
    if name != "recorded_at":
        return given
    try:
        return with_zone(given, time_zone())
    except ValueError as error:
        raise UnreadableTime(f"{name} = {shown(given)!r} {text.no_time(error)}") from None


def spring_constant(value: float | Property, stated: Stated, file: str, own_unit: str = "N/m") -> float:
    """A stiffness from the rig description or a property, in `own_unit`, which is also that of a property whose name
    holds no other unit."""
    if not isinstance(value, Property):
        return value
    place, given = f"property {value.property!r}", _property_value(value, stated, file)
    number = number_of(given)
    if number is None or not 0 < number < float("inf"):
        raise FileError(file, place, f"is {given!r}: must be a number greater than 0, a stiffness")
    label = labelled_unit(value.property)
    stated_unit, own = unit(label or own_unit), unit(own_unit)
    assert own is not None
    if stated_unit is None or stated_unit.dimension != own.dimension:
        raise FileError(file, place, f"its unit {label!r} is not one of {own.dimension}, such as {own_unit}")
    return number * (stated_unit.to_si / own.to_si)


def _property_value(value: Property, stated: Stated, file: str) -> str | float:
    if value.property not in stated:
        stated_names = ", ".join(list(stated)[:20])
        raise FileError(file, f"property {value.property!r}", f"is not in the file, which states {stated_names}")
    return stated[value.property]


def in_gram_force(label: str, field: str) -> str:
    """A hint for an error: the unit with gram-force, of which balances print `g`; empty where the field needs none."""
    meant = re.sub(r"\bg\b", "gf", label)
    meant_unit = unit(meant)
    is_meant = meant != label and meant_unit is not None and meant_unit.dimension == field_unit(field).dimension
    return f"; for gram-force, which balances print as g, write {meant}" if is_meant else ""


def factor(label: str, field: str, file: str, place: str, hint: str = "") -> float:
    """The conversion factor from a unit to the field's; `hint` is appended to the error."""
    label_unit, needed_unit = unit(label), field_unit(field)
    if label_unit is None or label_unit.dimension != needed_unit.dimension:
        what = "is not known here" if label_unit is None else f"is one of {label_unit.dimension}"
        needs = f" needs one of {needed_unit.dimension}, such as {LAB[field].unit}{in_gram_force(label, field)}{hint}"
        raise FileError(file, place, Requirement(f"its unit {label!r} {what}; ", Mention(field), needs))
    return label_unit.to_si / LAB[field].to_si
