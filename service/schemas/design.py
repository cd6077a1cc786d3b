"""A skin before it is built: what is asked, and what is answered."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.base import PressedSkin
from underskin.surrogate.sigma_table import ContactName

Axis = Literal["a_over_h", "rt_over_h", "load_parameter"]


class DesignRequest(PressedSkin):
    """A skin of an incompressible layer, a sphere that presses it, and the pitch of its array."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

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
        "a load above a sensor, so that they are resolved [%].",
    )
    contact: ContactName = Field(
        default="solved",
        description="`solved`: spheres in frictionless contact with the layer itself. `paper`: Hertz' pressure of a "
        "half space, as a dead load.",
    )
    units_checked: bool = Field(default=False, description="Accept magnitudes that look like a slip of units.")


class DesignDemand(BaseModel):
    """What a skin is to resolve, under which contact, and what can be made."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    resolution_mm: float = Field(gt=0, le=50, description="Largest two-point separation [mm].")
    preload_n: float = Field(gt=0, description="Force F of each of two spheres [N].")
    indenter_radius_mm: float = Field(gt=0, description="Their radius R [mm].")
    youngs_modulus_mpa: float = Field(gt=0, description="Young's modulus E of the layer, incompressible [MPa].")
    d33_pc_per_n: float = Field(gt=0, description="d33 of the sensors [pC/N].")
    dip_percent: float = Field(gt=0, le=100, description="As in `DesignRequest` [%].")
    thinnest_mm: float = Field(ge=0, le=1e3, description="The thinnest layer that can be made [mm].")
    least_pitch_mm: float = Field(ge=0, le=1e4, description="The smallest pitch that can be made [mm].")
    least_frf_pc_per_n: float = Field(ge=0, le=1e6, description="Least charge over force above a sensor [pC/N].")


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

    contact: ContactName = Field(description="As asked.")
    table_sha256: str = Field(description="SHA-256 of the table of this contact.")
    status: Literal["ok", "out_of_domain"] = Field(
        description="`out_of_domain`: outside the table, and null what depends on it; never extrapolated."
    )
    limit: str | None = Field(description="Which limit it exceeds, with the highest force; null where it is `ok`.")
    contact_radius_mm: float = Field(description="Radius a of the contact [mm].")
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
        description="From this distance on, two equal loads in line with a row of sensors are resolved wherever the "
        "row lies: a sensor between two others reads less than both by `dip_percent`; null where at this pitch they "
        "never are [mm]."
    )
    two_point_best_mm: float | None = Field(
        description="The smallest distance at which they are where the row lies best; not less than where the contacts "
        "touch [mm]."
    )
    response: ResponseAnswer = Field(description="Against the distance from the sensor.")
    sweeps: list[SweepAnswer] = Field(description="Against a/h, rT/h and L.")
