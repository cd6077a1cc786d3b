"""UM-Bridge 1.0: the protocol by which tools for uncertainty quantification call models, gradients included.

Each model takes one vector, as the protocol's own wrappers for samplers expect, and returns one number:
`sigma` of [a_over_h, rt_over_h, load_parameter]; `frf` in pC/N of [thickness_mm, youngs_modulus_mpa, sensor_radius_mm,
indenter_radius_mm, preload_n, d33_pc_per_n], incompressible. `config` is read by neither.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter
from orjson import dumps, loads
from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema

from service.dependencies import Table
from service.middleware.asgi_middleware import HotRoute, are_numbers
from service.middleware.unique_keys import JsonRoute
from service.problems import Refusal
from underskin import Indenter, InvalidInput, Skin
from underskin.prediction.pressed_skin import frf_gradient, transmission
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import LAB, Floats, checked, to_lab

router = APIRouter(prefix="/umbridge", tags=["umbridge"], route_class=JsonRoute)

_Zero = Annotated[int, Field(strict=True, ge=0, le=0)]
_Vector = list[Annotated[float, Field(strict=True, allow_inf_nan=False)]]


@dataclass(frozen=True)
class _Model:
    """A function of one vector: its value, and its gradient."""

    inputs: tuple[str, ...]
    value: Callable[[SigmaTable, Sequence[float]], float]
    gradient: Callable[[SigmaTable, Sequence[float]], Floats]


def _sigma(table: SigmaTable, point: Sequence[float]) -> float:
    found = table.at(*point) if min(point) >= 0 else None
    if found is None:
        raise _outside(table)
    return found[0]


def _sigma_gradient(table: SigmaTable, point: Sequence[float]) -> Floats:
    _sigma(table, point)
    return np.array(table.gradient(*point))


def _pressed(point: Sequence[float]) -> tuple[Skin, Indenter, Floats, Floats]:
    thickness, modulus, sensor_radius, indenter_radius, preload, d33 = point
    skin = Skin.from_lab(thickness_mm=thickness, youngs_modulus_mpa=modulus, sensor_radius_mm=sensor_radius)
    indenter = Indenter.from_lab(indenter_radius_mm=indenter_radius)
    return skin, indenter, checked("preload_n", preload), checked("d33_pc_per_n", d33)


def _frf(table: SigmaTable, point: Sequence[float]) -> float:
    skin, indenter, preload, d33 = _pressed(point)
    value = float(to_lab("frf_pc_per_n", transmission(table, skin, indenter, preload).frf(d33)))
    if math.isnan(value):
        raise _outside(table)
    return value


def _frf_gradient(table: SigmaTable, point: Sequence[float]) -> Floats:
    _frf(table, point)
    skin, indenter, preload, d33 = _pressed(point)
    slopes = frf_gradient(table, skin, indenter, preload, d33)
    return np.array([to_lab("frf_pc_per_n", slopes[_bare(name)]) * LAB[name].to_si for name in _FRF_INPUTS])


def _bare(name: str) -> str:
    """A lab field's name without its unit, as the library names the quantity."""
    return {"d33_pc_per_n": "d33"}.get(name, name.rsplit("_", 1)[0])


_SIGMA_INPUTS = ("a_over_h", "rt_over_h", "load_parameter")
_FRF_INPUTS = (
    "thickness_mm",
    "youngs_modulus_mpa",
    "sensor_radius_mm",
    "indenter_radius_mm",
    "preload_n",
    "d33_pc_per_n",
)
_MODELS = {
    "sigma": _Model(_SIGMA_INPUTS, _sigma, _sigma_gradient),
    "frf": _Model(_FRF_INPUTS, _frf, _frf_gradient),
}
_EXAMPLE = [[0.3, 0.6, 0.01]]

# Checked by `_model`, since the protocol has an error of its own for another name.
_Name = Annotated[str, WithJsonSchema({"type": "string", "enum": list(_MODELS)})]


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
        json_schema_extra={"minItems": 1, "maxItems": 1},
    )


class _Derivative(Evaluation):
    outWrt: _Zero = Field(default=0, description="Which output: there is one.")
    inWrt: _Zero = Field(default=0, description="Which input vector: there is one.")


class GradientRequest(_Derivative):
    """Where to differentiate, and the sensitivity of an objective to the output."""

    sens: _Vector = Field(description="∂objective/∂output, one number.", examples=[[1.0]])


class JacobianRequest(_Derivative):
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


@router.get("/Info", operation_id="umbridge_info", summary="Protocol and models")
async def info() -> Info:
    """Version of the protocol, and the models' names."""
    return Info(protocolVersion=1.0, models=list(_MODELS))


