"""Compiled: information on the mean parameters, and the gradient of the log likelihood (see `likelihood`).

With the direction u of a recording and J its derivatives, C⁻¹ is taken apart by Sherman and Morrison's identity, first
for each recording, then for the sensors' columns.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats

_FROM_SLOPES = 1e-3  # m: a recording whose response changes by more than itself over this way is led by its slopes
_OF_PARAMETERS, _OF_PAIRS = "float64[:, :, ::1]", "float64[:, :, :, ::1]"


_TERMS = 8
_FACTOR, _A, _KNOWN, _UU, _UR, _REDUCED, _AS_MODEL, _MOVED = range(_TERMS)  # of each recording


@compiled()
def _scatter(
    level: Floats,
    uu: Floats,
    uy: Floats,
    place: Floats,
    sensor: NDArray[np.int64],
    bend: Floats,
    laplacian: Floats,
    square: Floats,
    levels: Floats,
    terms: Floats,
) -> None:
    """What each recording's scatter makes of it: `terms` (recordings, 8), with V = s'² a² + p² |t|²."""
    gain2, k2, p2, _ = levels
    for r in range(len(level)):
        own = bend[sensor[r]]
        factor = np.exp(own + 0.5 * p2 * laplacian[r])
        a = level[r] * factor
        known = a * (1 - own)
        as_model = gain2 + 0.5 * p2 * p2 * square[r]
        moved = p2 * place[r] * factor * factor if len(place) else 0.0
        u = uu[r] / k2
        terms[r, _FACTOR], terms[r, _A], terms[r, _KNOWN] = factor, a, known
        terms[r, _UU], terms[r, _UR] = u, (uy[r] - known * uu[r]) / k2
        terms[r, _REDUCED] = 1 / (1 + (as_model * a * a + moved) * u)  # 1 − (share of u taken out)
        terms[r, _AS_MODEL], terms[r, _MOVED] = as_model, moved


@compiled()
def _shrink(terms: Floats) -> float:
    """V/(1 + V u*u)."""
    return (terms[_AS_MODEL] * terms[_A] ** 2 + terms[_MOVED]) * terms[_REDUCED]


@compiled()
def _along(level_slopes: Floats, uv: Floats, vy: Floats, inverse: float, terms: Floats, uj: Floats, jr: Floats) -> None:
    """Re u*J and, with a recording's own scatter taken out, Re J*r, both over κ² (recordings, P)."""
    leveled, turned = level_slopes.shape[1] > 0, uv.shape[1] > 0
    for r in range(len(terms)):
        of = terms[r]
        for p in range(uj.shape[1]):
            along = with_r = 0.0
            if leveled:
                along += level_slopes[r, p] * of[_FACTOR] * of[_UU]
                with_r += level_slopes[r, p] * of[_FACTOR] * of[_UR]
            if turned:
                along += of[_A] * uv[r, p] * inverse
                with_r += of[_A] * (vy[r, p] - of[_KNOWN] * uv[r, p]) * inverse
            uj[r, p] = along
            jr[r, p] = with_r - along * _shrink(of) * of[_UR]


@compiled()
def _over_sensors(
    sensor: NDArray[np.int64],
    tau2: float,
    terms: Floats,
    uj: Floats,
    mj: Floats,
    of_sensors: Floats,
    by_sensor: Floats,
) -> None:
    """mᵀC⁻¹J of recordings and of sensors; of sensors mᵀC⁻¹m, mᵀC⁻¹r, τ²/(1 + τ² mᵀC⁻¹m) and the most probable b."""
    of_sensors[:], by_sensor[:] = 0.0, 0.0
    for r in range(len(terms)):
        of, own = terms[r], sensor[r]
        weight = of[_A] * of[_REDUCED]
        of_sensors[own, 0] += of[_A] * of[_UU] * weight
        of_sensors[own, 1] += of[_UR] * weight
        for p in range(uj.shape[1]):
            mj[r, p] = uj[r, p] * weight
            by_sensor[own, p] += mj[r, p]
    for own in range(len(of_sensors)):
        of_sensors[own, 2] = tau2 / (1 + tau2 * of_sensors[own, 0])
        of_sensors[own, 3] = of_sensors[own, 2] * of_sensors[own, 1]


@compiled()
def _informed(
    level_slopes: Floats, uv: Floats, vv: Floats, inverse: float, terms: Floats, uj: Floats, whole: Floats
) -> None:
    """Add Jᵀ C⁻¹ J, without the sensors' columns, to the lower half."""
    leveled, turned = level_slopes.shape[1] > 0, uv.shape[1] > 0
    for r in range(len(terms)):
        of = terms[r]
        shrink, f, a = _shrink(of), of[_FACTOR], of[_A]
        for p in range(uj.shape[1]):
            for q in range(p + 1):
                both = -uj[r, p] * shrink * uj[r, q]
                if leveled:
                    both += level_slopes[r, p] * f * f * of[_UU] * level_slopes[r, q]
                if turned:
                    both += a * a * inverse * vv[r, p, q]
                if leveled and turned:
                    both += f * a * inverse * (level_slopes[r, p] * uv[r, q] + uv[r, p] * level_slopes[r, q])
                whole[p, q] += both


@compiled()
def _with_sensors(
    sensor: NDArray[np.int64],
    terms: Floats,
    of_sensors: Floats,
    jr: Floats,
    mj: Floats,
    jr_sensor: Floats,
    slope: Floats,
) -> None:
    """Add the gradient by the mean and by what follows the model in a recording, the sensors' columns in C as well."""
    jr_sensor[:] = 0.0
    for r in range(len(terms)):
        of, own = terms[r], sensor[r]
        _, _, shrink, gain = of_sensors[own]
        weight = of[_A] * of[_REDUCED]
        mm = of[_A] * of[_UU] * weight
        mr_left, left = of[_UR] * weight - mm * gain, 1 - shrink * mm
        for p in range(len(slope)):
            with_r = jr[r, p] - mj[r, p] * gain
            jr_sensor[own, p] += with_r
            slope[p] += with_r + of[_AS_MODEL] * (with_r * mr_left - mj[r, p] * left)


