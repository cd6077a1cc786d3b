"""The models of UM-Bridge: each takes one vector and returns one number, with its gradient.

`sigma` of [a_over_h, rt_over_h, load_parameter]; `frf` in pC/N of [thickness_mm, youngs_modulus_mpa, sensor_radius_mm,
indenter_radius_mm, preload_n, d33_pc_per_n], incompressible.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from underskin import Indenter, InvalidInput, Skin
from underskin.errors import out_of_range
from underskin.prediction.pressed_skin import frf_gradient, transmission
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import LAB, Floats, checked, to_lab


@dataclass(frozen=True)
class UmbridgeModel:
    """A function of one vector: its value, and its gradient."""

    inputs: tuple[str, ...]
    value: Callable[[SigmaTable, Sequence[float]], float]
    gradient: Callable[[SigmaTable, Sequence[float]], Floats]


def _sigma(table: SigmaTable, point: Sequence[float]) -> float:
    value = table.at(*point) if min(point) >= 0 else None
    if value is None:
        raise _outside(table)
    return value[0]


def _sigma_gradient(table: SigmaTable, point: Sequence[float]) -> Floats:
    _sigma(table, point)
    return np.array(table.gradient(*point))


def _pressed(point: Sequence[float]) -> tuple[Skin, Indenter, Floats, Floats]:
    thickness, modulus, sensor_radius, indenter_radius, preload, d33 = point
    skin = Skin.from_lab(thickness_mm=thickness, youngs_modulus_mpa=modulus, sensor_radius_mm=sensor_radius)
    indenter = Indenter.from_lab(indenter_radius_mm=indenter_radius)
    return skin, indenter, checked("preload_n", preload), checked("d33_pc_per_n", d33)


def _frf(table: SigmaTable, point: Sequence[float]) -> float:
    skin, indenter, preload, d33 = _pressed(point)
    value = float(to_lab("frf_pc_per_n", transmission(table, skin, indenter, preload).frf(d33)))
    if math.isnan(value):
        raise _outside(table)
    return value


def _frf_gradient(table: SigmaTable, point: Sequence[float]) -> Floats:
    _frf(table, point)
    skin, indenter, preload, d33 = _pressed(point)
    slopes = frf_gradient(table, skin, indenter, preload, d33)
    return np.array([to_lab("frf_pc_per_n", slopes[_bare(name)]) * LAB[name].to_si for name in _FRF_INPUTS])


def _bare(name: str) -> str:
    """A lab field's name without its unit, as the library names the quantity."""
    return {"d33_pc_per_n": "d33"}.get(name, name.rsplit("_", 1)[0])


_SIGMA_INPUTS = ("a_over_h", "rt_over_h", "load_parameter")
_FRF_INPUTS = (
    "thickness_mm",
    "youngs_modulus_mpa",
    "sensor_radius_mm",
    "indenter_radius_mm",
    "preload_n",
    "d33_pc_per_n",
)
MODELS = {
    "sigma": UmbridgeModel(_SIGMA_INPUTS, _sigma, _sigma_gradient),
    "frf": UmbridgeModel(_FRF_INPUTS, _frf, _frf_gradient),
}


def _outside(table: SigmaTable) -> InvalidInput:
    domain = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in table.domain.items())
    return out_of_range("input", "outside the domain", f"must lie inside {domain}")
