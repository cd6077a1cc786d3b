"""Something that no mechanism here describes: a Gaussian process over the campaign's axes, as a full rival.

FRF = model · (1 + δ), with the noise of every hypothesis and the model's parameters free (linearised at its best fit).
Two kinds of δ, alone or together:
- of a recording: real, a Matérn-3/2 process over one axis (preload, sphere, place, cycles, dwell, amplitude, time) or
  over all of them, in features at landmarks (Nyström), so that time is linear in recordings;
- of a line: complex, a Matérn-3/2 process over log frequency, that all recordings share or that changes along an axis.
Amplitudes and lengths are on grids of equal prior probability. An amplitude below 1.5 % is not looked for: a law that
is right to that is not missing physics.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp

from underskin.diagnosis.axes import recording_axes
from underskin.diagnosis.evidence import laplace
from underskin.diagnosis.explanation import Explanation, Workbench
from underskin.diagnosis.fit import Evaluated, Fitter
from underskin.diagnosis.residuals import line_residuals, whole_prediction
from underskin.diagnosis.scatter import GAIN_PRIOR, Bell, level_prior
from underskin.diagnosis.smooth_error import UNNAMED
from underskin.mechanisms.differentiated import Array
from underskin.mechanisms.mechanism import Normal, Parameter
from underskin.units import Floats

AMPLITUDES = np.array([0.015, 0.05, 0.15, 0.5])
_LENGTHS = (0.15, 0.4, 1.2)  # of a recording's axis, over its range
_LINE_LENGTHS = (0.08, 0.25, 0.8)  # of the logarithm of frequency
_LANDMARKS = 24
_INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS = 0.4, 8  # where both frequency and a recording's axis count
_LEAST_RECORDINGS = 4
_MOST_LINES = 160  # distinct frequencies, beyond which they are binned
_LEAST_LINES = 8  # in a recording
_GAINS = np.geomspace(0.005, 0.5, 16)
_KINDS = {"recordings": 0.5, "lines": 0.4, "both": 0.1}


@dataclass(frozen=True)
class Discrepancy:
    """The evidence for δ on top of one explanation: log Z of the whole, and of δ over each axis against none."""

    log_evidence: float
    axes: dict[str, float]  # log evidence gained; "frequency_hz" for lines


def discrepancy(bench: Workbench, explanation: Explanation) -> Discrepancy:
    """What a process gains on top of an explanation."""
    if bench.lines.curves:
        return _along_curves(bench, explanation)
    over = {"recordings": _over_recordings(bench, explanation), "lines": _over_lines(bench, explanation)}
    gained = {kind: _mean(list(gains.values())) for kind, gains in over.items() if gains}
    if len(gained) == 2:
        gained["both"] = sum(gained.values())
    each = [np.log(_KINDS[kind]) + gain for kind, gain in gained.items()]
    total = float(logsumexp(each)) if each else -np.inf
    return Discrepancy(explanation.log_evidence + total, {**over["recordings"], **over["lines"]})


def _along_curves(bench: Workbench, explanation: Explanation) -> Discrepancy:
    """The smooth error that every hypothesis has of curves, large: everything is fitted again beneath it."""
    fitter = Fitter(replace(bench.hypothesis(explanation.names, placed=False), smooth=UNNAMED))
    covariance = explanation.point.covariance.copy()
    covariance[2] = max(covariance[2], UNNAMED.low)
    best = laplace(fitter, fitter.improve(replace(explanation.point, covariance=covariance)))
    return Discrepancy(best.log_evidence, {"displacement_mm": best.log_evidence - explanation.log_evidence})


def _mean(log_values: list[float]) -> float:
    return float(logsumexp(log_values) - np.log(len(log_values)))


def _matern(distance: Floats) -> Floats:
    scaled = np.sqrt(3.0) * distance
    return (1 + scaled) * np.exp(-scaled)


def _features(axis: Floats, length: float, landmarks: int = _LANDMARKS) -> Floats:
    """Features whose products are the process' covariance, at up to so many places (rows, landmarks)."""
    values = np.unique(np.round(axis, 9), axis=0)
    chosen = values[np.unique(np.linspace(0, len(values) - 1, landmarks).round().astype(int))]

    def kernel(a: Floats, b: Floats) -> Floats:
        return _matern(np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2)) / length)

    root = np.linalg.cholesky(kernel(chosen, chosen) + 1e-8 * np.eye(len(chosen)))
    return np.linalg.solve(root, kernel(chosen, axis)).T


