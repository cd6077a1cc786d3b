"""The skin pressed by a sphere: contact radius, a/h, L, σ, stress on the sensor and FRF; and d33 from a measured FRF.

Columns in SI that broadcast. `model` "paper" is the base model: Hertz radius on a half space, the contact edge still,
σ of the bonded finite-strain layer from the table (PHYSICS, sections 1, 2 and 6).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underskin import hertz, response
from underskin.skin import INCOMPRESSIBLE, Indenter, Skin
from underskin.surrogate import SigmaTable
from underskin.units import Floats


@dataclass(frozen=True)
class Transmission:
    """What reaches the sensor; every array has one entry a row, NaN in σ, rel_error and stress where not `inside`."""

    contact_radius: Floats  # a [m]
    a_over_h: Floats
    rt_over_h: Floats
    load_parameter: Floats  # L
    sigma: Floats
    rel_error: Floats
    mean_stress: Floats  # T0 [Pa], compression positive
    inside: NDArray[np.bool_]

    def frf(self, d33: ArrayLike) -> Floats:
        """Charge over force [C/N] for d33 [C/N]."""
        return response.frf(d33, self.sigma, self.rt_over_h)

    def d33(self, frf: ArrayLike, frf_uncertainty: ArrayLike) -> tuple[Floats, Floats]:
        """d33 [C/N] and its standard uncertainty from a measured FRF [C/N]."""
        return response.d33(frf, frf_uncertainty, self.sigma, self.rel_error, self.rt_over_h)


def transmission(table: SigmaTable, skin: Skin, indenter: Indenter, preload: ArrayLike) -> Transmission:
    """σ and what leads to it for each row; rows with ν ≠ 0.5 are outside, since the table is incompressible."""
    columns = np.broadcast_arrays(
        skin.thickness,
        skin.youngs_modulus,
        skin.sensor_radius,
        skin.poisson_ratio,
        indenter.radius,
        np.asarray(preload, dtype=float),
    )
    h, modulus, sensor_radius, poisson_ratio, radius, force = columns
    a = hertz.contact_radius(force, radius, modulus, poisson_ratio)
    load = hertz.load_parameter(force, radius, modulus)
    answer = table.sigma(a / h, sensor_radius / h, load)
    inside = answer.inside & (poisson_ratio == INCOMPRESSIBLE)
    sigma = np.where(inside, answer.sigma, np.nan)
    return Transmission(
        contact_radius=a,
        a_over_h=a / h,
        rt_over_h=sensor_radius / h,
        load_parameter=load,
        sigma=sigma,
        rel_error=np.where(inside, answer.rel_error, np.nan),
        mean_stress=response.mean_stress(force, sigma, h),
        inside=inside,
    )
