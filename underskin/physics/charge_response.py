"""From transmitted stress to charge: the sensor's response and its inversion (Seminara 2018, equations 2 and 15).

All in SI, scalars or arrays that broadcast. FRF means charge over force at the same instant, e^(+iωt) convention,
positive in compression for a positive d33; in the base model it is real and flat over frequency.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underskin.errors import InvalidInput
from underskin.units import Floats


@dataclass(frozen=True)
class Sigma:
    """σ, the bound on its relative error, and which rows lie inside the domain (NaN outside); equal shapes."""

    sigma: Floats
    rel_error: Floats
    inside: NDArray[np.bool_]


def gain(sigma: ArrayLike, rt_over_h: ArrayLike) -> Floats:
    """(3/2) ρ² σ: the fraction of the force that the sensor sees, FRF / d33 [-]."""
    return 1.5 * np.square(np.asarray(rt_over_h, dtype=float)) * np.asarray(sigma, dtype=float)


def frf(d33: ArrayLike, sigma: ArrayLike, rt_over_h: ArrayLike) -> Floats:
    """Q/F = d33 · (3/2) ρ² σ [C/N]."""
    return np.asarray(d33, dtype=float) * gain(sigma, rt_over_h)


def charge(preload: ArrayLike, d33: ArrayLike, sigma: ArrayLike, rt_over_h: ArrayLike) -> Floats:
    """Q = d33 · (3/2) ρ² · σ · F [C], equation 15."""
    return frf(d33, sigma, rt_over_h) * np.asarray(preload, dtype=float)


def mean_stress(preload: ArrayLike, sigma: ArrayLike, thickness: ArrayLike) -> Floats:
    """T0 = 3 F σ / (2 π h²) [Pa], the static mean stress on the sensor, positive in compression."""
    return 1.5 / np.pi * np.asarray(preload, dtype=float) * np.asarray(sigma) / np.square(thickness)


def plateau(lines: Floats, in_band: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """The mean of each row's lines in the band, and its standard error; `lines` is (rows, lines), any unit.

    The standard error is NaN where the band holds one line, which has no scatter. It sees the scatter between lines
    only: the lines of one recording share its gain error. Raises InvalidInput where the band holds no line.
    """
    count = int(in_band.sum())
    if count == 0:
        raise InvalidInput("band_hz", "no line inside", "must hold at least one entry of frequency_hz")
    chosen = lines[:, in_band]
    if count == 1:
        return chosen[:, 0], np.full(len(chosen), np.nan)
    return chosen.mean(axis=1), chosen.std(axis=1, ddof=1) / np.sqrt(count)


def d33(
    frf: ArrayLike, frf_uncertainty: ArrayLike, sigma: ArrayLike, rel_error: ArrayLike, rt_over_h: ArrayLike
) -> tuple[Floats, Floats]:
    """d33 = FRF / ((3/2) ρ² σ) [C/N] and its standard uncertainty.

    The uncertainty adds in quadrature that of the FRF and |d33| · `rel_error`, the table's bound on σ's relative error.
    """
    seen = gain(sigma, rt_over_h)
    value = np.asarray(frf, dtype=float) / seen
    return value, np.hypot(np.asarray(frf_uncertainty, dtype=float) / seen, value * np.asarray(rel_error))
