"""The skin, the indenter and the sensor's response: from transmitted stress to charge and back, in SI.

Source: Seminara, Sensors 18 (2018) 459, section 2 and equations 2 and 15. Scalars or arrays that broadcast. FRF means
charge over force at the same instant, e^(+iωt) convention, positive in compression for a positive d33; in the base
model it is real and does not depend on frequency.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.errors import out_of_range, too_few
from underskin.units import Floats, Mask, checked

INCOMPRESSIBLE = 0.5


@dataclass(frozen=True)
class Skin:
    """An elastomer layer on a rigid base with circular sensors under it; scalars or arrays that broadcast.

    Attributes
    ----------
    thickness : ndarray
        h [m].
    youngs_modulus : ndarray
        E [Pa].
    sensor_radius : ndarray
        rT [m].
    poisson_ratio : ndarray
        ν [-].
    """

    thickness: Floats
    youngs_modulus: Floats
    sensor_radius: Floats
    poisson_ratio: Floats

    @classmethod
    def from_lab(
        cls,
        *,
        thickness_mm: ArrayLike,
        youngs_modulus_mpa: ArrayLike,
        sensor_radius_mm: ArrayLike,
        poisson_ratio: ArrayLike = INCOMPRESSIBLE,
        units_checked: bool = False,
    ) -> "Skin":
        """The skin from a lab's units.

        Raises
        ------
        InvalidInput
            Names the field that cannot be used, and guesses the unit that was meant.
        """
        return cls(
            thickness=checked("thickness_mm", thickness_mm, units_checked=units_checked),
            youngs_modulus=checked("youngs_modulus_mpa", youngs_modulus_mpa, units_checked=units_checked),
            sensor_radius=checked("sensor_radius_mm", sensor_radius_mm, units_checked=units_checked),
            poisson_ratio=_checked_poisson_ratio(poisson_ratio),
        )

    @property
    def rt_over_h(self) -> Floats:
        """Sensor radius over thickness, ρ [-]."""
        return self.sensor_radius / self.thickness


@dataclass(frozen=True)
class Indenter:
    """A rigid sphere of radius R [m], a scalar or an array."""

    radius: Floats

    @classmethod
    def from_lab(cls, *, indenter_radius_mm: ArrayLike, units_checked: bool = False) -> "Indenter":
        """The sphere from a lab's units; raises InvalidInput as `Skin.from_lab` does."""
        return cls(checked("indenter_radius_mm", indenter_radius_mm, units_checked=units_checked))


def _checked_poisson_ratio(value: ArrayLike) -> Floats:
    values = np.asarray(value, dtype=float)
    bad = ~((values >= 0.0) & (values <= INCOMPRESSIBLE))
    if bad.any():
        first = int(np.argmax(bad))
        raise out_of_range(
            "poisson_ratio", float(values.flat[first]), "must be 0 to 0.5", index=first if values.ndim else None
        )
    return values


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
