"""What a body that relaxes with one Prony pair remembers: E(t)/E(0) = 1 − g + g e^(−t/τ).

u(t) is what an elastic body would show; F(t) = ∫ E(t−s)/E(0) du(s) = (1 − g) u(t) + g Y(t) with the fading memory
Y(t) = ∫ e^(−(t−s)/τ) du(s). u is taken as linear between samples, for which the step is exact (Fung, Biomechanics,
1993, section 7.6).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from underskin.autodiff import Differentiated, chain, exp, where
from underskin.units import Floats

_SERIES = 1e-3


def relaxed(
    elastic: Differentiated, time: Floats, first: NDArray[np.bool_], fraction: Differentiated, tau: Differentiated
) -> Differentiated:
    """F of the histories u (rows,) at times [s]; `first` marks the first sample of each history, at once there."""
    at = Differentiated(time, np.zeros_like(elastic.slopes))
    return (1.0 - fraction) * elastic + fraction * faded(elastic, at, first, tau)


def faded(
    history: Differentiated, time: Differentiated, begins: NDArray[np.bool_], tau: Differentiated
) -> Differentiated:
    """Y (rows,) of the histories u (rows,); all of u has just come where one `begins`."""
    before = np.maximum(np.arange(len(begins)) - 1, 0)
    x = where(~begins, (time - time[before]) / tau, 0.0)
    decay = exp(-x)
    known = where(begins, history, lagging(x) * (history - history[before]))
    held = np.where(begins, 0.0, decay.value)
    value = _march(held, known.value[:, None])[:, 0]
    rows = np.where(begins, 0.0, decay.slopes * value[before]) + known.slopes
    return Differentiated(value, _march(held, rows.T).T)


def lagging(x: Differentiated) -> Differentiated:
    """(1 − e^(−x))/x: what is left of a steady change at its end, x of its duration over τ."""
    safe = np.maximum(x.value, _SERIES)
    small = x.value < safe
    value = np.where(small, 1 - x.value / 2 + x.value**2 / 6, -np.expm1(-safe) / safe)
    slope = np.where(small, -0.5 + x.value / 3, (np.exp(-safe) + np.expm1(-safe) / safe) / safe)
    return chain(value, (slope, x))


def _march(decay: Floats, known: Floats) -> Floats:
    """y_i = decay_i y_(i−1) + known_i, for each column."""
    bands = np.stack([np.ones_like(decay), -np.append(decay[1:], 0.0)])
    return np.asarray(solve_banded((1, 0), bands, known))
