"""Levels of recordings over the base model's, the model of these levels, and what may have changed them.

A recording's level is the magnitude of its FRF in the flat zone. With y_i = ln |level_i / shape_i|, shape_i being the
base model's, the model of levels is
    y = X b + ε,  b ~ N(0, P),  ε_i ~ N(0, s² + (g_i p)²),
where X holds a gain, one gain per sensor (of standard deviation t) and the columns of a cause, g_i is
|∂ ln shape/∂ position| and p the scatter of positions. The evidence is the largest ln N(y; 0, C) + ln p(s),
C = X P Xᵀ + diag(s² + g² p²), over s, t and p, p(s) being the prior of a recording's gain.

Causes of a change in level: none, one mechanism of the catalogue, or a smooth change along what physics may depend on
(sphere, preload, position, order, load cycles, dwell, dynamic force), as by several mechanisms or an unlisted law. The
changes Δ of ln level under a mechanism, at K points from the priors of its parameters, enter as a normal change of the
same second moments, Σ Δ Δᵀ/K. With no cause, and with each mechanism, the declared modulus and thickness may be off as
far as their priors allow.

An alternative is a slip, or what resembles one: known changes of y, unknown ones as further columns of X, or other
sensors. Its evidence is summed over all causes (`explained`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.noise import GAIN_FALL, Plateau
from underskin.diagnosis.slips.comparison import LEAST_RESPONSE, base_model, flat_level, position_slopes
from underskin.findings.finding import Finding
from underskin.halton import halton
from underskin.inversion.mixed_model import GAIN_RANGE
from underskin.mechanisms.base import Normal, Unsupported
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.forms import axes_of, recording_order
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, offsets
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Array, Floats, Indices

CHANGE = 0.45  # prior standard deviation of a slip's change of ln level of unknown size
LEAST_LEVELS = 4  # of recordings or of sensors, so that some agree and one can differ
SELDOM = log(4)  # by which what no convention or habit makes likely is rarer than what one does
LEAST_CHANGE = 0.12  # of ln level; smaller ones are within the scatter of gains


_TERMS, _SIZE = 4, 0.3  # number of cosines over the rank along an axis, and the prior standard deviation of each


def smooth_along(axis: Floats) -> Floats:
    """Cosines over the rank along an axis, times their prior standard deviation (recordings, terms)."""
    _, rank = np.unique(axis, return_inverse=True)
    share = rank / max(int(rank.max()), 1)
    return np.asarray(_SIZE * np.cos(np.pi * np.outer(share, np.arange(1, _TERMS + 1))))


_SCATTER = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)  # s, about the range of a rig's gain (inversion/mixed_model.py)
_SCATTER_PRIOR = Plateau.of(GAIN_RANGE, GAIN_FALL)
SPREADS = (0.01, 0.06, 0.25)  # t, of calibrated, of good and of poled sensors
_SMOOTH_SIZES = (0.1, 0.4, 1.0)  # of all smooth functions together
POSITION_MM = (0.0, 0.1, 0.3)  # p, of a stage (inversion/mixed_model.py)
SEARCHED = tuple(product((0.04, 0.12), (0.03, 0.3)))  # s, and size of smooth functions, at which slips are tried
_OVERALL = 3.0  # prior standard deviation of ln of the gain, the d33 of all sensors


@dataclass(frozen=True, eq=False)
class Levels:
    """Columns over the recordings with an informative level."""

    index: Indices  # of the recording among all
    value: Floats  # y
    sensor: Indices
    order: Floats  # 0, 1, … in time
    slope: Floats  # g [1/mm]
    may_age: bool  # whether load cycles are noted, by which sensors age
    axes: tuple[Floats, ...]  # each axis on which the recordings differ, and their offsets (recordings,)

    @cached_property
    def smooth(self) -> Floats:
        """Smooth functions along all axes, times their prior standard deviation (recordings, functions)."""
        return np.hstack([np.zeros((len(self.value), 0)), *(smooth_along(axis) for axis in self.axes)])

    def precision(self, scatter: float, smooth_size: float, spread: float = SPREADS[1]) -> Floats:
        """C⁻¹ (recordings, recordings) of smooth functions of a given size, at given s and t."""
        noise = scatter**2 + (POSITION_MM[1] * self.slope) ** 2
        return np.asarray(np.linalg.inv(self.expected(spread, smooth_size * self.smooth) + np.diag(noise)))

    def expected(self, spread: float, columns: Floats) -> Floats:
        """X P Xᵀ (recordings, recordings) at the sensors' spread t, for a gain, the sensors' gains and `columns`."""
        indicator = np.eye(int(self.sensor.max()) + 1)[self.sensor]
        return np.asarray(_OVERALL**2 + columns @ columns.T + spread**2 * indicator @ indicator.T)


def levels(campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable) -> Levels:
    """The levels of a campaign's recordings, whose signs are correct."""
    subset = replace(campaign, recordings=tuple(recordings))
    model, _, prediction = base_model(campaign, recordings, table)
    shape = np.abs(prediction.value.real)
    level = np.array([flat_level(recording) for recording in recordings])
    chosen = np.flatnonzero(
        model.valid & (shape > LEAST_RESPONSE * shape.max(initial=0.0)) & (level > 0) & np.isfinite(level)
    )
    slope = position_slopes(prediction) / np.where(shape > 0, shape, 1.0)
    offset = offsets(subset)
    columns = [axis.of([recording.id for recording in recordings]) for axis in axes_of(subset)]
    columns += [*offset.T, np.hypot(*offset.T)]
    ids = [sensor.id for sensor in campaign.skin.sensors]
    return Levels(
        index=chosen,
        value=np.log(level[chosen] / shape[chosen]),
        sensor=np.array([ids.index(recordings[index].sensor) for index in chosen.tolist()], dtype=np.intp),
        order=recording_order(recordings)[chosen],
        slope=slope[chosen],
        may_age=all(recording.load_cycles is not None for recording in recordings),
        axes=tuple(column[chosen] for column in columns if len(chosen) and np.ptp(column[chosen])),
    )