@compiled()
def _of_place(
    level: Floats,
    level_slopes: Floats,
    place: Floats,
    growth: Floats,
    uv: Floats,
    vy: Floats,
    inverse: float,
    sensor: NDArray[np.int64],
    terms: Floats,
    of_sensors: Floats,
    slope: Floats,
) -> None:
    """Add the gradient by the column that the position's slopes are."""
    for r in range(len(terms)):
        of = terms[r]
        _, _, shrink, gain = of_sensors[sensor[r]]
        weight = of[_A] * of[_REDUCED]
        um = of[_UU] * weight
        explained = of[_UR] * of[_REDUCED] - um * gain  # uᵀ C⁻¹ r
        taken = of[_UU] * of[_REDUCED] - shrink * um * um  # uᵀ C⁻¹ u
        led = _FROM_SLOPES**2 * place[r] > level[r] ** 2
        for p in range(len(slope)):
            grows = growth[r, p] if growth.shape[1] else np.nan
            if np.isnan(grows):
                grows = 0.0 if led else 2 * level_slopes[r, p] / level[r]
            by_growth = 0.5 * (explained * explained - taken) * grows
            if uv.shape[1]:
                along, with_r = uv[r, p] * inverse, (vy[r, p] - of[_KNOWN] * uv[r, p]) * inverse
                mv = along * weight
                by_growth += (with_r - along * _shrink(of) * of[_UR] - mv * gain) * explained
                by_growth -= along * of[_REDUCED] - shrink * um * mv
            slope[p] += of[_MOVED] * by_growth


@compiled(
    f"void(float64[:, ::1], {_OF_PARAMETERS}, float64[:, ::1], float64[:, ::1], {_OF_PARAMETERS}, {_OF_PARAMETERS}, "
    f"{_OF_PAIRS}, float64[:, ::1], {_OF_PARAMETERS}, int64[::1], float64[:, ::1], float64[::1], float64[::1], "
    f"float64[:, ::1], {_OF_PARAMETERS}, float64[:, ::1])"
)
def normal_equations(
    level: Floats,
    level_slopes: Floats,
    uu: Floats,
    uy: Floats,
    uv: Floats,
    vy: Floats,
    vv: Floats,
    place: Floats,
    growth: Floats,
    sensor: NDArray[np.int64],
    bend: Floats,
    laplacian: Floats,
    square: Floats,
    noise: Floats,
    information: Floats,
    gradient: Floats,
) -> None:
    """Fill `information` Jᵀ C⁻¹ J (points, P, P) and `gradient` ∂/∂θ (−½ log|C| − ½ rᵀC⁻¹r) (points, P).

    Parameters
    ----------
    level, level_slopes
        L (points, recordings), and its derivatives (points, recordings, P), or P = 0 where L is 1.
    uu, uy, uv, vy, vv
        The sums Re u*u, Re u*y (points, recordings), with the derivatives v of u Re u*v, Re v*y (points, recordings,
        P) and Re v*v (points, recordings, P, P), or P = 0 where u does not change.
    place, growth
        |t|² of the position's slopes (points, recordings), or (points, 0) where there are none, and ∂ log |t|²/∂θ
        (points, recordings, P), NaN where t is taken to change as L does, or where it leads, not at all; or P = 0.
    sensor, bend, laplacian, square
        See `cost_kernel.log_likelihoods`.
    noise
        (points, 4): gain, level, position and spread.
    """
    points, recordings = level.shape
    sensors, count = bend.shape[1], gradient.shape[1]
    terms = np.empty((recordings, _TERMS))
    uj, jr, mj = np.empty((recordings, count)), np.empty((recordings, count)), np.empty((recordings, count))
    of_sensors = np.empty((sensors, 4))
    by_sensor = np.empty((2, sensors, count))
    for point in range(points):
        levels = noise[min(point, len(noise) - 1)] ** 2
        at = min(point, len(place) - 1)
        _scatter(level[point], uu[point], uy[point], place[at], sensor, bend[point], laplacian, square, levels, terms)
        _along(level_slopes[point], uv[point], vy[point], 1 / levels[1], terms, uj, jr)
        _over_sensors(sensor, levels[3], terms, uj, mj, of_sensors, by_sensor[0])
        whole, slope = information[point], gradient[point]
        whole[:], slope[:] = 0.0, 0.0
        _informed(level_slopes[point], uv[point], vv[point], 1 / levels[1], terms, uj, whole)
        for of in range(sensors):
            for p in range(count):
                for q in range(p + 1):
                    whole[p, q] -= by_sensor[0, of, p] * of_sensors[of, 2] * by_sensor[0, of, q]
        for p in range(count):
            for q in range(p):
                whole[q, p] = whole[p, q]
        _with_sensors(sensor, terms, of_sensors, jr, mj, by_sensor[1], slope)
        if place.shape[1]:
            _of_place(
                level[point],
                level_slopes[point],
                place[point],
                growth[point],
                uv[point],
                vy[point],
                1 / levels[1],
                sensor,
                terms,
                of_sensors,
                slope,
            )
        for of in range(sensors):
            mm, mr, shrink, gain = of_sensors[of]
            for p in range(count):
                slope[p] += levels[3] * (
                    by_sensor[1, of, p] * (mr - mm * gain) - by_sensor[0, of, p] * (1 - shrink * mm)
                )
