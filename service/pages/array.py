"""An array under several loads or under a measured pressure map, and the charge on each of its sensors.

Nothing is stored: the map stays in the page's form.
"""

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np
import orjson
from fastapi import APIRouter, Depends, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from service.dependencies import Store, Table
from service.ingest.reading import READING_SLOTS
from service.ingest.uploads import UploadFolder, received, texts
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.forms import (
    NOTHING_WRONG,
    TOKEN,
    UNLIKELY,
    WrongFields,
    errors_together,
    in_form_words,
    label_of,
    labels_of,
    number,
    numbers,
    quantities,
    require_form_token,
    wrong_fields,
)
from service.pages.shared.html import page
from service.pages.shared.skin_values import FIELDS, UNITS, shown
from service.store import Database, campaigns, skins
from service.usecases.tables import influence_table
from underskin.array_stress import pressure_map
from underskin.array_stress.answer import ArrayStress, BaseStress, answer, base_stress
from underskin.array_stress.request import LabContact, read_request
from underskin.errors import InvalidInput, UnderskinError, all_of, noting, out_of_range, wrong_type
from underskin.figures.array_map import disc_size
from underskin.figures.loads import loaded_array, pressure_on_array, stress_on_base
from underskin.findings.codes import Reason
from underskin.prediction.columns import to_spreadsheet
from underskin.recordings.readers import text
from underskin.recordings.validation import check_fields, not_negative
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

router = APIRouter(prefix="/loads")


_MOST_SENSORS = 10_000

# The L up to which the addition by finite strain is known, and that addition in percent (docs/http-api.md).
_KNOWN_UP_TO_L, _ADDED_PERCENT = 0.1, 3
GRID = (("columns", "sensors along x", ""), ("rows", "sensors along y", ""), ("pitch_mm", "pitch", "mm"))
_DEFAULTS = {"columns": "4", "rows": "4", "pitch_mm": "8"}
GLUE = "glue_stiffness"
LOAD = "load in line"  # as errors call one of the loads, with its number
_LABELS = {
    **labels_of((*FIELDS, *GRID)),
    GLUE: "glue line, κ",
    "contacts": "loads",
    "pressure_map": "the map",
}
_LONGEST = 20_000  # characters of the loads
_LOADS = "10 8 4 1\n14 16 10 3 0.5 0"
_MOST_DRAWN = 6  # loads, of which the stress on the base is drawn
_MOST_OUTLINES = 1000  # sensors
_POINTS = 61  # of its grid along an axis
_OF_SKIN = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio")
_ORDER = ("x_mm", "y_mm", "indenter_radius_mm", "normal_force_n")
_PARTS = ("x", "y", "R", "F", "Fx", "Fy")
Loads = Annotated[str, Query(max_length=_LONGEST)]
_EXAMPLE = "map.csv"
_LARGEST_BYTES = 1_000_000
_LARGEST_BODY_BYTES = 2 * _LARGEST_BYTES + 100_000  # a file, the text of the last map, and the other fields
_LONGEST_FIELD = 1000  # bytes of a field other than the map
_MAP, _FILE, _SKIN = "map", "file", "skin"


@dataclass(frozen=True)
class Described:
    """The array in a form: values as sent, or else those of the skin's campaigns or of the prototype."""

    skin_id: str | None
    values: Mapping[str, str]
    glue: str
    units_checked: bool
    sensors: Sequence[Mapping[str, Any]] | None  # the skin's; None: a grid of the form's
    taken: Sequence[str]  # sentences on undeclared values

    @property
    def fields(self) -> Sequence[tuple[str, str, str]]:
        """The fields of the form."""
        return FIELDS if self.sensors is not None else (*FIELDS, *GRID)

    def document(self) -> dict[str, Any]:
        """The request without its loads; raises SeveralInvalid."""
        with errors_together() as wrong:
            document: dict[str, Any] = {}
            with noting(wrong):
                document |= quantities(self.values, [name for name, *_ in FIELDS], units_checked=self.units_checked)
            if self.glue.strip():
                with noting(wrong):
                    document[GLUE] = not_negative(GLUE, number(GLUE, self.glue), self.units_checked)
            if self.units_checked:
                document[UNITS] = True
            document["sensors"] = _grid(self.values) if self.sensors is None else list(self.sensors)
            return document


