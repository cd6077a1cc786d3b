"""Requests and answers of UM-Bridge 1.0."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema

_Zero = Annotated[int, Field(strict=True, ge=0, le=0)]
# Of a long one the first wrong number is told: as many errors as numbers would hold up all other requests.
_Vector = Annotated[list[Annotated[float, Field(strict=True, allow_inf_nan=False)]], Field(fail_fast=True)]
_EXAMPLE = [[0.3, 0.6, 0.01]]

# Checked by the route, since the protocol has an error of its own for another name.
_Name = Annotated[str, WithJsonSchema({"type": "string", "enum": ["sigma", "frf"]})]


class ModelRequest(BaseModel):
    """Which model is asked."""

    model_config = ConfigDict(extra="ignore")

    name: _Name = Field(description="Which model.", examples=["sigma"])
    config: dict[str, Any] = Field(default_factory=dict, description="Not used by these models.")


class Evaluation(ModelRequest):
    """Where to evaluate."""

    input: list[_Vector] = Field(
        description="One vector: a/h, rT/h, L for `sigma`; mm, MPa, mm, mm, N, pC/N for `frf`.",
        examples=[_EXAMPLE],
        fail_fast=True,
        json_schema_extra={"minItems": 1, "maxItems": 1},
    )


class Derivative(Evaluation):
    """Where to differentiate: which output, which input."""

    outWrt: _Zero = Field(default=0, description="Which output: there is one.")
    inWrt: _Zero = Field(default=0, description="Which input vector: there is one.")


class GradientRequest(Derivative):
    """Where to differentiate, and the sensitivity of an objective to the output."""

    sens: _Vector = Field(description="∂objective/∂output, one number.", examples=[[1.0]])


class JacobianRequest(Derivative):
    """Where to differentiate, and in which direction."""

    vec: _Vector = Field(description="Direction in the space of inputs.", examples=[[1.0, 0.0, 0.0]])


class HessianRequest(ModelRequest):
    """Not supported by these models."""


class Info(BaseModel):
    """The protocol and the models."""

    protocolVersion: float = Field(description="1.0")
    models: list[str] = Field(description="Names of the models.")


class ModelInfo(BaseModel):
    """What a model can do."""

    support: dict[str, bool] = Field(description="Operation by operation.")


class InputSizes(BaseModel):
    """Lengths of the input vectors."""

    inputSizes: list[int] = Field(description="One vector.")


class OutputSizes(BaseModel):
    """Lengths of the output vectors."""

    outputSizes: list[int] = Field(description="One number.")


class Values(BaseModel):
    """Output vectors."""

    output: list[list[float]] = Field(description="One vector of one number.")


class Vector(BaseModel):
    """A vector."""

    output: list[float] = Field(description="The product with the Jacobian.")
