"""d33 from single measured values of the FRF, without a file of recordings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response

from service.dependencies import Store, Table
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.forms import (
    NOTHING_WRONG,
    UNLIKELY,
    errors_together,
    in_form_words,
    labels_of,
    number,
    numbers,
    quantities,
    wrong_fields,
)
from service.pages.shared.html import page
from service.pages.shared.skin_values import FIELDS as SKIN_FIELDS
from service.pages.shared.skin_values import UNITS, shown
from service.problems import Refusal, parsed
from service.schemas.columns import Columns
from service.schemas.pressed_skin import D33Columns
from service.store import Conflict, Database
from service.usecases.adopted_models import model_in_force
from service.usecases.pressed_skin import d33
from underskin.errors import InvalidInput, TableError, UnderskinError, conflicting, noting, required, wrong_type
from underskin.prediction.adopted_model import AdoptedModel
from underskin.prediction.answers import other_contact
from underskin.prediction.pressed_skin import beyond
from underskin.recordings.validation import Check, declared, not_negative
from underskin.recordings.validation import number as finite
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/d33")


# Words and unit of the additional values that a model may need besides sphere and preload.
_NEEDED = {
    "dynamic_force_n": ("dynamic force", "N"),
    "dwell_s": ("time the preload was held", "s"),
    "load_cycles": ("load cycles so far", ""),
    "sensor": ("sensor", ""),
}
FIELDS = tuple(field for field in SKIN_FIELDS if field[0] != "d33_pc_per_n")
_LONGEST = 20_000  # characters of the rows
_WITHOUT_UNCERTAINTY = 3  # numbers of a row
_ROWS = "4 1 7.06 0.1\n4 3 7.45 0.1"
_ROW, _ALL_ROWS = "row", "measurements"  # names in errors of the columns of the rows
_CHECKS: dict[str, Check] = {
    "indenter_radius_mm": declared,
    "preload_n": declared,
    "frf_pc_per_n": finite,
    "frf_uncertainty_pc_per_n": not_negative,
}  # of the numbers of a row, in order
_ORDER = tuple(_CHECKS)
_LABELS = {
    **labels_of((*FIELDS, *((name, *words) for name, words in _NEEDED.items()))),
    "indenter_radius_mm": "sphere radius R",
    "preload_n": "preload F",
    "frf_pc_per_n": "FRF",
    "frf_uncertainty_pc_per_n": "uncertainty of the FRF",
}
_WORDS = {"frf_pc_per_n": "FRF", "d33_pc_per_n": "d33"}  # that findings are about
_ANSWERED = ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "contact_radius_mm", "sigma", "mean_stress_mpa")
RowsText = Annotated[str, Query(max_length=_LONGEST)]


@dataclass(frozen=True)
class ByModel:
    """The result of the model in force for the same measurements.

    `fields`: additional fields of the form (name, words, unit, value); `document`: the request of `POST /v1/d33` and
    `answer`: its answer, both None if `unavailable` gives a reason.
    """

    fields: Sequence[tuple[str, str, str, str]] = ()
    document: Mapping[str, Any] | None = None
    answer: Columns | None = None
    unavailable: str | None = None

    def columns(self) -> dict[str, list[float]]:
        """d33 by it, a row a measurement; none where it is unavailable."""
        if self.answer is None:
            return {}
        names = {"d33_pc_per_n": "d33_adopted_pc_per_n", "d33_uncertainty_pc_per_n": "d33_adopted_uncertainty_pc_per_n"}
        return {new: self.answer.full(name).tolist() for name, new in names.items()}


def by_model(
    store: Database, table: SigmaTable, skin: str | None, given: Mapping[str, str], document: Mapping[str, Any]
) -> ByModel | None:
    """The same by the model in force of the skin; None where there is none. `document`: the paper's request."""
    if skin is None:
        return None
    try:
        model = model_in_force(store, skin).model
    except Refusal:
        return None
    except Conflict as outdated:
        return ByModel(unavailable=str(outdated))
    fields = [(name, *_NEEDED[name], given.get(name, "").strip()) for name in model.needs]
    try:
        document_of_model = {**document, **_needed(model, fields), "model": "adopted", "skin_id": skin}
        return ByModel(fields, document_of_model, d33(table, store, D33Columns.model_validate(document_of_model)))
    except UnderskinError as refused:
        return ByModel(fields, unavailable=in_form_words(refused, _LABELS))


def _needed(model: AdoptedModel, fields: Sequence[tuple[str, str, str, str]]) -> dict[str, Any]:
    if model.of_lines:
        names = " and ".join(name.replace("_", " ") for name in model.of_lines)
        raise required("FRF", f"one value is not enough: {names} depends on frequency, so upload recordings")
    return {name: value if name == "sensor" else number(name, value) for name, _, _, value in fields if value}


@router.get("")
def view(request: Request, store: Store, table: Table, skin: str | None = None, rows: RowsText = _ROWS) -> Response:
    """With the skin and the rows of the address, or else the paper's prototype under a sphere."""
    values, taken = shown(store, table, request.query_params, skin, FIELDS)
    wrong = NOTHING_WRONG
    document: dict[str, Any] = {}
    answer: Columns | None = None
    adopted: ByModel | None = None
    try:
        document = _document(values, request.query_params, rows)
        answer = _answered(table, store, document)
        adopted = by_model(store, table, skin, request.query_params, document)
    except UnderskinError as problem:
        wrong = wrong_fields(problem, _message, _form_field)
    document_used = document if adopted is None or adopted.document is None else adopted.document
    return page(
        request,
        "measured.html",
        skin_id=skin,
        fields=FIELDS,
        values=values,
        taken=taken,
        units_checked=UNITS in request.query_params,
        rows=rows,
        wrong=wrong,
        findings=[] if answer is None else answer.shared["findings"],
        words=_WORDS,
        columns=None if answer is None else _columns(document, answer, adopted, table),
        adopted=adopted,
        outside=[] if answer is None else reasons(document, answer, table),
        query=request.url.query,
        same=same_request.post(request, "/v1/d33", document_used, f"client.d33(**{document_used!r})"),
    )