def described(store: Database, table: SigmaTable, given: Mapping[str, str], skin_id: str | None) -> Described:
    """The array of a form's fields; a regular grid if no campaign of the skin names sensors."""
    sensors = None if skin_id is None else _sensors(store, skin_id)
    values, taken = shown(store, table, given, skin_id)
    if skin_id is not None and sensors is None:
        taken = [*taken, "No campaign of the skin names its sensors, so they are a grid here"]
    values |= {name: given.get(name, default) for name, default in _DEFAULTS.items()}
    return Described(skin_id, values, given.get(GLUE, ""), UNITS in given, sensors, taken)


def findings(answer: ArrayStress | None, lines: Sequence[int] = ()) -> list[tuple[str, str]]:
    """Implausible values, each with the label of its field in these forms; `lines`: the line numbers of the loads."""
    stated = [] if answer is None else answer.findings
    return [(label_of(finding.field, _LABELS, lines), finding.statement) for finding in stated]


def finite_strain(answer: ArrayStress | None) -> str | None:
    """A warning that finite strain, which neither charge nor error includes, adds more than is known; None for
    smaller loads."""
    for finding in [] if answer is None else answer.findings:
        load = finding.arguments.get("load_parameter", 0.0)
        if finding.reason is Reason.LOAD_NOT_LINEAR and load > _KNOWN_UP_TO_L:
            return (
                f"The ± does not include finite strain. At L = {_KNOWN_UP_TO_L:g} that adds {_ADDED_PERCENT} % to the "
                f"stress on a sensor beneath the sphere; here L reaches {load:.2g}, beyond where it is known what it "
                "adds."
            )
    return None


def tried(
    request: Request, make: Callable[[], dict[str, Any]], lines: Sequence[int] = ()
) -> tuple[dict[str, Any], ArrayStress | None, WrongFields]:
    """The request made by `make`, with its answer or its errors; `lines` as for `findings`."""
    document: dict[str, Any] = {}
    try:
        document = make()
        return document, answered(request, document), NOTHING_WRONG
    except UnderskinError as error:
        in_words = partial(in_form_words, labels=_LABELS, lines=lines, unlikely=UNLIKELY)
        return document, None, wrong_fields(error, in_words, _form_field)


def _form_field(error: InvalidInput) -> str:
    """The form's field of an error."""
    loads = error.field.startswith(("contacts", LOAD))
    return "loads" if loads else "map" if error.field.startswith("pressure_map") else error.field


def answered(request: Request, document: Mapping[str, Any]) -> ArrayStress:
    """The answer of `POST /v1/stress`; raises UnderskinError."""
    table = influence_table(request.app.state.settings.tables)
    with np.errstate(all="ignore"):  # an overflow is out of reach
        return answer(table, read_request(document))


def charge_columns(answer: ArrayStress) -> dict[str, list[Any]]:
    """Charge and stress on each sensor."""
    return {"sensor": list(answer.sensors), **{name: column.tolist() for name, column in answer.columns.items()}}


def charge_figure(
    answer: ArrayStress, loads_mm: Sequence[tuple[float, float]], radius_mm: float, numbers: str
) -> Drawn:
    """The sensors coloured by charge, with the loads if they have positions; `radius_mm`: sensor radius."""
    x, y, charge, error = (answer.columns[name] for name in ("x_mm", "y_mm", "charge_pc", "charge_error_pc"))
    figure = loaded_array(answer.sensors, x, y, charge, error, loads_mm, radius_mm)
    about = f"Each sensor where it lies, coloured by its charge. {disc_size(x, y, radius_mm)}"
    if (np.abs(charge) <= error).any():
        about += " Grey: the charge is 0 within its ±."
    if np.isnan(charge).any():
        about += " Not filled: no load is within reach."
    return drawn("charge", figure, about, numbers)


