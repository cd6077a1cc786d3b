"""d33 of each sensor from its measured FRF, by the paper's model or by the adopted one."""

from collections.abc import Callable, Mapping

import numpy as np

from service.schemas.columns_answer import Columns
from service.schemas.d33 import D33Columns
from service.schemas.pressed_skin import ADOPTED_COLUMNS, FIELDS
from service.store import Database
from service.usecases.adopted_models import model_asked_for, press, require_paper
from underskin.errors import ErrorCode, InvalidInput, conflicting, required
from underskin.physics import charge_response
from underskin.prediction import answers, plausibility
from underskin.prediction.columns import rows
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats, finite, non_negative

_RESULTS = ("d33_pc_per_n", "d33_uncertainty_pc_per_n")


def d33(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    """d33 for each row."""
    if request.model == "adopted":
        return _by_adopted_model(table, store, request)
    require_paper(request)
    measured = _plateau(request) if request.frf_pc_per_n is None else _given(request)
    columns = {name: request.column(name) for name in FIELDS} | measured
    count = _rows(request, columns)
    answer = answers.d33(table, columns, request.units_checked)
    plateau = {name: answer.columns[name] for name in ("frf_pc_per_n", "frf_uncertainty_pc_per_n")}
    results = {name: answer.columns[name] for name in _RESULTS}
    leading = {name: values for name, values in answer.columns.items() if name not in plateau | results}
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=answer.inside,
        shared={"findings": [finding.in_columns() for finding in answer.findings]},
        columns={**leading, **plateau, **measured, **results},
    )


def _rows(request: D33Columns, columns: Mapping[str, Floats]) -> int:
    """How many there are; a plateau that comes from lines is called by their name where it does not fit."""
    sent = {"frf_pc_per_n": "frf_re_pc_per_n"} if request.frf_pc_per_n is None else {}
    return rows({sent.get(name, name): values for name, values in columns.items()})


def _by_adopted_model(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    given = {name: request.column(name) for name in (*FIELDS, *ADOPTED_COLUMNS) if getattr(request, name) is not None}
    model_in_force = model_asked_for(store, request)
    if request.frf_pc_per_n is None:
        _require_lines(request)
        each_row = np.zeros(len(request.frf_re_pc_per_n or ()))
        pressed = press(model_in_force, table, request, rows(given | {"frf_re_pc_per_n": each_row}))
        pressed.require_lines("frf_im_pc_per_n")
        measured = _plateau(request, lambda line: pressed.level[:, None] / pressed.response(line))
    else:
        measured = answers.measured(_given(request))
        pressed = press(model_in_force, table, request, _rows(request, given | measured))
        pressed.require_lines("frequency_hz")
    value = measured["frf_pc_per_n"] / pressed.level
    unsure = np.hypot(measured["frf_uncertainty_pc_per_n"] / pressed.level, value * pressed.columns["rel_error"])
    findings = [finding.in_columns() for finding in plausibility.of_rows(measured["frf_pc_per_n"], value)]
    return Columns(
        rows=len(pressed.level),
        model=request.model,
        table_sha256=table.sha256,
        inside=pressed.inside & np.isfinite(value),
        shared={"model_id": model_in_force.model_id, "findings": findings},
        columns={**pressed.columns, **measured, "d33_pc_per_n": value, "d33_uncertainty_pc_per_n": unsure},
    )


def _given(request: D33Columns) -> dict[str, Floats]:
    """Plateau values as they were sent."""
    for name in sorted(request.json_only):
        if getattr(request, name) is not None:
            raise conflicting(name, "given", "goes with lines; leave it out, or leave out frf_pc_per_n")
    sent = ("frf_pc_per_n", "frf_uncertainty_pc_per_n")
    return {name: request.column(name) for name in sent if getattr(request, name) is not None}


def _require_lines(request: D33Columns) -> None:
    for name in ("frequency_hz", "frf_re_pc_per_n", "band_hz"):
        if getattr(request, name) is None:
            raise required(name, "is required where frf_pc_per_n is not given")


def _plateau(request: D33Columns, factor: Callable[[Floats], Complexes] | None = None) -> dict[str, Floats]:
    """Mean over the band of each row's lines, and its standard error unless an uncertainty was sent.

    `factor`, of the frequencies, makes of each line what a plateau would show (rows, lines).
    """
    _require_lines(request)
    frequency = non_negative("frequency_hz", request.column("frequency_hz"))
    band = non_negative("band_hz", request.column("band_hz"))
    inside = (frequency >= band[0]) & (frequency <= band[1])
    real = _lines(request, "frf_re_pc_per_n", len(frequency))
    imaginary = None
    if request.frf_im_pc_per_n is not None:
        imaginary = _lines(request, "frf_im_pc_per_n", len(frequency))
    if factor is not None:
        lines = (real + 1j * (0.0 if imaginary is None else imaginary)) * factor(frequency)
        real, imaginary = lines.real, None if imaginary is None else lines.imag
    level, error = charge_response.plateau(real, inside)
    measured = {"frf_pc_per_n": level}
    if request.frf_uncertainty_pc_per_n is not None:
        sent = "frf_uncertainty_pc_per_n"
        measured[sent] = non_negative(sent, request.column(sent))
    elif inside.sum() < 2:
        raise required("frf_uncertainty_pc_per_n", "is required where band_hz holds one line, which has no scatter")
    else:
        measured["frf_uncertainty_pc_per_n"] = error
    if imaginary is not None:
        measured["frf_im_pc_per_n"], _ = charge_response.plateau(imaginary, inside)
    return measured


def _lines(request: D33Columns, name: str, count: int) -> Floats:
    """Rows × lines, after checking that each row has a value a frequency."""
    for row, line in enumerate(getattr(request, name)):
        if len(line) != count:
            allowed = f"must have as many lines as frequency_hz ({count})"
            raise InvalidInput(name, f"{len(line)} lines", allowed, row, code=ErrorCode.UNEQUAL_LENGTHS)
    return finite(name, request.column(name))