_NO_CAUSE, _SINGLE_CAUSE, _SMOOTH_CAUSE = 0.6, 0.25, 0.15  # prior probabilities
_DRAWS = 8  # points K
_LEAST_RATIO = 1e-3  # of the base model's response


@dataclass(frozen=True, eq=False)
class Cause:
    """The logarithm of its prior, and its columns of X times their prior standard deviations (recordings, columns)."""

    log_prior: float
    columns: Floats


Undone = tuple[list[FrfRecording], list[Finding]]


@dataclass(frozen=True, eq=False)
class Alternative:
    """A slip, or what resembles one: the logarithm of its prior less that of the number of choices, and what it does.

    `gain` is its ln evidence over no slip, apart from what it does to the levels: `offset` (recordings,) is a known
    change of y; `column` (recordings,) one of unknown amplitude, times its prior standard deviation; `sensor`
    (recordings,) are the true sensors. `undo` is the recordings without the slip and the findings, or a function that
    gives them from the amplitude in prior standard deviations, None where it is none of a slip; without `undo` the
    alternative is no slip.
    """

    log_prior: float
    gain: float = 0.0
    offset: Floats | None = None
    column: Floats | None = None
    sensor: Indices | None = None
    undo: Undone | Callable[[float], Undone | None] | None = None

    @property
    def changes_levels(self) -> bool:
        """Whether it is judged by the model of levels."""
        return not (self.offset is None and self.column is None and self.sensor is None)


NO_SLIP = Alternative(0.0)


@dataclass(frozen=True, eq=False)
class Explained:
    """ln evidence of each alternative (alternatives,), and the mean of its amplitude in prior standard deviations
    (alternatives,)."""

    evidence: Floats
    amplitude: Floats


def causes_of(campaign: Campaign, recordings: Sequence[FrfRecording], levels: Levels, table: SigmaTable) -> list[Cause]:
    """All causes that may change the levels of a campaign's recordings, for the rows of `levels`."""
    base, start, prediction = base_model(campaign, recordings, table)
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
    for model in models_of_laws(base.design.conditions, table, along_frequency=False).values():
        if not any(parameter.moves_covariance for parameter in model.parameters):
            relative = np.abs([changed[levels.index] / value for changed in model.values(_drawn(model, start))])
            change = np.log(np.maximum(relative, _LEAST_RATIO))
            laws.append(change.T / len(change) ** 0.5)
    return [
        Cause(log(_NO_CAUSE), declared),
        *(Cause(log(_SINGLE_CAUSE / len(laws)), np.hstack([declared, law])) for law in laws),
        *(Cause(log(_SMOOTH_CAUSE / len(_SMOOTH_SIZES)), smooth_size * levels.smooth) for smooth_size in _SMOOTH_SIZES),
    ]


