"""A skin before it is built: transmission, spatial resolution, two-point separation."""

from typing import Any

import numpy as np

from service.schemas.design import DesignAnswer, DesignRequest, ResponseAnswer, SweepAnswer
from underskin import Indenter, Skin
from underskin.errors import out_of_range
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.prediction.answers import OTHER, STATED, limits_of_pressed
from underskin.prediction.pressed_skin import transmission
from underskin.prediction.skin_design import Design, design
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import checked, to_lab


def design_of(table: SigmaTable, request: DesignRequest) -> Design:
    """The design that is asked for; raises InvalidInput."""
    skin, indenter, preload = _pressed(request)
    require_apart(request.pitch_mm, request.sensor_radius_mm)
    contact = contact_model(table, request.contact)
    return design(contact, skin, indenter, preload, request.pitch_mm * 1e-3, request.dip_percent / 100)


def _pressed(request: DesignRequest) -> tuple[Skin, Indenter, float]:
    values = {name: getattr(request, name) for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm")}
    skin = Skin.from_lab(**values, units_checked=request.units_checked)
    indenter = Indenter.from_lab(indenter_radius_mm=request.indenter_radius_mm, units_checked=request.units_checked)
    return skin, indenter, float(checked("preload_n", request.preload_n, units_checked=request.units_checked))


def other_sigma(table: SigmaTable, request: DesignRequest, answer: DesignAnswer) -> float | None:
    """σ by the other contact model, where it differs by more than 1 %; None elsewhere."""
    if answer.sigma is None:
        return None
    sigma = float(transmission(contact_model(table, OTHER[request.contact]), *_pressed(request)).sigma)
    return sigma if abs(sigma / answer.sigma - 1) > STATED else None


def require_apart(pitch_mm: float, sensor_radius_mm: float) -> None:
    """Raises InvalidInput where sensors would overlap."""
    if pitch_mm < 2 * sensor_radius_mm:
        allowed = f"must be at least {2 * sensor_radius_mm:g} mm, the diameter of a sensor: they cannot overlap"
        raise out_of_range("pitch_mm", pitch_mm, allowed)


def design_answer(table: SigmaTable, request: DesignRequest, designed: Design) -> DesignAnswer:
    """A design in lab units."""
    contact, resolution = designed.contact, designed.resolution
    values = {"preload_n": np.array(request.preload_n), "poisson_ratio": np.array(INCOMPRESSIBLE)}
    used = contact_model(table, request.contact)
    limits = limits_of_pressed(used, contact, values, contact.inside, 1)
    frf = None
    if request.d33_pc_per_n is not None:
        d33 = checked("d33_pc_per_n", request.d33_pc_per_n, units_checked=request.units_checked)
        frf = _number(to_lab("frf_pc_per_n", contact.frf(d33)))
    return DesignAnswer(
        contact=used.name,
        table_sha256=used.sha256,
        limit=None if limits is None else limits[0],
        status="ok" if bool(contact.inside) else "out_of_domain",
        contact_radius_mm=float(to_lab("contact_radius_mm", contact.contact_radius)),
        a_over_h=float(contact.a_over_h),
        rt_over_h=float(contact.rt_over_h),
        load_parameter=float(contact.load_parameter),
        sigma=_number(contact.sigma),
        rel_error=_number(contact.rel_error),
        gamma=_number(designed.gamma),
        mean_stress_mpa=_number(to_lab("mean_stress_mpa", contact.mean_stress)),
        frf_pc_per_n=frf,
        resolution_mm=_number(to_lab("x_mm", resolution.width)),
        response_between_percent=_number(100 * resolution.between),
        response_amid_percent=_number(100 * resolution.amid),
        two_point_separation_mm=_number(to_lab("x_mm", resolution.separation)),
        two_point_best_mm=_number(to_lab("x_mm", resolution.best_separation)),
        response=ResponseAnswer(
            offset_mm=to_lab("x_mm", designed.offset).tolist(),
            sigma=_numbers(designed.response),
            gamma=_numbers(designed.point_response),
        ),
        sweeps=[
            SweepAnswer(
                axis=sweep.axis, value=sweep.values.tolist(), sigma=_numbers(sweep.sigma), gamma=_numbers(sweep.gamma)
            )
            for sweep in designed.sweeps
        ],
    )


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def _numbers(values: Any) -> list[float | None]:
    return [_number(value) for value in values.tolist()]
