"""The skin pressed by a sphere: contact radius, a/h, L, σ, stress on the sensor and FRF; and d33 from a measured FRF.

Columns in SI that broadcast. `model` "paper" is the base model: Hertz radius on a half space, the contact edge still,
σ of the bonded finite-strain layer from the table (Seminara 2018, equations 7 to 16).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.physics import charge_response, hertz
from underskin.physics.skin import INCOMPRESSIBLE, Indenter, Skin
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Mask


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
    inside: Mask

    def frf(self, d33: ArrayLike) -> Floats:
        """Charge over force [C/N] for d33 [C/N]."""
        return charge_response.frf(d33, self.sigma, self.rt_over_h)

    def d33(self, frf: ArrayLike, frf_uncertainty: ArrayLike) -> tuple[Floats, Floats]:
        """d33 [C/N] and its standard uncertainty from a measured FRF [C/N]."""
        return charge_response.d33(frf, frf_uncertainty, self.sigma, self.rel_error, self.rt_over_h)


def transmission(table: SigmaTable, skin: Skin, indenter: Indenter, preload: ArrayLike) -> Transmission:
    """Contact radius, σ and mean stress of a skin pressed by a sphere, by the base model.

    Parameters
    ----------
    table
        The σ table.
    skin, indenter
        In SI, scalars or columns that broadcast.
    preload
        F [N], (rows,) or one.

    Returns
    -------
    Transmission
        NaN in σ, error and stress where a row is outside the table; rows with ν ≠ 0.5 are outside, since the table is
        of an incompressible elastomer.

    Source: Seminara, Sensors 18 (2018) 459, equations 7 to 16.
    """
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
        mean_stress=charge_response.mean_stress(force, sigma, h),
        inside=inside,
    )


def frf_gradient(
    table: SigmaTable, skin: Skin, indenter: Indenter, preload: ArrayLike, d33: ArrayLike
) -> dict[str, Floats]:
    """The derivatives of FRF = d33 · (3/2) ρ² σ(α, ρ, L), α = a/h ∝ (F R/E)^(1/3)/h, ρ = rT/h, L = F/(R² E).

    Parameters
    ----------
    table, skin, indenter, preload
        As for `transmission`.
    d33
        [C/N], (rows,) or one.

    Returns
    -------
    dict
        ∂FRF/∂ each of thickness, youngs_modulus, sensor_radius, indenter_radius, preload and d33, in SI, (rows,); NaN
        where the row is outside the table.
    """
    reached = transmission(table, skin, indenter, preload)
    rho = reached.rt_over_h
    scale = np.where(reached.inside, charge_response.frf(d33, 1.0, rho), np.nan)
    slopes = table.gradient(reached.a_over_h, rho, reached.load_parameter)
    # ∂FRF/∂ of the logarithm of each dimensionless number; d33's is FRF itself.
    in_a, in_load = scale * slopes[0] * reached.a_over_h, scale * slopes[2] * reached.load_parameter
    in_rho = scale * (2 * reached.sigma + slopes[1] * rho)
    return {
        "thickness": -(in_a + in_rho) / skin.thickness,
        "youngs_modulus": -(in_a / 3 + in_load) / skin.youngs_modulus,
        "sensor_radius": in_rho / skin.sensor_radius,
        "indenter_radius": (in_a / 3 - 2 * in_load) / indenter.radius,
        "preload": (in_a / 3 + in_load) / np.asarray(preload, dtype=float),
        "d33": charge_response.gain(reached.sigma, rho),
    }