def _grid(typed: Mapping[str, str]) -> list[dict[str, Any]]:
    readings = {name: partial(_count, name, typed[name]) for name in ("columns", "rows")}
    values = all_of({**readings, "pitch_mm": partial(number, "pitch_mm", typed["pitch_mm"])})
    columns, rows, pitch = values["columns"], values["rows"], values["pitch_mm"]
    if not (1 <= columns <= 1000 and 1 <= rows <= 1000 and columns * rows <= _MOST_SENSORS):
        raise out_of_range("columns", f"{columns:g} × {rows:g}", f"must be 1 to {_MOST_SENSORS} sensors in all")
    return [
        {"id": f"s{1 + row * int(columns) + column:02d}", "x_mm": pitch * column, "y_mm": pitch * row}
        for row in range(int(rows))
        for column in range(int(columns))
    ]


def _count(name: str, typed: str) -> float:
    value = number(name, typed)
    if not value.is_integer():
        raise wrong_type(name, f"{value:g}", "must be a whole number")
    return value


def _sensors(store: Database, skin_id: str) -> Sequence[Mapping[str, Any]] | None:
    """The sensors of the campaign that describes the skin; None if there are none."""
    with store.reading() as connection:
        row = campaigns.describing(connection, skins.require_root(connection, skin_id))
    return None if row is None else row.about["skin"]["sensors"] or None


def _of_address(request: Request, store: Store, table: Table, skin: str | None = None) -> Described:
    return described(store, table, request.query_params, skin)


ArrayOfQuery = Annotated[Described, Depends(_of_address)]


@router.get("")
def loads_view(request: Request, array: ArrayOfQuery, loads: Loads = _LOADS) -> Response:
    """The skin and the loads of the address, or else the paper's prototype under two spheres."""
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
        figures=[] if answer is None else _load_figures(request, document, answer),
        spheres=[] if answer is None else _spheres(document, lines),
        same=same_request.post(request, "/v1/stress", document, f"client.stress({document!r})"),
    )


@downloadable(router, "/charge")
def charge_csv(request: Request, array: ArrayOfQuery, loads: Loads = _LOADS) -> Numbers:
    """Charge and stress on each sensor."""
    return Numbers("charge", charge_columns(answered(request, _document(array, loads))))


@downloadable(router, "/base")
def base_csv(request: Request, array: ArrayOfQuery, loads: Loads = _LOADS) -> Numbers:
    """The normal stress on the base, a row for each grid point."""
    document = _document(array, loads)
    transmitted = _transmitted_contacts(document, answered(request, document))
    stress = _base_stress(request, {**document, "contacts": transmitted or document["contacts"]})
    x, y = np.meshgrid(stress.x_mm, stress.y_mm)
    columns = {"x_mm": x, "y_mm": y, "sigma_zz_mpa": stress.sigma_zz_mpa}
    return Numbers("base", {name: column.ravel().tolist() for name, column in columns.items()})


def _load_figures(request: Request, document: Mapping[str, Any], answer: ArrayStress) -> list[Drawn]:
    """Charge and stress under the loads within reach of a sensor: others would make a wide, empty map."""
    transmitted = _transmitted_contacts(document, answer)
    places = [(load["x_mm"], load["y_mm"]) for load in transmitted]
    charge = charge_figure(answer, places, document["sensor_radius_mm"], f"/loads/charge.csv{_query(request)}")
    return [charge, *(_on_base(request, {**document, "contacts": transmitted}) if transmitted else [])]


def _query(request: Request) -> str:
    return f"?{request.url.query}" if request.url.query else ""


