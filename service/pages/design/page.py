"""The design view: sliders, and the properties of the designed skin, updated at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import numpy as np
import orjson
from fastapi import APIRouter, Request, Response

from service.dependencies import Table
from service.pages.design.results import Compared, DesignResult, compared, results
from service.pages.design.sliders import LABELS, SLIDERS, Sliders, SlidersOfQuery, after_action
from service.pages.shared import same_request
from service.pages.shared.figures import Drawn, csv_answer, drawn
from service.pages.shared.forms import in_form_words, see
from service.pages.shared.html import compress, page
from service.pages.shared.wrong_fields import NOTHING_WRONG, WrongFields, wrong_fields
from service.problems import parsed
from service.schemas.design import DesignAnswer, DesignRequest
from service.usecases.design import design_answer, design_of, other_sigma
from service.usecases.materials import ELASTOMERS, FILMS, RATIO_SOURCE, with_values
from underskin.errors import UnderskinError
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/design")


@router.get("")
def view(request: Request, table: Table, sliders: SlidersOfQuery) -> Response:
    """The page; a button of its form leads back to it."""
    after = after_action(request, sliders)
    if after is not None:
        return see(after)
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
        wrong=shown.wrong,
        taken=sliders.taken,
        query=urlencode({**({} if sliders.skin_id is None else {"skin": sliders.skin_id}), **sliders.typed}),
        pin=sliders.pin,
        compared=shown.compared,
        materials=(("Elastomers", "Young's modulus", "MPa", ELASTOMERS), ("Films", "d33", "pC/N", FILMS)),
        ratio_source=RATIO_SOURCE,
        material_of=with_values(sliders.values),
        same=_same(request, sliders.values),
    )


@router.get("/answer")
def at_once(request: Request, table: Table, sliders: SlidersOfQuery) -> Response:
    """What changes in the page when a slider moves, as JSON."""
    shown = _tried(table, sliders)
    same = _same(request, sliders.values)
    changed = {
        "results": {result.name: [result.text, result.exact, result.note] for result in shown.results},
        "figures": {figure.name: figure.json for figure in shown.figures},
        "compared": {comparison.name: [comparison.stands, comparison.change] for comparison in shown.compared},
        "outside": shown.outside,
        "materials": with_values(sliders.values),
        "same": [same.curl, same.python],
    }
    content = orjson.dumps({"wrong": shown.wrong.sentences} if shown.wrong else changed)
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
    """A sensor's response against the position of the load."""
    return csv_answer("response", _computed(table, sliders).response.model_dump())


@dataclass(frozen=True)
class ShownDesign:
    """A design's results in numbers and figures; the limit of the table that it exceeds; its errors; its numbers
    compared with the pinned design's."""

    results: Sequence[DesignResult]
    figures: Sequence[Drawn]
    outside: str | None = None
    wrong: WrongFields = NOTHING_WRONG
    compared: Sequence[Compared] = ()


def _computed(table: SigmaTable, sliders: Sliders) -> DesignAnswer:
    if sliders.error is not None:
        raise sliders.error
    demand = parsed(DesignRequest, sliders.values)
    return design_answer(table, demand, design_of(table, demand))


def _tried(table: SigmaTable, sliders: Sliders) -> ShownDesign:
    from underskin.figures.design import Pinned, array_response, design_overview

    try:
        if sliders.error is not None:
            raise sliders.error
        demand = parsed(DesignRequest, sliders.values)
        with np.errstate(all="ignore"):
            designed = design_of(table, demand)
        answer = design_answer(table, demand, designed)
    except UnderskinError as refused:
        return ShownDesign([], [], wrong=wrong_fields(refused, _message))
    try:
        if sliders.wrong_pin is not None:
            raise sliders.wrong_pin
        reference_demand = parsed(DesignRequest, sliders.own if sliders.pinned is None else sliders.pinned)
        with np.errstate(all="ignore"):
            reference = design_of(table, reference_demand)
    except UnderskinError as refused:
        return ShownDesign(
            [], [], wrong=wrong_fields(refused, lambda error: f"A, pinned: {_message(error)}", lambda _: "")
        )
    name = "the paper's prototype" if sliders.skin_id is None else "the skin as it is"
    rows: list[Compared] = []
    pinned = None
    if sliders.pinned is not None:
        name, pinned = "A, pinned", Pinned("A, pinned", reference)
        rows = compared((sliders.pinned, design_answer(table, reference_demand, reference)), (sliders.values, answer))
    query = urlencode({name: getattr(demand, name) for name, *_ in SLIDERS})
    figures = [
        drawn(
            "design",
            design_overview(designed, Pinned(name, reference)),
            "σ under the sphere and γ under a point load, above a sensor's centre, against contact radius, sensor "
            "radius and load; the other two stay as designed.",
            f"/design/sweeps.csv?{query}",
        ),
        drawn(
            "row",
            array_response(designed, demand.pitch_mm, pinned),
            "The reading of each sensor of a row while the sphere moves along it, over that above a sensor.",
            f"/design/response.csv?{query}",
        ),
    ]
    return ShownDesign(results(answer, other_sigma(table, demand, answer)), figures, answer.limit, compared=rows)


def _message(error: UnderskinError) -> str:
    return in_form_words(error, LABELS)


def _same(request: Request, values: Mapping[str, float]) -> same_request.SameRequest:
    call = f"client.design({', '.join(f'{name}={value:.6g}' for name, value in values.items())})"
    return same_request.post(request, "/v1/design", values, call)
