"""The stress under a sphere: section and top view, and the contact's growth with the load."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import numpy as np
import orjson
from fastapi import APIRouter, Request, Response

from service.dependencies import Store, Table
from service.heavy_answers import computed_in_turn
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.forms import (
    NOTHING_WRONG,
    UNLIKELY,
    WrongFields,
    in_form_words,
    labels_of,
    number,
    quantities,
    wrong_fields,
)
from service.pages.shared.html import json_answer, page
from service.pages.shared.skin_values import UNITS, shown
from underskin.errors import TableError, UnderskinError
from underskin.figures.stress_field import frames, stress_on_base, stress_section
from underskin.physics.charge_response import INCOMPRESSIBLE, Indenter, Skin
from underskin.physics.hertz import peak_pressure
from underskin.prediction.answers import STATED, pressed
from underskin.prediction.stress_field import StressField, stress_field
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import checked, to_lab

router = APIRouter(prefix="/field")

FIELDS = (
    ("thickness_mm", "thickness h", "mm"),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa"),
    ("poisson_ratio", "Poisson's ratio ν", ""),
    ("sensor_radius_mm", "sensor radius rT", "mm"),
    ("indenter_radius_mm", "sphere radius R", "mm"),
    ("preload_n", "force F", "N"),
)
_LABELS = labels_of(FIELDS)
_SKIN = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
_RADII, _DEPTHS = 73, 21
FRAMES = 20  # of the load as it grows to the one that is asked for


@dataclass(frozen=True)
class ShownField:
    """The field of a form, its numbers, and the limit of the table that it exceeds; or its errors."""

    field: StressField | None
    given: Mapping[str, float]
    outside: str | None = None
    wrong: WrongFields = NOTHING_WRONG


@router.get("")
def view(request: Request, store: Store, table: Table, skin: str | None = None) -> Response:
    """With the values of the address, or else those of the skin or of the paper's prototype."""
    values, taken = shown(store, table, request.query_params, skin, FIELDS)
    tried = _tried(request, table, values)
    field = None if tried.outside is not None else tried.field
    query = urlencode({**tried.given, **({UNITS: "yes"} if UNITS in request.query_params else {})})
    return page(
        request,
        "field.html",
        skin_id=skin,
        fields=FIELDS,
        values=values,
        taken=taken,
        units_checked=UNITS in request.query_params,
        wrong=tried.wrong,
        outside=tried.outside,
        told=[] if field is None else _sentences(field, 0),
        error_percent=0.0 if field is None else 100 * float(field.section_error[0]),
        linear=tried.given.get("poisson_ratio") != INCOMPRESSIBLE,
        figures=[] if field is None else _figures(field, query),
        solved_mpa=None if field is None else _by_solved_contact(table, field, tried.given),
        frames=f"/field/frames?{query}",
        count=FRAMES,
        same=_same(request, tried.given, units_checked=UNITS in request.query_params),
    )


@router.get("/frames")
@computed_in_turn
def at_once(request: Request, table: Table) -> Response:
    """What changes in the page while the load grows, a frame for each force, as JSON."""
    given = {name: number(name, request.query_params.get(name, "")) for name, *_ in FIELDS}
    field = _computed(table, given, FRAMES, UNITS in request.query_params)
    rows = range(FRAMES) if field.contact.inside.all() else ()
    shown_frames = [{"told": _sentences(field, row), "figures": frames(field, row)} for row in rows]
    return json_answer(request, orjson.dumps(shown_frames, option=orjson.OPT_SERIALIZE_NUMPY))


@downloadable(router, "/section")
def section_csv(request: Request, table: Table) -> Numbers:
    """The stress at every depth and distance."""
    given = {name: number(name, request.query_params.get(name, "")) for name, *_ in FIELDS}
    field = _computed(table, given, 1, UNITS in request.query_params)
    r, depth = to_lab("r_mm", field.r), to_lab("depth_mm", field.depth)
    columns: dict[str, Any] = {"depth_mm": np.repeat(depth, r.size), "r_mm": np.tile(r, depth.size)}
    columns["sigma_zz_mpa"] = to_lab("sigma_zz_mpa", field.sigma_zz[0]).ravel()
    return Numbers("field", {name: column.tolist() for name, column in columns.items()})


