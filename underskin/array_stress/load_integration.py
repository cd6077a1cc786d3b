"""Surface loads as point forces, and the charge that they cause on every sensor of an array; and what
finite strain adds beneath spheres to the linear layer's contacts.

A contact's tangential force is distributed like its pressure, as under a sliding sphere. A pressure map is constant in
each of its cells. All in SI; x and y in the sensors' frame.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from underskin.array_stress.request import LoadCase
from underskin.errors import out_of_range
from underskin.physics import charge_response, hertz
from underskin.physics.contact_pressure import SpherePressure
from underskin.surrogate.influence_table import Influence, SensorStress
from underskin.surrogate.off_centre_sigma import sigma_off_centre
from underskin.surrogate.solved_contact import SolvedContact
from underskin.units import Floats, to_si

_FINE_CELL = 0.02  # of the thickness: below, one point a cell; γ varies over lengths of about 0.3
_MIDDLING_CELL = 0.1  # two points each way; above, three in every _SUBCELL
_SUBCELL = 0.4
_RAY = 97  # positions along a ray: the stress varies over lengths of 0.3 h and more
_POINTS_AT_ONCE = 1 << 16  # points of a map, of which all may exceed the memory


@dataclass(frozen=True)
class Load:
    """Point forces on the surface.

    Attributes
    ----------
    positions : ndarray, (points, 2)
        x, y [m].
    forces : ndarray, (points, 3)
        F1, F2, F3 [N]; F3 positive into the skin.
    """

    positions: Floats
    forces: Floats


def contact_load(centre: Floats, force: Sequence[float], pressure: SpherePressure, thickness: float) -> Load:
    """A contact as point forces.

    The pressure's share of a ring is smooth in t = √(1 − r²/a²), so that Gauss' rule in t and equal angles integrate
    the influence function γ, which is analytic, to machine precision.

    Parameters
    ----------
    place : ndarray, (2,)
        x, y of the contact [m].
    force : sequence of float
        F1, F2, F3 [N]; F3 above 0, into the skin.
    pressure : SpherePressure
    thickness : float
        h [m].
    """
    wide = int(np.ceil(pressure.radius / thickness))
    t, weight = np.polynomial.legendre.leggauss(6 + 4 * wide)
    t, weight = (1 + t) / 2, weight / 2
    count = 12 + 12 * wide
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    r = pressure.radius * np.sqrt(1 - t**2)
    positions = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=-1).reshape(-1, 2)
    share = np.repeat(pressure.ring_share(t) * weight / count, count)
    return Load(positions + centre, np.outer(share, force))


def pressure_map_loads(x: Floats, y: Floats, pressure: Floats, thickness: float) -> Iterator[Load]:
    """A pressure map as point forces, in parts.

    Parameters
    ----------
    x, y : ndarray, (columns,) and (rows,)
        Evenly spaced centres of the cells [m].
    pressure : ndarray, (rows, columns)
        Constant in each cell [Pa].
    thickness : float
        h [m].
    """
    width, height = x[1] - x[0], y[1] - y[0]
    across, across_share = _cell_rule(width / thickness)
    along, along_share = _cell_rule(height / thickness)
    every_row, every_column = np.nonzero(pressure)
    at_once = max(1, _POINTS_AT_ONCE // (along.size * across.size))
    for start in range(0, max(1, every_row.size), at_once):
        row, column = (every[start : start + at_once] for every in (every_row, every_column))
        positions = np.empty((row.size, along.size, across.size, 2))
        positions[..., 0] = x[column, None, None] + width * across
        positions[..., 1] = y[row, None, None] + height * along[:, None]
        force = pressure[row, column, None, None] * width * height * np.outer(along_share, across_share)
        forces = np.zeros((force.size, 3))
        forces[:, 2] = force.ravel()
        yield Load(positions.reshape(-1, 2), forces)


def map_points(x: Floats, y: Floats, pressure: Floats, thickness: float) -> int:
    """Number of point forces that `pressure_map_loads` makes of a map."""
    width, height = (_rule_of((axis[1] - axis[0]) / thickness) for axis in (x, y))
    return int(np.count_nonzero(pressure)) * width[0] * width[1] * height[0] * height[1]


def combined(loads: Sequence[Load]) -> Load:
    """Several loads as one."""
    return Load(np.concatenate([load.positions for load in loads]), np.concatenate([load.forces for load in loads]))


def array_stress(influence: Influence, thickness: float, sensors: Floats, loads: Iterable[Load]) -> SensorStress:
    """Mean stress on sensors under all loads.

    Parameters
    ----------
    influence : Influence
        Of the skin.
    thickness : float
        h [m].
    sensors : ndarray, (sensors, 2)
        Centres x, y [m].
    loads : iterable of Load

    Returns
    -------
    SensorStress
        Stress, bound on its error, and whether any load is in range; each (sensors,).
    """
    stress, error, inside = np.zeros(len(sensors)), np.zeros(len(sensors)), np.zeros(len(sensors), dtype=bool)
    for load in loads:
        part = influence.stress(thickness, sensors, load.positions, load.forces)
        stress, error, inside = stress + part.stress, error + part.error, inside | part.inside
    return SensorStress(stress, error, inside)


def stress_around(
    influence: Influence,
    thickness: float,
    pressure: SpherePressure,
    force: Sequence[float],
    away: tuple[Floats, Floats],
) -> Floats:
    """Stress of one contact at many positions, from profiles along a ray: T(r) + S(r) (F1 cos φ + F2 sin φ).

    Parameters
    ----------
    influence : Influence
        Of the skin, for a point sensor.
    thickness : float
        h [m].
    pressure : SpherePressure
    force : sequence of float
        F1, F2, F3 [N], as in `contact_load`.
    away : pair of ndarray
        x and y of the places from the contact's centre [m], of one shape.

    Returns
    -------
    ndarray
        σ_zz [Pa], tension positive, of that shape; 0 beyond the table's reach.
    """
    r, angle = np.hypot(*away), np.arctan2(away[1], away[0])
    ray = np.linspace(0.0, influence.reach * thickness, _RAY)
    points = np.stack([ray, np.zeros(_RAY)], axis=-1)
    stress = np.zeros(r.shape)
    for unit, strength in (
        ((0.0, 0.0, 1.0), np.full(r.shape, force[2])),
        ((1.0, 0.0, 0.0), force[0] * np.cos(angle) + force[1] * np.sin(angle)),
    ):
        if strength.any():
            load = contact_load(np.zeros(2), unit, pressure, thickness)
            along_ray = CubicSpline(ray, influence.stress(thickness, points, load.positions, load.forces).stress)
            stress += strength * np.where(r <= ray[-1], along_ray(r), 0.0)
    return stress


def _rule_of(size: float) -> tuple[int, int]:
    """Number of quadrature points in each part of a cell of `size` thicknesses, and number of parts."""
    points = 1 if size <= _FINE_CELL else 2 if size <= _MIDDLING_CELL else 3
    return points, max(1, int(np.ceil(size / _SUBCELL)))


def _cell_rule(size: float) -> tuple[Floats, Floats]:
    """Quadrature points in a cell, −1/2 to 1/2, and their weights, for a cell of `size` thicknesses."""
    points, parts = _rule_of(size)
    node, weight = np.polynomial.legendre.leggauss(points)
    start = (np.arange(parts) - parts / 2) / parts
    positions = (start[:, None] + (1 + node) / 2 / parts).ravel()
    return positions, np.tile(weight / 2 / parts, parts)


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
