"""The campaign (`campaign/1`): a skin, the conditions of its recordings, and what was recorded, in the lab's units.

Conditions (skin, sphere or sample, and everything else chosen before a measurement) are what a forward model takes; a
recording extends its conditions by the measured columns, so a campaign can be used wherever conditions are needed.
Fields are named as in the document; a field absent from a document is None. Reading a document keeps the valid
recordings and reports the problems of the others; writing one gives the canonical document.

Numbers beyond any instrument and any skin are rejected in every unit, since their products and powers overflow. The
bounds lie far beyond any slip of units: a picometre to a kilometre, a millionth of a pascal to the pressure in neutron
stars. `units_checked` does not admit them.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, fields, replace
from datetime import datetime
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from underskin import errors
from underskin.errors import ErrorCode, InvalidInput, not_one_of, not_unique, out_of_range, too_few, wrong_type
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings import validation as field
from underskin.recordings.frf.estimators import Estimator, checked_estimator
from underskin.recordings.validation import shown
from underskin.units import Complexes, Floats, checked, finite, non_negative, to_si

DEFAULT_KIND = "frf"  # of a recording whose document states none


@dataclass(frozen=True)
class Sensor:
    """A sensor of the array and its centre: x along the skin's length, y along its width; a single one needs none."""

    id: field.Name
    x_mm: field.Number = 0.0
    y_mm: field.Number = 0.0


def read_sensors(name: str, value: Any, units_checked: bool) -> tuple[Sensor, ...]:
    """The sensors of an array, with distinct ids, and each with a place where they are several."""
    if not isinstance(value, list | tuple):
        raise wrong_type(name, shown(value), "must be a list of sensors")
    sensors = [field.build(Sensor, f"{name}[{index}]", document, units_checked) for index, document in enumerate(value)]
    seen: set[str] = set()
    for index, sensor in enumerate(sensors):
        if sensor.id in seen:
            raise not_unique(f"{name}[{index}].id", sensor.id, "must differ from every other sensor's")
        seen.add(sensor.id)
        for axis in ("x_mm", "y_mm") if len(sensors) > 1 or len(value[index]) > 1 else ():
            if value[index].get(axis) is None:
                raise errors.required(f"{name}[{index}].{axis}", "required, but of a skin's only sensor")
    return tuple(sensors)


Sensors = Annotated[tuple[Sensor, ...], read_sensors]


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of declared values of the skin [%].

    They widen absolute intervals, such as that of the array's d33, not those that compare sensors or dates.
    """

    thickness_percent: field.NotNegative = 2.0
    sensor_radius_percent: field.NotNegative = 2.0
    youngs_modulus_percent: field.NotNegative = 10.0


def read_tolerances(name: str, value: Any, units_checked: bool) -> Tolerances:
    """The tolerances that a document states; others have their defaults."""
    return field.build(Tolerances, name, value, units_checked)


@dataclass(frozen=True)
class SkinDescription:
    """The skin as the lab declares it.

    `thickness_mm`, `youngs_modulus_mpa`, `sensor_radius_mm` and `sensors` may be unknown (None, empty) where no
    `frf` recording needs them; `d33_pc_per_n` may always be.
    """

    poisson_ratio: field.PoissonRatio
    id: field.Name | None = None
    thickness_mm: field.Declared | None = None
    youngs_modulus_mpa: field.Declared | None = None
    sensor_radius_mm: field.Declared | None = None
    d33_pc_per_n: field.Declared | None = None
    width_mm: field.Declared | None = None
    length_mm: field.Declared | None = None
    tolerances: Annotated[Tolerances, read_tolerances] | None = None
    sensors: Sensors = ()


# What a diagnosis makes of the fields of recordings, and the words for these axes
_AXES_OF_FIELDS = ("order", "time_of_day", "previous_preload_n", "x_mm", "y_mm", "phase", "day")


@cache
def built_in_axes() -> frozenset[str]:
    """The names of fields and axes, which no column of `conditions` may have."""
    fields_of_kinds = {model_field.name for kind in KINDS.values() for model_field in fields(kind)}
    return frozenset(fields_of_kinds | {*_AXES_OF_FIELDS})


def further(name: str, value: Any, units_checked: bool) -> dict[str, float | str]:
    """A lab's own columns by name, none of them that of a field or an axis."""
    noted = field.further(name, value, units_checked)
    for key in noted.keys() & built_in_axes():
        allowed = "is the name of a field or an axis of its own; choose another"
        raise InvalidInput(f"{name}.{key}", key, allowed)
    return noted


