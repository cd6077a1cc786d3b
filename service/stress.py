"""Charge on every sensor of an array under several contacts or a pressure map."""

from typing import Any, ClassVar

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service.answers import Accept, AnswerInColumns, Columns
from service.columns import ColumnsRequest
from service.dependencies import Table, columns_route
from service.more_tables import influence_table
from underskin.influence import InfluenceTable
from underskin.stress_request import MOST_CONTACTS, read_request
from underskin.stress_request import answer as stress_answer
from underskin.surrogate import SigmaTable

router = APIRouter(prefix="/v1", tags=["stress"])


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class StressSensor(_Part):
    """A sensor of the array."""

    id: str = Field(description="Its name, one of its own.")
    x_mm: float = Field(description="Its centre along the skin's length [mm].")
    y_mm: float = Field(description="Its centre along the skin's width [mm].")


class StressContact(_Part):
    """A sphere that presses with the Hertz pressure; its tangential force is spread in the same way."""

    x_mm: float = Field(description="Centre of the contact, in the sensors' frame [mm].")
    y_mm: float = Field(description="Centre of the contact, in the sensors' frame [mm].")
    indenter_radius_mm: float = Field(gt=0, description="Radius R of the sphere [mm].")
    normal_force_n: float = Field(gt=0, description="Force into the skin [N].")
    tangential_force_n: list[float] = Field(
        default=[0.0, 0.0], min_length=2, max_length=2, description="Force on the skin along x and y [N]."
    )


class StressMap(_Part):
    """Pressure into the skin, constant around each of evenly spaced places."""

    x_mm: list[float] = Field(min_length=2, description="Places of the columns, evenly spaced, ascending [mm].")
    y_mm: list[float] = Field(min_length=2, description="Places of the rows, evenly spaced, ascending [mm].")
    pressure_mpa: list[list[float]] = Field(min_length=2, description="Pressure, y × x, at least 0 [MPa].")


class StressRequest(ColumnsRequest):
    """A skin with its sensors, and either contacts or a pressure map."""

    thickness_mm: float = Field(gt=0, description="Thickness h of the layer over the sensors [mm].")
    youngs_modulus_mpa: float | None = Field(
        default=None, gt=0, description="Young's modulus E of the layer; needed with contacts [MPa]."
    )
    poisson_ratio: float = Field(default=0.5, ge=0, le=0.5, description="Poisson's ratio ν, 0 to 0.5 [-].")
    glue_stiffness: float | None = Field(
        default=None, ge=0, description="κ of the glue line, τ = κ (G/h) u_r at the base [-]; left out or null: bonded."
    )
    sensor_radius_mm: float = Field(gt=0, description="Radius rT of a sensor [mm].")
    d33_pc_per_n: float = Field(description="Piezoelectric coefficient d33 of the sensors [pC/N].")
    length_mm: float | None = Field(
        default=None,
        gt=0,
        description="Extent along x about the middle of the sensors; loads beside it are refused [mm].",
    )
    width_mm: float | None = Field(default=None, gt=0, description="The same along y [mm].")
    sensors: list[StressSensor] = Field(min_length=1, description="The sensors of the array.")
    contacts: list[StressContact] | None = Field(
        default=None, min_length=1, max_length=MOST_CONTACTS, description="Spheres, none over another."
    )
    pressure_map: StressMap | None = Field(default=None, description="Instead of contacts: a map of pressure.")
    units_checked: bool = Field(default=False, description="Accept magnitudes that look like a slip of units.")

    json_only: ClassVar[frozenset[str]] = frozenset({"sensors", "contacts", "pressure_map"})


class StressAnswer(AnswerInColumns):
    """One entry a sensor, in the order of the request."""

    sensor: list[str] = Field(description="The sensor's id (not in CSV).")
    x_mm: list[float] = Field(description="Its centre [mm].")
    y_mm: list[float] = Field(description="Its centre [mm].")
    charge_pc: list[float | None] = Field(description="Charge, positive in compression for a positive d33 [pC].")
    charge_error_pc: list[float | None] = Field(
        description="Bound on the table's error, with what loads beyond its reach may add; they count as 0 [pC]."
    )
    mean_stress_mpa: list[float | None] = Field(description="Mean stress on the sensor, positive in compression [MPa].")
    reach_mm: float | None = Field(
        description="How far from a sensor the table knows a load; a sensor farther from all is out_of_domain [mm]."
    )


def answer(table: InfluenceTable, request: StressRequest) -> Columns:
    """Charge and stress on each sensor."""
    found = stress_answer(table, read_request(request.model_dump()))
    reach = found.reach_mm if found.reach_mm == found.reach_mm else None
    return Columns(
        rows=len(found.sensors),
        model="linear_layer",
        table_sha256=table.sha256,
        inside=found.inside,
        shared={"sensor": list(found.sensors), "reach_mm": reach},
        columns=found.columns,
    )


EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "d33_pc_per_n": 14.0,
    "sensors": [{"id": "s01", "x_mm": 0.0, "y_mm": 0.0}, {"id": "s02", "x_mm": 8.0, "y_mm": 0.0}],
    "contacts": [
        {"x_mm": 0.5, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0},
        {"x_mm": 7.0, "y_mm": 1.0, "indenter_radius_mm": 4.0, "normal_force_n": 2.0, "tangential_force_n": [0.5, 0.0]},
    ],
}

_SCHEMA = {"$ref": "#/components/schemas/StressRequest"}
_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": StressAnswer, "content": {"text/csv": {}}}}


@router.post(
    "/stress",
    operation_id="stress",
    summary="Charge on every sensor of an array",
    responses=_ANSWER,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": _SCHEMA, "example": EXAMPLE}},
        }
    },
)
async def stress(request: Request, table: Table, accept: Accept = "application/json") -> Response:
    """Linear superposition over all loads: off-centre, several, sheared, ν < 0.5, a yielding glue line."""

    def work(_: SigmaTable, asked: StressRequest) -> Columns:
        return answer(influence_table(request.app.state.settings.tables), asked)

    return await columns_route(StressRequest, work)(request, table, accept)