def _on_base(request: Request, document: Mapping[str, Any]) -> list[Drawn]:
    """The stress on the base; none if it would take too long for a page or be too large."""
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
    x, y = (_along([position[name] for position in places], document) for name in ("x_mm", "y_mm"))
    return base_stress(influence_table(request.app.state.settings.tables), read_request(document), x, y)


def _along(places: Sequence[float], document: Mapping[str, Any]) -> Floats:
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


@router.get("/map")
def map_view(request: Request, store: Store, skin: str | None = None) -> Response:
    """An example map, a finger pressing on the skin or on the paper's prototype."""
    example = (Path(__file__).parent / "static" / _EXAMPLE).read_bytes()
    return _shown(request, store, {} if skin is None else {_SKIN: skin}, example, "the map")


@router.post("/map")
async def send(request: Request, store: Store) -> Response:
    """The map sent as a file, or else as text."""
    folder: UploadFolder = request.app.state.uploads
    async with received(request, folder, _LARGEST_BODY_BYTES) as sent:
        fields = [part for part in sent if part.field not in (_MAP, _FILE)]
        given = await folder.threads.run(partial(texts, fields, _LONGEST_FIELD))
        require_form_token(request, given.get(TOKEN, ""))
        file = next((part for part in sent if part.field == _FILE and part.label), None)
        typed = next((part for part in sent if part.field == _MAP), None)
        chosen = file or typed
        content = b"" if chosen is None else await folder.threads.run(partial(chosen.start, _LARGEST_BYTES + 1))
    name = "the map" if file is None or not file.label else file.label
    async with READING_SLOTS:
        return await run_in_threadpool(_shown, request, store, given, content, name)


def _shown(request: Request, store: Database, given: Mapping[str, str], content: bytes, name: str) -> Response:
    array = described(store, request.app.state.table, given, given.get(_SKIN))

    def document_of_map() -> dict[str, Any]:
        document: dict[str, Any] = {}
        with errors_together() as wrong:
            with noting(wrong):
                document = array.document()
            if len(content) > _LARGEST_BYTES:
                must = f"must have at most {_LARGEST_BYTES / 1e6:g} MB: make it coarser"
                raise out_of_range("pressure_map", name, must)
            return {**document, "pressure_map": pressure_map.parse(content, name)}

    document, answer, wrong = tried(request, document_of_map)
    return page(
        request,
        "pressure_map.html",
        array=array,
        map=_text(content[:_LARGEST_BYTES]),
        example=_EXAMPLE,
        wrong=wrong,
        answer=answer,
        findings=findings(answer),
        strained=finite_strain(answer),
        figures=[] if answer is None else _map_figures(document, answer),
        body=None if answer is None else _inside("application/json", orjson.dumps(document)),
        same=same_request.from_file(request, "/v1/stress", "request.json", "client.stress({})"),
    )


def _map_figures(document: Mapping[str, Any], answer: ArrayStress) -> list[Drawn]:
    columns, held = answer.columns, document["pressure_map"]
    places = list(zip(columns["x_mm"].tolist(), columns["y_mm"].tolist(), strict=True))
    pressed = pressure_on_array(held["x_mm"], held["y_mm"], held["pressure_mpa"], places, document["sensor_radius_mm"])
    as_map = {"y_mm \\ x_mm": held["y_mm"]} | {
        f"{x!r}": column for x, column in zip(held["x_mm"], zip(*held["pressure_mpa"], strict=True), strict=True)
    }
    return [
        drawn("pressure", pressed, "The map as it was read, and the sensors' outlines.", _csv(as_map)),
        charge_figure(answer, [], document["sensor_radius_mm"], _csv(charge_columns(answer))),
    ]


def _csv(columns: Mapping[str, Any]) -> str:
    return _inside("text/csv", to_spreadsheet(columns).encode())


def _inside(media_type: str, content: bytes) -> str:
    """An address (data URL) that contains the file itself."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


def _text(content: bytes) -> str:
    """The map for the form's text field; empty if it is not text, such as a spreadsheet file."""
    try:
        return text.decode(content, "")
    except UnderskinError:
        return ""
