"""The noise of single lines, from how rough the lines are along frequency.

Real and imaginary part each have variance d² = rel(f)² A² + floor², A the recording's amplitude around the line.
What all recordings share at a frequency is taken off, then each line is compared with its two neighbours,
    e_j = z_j − λ z_(j−1) − (1−λ) z_(j+1)   (linear in log f),   E|e_j|²/2 = d_j² + λ² d_(j−1)² + (1−λ)² d_(j+1)²,
which smooth misfit hardly reaches. A steep course, such as the flank of a resonance that moves with the preload, does
reach it: where a law describes that, its prediction (`expected`) is taken off as well (see noise_refinement.py).
log rel² is piecewise linear in log f; it and the floor are fitted with Student's likelihood, so that single wild lines
(mains, a resonance between two lines) do not count, and the level is set by the median of |e|².
Where `coherence` γ² is given, (1 − γ²)/γ² has the shape of (d/A)² (its n is unknown), and steadies it. It may miss
noise that is not averaged, alike in all recordings: of many recordings it says little more than of a few.
Where lines are known to be `uneven` (of a time series whose force has more power at one than at the next), rel is that
much larger.
"""

import itertools
import weakref
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from underskin.units import Complexes, Floats, Indices

_KNOTS_PER_DECADE = 2.0
_SMOOTH = 1.0  # sd of the second difference of log rel² between knots
_FREEDOM = 6.0
_TYPICAL, _TYPICAL_SD = 1e-4, 3.0  # rel², and the sd of its logarithm: where hardly any line says anything
_SHARED = 8  # recordings at a frequency from which what they share is taken off
_WINDOW = 5
_BLOCK = 10_000  # windows that are copied at a time


@dataclass(frozen=True)
class LineNoise:
    """`deviation` (rows,) of real and imaginary part [C/N], and how well its level is known (sd of its logarithm)."""

    deviation: Floats
    log_level_sd: float
    floor: float


def line_noise(
    value: Complexes,
    frequency: Floats,
    recording: Indices,
    coherence: Floats,
    uneven: Floats,
    expected: Complexes | None = None,
) -> LineNoise:
    """The noise of the rows, which run over recordings one after another, sorted by frequency within each.

    `expected` (rows,) is a prediction whose course along frequency is no noise.
    """
    from underskin.diagnosis.noise.roughness_kernel import roughness_cost

    if len(value) == 0:
        return LineNoise(np.zeros(0), 1.0, 0.0)
    amplitude = local_amplitude(value, recording)
    rest = value if expected is None else value - expected
    middle, share, rough = _roughness(_without_shared(value, frequency, recording, rest), frequency, recording)
    distinct, line = np.unique(frequency, return_inverse=True)
    knots = _knots(np.log(distinct))
    hats = _hats(np.log(distinct), knots)
    scale = float(np.median(amplitude))
    rough /= scale**2
    size2 = (amplitude / scale) ** 2
    weighed2 = size2 * uneven**2
    known = np.isfinite(coherence) & (coherence > 0) & (coherence < 1)
    from_coherence = np.log((1 - coherence[known]) / coherence[known]) if known.any() else None
    certainty = 1 / (_COHERENCE_VARIANCE + _OF_ALL_VARIANCE * np.bincount(line[known], minlength=1)[line[known]])

    def variance(p: Floats) -> Floats:
        return np.exp(hats @ p[:-2])[line] * weighed2 + np.exp(p[-2])

    def objective(p: Floats) -> tuple[float, Floats]:
        relative, floor = np.exp(hats @ p[:-2])[line] * weighed2, np.exp(p[-2])
        d2 = relative + floor
        by_d2 = np.zeros(len(d2))
        cost = roughness_cost(d2, middle, share, rough, _FREEDOM, by_d2)
        if from_coherence is not None:
            # Noisy, and with an unknown n: loose Gaussians; p[-1] is log(1/2n).
            gap = np.log(d2[known] / size2[known]) - from_coherence - p[-1]
            cost += 0.5 * np.sum(certainty * gap**2)
            by_d2[known] += certainty * gap / d2[known]
        bend = np.diff(p[:-2], 2) / _SMOOTH
        cost += 0.5 * bend @ bend + 0.5 * np.sum(((p[:-2] - np.log(_TYPICAL)) / _TYPICAL_SD) ** 2)
        cost += 0.5 * ((p[-2] - np.log(_TYPICAL)) / _TYPICAL_SD) ** 2 + 0.5 * (p[-1] + 3.5) ** 2
        by_p = np.zeros(len(p))
        by_p[:-2] = (
            hats.T @ np.bincount(line, by_d2 * relative, len(distinct)) + (p[:-2] - np.log(_TYPICAL)) / _TYPICAL_SD**2
        )
        by_p[:-2] += np.convolve(bend, [1, -2, 1]) / _SMOOTH if len(bend) else 0.0
        by_p[-2] = by_d2.sum() * floor + (p[-2] - np.log(_TYPICAL)) / _TYPICAL_SD**2
        by_p[-1] = (p[-1] + 3.5) - (certainty @ gap if from_coherence is not None else 0.0)
        return float(cost), by_p

    level = np.log(max(float(np.median(rough)), 1e-14)) if len(middle) else np.log(_TYPICAL)
    start = np.concatenate([np.full(len(knots), level - 1.0), [level - 2.0, -3.5]])
    # SciPy leaves cycles that hold the function, and all arrays with it.
    p = minimize(weakref.proxy(objective), start, jac=True, method="L-BFGS-B", options={"maxiter": 200}).x
    d2 = variance(p)
    freedom = len(middle) / 1.5  # neighbouring differences share lines
    if len(middle) > 10:
        of_rough = d2[middle] + share**2 * d2[middle - 1] + (1 - share) ** 2 * d2[middle + 1]
        median = float(np.median(rough / of_rough))
        d2 = d2 * (median / np.log(2.0)) ** (freedom / (freedom + 30.0))
    d2 = np.maximum(d2, (1e-5) ** 2 * size2)
    sd = float(np.hypot(0.03, 1.0 / np.sqrt(1.0 + 2.0 * freedom)))
    return LineNoise(scale * np.sqrt(d2), sd, float(scale * np.exp(p[-2] / 2)))