Further = Annotated[dict[str, float | str], further]


class _OfAKind:
    """What kinds of recordings differ in beside their fields."""

    needed_of_skin: ClassVar[tuple[str, ...]] = ()  # fields of the skin that must be declared
    has_sphere: ClassVar[bool] = True

    @property
    def height_mm(self) -> float:
        """The height of a sample between platens [mm], which no compression exceeds; infinite under a sphere."""
        return math.inf

    @classmethod
    def form_errors(cls, document: Mapping[str, Any]) -> list[InvalidInput]:  # noqa: ARG003
        """Errors of a document whose fields do not go together."""
        return []

    def with_estimator(self, estimator: Estimator) -> Self:  # noqa: ARG002
        """With this estimator of the FRF; itself where it is no time series of one."""
        return self


@dataclass(frozen=True, eq=False)
class FrfConditions(_OfAKind):
    """The skin is pressed by `preload_n` and shaken by `dynamic_force_n` (peak amplitude) at `frequency_hz`.

    A `dynamic_force_n` of 0 is the limit of a small oscillation. `frequency_hz` is None for a time series, whose lines
    are estimated later. `conditions` holds the lab's further columns, numbers or words by names of its own.
    """

    id: field.Name
    sensor: field.Name
    indenter_radius_mm: field.Declared
    preload_n: field.Declared
    dynamic_force_n: field.Positive
    kind: field.Name = DEFAULT_KIND
    recorded_at: field.TimeOfDay | None = None
    load_cycles: field.Count | None = None
    dwell_s: field.NotNegative | None = None
    position_mm: field.Position | None = None
    frequency_hz: field.Frequencies | None = None
    conditions: Further | None = None
    needed_of_skin = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm")

    def without_measurements(self, **changes: Any) -> "FrfConditions":
        """The conditions without measurements, with some of them changed."""
        values = vars(self)
        return FrfConditions(**({name: values[name] for name in _OF_FRF} | changes))


_OF_FRF = [model_field.name for model_field in fields(FrfConditions)]


@dataclass(frozen=True, eq=False)
class IndentationConditions(_OfAKind):
    """A sphere pressed in and drawn back by `displacement_mm`, loading and unloading in order.

    `displacement_mm` is that of the sphere. `stage_stiffness_n_per_mm` is that of a stage or cantilever whose
    deflection has been subtracted; it determines the pull-off of an adhesive contact. `signs_checked`: force and
    displacement have the signs that they should, whatever the curve looks like.
    """

    id: field.Name
    indenter_radius_mm: field.Declared
    displacement_mm: field.Series
    _: KW_ONLY
    kind: field.Name = "indentation"
    sensor: field.Name | None = None
    time_s: field.Times | None = None
    recorded_at: field.TimeOfDay | None = None
    load_cycles: field.Count | None = None
    dwell_s: field.NotNegative | None = None
    position_mm: field.Position | None = None
    stage_stiffness_n_per_mm: field.Positive | None = None
    signs_checked: field.Flag | None = None
    conditions: Further | None = None


@dataclass(frozen=True, eq=False)
class CompressionConditions(_OfAKind):
    """A cylinder between platens that approach each other by `displacement_mm`; tension negative."""

    id: field.Name
    sample_height_mm: field.Declared
    sample_diameter_mm: field.Declared
    displacement_mm: field.Series
    _: KW_ONLY
    kind: field.Name = "compression"
    time_s: field.Times | None = None
    recorded_at: field.TimeOfDay | None = None
    load_cycles: field.Count | None = None
    dwell_s: field.NotNegative | None = None
    signs_checked: field.Flag | None = None
    conditions: Further | None = None
    has_sphere = False

    @property
    def height_mm(self) -> float:
        """The height of the sample [mm]."""
        return self.sample_height_mm