def _over_recordings(bench: Workbench, explanation: Explanation) -> dict[str, float]:
    """The log evidence that a process over each axis gains."""
    axes = {name: _normalised(column) for name, column in recording_axes(bench.collapsed.campaign).items()}
    if bench.collapsed.recordings < _LEAST_RECORDINGS or not axes:
        return {}
    if len(axes) > 1:
        axes["all"] = np.concatenate(list(axes.values()), axis=1) / np.sqrt(len(axes))
    problem = _GainProblem(explanation.best.at, explanation.best.fitter.parameters, bench)
    plain = problem.log_evidence(None)
    found = {}
    for name, column in axes.items():
        each = [problem.log_evidence(_features(column, length)) for length in _LENGTHS]
        found[name] = float(logsumexp(each) - np.log(len(each)) - plain)
    return found


def _normalised(column: Floats) -> Floats:
    return (column - column.min(axis=0)) / np.ptp(column, axis=0).max()


class _GainProblem:
    """Each recording's gain residual, linear in the model's parameters, sensors' gains and a process' features."""

    def __init__(self, at: Evaluated, parameters: tuple[Parameter, ...], bench: Workbench) -> None:
        moments = at.moments
        _, uj, _, _ = moments.slopes
        size = moments.along * moments.uu
        size = np.where(np.abs(size) > 1e-12 * np.abs(size).max(), size, 1e-12 * np.abs(size).max())
        self._z = moments.ur / size
        self._line = moments.uu / size**2
        slopes = uj / size[:, None]
        centre = np.array([entry.start for entry in parameters]) - at.point.fit
        scale = np.array([_prior_sd(entry) for entry in parameters])
        self._z = self._z - slopes @ centre
        sensors = np.eye(int(bench.lines.sensor.max()) + 1)[bench.lines.sensor]
        sensors = sensors[:, sensors.any(axis=0)]
        spread = at.marginal.levels.spread
        self._fixed = np.concatenate([slopes * scale, spread * sensors], axis=1)
        position = at.marginal.levels.position
        placed = position**2 * moments.moved / np.maximum(moments.along**2, 1e-12)
        placed = placed + 0.5 * position**4 * moments.second_order
        self._variances = [
            (GAIN_PRIOR.log_density(float(np.log(gain))), gain**2 + placed + self._line) for gain in _GAINS
        ]

    def log_evidence(self, features: Floats | None) -> float:
        """Over the scatters' and the amplitudes' priors, up to a constant."""
        count = self._fixed.shape[1]
        design = self._fixed if features is None else np.concatenate([self._fixed, features], axis=1)
        amplitudes = np.ones(1) if features is None else AMPLITUDES
        scale = np.ones((len(amplitudes), design.shape[1]))
        scale[:, count:] = amplitudes[:, None]
        each = []
        for log_weight, variance in self._variances:
            gram = design.T @ (design / variance[:, None])
            moment = design.T @ (self._z / variance)
            inner = gram * scale[:, :, None] * scale[:, None, :] + np.eye(len(gram))
            root = np.linalg.cholesky(inner)
            solved = np.linalg.solve(root, (scale * moment)[..., None])[..., 0]
            log_determinant = np.log(variance).sum() + 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
            chi2 = (self._z**2 / variance).sum() - (solved**2).sum(axis=1)
            each.append(log_weight - 0.5 * (chi2 + log_determinant))
        return float(logsumexp(each) - np.log(len(amplitudes)))


def _prior_sd(entry: Parameter) -> float:
    if isinstance(entry.prior, Normal):
        return entry.prior.sd
    low, high = entry.bounds
    return (high - low) / np.sqrt(12.0)


