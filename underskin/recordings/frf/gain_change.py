"""Whether the gain of a time series changes from one part of it to another.

With F and Q the spectra of force and charge of a block, H the FRF by all blocks (H1), P = H F and s² the power at a
line that H leaves, let
    c = Σ Re(conj(P) Q)/s²,  p = Σ |P|²/s²,  w = Σ u |P|²/s²
over the L lines, with u = (1 − γ²)/γ², which is s² over the mean |P|². If a share θ of s² is by a steady noise in the
force, H is too small by 1 + θu (Bendat and Piersol, Random Data, chapter 6: H2 = (1 + u) H1), and if the series has one
gain x, relative to the FRF, c = x (p + θ (w − L)) in all blocks, also where the force moves over the lines, as a sweep
does. A few blows in much noise leave u of a line too uncertain for that; their force has the same lines each time, so
that c = x (p − m), with m at most L and the least p. Two lines of Hann's window carry the information of one: c has
the variance p. Noise is independent from line to line, so that the sum of the squares of c less that, over p, is χ²
distributed over the blocks, with more where few blocks make H, which is then in part their own noise; a gain that
changes moves all lines of a block alike, and fits neither.
"""

from dataclasses import dataclass

import numpy as np

from underskin.units import Complexes, Floats

_FEWEST = 5  # blocks: two parameters, and two blocks on each side of a step
_EXCESS = 6.0  # of χ² over its freedom: 1.2 by noise, and 5 in simulated blows with noise of half their power
_LEAST_SCATTER = 0.01  # beyond noise, relative: less is not worth a word
_IS_STEP = 0.8  # of the scatter, explained by a gain before and one after
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class GainChange:
    """The scatter of the blocks' gains beyond noise and their range, relative to the FRF by all blocks; where they are
    a step, the time of it [s] and the ratio of the gains after and before it, else None."""

    scatter: float
    lowest: float
    highest: float
    step_s: float | None = None
    ratio: float | None = None


def gain_change(force: Complexes, charge: Complexes, middle_s: Floats) -> GainChange | None:
    """The change of the gain, from spectra (blocks, lines) and the time of each block's middle (blocks,) [s]; None
    where the blocks have one gain within their noise."""
    count, power = len(force), np.mean(np.abs(force) ** 2, axis=0)
    if count < _FEWEST:
        return None
    response = np.mean(np.conj(force) * charge, axis=0) / np.maximum(power, _TINY) * force
    left = np.maximum(np.mean(np.abs(charge - response) ** 2, axis=0) * count / (count - 1), _TINY)
    of_lines = np.abs(response) ** 2 / left
    size = np.maximum(of_lines.sum(axis=1), _TINY)
    by_noise = (of_lines / np.maximum(of_lines.mean(axis=0), _TINY)).sum(axis=1) - len(power)
    both = ((np.conj(response) * charge).real / left).sum(axis=1)
    gain, weight = both / size, size / size.sum()
    same_lines = min(float(size.min()), len(power))
    steady = (_steady(both, size, by_noise, 1.0), _steady(both, size, -np.ones(count), same_lines))
    excess = min(float(((both - expected) ** 2 / size).sum()) for expected in steady) / (count - 2)
    scatter = float(np.sqrt(max(weight @ (gain - weight @ gain) ** 2 - count / size.sum(), 0.0)))
    if excess < _EXCESS or scatter < _LEAST_SCATTER:
        return None
    change = GainChange(scatter, float(gain.min()), float(gain.max()))
    explained = [_between(gain, weight, first) for first in range(2, count - 1)]
    first = 2 + int(np.argmax(explained))
    if explained[first - 2] < _IS_STEP * weight @ (gain - weight @ gain) ** 2:
        return change
    before, after = (  # without the block that the step may lie in
        np.mean((np.conj(force) * charge)[part], axis=0) / np.maximum(np.mean(np.abs(force[part]) ** 2, axis=0), _TINY)
        for part in (slice(first - 1), slice(first + 1, None))
    )
    halves = [float((power * np.abs(part) ** 2).sum()) for part in (before, after)]
    share = float((power * np.conj(before) * after).real.sum()) / max(*halves, _TINY)
    ratio = share if halves[0] >= halves[1] else 1 / share if share else np.inf
    return GainChange(scatter, change.lowest, change.highest, float(middle_s[first - 1] + middle_s[first]) / 2, ratio)


def _steady(both: Floats, size: Floats, by_noise: Floats, most: float) -> Floats:
    """x (p + θ `by_noise`) of the blocks (blocks,), by least squares with 0 ≤ θ ≤ `most`."""
    columns = np.stack([size, by_noise], axis=1) / np.sqrt(size)[:, None]
    slope, noise = np.linalg.lstsq(columns, both / np.sqrt(size), rcond=None)[0]
    signal = size + (float(np.clip(noise / slope, 0.0, most)) if slope else 0.0) * by_noise
    return np.asarray(signal * (signal * both / size).sum() / (signal**2 / size).sum())


def _between(gain: Floats, weight: Floats, first: int) -> float:
    """The variance that one mean before a block and one from it on explain."""
    share = float(weight[:first].sum())
    means = [float(gain[part] @ weight[part] / weight[part].sum()) for part in (slice(first), slice(first, None))]
    return share * (1 - share) * (means[1] - means[0]) ** 2
