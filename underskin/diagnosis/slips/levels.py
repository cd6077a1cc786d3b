"""Levels of recordings over the base model's, the model of these levels, and what may change them.

A recording's level is the magnitude of its FRF in the flat zone. With y_i = ln |level_i / shape_i|, shape_i being the
base model's, the model of levels is
    y = X b + ε,  b ~ N(0, P),  ε_i ~ N(0, s² + (g_i p)²),
where X holds a gain, one gain per sensor (of standard deviation t), and smooth functions of what physics may depend on
(sphere, preload, position, order, load cycles, dwell, dynamic force), g_i is |∂ ln shape/∂ position| and p the scatter
of positions. The evidence is the largest ln N(y; 0, C) + ln p(s), C = X P Xᵀ + diag(s² + g² p²), over s, t, p and the
size of the smooth functions, p(s) being the prior of a recording's gain. A recording error is accepted where removing
it from y raises the evidence by far more than the cost of describing it.

Causes of a change in level: none, one mechanism of the catalogue, or a smooth change (several mechanisms, or an
unlisted law). The changes Δ of ln level under a mechanism, at K points from the priors of its parameters, enter as a
normal change of the same second moments, Σ Δ Δᵀ/K. With no cause, and with each mechanism, the declared modulus and
thickness may be off as far as their priors allow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import log

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp
from scipy.stats import qmc

from underskin.diagnosis.noise import GAIN_FALL, Plateau
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Normal
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.axes import axes_of, recording_order
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording
from underskin.recordings.frf.estimation import advanced, common_delay, lines_of
from underskin.recordings.frf.spectra import stacked
from underskin.recordings.usual_scatter import GAIN_RANGE
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Complexes, Floats, Indices, Mask


def aligned_lines(recordings: Sequence[FrfRecording]) -> list[Complexes]:
    """The values [C/N] of each recording's lines without the delay common to all."""
    measured = [lines_of(recording) for recording in recordings]
    delay = common_delay(stacked(measured))
    return [advanced(frf.values, frf.frequency, delay) if delay else frf.values for frf in measured]


_LEAST = 2  # recordings: a single one is always extreme along some axis
_MISMATCH = 0.25  # share of the recordings that may differ
_TERMS, _SIZE = 4, 0.3  # number of cosines over the rank along an axis, and the prior standard deviation of each


def follows_an_axis(chosen: Mask, axes: Sequence[Floats]) -> bool:
    """Whether the chosen recordings are, but for a few, those on one side of an axis, or on one level of it.

    Then a law along the axis may act, and the recordings need not be wrong.
    """
    if chosen.sum() < _LEAST:
        return False
    allowed = _MISMATCH * chosen.sum()
    for axis in axes:
        for level in np.unique(axis):
            for part in (axis >= level, axis == level):
                mismatches = int((part ^ chosen).sum())
                if min(mismatches, len(chosen) - mismatches) <= allowed:
                    return True
    return False


def smooth_along(axis: Floats) -> Floats:
    """Cosines over the rank along an axis, times their prior standard deviation (recordings, terms)."""
    _, rank = np.unique(axis, return_inverse=True)
    share = rank / max(int(rank.max()), 1)
    return np.asarray(_SIZE * np.cos(np.pi * np.outer(share, np.arange(1, _TERMS + 1))))


_FLAT_HZ = 130.0  # below it the response is about flat
_LEAST_RESPONSE = 0.2  # of the largest prediction: below it, near a zero crossing, a level is not informative
SCATTER = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)  # s
SCATTER_PRIOR = Plateau.of(GAIN_RANGE, GAIN_FALL)
_SPREAD = (0.01, 0.06, 0.25)  # t
SMOOTH_SIZES = (0.0, 0.1, 0.4, 1.0)  # of all smooth functions together; 0 where nothing moves the levels
_POSITION_MM = (0.0, 0.1, 0.3)  # p
_USUAL_SPREAD, _USUAL_POSITION_MM = 0.06, 0.1
_OVERALL, _SMOOTH, _CURVATURE = 3.0, 0.3, 0.15  # prior standard deviations of the other coefficients


