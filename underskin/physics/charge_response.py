"""From transmitted stress to charge: the sensor's response and its inversion (Seminara 2018, equations 2 and 15).

All in SI, scalars or arrays that broadcast. FRF means charge over force at the same instant, e^(+iωt) convention,
positive in compression for a positive d33; in the base model it is real and does not depend on frequency.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.errors import too_few
from underskin.units import Floats, Mask


@dataclass(frozen=True)
class Sigma:
    """The transmission factor σ with its error and domain; three arrays of one shape.

    Attributes
    ----------
    sigma : ndarray
        σ [-], NaN outside the domain.
    rel_error : ndarray
        Bound on the relative error of σ [-].
    inside : ndarray of bool
        Which entries lie inside the domain.
    """

    sigma: Floats
    rel_error: Floats
    inside: Mask


def gain(sigma: ArrayLike, rt_over_h: ArrayLike) -> Floats:
    """Share of the force that the sensor bears, FRF/d33 = (3/2) ρ² σ.

    Parameters
    ----------
    sigma : array_like
        Transmission factor σ [-].
    rt_over_h : array_like
        ρ = rT/h, sensor radius over thickness [-].

    Returns
    -------
    ndarray
        [-], of the broadcast shape.
    """
    return 1.5 * np.square(np.asarray(rt_over_h, dtype=float)) * np.asarray(sigma, dtype=float)


def frf(d33: ArrayLike, sigma: ArrayLike, rt_over_h: ArrayLike) -> Floats:
    """Frequency response function of the base model, Q/F = d33 (3/2) ρ² σ.

    Parameters
    ----------
    d33 : array_like
        Piezoelectric coefficient [C/N].
    sigma, rt_over_h : array_like
        As in `gain`.

    Returns
    -------
    ndarray
        [C/N], of the broadcast shape.
    """
    return np.asarray(d33, dtype=float) * gain(sigma, rt_over_h)


def mean_stress(preload: ArrayLike, sigma: ArrayLike, thickness: ArrayLike) -> Floats:
    """Static mean stress on the sensor, T0 = 3 F σ/(2 π h²), positive in compression.

    Parameters
    ----------
    preload : array_like
        Force F [N].
    sigma : array_like
        Transmission factor σ [-].
    thickness : array_like
        h [m].

    Returns
    -------
    ndarray
        [Pa], of the broadcast shape.
    """
    return 1.5 / np.pi * np.asarray(preload, dtype=float) * np.asarray(sigma) / np.square(thickness)


def plateau(lines: Floats, in_band: Mask) -> tuple[Floats, Floats]:
    """Mean of the FRF lines inside a band, and its standard error.

    The standard error is the scatter between lines alone: a gain error is common to all lines of a recording.

    Parameters
    ----------
    lines : ndarray, (rows, lines)
        In any unit.
    in_band : ndarray of bool, (lines,)
        Which lines lie in the band.

    Returns
    -------
    mean : ndarray, (rows,)
    standard_error : ndarray, (rows,)
        NaN where the band holds one line.

    Raises
    ------
    InvalidInput
        Where the band holds no line.
    """
    count = int(in_band.sum())
    if count == 0:
        raise too_few("band_hz", "no line inside", "must hold at least one entry of frequency_hz")
    chosen = lines[:, in_band]
    if count == 1:
        return chosen[:, 0], np.full(len(chosen), np.nan)
    return chosen.mean(axis=1), chosen.std(axis=1, ddof=1) / np.sqrt(count)


def d33(
    frf: ArrayLike, frf_uncertainty: ArrayLike, sigma: ArrayLike, rel_error: ArrayLike, rt_over_h: ArrayLike
) -> tuple[Floats, Floats]:
    """Piezoelectric coefficient d33 = FRF/((3/2) ρ² σ), with its standard uncertainty.

    The relative error of the table is added in quadrature to the uncertainty of the FRF.

    Parameters
    ----------
    frf, frf_uncertainty : array_like
        Measured FRF and its standard uncertainty [C/N].
    sigma, rel_error : array_like
        Transmission factor and the bound on its relative error [-].
    rt_over_h : array_like
        ρ = rT/h [-].

    Returns
    -------
    value : ndarray
        [C/N], of the broadcast shape.
    uncertainty : ndarray
        [C/N], of the broadcast shape.
    """
    share = gain(sigma, rt_over_h)
    value = np.asarray(frf, dtype=float) / share
    return value, np.hypot(np.asarray(frf_uncertainty, dtype=float) / share, value * np.asarray(rel_error))
