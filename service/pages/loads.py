"""Several loads on an array, and the charge on each of its sensors."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response

from service.dependencies import Store
from service.more_tables import influence_table
from service.pages import requests
from service.pages.figures import csv_answer, drawn
from service.pages.html import page
from service.store import campaigns, skins
from service.store.engine import Database
from underskin import InvalidInput, UnderskinError
from underskin.stress_answer import StressAnswer, answer
from underskin.stress_request import read_request

router = APIRouter(prefix="/loads")

_MOST_SENSORS = 10_000
_LONGEST = 20_000  # characters of the loads
# Field, words, unit, the paper's prototype.
FIELDS = (
    ("thickness_mm", "thickness h", "mm", 2.5),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa", 16.0),
    ("sensor_radius_mm", "sensor radius rT", "mm", 1.5),
    ("d33_pc_per_n", "d33", "pC/N", 14.0),
    ("poisson_ratio", "Poisson's ratio ν", "", 0.5),
)
GRID = (("columns", "sensors along x", "", 4), ("rows", "sensors along y", "", 4), ("pitch_mm", "pitch", "mm", 8.0))
_LOADS = "10 8 4 1\n14 16 10 3 0.5 0"
_ORDER = ("x_mm", "y_mm", "indenter_radius_mm", "normal_force_n")

Loads = Annotated[str, Query(max_length=_LONGEST)]
Skin = Annotated[str | None, Query()]


@router.get("")
def view(request: Request, store: Store, skin: Skin = None, loads: Loads = _LOADS) -> Response:
    """With the skin and the loads of the address, or else the paper's prototype under two spheres."""
    values = _values(request, store, skin)
    error: str | None = None
    document: dict[str, Any] = {}
    found: StressAnswer | None = None
    try:
        document = _document(request, store, skin, loads)
        found = _answered(request, document)
    except UnderskinError as refused:
        error = str(refused)
    return page(
        request,
        "loads.html",
        skin_id=skin,
        fields=FIELDS if skin is not None else (*FIELDS, *GRID),
        values=values,
        loads=loads,
        error=error,
        found=found,
        figures=[] if found is None else [_figure(request, document, found)],
        same=requests.post(request, "/v1/stress", document, f"client.stress({document!r})"),
    )


@router.get("/charge.csv")
def charge_csv(request: Request, store: Store, skin: Skin = None, loads: Loads = _LOADS) -> Response:
    """Charge and stress on each sensor."""
    found = _answered(request, _document(request, store, skin, loads))
    return csv_answer(
        "charge", {"sensor": found.sensors, **{name: column.tolist() for name, column in found.columns.items()}}
    )


def _answered(request: Request, document: Mapping[str, Any]) -> StressAnswer:
    table = influence_table(request.app.state.settings.tables)
    with np.errstate(all="ignore"):  # what overflows is out of reach
        return answer(table, read_request(document))


def _figure(request: Request, document: Mapping[str, Any], found: StressAnswer) -> Any:
    from underskin.figures import loaded_array

    columns = found.columns
    figure = loaded_array(
        found.sensors,
        columns["x_mm"],
        columns["y_mm"],
        columns["charge_pc"],
        columns["charge_error_pc"],
        [(load["x_mm"], load["y_mm"]) for load in document["contacts"]],
    )
    query = f"?{request.url.query}" if request.url.query else ""
    return drawn("charge", figure, "Each sensor where it lies, coloured by its charge.", f"/loads/charge.csv{query}")


def _values(request: Request, store: Database, skin: str | None) -> dict[str, str]:
    """What the form shows: as it was sent, or else the skin's, or the prototype's."""
    known = {} if skin is None else _described(store, skin)
    given = request.query_params
    return {name: given.get(name) or f"{known.get(name) or default:g}" for name, _, _, default in (*FIELDS, *GRID)}


def _document(request: Request, store: Database, skin: str | None, loads: str) -> dict[str, Any]:
    """The request of `POST /v1/stress`; raises InvalidInput."""
    values = {name: _number(name, text) for name, text in _values(request, store, skin).items()}
    document: dict[str, Any] = {name: values[name] for name, *_ in FIELDS}
    document["sensors"] = _grid(values) if skin is None else _described(store, skin)["sensors"]
    document["contacts"] = [_load(number, line) for number, line in enumerate(loads.splitlines(), 1) if line.strip()]
    return document


def _load(number: int, line: str) -> dict[str, Any]:
    """A line of numbers: x, y, radius and force, and perhaps the tangential force along x and y."""
    parts = [_number(f"load {number}", part) for part in line.replace(",", " ").split()]
    if len(parts) not in (4, 6):
        raise InvalidInput(f"load {number}", line[:80], "must be x y R F, or x y R F Fx Fy (mm, N)")
    load: dict[str, Any] = dict(zip(_ORDER, parts, strict=False))
    return {**load, "tangential_force_n": parts[4:]} if parts[4:] else load


def _grid(values: Mapping[str, float]) -> list[dict[str, Any]]:
    columns, rows, pitch = values["columns"], values["rows"], values["pitch_mm"]
    if not (1 <= columns <= 1000 and 1 <= rows <= 1000 and columns * rows <= _MOST_SENSORS):
        raise InvalidInput("columns", f"{columns:g} × {rows:g}", f"must be 1 to {_MOST_SENSORS} sensors in all")
    return [
        {"id": f"s{1 + row * int(columns) + column:02d}", "x_mm": pitch * column, "y_mm": pitch * row}
        for row in range(int(rows))
        for column in range(int(columns))
    ]


def _described(store: Database, skin_id: str) -> dict[str, Any]:
    """The skin as its latest campaign declares it; raises InvalidInput where it has none with sensors."""
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        latest = campaigns.listed(connection, campaigns.Filters(skin=root, state="current"), None, 1)
    described: dict[str, Any] = latest[0].about["skin"] if latest else {"sensors": []}
    if not described["sensors"]:
        raise InvalidInput("skin", skin_id, "must have a current campaign that names its sensors")
    return described


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidInput(name, text[:80], "must be a number") from None
