"""The design view: sliders, and the properties of the designed skin, updated at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any
from urllib.parse import parse_qsl, urlencode

import numpy as np
import orjson
from fastapi import APIRouter, Depends, Request, Response

from service.dependencies import Store, Table
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.figures import Drawn, drawn
from service.pages.shared.formats import change_in_percent, short_and_exact
from service.pages.shared.forms import (
    NOTHING_WRONG,
    WrongFields,
    errors_together,
    in_form_words,
    labels_of,
    quantity,
    see,
    wrong_fields,
)
from service.pages.shared.html import json_answer, page
from service.pages.shared.skin_values import start
from service.problems import parsed
from service.schemas.design import DesignAnswer, DesignRequest
from service.usecases.design import design_answer, design_of, other_sigma, require_apart
from service.usecases.materials import ELASTOMERS, FILMS, MATERIALS, RATIO_SOURCE, with_values
from underskin.errors import InvalidInput, UnderskinError, not_one_of, noting
from underskin.figures.design import Pinned, array_response, design_overview
from underskin.prediction.answers import OTHER
from underskin.prediction.answers import WORDS as CONTACT_WORDS
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
    ("dip_percent", "resolvable dip", "%", 1, 50),
)
LABELS = labels_of(SLIDERS)
WORDS = {name: (words, unit) for name, words, unit, *_ in SLIDERS if name != "dip_percent"}
PIN, ACTION, MATERIAL = "pin", "do", "material"
BLIND_PERCENT = 10.0  # of the response above a sensor: below, it is invisible


@dataclass(frozen=True)
class Sliders:
    """Defaults (`own`) and present values of the sliders, as text (`typed`) and as numbers; the `pinned` design if
    there is one, as text `pin`; errors of both; `taken`: sentences on values that neither the address nor the skin
    declares."""

    skin_id: str | None
    own: Mapping[str, float]
    typed: Mapping[str, str]
    values: Mapping[str, float]
    pin: str
    pinned: Mapping[str, float] | None
    error: InvalidInput | None
    wrong_pin: InvalidInput | None
    taken: Sequence[str]


def _sliders(request: Request, store: Store, table: Table, skin: str | None = None) -> Sliders:
    """With the values of the address, or else those of the skin or of the paper's prototype."""
    given = {name: request.query_params[name] for name, *_ in SLIDERS if name in request.query_params}
    start_values, taken = start(store, table, skin, {name: words for name, words in WORDS.items() if name not in given})
    start_values = {name: start_values[name] for name, *_ in SLIDERS}
    values, error = _numbers(start_values, given)
    pin = request.query_params.get(PIN, "")
    pinned, wrong_pin = _numbers(start_values, dict(parse_qsl(pin, keep_blank_values=True))) if pin else (None, None)
    typed = {name: given.get(name, f"{start_values[name]:g}") for name, *_ in SLIDERS}
    return Sliders(skin, start_values, typed, values, pin, pinned, error, wrong_pin, taken)


SlidersOfQuery = Annotated[Sliders, Depends(_sliders)]


def _numbers(own: Mapping[str, float], given: Mapping[str, str]) -> tuple[dict[str, float], InvalidInput | None]:
    """The given values, or else the defaults, and all errors."""
    values = dict(own)
    try:
        with errors_together(list(LABELS)) as wrong:
            for name in (slider for slider in own if slider in given):
                with noting(wrong):
                    values[name] = quantity(name, given[name])
            with noting(wrong):
                parsed(DesignRequest, values)
            if not {"pitch_mm", "sensor_radius_mm"} & {invalid.field for invalid in wrong}:
                require_apart(values["pitch_mm"], values["sensor_radius_mm"])
    except InvalidInput as error:
        return values, error
    return values, None


def after_action(request: Request, sliders: Sliders) -> str | None:
    """The address to which a button of the form leads: design pinned or unpinned, or a material's value used; None
    if no button was pressed. Raises InvalidInput for an unknown material."""
    action, material = (request.query_params.get(name) for name in (ACTION, MATERIAL))
    if action is None and material is None:
        return None
    typed, pin = dict(sliders.typed), sliders.pin
    if action == "pin":
        pin = urlencode(typed)
    elif action == "unpin":
        pin = ""
    if material is not None:
        if material not in MATERIALS:
            raise not_one_of(MATERIAL, material, MATERIALS)
        taken = MATERIALS[material]
        typed[taken.field] = f"{taken.value:g}"
    skin = {} if sliders.skin_id is None else {"skin": sliders.skin_id}
    return f"/design?{urlencode({**skin, **typed, **({PIN: pin} if pin else {})})}"