CurveConditions = IndentationConditions | CompressionConditions
RecordingConditions = FrfConditions | IndentationConditions | CompressionConditions

_Kind = TypeVar("_Kind")


@dataclass(frozen=True, eq=False)
class Conditions:
    """Conditions of several recordings of one skin; `name` is their name in messages."""

    name: str
    skin: SkinDescription
    recordings: tuple[RecordingConditions, ...]

    def of(self, recorded: type[_Kind]) -> list[_Kind]:
        """The recordings of one class, in order."""
        return [recording for recording in self.recordings if isinstance(recording, recorded)]


def frf_conditions(
    skin: SkinDescription,
    *,
    indenter_radius_mm: ArrayLike,
    preload_n: ArrayLike,
    frequency_hz: ArrayLike,
    sensor: str | None = None,
    **further: ArrayLike | None,
) -> Conditions:
    """The conditions of FRFs from columns that broadcast: one recording a row, all at the same frequencies.

    Parameters
    ----------
    skin
        The skin as declared. A skin without sensors gets one, at the origin.
    indenter_radius_mm, preload_n
        Radius of the sphere [mm] and static force [N], (rows,) or one for all rows.
    frequency_hz
        The lines of every recording [Hz], (lines,).
    sensor
        The sensor that is pressed; the skin's first one where none is named.
    further
        Columns of `offset_x_mm` and `offset_y_mm` (of the sphere from the sensor's centre, default 0),
        `dynamic_force_n` (default 0: a small oscillation), `dwell_s` and `load_cycles` (default unknown).

    Returns
    -------
    Conditions
        With recordings named "row 0", "row 1", ….

    Raises
    ------
    InvalidInput
        For a sensor that the skin does not have, a column that does not exist, columns that do not broadcast or are
        empty, and a value that is not finite or not positive where it must be.
    """
    unknown = [name for name in further if name not in _FURTHER_COLUMNS]
    if unknown:
        raise not_one_of(unknown[0], "given", ("indenter_radius_mm", "preload_n", "frequency_hz", *_FURTHER_COLUMNS))
    skin = skin if skin.sensors else replace(skin, sensors=(Sensor("sensor", 0.0, 0.0),))
    centres = {skin_sensor.id: skin_sensor for skin_sensor in skin.sensors}
    if sensor is not None and sensor not in centres:
        raise not_one_of("sensor", sensor, centres)
    centre = skin.sensors[0] if sensor is None else centres[sensor]
    columns = {name: values for name, values in further.items() if values is not None}
    columns = {"offset_x_mm": 0.0, "offset_y_mm": 0.0, "dynamic_force_n": 0.0} | columns
    columns |= {"indenter_radius_mm": indenter_radius_mm, "preload_n": preload_n}
    lines = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    _check_values(skin, columns, lines)
    recordings = []
    for index, row in enumerate(_rows(columns)):
        position = centre.x_mm + row.pop("offset_x_mm"), centre.y_mm + row.pop("offset_y_mm")
        recordings.append(
            FrfConditions(id=f"row {index}", sensor=centre.id, position_mm=position, frequency_hz=lines, **row)
        )
    return Conditions("rows", skin, tuple(recordings))


_FURTHER_COLUMNS = ("offset_x_mm", "offset_y_mm", "dynamic_force_n", "dwell_s", "load_cycles")


def _check_values(skin: SkinDescription, columns: Mapping[str, ArrayLike], lines: Floats) -> None:
    """Raises InvalidInput at the first value that no recording can have; unlikely magnitudes are accepted."""
    for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "d33_pc_per_n"):
        value = getattr(skin, name)
        if value is not None:
            checked(name, value, units_checked=True)
    if not 0 <= skin.poisson_ratio <= INCOMPRESSIBLE:
        raise out_of_range("poisson_ratio", skin.poisson_ratio, f"must be 0 to {INCOMPRESSIBLE:g}")
    for name, values in {**columns, "frequency_hz": lines}.items():
        column = np.asarray(values, dtype=float)
        if column.size == 0 or column.ndim > 1:
            raise too_few(name, f"shape {column.shape}", "must be one number or a column of at least one")
        if name in ("indenter_radius_mm", "preload_n"):
            checked(name, column, units_checked=True)
        elif name in ("offset_x_mm", "offset_y_mm"):
            finite(name, column)
        else:
            non_negative(name, column)


