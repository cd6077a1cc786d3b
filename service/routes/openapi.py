"""The OpenAPI document: FastAPI's own, with the errors and the keys as they are here."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import orjson
from fastapi import APIRouter, FastAPI, Request
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel, Field

from service.auth.access_control import OPEN
from service.problems import MEDIA_TYPE, Problem, unexpected
from service.schemas.campaign_document import campaign_schemas
from service.schemas.design import DesignRequest
from service.schemas.pressed_skin import D33Columns, FrfColumns
from service.schemas.sigma import SigmaColumns
from service.schemas.stress import StressRequest

router = APIRouter(tags=["openapi"])

# What a server was asked and answered, by operation: scripts/openapi_examples.py writes it, of a server without it.
_EXAMPLES = Path(__file__).with_name("examples.json")

# Requests that routes read themselves, so that FastAPI does not know them.
_READ_BY_ROUTES = (SigmaColumns, FrfColumns, D33Columns, StressRequest, DesignRequest)

DESCRIPTION = """\
What is happening under the skin: σ, FRF and d33 of a piezoelectric electronic skin pressed by a sphere.

Units are spelled in the names (`_mm`, `_mpa`, `_n`, `_pc_per_n`, `_hz`). Requests to `/v1/sigma`, `/v1/frf` and
`/v1/d33` are in columns: a single number holds for all rows. A row outside the table is answered `out_of_domain` with
null, never extrapolated. `Accept: text/csv` returns columns as CSV, `Accept: application/x-npz` as NumPy's .npz, both
with NaN. Errors are RFC 9457 problems; under `/umbridge` they have the shape of that protocol.
"""


class UmbridgeError(BaseModel):
    """What is wrong."""

    type: str = Field(description="Kind of error.", examples=["InvalidInput"])
    message: str = Field(description="What happened and what to do.")


class UmbridgeProblem(BaseModel):
    """An error as UM-Bridge says it."""

    error: UmbridgeError


@router.get("/openapi.json", summary="This document")
async def openapi(request: Request) -> dict[str, Any]:
    """OpenAPI 3.1; says that a key is needed where one is."""
    described = dict(document(request.app))
    if request.app.state.access.keys_needed():
        described["security"] = [{"key": []}]
    return described


def methods(api: FastAPI, path: str) -> list[str]:
    """All methods of a path of the document; none where it has no such path."""
    return [method.upper() for method in document(api)["paths"].get(path, ())]


def document(api: FastAPI) -> dict[str, Any]:
    """The OpenAPI document without what depends on the keys."""
    return api.openapi_schema or _describe(api)


def _describe(api: FastAPI) -> dict[str, Any]:
    """The document without what depends on the keys; kept for the next time."""
    document = get_openapi(title=api.title, version=api.version, description=api.description, routes=api.routes)
    components = document["components"]
    components["schemas"].update(campaign_schemas())
    for model in (Problem, UmbridgeProblem, *_READ_BY_ROUTES):
        schema = model.model_json_schema(ref_template="#/components/schemas/{model}")
        components["schemas"].update(schema.pop("$defs", {}))
        components["schemas"][model.__name__] = schema
    for unused in ("HTTPValidationError", "ValidationError"):
        components["schemas"].pop(unused, None)
    components["securitySchemes"] = {
        "key": {"type": "http", "scheme": "bearer", "description": "`underskin key create NAME` makes one."}
    }
    examples = orjson.loads(_EXAMPLES.read_bytes()) if _EXAMPLES.exists() else {}
    for path, operations in document["paths"].items():
        for operation in operations.values():
            _add_examples(operation, examples.get(operation["operationId"], {}))
            _describe_errors(path, operation, examples)
    api.openapi_schema = document
    return document


def _add_examples(operation: dict[str, Any], example: Mapping[str, Any]) -> None:
    """Put what the server was asked and answered next to the schemas of an operation."""
    for parameter in operation.get("parameters", []):
        if parameter["name"] in example.get("given", {}):
            parameter["example"] = example["given"][parameter["name"]]
    body = operation.get("requestBody", {}).get("content", {}).get("application/json")
    if body is not None and "request" in example:
        body.setdefault("example", example["request"])
    (content,) = (answer["content"] for status, answer in operation["responses"].items() if status.startswith("2"))
    for media_type, name in (("application/json", "answer"), ("text/plain", "answer"), ("text/csv", "csv")):
        if media_type in content and name in example:
            content[media_type]["example"] = example[name]


def _describe_errors(path: str, operation: dict[str, Any], examples: Mapping[str, Any]) -> None:
    operation["responses"].pop("422", None)
    umbridge = path.startswith("/umbridge/")
    name, media_type = ("UmbridgeProblem", "application/json") if umbridge else ("Problem", MEDIA_TYPE)
    refused = examples.get("umbridge_problem" if umbridge else "problem", {}).get("answer")
    failed = orjson.loads(unexpected().body(path, "000000000000-1"))
    schema = {"$ref": f"#/components/schemas/{name}"}
    for status, meaning, example in (
        ("4XX", "The request is refused.", refused),
        ("5XX", "The server failed.", failed),
    ):
        content = {media_type: {"schema": schema, "example": example}}
        operation["responses"][status] = {"description": meaning, "content": content}
    if path in OPEN:
        operation["security"] = []
