"""σ: points in columns, or one."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.columns import AnswerInColumns, ColumnsRequest, NonNegative, Status

SigmaModelName = Literal["layer", "half_space"]

_A = "Contact radius over skin thickness, a/h [-]."
_RHO = "Sensor radius over skin thickness, rT/h [-]; 0 is a point sensor."
_LOAD = "L = F/(R² E) [-], which stands for finite strain; 0 is the linear layer. The half space does not use it."
_MODEL = "`layer`: incompressible, bonded to a rigid base, finite strain. `half_space`: Boussinesq, linear."


class SigmaColumns(ColumnsRequest):
    """Points in columns; a single number holds for all rows."""

    a_over_h: NonNegative = Field(description=_A)
    rt_over_h: NonNegative = Field(description=_RHO)
    load_parameter: NonNegative = Field(default=0.0, description=_LOAD)
    model: SigmaModelName = Field(default="layer", description=_MODEL)


class SigmaAnswer(AnswerInColumns):
    """σ in columns."""

    sigma: list[float | None] = Field(description="σ [-]: charge = d33 (3/2) (rT/h)² σ F.")
    rel_error: list[float | None] = Field(description="Bound on σ's relative error [-].")


class SigmaQuery(BaseModel):
    """One point."""

    model_config = ConfigDict(extra="forbid")

    a_over_h: float = Field(ge=0, allow_inf_nan=False, description=_A, examples=[0.3])
    rt_over_h: float = Field(ge=0, allow_inf_nan=False, description=_RHO, examples=[0.6])
    load_parameter: float = Field(default=0.0, ge=0, allow_inf_nan=False, description=_LOAD, examples=[0.01])
    model: SigmaModelName = Field(default="layer", description=_MODEL)


class OneSigma(BaseModel):
    """σ at one point."""

    model: str = Field(description="The model that answered.")
    table_sha256: str | None = Field(description="SHA-256 of the table that was read; null where none was.")
    sigma: float | None = Field(description="σ [-]: charge = d33 (3/2) (rT/h)² σ F; null outside the domain.")
    rel_error: float | None = Field(description="Bound on σ's relative error [-].")
    limit: str | None = Field(description="Which limit it exceeds; null where it is `ok`.")
    status: Status = Field(description="`ok`, or `out_of_domain`.")
