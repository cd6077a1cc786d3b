"""Charge and mean stress on every sensor of an array: the answer of `POST /v1/stress` and `underskin stress`."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from underskin.array_stress import load_integration as integration
from underskin.array_stress.load_integration import Load, finite_strain
from underskin.array_stress.request import LoadCase
from underskin.array_stress.validation import findings, refuse_coarse, refuse_many, refuse_off_skin, refuse_overlap
from underskin.errors import Mention, Requirement, out_of_range
from underskin.findings.finding import Finding
from underskin.physics.contact_pressure import MOST_A_OVER_H, SpherePressure, sphere_pressures
from underskin.physics.elastic_layer import Layer, slip
from underskin.surrogate.hdf5_format import CONTACT_TABLE
from underskin.surrogate.influence_table import Influence, InfluenceTable
from underskin.surrogate.solved_contact import solved_contact
from underskin.units import Floats, Mask, checked, to_lab, to_si


@dataclass(frozen=True)
class ArrayStress:
    """Charge and stress of every sensor.

    Attributes
    ----------
    columns : mapping
        Lab-unit columns by field name, each (sensors,); NaN where a sensor is not `inside`.
    inside : ndarray of bool, (sensors,)
        False where no load is within the table's range, or numbers overflow.
    contact_radius_mm : ndarray, (contacts,)
        Empty for a map.
    """

    columns: Mapping[str, Floats]
    sensors: tuple[str, ...]
    inside: Mask
    reach_mm: float
    contact_radius_mm: Floats
    findings: list[Finding]

    @property
    def limits(self) -> list[str | None] | None:
        """For each sensor outside, that no load is near enough; None where all are inside."""
        far = f"no load within {self.reach_mm:g} mm"
        return None if self.inside.all() else [None if inside else far for inside in self.inside.tolist()]


def answer(table: InfluenceTable, request: LoadCase) -> ArrayStress:
    """Charge and mean stress on every sensor.

    Raises
    ------
    InvalidInput
        For a skin outside the table, for loads off the skin, overlapping or too wide, and for too large a request.
    """
    thickness, radius, d33 = (
        float(checked(name, getattr(request, name), units_checked=True))
        for name in ("thickness_mm", "sensor_radius_mm", "d33_pc_per_n")
    )
    influence = _influence(table, request, radius / thickness)
    sensors = to_si("x_mm", [[sensor.x_mm, sensor.y_mm] for sensor in request.sensors])
    pressures = _pressures(request, thickness)
    loads = [_contacts_load(request, pressures, thickness)] if request.contacts else _map_loads(request, thickness)
    total = integration.array_stress(influence, thickness, sensors, loads)
    radii = np.array([pressure.radius for pressure in pressures])
    if request.contact == "solved":
        added, added_error, radii = finite_strain(solved_contact(table.path.parent / CONTACT_TABLE), request, sensors)
        total = replace(total, stress=total.stress + added, error=total.error + added_error)
    inside = total.inside & np.isfinite(total.stress)
    stress, error = (np.where(inside, values, np.nan) for values in (total.stress, total.error))
    charge = d33 * np.pi * radius**2  # [C/Pa]
    columns = {
        "x_mm": to_lab("x_mm", sensors[:, 0]),
        "y_mm": to_lab("y_mm", sensors[:, 1]),
        "charge_pc": to_lab("charge_pc", 0.0 - charge * stress),  # no load is 0, not −0
        "charge_error_pc": to_lab("charge_error_pc", np.abs(charge * error)),
        "mean_stress_mpa": to_lab("mean_stress_mpa", 0.0 - stress),
    }
    return ArrayStress(
        columns=columns,
        sensors=tuple(sensor.id for sensor in request.sensors),
        inside=inside,
        reach_mm=float(to_lab("x_mm", influence.reach * thickness)),
        contact_radius_mm=to_lab("x_mm", radii),
        findings=findings(request),
    )


@dataclass(frozen=True)
class BaseStress:
    """The normal stress on the base under all loads, on a grid.

    Attributes
    ----------
    x_mm, y_mm : ndarray, (columns,) and (rows,)
        Places of the grid in the sensors' frame.
    sigma_zz_mpa : ndarray, (rows, columns)
        Tension positive; 0 where no load is within the table's range.
    contact_radius_mm : ndarray, (contacts,)
    """

    x_mm: Floats
    y_mm: Floats
    sigma_zz_mpa: Floats
    contact_radius_mm: Floats


def base_stress(table: InfluenceTable, request: LoadCase, x_mm: Floats, y_mm: Floats) -> BaseStress:
    """The normal stress on the base under contacts, at the points of a grid: the linear layer's, as for point sensors.

    Parameters and errors as in `answer`; `x_mm` (columns,) and `y_mm` (rows,) are the places of the grid.
    """
    thickness = float(checked("thickness_mm", request.thickness_mm, units_checked=True))
    influence = _influence(table, request, 0.0)
    pressures = _pressures(request, thickness)
    _contacts_load(request, pressures, thickness)  # raises where contacts overlap or lie off the skin
    x, y = np.meshgrid(to_si("x_mm", x_mm), to_si("x_mm", y_mm))
    stress = np.zeros(x.shape)
    for contact, pressure in zip(request.contacts, pressures, strict=True):
        away = x - to_si("x_mm", contact.x_mm), y - to_si("x_mm", contact.y_mm)
        forces = (*contact.tangential_force_n, contact.normal_force_n)
        stress += integration.stress_around(influence, thickness, pressure, forces, away)
    return BaseStress(
        x_mm=x_mm,
        y_mm=y_mm,
        sigma_zz_mpa=to_lab("sigma_zz_mpa", stress),
        contact_radius_mm=to_lab("x_mm", [pressure.radius for pressure in pressures]),
    )


def _influence(table: InfluenceTable, request: LoadCase, rt_over_h: float) -> Influence:
    """The influence functions of the skin; InvalidInput where the table has none."""
    low, high = table.domain["poisson_ratio"]
    if not low <= request.poisson_ratio <= high:
        allowed = f"must be {low:g} to {high:g}: the table of influences holds no other"
        raise out_of_range("poisson_ratio", request.poisson_ratio, allowed)
    low, high = table.domain["rt_over_h"]
    glue = np.inf if request.glue_stiffness is None else request.glue_stiffness
    influence = table.at(rt_over_h, request.poisson_ratio, slip(glue))
    if influence is None:
        thickness = f" ({request.thickness_mm:g}): the table's range"
        allowed = Requirement(f"must be {low:g} to {high:g} times ", Mention("thickness_mm"), thickness)
        raise out_of_range("sensor_radius_mm", request.sensor_radius_mm, allowed)
    return influence


def _pressures(request: LoadCase, thickness: float) -> list[SpherePressure]:
    """Pressures of the contacts; InvalidInput for those too wide for a linear layer."""
    if not request.contacts:
        return []
    glue = np.inf if request.glue_stiffness is None else request.glue_stiffness
    modulus = float(to_si("youngs_modulus_mpa", request.youngs_modulus_mpa or np.nan))
    radii = to_si("indenter_radius_mm", [contact.indenter_radius_mm for contact in request.contacts])
    forces = to_si("normal_force_n", [contact.normal_force_n for contact in request.contacts])
    layer = Layer(request.poisson_ratio, slip(glue))
    pressures = []
    for index, pressure in enumerate(sphere_pressures(layer, thickness, modulus, radii, forces)):
        if pressure is None or pressure.radius >= radii[index]:
            allowed = (
                f"must press less: the contact must be smaller than its sphere and {MOST_A_OVER_H:g} thicknesses; "
                "is the modulus in MPa?"
            )
            raise out_of_range(f"contacts[{index}].normal_force_n", request.contacts[index].normal_force_n, allowed)
        pressures.append(pressure)
    return pressures


def _contacts_load(request: LoadCase, pressures: list[SpherePressure], thickness: float) -> Load:
    positions = to_si("x_mm", [[contact.x_mm, contact.y_mm] for contact in request.contacts])
    radii = np.array([pressure.radius for pressure in pressures])
    refuse_off_skin(request, positions, radii[:, None], "contacts[{}]".format)
    refuse_overlap(positions, radii)
    load = integration.combined(
        [
            integration.contact_load(centre, (*contact.tangential_force_n, contact.normal_force_n), pressure, thickness)
            for centre, contact, pressure in zip(positions, request.contacts, pressures, strict=True)
        ]
    )
    refuse_many(request, len(load.positions))
    return load


def _map_loads(request: LoadCase, thickness: float) -> Iterable[Load]:
    pressure_map = request.pressure_map
    assert pressure_map is not None
    x, y = to_si("x_mm", pressure_map.x_mm), to_si("x_mm", pressure_map.y_mm)
    pressure = to_si("pressure_mpa", pressure_map.pressure_mpa)
    refuse_coarse(x, y, thickness)
    row, column = np.nonzero(pressure)
    half = np.array([x[1] - x[0], y[1] - y[0]]) / 2
    refuse_off_skin(
        request,
        np.stack([x[column], y[row]], axis=-1),
        half,
        lambda cell: f"pressure_map.pressure_mpa[{row[cell]}][{column[cell]}]",
    )
    refuse_many(request, integration.map_points(x, y, pressure, thickness))
    return integration.pressure_map_loads(x, y, pressure, thickness)
