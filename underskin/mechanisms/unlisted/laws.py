"""Unlisted laws that act on recordings, and the level of each recording as a function of what they change.

The level's dependence on modulus, thickness, contact radius, force and contact position is tabulated once under the
base model, as declared, and interpolated: a law is then a factor on each recording, level(quantity ·
e^s)/level(quantity). The effect of other mechanisms on that factor is neglected, which is of second order. Under the
base model a force F e^s is a modulus E e^(−s): both enter through F/E alone. A contact radius a e^s at the same L is
that of a sphere R e^s on a modulus E e^(−2s).

Laws are bound to the recordings of a campaign; they are mechanisms like any other.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from operator import add
from typing import ClassVar, Literal, get_args

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.autodiff import Differentiated, chain, exp
from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.unlisted.forms import Axis, Feature, Shape
from underskin.mechanisms.unlisted.vocabulary import ActsOn, Form, acted_on, followed
from underskin.recordings.campaign import Conditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices

_LOGS: Mapping[str, tuple[float, float]] = {  # s that are tabulated
    "modulus": (-2.4, 1.8),
    "thickness": (-0.45, 0.45),
    "contact_radius": (-0.9, 0.7),
}
_NODES, _NODES_OF_RADIUS = 22, 12
_FURTHEST_MM, _DISTANCES = 2.0, 41  # beyond the largest offset; number of distances from the centre
_FAINT = 1e-3  # of the largest level, below which a factor on it is ignored
_ANY_LINE = np.array([1.0])  # Hz


@dataclass(frozen=True, eq=False)
class Curve:
    """Values at equal strides of x from `first` on (rows, nodes), and their slopes: cubic between, constant beyond."""

    first: float
    stride: float
    values: Floats
    slopes: Floats

    @classmethod
    def of(cls, x: Floats, values: Floats) -> "Curve":
        """Through the values (rows, nodes)."""
        slopes = CubicSpline(x, values, axis=1)(x, 1)
        return cls(float(x[0]), float(x[1] - x[0]), values, slopes)

    def at(self, rows: Indices, x: Floats) -> tuple[Floats, Floats]:
        """Values and slopes of these rows at x (…, rows)."""
        last = self.values.shape[1] - 1
        position = np.clip((x - self.first) / self.stride, 0.0, last)
        inside = (x >= self.first) & (x <= self.first + last * self.stride)
        cell = np.minimum(position.astype(np.intp), last - 1)
        t = position - cell
        v0, v1 = self.values[rows, cell], self.values[rows, cell + 1]
        d0, d1 = self.slopes[rows, cell] * self.stride, self.slopes[rows, cell + 1] * self.stride
        a, b = 2 * (v0 - v1) + d0 + d1, 3 * (v1 - v0) - 2 * d0 - d1
        slope = np.where(inside, (d0 + t * (2 * b + 3 * a * t)) / self.stride, 0.0)
        return v0 + t * (d0 + t * (b + a * t)), slope


class LevelTables:
    """Tables for the recordings of one campaign, by their ids; each is computed on first use."""

    def __init__(self, conditions: Conditions, table: SigmaTable) -> None:
        """Tabulate nothing yet."""
        recordings = [recording.without_measurements(frequency_hz=_ANY_LINE) for recording in frf_of(conditions)]
        self._conditions = Conditions(conditions.name, conditions.skin, tuple(recordings))
        self._table = table
        self._row_numbers = {recording.id: number for number, recording in enumerate(recordings)}
        self._force = np.array([recording.preload_n for recording in recordings])
        self._curves: dict[str, Curve] = {}

    def rows(self, ids: Sequence[str]) -> Indices:
        """Row indices of these recordings in the tables."""
        return np.array([self._row_numbers[name] for name in ids], dtype=np.intp)

    def forces(self, ids: Sequence[str]) -> Floats:
        """The preloads of these recordings [N]."""
        return np.asarray(self._force[self.rows(ids)])

    def factor(self, acts_on: str, rows: Indices, log: Differentiated) -> Differentiated:
        """level(quantity · e^s)/level(quantity) of recordings, from s (…, recordings)."""
        if acts_on == "force":
            acts_on, log = "modulus", -log
        if acts_on not in self._curves:
            self._curves[acts_on] = self._tabulated(acts_on)
        value, slope = self._curves[acts_on].at(rows, log.value)
        return chain(value, (slope, log))

    def moved(self, rows: Indices, x: Differentiated, y: Differentiated) -> Differentiated:
        """The same factor for contacts displaced by x and y [mm] (…, recordings)."""
        x, y = x + self._offset[rows, 0], y + self._offset[rows, 1]
        distance = np.hypot(x.value, y.value)
        away = np.where(distance > 0, distance, 1.0)
        radius = chain(distance, (x.value / away, x), (y.value / away, y))
        value, slope = self._over_distance.at(rows, radius.value)
        return chain(value, (slope, radius))

    @cached_property
    def usual_force(self) -> float:
        """The median preload [N]."""
        return float(np.median(self._force))

    @cached_property
    def _model(self) -> FrfModel:
        return FrfModel((), self._conditions, self._table)

    @cached_property
    def _start(self) -> Floats:
        return np.array([parameter.start for parameter in self._model.parameters])

    def _tabulated(self, acts_on: str) -> Curve:
        s = np.linspace(*_LOGS[acts_on], _NODES_OF_RADIUS if acts_on == "contact_radius" else _NODES)
        if acts_on == "contact_radius":
            levels = np.stack([self._of_radius(value) for value in s.tolist()])
        else:
            fits = np.tile(self._start, (len(s), 1))
            name = "youngs_modulus" if acts_on == "modulus" else "thickness"
            fits[:, self._model.nuisance_indices[name]] += s
            levels = self._model.respond(fits, slopes=False).level.value
        return Curve.of(s, _over(levels, self._base))

    def _of_radius(self, s: float) -> Floats:
        recordings = [
            replace(recording, indenter_radius_mm=recording.indenter_radius_mm * float(np.exp(s)))
            for recording in frf_of(self._conditions)
        ]
        model = FrfModel((), Conditions("radius", self._conditions.skin, tuple(recordings)), self._table)
        fit = self._start.copy()
        fit[model.nuisance_indices["youngs_modulus"]] -= 2 * s
        return model.respond(fit, slopes=False).level.value

    @cached_property
    def _base(self) -> Floats:
        return self._model.respond(self._start, slopes=False).level.value

    @cached_property
    def _offset(self) -> Floats:
        """The offset of each contact from its sensor's centre (recordings, 2) [mm]."""
        design = self._model.design
        return 1e3 * np.column_stack([design.point_x, design.point_y])[design.point]

    @cached_property
    def _over_distance(self) -> Curve:
        """The level over the distance from the sensor's centre [mm]."""
        recordings = frf_of(self._conditions)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in self._conditions.skin.sensors}
        keys = [(recording.indenter_radius_mm, recording.preload_n) for recording in recordings]
        distinct = list(dict.fromkeys(keys))
        radii = np.linspace(0.0, float(np.hypot(*self._offset.T).max()) + _FURTHEST_MM, _DISTANCES)
        sensor = recordings[0].sensor
        x, y = centres[sensor]
        placed = [
            replace(recordings[keys.index(key)], sensor=sensor, position_mm=(x + radius, y), id=f"{number} {index}")
            for number, key in enumerate(distinct)
            for index, radius in enumerate(radii.tolist())
        ]
        model = FrfModel((), Conditions("places", self._conditions.skin, tuple(placed)), self._table)
        levels = model.respond(self._start, slopes=False).level.value.reshape(len(distinct), -1)
        return Curve.of(radii, _over(levels[[distinct.index(key) for key in keys]].T, self._base))


