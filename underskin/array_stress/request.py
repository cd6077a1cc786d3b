"""The request of `POST /v1/stress` and `underskin stress`, in lab units.

The skin's fields are named as in a campaign; x runs along its length, y along its width.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast, get_args

import numpy as np

from underskin import errors
from underskin.array_stress import pressure_map
from underskin.errors import ErrorCode, InvalidInput, Mention, Requirement
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings import validation as field
from underskin.recordings.campaign import Sensors
from underskin.recordings.readers import json_file
from underskin.recordings.validation import shown
from underskin.surrogate.sigma_table import ContactName
from underskin.units import Floats

MOST_CONTACTS = 1000
_EVEN = 1e-6  # of a cell: largest deviation of the map's positions from even spacing
_MOST_NAMED = 5  # rejected cells of a map that are listed


@dataclass(frozen=True)
class LabContact:
    """A sphere that is pressed and dragged: forces on the skin along x and y, and into it."""

    x_mm: field.Number
    y_mm: field.Number
    indenter_radius_mm: field.Declared
    normal_force_n: field.Declared
    tangential_force_n: field.Position = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class PressureMap:
    """Pressure into the skin, a row for each y and a column for each x, constant in the cell around each position."""

    x_mm: field.Increasing
    y_mm: field.Increasing
    pressure_mpa: field.Rows


def _contacts(name: str, value: Any, units_checked: bool) -> tuple[LabContact, ...]:
    if not isinstance(value, list | tuple) or not 0 < len(value) <= MOST_CONTACTS:
        allowed = Requirement(f"must be a list of 1 to {MOST_CONTACTS} ", Mention("contacts"))
        raise errors.wrong_type(name, shown(value), allowed)
    return tuple(field.build(LabContact, f"{name}[{i}]", document, units_checked) for i, document in enumerate(value))


def _pressure_map(name: str, value: Any, units_checked: bool) -> PressureMap:
    result = field.build(PressureMap, name, value, units_checked)
    for axis, positions in (("x_mm", result.x_mm), ("y_mm", result.y_mm)):
        steps = np.diff(positions)
        if positions.size < 2 or np.ptp(steps) > _EVEN * steps[0]:
            raise InvalidInput(f"{name}.{axis}", shown(positions.tolist()), "must be two or more evenly spaced places")
    shape = (result.y_mm.size, result.x_mm.size)
    if result.pressure_mpa.shape != shape:
        rows, columns = result.pressure_mpa.shape
        allowed = f"must have a row for each y_mm ({shape[0]}) and a column for each x_mm ({shape[1]})"
        sizes = f"{rows} rows, {columns} columns"
        raise InvalidInput(f"{name}.pressure_mpa", sizes, allowed, code=ErrorCode.UNEQUAL_LENGTHS)
    _refuse_pull(f"{name}.pressure_mpa", result.pressure_mpa)
    return result


def _contact(name: str, value: Any, _: bool) -> ContactName:
    if value not in get_args(ContactName):
        raise errors.not_one_of(name, shown(value), get_args(ContactName))
    return cast(ContactName, value)


def _refuse_pull(name: str, pressure: Floats) -> None:
    """Reject negative cells, and list the first ones."""
    cells = np.argwhere(pressure < 0)
    if cells.size:
        first, *others = [f"[{row}][{column}]" for row, column in cells[:_MOST_NAMED]]
        more = f" and {len(cells) - _MOST_NAMED} more" if len(cells) > _MOST_NAMED else ""
        also = f"; so are {', '.join(others)}{more}" if others else ""
        allowed = f"must be at least 0: a pressure does not pull{also}"
        raise errors.out_of_range(name + first, float(pressure[tuple(cells[0])]), allowed)


@dataclass(frozen=True, eq=False)
class LoadCase:
    """A skin, its sensors, and either `contacts` or a `pressure_map`.

    `glue_stiffness` κ [-]: shear stress at the base over (G/h) times the slip there; None: bonded. `contact`: `paper`
    for small strain; `solved` with the effect of finite strain beneath contacts on a bonded incompressible layer.
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
    contact: Annotated[ContactName, _contact] = "paper"


def read_file(path: str, map_path: str | None = None) -> LoadCase:
    """The request in a JSON file (`-`: standard input), with the pressure map of a CSV file.

    Raises InvalidInput, or FileError that names line and column of what is not JSON.
    """
    try:
        content = sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()
    except OSError as error:
        raise errors.unreadable("file", path, f"must be a readable JSON file ({error.strerror})") from error
    document = json_file.document(content, path)
    if map_path is not None:
        if field.mapping("body", document).get("pressure_map") is not None:
            raise errors.not_unique("pressure_map", map_path, f"is in {path} already; give it once")
        document = {**document, "pressure_map": _map_in_file(map_path)}
    return read_request(document)


def _map_in_file(path: str) -> dict[str, Any]:
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise errors.unreadable("pressure_map", path, f"must be a readable CSV file ({error.strerror})") from error
    return pressure_map.parse(content, path)


def read_request(document: Any) -> LoadCase:
    """The request of a JSON document; raises InvalidInput for the first invalid field."""
    fields = dict(field.mapping("body", document))
    units_checked = field.flag("units_checked", fields.pop("units_checked", False), False)
    values, refused = field.check_fields(LoadCase, fields, units_checked=units_checked)
    if refused:
        raise refused[0]
    request = LoadCase(**values)
    if not request.sensors:
        raise errors.too_few("sensors", shown(request.sensors), "must hold at least one sensor")
    if bool(request.contacts) == (request.pressure_map is not None):
        allowed = Requirement("must be given, or ", Mention("pressure_map"), ", but not both")
        if not request.contacts:
            raise errors.required("contacts", allowed)
        raise errors.conflicting("contacts", shown(request.contacts), allowed)
    if request.contacts and request.youngs_modulus_mpa is None:
        allowed = Requirement("is required with ", Mention("contacts"), ", whose radii depend on it")
        raise errors.required("youngs_modulus_mpa", allowed)
    if request.contact == "solved":
        _require_solvable(request)
    return request


def _require_solvable(request: LoadCase) -> None:
    """Raise InvalidInput for loads or layers that the solved contact does not support."""
    if request.pressure_map is not None:
        raise errors.conflicting("contact", request.contact, "must be 'paper' with a pressure_map: it has no contact")
    if request.poisson_ratio != INCOMPRESSIBLE:
        raise errors.out_of_range("poisson_ratio", request.poisson_ratio, "must be 0.5 with contact 'solved'")
    if request.glue_stiffness is not None:
        allowed = "must be left out with contact 'solved', which is of a bonded layer"
        raise errors.conflicting("glue_stiffness", request.glue_stiffness, allowed)
