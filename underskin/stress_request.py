"""What `POST /v1/stress` and `underskin stress` are asked, as the lab writes it, and their answer.

The skin's fields are named as in a campaign; x runs along its length, y along its width. Where both are given, the skin
is taken to be centred on the middle of the sensors' extent, and a load beside it is refused.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import orjson
from numpy.typing import NDArray

from underskin.errors import InvalidInput
from underskin.influence import InfluenceTable
from underskin.layer import slip
from underskin.recordings import fields as field
from underskin.recordings.campaign import Sensors
from underskin.recordings.fields import shown
from underskin.stress import Contact, Load, array_stress, charge, contact_load, map_points, pressure_map_load, together
from underskin.units import Floats, checked, to_lab, to_si

MOST_CONTACTS = 1000
MOST_PAIRS = 50_000_000  # of a sensor and a point force: about ten seconds
_WIDEST = 12.0  # thicknesses; no sensor is influenced from further away
_EVEN = 1e-6  # of a cell, how evenly the map's places must be spaced


@dataclass(frozen=True)
class LabContact:
    """A sphere pressed and dragged: forces on the skin along x and y, and into it."""

    x_mm: field.Number
    y_mm: field.Number
    indenter_radius_mm: field.Declared
    normal_force_n: field.Declared
    tangential_force_n: field.Position = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class PressureMap:
    """Pressure into the skin, a row for each y and a column for each x, constant around each place."""

    x_mm: field.Increasing
    y_mm: field.Increasing
    pressure_mpa: field.Rows


def _contacts(name: str, value: Any, units_checked: bool) -> tuple[LabContact, ...]:
    if not isinstance(value, list | tuple) or not 0 < len(value) <= MOST_CONTACTS:
        raise InvalidInput(name, shown(value), f"must be a list of 1 to {MOST_CONTACTS} contacts")
    return tuple(field.build(LabContact, f"{name}[{i}]", entry, units_checked) for i, entry in enumerate(value))


def _pressure_map(name: str, value: Any, units_checked: bool) -> PressureMap:
    found = field.build(PressureMap, name, value, units_checked)
    for axis, places in (("x_mm", found.x_mm), ("y_mm", found.y_mm)):
        steps = np.diff(places)
        if places.size < 2 or np.ptp(steps) > _EVEN * steps[0]:
            raise InvalidInput(f"{name}.{axis}", shown(places.tolist()), "must be two or more evenly spaced places")
    shape = (found.y_mm.size, found.x_mm.size)
    if found.pressure_mpa.shape != shape:
        rows, columns = found.pressure_mpa.shape
        allowed = f"must have a row for each y_mm ({shape[0]}) and a column for each x_mm ({shape[1]})"
        raise InvalidInput(f"{name}.pressure_mpa", f"{rows} rows, {columns} columns", allowed)
    row, column = np.unravel_index(int(np.argmin(found.pressure_mpa)), shape)
    if found.pressure_mpa[row, column] < 0:
        place = f"{name}.pressure_mpa[{row}][{column}]"
        raise InvalidInput(
            place, float(found.pressure_mpa[row, column]), "must be at least 0: a pressure does not pull"
        )
    return found


@dataclass(frozen=True, eq=False)
class StressRequest:
    """A skin, its sensors, and either `contacts` or a `pressure_map`.

    `glue_stiffness` κ [-]: shear stress at the base over (G/h) times the slip there; left out: bonded.
    """

    thickness_mm: field.Declared
    sensor_radius_mm: field.Declared
    d33_pc_per_n: field.Declared
    sensors: Sensors
    youngs_modulus_mpa: field.Declared | None = None
    poisson_ratio: field.PoissonRatio = 0.5
    glue_stiffness: field.NotNegative | None = None
    width_mm: field.Declared | None = None
    length_mm: field.Declared | None = None
    contacts: Annotated[tuple[LabContact, ...], _contacts] = ()
    pressure_map: Annotated[PressureMap | None, _pressure_map] = None


@dataclass(frozen=True)
class StressAnswer:
    """One entry a sensor; NaN where no load is within the table's reach (not `inside`)."""

    columns: Mapping[str, Floats]
    sensors: tuple[str, ...]
    inside: NDArray[np.bool_]
    reach_mm: float


