"""What the model predicts for a skin: FRF, and what leads to it."""

from typing import Any, ClassVar

import numpy as np
from fastapi import APIRouter, Request, Response
from pydantic import Field

from service.dependencies import StoreToRead, Table, columns_body, columns_route
from service.schemas.columns import Numbers, Signed, rows
from service.schemas.columns_answer import Accept, Columns
from service.schemas.pressed_skin import ADOPTED_COLUMNS, FIELDS, PressedSkinAnswer, PressedSkinColumns, require_paper
from service.store import Database
from service.usecases.adopted_models import press, serving_of
from underskin import InvalidInput
from underskin.prediction.answers import lab_columns, pressed
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, checked, non_negative, to_lab

router = APIRouter(prefix="/v1", tags=["frf"])

# A spectrum a row multiplies the answer; this is some 20 MB of JSON.
_LARGEST_SPECTRA = 1_000_000


class FrfColumns(PressedSkinColumns):
    """The skin, the sphere and d33, in columns."""

    json_only: ClassVar[frozenset[str]] = frozenset({"frequency_hz"})

    d33_pc_per_n: Signed = Field(description="Piezoelectric coefficient d33 of the sensor [pC/N], not 0.")
    frequency_hz: Numbers | None = Field(
        default=None,
        min_length=1,
        description="Frequencies of the spectra, the same for all rows [Hz]. The paper's model is flat and real; an "
        "adopted one that depends on frequency needs them.",
    )


class FrfAnswer(PressedSkinAnswer):
    """The FRF in columns."""

    frf_pc_per_n: list[float | None] = Field(
        description="FRF on the plateau, charge over force; of an adopted model without its dynamics [pC/N]."
    )
    frequency_hz: list[float] | None = Field(default=None, description="As asked, if it was [Hz].")
    frf_re_pc_per_n: list[list[float | None]] | None = Field(
        default=None, description="Real part, rows × frequencies; only with `frequency_hz` [pC/N]."
    )
    frf_im_pc_per_n: list[list[float | None]] | None = Field(
        default=None, description="Imaginary part (e^(+iωt)), rows × frequencies; only with `frequency_hz` [pC/N]."
    )


def answer(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    """FRF for each row."""
    if request.model == "adopted":
        return _adopted_answer(table, store, request)
    require_paper(request)
    columns = {name: request.column(name) for name in (*FIELDS, "d33_pc_per_n")}
    count = rows(columns)
    reached = pressed(table, columns, request.units_checked)
    d33 = checked("d33_pc_per_n", columns["d33_pc_per_n"], units_checked=request.units_checked)
    frf = to_lab("frf_pc_per_n", reached.frf(d33))
    spectra, frequency = _spectra(request, frf, count)
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=reached.inside & np.isfinite(frf),
        shared={} if frequency is None else {"frequency_hz": frequency},
        columns={**lab_columns(reached), "frf_pc_per_n": frf, **spectra},
        line_hz=frequency,
    )


def _adopted_answer(table: SigmaTable, store: Database, request: FrfColumns) -> Columns:
    columns = {name: request.column(name) for name in _GIVEN if getattr(request, name) is not None}
    count = rows(columns)
    felt = press(serving_of(store, request), table, request, count)
    felt.require_lines("frequency_hz")
    d33 = checked("d33_pc_per_n", columns["d33_pc_per_n"], units_checked=request.units_checked)
    found = {**felt.columns, "frf_pc_per_n": to_lab("frf_pc_per_n", d33 * felt.level)}
    frequency = None
    if request.frequency_hz is not None:
        frequency = non_negative("frequency_hz", request.column("frequency_hz"))
        response = np.where(felt.inside[:, None], felt.response(frequency), np.nan + 0j)
        lines = to_lab("frf_pc_per_n", 1.0) * np.broadcast_to(d33, (count,))[:, None] * response
        found |= {"frf_re_pc_per_n": lines.real, "frf_im_pc_per_n": np.where(np.isnan(lines.real), np.nan, lines.imag)}
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=felt.inside & np.isfinite(found["frf_pc_per_n"]),
        shared={"model_id": felt.serving.model_id, **({} if frequency is None else {"frequency_hz": frequency})},
        columns=found,
        line_hz=frequency,
    )


def _spectra(request: FrfColumns, frf: Floats, count: int) -> tuple[dict[str, Floats], Floats | None]:
    """Real and imaginary part, rows × frequencies: flat and real in the paper's model."""
    if request.frequency_hz is None:
        return {}, None
    frequency = non_negative("frequency_hz", request.column("frequency_hz"))
    if count * len(frequency) > _LARGEST_SPECTRA:
        allowed = f"rows times frequencies must be at most {_LARGEST_SPECTRA}"
        raise InvalidInput("frequency_hz", f"{count} rows, {len(frequency)} frequencies", allowed)
    shape = (count, len(frequency))
    real = np.broadcast_to(np.broadcast_to(frf, (count,))[:, None], shape)
    imaginary = np.where(np.isnan(real), np.nan, 0.0)
    return {"frf_re_pc_per_n": real, "frf_im_pc_per_n": imaginary}, frequency


EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "d33_pc_per_n": 14.0,
}

_GIVEN = (*FIELDS, "d33_pc_per_n", *ADOPTED_COLUMNS)

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": FrfAnswer, "content": {"text/csv": {}}}}


@router.post(
    "/frf",
    operation_id="frf_columns",
    summary="FRF of a skin under a sphere",
    responses=_ANSWER,
    openapi_extra=columns_body(FrfColumns, EXAMPLE),
)
async def frf_columns(
    request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json"
) -> Response:
    """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""

    def work(table: SigmaTable, columns: FrfColumns) -> Columns:
        return answer(table, store, columns)

    return await columns_route(FrfColumns, work)(request, table, accept)