def _rows(columns: Mapping[str, ArrayLike]) -> list[dict[str, Any]]:
    """One dictionary a row of columns that broadcast to one dimension."""
    try:
        broadcast = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(values, dtype=float)) for values in columns.values())
        )
    except ValueError:
        lengths = ", ".join(f"{name} {np.size(values)}" for name, values in columns.items())
        raise InvalidInput(
            "columns", lengths, "must have one length, or be single numbers", code=ErrorCode.UNEQUAL_LENGTHS
        ) from None
    rows = zip(*(column.tolist() for column in broadcast), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def frf_of(conditions: Conditions) -> list[FrfConditions]:
    """The conditions of FRF recordings, in order; raises InvalidInput where there is none."""
    return _at_least_one(conditions.of(FrfConditions))


def _at_least_one(recordings: list[_Kind]) -> list[_Kind]:
    if not recordings:
        raise too_few("recordings", "none of kind frf", "must hold at least one")
    return recordings


def curves_of(conditions: Conditions) -> list[CurveConditions]:
    """The conditions of indentations and compressions, in order."""
    return [recording for recording in conditions.recordings if isinstance(recording, CurveConditions)]


def offsets(conditions: Conditions) -> Floats:
    """The commanded position of the sphere in each FRF recording, from its sensor's centre (recordings, 2) [m]."""
    centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors}
    offsets_mm = [
        np.subtract(recording.position_mm or centres[recording.sensor], centres[recording.sensor])
        for recording in frf_of(conditions)
    ]
    return to_si("thickness_mm", np.array(offsets_mm))


_LENGTH, _FORCE, _TIME = (1e-9, 1e6), (1e-8, 1e8), (1e-12, 1e12)
_POSITION = (0.0, 1e6)  # also rounding of differences and rotations that should be 0
_CHARGE = (1e-9, 1e9)
_STIFFNESS = (1e-12, 1e12)
_BOUNDS = {
    "thickness_mm": _LENGTH,
    "sensor_radius_mm": _LENGTH,
    "youngs_modulus_mpa": _STIFFNESS,
    "d33_pc_per_n": _CHARGE,
    "width_mm": _LENGTH,
    "length_mm": _LENGTH,
    "sensors": _POSITION,
    "indenter_radius_mm": _LENGTH,
    "sample_height_mm": _LENGTH,
    "sample_diameter_mm": _LENGTH,
    "position_mm": _POSITION,
    "displacement_mm": _LENGTH,
    "preload_n": _FORCE,
    "dynamic_force_n": _FORCE,
    "force_n": (1e-13, 1e8),  # the peak of a soft cantilever's curve may be tens of piconewtons
    "frf_re_pc_per_n": _CHARGE,
    "frf_im_pc_per_n": _CHARGE,
    "charge_pc": _CHARGE,
    "dwell_s": _TIME,
    "time_s": _TIME,
    "sample_rate_hz": (1e-6, 1e9),
    "stage_stiffness_n_per_mm": _STIFFNESS,
    "conditions": (0.0, 1e20),  # a lab's own columns: clocks that count nanoseconds have 19 digits
}
# Measured values may be arbitrarily small (rounded zeros): then only a diagnosis is impossible.
_MEASURED = ("displacement_mm", "force_n", "frf_re_pc_per_n", "frf_im_pc_per_n", "charge_pc", "time_s", "dwell_s")
_YEARS = (1000, 8999)  # an unset clock may write year 1 or 9999, where other time zones lie outside the calendar


@dataclass(frozen=True)
class Excess:
    """A field whose largest magnitude is neither 0 nor from `low` to `high`."""

    field: str
    largest: float
    low: float
    high: float

    @property
    def is_faint(self) -> bool:
        """Whether it is measured, and below its bounds."""
        return self.field in _MEASURED and self.largest < self.low

    @property
    def error(self) -> InvalidInput:
        """The error that rejects the field."""
        allowed = f"must be {self.low:g} to {self.high:g} in magnitude: no skin and no instrument is beyond"
        return out_of_range(self.field, self.largest, allowed)


