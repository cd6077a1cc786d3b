"""The conditions of recordings: skin, sphere or sample, and all else that is chosen before anything is measured.

A forward model takes conditions and predicts what would be measured under them. A recording is its conditions and what
was measured under them (`underskin.recordings.campaign`), so that a campaign stands wherever conditions are asked for.
Fields are named as in `campaign/1` and keep its units.
"""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, fields, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from underskin.errors import ErrorCode, InvalidInput, not_one_of, not_unique, out_of_range, too_few, wrong_type
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.recordings import validation as field
from underskin.recordings.noted_columns import Further
from underskin.recordings.shown_values import shown
from underskin.units import Floats, checked, finite, non_negative, to_si


@dataclass(frozen=True)
class Sensor:
    """A sensor of the array and its centre: x along the skin's length, y along its width."""

    id: field.Name
    x_mm: field.Number
    y_mm: field.Number


def read_sensors(name: str, value: Any, units_checked: bool) -> tuple[Sensor, ...]:
    """The sensors of an array, each with an id of its own."""
    if not isinstance(value, list | tuple):
        raise wrong_type(name, shown(value), "must be a list of sensors")
    sensors = [field.build(Sensor, f"{name}[{index}]", entry, units_checked) for index, entry in enumerate(value)]
    seen: set[str] = set()
    for index, sensor in enumerate(sensors):
        if sensor.id in seen:
            raise not_unique(f"{name}[{index}].id", sensor.id, "must differ from every other sensor's")
        seen.add(sensor.id)
    return tuple(sensors)


Sensors = Annotated[tuple[Sensor, ...], read_sensors]


@dataclass(frozen=True)
class Tolerances:
    """What declared values of the skin may be off by: standard deviations [%].

    They are part of absolute intervals, such as that of the array's d33, and of none that compares sensors or dates.
    """

    thickness_percent: field.NotNegative = 2.0
    sensor_radius_percent: field.NotNegative = 2.0
    youngs_modulus_percent: field.NotNegative = 10.0


def read_tolerances(name: str, value: Any, units_checked: bool) -> Tolerances:
    """Those that differ from the default ones."""
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


@dataclass(frozen=True, eq=False)
class FrfConditions:
    """The skin is pressed by `preload_n` and shaken by `dynamic_force_n` (peak amplitude) at `frequency_hz`.

    A `dynamic_force_n` of 0 stands for the limit of a small oscillation. `frequency_hz` is None where a time series is
    recorded, whose lines are yet to be estimated. `conditions` holds what else the lab noted, numbers or words by names
    of its own.
    """

    id: field.Name
    sensor: field.Name
    indenter_radius_mm: field.Declared
    preload_n: field.Declared
    dynamic_force_n: field.Positive
    kind: field.Name = "frf"
    recorded_at: field.TimeOfDay | None = None
    load_cycles: field.Count | None = None
    dwell_s: field.NotNegative | None = None
    position_mm: field.Position | None = None
    frequency_hz: field.Frequencies | None = None
    conditions: Further | None = None

    def without_measurements(self, **changes: Any) -> "FrfConditions":
        """These conditions alone, with some of them changed."""
        own = vars(self)
        return FrfConditions(**({name: own[name] for name in _OF_FRF} | changes))


_OF_FRF = [entry.name for entry in fields(FrfConditions)]


@dataclass(frozen=True, eq=False)
class IndentationConditions:
    """A sphere pressed in and drawn back by `displacement_mm`, loading and unloading in order.

    `displacement_mm` is the sphere's own; `stage_stiffness_n_per_mm` is that of a stage or cantilever whose deflection
    has been subtracted, which decides where a contact that sticks comes off.
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
    conditions: Further | None = None


@dataclass(frozen=True, eq=False)
class CompressionConditions:
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
    conditions: Further | None = None


CurveConditions = IndentationConditions | CompressionConditions
RecordingConditions = FrfConditions | IndentationConditions | CompressionConditions


@dataclass(frozen=True, eq=False)
class Conditions:
    """Conditions of several recordings of one skin; `name` is what messages call them."""

    name: str
    skin: SkinDescription
    recordings: tuple[RecordingConditions, ...]


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
    centres = {entry.id: entry for entry in skin.sensors}
    if sensor is not None and sensor not in centres:
        raise not_one_of("sensor", sensor, centres)
    centre = skin.sensors[0] if sensor is None else centres[sensor]
    columns = {name: values for name, values in further.items() if values is not None}
    columns = {"offset_x_mm": 0.0, "offset_y_mm": 0.0, "dynamic_force_n": 0.0} | columns
    columns |= {"indenter_radius_mm": indenter_radius_mm, "preload_n": preload_n}
    lines = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    _check_values(skin, columns, lines)
    recordings = []
    for number, row in enumerate(_rows(columns)):
        place = centre.x_mm + row.pop("offset_x_mm"), centre.y_mm + row.pop("offset_y_mm")
        recordings.append(
            FrfConditions(id=f"row {number}", sensor=centre.id, position_mm=place, frequency_hz=lines, **row)
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
        whole = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values, dtype=float)) for values in columns.values()))
    except ValueError:
        lengths = ", ".join(f"{name} {np.size(values)}" for name, values in columns.items())
        raise InvalidInput(
            "columns", lengths, "must have one length, or be single numbers", code=ErrorCode.UNEQUAL_LENGTHS
        ) from None
    return [dict(zip(columns, row, strict=True)) for row in zip(*(column.tolist() for column in whole), strict=True)]


def frf_of(conditions: Conditions) -> list[FrfConditions]:
    """Those of FRF recordings, in order; raises InvalidInput where there is none."""
    recordings = [entry for entry in conditions.recordings if isinstance(entry, FrfConditions)]
    if not recordings:
        raise too_few("recordings", "none of kind frf", "must hold at least one")
    return recordings


def curves_of(conditions: Conditions) -> list[CurveConditions]:
    """Those of indentations and compressions, in order."""
    return [entry for entry in conditions.recordings if isinstance(entry, CurveConditions)]


def offsets(conditions: Conditions) -> Floats:
    """The commanded place of the sphere in each FRF recording, from its sensor's centre (recordings, 2) [m]."""
    centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors}
    beside = [
        np.subtract(entry.position_mm or centres[entry.sensor], centres[entry.sensor]) for entry in frf_of(conditions)
    ]
    return to_si("thickness_mm", np.array(beside))