def _over(levels: Floats, base: Floats) -> Floats:
    """levels/base (recordings, nodes) where the base is not faint, else 1."""
    is_significant = np.abs(base) > _FAINT * np.abs(base).max()
    return np.where(is_significant, levels / np.where(is_significant, base, 1.0), 1.0).T


PREFIX = "unnamed_"
Dispersion = Literal["angle", "delay", "power", "corner"]
DISPERSIONS: tuple[Dispersion, ...] = get_args(Dispersion)
_USUAL: dict[ActsOn, float] = {  # sd of the prior of a change, relative; of a position in mm, of a lag in rad
    "gain": 0.2,
    "modulus": 0.4,
    "thickness": 0.2,
    "contact_radius": 0.2,
    "force": 0.3,
    "position": 0.5,
    "frequency_response": 0.3,
}
_REASON = "nothing is known of it; as large as what is usually left out"
_LEAST = 0.1  # of a quantity, below which a change is continued so that it stays positive
_MOST = 6.0  # standard deviations of the prior that bound an amplitude
_EXPONENT = Parameter("law_exponent", "-", -4.0, 4.0, Normal(0.0, 1.5), "linear", None, _REASON)
_EXPONENTS = np.array([[-2.0], [-1.0], [-0.5], [0.0], [0.5], [1.0], [2.0]])


@dataclass(frozen=True, eq=False)
class LawDescription:
    """A law in a report: the quantity it acts on, the axis it follows, its form."""

    acts_on: ActsOn
    axis: str
    form: Form

    @property
    def words(self) -> str:
        """All three, for legends."""
        return f"{acted_on(self.acts_on, self.axis)} over {followed(self.axis)}, {self.form}"


