"""How the level of each recording follows its modulus, thickness, contact radius, force, or the place of its contact.

Worked out once under the base model, as declared, and interpolated: a law that acts there is then a factor on each
recording, level(quantity · e^s)/level(quantity). What other mechanisms of a set do to that factor is left out, which is
of second order. Under the base model a force F e^s is a modulus E e^(−s): both enter through F/E alone. A contact
radius a e^s at the same L is that of a sphere R e^s on a modulus E e^(−2s).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.autodiff import Differentiated, chain
from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.models.frf import FrfModel
from underskin.recordings.conditions import Conditions, frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices

_LOGS: Mapping[str, tuple[float, float]] = {  # s that are tabulated
    "modulus": (-2.4, 1.8),
    "thickness": (-0.45, 0.45),
    "contact_radius": (-0.9, 0.7),
}
_NODES, _NODES_OF_RADIUS = 22, 12
_FURTHEST_MM, _PLACES = 2.0, 41  # beyond the largest offset; how many places from the sensor's centre
_FAINT = 1e-3  # of the largest level, below which a factor on it says nothing
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
        place = np.clip((x - self.first) / self.stride, 0.0, last)
        inside = (x >= self.first) & (x <= self.first + last * self.stride)
        left = np.minimum(place.astype(np.intp), last - 1)
        t = place - left
        v0, v1 = self.values[rows, left], self.values[rows, left + 1]
        d0, d1 = self.slopes[rows, left] * self.stride, self.slopes[rows, left + 1] * self.stride
        a, b = 2 * (v0 - v1) + d0 + d1, 3 * (v1 - v0) - 2 * d0 - d1
        slope = np.where(inside, (d0 + t * (2 * b + 3 * a * t)) / self.stride, 0.0)
        return v0 + t * (d0 + t * (b + a * t)), slope


class LevelTables:
    """Of one campaign's recordings, by their ids; each table is worked out when it is first asked for."""

    def __init__(self, conditions: Conditions, table: SigmaTable, beside: Sequence[Mechanism]) -> None:
        """`beside`: mechanisms for which σ has room as well."""
        entries = [entry.without_measurements(frequency_hz=_ANY_LINE) for entry in frf_of(conditions)]
        self._conditions = Conditions(conditions.name, conditions.skin, tuple(entries))
        self._table, self._beside = table, tuple(beside)
        self._places = {entry.id: number for number, entry in enumerate(entries)}
        self.force = {entry.id: entry.preload_n for entry in entries}
        self._known: dict[str, Curve] = {}

    def rows(self, ids: Sequence[str]) -> Indices:
        """Where in the tables these recordings are."""
        return np.array([self._places[name] for name in ids], dtype=np.intp)

    def factor(self, acts_on: str, rows: Indices, log: Differentiated) -> Differentiated:
        """level(quantity · e^s)/level(quantity) of recordings, from s (…, recordings)."""
        if acts_on == "force":
            acts_on, log = "modulus", -log
        if acts_on not in self._known:
            self._known[acts_on] = self._tabulated(acts_on)
        value, slope = self._known[acts_on].at(rows, log.value)
        return chain(value, (slope, log))

    def moved(self, rows: Indices, x: Differentiated, y: Differentiated) -> Differentiated:
        """The same where contacts lie elsewhere by x and y [mm] (…, recordings)."""
        x, y = x + self._offset[rows, 0], y + self._offset[rows, 1]
        distance = np.hypot(x.value, y.value)
        away = np.where(distance > 0, distance, 1.0)
        radius = chain(distance, (x.value / away, x), (y.value / away, y))
        value, slope = self._over_places.at(rows, radius.value)
        return chain(value, (slope, radius))

    @cached_property
    def usual_force(self) -> float:
        """The median preload [N]."""
        return float(np.median(list(self.force.values())))

    @cached_property
    def _model(self) -> FrfModel:
        return FrfModel((), self._conditions, self._table, self._beside)

    @cached_property
    def _start(self) -> Floats:
        return np.array([entry.start for entry in self._model.parameters])

    def _tabulated(self, acts_on: str) -> Curve:
        s = np.linspace(*_LOGS[acts_on], _NODES_OF_RADIUS if acts_on == "contact_radius" else _NODES)
        if acts_on == "contact_radius":
            levels = np.stack([self._of_radius(value) for value in s.tolist()])
        else:
            fits = np.tile(self._start, (len(s), 1))
            name = "youngs_modulus" if acts_on == "modulus" else "thickness"
            fits[:, self._model.places_of_nuisances[name]] += s
            levels = self._model.respond(fits, slopes=False).level.value
        return Curve.of(s, _over(levels, self._base))

    def _of_radius(self, s: float) -> Floats:
        entries = [
            replace(entry, indenter_radius_mm=entry.indenter_radius_mm * float(np.exp(s)))
            for entry in frf_of(self._conditions)
        ]
        model = FrfModel((), Conditions("radius", self._conditions.skin, tuple(entries)), self._table, self._beside)
        fit = self._start.copy()
        fit[model.places_of_nuisances["youngs_modulus"]] -= 2 * s
        return model.respond(fit, slopes=False).level.value

    @cached_property
    def _base(self) -> Floats:
        return self._model.respond(self._start, slopes=False).level.value

    @cached_property
    def _offset(self) -> Floats:
        """Of each contact from its sensor's centre (recordings, 2) [mm]."""
        design = self._model.design
        return 1e3 * np.column_stack([design.point_x, design.point_y])[design.point]

    @cached_property
    def _over_places(self) -> Curve:
        """Over the distance from the sensor's centre [mm]."""
        entries = frf_of(self._conditions)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in self._conditions.skin.sensors}
        keys = [(entry.indenter_radius_mm, entry.preload_n) for entry in entries]
        distinct = list(dict.fromkeys(keys))
        radii = np.linspace(0.0, float(np.hypot(*self._offset.T).max()) + _FURTHEST_MM, _PLACES)
        sensor = entries[0].sensor
        x, y = centres[sensor]
        placed = [
            replace(entries[keys.index(key)], sensor=sensor, position_mm=(x + radius, y), id=f"{number} {place}")
            for number, key in enumerate(distinct)
            for place, radius in enumerate(radii.tolist())
        ]
        model = FrfModel((), Conditions("places", self._conditions.skin, tuple(placed)), self._table, self._beside)
        levels = model.respond(self._start, slopes=False).level.value.reshape(len(distinct), -1)
        return Curve.of(radii, _over(levels[[distinct.index(key) for key in keys]].T, self._base))


def _over(levels: Floats, base: Floats) -> Floats:
    """levels/base (recordings, nodes), where the base shows anything."""
    shows = np.abs(base) > _FAINT * np.abs(base).max()
    return np.where(shows, levels / np.where(shows, base, 1.0), 1.0).T