@downloadable(router, "/rows")
def rows_csv(request: Request, store: Store, table: Table, skin: str | None = None, rows: RowsText = _ROWS) -> Numbers:
    """What was measured and what it says, a row a measurement."""
    values, _ = shown(store, table, request.query_params, skin, FIELDS)
    document = _document(values, request.query_params, rows)
    adopted = by_model(store, table, skin, request.query_params, document)
    return Numbers("d33", _columns(document, _answered(table, store, document), adopted, table))


def _message(error: UnderskinError) -> str:
    row = "" if not isinstance(error, InvalidInput) or error.index is None else f"{_ROW} {error.index + 1}, "
    return row + in_form_words(error, _LABELS, unlikely=UNLIKELY)


def _form_field(error: InvalidInput) -> str:
    of_row = error.index is not None or error.field.startswith((_ROW, _ALL_ROWS))
    return "rows" if of_row else error.field


def _answered(table: SigmaTable, store: Database, document: dict[str, Any]) -> Columns:
    return d33(table, store, parsed(D33Columns, document))


def _columns(
    document: Mapping[str, Any], answer: Columns, adopted: ByModel | None, table: SigmaTable
) -> dict[str, list[Any]]:
    """What was sent and what is answered, a row a measurement."""
    sent = {name: document.get(name, [math.nan] * answer.rows) for name in _ORDER}
    answered = {name: answer.full(name).tolist() for name in _ANSWERED}
    adopted_columns = {} if adopted is None else adopted.columns()
    return {
        **sent,
        **answered,
        **_by_solved_contact(document, answer, table),
        **adopted_columns,
        "status": list(answer.status()),
    }


def _by_solved_contact(document: Mapping[str, Any], answer: Columns, table: SigmaTable) -> dict[str, list[float]]:
    """d33 with the finite-strain contact, a row a measurement, if any differs from the paper's by more than 1 %;
    none without the contact table, about which /tables informs."""
    given = {name: np.asarray(value, dtype=float) for name, value in document.items() if name != UNITS}
    try:
        other = other_contact(table, "paper", given, answer.full("d33_pc_per_n"), units_checked=UNITS in document)
    except TableError:
        return {}
    values = np.broadcast_to(other.d33, (answer.rows,))
    return {"d33_solved_pc_per_n": values.tolist()} if other.differs.any() else {}


def _document(values: Mapping[str, str], given: Mapping[str, str], rows: str) -> dict[str, Any]:
    """The request of `POST /v1/d33`; raises SeveralInvalid."""
    with errors_together() as wrong:
        document: dict[str, Any] = {}
        with noting(wrong):
            document |= quantities(values, [name for name, *_ in FIELDS], units_checked=UNITS in given)
        columns = _columns_of(rows, units_checked=UNITS in given)
        return {**document, **columns, **({UNITS: True} if UNITS in given else {})}


def _columns_of(rows: str, *, units_checked: bool) -> dict[str, list[float]]:
    """The measurements, a column for each quantity; raises SeveralInvalid."""
    parts: list[list[float]] = []
    with errors_together() as wrong:
        for line_number, line in enumerate(rows.splitlines(), 1):
            if line.strip():
                with noting(wrong):
                    parts.append(_row(line_number, line, units_checked=units_checked))
    if not parts:
        raise required(_ALL_ROWS, "fill in at least one row: R F FRF, in mm, N and pC/N")
    if len({len(part) for part in parts}) != 1:
        bare = [str(number) for number, part in enumerate(parts, 1) if len(part) == _WITHOUT_UNCERTAINTY]
        must = f"give an uncertainty (the fourth number) in every row or in none: row {', '.join(bare[:5])} has none"
        raise conflicting(_ALL_ROWS, None, must)
    return dict(zip(_ORDER, (list(column) for column in zip(*parts, strict=True)), strict=False))


def _row(line_number: int, line: str, *, units_checked: bool) -> list[float]:
    parts = numbers(f"{_ROW} {line_number}", line, [_LABELS[name] for name in _ORDER])
    if len(parts) not in (_WITHOUT_UNCERTAINTY, len(_ORDER)):
        raise wrong_type(
            f"{_ROW} {line_number}", line[:80], "must be R F FRF, or R F FRF and its uncertainty (mm, N, pC/N)"
        )
    with errors_together() as wrong:
        for (name, check), value in zip(_CHECKS.items(), parts, strict=False):
            try:
                check(name, value, units_checked)
            except InvalidInput as error:
                wrong.append(InvalidInput(name, error.value, error.allowed, line_number - 1, code=error.code))
    return parts


def reasons(document: Mapping[str, Any], answer: Columns, table: SigmaTable) -> list[str]:
    """For each row outside the table the value and the allowed range; `document`: the request of the answer."""
    numbers = np.stack([answer.full(name) for name in ("a_over_h", "rt_over_h", "load_parameter")], axis=-1).tolist()
    status = answer.status()
    skin = document["youngs_modulus_mpa"], document["poisson_ratio"]
    return [
        f"row {row + 1}, {beyond(table, numbers[row], force, radius, *skin)}"
        for row, (force, radius) in enumerate(zip(document["preload_n"], document["indenter_radius_mm"], strict=True))
        if status[row] != "ok"
    ]
