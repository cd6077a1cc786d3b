"""What /frf and /d33 share: the skin and what presses it, in columns, and what reaches the sensor."""

from typing import ClassVar, Literal

from pydantic import Field

from service.answers import AnswerInColumns
from service.columns import ColumnsRequest, NonNegative, Positive
from service.problems import Refusal
from underskin import InvalidInput

FIELDS = (
    "thickness_mm",
    "youngs_modulus_mpa",
    "sensor_radius_mm",
    "poisson_ratio",
    "indenter_radius_mm",
    "preload_n",
)


class PressedSkinColumns(ColumnsRequest):
    """A skin pressed by a sphere."""

    constants: ClassVar[frozenset[str]] = frozenset({"model", "skin_id", "units_checked"})

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
    units_checked: bool = Field(
        default=False, description="Accept magnitudes that look like a slip of units (2.5 m, 16 Pa)."
    )


class PressedSkinAnswer(AnswerInColumns):
    """What reaches the sensor, row by row."""

    contact_radius_mm: list[float | None] = Field(description="Hertz contact radius a [mm].")
    a_over_h: list[float | None] = Field(description="a/h [-].")
    rt_over_h: list[float | None] = Field(description="rT/h [-].")
    load_parameter: list[float | None] = Field(description="L = F/(R² E) [-].")
    sigma: list[float | None] = Field(description="σ [-].")
    rel_error: list[float | None] = Field(description="Bound on σ's relative error [-].")
    mean_stress_mpa: list[float | None] = Field(
        description="Static mean stress on the sensor, 3Fσ/(2πh²), positive in compression [MPa]."
    )


def require_known_model(request: PressedSkinColumns) -> None:
    """Refuses a model that does not exist: no skin has an adopted one."""
    if request.model == "adopted":
        if request.skin_id is None:
            raise InvalidInput("skin_id", None, "is required with model adopted")
        raise Refusal(404, f"Skin {request.skin_id!r} has no adopted model; use model paper.")
    if request.skin_id is not None:
        raise InvalidInput("skin_id", request.skin_id, "is used only with model adopted")
