"""Several loads on an array, and the charge on each of its sensors."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Query, Request, Response

from service.dependencies import Store, Table
from service.heavy_answers import computed_in_turn
from service.pages.array.description import (
    LOAD,
    Described,
    answered,
    charge_columns,
    charge_figure,
    described,
    findings,
    finite_strain,
    tried,
)
from service.pages.shared import same_request
from service.pages.shared.figures import Drawn, csv_answer, drawn
from service.pages.shared.forms import numbers
from service.pages.shared.html import page
from service.pages.shared.wrong_fields import errors_together
from service.usecases.tables import influence_table
from underskin.array_stress.answer import ArrayStress, BaseStress, base_stress
from underskin.array_stress.request import LabContact, read_request
from underskin.errors import noting, out_of_range, wrong_type
from underskin.recordings.validation import check_fields
from underskin.units import Floats

router = APIRouter(prefix="/loads")

_LONGEST = 20_000  # characters of the loads
_LOADS = "10 8 4 1\n14 16 10 3 0.5 0"
_MOST_DRAWN = 6  # loads, of which the stress on the base is drawn
_MOST_OUTLINES = 1000  # sensors
_POINTS = 61  # of its grid along an axis
_OF_SKIN = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
_ORDER = ("x_mm", "y_mm", "indenter_radius_mm", "normal_force_n")
_PARTS = ("x", "y", "R", "F", "Fx", "Fy")

Loads = Annotated[str, Query(max_length=_LONGEST)]


@router.get("")
def view(request: Request, store: Store, table: Table, skin: str | None = None, loads: Loads = _LOADS) -> Response:
    """The skin and the loads of the address, or else the paper's prototype under two spheres."""
    array = described(store, table, request.query_params, skin)
    lines = [number for number, line in enumerate(loads.splitlines(), 1) if line.strip()]
    document, answer, wrong = tried(request, lambda: _document(array, loads), lines)
    return page(
        request,
        "loads.html",
        array=array,
        loads=loads,
        wrong=wrong,
        answer=answer,
        findings=[] if answer is None else [*findings(answer, lines), *_beyond_reach(document, answer, lines)],
        strained=finite_strain(answer),
        figures=[] if answer is None else _figures(request, document, answer),
        spheres=[] if answer is None else _spheres(document, lines),
        same=same_request.post(request, "/v1/stress", document, f"client.stress({document!r})"),
    )


@router.get("/charge.csv")
def charge_csv(
    request: Request, store: Store, table: Table, skin: str | None = None, loads: Loads = _LOADS
) -> Response:
    """Charge and stress on each sensor."""
    answer = answered(request, _document(described(store, table, request.query_params, skin), loads))
    return csv_answer("charge", charge_columns(answer))


@router.get("/base.csv")
@computed_in_turn
def base_csv(request: Request, store: Store, table: Table, skin: str | None = None, loads: Loads = _LOADS) -> Response:
    """The normal stress on the base, a row for each grid point."""
    document = _document(described(store, table, request.query_params, skin), loads)
    transmitted = _transmitted_contacts(document, answered(request, document))
    stress = _base_stress(request, {**document, "contacts": transmitted or document["contacts"]})
    x, y = np.meshgrid(stress.x_mm, stress.y_mm)
    columns = {"x_mm": x, "y_mm": y, "sigma_zz_mpa": stress.sigma_zz_mpa}
    return csv_answer("base", {name: column.ravel().tolist() for name, column in columns.items()})


def _figures(request: Request, document: Mapping[str, Any], answer: ArrayStress) -> list[Drawn]:
    """Charge and stress under the loads within reach of a sensor: others would make a wide, empty map."""
    transmitted = _transmitted_contacts(document, answer)
    places = [(load["x_mm"], load["y_mm"]) for load in transmitted]
    charge = charge_figure(answer, places, document["sensor_radius_mm"], f"/loads/charge.csv{_query(request)}")
    return [charge, *(_on_base(request, {**document, "contacts": transmitted}) if transmitted else [])]


def _query(request: Request) -> str:
    return f"?{request.url.query}" if request.url.query else ""


def _on_base(request: Request, document: Mapping[str, Any]) -> list[Drawn]:
    """The stress on the base; none if it would take too long for a page or be too large."""
    from underskin.figures.loads import stress_on_base

    contacts, sensors = document["contacts"], document["sensors"]
    if len(contacts) > _MOST_DRAWN or len(sensors) > _MOST_OUTLINES:
        return []
    places = [[(position["x_mm"], position["y_mm"]) for position in some] for some in (contacts, sensors)]
    figure = stress_on_base(_base_stress(request, document), places[0], places[1], document["sensor_radius_mm"])
    about = (
        "Normal stress where the sensors are, seen from above; compression is positive, as in the table. Loads add. "
    )
    about += "The CSV has σ_zz, in which compression is negative."
    return [drawn("base", figure, about, f"/loads/base.csv{_query(request)}")]