def read_file(path: str) -> StressRequest:
    """The request in a JSON file (`-`: standard input); raises InvalidInput."""
    try:
        content = sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()
        document = orjson.loads(content)
    except (OSError, orjson.JSONDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InvalidInput("file", path, f"must be a readable JSON file ({reason})") from error
    return read_request(document)


def read_request(document: Any) -> StressRequest:
    """The request that a JSON document makes; raises InvalidInput at the first field that cannot be used."""
    given = dict(field.mapping("body", document))
    units_checked = field.flag("units_checked", given.pop("units_checked", False), False)
    values, refused = field.check_fields(StressRequest, given, units_checked=units_checked)
    if refused:
        raise refused[0]
    request = StressRequest(**values)
    if not request.sensors:
        raise InvalidInput("sensors", shown(request.sensors), "must hold at least one sensor")
    if bool(request.contacts) == (request.pressure_map is not None):
        allowed = "must be given, or pressure_map, but not both"
        raise InvalidInput("contacts", shown(request.contacts) if request.contacts else None, allowed)
    if request.contacts and request.youngs_modulus_mpa is None:
        raise InvalidInput("youngs_modulus_mpa", None, "is required with contacts, whose radii depend on it")
    return request


def answer(table: InfluenceTable, request: StressRequest) -> StressAnswer:
    """Charge and mean stress on every sensor; raises InvalidInput for loads beside the skin or over one another."""
    thickness, radius, d33 = (
        float(checked(name, getattr(request, name), units_checked=True))
        for name in ("thickness_mm", "sensor_radius_mm", "d33_pc_per_n")
    )
    sensors = to_si("x_mm", [[sensor.x_mm, sensor.y_mm] for sensor in request.sensors])
    load = _contacts_load(request, thickness) if request.contacts else _map_load(request, thickness)
    _refuse_many(request, len(load.places))
    glue = np.inf if request.glue_stiffness is None else request.glue_stiffness
    influence = table.at(radius / thickness, request.poisson_ratio, slip(glue))
    unknown = np.full(len(sensors), np.nan)
    stress, error, inside, reach = unknown, unknown, np.zeros(len(sensors), dtype=bool), np.nan
    if influence is not None:
        found = array_stress(influence, thickness, sensors, load)
        inside, reach = found.inside, influence.reach * thickness
        stress, error = (np.where(inside, values, np.nan) for values in (found.stress, found.error))
    columns = {
        "x_mm": to_lab("x_mm", sensors[:, 0]),
        "y_mm": to_lab("y_mm", sensors[:, 1]),
        "charge_pc": to_lab("charge_pc", charge(stress, d33, radius)),
        "charge_error_pc": to_lab("charge_error_pc", np.abs(charge(error, d33, radius))),
        "mean_stress_mpa": to_lab("mean_stress_mpa", 0.0 - stress),
    }
    names = tuple(sensor.id for sensor in request.sensors)
    return StressAnswer(columns, names, inside, float(to_lab("x_mm", reach)))


def _contacts_load(request: StressRequest, thickness: float) -> Load:
    modulus = float(to_si("youngs_modulus_mpa", request.youngs_modulus_mpa or np.nan))
    contacts = [
        Contact(
            float(to_si("x_mm", contact.x_mm)),
            float(to_si("x_mm", contact.y_mm)),
            float(to_si("indenter_radius_mm", contact.indenter_radius_mm)),
            (*contact.tangential_force_n, contact.normal_force_n),
        )
        for contact in request.contacts
    ]
    places = np.array([[contact.x, contact.y] for contact in contacts])
    _refuse_beside_skin(request, "contacts", places)
    radii = np.array([contact.radius(modulus, request.poisson_ratio) for contact in contacts])
    _refuse_wide(request, radii, thickness)
    _refuse_overlap(places, radii)
    return together([contact_load(contact, a, thickness) for contact, a in zip(contacts, radii, strict=True)])


def _map_load(request: StressRequest, thickness: float) -> Load:
    found = request.pressure_map
    assert found is not None
    x, y = to_si("x_mm", found.x_mm), to_si("x_mm", found.y_mm)
    row, column = np.nonzero(found.pressure_mpa)
    _refuse_beside_skin(request, "pressure_map", np.stack([x[column], y[row]], axis=-1))
    pressure = to_si("pressure_mpa", found.pressure_mpa)
    _refuse_many(request, map_points(x, y, pressure, thickness))
    return pressure_map_load(x, y, pressure, thickness)


def _refuse_many(request: StressRequest, points: int) -> None:
    if len(request.sensors) * points > MOST_PAIRS:
        allowed = f"sensors times points of the load must be at most {MOST_PAIRS}: send fewer, or coarser, at a time"
        raise InvalidInput("sensors", f"{len(request.sensors)} sensors, {points} points", allowed)


def _refuse_wide(request: StressRequest, radii: Floats, thickness: float) -> None:
    """Refuse contacts that Hertz cannot mean: wider than their sphere, or than the skin's influence reaches."""
    for index, (contact, a) in enumerate(zip(request.contacts, radii, strict=True)):
        widest = min(float(to_si("x_mm", contact.indenter_radius_mm)), _WIDEST * thickness)
        if a >= widest:
            allowed = (
                f"must press less: the contact's radius by Hertz, {to_lab('x_mm', a):.3g} mm, must be below the "
                f"sphere's and {_WIDEST:g} thicknesses, {to_lab('x_mm', widest):.3g} mm; is the modulus in MPa?"
            )
            raise InvalidInput("contacts", contact.normal_force_n, allowed, index)


def _refuse_beside_skin(request: StressRequest, name: str, places: Floats) -> None:
    """Refuse loads beside the skin, as far as its length and width are known."""
    sensors = np.array([[sensor.x_mm, sensor.y_mm] for sensor in request.sensors])
    middle = (sensors.min(axis=0) + sensors.max(axis=0)) / 2
    for axis, extent in enumerate(("length_mm", "width_mm")):
        size = getattr(request, extent)
        if size is None:
            continue
        away = to_lab("x_mm", places[:, axis]) - middle[axis]
        beside = np.abs(away) > size / 2 * (1 + 1e-9)
        if beside.any():
            first = int(np.argmax(beside))
            low, high = middle[axis] - size / 2, middle[axis] + size / 2
            allowed = f"must lie on the skin, {'xy'[axis]} from {low:g} to {high:g} mm ({extent} {size:g})"
            value = f"{'xy'[axis]} = {away[first] + middle[axis]:g} mm"
            raise InvalidInput(name, value, allowed, index=first if name == "contacts" else None)


def _refuse_overlap(places: Floats, radii: Floats) -> None:
    distance = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    apart = radii[:, None] + radii
    first, second = np.nonzero(np.triu(distance < apart, 1))
    if first.size:
        i, j = int(first[0]), int(second[0])
        gap, least = to_lab("x_mm", distance[i, j]), to_lab("x_mm", apart[i, j])
        allowed = f"must not overlap contact {i}: the centres are {gap:.4g} mm apart, the radii add to {least:.4g} mm"
        raise InvalidInput("contacts", f"contact {j}", allowed, index=j)
