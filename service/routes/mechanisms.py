"""The catalogue of mechanisms, and the lab's own in it."""

from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Path, Request, Response
from starlette.concurrency import run_in_threadpool

from service.dependencies import WRITE, Store
from service.middleware.unique_keys import require_unique_keys
from service.problems import Refusal, validated
from service.schemas.mechanisms import KeepFound, MechanismEntry, MechanismList
from service.usecases import mechanisms as usecase
from underskin.errors import FileError
from underskin.mechanisms.declared.document import LARGEST_BYTES

router = APIRouter(prefix="/v1", tags=["mechanisms"])

_EXAMPLE = """\
schema: mechanism/1
name: warm_skin
description: The skin softens as it warms up.
acts_on: modulus
axes: [temperature_c]
law: 1 - softening * (temperature_c - 23)
parameters:
  softening: {unit: 1/°C, low: 0, high: 0.1, prior: {mean: 0.01, sd: 0.01}, limit: 0}
source: Our own measurements.
"""
_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "A document `mechanism/1` as YAML or JSON; or, as JSON, the diagnosis whose law is to be kept.",
        "content": {
            "application/yaml": {"schema": {"type": "string"}, "example": _EXAMPLE},
            "application/json": {
                "schema": KeepFound.model_json_schema(),
                "example": {"diagnosis_id": "d-0123456789abcdef", "name": "warm_skin"},
            },
        },
    }
}


@router.get("/mechanisms", operation_id="mechanisms", summary="The catalogue of mechanisms")
def listed() -> MechanismList:
    """Every mechanism that diagnoses know by name: underskin's, those of other packages, and the lab's own."""
    return MechanismList(mechanisms=usecase.entries())


@router.post(
    "/mechanisms",
    operation_id="keep_mechanism",
    summary="Keep one of the lab's own",
    status_code=201,
    dependencies=WRITE,
    openapi_extra=_BODY,
)
async def keep(request: Request, store: Store) -> MechanismEntry:
    """Diagnoses that are asked for from now on know it by name; 409 where the name is taken. Its law is an expression,
    of which no code is ever executed."""
    body = await request.body()
    found = _found(body)
    try:
        if found is None:
            return await run_in_threadpool(usecase.keep, body)
        return await run_in_threadpool(
            store.read, usecase.keep_found, found.diagnosis_id, found.name, found.description
        )
    except FileError as error:
        raise error.of_field("mechanism", None) from None


@router.delete(
    "/mechanisms/{name}",
    operation_id="discard_mechanism",
    summary="Discard one of the lab's own",
    status_code=204,
    dependencies=WRITE,
)
def discard(name: Annotated[str, Path(description="Of one of the lab's own mechanisms.")], store: Store) -> Response:
    """Diagnoses know it no more; its file is kept apart, and reports that name it stay as they are. 409 where it is
    not the lab's own, or a model in force needs it."""
    store.read(usecase.discard, name)
    return Response(status_code=204)


def _found(body: bytes) -> KeepFound | None:
    """The diagnosis whose law is to be kept; None where the body is a document of its own."""
    if len(body) > LARGEST_BYTES:
        raise Refusal(413, f"A mechanism may have up to {LARGEST_BYTES} bytes.")
    try:
        document = orjson.loads(body)
    except orjson.JSONDecodeError:
        return None
    require_unique_keys(body)
    if not isinstance(document, dict) or "schema" in document:
        return None
    return validated(KeepFound, document)
