"""The FRF that a skin should show, and d33 from measured FRF: by the paper's model or by the adopted one."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from service.schemas.columns import Columns
from service.schemas.pressed_skin import ADOPTED_COLUMNS, FIELDS, D33Columns, FrfColumns, PressedSkinColumns
from service.store import Database
from service.usecases.adopted_models import press, requested_model, require_paper
from underskin.errors import ErrorCode, InvalidInput, SeveralInvalid, conflicting, out_of_range, required
from underskin.physics import charge_response
from underskin.prediction import answers
from underskin.prediction.columns import rows
from underskin.recordings import plausibility
from underskin.surrogate.sigma_table import SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import Complexes, Floats, checked, finite, non_negative, to_lab

# A spectrum a row multiplies the answer; this is some 20 MB of JSON.
_LARGEST_SPECTRA = 1_000_000
_RESULTS = ("d33_pc_per_n", "d33_uncertainty_pc_per_n")


def frf(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    """FRF for each row."""
    if request.model == "adopted":
        return _adopted_frf(table, store, request)
    require_paper(request)
    contact = contact_model(table, request.contact)
    columns = _sent(request, *FIELDS, "d33_pc_per_n")
    count = rows(columns)
    with _all_refused(columns, request.units_checked):
        answer = answers.frf(contact, columns, request.units_checked)
    frequency = _requested_lines(request)
    results = dict(answer.columns)
    shared: dict[str, Any] = {"contact": contact.name}
    if frequency is not None:
        results |= _flat_spectra(frequency, results["frf_pc_per_n"], count)
        shared["frequency_hz"] = frequency
    return Columns(
        count, request.model, contact.sha256, answer.inside, results, shared, frequency, limits=answer.limits
    )


@contextmanager
def _all_refused(columns: Mapping[str, Floats], units_checked: bool) -> Iterator[None]:
    """Raises SeveralInvalid with all errors if one of the columns was rejected."""
    try:
        yield
    except InvalidInput as first:
        other_errors = [error for error in answers.refused(columns, units_checked) if error.field != first.field]
        raise SeveralInvalid([first, *other_errors]) from None


def _sent(request: PressedSkinColumns, *names: str) -> dict[str, Floats]:
    """Those of these columns that the request has."""
    return {name: request.column(name) for name in names if getattr(request, name) is not None}


def _adopted_frf(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    columns = _sent(request, *FIELDS, "d33_pc_per_n", *ADOPTED_COLUMNS)
    count = rows(columns)
    pressed = press(requested_model(store, request), table, request, count)
    pressed.require_lines("frequency_hz")
    d33 = checked("d33_pc_per_n", columns["d33_pc_per_n"], units_checked=request.units_checked)
    results = {**pressed.columns, "frf_pc_per_n": to_lab("frf_pc_per_n", d33 * pressed.level)}
    inside = pressed.inside & np.isfinite(results["frf_pc_per_n"])
    frequency = _requested_lines(request)
    shared: dict[str, Any] = {"model_id": pressed.model_in_force.model_id}
    if frequency is not None:
        response = np.where(pressed.inside[:, None], pressed.response(frequency), np.nan + 0j)
        lines = to_lab("frf_pc_per_n", 1.0) * d33[..., None] * response
        results["frf_re_pc_per_n"] = lines.real
        results["frf_im_pc_per_n"] = np.where(np.isnan(lines.real), np.nan, lines.imag)
        shared["frequency_hz"] = frequency
    limits = pressed.limits(inside)
    return Columns(count, request.model, table.sha256, inside, results, shared, frequency, limits=limits)


def _requested_lines(request: FrfColumns) -> Floats | None:
    return None if request.frequency_hz is None else non_negative("frequency_hz", request.column("frequency_hz"))


def _flat_spectra(frequency: Floats, frf: Floats, count: int) -> dict[str, Floats]:
    """Real and imaginary part, rows × frequencies: flat and real in the paper's model."""
    if count * len(frequency) > _LARGEST_SPECTRA:
        allowed = f"rows times frequencies must be at most {_LARGEST_SPECTRA}"
        raise out_of_range("frequency_hz", f"{count} rows, {len(frequency)} frequencies", allowed)
    real = np.broadcast_to(frf[..., None], (count, len(frequency)))
    return {"frf_re_pc_per_n": real, "frf_im_pc_per_n": np.where(np.isnan(real), np.nan, 0.0)}