@dataclass(frozen=True, eq=False)
class Levels:
    """Columns over the recordings with an informative level."""

    index: Indices  # of the recording among all
    value: Floats  # y
    sensor: Indices
    order: Floats  # 0, 1, … in time
    slope: Floats  # g [1/mm]
    smooth: Floats  # (recordings, columns) of X, times their prior standard deviation
    cycles: Floats | None
    axes: tuple[Floats, ...]  # each axis on which the recordings differ (recordings,)

    def fit(self, value: Floats, further: Floats | None = None, sensor: Indices | None = None) -> "LevelFit":
        """The best s, t, p and size of the smooth functions for `value` (recordings,).

        `further` (recordings, columns), scaled by its prior, is added to X; `sensor` replaces the recordings' sensors.
        """
        added = 0.0 if further is None else further @ further.T
        best, chosen, best_spread = -np.inf, np.eye(len(value)), self.spreads[0]
        for spread, position_scatter, smooth_size in product(self.spreads, self.position_scatters, SMOOTH_SIZES):
            fixed = (
                self.expected(spread, smooth_size * self.smooth, sensor)
                + np.diag((self.slope * position_scatter) ** 2)
                + added
            )
            for scatter in SCATTER:
                covariance = fixed + np.diag(np.full(len(value), scatter**2))
                density = _log_density(value, covariance) + float(SCATTER_PRIOR.log_density(log(scatter)))
                if density > best:
                    best, chosen, best_spread = density, covariance, spread
        return LevelFit(best, np.asarray(np.linalg.inv(chosen), dtype=np.float64), best_spread)

    def precision(self, scatter: float, smooth_size: float) -> Floats:
        """C⁻¹ (recordings, recordings) at a given s and size of the smooth functions."""
        noise = scatter**2 + (_USUAL_POSITION_MM * self.slope) ** 2
        return np.asarray(np.linalg.inv(self.expected(_USUAL_SPREAD, smooth_size * self.smooth) + np.diag(noise)))

    def expected(self, spread: float, columns: Floats, sensor: Indices | None = None) -> Floats:
        """X P Xᵀ (recordings, recordings) at the sensors' spread t, for a gain, the sensors' gains and `columns`."""
        indicator = np.eye(int(self.sensor.max()) + 1)[self.sensor if sensor is None else sensor]
        return np.asarray(_OVERALL**2 + columns @ columns.T + spread**2 * indicator @ indicator.T)

    @property
    def spreads(self) -> tuple[float, ...]:
        """The values of t that are tried."""
        return _SPREAD if self.sensor.max() > 0 else _SPREAD[:1]

    @property
    def position_scatters(self) -> tuple[float, ...]:
        """The values of p that are tried."""
        return _POSITION_MM if self.slope.max(initial=0.0) > 0.05 else _POSITION_MM[:1]


@dataclass(frozen=True, eq=False)
class LevelFit:
    """ln N(y; 0, C) + ln p(s) but for the normal density's constant at the best standard deviations, C⁻¹, and the
    sensors' spread t."""

    evidence: float
    precision: Floats
    spread: float

    def amplitude(self, value: Floats, column: Floats) -> tuple[float, float]:
        """The amplitude of a column in y by generalised least squares, and its standard deviation."""
        weight = self.precision @ column
        total = float(weight @ column)
        return float(weight @ value) / total, total**-0.5

    def residual(self, value: Floats) -> Floats:
        """Each value minus its expectation given all others."""
        return np.asarray((self.precision @ value) / np.diag(self.precision))


def levels(campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable) -> Levels:
    """The levels of a campaign's recordings, whose signs are correct."""
    subset = replace(campaign, recordings=tuple(recordings))
    model = compose((), subset, table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    first = np.searchsorted(model.recording, np.arange(len(recordings)))
    shape = np.abs(prediction.value[first].real)
    level = np.array([flat_level(recording) for recording in recordings])
    chosen = np.flatnonzero(
        model.valid[first] & (shape > _LEAST_RESPONSE * shape.max(initial=0.0)) & (level > 0) & np.isfinite(level)
    )
    slope = np.zeros(len(recordings))
    if prediction.position_slopes is not None:
        slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes[:, first])) / np.where(shape > 0, shape, 1.0)
    ids = [sensor.id for sensor in campaign.skin.sensors]
    cycles = [recording.load_cycles for recording in recordings]
    counted = None if any(count is None for count in cycles) else np.array(cycles, dtype=float)[chosen]
    return Levels(
        index=chosen,
        value=np.log(level[chosen] / shape[chosen]),
        sensor=np.array([ids.index(recordings[index].sensor) for index in chosen.tolist()], dtype=np.intp),
        order=recording_order(recordings)[chosen],
        slope=slope[chosen],
        smooth=_smooth(campaign, [recordings[index] for index in chosen.tolist()], recording_order(recordings)[chosen]),
        cycles=counted,
        axes=tuple(axis.of([recordings[index].id for index in chosen.tolist()]) for axis in axes_of(subset)),
    )