def excesses(model: Any) -> Iterator[Excess]:
    """The fields of a skin's description or a recording whose magnitude is out of bounds."""
    kind: Any = type(model)
    for name in _bounded(kind):
        value, (low, high) = getattr(model, name), _BOUNDS[name]
        largest = abs(value) if isinstance(value, float) and math.isfinite(value) else _largest(value)
        if largest and not low <= largest <= high:
            yield Excess(name, float(largest), low, high)


@cache
def _bounded(model: Any) -> tuple[str, ...]:
    return tuple(model_field.name for model_field in fields(model) if model_field.name in _BOUNDS)


def _largest(value: Any) -> float:
    """The largest finite magnitude of a column, of positions, or of a lab's own columns; 0 if none."""
    if isinstance(value, dict):
        value = [number for number in value.values() if not isinstance(number, str)]
    elif isinstance(value, tuple) and value and isinstance(value[0], Sensor):
        value = [(sensor.x_mm, sensor.y_mm) for sensor in value]
    if value is None or np.size(value) == 0:
        return 0.0
    size = np.abs(np.asarray(value, dtype=float))
    return float(size.max(initial=0.0, where=np.isfinite(size)))


def refusals(model: Any) -> list[InvalidInput]:
    """The errors of a model: numbers out of bounds, and times outside the years that every time zone has."""
    refused = [excess.error for excess in excesses(model) if not excess.is_faint]
    written, (first, last) = getattr(model, "recorded_at", None), _YEARS
    if written is not None and not first <= datetime.fromisoformat(written).year <= last:
        allowed = f"must be in the years {first} to {last}: leave it out where the clock was not set"
        refused.append(out_of_range("recorded_at", written, allowed))
    return refused


SCHEMA = "campaign/1"


def read_estimator(name: str, value: Any, units_checked: bool) -> Estimator:  # noqa: ARG001
    """The estimator of an FRF from a time series."""
    return checked_estimator(name, shown(value))


LINES = ("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n")
TIME_SERIES = ("sample_rate_hz", "force_n", "charge_pc")


@dataclass(frozen=True, eq=False)
class FrfRecording(FrfConditions):
    """Charge over force under these conditions.

    Either the FRF (`frequency_hz`, real and imaginary part, e^(+iωt); γ² in `coherence`) or the time series
    (`sample_rate_hz`, `force_n`, `charge_pc`) that it is estimated from, by `estimator` (H1 where it is None).
    """

    frf_re_pc_per_n: field.Series | None = None
    frf_im_pc_per_n: field.Series | None = None
    coherence: field.Coherence | None = None
    sample_rate_hz: field.Positive | None = None
    force_n: field.Series | None = None
    charge_pc: field.Series | None = None
    estimator: Annotated[Estimator, read_estimator] | None = None

    @classmethod
    def of_lines(
        cls, conditions: FrfConditions, frequency: Floats, values: Complexes, coherence: Floats | None = None
    ) -> Self:
        """The recording of an FRF `values` [C/N] at lines `frequency` [Hz], otherwise under these conditions."""
        attributes = vars(conditions.without_measurements(frequency_hz=frequency))
        real, imaginary = 1e12 * values.real, 1e12 * values.imag
        return cls(**attributes, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary, coherence=coherence)

    @classmethod
    def form_errors(cls, document: Mapping[str, Any]) -> list[InvalidInput]:
        """Errors unless a recording holds either a complete FRF or a complete time series."""
        series = [name for name in TIME_SERIES if document.get(name) is not None]
        lines = [name for name in (*LINES, "coherence") if document.get(name) is not None]
        if document.get("estimator") is not None and not series:
            allowed = "must be absent where there is no time series"
            return [errors.conflicting("estimator", shown(document["estimator"]), allowed)]
        if series and lines:
            return [errors.conflicting(series[0], "given", "must be absent where the FRF itself is given")]
        needed = TIME_SERIES if series else LINES
        return [errors.required(name) for name in needed if document.get(name) is None]

    def with_estimator(self, estimator: Estimator) -> Self:
        """With this estimator of the FRF; itself where it holds its lines."""
        return self if self.sample_rate_hz is None else replace(self, estimator=estimator)