@router.post("/ModelInfo", operation_id="umbridge_model_info", summary="What a model supports")
async def model_info(request: ModelRequest) -> ModelInfo:
    """Values and first derivatives."""
    _model(request)
    return ModelInfo(support={"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False})


@router.post("/InputSizes", operation_id="umbridge_input_sizes", summary="Lengths of the inputs")
async def input_sizes(request: ModelRequest) -> InputSizes:
    """One vector."""
    return InputSizes(inputSizes=[len(_model(request).inputs)])


@router.post("/OutputSizes", operation_id="umbridge_output_sizes", summary="Lengths of the outputs")
async def output_sizes(request: ModelRequest) -> OutputSizes:
    """One number."""
    _model(request)
    return OutputSizes(outputSizes=[1])


@router.post("/Evaluate", operation_id="umbridge_evaluate", summary="A model's value")
async def evaluate(request: Evaluation, table: Table) -> Values:
    """σ or the FRF [pC/N] at one point."""
    model = _model(request)
    return Values(output=[[model.value(table, _point(model, request))]])


@router.post("/Gradient", operation_id="umbridge_gradient", summary="Gradient of a model")
async def gradient(request: GradientRequest, table: Table) -> Vector:
    """sens · ∂output/∂input."""
    slopes = _slopes(table, request)
    _require(len(request.sens) == 1, "sens must have length 1")
    return Vector(output=_finite_product(slopes, np.broadcast_to(request.sens, slopes.shape)).tolist())


@router.post("/ApplyJacobian", operation_id="umbridge_apply_jacobian", summary="Derivative along a direction")
async def apply_jacobian(request: JacobianRequest, table: Table) -> Vector:
    """∂output/∂input · vec."""
    slopes = _slopes(table, request)
    _require(len(request.vec) == slopes.size, f"vec must have length {slopes.size}")
    return Vector(output=[float(_finite_product(slopes, np.array(request.vec)).sum())])


@router.post("/ApplyHessian", operation_id="umbridge_apply_hessian", summary="Not supported")
async def apply_hessian(request: HessianRequest) -> Vector:
    """Always refused, as the protocol says of models without second derivatives."""
    _model(request)
    raise Refusal(400, "ApplyHessian is not supported by this model.", title="Unsupported feature")


def hot_route(table: SigmaTable) -> HotRoute:
    """The plain case of `evaluate`: sigma inside the domain."""

    def one(body: bytes) -> bytes | None:
        try:
            request = loads(body)
            (point,) = request["input"]
            plain = request["name"] == "sigma" and type(request.get("config", {})) is dict
            plain = plain and len(point) == 3 and are_numbers(point)
            plain = plain and body.count(b":") == len(request)  # no key comes twice
            found = table.at(*point) if plain else None
        except (ValueError, TypeError, KeyError):
            return None
        return None if found is None else dumps({"output": [[found[0]]]})

    return one


def _model(request: ModelRequest) -> _Model:
    if request.name not in _MODELS:
        raise Refusal(400, f"There is no model {request.name!r}; there are {list(_MODELS)}.", title="Model not found")
    return _MODELS[request.name]


def _point(model: _Model, request: Evaluation) -> list[float]:
    names = ", ".join(model.inputs)
    _require(len(request.input) == 1, f"input must be one vector: [[{names}]]")
    _require(len(request.input[0]) == len(model.inputs), f"the input vector must be [{names}]")
    return request.input[0]


def _slopes(table: SigmaTable, request: _Derivative) -> Floats:
    model = _model(request)
    return model.gradient(table, _point(model, request))


def _finite_product(slopes: Floats, factors: Floats) -> Floats:
    """Component by component; a slope that is infinite, ∂σ/∂L at L = 0, is refused unless it is not asked for."""
    asked = factors != 0
    _require(
        bool(np.isfinite(slopes[asked]).all()),
        "the derivative in load_parameter is infinite at 0, where sigma grows with its cube root; use a value above 0",
    )
    with np.errstate(over="ignore"):
        product = np.multiply(slopes, factors, where=asked, out=np.zeros_like(slopes))
    _require(bool(np.isfinite(product.sum())), "the product is too large for a double")
    return product


def _require(holds: bool, message: str) -> None:
    if not holds:
        raise Refusal(400, message, title="Invalid input")


def _outside(table: SigmaTable) -> InvalidInput:
    domain = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in table.domain.items())
    return InvalidInput("input", "outside the domain", f"must lie inside {domain}")
