"""UM-Bridge 1.0: the protocol by which tools for uncertainty quantification call models, gradients included.

`config` is read by no model.
"""

import numpy as np
from fastapi import APIRouter
from orjson import dumps, loads

from service.dependencies import Table
from service.middleware.asgi_middleware import HotRoute, are_numbers
from service.middleware.json_bodies import JsonRoute
from service.problems import Refusal
from service.schemas import umbridge as models
from service.usecases.umbridge_models import MODELS, UmbridgeModel
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

router = APIRouter(prefix="/umbridge", tags=["umbridge"], route_class=JsonRoute)


@router.get("/Info", summary="Protocol and models")
async def umbridge_info() -> models.Info:
    """Version of the protocol, and the models' names."""
    return models.Info(protocolVersion=1.0, models=list(MODELS))


@router.post("/ModelInfo", summary="What a model supports")
async def umbridge_model_info(request: models.ModelRequest) -> models.ModelInfo:
    """Values and first derivatives."""
    _model(request)
    return models.ModelInfo(support={"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False})


@router.post("/InputSizes", summary="Lengths of the inputs")
async def umbridge_input_sizes(request: models.ModelRequest) -> models.InputSizes:
    """One vector."""
    return models.InputSizes(inputSizes=[len(_model(request).inputs)])


@router.post("/OutputSizes", summary="Lengths of the outputs")
async def umbridge_output_sizes(request: models.ModelRequest) -> models.OutputSizes:
    """One number."""
    _model(request)
    return models.OutputSizes(outputSizes=[1])


@router.post("/Evaluate", summary="A model's value")
async def umbridge_evaluate(request: models.Evaluation, table: Table) -> models.Values:
    """σ or the FRF [pC/N] at one point."""
    model = _model(request)
    return models.Values(output=[[model.value(table, _point(model, request))]])


@router.post("/Gradient", summary="Gradient of a model")
async def umbridge_gradient(request: models.GradientRequest, table: Table) -> models.Vector:
    """sens · ∂output/∂input."""
    slopes = _slopes(table, request)
    _require(len(request.sens) == 1, "sens must have length 1")
    return models.Vector(output=_finite_product(slopes, np.broadcast_to(request.sens, slopes.shape)).tolist())


@router.post("/ApplyJacobian", summary="Derivative along a direction")
async def umbridge_apply_jacobian(request: models.JacobianRequest, table: Table) -> models.Vector:
    """∂output/∂input · vec."""
    slopes = _slopes(table, request)
    _require(len(request.vec) == slopes.size, f"vec must have length {slopes.size}")
    return models.Vector(output=[float(_finite_product(slopes, np.array(request.vec)).sum())])


@router.post("/ApplyHessian", summary="Not supported")
async def umbridge_apply_hessian(request: models.HessianRequest) -> models.Vector:
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
            value = table.at(*point) if plain else None
        except (ValueError, TypeError, KeyError):
            return None
        return None if value is None else dumps({"output": [[value[0]]]})

    return one


def _model(request: models.ModelRequest) -> UmbridgeModel:
    if request.name not in MODELS:
        raise Refusal(400, f"There is no model {request.name!r}; there are {list(MODELS)}.", title="Model not found")
    return MODELS[request.name]


def _point(model: UmbridgeModel, request: models.Evaluation) -> list[float]:
    names = ", ".join(model.inputs)
    _require(len(request.input) == 1, f"input must be one vector: [[{names}]]")
    _require(len(request.input[0]) == len(model.inputs), f"the input vector must be [{names}]")
    return request.input[0]


def _slopes(table: SigmaTable, request: models.Derivative) -> Floats:
    model = _model(request)
    return model.gradient(table, _point(model, request))


def _finite_product(slopes: Floats, factors: Floats) -> Floats:
    """Component by component; a slope that is infinite, ∂σ/∂L at L = 0, is refused unless it is not asked for."""
    is_needed = factors != 0
    _require(
        bool(np.isfinite(slopes[is_needed]).all()),
        "the derivative in load_parameter is infinite at 0, where sigma grows with its cube root; use a value above 0",
    )
    with np.errstate(over="ignore"):
        product = np.multiply(slopes, factors, where=is_needed, out=np.zeros_like(slopes))
    _require(bool(np.isfinite(product.sum())), "the product is too large for a double")
    return product


def _require(holds: bool, message: str) -> None:
    if not holds:
        raise Refusal(400, message, title="Invalid input")