def flat_level(recording: FrfRecording) -> float:
    """|FRF| in the flat zone [C/N]."""
    measured = lines_of(recording)
    flat: Mask = measured.frequency <= _FLAT_HZ
    values = np.abs(measured.values[flat] if flat.any() else measured.values)
    return float(np.nanmedian(values))


def _smooth(campaign: Campaign, recordings: Sequence[FrfRecording], order: Floats) -> Floats:
    """The smooth columns of X, times their prior standard deviations."""
    if not recordings:
        return np.zeros((0, 0))
    preload = _standard(np.log([recording.preload_n for recording in recordings]))
    sphere = np.array([recording.indenter_radius_mm for recording in recordings])
    columns = []
    for radius in np.unique(sphere):
        of_sphere = (sphere == radius).astype(float)
        columns += [
            _SMOOTH * of_sphere,
            _SMOOTH * of_sphere * preload,
            _CURVATURE * of_sphere * preload**2,
            _CURVATURE * of_sphere * preload**3,
        ]
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    offsets = [
        np.subtract(recording.position_mm or positions[recording.sensor], positions[recording.sensor])
        for recording in recordings
    ]
    x, y = np.array(offsets).T / (campaign.skin.thickness_mm or 1.0)
    columns += [_SMOOTH * column for column in (x, y, x**2 + y**2, x**2 - y**2, x * y)]
    columns += [_SMOOTH * column * np.hypot(x, y) ** 2 for column in (x, y, x**2 + y**2)]
    columns += [_CURVATURE * column * preload for column in (x, y, x**2 + y**2)]
    along = _standard(order)
    columns += [_CURVATURE * along, _CURVATURE * along**2]
    for name in ("load_cycles", "dwell_s", "dynamic_force_n"):
        noted = [getattr(recording, name) for recording in recordings]
        if all(value is not None and value > 0 for value in noted):
            columns.append(_CURVATURE * _standard(np.log(np.array(noted, dtype=float))))
    return np.stack(columns, axis=1)


def _standard(column: Floats) -> Floats:
    """The column scaled to −1 … 1."""
    middle, half = (np.max(column) + np.min(column)) / 2, (np.max(column) - np.min(column)) / 2
    return np.asarray((column - middle) / half if half > 0 else np.zeros(len(column)))


def _log_density(value: Floats, covariance: Floats) -> float:
    """ln N(value; 0, covariance) but for its constant."""
    root = np.linalg.cholesky(covariance)
    white = solve_triangular(root, value, lower=True, check_finite=False)
    return float(-0.5 * white @ white - np.log(np.diag(root)).sum())


_NO_CAUSE, _SINGLE_CAUSE, _SMOOTH_CAUSE = 0.6, 0.25, 0.15  # prior probabilities
_DRAWS = 8
_LEAST_RATIO = 1e-3  # of the base model's response


@dataclass(frozen=True, eq=False)
class Cause:
    """The logarithm of its prior, and its columns of X times their prior standard deviations (recordings, columns)."""

    log_prior: float
    columns: Floats


@dataclass(frozen=True, eq=False)
class Explained:
    """ln evidence of each alternative (alternatives,), and the means of its coefficients over their prior standard
    deviations (alternatives, columns)."""

    evidence: Floats
    coefficient: Floats


