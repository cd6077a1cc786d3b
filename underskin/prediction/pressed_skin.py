"""The skin pressed by a sphere: contact radius, a/h, L, σ, stress on the sensor and FRF; and d33 from a measured FRF.

Columns in SI that broadcast. In the base model the contact edge stands still; the contact is one of two models:
`paper`, the σ table: Hertz' radius on a half space, σ of the bonded finite-strain layer under Hertz' pressure as a dead
load (Seminara 2018, equations 7 to 16); and `solved`: a sphere in frictionless contact with that layer itself.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.physics import charge_response, hertz
from underskin.physics.skin import INCOMPRESSIBLE, Indenter, Skin
from underskin.surrogate.contact_model import ContactModel
from underskin.units import Floats, Mask


@dataclass(frozen=True)
class Transmission:
    """What reaches the sensor; every array has one entry a row, NaN in σ, rel_error and stress where not `inside`."""

    contact_radius: Floats  # a [m]
    a_over_h: Floats
    small_strain_a_over_h: Floats  # of the contact at small strain, over which σ is tabulated
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


def transmission(contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: ArrayLike) -> Transmission:
    """Contact radius, σ and mean stress of a skin pressed by a sphere, by the base model.

    Parameters
    ----------
    contact_model
        The σ table (`load_table`), or the solved contact (`solved_contact`).
    skin, indenter
        In SI, scalars or columns that broadcast.
    preload
        F [N], (rows,) or one.

    Returns
    -------
    Transmission
        NaN in σ, error and stress where a row is outside the table; rows with ν ≠ 0.5 are outside, since the tables are
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
    contact = contact_model.radius(force, radius, modulus, poisson_ratio, h)
    load = hertz.load_parameter(force, radius, modulus)
    answer = contact_model.sigma(contact.small_strain_over_h, sensor_radius / h, load)
    inside = answer.inside & (poisson_ratio == INCOMPRESSIBLE)
    sigma = np.where(inside, answer.sigma, np.nan)
    return Transmission(
        contact_radius=contact.radius,
        a_over_h=contact.radius / h,
        small_strain_a_over_h=contact.small_strain_over_h,
        rt_over_h=sensor_radius / h,
        load_parameter=load,
        sigma=sigma,
        rel_error=np.where(inside, answer.rel_error, np.nan),
        mean_stress=charge_response.mean_stress(force, sigma, h),
        inside=inside,
    )


def frf_gradient(
    contact_model: ContactModel, skin: Skin, indenter: Indenter, preload: ArrayLike, d33: ArrayLike
) -> dict[str, Floats]:
    """The derivatives of FRF = d33 · (3/2) ρ² σ(α, ρ, L), α = a/h of F R/(E h³), ρ = rT/h, L = F/(R² E).

    Parameters
    ----------
    contact_model, skin, indenter, preload
        As for `transmission`.
    d33
        [C/N], (rows,) or one.

    Returns
    -------
    dict
        ∂FRF/∂ each of thickness, youngs_modulus, sensor_radius, indenter_radius, preload and d33, in SI, (rows,); NaN
        where the row is outside the table.
    """
    reached = transmission(contact_model, skin, indenter, preload)
    alpha, rho = reached.small_strain_a_over_h, reached.rt_over_h
    scale = np.where(reached.inside, charge_response.frf(d33, 1.0, rho), np.nan)
    slopes = contact_model.gradient(alpha, rho, reached.load_parameter)
    # ∂FRF/∂ of the logarithm of each dimensionless number, F R/(E h³), L and ρ.
    _, growth = contact_model.load_over_cube(alpha)
    in_force, in_load = scale * slopes[0] * alpha * growth, scale * slopes[2] * reached.load_parameter
    in_rho = scale * (2 * reached.sigma + slopes[1] * rho)
    return {
        "thickness": -(3 * in_force + in_rho) / skin.thickness,
        "youngs_modulus": -(in_force + in_load) / skin.youngs_modulus,
        "sensor_radius": in_rho / skin.sensor_radius,
        "indenter_radius": (in_force - 2 * in_load) / indenter.radius,
        "preload": (in_force + in_load) / np.asarray(preload, dtype=float),
        "d33": charge_response.gain(reached.sigma, rho),
    }
