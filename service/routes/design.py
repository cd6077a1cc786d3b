"""A skin before it is built: transmission, spatial resolution, two-point separation."""

from typing import Any, Literal

import numpy as np
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from service.dependencies import Table, in_thread
from service.problems import from_validation
from service.schemas.columns import json_document
from underskin import Indenter, InvalidInput, Skin
from underskin.prediction.skin_design import Design, design
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import checked, to_lab

router = APIRouter(prefix="/v1", tags=["design"])

Axis = Literal["a_over_h", "rt_over_h", "load_parameter"]


class DesignRequest(BaseModel):
    """A skin, a sphere that presses it, and the pitch of its array."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    thickness_mm: float = Field(description="Thickness h of the layer over the sensors [mm].", examples=[2.5])
    youngs_modulus_mpa: float = Field(
        description="Young's modulus E of the layer, incompressible [MPa].", examples=[16.0]
    )
    sensor_radius_mm: float = Field(description="Radius rT of a sensor [mm].", examples=[1.5])
    indenter_radius_mm: float = Field(description="Radius R of the sphere [mm].", examples=[4.0])
    preload_n: float = Field(description="Force F of the sphere [N].", examples=[1.0])
    pitch_mm: float = Field(
        gt=0, le=1e4, description="Distance of neighbouring sensors of a square array [mm].", examples=[4.0]
    )
    d33_pc_per_n: float | None = Field(
        default=None, description="d33 of the sensors, for the FRF [pC/N].", examples=[14.0]
    )
    dip_percent: float = Field(
        default=10.0,
        gt=0,
        le=100,
        description="How much less a sensor between two loads must read than those on both sides, over the reading of "
        "a load above a sensor, so that they are told apart [%].",
    )
    units_checked: bool = Field(default=False, description="Accept magnitudes that look like a slip of units.")


class SweepAnswer(BaseModel):
    """σ and γ above a sensor along one axis, the other two as designed."""

    axis: Axis = Field(description="Which axis.")
    value: list[float] = Field(description="Along it.")
    sigma: list[float | None] = Field(description="σ under the sphere; null outside the table.")
    gamma: list[float | None] = Field(description="γ under a point load on the linear layer; null outside the table.")


class ResponseAnswer(BaseModel):
    """The response of a sensor to a load beside its centre."""

    offset_mm: list[float] = Field(description="Distance of the load from the sensor's centre [mm].")
    sigma: list[float | None] = Field(description="σ there under the sphere.")
    gamma: list[float | None] = Field(description="γ there under a point load on the linear layer.")


class DesignAnswer(BaseModel):
    """What the skin tells of a load, and of two."""

    table_sha256: str = Field(description="SHA-256 of the σ table.")
    status: Literal["ok", "out_of_domain"] = Field(
        description="`out_of_domain`: outside the table, and null what depends on it; never extrapolated."
    )
    contact_radius_mm: float = Field(description="Radius a of the contact, Hertz [mm].")
    a_over_h: float = Field(description="a/h.")
    rt_over_h: float = Field(description="rT/h.")
    load_parameter: float = Field(description="L = F/(R²E).")
    sigma: float | None = Field(description="σ above the sensor's centre.")
    rel_error: float | None = Field(description="Bound on its relative error.")
    gamma: float | None = Field(description="γ of a point load above the sensor's centre.")
    mean_stress_mpa: float | None = Field(
        description="Mean static stress on the sensor, positive in compression [MPa]."
    )
    frf_pc_per_n: float | None = Field(description="Charge over force, where d33 is given [pC/N].")
    resolution_mm: float | None = Field(
        description="Spatial resolution: full width at half maximum of a sensor's response against the place of the "
        "load [mm]."
    )
    response_between_percent: float | None = Field(
        description="Response to a load midway between two sensors, over that above a sensor [%]."
    )
    response_amid_percent: float | None = Field(description="The same amid four sensors [%].")
    two_point_separation_mm: float | None = Field(
        description="From this distance on, two equal loads in line with a row of sensors are told apart wherever the "
        "row lies: a sensor between two others reads less than both by `dip_percent`; null where at this pitch they "
        "never are [mm]."
    )
    two_point_best_mm: float | None = Field(
        description="The smallest distance at which they are where the row lies best; not less than where the contacts "
        "touch [mm]."
    )
    response: ResponseAnswer = Field(description="Against the distance from the sensor.")
    sweeps: list[SweepAnswer] = Field(description="Against a/h, rT/h and L.")


def designed(table: SigmaTable, asked: DesignRequest) -> Design:
    """The design that is asked for; raises InvalidInput."""
    given = {name: getattr(asked, name) for name in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm")}
    skin = Skin.from_lab(**given, units_checked=asked.units_checked)
    indenter = Indenter.from_lab(indenter_radius_mm=asked.indenter_radius_mm, units_checked=asked.units_checked)
    preload = float(checked("preload_n", asked.preload_n, units_checked=asked.units_checked))
    pitch = asked.pitch_mm * 1e-3
    if pitch < 2 * float(skin.sensor_radius):
        allowed = f"must be at least {2 * asked.sensor_radius_mm:g} mm, the diameter of a sensor: they cannot overlap"
        raise InvalidInput("pitch_mm", asked.pitch_mm, allowed)
    return design(table, skin, indenter, preload, pitch, asked.dip_percent / 100)


def answer(table: SigmaTable, asked: DesignRequest, found: Design) -> DesignAnswer:
    """A design in lab units."""
    contact, told = found.contact, found.resolution
    frf = None
    if asked.d33_pc_per_n is not None:
        d33 = checked("d33_pc_per_n", asked.d33_pc_per_n, units_checked=asked.units_checked)
        frf = _number(to_lab("frf_pc_per_n", contact.frf(d33)))
    return DesignAnswer(
        table_sha256=table.sha256,
        status="ok" if bool(contact.inside) else "out_of_domain",
        contact_radius_mm=float(to_lab("contact_radius_mm", contact.contact_radius)),
        a_over_h=float(contact.a_over_h),
        rt_over_h=float(contact.rt_over_h),
        load_parameter=float(contact.load_parameter),
        sigma=_number(contact.sigma),
        rel_error=_number(contact.rel_error),
        gamma=_number(found.gamma),
        mean_stress_mpa=_number(to_lab("mean_stress_mpa", contact.mean_stress)),
        frf_pc_per_n=frf,
        resolution_mm=_number(to_lab("x_mm", told.width)),
        response_between_percent=_number(100 * told.between),
        response_amid_percent=_number(100 * told.amid),
        two_point_separation_mm=_number(to_lab("x_mm", told.separation)),
        two_point_best_mm=_number(to_lab("x_mm", told.best_separation)),
        response=ResponseAnswer(
            offset_mm=to_lab("x_mm", found.offset).tolist(),
            sigma=_numbers(found.response),
            gamma=_numbers(found.point_response),
        ),
        sweeps=[
            SweepAnswer(
                axis=sweep.axis, value=sweep.values.tolist(), sigma=_numbers(sweep.sigma), gamma=_numbers(sweep.gamma)
            )
            for sweep in found.sweeps
        ],
    )


EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "pitch_mm": 4.0,
    "d33_pc_per_n": 14.0,
}


@router.post(
    "/design",
    operation_id="design",
    summary="A skin before it is built",
    responses={200: {"model": DesignAnswer}},
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": DesignRequest.model_json_schema(), "example": EXAMPLE}},
        }
    },
)
async def post(request: Request, table: Table) -> Response:
    """How much of a load reaches a sensor, how finely the array tells where it is, and how far apart two loads must be.

    Loads add, as on a linear layer.
    """
    body = await request.body()
    content_type = request.headers.get("content-type", "")

    def work() -> Response:
        asked = read_design(json_document(body, content_type))
        with np.errstate(all="ignore"):  # what overflows is answered as out of the domain
            found = answer(table, asked, designed(table, asked))
        return Response(found.model_dump_json(), media_type="application/json")

    return await in_thread(work)


def read_design(document: Any) -> DesignRequest:
    """The request that a document makes; raises Refusal with all that is wrong."""
    try:
        return DesignRequest.model_validate(document)
    except ValidationError as error:
        raise from_validation(error) from None


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def _numbers(values: Any) -> list[float | None]:
    return [_number(value) for value in values.tolist()]
