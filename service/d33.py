"""d33 of each sensor from its measured FRF."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from fastapi import APIRouter, Request, Response
from pydantic import Field

from service.adopted import press, serving_of
from service.answers import Accept, Columns, FindingModel
from service.columns import NonNegative, Numbers, NumbersPerRow, Signed, rows
from service.dependencies import StoreToRead, Table, columns_body, columns_route
from service.frf import EXAMPLE as FRF_EXAMPLE
from service.skin_columns import (
    ADOPTED_COLUMNS,
    FIELDS,
    PressedSkinAnswer,
    PressedSkinColumns,
    require_paper,
)
from service.store import Database
from underskin import InvalidInput
from underskin.physics import charge_response
from underskin.prediction import plausibility
from underskin.prediction.answers import lab_columns, pressed
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats, finite, non_negative, to_lab, to_si

router = APIRouter(prefix="/v1", tags=["d33"])


class D33Columns(PressedSkinColumns):
    """The skin, the sphere and the measured FRF: plateau values, or lines with a band to average over."""

    json_only: ClassVar[frozenset[str]] = frozenset({"frequency_hz", "band_hz", "frf_re_pc_per_n", "frf_im_pc_per_n"})

    frf_pc_per_n: Signed | None = Field(
        default=None, description="Measured FRF on the plateau, real part [pC/N]; or give lines."
    )
    frf_uncertainty_pc_per_n: NonNegative | None = Field(
        default=None,
        description="Standard uncertainty of the plateau [pC/N]. Left out: unknown, so that d33's is null; for lines "
        "the standard error of their mean, which does not see the gain error that lines of one recording share.",
    )
    frequency_hz: Numbers | None = Field(
        default=None, min_length=1, description="Frequencies of the lines, the same for all rows [Hz]."
    )
    frf_re_pc_per_n: NumbersPerRow | None = Field(
        default=None, min_length=1, description="Real part of the FRF, rows × lines [pC/N]."
    )
    frf_im_pc_per_n: NumbersPerRow | None = Field(
        default=None,
        min_length=1,
        description="Imaginary part, rows × lines [pC/N]; its mean is answered, and used only with an adopted model "
        "that depends on frequency.",
    )
    band_hz: Numbers | None = Field(
        default=None, min_length=2, max_length=2, description="Lowest and highest frequency averaged over [Hz]."
    )


class D33Answer(PressedSkinAnswer):
    """d33 in columns."""

    frf_pc_per_n: list[float | None] = Field(
        description="The plateau that was inverted; of an adopted model what a plateau would show [pC/N]."
    )
    frf_uncertainty_pc_per_n: list[float | None] = Field(description="Its standard uncertainty [pC/N].")
    frf_im_pc_per_n: list[float | None] | None = Field(
        default=None, description="Mean imaginary part over the band, where given [pC/N]."
    )
    d33_pc_per_n: list[float | None] = Field(description="d33 = FRF / ((3/2) (rT/h)² σ) [pC/N].")
    d33_uncertainty_pc_per_n: list[float | None] = Field(
        description="Standard uncertainty: the FRF's and the table's, in quadrature; null without the FRF's [pC/N]."
    )
    findings: list[FindingModel] = Field(
        description="Measured values that look wrong, such as C/N taken for pC/N, and a d33 that no sensors have; "
        "they are used all the same."
    )


def answer(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    """d33 for each row."""
    if request.model == "adopted":
        return _adopted_answer(table, store, request)
    require_paper(request)
    measured = _plateau(request) if request.frf_pc_per_n is None else _given(request)
    columns = {name: request.column(name) for name in FIELDS} | measured
    count = _rows(request, columns)
    reached = pressed(table, columns, request.units_checked)
    d33, uncertainty = reached.d33(
        *(to_si(name, measured[name]) for name in ("frf_pc_per_n", "frf_uncertainty_pc_per_n"))
    )
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256,
        inside=reached.inside & np.isfinite(d33),
        shared={"findings": _findings(measured, to_lab("d33_pc_per_n", d33))},
        columns={
            **lab_columns(reached),
            **measured,
            "d33_pc_per_n": to_lab("d33_pc_per_n", d33),
            "d33_uncertainty_pc_per_n": to_lab("d33_uncertainty_pc_per_n", uncertainty),
        },
    )


def _rows(request: D33Columns, columns: Mapping[str, Floats]) -> int:
    """How many there are; a plateau that comes from lines is called by their name where it does not fit."""
    sent = {"frf_pc_per_n": "frf_re_pc_per_n"} if request.frf_pc_per_n is None else {}
    return rows({sent.get(name, name): values for name, values in columns.items()})


def _adopted_answer(table: SigmaTable, store: Database, request: D33Columns) -> Columns:
    given = {name: request.column(name) for name in (*FIELDS, *ADOPTED_COLUMNS) if getattr(request, name) is not None}
    serving = serving_of(store, request)
    if request.frf_pc_per_n is None:
        _require_lines(request)
        each_row = np.zeros(len(request.frf_re_pc_per_n or ()))
        felt = press(serving, table, request, rows(given | {"frf_re_pc_per_n": each_row}))
        felt.require_lines("frf_im_pc_per_n")
        measured = _plateau(request, lambda frequency: felt.level[:, None] / felt.response(frequency))
    else:
        measured = _given(request)
        felt = press(serving, table, request, _rows(request, given | measured))
        felt.require_lines("frequency_hz")
    value = measured["frf_pc_per_n"] / felt.level
    unsure = np.hypot(measured["frf_uncertainty_pc_per_n"] / felt.level, value * felt.columns["rel_error"])
    return Columns(
        rows=len(felt.level),
        model=request.model,
        table_sha256=table.sha256,
        inside=felt.inside & np.isfinite(value),
        shared={"model_id": serving.model_id, "findings": _findings(measured, value)},
        columns={**felt.columns, **measured, "d33_pc_per_n": value, "d33_uncertainty_pc_per_n": unsure},
    )


def _findings(measured: Mapping[str, Floats], d33: Floats) -> list[dict[str, Any]]:
    return [finding.in_columns() for finding in plausibility.of_rows(measured["frf_pc_per_n"], d33)]


def _given(request: D33Columns) -> dict[str, Floats]:
    """Plateau values as they were sent."""
    for name in sorted(request.json_only):
        if getattr(request, name) is not None:
            raise InvalidInput(name, "given", "goes with lines; leave it out, or leave out frf_pc_per_n")
    return {"frf_pc_per_n": finite("frf_pc_per_n", request.column("frf_pc_per_n")), **_uncertainty(request)}


def _uncertainty(request: D33Columns) -> dict[str, Floats]:
    name = "frf_uncertainty_pc_per_n"
    if request.frf_uncertainty_pc_per_n is None:
        return {name: np.full((), np.nan)}
    return {name: non_negative(name, request.column(name))}


def _require_lines(request: D33Columns) -> None:
    for name in ("frequency_hz", "frf_re_pc_per_n", "band_hz"):
        if getattr(request, name) is None:
            raise InvalidInput(name, None, "is required where frf_pc_per_n is not given")


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
        measured |= _uncertainty(request)
    elif inside.sum() < 2:
        raise InvalidInput(
            "frf_uncertainty_pc_per_n", None, "is required where band_hz holds one line, which has no scatter"
        )
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
            raise InvalidInput(name, f"{len(line)} lines", allowed, index=row)
    return finite(name, request.column(name))


EXAMPLE = {**FRF_EXAMPLE, "frf_pc_per_n": [6.8, 6.9], "frf_uncertainty_pc_per_n": 0.1}
del EXAMPLE["d33_pc_per_n"]

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": D33Answer, "content": {"text/csv": {}}}}


@router.post(
    "/d33",
    operation_id="d33_columns",
    summary="d33 from measured FRF",
    responses=_ANSWER,
    openapi_extra=columns_body(D33Columns, EXAMPLE),
)
async def d33_columns(
    request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json"
) -> Response:
    """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""

    def work(table: SigmaTable, columns: D33Columns) -> Columns:
        return answer(table, store, columns)

    return await columns_route(D33Columns, work)(request, table, accept)