def _base_stress(request: Request, document: Mapping[str, Any]) -> BaseStress:
    """On a grid over all loads and sensors; raises InvalidInput."""
    count = len(document["contacts"])
    if count > _MOST_DRAWN:
        raise out_of_range("contacts", f"{count} loads", f"must be at most {_MOST_DRAWN} for the stress on the base")
    places = (*document["contacts"], *document["sensors"])
    x, y = (_grid([position[name] for position in places], document) for name in ("x_mm", "y_mm"))
    return base_stress(influence_table(request.app.state.settings.tables), read_request(document), x, y)


def _grid(places: Sequence[float], document: Mapping[str, Any]) -> Floats:
    """Coordinates along an axis, from a margin before the first to one behind the last."""
    margin = document["sensor_radius_mm"] + document["thickness_mm"]
    return np.linspace(min(places) - margin, max(places) + margin, _POINTS)


def _beyond_reach(document: Mapping[str, Any], answer: ArrayStress, lines: Sequence[int]) -> list[tuple[str, str]]:
    """Messages for the loads that no sensor transmits: where each lies and how far the nearest sensor is."""
    further = f"sensors feel no further than {answer.reach_mm:.3g} mm. It is not drawn."
    return [
        (f"load in line {line}", f"it lies {away:.4g} mm from the nearest sensor and adds nothing: {further}")
        for line, away, is_transmitted in zip(
            lines, _away_mm(document), _are_transmitted(document, answer), strict=True
        )
        if not is_transmitted
    ]


def _away_mm(document: Mapping[str, Any]) -> list[float]:
    """Distance from each load to the nearest sensor [mm]."""
    sensors = np.array([(sensor["x_mm"], sensor["y_mm"]) for sensor in document["sensors"]])
    return [
        float(np.hypot(*(sensors - (contact["x_mm"], contact["y_mm"])).T).min()) for contact in document["contacts"]
    ]


def _are_transmitted(document: Mapping[str, Any], answer: ArrayStress) -> list[bool]:
    """Whether a part of each load's contact lies within the reach of a sensor."""
    edges = np.array(_away_mm(document)) - answer.contact_radius_mm
    return [bool(edge <= answer.reach_mm) for edge in edges]


def _transmitted_contacts(document: Mapping[str, Any], answer: ArrayStress) -> list[Mapping[str, Any]]:
    """The loads that a sensor transmits."""
    return [
        contact
        for contact, is_transmitted in zip(document["contacts"], _are_transmitted(document, answer), strict=True)
        if is_transmitted
    ]


def _spheres(document: Mapping[str, Any], lines: Sequence[int]) -> list[tuple[int, str]]:
    """For each load its line and the page of the stress under its sphere alone."""
    skin = {name: document[name] for name in _OF_SKIN if name in document}
    return [
        (
            line,
            urlencode(
                {**skin, "indenter_radius_mm": contact["indenter_radius_mm"], "preload_n": contact["normal_force_n"]}
            ),
        )
        for line, contact in zip(lines[:_MOST_DRAWN], document["contacts"], strict=False)
    ]


def _document(array: Described, loads: str) -> dict[str, Any]:
    """The request of `POST /v1/stress`; raises SeveralInvalid."""
    lines = [(line_number, line) for line_number, line in enumerate(loads.splitlines(), 1) if line.strip()]
    contacts = []
    with errors_together() as wrong:
        document: dict[str, Any] = {}
        with noting(wrong):
            document = array.document()
        for number, (line_number, line) in enumerate(lines):
            with noting(wrong):
                load = _load(line_number, line)
                refused = check_fields(LabContact, load, units_checked=array.units_checked)[1]
                wrong += [invalid.at(f"contacts[{number}].{invalid.field}") for invalid in refused]
                contacts.append(load)
        return {**document, "contacts": contacts}


def _load(line_number: int, line: str) -> dict[str, Any]:
    """A line of numbers: x, y, radius and force, optionally the tangential force along x and y."""
    parts = numbers(f"{LOAD} {line_number}", line, _PARTS)
    if len(parts) not in (4, 6):
        raise wrong_type(f"{LOAD} {line_number}", line[:80], "must be x y R F, or x y R F Fx Fy (mm, N)")
    load: dict[str, Any] = dict(zip(_ORDER, parts, strict=False))
    return {**load, "tangential_force_n": parts[4:]} if parts[4:] else load