def _tried(request: Request, table: SigmaTable, values: Mapping[str, str]) -> ShownField:
    given: dict[str, float] = {}
    try:
        names = [name for name, *_ in FIELDS]
        given = quantities(values, names, units_checked=UNITS in request.query_params)
        field = _computed(table, given, 1, UNITS in request.query_params)
    except UnderskinError as refused:
        wrong = wrong_fields(refused, lambda error: in_form_words(error, _LABELS, unlikely=UNLIKELY))
        return ShownField(None, given, wrong=wrong)
    return ShownField(field, given, field.limits[0])


def _by_solved_contact(table: SigmaTable, field: StressField, typed: Mapping[str, float]) -> float | None:
    """The sensor's mean stress [MPa] with the finite-strain contact if it differs by more than 1 %; None otherwise,
    or without the contact table, about which /tables informs."""
    given = {name: np.array(value) for name, value in typed.items()}
    paper = float(field.contact.mean_stress[0])
    try:
        solved = float(pressed(contact_model(table, "solved"), given, units_checked=True).mean_stress)
    except TableError:
        return None
    return float(to_lab("mean_stress_mpa", solved)) if abs(solved / paper - 1) > STATED else None


def _computed(table: SigmaTable, given: Mapping[str, float], count: int, units_checked: bool) -> StressField:
    """For `count` forces in equal steps up to the given one; raises InvalidInput."""
    skin = Skin.from_lab(**{name: given[name] for name in _SKIN}, units_checked=units_checked)
    indenter = Indenter.from_lab(indenter_radius_mm=given["indenter_radius_mm"], units_checked=units_checked)
    force = checked("preload_n", given["preload_n"], units_checked=units_checked)
    with np.errstate(all="ignore"):  # an overflow is outside the table
        return stress_field(table, skin, indenter, force * np.arange(1, count + 1) / count, _RADII, _DEPTHS)


def _sentences(field: StressField, row: int) -> list[str]:
    """The results for a load, in the order of the page."""
    contact, force = field.contact, float(field.preload[row])
    a = float(contact.contact_radius[row])
    mean = float(to_lab("mean_stress_mpa", contact.mean_stress[row]))
    share = 100 * 1.5 * float(contact.rt_over_h[row]) ** 2 * float(contact.sigma[row])
    return [
        f"{force:.3g} N",
        f"{to_lab('contact_radius_mm', a):.3g} mm",
        f"{to_lab('pressure_mpa', peak_pressure(force, a)):.3g} MPa",
        f"{to_lab('sigma_zz_mpa', -field.sigma_zz[row, -1, 0]):.3g} MPa",
        f"{mean:.3g} MPa",
        f"{share:.3g} %",
    ]


def _figures(field: StressField, query: str) -> Sequence[Drawn]:
    numbers = f"/field/section.csv?{query}"
    return [
        drawn(
            "section",
            stress_section(field, 0),
            "Normal stress in the plane through the sphere's axis; compression is positive, as in the numbers "
            "above. The colours go with the square root of the stress. The CSV has σ_zz, in which compression is "
            "negative.",
            numbers,
        ),
        drawn(
            "base",
            stress_on_base(field, 0),
            "The same where the sensors are, seen from above, in colours of its own range; the sensor averages it over "
            "its disc.",
            numbers,
        ),
    ]


def _same(request: Request, given: Mapping[str, float], *, units_checked: bool) -> same_request.SameRequest:
    arguments = [f"{name}={value:.6g}" for name, value in given.items()] + ["units_checked=True"] * units_checked
    query = urlencode({**given, **({"units_checked": "true"} if units_checked else {})})
    return same_request.get(request, f"/v1/field?{query}", f"client.field({', '.join(arguments)})")