class UnlistedLaw(Mechanism):
    """Base of all unlisted laws. Attributes: `description`, `share` of the prior of its combination, `grid` of
    values of its shape parameters (points, parameters), and `amplitudes`, the names of its other parameters."""

    plain = "Nobody listed it."
    source = "None."
    assumptions = "That of one form over one axis."
    law = "See its expression."
    kinds: ClassVar[tuple[Kind, ...]] = ("frf",)
    axes: ClassVar[tuple[str, ...]] = ()
    description: LawDescription
    share: float
    grid: Floats
    amplitudes: tuple[str, ...]
    log_share: float = 0.0  # in the prior of an unlisted law
    screened_fits: tuple[Floats, ...] = ()  # fit coordinates from screenings

    def describe(
        self, of: LawDescription, variant: Sequence[str], sizes: Sequence[Parameter], shape: Sequence[Parameter]
    ) -> None:
        """Set the description, the name, which ends with the parts of its `variant`, and the parameters: the sizes of
        changes, then those of its shape."""
        self.description = of
        self.name = PREFIX + "__".join(filter(None, (of.acts_on, of.axis, *variant)))
        self.amplitudes = tuple(parameter.name for parameter in sizes)
        self.parameters_stated = (*sizes, *shape)

    def guesses(self, conditions: object, kind: Kind) -> Sequence[Sequence[float]]:
        """The fits of screenings that found it."""
        return [
            [parameter.from_fit(at) for parameter, at in zip(self.parameters_stated, fit.tolist(), strict=True)]
            for fit in self.screened_fits
        ]


def in_plain_words(mechanism: Mechanism) -> str:
    """A mechanism's name; for an unlisted law the quantity it acts on, its axis and its form."""
    return mechanism.description.words if isinstance(mechanism, UnlistedLaw) else mechanism.name


class RecordingLaw(UnlistedLaw):
    """An unlisted law that changes the level of each recording: gain, pressed material, force or position."""

    stage = Stage.RECORDING
    order = 200
    axes = ()

    def __init__(self, acts_on: ActsOn, axis: Axis, shape: Shape, tables: LevelTables) -> None:
        """Bind the form to the axis of a campaign and to its levels."""
        self.axis, self.shape, self._acts_on, self.tables = axis, shape, acts_on, tables
        self.share, self.grid = shape.share, shape.points
        unit = {"force": "N", "position": "mm"}.get(acts_on, "-")
        usual = _USUAL[acts_on] * (tables.usual_force if acts_on == "force" else 1.0)
        usual = usual / 2 if shape.form == "free" else usual
        sizes = changes("law_change", unit, usual, shape.count * (2 if acts_on == "position" else 1))
        variant = ("relative" if axis.relative else "", shape.form, shape.variant)
        self.describe(LawDescription(acts_on, axis.name, shape.form), variant, sizes, shape.shape_parameters)

    def on(self, axis: Axis, tables: LevelTables) -> "RecordingLaw":
        """The same law on other recordings."""
        other = copy(self)
        other.axis, other.tables = axis, tables
        return other

    def features(self, ids: Sequence[str], values: Values) -> Sequence[Feature]:
        """Of recordings (…, recordings)."""
        return self.shape.features(self.axis.of(ids), values)

    def act(self, state: FrfState, values: Values) -> None:
        """Set the factor on each recording."""
        state.factor = self.factor(state.design.ids, values)

    def factor(self, ids: tuple[str, ...], values: Values) -> Differentiated:
        """The factor on each of these recordings."""
        features = self.features(ids, values)
        rows = self.tables.rows(ids)
        if self._acts_on == "position":
            half = len(self.amplitudes) // 2
            x, y = (
                reduce(add, [values[name] * feature for name, feature in zip(names, features, strict=True)])
                for names in (self.amplitudes[:half], self.amplitudes[half:])
            )
            return self.tables.moved(rows, x, y)
        change = reduce(add, [values[name] * feature for name, feature in zip(self.amplitudes, features, strict=True)])
        if self.shape.logarithmic:
            log = change
        elif self._acts_on == "force":
            log = log_positive(change / self.tables.forces(ids))
        else:
            log = log_positive(change)
        if self._acts_on == "gain":
            return exp(log)
        return self.tables.factor(self._acts_on, rows, log)

    def sensitivity(self, ids: tuple[str, ...]) -> Floats:
        """∂ ln level by the law's features at amplitudes of 0 (recordings, 1); of a position by x and y (…, 2)."""
        rows = self.tables.rows(ids)
        if self._acts_on == "position":
            none = Differentiated(np.zeros((1, 1)), np.zeros((2, 1, 1)))
            x, y = (Differentiated(none.value, np.eye(2)[index][:, None, None]) for index in (0, 1))
            moved = self.tables.moved(rows, x, y)
            return np.asarray((moved.slopes / moved.value)[:, 0].T)
        if self._acts_on == "gain":
            return np.ones((len(ids), 1))
        seed = Differentiated(np.zeros((1, len(ids))), np.ones((1, 1, len(ids))))
        by_log = self.tables.factor(self._acts_on, rows, seed).slopes[0, 0]
        return np.asarray(by_log / (self.tables.forces(ids) if self._acts_on == "force" else 1.0))[:, None]