def models_of_laws(conditions: Conditions, table: SigmaTable, *, along_frequency: bool) -> dict[str, FrfModel]:
    """The models of single laws of the catalogue under these conditions, by name: of those that act along frequency, or
    of the others."""
    models = {}
    for name, mechanism in CATALOGUE.items():
        if not mechanism.acts_on_frfs or mechanism.needs_lines is not along_frequency:
            continue
        try:
            model = compose((name,), conditions, table, "frf")
        except Unsupported:
            continue
        assert isinstance(model, FrfModel)
        models[name] = model
    return models


def explained(levels: Levels, causes: Sequence[Cause], alternatives: Sequence[Alternative]) -> Explained:
    """The evidence of each alternative, summed over all causes, at the best s, t, p of each."""
    evidence, amplitude = np.zeros(len(alternatives)), np.zeros(len(alternatives))
    as_labelled = [index for index, alternative in enumerate(alternatives) if alternative.sensor is None]
    relabelled = [index for index in range(len(alternatives)) if index not in as_labelled]
    for indices in (as_labelled, *([index] for index in relabelled)):
        chosen = [alternatives[index] for index in indices]
        sensor = levels.sensor if chosen[0].sensor is None else chosen[0].sensor
        by_cause = [_by_cause(replace(levels, sensor=sensor), cause.columns, chosen) for cause in causes]
        joint = np.array([cause.log_prior + result.evidence for cause, result in zip(causes, by_cause, strict=True)])
        evidence[indices] = logsumexp(joint, axis=0)
        share = np.exp(joint - evidence[indices])
        amplitude[indices] = (share * np.array([result.amplitude for result in by_cause])).sum(axis=0)
    return Explained(evidence, amplitude)


def _by_cause(levels: Levels, columns: Floats, alternatives: Sequence[Alternative]) -> Explained:
    """The evidence of each alternative under one cause."""
    count, none = len(alternatives), np.zeros(len(levels.value))
    spreads = SPREADS if levels.sensor.max() > 0 else SPREADS[:1]
    position_scatters = (
        POSITION_MM if POSITION_MM[-1] * levels.slope.max(initial=0.0) > _SCATTER[0] else POSITION_MM[:1]
    )
    values = [levels.value - (none if one.offset is None else one.offset) for one in alternatives]
    right = np.stack([*values, *(none if one.column is None else one.column for one in alternatives)], axis=1)
    evidence, amplitude = np.full(count, -np.inf), np.zeros(count)
    scatters = np.array(_SCATTER)
    prior = _SCATTER_PRIOR.log_density(np.log(scatters))
    for spread, position_scatter in product(spreads, position_scatters):
        fixed = levels.expected(spread, columns) + np.diag((levels.slope * position_scatter) ** 2)
        eigenvalues, vectors = np.linalg.eigh(fixed)  # of all s: C = V (Λ + s²) Vᵀ
        turned = vectors.T @ right
        value, column = turned[:, :count], turned[:, count:]
        variance = np.maximum(eigenvalues, 0.0) + scatters[:, None] ** 2
        square, along, size = (1 / variance) @ np.stack(
            [value**2, value * column, column**2]
        )  # (scatters, alternatives)
        best = along / (1 + size)
        density = (
            0.5 * (along * best - np.log1p(size) - square - np.log(variance).sum(axis=1)[:, None]) + prior[:, None]
        )
        chosen = density.argmax(axis=0), np.arange(count)
        better = density[chosen] > evidence
        evidence = np.where(better, density[chosen], evidence)
        amplitude = np.where(better, best[chosen], amplitude)
    return Explained(evidence, amplitude)


def _drawn(model: FrfModel, start: Floats) -> Array:
    """Points (points, parameters) from the priors of a mechanism's parameters, declared values unchanged."""
    mechanism_parameters = model.parameters[: len(model.parameters) - len(start)]
    if not mechanism_parameters:
        return start[None, :]
    points = [
        [
            parameter.quantile(float(probability))
            for parameter, probability in zip(mechanism_parameters, row, strict=True)
        ]
        for row in halton(_DRAWS, len(mechanism_parameters))
    ]
    return np.hstack([points, np.tile(start, (len(points), 1))])
