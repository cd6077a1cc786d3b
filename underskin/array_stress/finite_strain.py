"""The contribution of finite strain to the stress on sensors beneath spheres, in addition to the linear layer's
contacts."""

import numpy as np
from scipy.interpolate import make_interp_spline

from underskin.array_stress.request import LoadCase
from underskin.errors import out_of_range
from underskin.physics import charge_response, hertz
from underskin.surrogate.off_centre_sigma import sigma_off_centre
from underskin.surrogate.solved_contact import SolvedContact
from underskin.units import Floats, to_si


def finite_strain(solved: SolvedContact, request: LoadCase, sensors: Floats) -> tuple[Floats, Floats, Floats]:
    """The change beneath each contact as for a single contact; changes add.

    Parameters
    ----------
    solved : SolvedContact
    request : LoadCase
        With contacts on a bonded incompressible layer.
    sensors : ndarray, (sensors, 2)
        Centres x, y [m].

    Returns
    -------
    stress, error : ndarray, (sensors,)
        [Pa] on each sensor, tension positive, and the bound on its error.
    contact_radius : ndarray, (contacts,)
        [m].

    Raises
    ------
    InvalidInput
        For a contact outside the domain of the solved contact.
    """
    h, rho = float(to_si("thickness_mm", request.thickness_mm)), request.sensor_radius_mm / request.thickness_mm
    modulus = to_si("youngs_modulus_mpa", request.youngs_modulus_mpa or np.nan)
    force = to_si("normal_force_n", [contact.normal_force_n for contact in request.contacts])
    radius = to_si("indenter_radius_mm", [contact.indenter_radius_mm for contact in request.contacts])
    contact_radii = solved.radius(force, radius, modulus, np.array(request.poisson_ratio), np.array(h))
    load = hertz.load_parameter(force, radius, modulus)
    tabulated = solved.sigma(contact_radii.small_strain_over_h, rho, load)
    stress, error = np.zeros((2, len(sensors)))
    for index, contact in enumerate(request.contacts):
        if not tabulated.inside[index]:
            raise _beyond(solved, index, contact.normal_force_n, contact_radii.small_strain_over_h[index], load[index])
        point = float(contact_radii.small_strain_over_h[index]), rho
        offset, strained = sigma_off_centre(solved, *point, float(load[index]))
        added = make_interp_spline(offset, strained - sigma_off_centre(solved, *point, 0.0)[1], k=3)
        away = np.hypot(*(sensors - to_si("x_mm", [contact.x_mm, contact.y_mm])).T) / h
        near = away <= offset[-1]
        scale = float(charge_response.mean_stress(force[index], 1.0, h))
        stress -= scale * np.where(near, added(np.minimum(away, offset[-1])), 0.0)
        error += scale * np.where(near, tabulated.rel_error[index] * tabulated.sigma[index], 0.0)
    return stress, error, contact_radii.radius


def _beyond(solved: SolvedContact, index: int, force: float, a_over_h: float, load: float) -> Exception:
    most_a, most_load = (solved.domain[name][1] for name in ("a_over_h", "load_parameter"))
    values = f"a/h = {a_over_h:.3g}, L = F/(R²E) = {load:.3g}"
    allowed = f"must press less with contact 'solved': a/h at most {most_a:g} and L at most {most_load:g} ({values})"
    return out_of_range(f"contacts[{index}].normal_force_n", force, allowed)