def causes_of(campaign: Campaign, recordings: Sequence[FrfRecording], levels: Levels, table: SigmaTable) -> list[Cause]:
    """All causes that may change the levels of a campaign's recordings, for the rows of `levels`."""
    contacts = tuple(recording.without_measurements(frequency_hz=np.ones(1)) for recording in recordings)
    conditions = Conditions("contacts", campaign.skin, contacts)
    base = compose((), conditions, table, "frf")
    start = np.array([parameter.start for parameter in base.parameters])
    prediction = base.predict(start)
    value = prediction.value[levels.index]
    declared = np.stack(
        [
            (slope[levels.index] / value).real * parameter.prior.sd
            for parameter, slope in zip(base.parameters, prediction.slopes, strict=True)
            if isinstance(parameter.prior, Normal)
        ],
        axis=1,
    )
    laws = []
    for name, mechanism in CATALOGUE.items():
        if "frf" not in mechanism.kinds or mechanism.needs_lines:
            continue
        try:
            model = compose((name,), conditions, table, "frf")
        except Unsupported:
            continue
        assert isinstance(model, FrfModel)
        if not any(parameter.moves_covariance for parameter in model.parameters):
            relative = np.abs([changed[levels.index] / value for changed in model.values(_drawn(model, start))])
            change = np.log(np.maximum(relative, _LEAST_RATIO))
            laws.append(change.T / len(change) ** 0.5)
    smooth_sizes = [smooth_size for smooth_size in SMOOTH_SIZES if smooth_size > 0]
    return [
        Cause(log(_NO_CAUSE), declared),
        *(Cause(log(_SINGLE_CAUSE / len(laws)), np.hstack([declared, law])) for law in laws),
        *(Cause(log(_SMOOTH_CAUSE / len(smooth_sizes)), smooth_size * levels.smooth) for smooth_size in smooth_sizes),
    ]


def explained(levels: Levels, causes: Sequence[Cause], further: Floats) -> Explained:
    """The evidence of each alternative, summed over all causes, at the best s, t, p of each.

    `further` (alternatives, recordings, columns): columns that each alternative adds to X, times their prior standard
    deviations.
    """
    by_cause = [_by_cause(levels, cause.columns, further) for cause in causes]
    joint = np.array([cause.log_prior + result.evidence for cause, result in zip(causes, by_cause, strict=True)])
    total = logsumexp(joint, axis=0)
    share = np.exp(joint - total)
    coefficient = (share[:, :, None] * np.array([result.coefficient for result in by_cause])).sum(axis=0)
    return Explained(np.asarray(total), np.asarray(coefficient))


def _by_cause(levels: Levels, columns: Floats, further: Floats) -> Explained:
    """The evidence of each alternative under one cause."""
    alternatives, recordings, width = further.shape
    right = np.column_stack([levels.value, further.transpose(1, 0, 2).reshape(recordings, -1)])
    evidence, coefficient = np.full(alternatives, -np.inf), np.zeros((alternatives, width))
    for spread, position_scatter in product(levels.spreads, levels.position_scatters):
        fixed = levels.expected(spread, columns) + np.diag((levels.slope * position_scatter) ** 2)
        for scatter in SCATTER:
            root = np.linalg.cholesky(fixed + scatter**2 * np.eye(recordings))
            white = solve_triangular(root, right, lower=True, check_finite=False)
            value, white_columns = white[:, 0], white[:, 1:].reshape(recordings, alternatives, width).transpose(1, 0, 2)
            precision = np.eye(width) + white_columns.transpose(0, 2, 1) @ white_columns
            along = value @ white_columns
            best = np.linalg.solve(precision, along[:, :, None])[:, :, 0]
            nothing = -0.5 * value @ value - np.log(np.diag(root)).sum() + SCATTER_PRIOR.log_density(log(scatter))
            density = nothing + 0.5 * (along * best).sum(axis=1) - 0.5 * np.linalg.slogdet(precision)[1]
            better = density > evidence
            evidence = np.where(better, density, evidence)
            coefficient = np.where(better[:, None], best, coefficient)
    return Explained(evidence, coefficient)


def _drawn(model: FrfModel, start: Floats) -> Array:
    """Points (points, parameters) from the priors of a mechanism's parameters, declared values unchanged."""
    mechanism_parameters = model.parameters[: len(model.parameters) - len(start)]
    if not mechanism_parameters:
        return start[None, :]
    share = qmc.Halton(len(mechanism_parameters), scramble=False).random(_DRAWS + 1)[1:]  # the first is 0
    points = [
        [
            parameter.quantile(float(probability))
            for parameter, probability in zip(mechanism_parameters, row, strict=True)
        ]
        for row in share
    ]
    return np.hstack([points, np.tile(start, (len(points), 1))])