def d33(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    """d33 for each row."""
    if request.model == "adopted":
        return _adopted_d33(table, store, request)
    require_paper(request)
    contact = contact_model(table, request.contact)
    measured = _plateau(request) if request.frf_pc_per_n is None else _values(request)
    columns = _sent(request, *FIELDS) | measured
    count = _rows(request, columns)
    with _all_refused(columns, request.units_checked):
        answer = answers.d33(contact, columns, request.units_checked)
    plateau = {name: answer.columns[name] for name in ("frf_pc_per_n", "frf_uncertainty_pc_per_n")}
    results = {name: answer.columns[name] for name in _RESULTS}
    leading = {name: values for name, values in answer.columns.items() if name not in plateau | results}
    shared = {"contact": contact.name, "findings": [finding.in_columns() for finding in answer.findings]}
    columns = {**leading, **plateau, **measured, **results}
    return Columns(count, request.model, contact.sha256, answer.inside, columns, shared, limits=answer.limits)


def _rows(request: D33Columns, columns: Mapping[str, Floats]) -> int:
    """How many there are; a plateau that comes from lines is called by their name where it does not fit."""
    sent = {"frf_pc_per_n": "frf_re_pc_per_n"} if request.frf_pc_per_n is None else {}
    return rows({sent.get(name, name): values for name, values in columns.items()})


def _adopted_d33(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    sent_values = _sent(request, *FIELDS, *ADOPTED_COLUMNS)
    model_in_force = requested_model(store, request)
    if request.frf_pc_per_n is None:
        _require_lines(request)
        ones_of_rows = np.zeros(len(request.frf_re_pc_per_n or ()))
        pressed = press(model_in_force, table, request, rows(sent_values | {"frf_re_pc_per_n": ones_of_rows}))
        pressed.require_lines("frf_im_pc_per_n")
        measured = _plateau(request, lambda line: pressed.level[:, None] / pressed.response(line))
    else:
        measured = answers.measured(_values(request))
        pressed = press(model_in_force, table, request, _rows(request, sent_values | measured))
        pressed.require_lines("frequency_hz")
    value = measured["frf_pc_per_n"] / pressed.level
    unsure = np.hypot(measured["frf_uncertainty_pc_per_n"] / pressed.level, value * pressed.columns["rel_error"])
    columns = {**pressed.columns, **measured, **dict(zip(_RESULTS, (value, unsure), strict=True))}
    findings = [finding.in_columns() for finding in plausibility.of_rows(measured["frf_pc_per_n"], value)]
    shared = {"model_id": model_in_force.model_id, "findings": findings}
    inside = pressed.inside & np.isfinite(value)
    limits = pressed.limits(inside)
    return Columns(len(pressed.level), request.model, table.sha256, inside, columns, shared, limits=limits)


def _values(request: D33Columns) -> dict[str, Floats]:
    """Plateau values as they were sent."""
    for name in sorted(request.lists):
        if getattr(request, name) is not None:
            raise conflicting(name, "given", "goes with lines; leave it out, or leave out frf_pc_per_n")
    return _sent(request, "frf_pc_per_n", "frf_uncertainty_pc_per_n")


def _require_lines(request: D33Columns) -> None:
    for name in ("frequency_hz", "frf_re_pc_per_n", "band_hz"):
        if getattr(request, name) is None:
            raise required(name, "is required where frf_pc_per_n is not given")


def _plateau(request: D33Columns, factor: Callable[[Floats], Complexes] | None = None) -> dict[str, Floats]:
    """Mean over the band of each row's lines, and its standard error unless an uncertainty was sent.

    `factor` of the frequencies converts each line to its plateau value (rows, lines).
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
