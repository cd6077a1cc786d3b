"""The paper's prototype, and the predictions of each model of the skin for its sensors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tablegen import linear_layer
from underskin.physics import half_space, hertz
from underskin.physics.charge_response import Indenter, Skin
from underskin.prediction.pressed_skin import transmission
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab, to_si

THICKNESS_MM = 2.5
MODULUS_MPA = 16.0
SENSOR_RADIUS_MM = 1.5
PITCH_MM = 8.0
INDENTERS_MM = (4.0, 10.0)
PRELOADS_N = (0.5, 1.0, 2.0, 3.0)
DYNAMIC_FORCE_N = 0.09
BEST_FIT_D33_PC_PER_N = 14.0
ARRAY = ((41, 3.0, 22.0), (12, 1.0, 14.0))  # sensors, preload [N], the d33 that fits them [pC/N]
LINEAR_UP_TO_MPA = 2.0
FLAT_UP_TO_HZ = 130.0
CYLINDER_DIAMETER_MM, CYLINDER_HEIGHT_MM = 4.0, 2.5

SKIN = Skin.from_lab(thickness_mm=THICKNESS_MM, youngs_modulus_mpa=MODULUS_MPA, sensor_radius_mm=SENSOR_RADIUS_MM)
RHO = float(SKIN.rt_over_h)


@dataclass(frozen=True)
class Press:
    """One sphere at several preloads (arrays over the preloads): Hertz, L, and σ by three models of the skin."""

    indenter_radius_mm: float
    preload_n: Floats
    contact_radius_mm: Floats
    a_over_h: Floats
    load_parameter: Floats
    peak_pressure_mpa: Floats
    mean_stress_mpa: Floats
    half_space: Floats
    linear: Floats
    table: Floats
    table_error: Floats


def press(
    table: SigmaTable, indenter_radius_mm: float, preload_n: ArrayLike, youngs_modulus_mpa: float = MODULUS_MPA
) -> Press:
    """The prototype under a sphere, or one of another modulus."""
    preload = np.asarray(preload_n, dtype=float)
    skin = Skin.from_lab(
        thickness_mm=THICKNESS_MM, youngs_modulus_mpa=youngs_modulus_mpa, sensor_radius_mm=SENSOR_RADIUS_MM
    )
    response = transmission(table, skin, Indenter.from_lab(indenter_radius_mm=indenter_radius_mm), preload)
    return Press(
        indenter_radius_mm=indenter_radius_mm,
        preload_n=preload,
        contact_radius_mm=to_lab("contact_radius_mm", response.contact_radius),
        a_over_h=response.a_over_h,
        load_parameter=response.load_parameter,
        peak_pressure_mpa=to_lab("mean_stress_mpa", hertz.peak_pressure(preload, response.contact_radius)),
        mean_stress_mpa=to_lab("mean_stress_mpa", response.mean_stress),
        half_space=half_space.sigma(response.a_over_h, RHO),
        linear=linear_layer.sigma(response.a_over_h, RHO),
        table=response.sigma,
        table_error=response.rel_error,
    )


def preload_at_peak_pressure(indenter_radius_mm: float, pressure_mpa: float) -> float:
    """The preload [N] at which the Hertz pressure's peak reaches `pressure_mpa`; q0 grows like F^(1/3)."""
    radius = Indenter.from_lab(indenter_radius_mm=indenter_radius_mm).radius
    peak_at_one_newton = hertz.peak_pressure(1.0, hertz.contact_radius(1.0, radius, SKIN.youngs_modulus))
    return float((to_si("mean_stress_mpa", pressure_mpa) / peak_at_one_newton) ** 3)