_COHERENCE_VARIANCE = 0.5  # of the logarithm of what one recording's says
_OF_ALL_VARIANCE = 0.1  # and of what all have in common at a frequency


def local_amplitude(value: Complexes, recording: Indices) -> Floats:
    """|FRF| around each line: the median over five neighbours, or its own where that is larger (a sharp peak)."""
    size = np.abs(value)
    smooth = size.copy()
    half = _WINDOW // 2
    if len(size) >= _WINDOW:
        windows = np.lib.stride_tricks.sliding_window_view(size, _WINDOW)
        for low in range(0, len(windows), _BLOCK):
            some = windows[low : low + _BLOCK]
            smooth[half + low : half + low + len(some)] = np.partition(some, half, axis=1)[:, half]
    edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
    for low, high in itertools.pairwise(edges.tolist()):
        if high - low < _WINDOW:
            smooth[low:high] = np.median(size[low:high])
        else:  # windows lie within a recording; its ends have the next one's
            smooth[low : low + half], smooth[high - half : high] = smooth[low + half], smooth[high - half - 1]
    return np.maximum(size, smooth)


def _interior(recording: Indices, frequency: Floats) -> Indices:
    """Rows with a lower and a higher neighbour in their own recording."""
    inner = np.arange(1, len(recording) - 1)
    same = (recording[inner - 1] == recording[inner]) & (recording[inner + 1] == recording[inner])
    apart = (frequency[inner] > frequency[inner - 1]) & (frequency[inner + 1] > frequency[inner])
    return inner[same & apart & (frequency[inner - 1] > 0)]


def _roughness(z: Complexes, frequency: Floats, recording: Indices) -> tuple[Indices, Floats, Floats]:
    """The rows j with two neighbours, λ and |e_j|²/2 of each."""
    middle = _interior(recording, frequency)
    log_f = np.log(frequency)
    share = (log_f[middle + 1] - log_f[middle]) / (log_f[middle + 1] - log_f[middle - 1])
    return middle, share, np.abs(z[middle] - share * z[middle - 1] - (1 - share) * z[middle + 1]) ** 2 / 2


def _without_shared(value: Complexes, frequency: Floats, recording: Indices, rest: Complexes) -> Complexes:
    """`rest` (rows,), the lines or what is left of them, less each recording's level times what all recordings have of
    it at that frequency, where many have it."""
    edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
    level = np.array([np.median(value.real[low:high]) for low, high in itertools.pairwise(edges.tolist())])
    ratio = rest / np.where(level == 0, 1.0, level)[recording]
    _, line, count = np.unique(np.round(frequency, 9), return_inverse=True, return_counts=True)
    if count[line].min() < _SHARED:
        return rest
    shared = np.empty(len(count), dtype=complex)
    strong = np.abs(level)[recording] > 0.3 * np.median(np.abs(level))
    for number, rows in enumerate(np.split(np.argsort(line, kind="stable"), np.cumsum(count)[:-1])):
        chosen = ratio[rows[strong[rows]]]
        chosen = chosen if len(chosen) else ratio[rows]
        shared[number] = np.median(chosen.real) + 1j * np.median(chosen.imag)
    return rest - level[recording] * shared[line]


def _knots(log_f: Floats) -> Floats:
    low, high = float(log_f.min()), float(log_f.max())
    count = max(1, int(np.ceil((high - low) / np.log(10.0) * _KNOTS_PER_DECADE)))
    return np.linspace(low, high, count + 1) if high > low else np.array([low])


def _hats(log_f: Floats, knots: Floats) -> Floats:
    """The piecewise linear functions (rows, knots) that are 1 at one knot and 0 at the others."""
    if len(knots) == 1:
        return np.ones((len(log_f), 1))
    place = (log_f - knots[0]) / (knots[1] - knots[0])
    return np.clip(1 - np.abs(place[:, None] - np.arange(len(knots))), 0, None)
