"""The level of each recording over the base model's, and what else than a slip may move it.

With y_i = ln |level_i / shape_i| of recording i, the model of levels is
    y = X b + ε,  b ~ N(0, P),  ε_i ~ N(0, s² + (g_i p)²),
where X holds a gain, one gain a sensor (of standard deviation t), and smooth functions of what physics may follow
(sphere, preload, place, order, load cycles, dwell, dynamic force), g_i is |∂ ln shape/∂ position| and p the scatter of
positions. The evidence is the largest ln N(y; 0, C) + ln p(s), C = X P Xᵀ + diag(s² + g² p²), over s, t, p and the size
of the smooth functions, p(s) the prior of a recording's gain: a slip is believed where taking it out of y raises the
evidence by far more than its own description costs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import log

import numpy as np
from scipy.linalg import solve_triangular

from underskin.diagnosis.noise.noise_priors import GAIN_FALL, Plateau
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.unnamed.axes import axes_of, recording_order
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.usual_scatter import GAIN_RANGE
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

_FLAT_HZ = 130.0  # the response is about flat below
_LEAST_RESPONSE = 0.2  # of the largest prediction: below it, near a crossing of zero, a level says nothing
SCATTER = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)  # s
SCATTER_PRIOR = Plateau.of(GAIN_RANGE, GAIN_FALL)
_SPREAD = (0.01, 0.06, 0.25)  # t
BENDS = (0.0, 0.1, 0.4, 1.0)  # of all smooth functions together; 0 where nothing moves the levels
_PLACE_MM = (0.0, 0.1, 0.3)  # p
_USUAL_SPREAD, _USUAL_PLACE_MM = 0.06, 0.1
_OVERALL, _SMOOTH, _BEND = 3.0, 0.3, 0.15  # prior standard deviations of the other coefficients


@dataclass(frozen=True, eq=False)
class Levels:
    """Columns over the recordings that tell a level."""

    number: Indices  # of the recording among all entries
    value: Floats  # y
    sensor: Indices
    order: Floats  # 0, 1, … in time
    slope: Floats  # g [1/mm]
    smooth: Floats  # (recordings, columns) of X, times their prior standard deviation
    cycles: Floats | None
    axes: tuple[Floats, ...]  # what else may move the level: each axis on which the recordings differ (recordings,)

    def fit(self, value: Floats, further: Floats | None = None, sensor: Indices | None = None) -> "LevelFit":
        """The best s, t, p and size of the smooth functions for `value` (recordings,).

        `further` (recordings, columns) is added to X, scaled by its prior; `sensor` stands for the recordings' sensors.
        """
        added = 0.0 if further is None else further @ further.T
        best, chosen, best_spread = -np.inf, np.eye(len(value)), self.spreads[0]
        for spread, place, bend in product(self.spreads, self.places, BENDS):
            fixed = self.expected(spread, bend * self.smooth, sensor) + np.diag((self.slope * place) ** 2) + added
            for scatter in SCATTER:
                covariance = fixed + np.diag(np.full(len(value), scatter**2))
                density = _log_density(value, covariance) + float(SCATTER_PRIOR.log_density(log(scatter)))
                if density > best:
                    best, chosen, best_spread = density, covariance, spread
        return LevelFit(best, np.asarray(np.linalg.inv(chosen), dtype=np.float64), best_spread)

    def precision(self, scatter: float, bend: float) -> Floats:
        """C⁻¹ (recordings, recordings) at given s and size of the smooth functions."""
        noise = scatter**2 + (_USUAL_PLACE_MM * self.slope) ** 2
        return np.asarray(np.linalg.inv(self.expected(_USUAL_SPREAD, bend * self.smooth) + np.diag(noise)))

    def expected(self, spread: float, columns: Floats, sensor: Indices | None = None) -> Floats:
        """X P Xᵀ (recordings, recordings) at a sensors' spread t, of a gain, the sensors' and columns."""
        own = np.eye(int(self.sensor.max()) + 1)[self.sensor if sensor is None else sensor]
        return np.asarray(_OVERALL**2 + columns @ columns.T + spread**2 * own @ own.T)

    @property
    def spreads(self) -> tuple[float, ...]:
        """The values of t that are tried."""
        return _SPREAD if self.sensor.max() > 0 else _SPREAD[:1]

    @property
    def places(self) -> tuple[float, ...]:
        """The values of p that are tried."""
        return _PLACE_MM if self.slope.max(initial=0.0) > 0.05 else _PLACE_MM[:1]


@dataclass(frozen=True, eq=False)
class LevelFit:
    """ln N(y; 0, C) + ln p(s) but for the normal density's constant at the best standard deviations, C⁻¹, and the
    sensors' spread t."""

    evidence: float
    precision: Floats
    spread: float

    def amplitude(self, value: Floats, column: Floats) -> tuple[float, float]:
        """That of a column in y by generalised least squares, and its standard deviation."""
        weight = self.precision @ column
        total = float(weight @ column)
        return float(weight @ value) / total, total**-0.5

    def residual(self, value: Floats) -> Floats:
        """Each value less what all others let expect of it."""
        return np.asarray((self.precision @ value) / np.diag(self.precision))