def log_positive(change: Differentiated) -> Differentiated:
    """ln(1 + change); below a quantity of 0.1 continued along its tangent."""
    return log_of(1.0 + change)


def log_of(quantity: Differentiated) -> Differentiated:
    """The logarithm of a relative quantity, below 0.1 continued along its tangent."""
    factor = quantity.value
    inside = factor > _LEAST
    value = np.where(inside, np.log(np.where(inside, factor, 1.0)), np.log(_LEAST) + factor / _LEAST - 1)
    return chain(value, (1 / np.where(inside, factor, _LEAST), quantity))


@lru_cache(maxsize=64)
def changes(name: str, unit: str, usual: float, count: int, most: float = _MOST) -> tuple[Parameter, ...]:
    """This many changes, each with the typical size as prior sd; bounded by `most` times that."""
    names = [f"{name}_{number + 1}" for number in range(count)] if count > 1 else [name]
    prior = Normal(0.0, usual)
    return tuple(Parameter(label, unit, -most * usual, most * usual, prior, "linear", 0.0, _REASON) for label in names)


class LagLaw(UnlistedLaw):
    """A phase lag, or a fall-off over the lines, that follows an axis of the recordings.

    `dispersion`: an angle, the same at all frequencies; a delay, ∝ f; a power (if)^n; the corner of a high pass. For a
    lag φ the factors are exp(−iφ), exp(−iφ f/f_highest), (if/f_middle)^(−φ) and 1/(1 + φ f_lowest/(if)).
    """

    stage = Stage.LINES
    order = 200
    reads = ("id",)

    def __init__(self, dispersion: Dispersion, axis: Axis, shape: Shape, lines: Floats) -> None:
        """Over the band of these lines [Hz]."""
        self.axis, self.shape, self.dispersion = axis, shape, dispersion
        self.share = shape.share / len(DISPERSIONS)
        self.lowest_hz, self.highest_hz = float(lines[0]), float(lines[-1])
        self.middle_hz = float(np.exp(np.log(lines).mean()))
        usual = _USUAL["frequency_response"] * {"power": 0.3, "corner": 2.0}.get(dispersion, 1.0)
        self.grid = _EXPONENTS if shape.logarithmic else shape.points
        of_shape = (_EXPONENT, *shape.shape_parameters) if shape.logarithmic else shape.shape_parameters
        variant = ("relative" if axis.relative else "", shape.form, dispersion, shape.variant)
        description = LawDescription("frequency_response", axis.name, shape.form)
        self.describe(description, variant, changes("law_lag", "-", usual, shape.count), of_shape)

    def on(self, axis: Axis) -> "LagLaw":
        """The same law on other recordings."""
        other = copy(self)
        other.axis = axis
        return other

    def lag(self, ids: Sequence[str], values: Values) -> Differentiated:
        """Of these recordings (…, recordings): an angle [rad] or an exponent."""
        features = self.shape.features(self.axis.of(ids), values)
        if self.shape.logarithmic:
            features = [exp(values["law_exponent"] * features[0])]
        return reduce(add, [values[name] * feature for name, feature in zip(self.amplitudes, features, strict=True)])

    def act(self, state: FrfState, values: Values) -> None:
        """Set the factor on each distinct line."""
        design = state.design
        ids = [design.ids[number] for number in design.contact_recording]
        lag = self.lag(ids, values).spread(len(ids))[design.line_contact]
        pattern = self.pattern(design.line_frequency)
        state.factor = 1.0 / (1.0 - lag * pattern) if self.dispersion == "corner" else exp(lag * pattern)

    def pattern(self, frequency: Floats) -> Array:
        """∂ ln factor by the lag, where that is 0."""
        match self.dispersion:
            case "angle":
                return np.full(len(frequency), -1j)
            case "delay":
                return np.asarray(-1j * frequency / self.highest_hz)
            case "power":
                return np.asarray(-(np.log(frequency / self.middle_hz) + 0.5j * np.pi))
            case "corner":
                return np.asarray(1j * self.lowest_hz / frequency)
