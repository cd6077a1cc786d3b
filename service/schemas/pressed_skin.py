"""A skin pressed by a sphere, in columns, and what reaches its sensor: common to `/v1/frf` and `/v1/d33`."""

from typing import ClassVar, Literal

from pydantic import Field

from service.schemas.columns import ColumnsRequest, NonNegative, Positive, Signed
from service.schemas.columns_answer import AnswerInColumns

FIELDS = ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio", "indenter_radius_mm", "preload_n")
ADOPTED_COLUMNS = ("offset_x_mm", "offset_y_mm", "dynamic_force_n", "dwell_s", "load_cycles")


class PressedSkinColumns(ColumnsRequest):
    """A skin pressed by a sphere."""

    constants: ClassVar[frozenset[str]] = frozenset({"model", "skin_id", "sensor", "units_checked"})

    thickness_mm: Positive = Field(description="Thickness h of the layer over the sensors [mm].")
    youngs_modulus_mpa: Positive = Field(description="Young's modulus E of the layer [MPa].")
    sensor_radius_mm: Positive = Field(description="Radius rT of a sensor [mm].")
    poisson_ratio: NonNegative = Field(
        default=0.5, description="Poisson's ratio ν, 0 to 0.5 [-]. Rows other than 0.5 are out_of_domain."
    )
    indenter_radius_mm: Positive = Field(description="Radius R of the sphere [mm].")
    preload_n: Positive = Field(description="Static force F [N].")
    model: Literal["paper", "adopted"] = Field(
        default="paper",
        description="`paper`: Hertz radius on a half space, σ of the bonded finite-strain layer, flat FRF. "
        "`adopted`: the model adopted for `skin_id`.",
    )
    skin_id: str | None = Field(default=None, description="The skin whose adopted model is meant.")
    sensor: str | None = Field(
        default=None, description="The sensor pressed, the same in all rows; with an adopted model that needs it."
    )
    offset_x_mm: Signed | None = Field(
        default=None, description="The sphere's place from the sensor's centre, along x; with an adopted model [mm]."
    )
    offset_y_mm: Signed | None = Field(
        default=None, description="The sphere's place from the sensor's centre, along y; with an adopted model [mm]."
    )
    dynamic_force_n: Positive | None = Field(
        default=None, description="Amplitude of the oscillating force; with an adopted model that needs it [N]."
    )
    dwell_s: NonNegative | None = Field(
        default=None, description="Time the preload has been held; with an adopted model that needs it [s]."
    )
    load_cycles: NonNegative | None = Field(
        default=None, description="Load cycles the skin has seen; with an adopted model that needs it [-]."
    )
    units_checked: bool = Field(
        default=False, description="Accept magnitudes that look like a slip of units (2.5 m, 16 Pa)."
    )


class PressedSkinAnswer(AnswerInColumns):
    """What reaches the sensor, row by row."""

    model_id: str | None = Field(default=None, description="The adopted model that answered; only with that model.")
    contact_radius_mm: list[float | None] = Field(
        description="Hertz contact radius a; null with an adopted model, whose contact may be another [mm]."
    )
    a_over_h: list[float | None] = Field(description="a/h; null with an adopted model [-].")
    rt_over_h: list[float | None] = Field(description="rT/h [-].")
    load_parameter: list[float | None] = Field(description="L = F/(R² E); null with an adopted model [-].")
    sigma: list[float | None] = Field(
        description="σ; of an adopted model the one that FRF = d33 · (3/2) (rT/h)² σ asks for on the plateau [-]."
    )
    rel_error: list[float | None] = Field(
        description="Bound on σ's relative error; of an adopted model its relative standard uncertainty within the "
        "range of the campaign that was diagnosed [-]."
    )
    mean_stress_mpa: list[float | None] = Field(
        description="Static mean stress on the sensor, 3Fσ/(2πh²), positive in compression; null with an adopted "
        "model [MPa]."
    )
