"""The stress in the layer under a sphere: what is asked, and what is answered."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.base import PressedSkin
from service.schemas.columns import Status
from underskin.surrogate.sigma_table import ContactName

MOST_RADII, MOST_DEPTHS = 301, 101


class FieldQuery(PressedSkin):
    """A skin and a sphere above the centre of a sensor, in lab units."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    poisson_ratio: float = Field(
        default=0.5,
        description="Poisson's ratio ν of the layer, 0 to 0.5. Below 0.5 the stress is that of the linear layer.",
    )
    contact: ContactName = Field(
        default="paper",
        description="`paper`: Hertz' pressure of a half space, as a dead load. `solved`: a sphere in frictionless "
        "contact with the layer itself, at ν = 0.5.",
    )
    r_points: int = Field(
        default=61, ge=2, le=MOST_RADII, description="Number of distances from the axis, evenly spaced from 0."
    )
    depth_points: int = Field(
        default=26, ge=2, le=MOST_DEPTHS, description="Number of depths, evenly spaced from the surface to the base."
    )
    units_checked: bool = Field(default=False, description="Accept magnitudes that look like a slip of units.")


class FieldAnswer(BaseModel):
    """The stress σ_zz in the layer: from the table on the base, approximate above; exact on the surface in the contact
    `paper`."""

    model: Literal["layer", "linear_layer"] = Field(
        description="`layer`: finite strain from the table, at ν = 0.5. `linear_layer`: small strain, at other ν."
    )
    contact: ContactName = Field(description="As asked.")
    table_sha256: str = Field(description="SHA-256 of the table of this contact, whose domain holds for both models.")
    status: Status = Field(
        description="`out_of_domain`: outside the table, and null what depends on it; never extrapolated."
    )
    limit: str | None = Field(description="Which limit it exceeds, with the highest force; null where it is `ok`.")
    contact_radius_mm: float | None = Field(
        description="Radius a of the contact; null of a solved one at ν other than 0.5 [mm]."
    )
    a_over_h: float | None = Field(description="a/h.")
    rt_over_h: float = Field(description="rT/h.")
    load_parameter: float = Field(description="L = F/(R²E).")
    sigma: float | None = Field(description="σ of the sensor, as POST /v1/frf has it.")
    rel_error: float | None = Field(description="Bound on its relative error; null where no table was read.")
    mean_stress_mpa: float | None = Field(
        description="Mean of −σ_zz over the sensor's disc, positive in compression [MPa]."
    )
    section_error: float | None = Field(
        description="Bound on the error of σ_zz between surface and base, over the largest stress at the same depth: "
        "what finite strain changes is tabulated on the base alone, and is added in proportion to the depth; null for "
        "`linear_layer`, which leaves finite strain out, and for the contact `solved`, of which no bound is known."
    )
    r_mm: list[float] | None = Field(description="Distances from the axis of the contact [mm].")
    depth_mm: list[float] | None = Field(
        description="Depths below the surface, the last is the base [mm]; before deformation, like r_mm."
    )
    sigma_zz_mpa: list[list[float]] | None = Field(
        description="Normal stress σ_zz per undeformed area, a row for each depth and a column for each distance; "
        "compression is negative [MPa]."
    )