def levels(campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable) -> Levels:
    """Those of a campaign's recordings, signs put right."""
    whole = replace(campaign, recordings=tuple(entries))
    model = compose((), whole, table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    first = np.searchsorted(model.recording, np.arange(len(entries)))
    shape = np.abs(prediction.value[first].real)
    level = np.array([flat_level(entry) for entry in entries])
    chosen = np.flatnonzero(
        model.valid[first] & (shape > _LEAST_RESPONSE * shape.max(initial=0.0)) & (level > 0) & np.isfinite(level)
    )
    slope = np.zeros(len(entries))
    if prediction.position_slopes is not None:
        slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes[:, first])) / np.where(shape > 0, shape, 1.0)
    ids = [sensor.id for sensor in campaign.skin.sensors]
    cycles = [entry.load_cycles for entry in entries]
    counted = None if any(count is None for count in cycles) else np.array(cycles, dtype=float)[chosen]
    return Levels(
        number=chosen,
        value=np.log(level[chosen] / shape[chosen]),
        sensor=np.array([ids.index(entries[number].sensor) for number in chosen.tolist()], dtype=np.intp),
        order=recording_order(entries)[chosen],
        slope=slope[chosen],
        smooth=_smooth(campaign, [entries[number] for number in chosen.tolist()], recording_order(entries)[chosen]),
        cycles=counted,
        axes=tuple(axis.of([entries[number].id for number in chosen.tolist()]) for axis in axes_of(whole)),
    )


def flat_level(entry: FrfRecording) -> float:
    """|FRF| in the flat zone [C/N]."""
    measured = lines_of(entry)
    flat: Mask = measured.frequency <= _FLAT_HZ
    values = np.abs(measured.values[flat] if flat.any() else measured.values)
    return float(np.nanmedian(values))


def _smooth(campaign: Campaign, entries: Sequence[FrfRecording], order: Floats) -> Floats:
    """The smooth columns of X, times their prior standard deviations."""
    if not entries:
        return np.zeros((0, 0))
    preload = _standard(np.log([entry.preload_n for entry in entries]))
    sphere = np.array([entry.indenter_radius_mm for entry in entries])
    columns = []
    for radius in np.unique(sphere):
        own = (sphere == radius).astype(float)
        columns += [_SMOOTH * own, _SMOOTH * own * preload, _BEND * own * preload**2, _BEND * own * preload**3]
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    away = [np.subtract(entry.position_mm or known[entry.sensor], known[entry.sensor]) for entry in entries]
    x, y = np.array(away).T / (campaign.skin.thickness_mm or 1.0)
    columns += [_SMOOTH * column for column in (x, y, x**2 + y**2, x**2 - y**2, x * y)]
    columns += [_SMOOTH * column * np.hypot(x, y) ** 2 for column in (x, y, x**2 + y**2)]
    columns += [_BEND * column * preload for column in (x, y, x**2 + y**2)]
    along = _standard(order)
    columns += [_BEND * along, _BEND * along**2]
    for name in ("load_cycles", "dwell_s", "dynamic_force_n"):
        noted = [getattr(entry, name) for entry in entries]
        if all(value is not None and value > 0 for value in noted):
            columns.append(_BEND * _standard(np.log(np.array(noted, dtype=float))))
    return np.stack(columns, axis=1)


def _standard(column: Floats) -> Floats:
    """From −1 to 1."""
    middle, half = (np.max(column) + np.min(column)) / 2, (np.max(column) - np.min(column)) / 2
    return np.asarray((column - middle) / half if half > 0 else np.zeros(len(column)))


def _log_density(value: Floats, covariance: Floats) -> float:
    """ln N(value; 0, covariance) but for its constant."""
    root = np.linalg.cholesky(covariance)
    white = solve_triangular(root, value, lower=True, check_finite=False)
    return float(-0.5 * white @ white - np.log(np.diag(root)).sum())