def _over_lines(bench: Workbench, explanation: Explanation) -> dict[str, float]:
    """The log evidence that a process over frequency gains, the level of the lines' noise free in both: one that all
    recordings share ("frequency_hz"), and for each axis one that changes along it."""
    lines = bench.lines
    if np.bincount(lines.recording).max() < _LEAST_LINES:
        return {}
    relative, weight = line_residuals(lines, whole_prediction(bench, explanation))
    noise = _LineNoise(
        float((weight * np.abs(relative) ** 2).sum()),
        2 * len(relative) + lines.scatter[1] - lines.recordings,
        level_prior(lines.noise.log_level_sd),
    )
    plain = noise.best(np.zeros(0), np.zeros(0))
    line, centres = frequency_bins(lines.frequency)
    total = np.bincount(line, weight, len(centres))
    sums = np.bincount(line, weight * relative.real, len(centres))
    sums = sums + 1j * np.bincount(line, weight * relative.imag, len(centres))
    distance = np.abs(np.log(centres[:, None] / centres[None]))
    each = []
    for length in _LINE_LENGTHS:
        root = np.linalg.cholesky(_matern(distance / length) + 1e-9 * np.eye(len(centres)))
        each += noise.gains(root.T @ (total[:, None] * root), root.T @ sums)
    found = {"frequency_hz": float(logsumexp(each) - np.log(len(each)) - plain)}
    if lines.recordings < _LEAST_RECORDINGS:
        return found
    features = _features(_normalised(np.log(lines.frequency)[:, None]), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)
    moments = np.add.reduceat(features * (weight * relative)[:, None], lines.first)
    products = (features[:, :, None] * features[:, None, :] * weight[:, None, None]).reshape(len(features), -1)
    grams = np.add.reduceat(products, lines.first).reshape(lines.recordings, *2 * (features.shape[1],))
    for name, column in recording_axes(lines.campaign).items():
        along = _features(_normalised(column), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)
        size = along.shape[1] * features.shape[1]
        gram = np.einsum("ra,rb,rfg->afbg", along, along, grams, optimize=True).reshape(size, size)
        moment = (along.T @ moments).reshape(size)
        found[f"frequency_hz and {name}"] = float(
            logsumexp(noise.gains(gram, moment)) - np.log(len(AMPLITUDES)) - plain
        )
    return found


@dataclass(frozen=True)
class _LineNoise:
    """The lines' residuals without a process: Σ|·|²/d², its degrees of freedom, and the prior of the noise's level."""

    chi2: float
    freedom: int
    prior: Bell

    def gains(self, gram: Array, moment: Array) -> list[float]:
        """log p of the lines with a process of each amplitude, at the level that suits it best."""
        eigenvalues, vectors = np.linalg.eigh(gram)
        eigenvalues = np.maximum(eigenvalues, 0.0)
        square = np.abs(vectors.T @ moment) ** 2
        return [self.best(eigenvalues * amplitude**2, square * amplitude**2) for amplitude in AMPLITUDES]

    def best(self, eigenvalues: Array, square: Array) -> float:
        """With AᵀW A's eigenvalues and |AᵀW r|² along them, at κ: χ²/κ² less Σ square/(κ⁴ (1 + λ/κ²))."""

        def cost(log_level: float) -> float:
            k2 = np.exp(2 * log_level)
            inner = 1 + eigenvalues / k2
            value = 0.5 * self.chi2 / k2 + self.freedom * log_level - self.prior.log_density(log_level)
            return float(value - 0.5 * (square / inner).sum() / k2**2 + np.log(inner).sum())

        found = minimize_scalar(cost, bounds=(-1.0, 5.0), method="bounded", options={"xatol": 1e-3})
        return -float(found.fun)


def frequency_bins(frequency: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Of each row its distinct frequency, or its bin where there are too many, and the frequencies."""
    distinct, line = np.unique(np.round(frequency, 6), return_inverse=True)
    if len(distinct) <= _MOST_LINES:
        return line, distinct
    edges = np.geomspace(distinct[0], distinct[-1] * (1 + 1e-9), _MOST_LINES + 1)
    line = np.searchsorted(edges, frequency, side="right") - 1
    used, line = np.unique(line, return_inverse=True)
    return line, np.sqrt(edges[used] * edges[used + 1])
