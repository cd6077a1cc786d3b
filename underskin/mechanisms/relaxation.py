"""A quasi-linear viscoelastic answer to any history: one Prony pair acting on the elastic answer.

u(t) is what an elastic body would show; F(t) = u − g ∫ (1 − e^(−(t−s)/τ)) du(s) = u − g q, τ q' = u − q, q = 0 at the
start; u is taken as linear between samples, for which the step is exact (Fung, Biomechanics, 1993, section 7.6).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from underskin.mechanisms.differentiated import Differentiated
from underskin.units import Floats


def relaxed(
    elastic: Differentiated, time: Floats, first: NDArray[np.bool_], fraction: Differentiated, tau: Differentiated
) -> Differentiated:
    """F of the histories u (rows,) at times [s]; `first` marks the first sample of each history."""
    step = np.diff(time, prepend=time[0])
    step[first] = 0.0
    x = step / tau.value
    decay, old, new, slopes = _step(x)
    before = np.roll(elastic.value, 1)
    decay[first] = 0.0  # at rest before
    known = np.where(first, 0.0, old * before + new * elastic.value)
    value = _march(decay, known[:, None])[:, 0]
    decay_slope, old_slope, new_slope = slopes * (-x / tau.value)
    by_tau = decay_slope * np.roll(value, 1) + old_slope * before + new_slope * elastic.value
    rows = old * np.roll(elastic.slopes, 1, axis=1) + new * elastic.slopes + by_tau * tau.slopes
    memory = Differentiated(value, _march(decay, np.where(first, 0.0, rows).T).T)
    return elastic - fraction * memory


def _step(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """e^(−x), the weights of u before and after the step, and the derivatives of the three by x."""
    safe = np.maximum(x, 1e-3)
    decay = np.exp(-x)
    mean = np.where(x < safe, 1 - x / 2 + x**2 / 6, -np.expm1(-safe) / safe)
    mean_slope = np.where(x < safe, -0.5 + x / 3, (np.exp(-safe) + np.expm1(-safe) / safe) / safe)
    return decay, mean - decay, 1 - mean, np.stack([-decay, mean_slope + decay, -mean_slope])


def _march(decay: Floats, known: Floats) -> Floats:
    """q_i = decay_i q_(i−1) + known_i, for each column."""
    bands = np.stack([np.ones_like(decay), -np.append(decay[1:], 0.0)])
    return np.asarray(solve_banded((1, 0), bands, known))
