"""The design view: sliders, and at once what the skin would tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np
import orjson
from fastapi import APIRouter, Depends, Request, Response

from service.dependencies import Store, Table
from service.pages.shared import same_request
from service.pages.shared.figures import Drawn, csv_answer, drawn
from service.pages.shared.formats import short_and_exact
from service.pages.shared.forms import in_form_words, number
from service.pages.shared.html import compress, page
from service.pages.shared.skin_values import start
from service.problems import parsed
from service.schemas.design import DesignAnswer, DesignRequest
from service.usecases.design import design_answer, design_of
from underskin.errors import InvalidInput, UnderskinError
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/design")

# Field, words, unit, the slider's ends.
SLIDERS = (
    ("thickness_mm", "thickness h", "mm", 0.2, 20),
    ("sensor_radius_mm", "sensor radius rT", "mm", 0.1, 10),
    ("indenter_radius_mm", "sphere radius R", "mm", 0.5, 50),
    ("preload_n", "force F", "N", 0.05, 50),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa", 0.1, 100),
    ("d33_pc_per_n", "d33", "pC/N", 1, 100),
    ("pitch_mm", "pitch of the array", "mm", 0.5, 50),
    ("dip_percent", "dip that can be told", "%", 1, 50),
)
_LABELS = {name: f"{words} [{unit}]" for name, words, unit, *_ in SLIDERS}
_WORDS = {name: (words, unit) for name, words, unit, *_ in SLIDERS if name != "dip_percent"}
BLIND_PERCENT = 10.0  # of the response above a sensor: what lies below goes unseen


@dataclass(frozen=True)
class Sliders:
    """Where they start and stand, as they were `typed` and as numbers, and what is wrong with what was typed; `taken`:
    in sentences what of it, beyond what the address gives, nobody declared."""

    skin_id: str | None
    own: Mapping[str, float]
    typed: Mapping[str, str]
    values: Mapping[str, float]
    error: InvalidInput | None
    taken: Sequence[str]


def _sliders(request: Request, store: Store, table: Table, skin: str | None = None) -> Sliders:
    """With the values of the address, or else those of the skin, or of the paper's prototype."""
    given = {name: text for name, *_ in SLIDERS if (text := request.query_params.get(name))}
    own, taken = start(store, table, skin, {name: words for name, words in _WORDS.items() if name not in given})
    own = {name: own[name] for name, *_ in SLIDERS}
    values, error = dict(own), None
    for name, text in given.items():
        try:
            values[name] = number(name, text)
        except InvalidInput as wrong:
            error = error or wrong
    typed = {name: given.get(name) or f"{own[name]:g}" for name, *_ in SLIDERS}
    return Sliders(skin, own, typed, values, error, taken)


SlidersOfQuery = Annotated[Sliders, Depends(_sliders)]


@router.get("")
def view(request: Request, table: Table, sliders: SlidersOfQuery) -> Response:
    """The page."""
    shown = _tried(table, sliders)
    return page(
        request,
        "design.html",
        skin_id=sliders.skin_id,
        typed=sliders.typed,
        sliders=SLIDERS,
        results=shown.results,
        outside=shown.outside,
        figures=shown.figures,
        error=shown.error,
        taken=sliders.taken,
        query=urlencode({**({} if sliders.skin_id is None else {"skin": sliders.skin_id}), **sliders.typed}),
        same=_same(request, sliders.values),
    )


@router.get("/answer")
def at_once(request: Request, table: Table, sliders: SlidersOfQuery) -> Response:
    """What changes in the page when a slider moves, as JSON."""
    shown = _tried(table, sliders)
    same = _same(request, sliders.values)
    changed = {
        "results": {entry.name: [entry.text, entry.exact, entry.note] for entry in shown.results},
        "figures": {figure.name: figure.json for figure in shown.figures},
        "outside": shown.outside,
        "same": [same.curl, same.python],
    }
    content = orjson.dumps(changed if shown.error is None else {"error": shown.error})
    answer = Response(content, media_type="application/json", headers={"Cache-Control": "no-store"})
    compress(request, answer)
    return answer


@router.get("/sweeps.csv")
def sweeps_csv(table: Table, sliders: SlidersOfQuery) -> Response:
    """σ and γ along each axis."""
    answer = _computed(table, sliders)
    columns: dict[str, list[Any]] = {name: [] for name in ("axis", "value", "sigma", "gamma")}
    for sweep in answer.sweeps:
        columns["axis"] += [sweep.axis] * len(sweep.value)
        columns["value"] += sweep.value
        columns["sigma"] += sweep.sigma
        columns["gamma"] += sweep.gamma
    return csv_answer("design", columns)


