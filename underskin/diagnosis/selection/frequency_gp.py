"""An unmodelled discrepancy along frequency: a complex process that changes the shape of the lines.

A Matérn-3/2 process over log frequency, that all recordings share or that changes along an axis of the campaign, on top
of each recording's own best real multiple of the model.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.special import logsumexp

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import line_residuals
from underskin.diagnosis.noise.noise_priors import Plateau, level_prior
from underskin.diagnosis.selection.gaussian_process import AMPLITUDES, features, matern, normalised
from underskin.units import Array, Floats, Indices

_LINE_LENGTHS = (0.08, 0.25, 0.8)  # of the logarithm of frequency
_INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS = 0.4, 8  # where both frequency and a recording's axis count
_LEAST_RECORDINGS = 4
_MOST_LINES = 160  # distinct frequencies, beyond which they are binned
_LEAST_LINES = 8  # in a recording


def over_lines(problem: FittingProblem, explanation: Explanation) -> dict[str, float]:
    """The log evidence that a process over frequency gains, the level of the lines' noise free in both: one that all
    recordings share ("frequency_hz"), and for each axis one that changes along it."""
    lines = problem.lines
    if np.bincount(lines.recording).max() < _LEAST_LINES:
        return {}
    relative, weight = line_residuals(problem, explanation)
    noise = _LineNoise(
        float((weight * np.abs(relative) ** 2).sum()),
        2 * len(relative) + lines.scatter[1] - lines.recordings,
        level_prior(lines.noise.log_level_sd),
    )
    plain = noise.plain
    line, centres = frequency_bins(lines.frequency)
    total = np.bincount(line, weight, len(centres))
    sums = np.bincount(line, weight * relative.real, len(centres))
    sums = sums + 1j * np.bincount(line, weight * relative.imag, len(centres))
    distance = np.abs(np.log(centres[:, None] / centres[None]))
    each: list[float] = []
    for length in _LINE_LENGTHS:
        root = np.linalg.cholesky(matern(distance / length) + 1e-9 * np.eye(len(centres)))
        each += noise.gains(root.T @ (total[:, None] * root), root.T @ sums).tolist()
    gains = {"frequency_hz": float(logsumexp(each) - np.log(len(each)) - plain)}
    if lines.recordings < _LEAST_RECORDINGS:
        return gains
    distinct, line = np.unique(lines.frequency, return_inverse=True)
    shapes = features(normalised(np.log(distinct)[:, None]), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)

    def summed(values: Array, of_lines: Floats) -> Array:
        """Over the rows of each recording, of what distinct frequencies have (frequencies, …)."""
        rows = csr_array((values, line, [*lines.first, len(line)]), shape=(lines.recordings, len(distinct)))
        return rows @ of_lines.reshape(len(distinct), -1)

    moments = summed(weight * relative, shapes)
    grams = summed(weight, shapes[:, :, None] * shapes[:, None, :]).reshape(lines.recordings, *2 * (shapes.shape[1],))
    for name, column in recording_axes(lines.campaign).items():
        along = features(normalised(column), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)
        size = along.shape[1] * shapes.shape[1]
        gram = np.einsum("ra,rb,rfg->afbg", along, along, grams, optimize=True).reshape(size, size)
        moment = (along.T @ moments).reshape(size)
        gains[f"frequency_hz and {name}"] = float(
            logsumexp(noise.gains(gram, moment)) - np.log(len(AMPLITUDES)) - plain
        )
    return gains


@dataclass(frozen=True)
class _LineNoise:
    """The lines' residuals without a process: Σ|·|²/d², its degrees of freedom, and the prior of the noise's level."""

    chi2: float
    freedom: int
    prior: Plateau

    def gains(self, gram: Array, moment: Array) -> Floats:
        """log p of the lines with a process of each amplitude, at the level that suits it best."""
        eigenvalues, vectors = np.linalg.eigh(gram)
        return self._best(np.maximum(eigenvalues, 0.0), np.abs(vectors.T @ moment) ** 2, AMPLITUDES)

    @property
    def plain(self) -> float:
        """The same without a process."""
        return float(self._best(np.zeros(0), np.zeros(0), np.zeros(1))[0])

    def _best(self, eigenvalues: Floats, square: Floats, amplitudes: Floats) -> Floats:
        """With AᵀW A's eigenvalues and |AᵀW r|² along them."""
        from underskin.diagnosis.selection.process_kernel import at_best_level

        each = np.empty(len(amplitudes))
        at_best_level(self.chi2, self.freedom, np.array(self.prior.row), eigenvalues, square, amplitudes, each)
        return each


def frequency_bins(frequency: Floats) -> tuple[Indices, Floats]:
    """Of each row its distinct frequency, or its bin where there are too many, and the frequencies."""
    distinct, line = np.unique(np.round(frequency, 6), return_inverse=True)
    if len(distinct) <= _MOST_LINES:
        return line, distinct
    edges = np.geomspace(distinct[0], distinct[-1] * (1 + 1e-9), _MOST_LINES + 1)
    line = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, _MOST_LINES - 1)
    used, line = np.unique(line, return_inverse=True)
    return line, np.sqrt(edges[used] * edges[used + 1])
