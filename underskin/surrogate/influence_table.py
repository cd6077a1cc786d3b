"""γ_n and γ_t from the finite-element table, and the mean stress on sensors under any field of surface forces.

For a point force on the surface of the linear layer at the distance r̂ and the azimuth β from a sensor's centre
(Betti's theorem; stress tension-positive, F3 > 0 presses into the skin, F1 and F2 act on it along +x and +y):
    T̄ = −(3/2πh²) [F3 γ_n(r̂/h) − (F1 cos β + F2 sin β) γ_t(r̂/h)]
The layer is linear, so the stress under many forces is the sum over them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from underskin.surrogate.hdf5_format import INFLUENCE_SCHEMA, Table, tables_folder
from underskin.units import Floats, Mask

INFLUENCE_TABLE = "influence.h5"
_DEGREE = 5
_AXES = ("poisson_ratio", "slip", "rt_over_h", "r_over_h")


@dataclass(frozen=True)
class SensorStress:
    """Mean stress on each sensor, (sensors,).

    `stress` [Pa], tension positive; `error` [Pa], the contribution of the table, including the forces beyond its reach,
    which are neglected; `inside`: whether any force is within reach.
    """

    stress: Floats
    error: Floats
    inside: Mask


@dataclass(frozen=True)
class Influence:
    """γ_n and γ_t of one skin against r̂/h; NaN beyond `reach`.

    `normal_error`, `tangential_error`: bounds on the absolute errors of both. `normal_beyond`, `tangential_beyond`:
    bounds on |γ| beyond the reach.
    """

    rt_over_h: float
    reach: float
    normal_error: float
    tangential_error: float
    normal_beyond: float
    tangential_beyond: float
    _normal: BSpline
    _tangential: BSpline

    def gamma_n(self, offset: ArrayLike) -> Floats:
        """γ_n at r̂/h ≥ 0."""
        return self._evaluate(self._normal, offset)

    def gamma_t(self, offset: ArrayLike) -> Floats:
        """γ_t at r̂/h ≥ 0."""
        return self._evaluate(self._tangential, offset)

    def stress(self, thickness: float, sensors: Floats, places: Floats, forces: Floats) -> SensorStress:
        """Mean stress on `sensors` (sensors, 2) [m] under `forces` (points, 3) [N] at `places` (points, 2) [m].

        A force is (F1, F2, F3); a field of pressure is a point force for each point of a quadrature.
        """
        scale = 1.5 / np.pi / thickness**2
        normal, tangential = np.abs(forces[:, 2]), np.hypot(forces[:, 0], forces[:, 1])
        within_reach = normal * self.normal_error + tangential * self.tangential_error
        beyond = normal * self.normal_beyond + tangential * self.tangential_beyond
        stress, error = np.empty((2, len(sensors)))
        inside = np.full(len(sensors), len(places) == 0)  # without any load the stress is exactly 0
        for index, sensor in enumerate(sensors):
            away = (places - sensor) / thickness
            distance = np.hypot(away[:, 0], away[:, 1])
            near = distance <= self.reach
            stress[index] = -scale * self._on_sensor(away[near], distance[near], forces[near])
            error[index] = scale * np.where(near, within_reach, beyond).sum()
            inside[index] |= near.any()
        return SensorStress(stress, error, inside)

    def _on_sensor(self, away: Floats, distance: Floats, forces: Floats) -> float:
        """Σ F3 γ_n − F_outward γ_t over forces within reach, `away` from the sensor (points, 2) by `distance`."""
        total = float(forces[:, 2] @ self._normal(distance))
        if forces[:, :2].any():
            outward = (forces[:, :2] * away).sum(axis=1) / np.where(distance > 0, distance, 1.0)
            total -= float(outward @ self._tangential(distance))
        return total

    def _evaluate(self, spline: BSpline, offset: ArrayLike) -> Floats:
        r = np.asarray(offset, dtype=float)
        return np.where((r >= 0) & (r <= self.reach), spline(r), np.nan)


class InfluenceTable(Table):
    """A verified table of γ_n and γ_t."""

    schema = INFLUENCE_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        self.axes = tuple(data[f"influence/{name}"] for name in _AXES)
        self._values = [data[f"influence/{name}"] for name in ("gamma_n", "gamma_t")]
        self._errors = [data[f"influence/{name}_error"] for name in ("gamma_n", "gamma_t")]

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest poisson_ratio, slip, rt_over_h and r_over_h, limits included."""
        return {name: (float(axis[0]), float(axis[-1])) for name, axis in zip(_AXES, self.axes, strict=True)}

    def at(self, rt_over_h: float, poisson_ratio: float = 0.5, slip: float = 0.0) -> Influence | None:
        """The influence of one skin, or None outside the domain.

        `slip` = 1/(1 + κ) of the glue line, whose shear stress is κ (G/h) u_r: 0 bonded, 1 frictionless.
        """
        point = (poisson_ratio, slip, rt_over_h)
        if not all(axis[0] <= x <= axis[-1] for axis, x in zip(self.axes, point, strict=False)):
            return None
        curves, errors = self._values, self._errors
        for axis, x in zip(self.axes, point, strict=False):
            weights = interpolation_weights(axis, x)
            cell = int(np.clip(np.searchsorted(axis, x, side="right") - 1, 0, axis.size - 2))
            curves = [np.tensordot(weights, values, axes=1) for values in curves]
            errors = [values[cell : cell + 2].max(axis=0) for values in errors]
        r = self.axes[3]
        normal, tangential = (make_interp_spline(r, curve, k=_DEGREE) for curve in curves)
        last = r >= r[-1] - 1.0  # both decay in waves no longer than that
        normal_beyond, tangential_beyond = (float(np.abs(curve[last]).max()) for curve in curves)
        return Influence(
            rt_over_h=rt_over_h,
            reach=float(r[-1]),
            normal_error=float(errors[0]),
            tangential_error=float(errors[1]),
            normal_beyond=normal_beyond,
            tangential_beyond=tangential_beyond,
            _normal=normal,
            _tangential=tangential,
        )


def load_influence(path: Path | None = None) -> InfluenceTable:
    """The influence table at `path`, or the default one; raises TableError with the reason."""
    return InfluenceTable(path or tables_folder() / INFLUENCE_TABLE)


def interpolation_weights(nodes: Floats, x: float) -> Floats:
    """Weights of the values at the nodes in their interpolating spline of degree 5 (not-a-knot ends) at x."""
    return np.asarray(make_interp_spline(nodes, np.eye(nodes.size), k=_DEGREE)(x))