@dataclass(frozen=True, eq=False)
class IndentationRecording(IndentationConditions):
    """The force on a sphere that is pressed in and drawn back; compression positive."""

    force_n: field.Series


@dataclass(frozen=True, eq=False)
class CompressionRecording(CompressionConditions):
    """The force on a cylinder between platens; compression positive, tension negative."""

    force_n: field.Series


CurveRecording = IndentationRecording | CompressionRecording
Recording = FrfRecording | CurveRecording
KINDS: dict[str, type[Recording]] = {
    "frf": FrfRecording,
    "indentation": IndentationRecording,
    "compression": CompressionRecording,
}
COLUMNS = (
    *("frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence", "force_n", "charge_pc", "displacement_mm"),
    "time_s",
)


@dataclass(frozen=True, eq=False)
class Campaign(Conditions):
    """Recordings of one skin. `units_checked` accepts magnitudes that look like a slip of units."""

    recordings: tuple[Recording, ...]
    units_checked: bool = False

    @property
    def curves(self) -> list[CurveRecording]:
        """The indentations and compressions, in order."""
        return [recording for recording in self.recordings if isinstance(recording, CurveRecording)]

    def with_curves(self, change: Callable[[CurveRecording], CurveRecording]) -> "Campaign":
        """The campaign with each curve changed."""
        recordings = (change(one) if isinstance(one, CurveRecording) else one for one in self.recordings)
        return replace(self, recordings=tuple(recordings))


@dataclass(frozen=True)
class RecordingProblem:
    """Why a recording was rejected: its id (or index, `recordings[3]`), the field, its value, what is allowed."""

    recording: str
    field: str
    value: Any
    allowed: str
    code: ErrorCode = ErrorCode.INVALID_VALUE

    def as_error(self, field: str) -> InvalidInput:
        """The problem as an error of a field."""
        return InvalidInput(field, self.value, self.allowed, code=self.code)


def frf_recordings(campaign: Campaign) -> list[FrfRecording]:
    """The campaign's FRF recordings, in order; raises InvalidInput where there is none."""
    return _at_least_one(campaign.of(FrfRecording))


def from_dict(document: Any) -> tuple[Campaign, list[RecordingProblem]]:
    """The campaign of a document with its valid recordings, and the problems of the others.

    Raises InvalidInput where the campaign itself or its skin is invalid.
    """
    fields_known = ("schema", "name", "skin", "recordings", "units_checked")
    document = field.of_schema("campaign", document, SCHEMA, fields_known)
    units_checked = field.flag("units_checked", document.get("units_checked", False), False)
    name = field.name("name", document.get("name"), units_checked)
    skin = field.build(SkinDescription, "skin", document.get("skin"), units_checked)
    for refusal in refusals(skin):
        raise refusal.at(f"skin.{refusal.field}")
    recording_documents = document.get("recordings")
    if not isinstance(recording_documents, list) or not recording_documents:
        raise errors.wrong_type("recordings", shown(recording_documents), "must be a list of at least one recording")
    skin = skin if skin.sensors else replace(skin, sensors=_single_sensor(recording_documents))
    field.counted_alike([sensor.id for sensor in skin.sensors], recording_documents)
    good: dict[str, Recording] = {}
    problems: list[RecordingProblem] = []
    for index, recording_document in enumerate(recording_documents):
        recording, refused = _recording(recording_document, skin, units_checked)
        if recording is not None and recording.id in good:
            refused = [errors.not_unique("id", recording.id, "must differ from every other recording's")]
        if recording is not None and not refused:
            good[recording.id] = recording
        label = recording.id if recording is not None else _label(recording_document, index)
        problems += [RecordingProblem(label, error.place, error.value, error.allowed, error.code) for error in refused]
    if not good and all(problem.field.startswith("skin.") for problem in problems):
        raise problems[0].as_error(problems[0].field)
    return Campaign(name, skin, tuple(good.values()), units_checked), problems


