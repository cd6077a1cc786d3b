"""The catalogue of mechanisms, and the lab's own in it."""

from typing import Annotated, Any

import orjson
import yaml
from fastapi import APIRouter, Path, Request
from starlette.concurrency import run_in_threadpool

from service.dependencies import Store
from service.middleware.json_bodies import require_unique_keys
from service.problems import Refusal, validated
from service.schemas.mechanisms import KeepFound, MechanismEntry, MechanismList
from service.usecases import mechanisms as usecase
from underskin.errors import FileError
from underskin.mechanisms.declared.document import LARGEST_BYTES

router = APIRouter(prefix="/v1", tags=["mechanisms"])

EXAMPLE: dict[str, Any] = {
    "schema": "mechanism/1",
    "name": "loose_cable",
    "description": "A cable that comes loose takes its share of the charge from some recording on.",
    "acts_on": "gain",
    "axes": ["order"],
    "law": "1 - lost * step(order - onset)",
    "parameters": {
        "lost": {"unit": "-", "low": 0, "high": 0.5, "limit": 0},
        "onset": {"unit": "-", "low": 0, "high": 1000},
    },
    "source": "Our own rig.",
}
_YAML = ("application/yaml", "application/x-yaml", "text/yaml", "text/plain")
_TEXT = {"type": "string"}
_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "A document `mechanism/1` as YAML or JSON; or, as JSON, the diagnosis whose law is to be kept.",
        "content": {
            "application/yaml": {
                "schema": _TEXT,
                "example": yaml.safe_dump({**EXAMPLE, "name": "loose_plug"}, sort_keys=False),
            },
            "application/json": {
                "schema": {
                    "type": "object",
                    "description": "With `diagnosis_id` and `name` the law that a diagnosis found, else `mechanism/1`.",
                    "properties": {
                        "diagnosis_id": {**_TEXT, "description": "A diagnosis whose report has `unnamed`."},
                        "name": {**_TEXT, "description": "Lower case letters, digits and _."},
                        "description": {**_TEXT, "description": "One sentence on what it is."},
                        "schema": {**_TEXT, "description": "`mechanism/1`."},
                    },
                },
                "example": EXAMPLE,
            },
        },
    }
}


@router.get("/mechanisms", summary="The catalogue of mechanisms")
def mechanisms() -> MechanismList:
    """Every mechanism that diagnoses know by name: underskin's, those of other packages, and the lab's own."""
    return MechanismList(mechanisms=usecase.entries(), unusable=usecase.unusable())


@router.post("/mechanisms", summary="Keep one of the lab's own", status_code=201, openapi_extra=_BODY)
async def keep_mechanism(request: Request, store: Store) -> MechanismEntry:
    """Diagnoses that are asked for from now on know it by name; 409 where the name is taken. Its law is an expression,
    of which no code is ever executed."""
    body = await request.body()
    if len(body) > LARGEST_BYTES:
        raise Refusal(413, f"A mechanism may have up to {LARGEST_BYTES} bytes.")
    law = _law_of_diagnosis(request.headers.get("content-type", _YAML[0]), body)
    try:
        if law is None:
            return await run_in_threadpool(usecase.keep, body)
        return await run_in_threadpool(store.read, usecase.keep_found, law.diagnosis_id, law.name, law.description)
    except FileError as error:
        raise error.of_field("mechanism", None) from None


@router.delete("/mechanisms/{name}", summary="Discard one of the lab's own")
def discard_mechanism(
    name: Annotated[str, Path(description="Of one of the lab's own mechanisms.")], store: Store
) -> MechanismEntry:
    """Diagnoses know it no more; its file is kept apart, and reports that name it stay as they are. 409 where it is
    not the lab's own, or a model in force needs it."""
    return store.read(usecase.discard, name)


def _law_of_diagnosis(content_type: str, body: bytes) -> KeepFound | None:
    """The diagnosis whose law is to be kept; None where the body is a document of its own."""
    kind = content_type.partition(";")[0].strip().lower()
    if kind in _YAML:
        return None
    if kind != "application/json":
        raise Refusal(415, f"{kind} is no mechanism: send application/yaml or application/json.")
    try:
        document = orjson.loads(body)
    except orjson.JSONDecodeError as error:
        raise Refusal(400, f"The body is not JSON: {error.msg}.") from None
    require_unique_keys(body)
    is_request = isinstance(document, dict) and "schema" not in document
    return validated(KeepFound, document) if is_request else None