@router.get("/response.csv")
def response_csv(table: Table, sliders: SlidersOfQuery) -> Response:
    """A sensor's response against the place of the load."""
    return csv_answer("response", _computed(table, sliders).response.model_dump())


@dataclass(frozen=True)
class DesignResult:
    """One thing that a design tells: short, exact, and with a remark."""

    name: str
    words: str
    value: float | None
    unit: str
    digits: int
    note: str

    @property
    def text(self) -> str:
        """The value with its unit."""
        shown = short_and_exact(self.value, self.unit, self.digits)[0]
        return shown if self.value is None else f"{shown} {self.unit}".strip()

    @property
    def exact(self) -> str:
        """All its digits."""
        return short_and_exact(self.value, self.unit, self.digits)[1]


def results(answer: DesignAnswer) -> list[DesignResult]:
    """What a design tells, in order."""
    apart = answer.two_point_separation_mm
    blind = answer.response_amid_percent is not None and answer.response_amid_percent < BLIND_PERCENT
    point = f"a/h {answer.a_over_h:.3g}, rT/h {answer.rt_over_h:.3g}, L {answer.load_parameter:.2g}"
    anywhere = "wherever the array lies" if apart is not None else "not told apart everywhere at this pitch"
    entries = [
        DesignResult("sigma", "transmission σ", answer.sigma, "", 4, point),
        DesignResult("frf", "FRF", answer.frf_pc_per_n, "pC/N", 4, "what an instrument should show above the sensor"),
        DesignResult("gamma", "γ of a point load", answer.gamma, "", 4, "above the sensor, linear layer"),
        DesignResult("stress", "mean stress on the sensor", answer.mean_stress_mpa, "MPa", 3,
             f"contact radius {answer.contact_radius_mm:.3g} mm"),
        DesignResult("resolution", "spatial resolution", answer.resolution_mm, "mm", 3,
                     "width at half maximum of a response"),
        DesignResult("apart", "two-point separation", apart, "mm", 3, f"two equal loads, {anywhere}"),
        DesignResult("best", "two-point separation at best", answer.two_point_best_mm, "mm", 3,
             "where the sensors lie best under them"),
        DesignResult("amid", "response amid four sensors", answer.response_amid_percent, "%", 3,
             "of that above one" + (": blind spots" if blind else "")),
    ]  # fmt: skip
    if answer.status == "ok":
        return entries
    return [replace(entry, note="outside the table") if entry.value is None else entry for entry in entries]


@dataclass(frozen=True)
class ShownDesign:
    """What a design tells, in numbers and figures; the limit of the table that it exceeds; or what is wrong with it."""

    results: Sequence[DesignResult]
    figures: Sequence[Drawn]
    outside: str | None = None
    error: str | None = None


def _computed(table: SigmaTable, sliders: Sliders) -> DesignAnswer:
    if sliders.error is not None:
        raise sliders.error
    asked = parsed(DesignRequest, sliders.values)
    return design_answer(table, asked, design_of(table, asked))


def _tried(table: SigmaTable, sliders: Sliders) -> ShownDesign:
    from underskin.figures.design import Mark, array_response, design_overview

    try:
        if sliders.error is not None:
            raise sliders.error
        asked = parsed(DesignRequest, sliders.values)
        with np.errstate(all="ignore"):
            designed = design_of(table, asked)
            start = design_of(table, parsed(DesignRequest, sliders.own)).contact
        answer = design_answer(table, asked, designed)
    except UnderskinError as refused:
        return ShownDesign([], [], error=in_form_words(refused, _LABELS))
    name = "the paper's prototype" if sliders.skin_id is None else "the skin as it is"
    mark = Mark(name, float(start.a_over_h), float(start.rt_over_h), float(start.load_parameter), float(start.sigma))
    query = urlencode({name: getattr(asked, name) for name, *_ in SLIDERS})
    figures = [
        drawn(
            "design",
            design_overview(designed, mark),
            "σ under the sphere and γ under a point load, above a sensor's centre, against contact radius, sensor "
            "radius and load; the other two stay as designed.",
            f"/design/sweeps.csv?{query}",
        ),
        drawn(
            "row",
            array_response(designed, asked.pitch_mm),
            "The reading of each sensor of a row while the sphere moves along it, over that above a sensor.",
            f"/design/response.csv?{query}",
        ),
    ]
    return ShownDesign(results(answer), figures, answer.limit)


def _same(request: Request, values: Mapping[str, float]) -> same_request.SameRequest:
    call = f"client.design({', '.join(f'{name}={value:.6g}' for name, value in values.items())})"
    return same_request.post(request, "/v1/design", values, call)