def _single_sensor(recordings: Sequence[Any]) -> Sensors:
    """The sensor that recordings name, where they name one."""
    named = {one["sensor"] for one in recordings if isinstance(one, Mapping) and isinstance(one.get("sensor"), str)}
    return read_sensors("skin.sensors", [{"id": name} for name in named], False) if len(named) == 1 else ()


def parse(document: Any) -> Campaign:
    """The campaign of a document; raises InvalidInput for the first problem, also of a recording."""
    campaign, problems = from_dict(document)
    if problems:
        first = problems[0]
        raise first.as_error(f"recordings[{first.recording}].{first.field}")
    return campaign


def to_dict(campaign: Campaign) -> dict[str, Any]:
    """The canonical document of a campaign: plain JSON values, without the fields that are not known.

    `youngs_modulus_mpa` and `d33_pc_per_n` are written as null when unknown; `kind` is left out when it is `frf`.
    """
    unknown = {"youngs_modulus_mpa": campaign.skin.youngs_modulus_mpa, "d33_pc_per_n": campaign.skin.d33_pc_per_n}
    skin = {**_plain(replace(campaign.skin, sensors=())), **unknown}
    if campaign.skin.sensors:
        skin["sensors"] = [_plain(sensor) for sensor in campaign.skin.sensors]
    document = {
        "schema": SCHEMA,
        "name": campaign.name,
        "skin": skin,
        "recordings": [_plain(recording) for recording in campaign.recordings],
    }
    return {**document, "units_checked": True} if campaign.units_checked else document


def _plain(model: Any) -> dict[str, Any]:
    document: dict[str, Any] = {}
    for name in (model_field.name for model_field in fields(model)):
        value = getattr(model, name)
        if isinstance(value, np.ndarray):
            document[name] = value.tolist()
        elif isinstance(value, Tolerances):
            document[name] = asdict(value)
        elif value not in (None, ()) and (name, value) != ("kind", DEFAULT_KIND):
            document[name] = list(value) if isinstance(value, tuple) else value
    return document


def _recording(given: Any, skin: SkinDescription, units_checked: bool) -> tuple[Recording | None, list[InvalidInput]]:
    try:
        document = field.mapping("recording", given)
    except InvalidInput as refusal:
        return None, [refusal]
    kind = shown(document.get("kind")) or DEFAULT_KIND
    if kind not in KINDS:
        return None, [errors.not_one_of("kind", kind, KINDS)]
    values, refused = field.check_fields(KINDS[kind], document, units_checked=units_checked)
    refused_fields = {error.field for error in refused}
    together = [*_unmet_needs(KINDS[kind], document, values, skin), *_unequal_lengths(values)]
    refused += [error for error in together if error.field not in refused_fields]
    if refused_fields:
        return None, refused
    recording = KINDS[kind](**{**values, "kind": kind})
    return recording, [*refused, *refusals(recording)]


def _unmet_needs(
    kind: type[Recording], document: Mapping[str, Any], values: Mapping[str, Any], skin: SkinDescription
) -> list[InvalidInput]:
    """The missing requirements of the recording's kind on the skin and its own fields; `values`: the valid fields."""
    refused = []
    sensor = values.get("sensor")
    if sensor is not None and sensor not in (skin_sensor.id for skin_sensor in skin.sensors):
        refused.append(
            InvalidInput("sensor", sensor, "must be the id of one of the skin's sensors", code=ErrorCode.NOT_ONE_OF)
        )
    refused += [
        errors.required(f"skin.{name}", "required by a recording of kind frf")
        for name in kind.needed_of_skin
        if getattr(skin, name) is None
    ]
    return [*refused, *kind.form_errors(document)]


def _unequal_lengths(values: Mapping[str, Any]) -> list[InvalidInput]:
    columns = {name: len(column) for name, column in values.items() if isinstance(column, np.ndarray)}
    if len(set(columns.values())) < 2:
        return []
    first, length = next(iter(columns.items()))
    return [errors.unequal_lengths(name, size, length, first) for name, size in columns.items() if size != length]


def _label(document: Any, index: int) -> str:
    recording_id = document.get("id") if isinstance(document, Mapping) else None
    return shown(recording_id) if isinstance(recording_id, str) and recording_id else f"recordings[{index}]"
