"""The FRF that a skin should show, by the paper's model or by the adopted one."""

import numpy as np

from service.schemas.columns_answer import Columns
from service.schemas.frf import FrfColumns
from service.schemas.pressed_skin import ADOPTED_COLUMNS, FIELDS
from service.store import Database
from service.usecases.adopted_models import model_asked_for, press, require_paper
from underskin.errors import out_of_range
from underskin.prediction import answers
from underskin.prediction.columns import rows
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, checked, non_negative, to_lab

# A spectrum a row multiplies the answer; this is some 20 MB of JSON.
_LARGEST_SPECTRA = 1_000_000
_GIVEN = (*FIELDS, "d33_pc_per_n", *ADOPTED_COLUMNS)


def frf(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    """FRF for each row."""
    if request.model == "adopted":
        return _by_adopted_model(table, store, request)
    require_paper(request)
    columns = {name: request.column(name) for name in (*FIELDS, "d33_pc_per_n")}
    count = rows(columns)
    answer = answers.frf(table, columns, request.units_checked)
    spectra, frequency = _spectra(request, answer.columns["frf_pc_per_n"], count)
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=answer.inside,
        shared={} if frequency is None else {"frequency_hz": frequency},
        columns={**answer.columns, **spectra},
        line_hz=frequency,
    )


def _by_adopted_model(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    columns = {name: request.column(name) for name in _GIVEN if getattr(request, name) is not None}
    count = rows(columns)
    pressed = press(model_asked_for(store, request), table, request, count)
    pressed.require_lines("frequency_hz")
    d33 = checked("d33_pc_per_n", columns["d33_pc_per_n"], units_checked=request.units_checked)
    results = {**pressed.columns, "frf_pc_per_n": to_lab("frf_pc_per_n", d33 * pressed.level)}
    frequency = None
    if request.frequency_hz is not None:
        frequency = non_negative("frequency_hz", request.column("frequency_hz"))
        response = np.where(pressed.inside[:, None], pressed.response(frequency), np.nan + 0j)
        lines = to_lab("frf_pc_per_n", 1.0) * np.broadcast_to(d33, (count,))[:, None] * response
        results |= {
            "frf_re_pc_per_n": lines.real,
            "frf_im_pc_per_n": np.where(np.isnan(lines.real), np.nan, lines.imag),
        }
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=pressed.inside & np.isfinite(results["frf_pc_per_n"]),
        shared={
            "model_id": pressed.model_in_force.model_id,
            **({} if frequency is None else {"frequency_hz": frequency}),
        },
        columns=results,
        line_hz=frequency,
    )


def _spectra(request: FrfColumns, frf: Floats, count: int) -> tuple[dict[str, Floats], Floats | None]:
    """Real and imaginary part, rows × frequencies: flat and real in the paper's model."""
    if request.frequency_hz is None:
        return {}, None
    frequency = non_negative("frequency_hz", request.column("frequency_hz"))
    if count * len(frequency) > _LARGEST_SPECTRA:
        allowed = f"rows times frequencies must be at most {_LARGEST_SPECTRA}"
        raise out_of_range("frequency_hz", f"{count} rows, {len(frequency)} frequencies", allowed)
    shape = (count, len(frequency))
    real = np.broadcast_to(np.broadcast_to(frf, (count,))[:, None], shape)
    imaginary = np.where(np.isnan(real), np.nan, 0.0)
    return {"frf_re_pc_per_n": real, "frf_im_pc_per_n": imaginary}, frequency