@dataclass(frozen=True)
class DesignResult:
    """One result of a design: short, exact, and with a remark."""

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


def results(answer: DesignAnswer, other_sigma: float | None = None) -> list[DesignResult]:
    """The results of a design, in order; `other_sigma`: σ by the other contact model, if it is shown."""
    apart = answer.two_point_separation_mm
    blind = answer.response_amid_percent is not None and answer.response_amid_percent < BLIND_PERCENT
    point = f"a/h {answer.a_over_h:.3g}, rT/h {answer.rt_over_h:.3g}, L {answer.load_parameter:.2g}"
    if other_sigma is not None:
        point += f"; {CONTACT_WORDS[OTHER[answer.contact]]} σ is {other_sigma:.4g}"
    anywhere = "wherever the array lies" if apart is not None else "not resolved everywhere at this pitch"
    entries = [
        DesignResult("sigma", "transmission σ", answer.sigma, "", 4, point),
        DesignResult("frf", "FRF", answer.frf_pc_per_n, "pC/N", 4, "what an instrument should show above the sensor"),
        DesignResult("gamma", "γ of a point load", answer.gamma, "", 4, "above the sensor, linear layer"),
        DesignResult("stress", "mean stress on the sensor", answer.mean_stress_mpa, "MPa", 3,
             f"contact radius {answer.contact_radius_mm:.3g} mm"),
        DesignResult("resolution", "response width", answer.resolution_mm, "mm", 3,
                     "of one sensor, at half its maximum"),
        DesignResult("apart", "two-point separation", apart, "mm", 3, f"two equal loads, {anywhere}"),
        DesignResult("best", "two-point separation at best", answer.two_point_best_mm, "mm", 3,
             "where the sensors lie best under them"),
        DesignResult("amid", "response amid four sensors", answer.response_amid_percent, "%", 3,
             "of that above one" + (": blind spots" if blind else "")),
    ]  # fmt: skip
    if answer.status == "ok":
        return entries
    return [replace(result, note="outside the table") if result.value is None else result for result in entries]


@dataclass(frozen=True)
class Compared:
    """One number of the pinned and of the present design, and the relative change to the latter."""

    name: str
    words: str
    pinned: str
    stands: str
    change: str


def compared(
    pinned: tuple[Mapping[str, float], DesignAnswer], stands: tuple[Mapping[str, float], DesignAnswer]
) -> list[Compared]:
    """Inputs and results of both designs."""
    numbers = [values for values, _ in (pinned, stands)]
    chosen = [
        _compared(name, words, [(f"{values[name]:g} {unit}", values[name]) for values in numbers])
        for name, words, unit, *_ in SLIDERS
    ]
    comparisons = [
        _compared(f"told-{result.name}", result.words, [(result.text, result.value), (reference.text, reference.value)])
        for result, reference in zip(*(results(answer) for _, answer in (pinned, stands)), strict=True)
    ]
    return chosen + comparisons


def _compared(name: str, words: str, both: Sequence[tuple[str, float | None]]) -> Compared:
    (pinned, before), (stands, after) = both
    change = "–"
    if before and after is not None:
        percent = 100 * (after / before - 1)
        change = "same" if abs(percent) < 0.05 else f"{change_in_percent(percent, 3)} %"
    return Compared(name, words, pinned, stands, change)


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
    return json_answer(request, orjson.dumps({"wrong": shown.wrong.sentences} if shown.wrong else changed))


@downloadable(router, "/sweeps")
def sweeps_csv(table: Table, sliders: SlidersOfQuery) -> Numbers:
    """σ and γ along each axis."""
    answer = _computed(table, sliders)
    columns: dict[str, list[Any]] = {name: [] for name in ("axis", "value", "sigma", "gamma")}
    for sweep in answer.sweeps:
        columns["axis"] += [sweep.axis] * len(sweep.value)
        columns["value"] += sweep.value
        columns["sigma"] += sweep.sigma
        columns["gamma"] += sweep.gamma
    return Numbers("design", columns)


@downloadable(router, "/response")
def response_csv(table: Table, sliders: SlidersOfQuery) -> Numbers:
    """A sensor's response against the position of the load."""
    return Numbers("response", _computed(table, sliders).response.model_dump())


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
