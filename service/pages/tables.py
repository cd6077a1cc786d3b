"""The tables in use: content, range, error and origin of each."""

from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from fastapi import APIRouter, Request, Response

from service.dependencies import Table
from service.pages.shared import same_request
from service.pages.shared.html import page
from service.pages.shared.skin_values import PROTOTYPE
from service.schemas.tables import TableAxis, TableEntry
from service.usecases.tables import tables
from underskin.surrogate.hdf5_format import CONTACT_TABLE
from underskin.surrogate.influence_table import INFLUENCE_TABLE
from underskin.surrogate.sigma_table import SIGMA_TABLE

router = APIRouter(prefix="/tables")

# Of each table: its file, a title, its content.
_HELD = {
    "sigma": (
        SIGMA_TABLE,
        "Transmission factor σ",
        "A sphere above the sensor's centre, its pressure after Hertz: σ, from which FRF and d33 follow.",
    ),
    "influence": (
        INFLUENCE_TABLE,
        "Influence γ",
        "A point load anywhere on top, pressing or dragging, on a layer that deforms little: several loads add up.",
    ),
    "contact": (
        CONTACT_TABLE,
        "Contact of a sphere",
        "A sphere that sinks deep: what finite strain adds to σ, contact radius and depth. No answer uses it yet.",
    ),
}
# Words of an axis, and its quantity on the paper's prototype in lab units: symbol, factor, unit.
_H, _RT, _E = (PROTOTYPE[name] for name in ("thickness_mm", "sensor_radius_mm", "youngs_modulus_mpa"))
_R = PROTOTYPE["indenter_radius_mm"]
_AXES = {
    "a_over_h": ("contact radius a over thickness, a/h", "a", _H, "mm"),
    "rt_over_h": ("sensor radius over thickness, rT/h", "rT", _H, "mm"),
    "load_parameter": ("load parameter, L = F/(R²E)", "F", _R**2 * _E, "N"),
    "r_over_h": ("distance of the load from the sensor's centre over thickness, r/h", "r", _H, "mm"),
    "poisson_ratio": ("Poisson's ratio ν", "", 0.0, ""),
    "slip": ("slip of the glue line: 0 bonded, 1 frictionless", "", 0.0, ""),
}
_MADE = {
    "material": "material",
    "mesh": "elements",
    "solver": "solver",
    "force_balance_error": "the base bears the force, but for a relative",
    "tablegen_sources_sha256": "SHA-256 of the sources",
}


class DescribedTable(TableEntry):
    """One table in words."""

    title: str
    holds: str
    domain: list[tuple[str, TableAxis, str]]  # words, the axis, its quantity on the prototype
    errors: list[tuple[str, float, float]]  # quantity, median and largest
    made: list[tuple[str, Any]]
    versions: str


@router.get("")
def view(request: Request, table: Table) -> Response:
    """What `GET /v1/tables` says, and the errors that the files hold."""
    folder = request.app.state.settings.tables
    return page(
        request,
        "tables.html",
        tables=[_described(folder, tabulated) for tabulated in tables(table, folder).tables],
        prototype=f"h {_H:g} mm, E {_E:g} MPa, a sphere of R {_R:g} mm",
        same=same_request.get(request, "/v1/tables", "client.tables()"),
    )


def _described(folder: Path, tabulated: TableEntry) -> DescribedTable:
    file, title, holds = _HELD[tabulated.name]
    versions = {name.removeprefix("version_"): value for name, value in tabulated.about.items() if "version_" in name}
    return DescribedTable(
        **tabulated.model_dump(),
        title=title,
        holds=holds,
        domain=[(_AXES[axis.name][0], axis, _in_lab_units(axis)) for axis in tabulated.axes],
        errors=_errors(folder / file),
        made=[(words, tabulated.about[name]) for name, words in _MADE.items() if name in tabulated.about],
        versions=", ".join(f"{name} {value}" for name, value in versions.items()),
    )


def _in_lab_units(axis: TableAxis) -> str:
    """The range on the prototype; empty where the axis has none."""
    _, symbol, factor, unit = _AXES[axis.name]
    return f"{symbol} {factor * axis.low:.3g} to {factor * axis.high:.3g} {unit}" if symbol else ""


@cache
def _errors(file: Path) -> list[tuple[str, float, float]]:
    """Of each estimate of an error that a table's file holds: of what, and its median and largest over the domain."""
    errors = []
    with h5py.File(file) as table:
        for group in table.values():
            for name, values in group.items():
                if name.endswith("_error"):
                    sizes = np.abs(values[()])
                    words = f"{name.removesuffix('_error')}: {values.attrs['long_name']}".replace("_", " ")
                    errors.append((words, float(np.median(sizes)), float(sizes.max())))
    return errors
