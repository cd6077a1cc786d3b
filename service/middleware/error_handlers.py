"""Turns every exception of a route into a problem document."""

from collections.abc import Callable, Sequence

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import DataError, IntegrityError, OperationalError
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Scope

from service.log import logger
from service.problems import (
    RETRY_LATER,
    Refusal,
    from_validation,
    invalid_input,
    is_browsing,
    unexpected,
)
from service.store import Conflict, Missing, StorageFailed, StorageFull, StoreMoved
from service.store.answers import OtherRequest
from service.store.engine import storage_failure
from underskin import InvalidInput, TableError
from underskin.errors import SeveralInvalid

_STATUS = {Missing: 404, Conflict: 409, OtherRequest: 422}

ProblemPage = Callable[[Refusal, str], Response]  # of a refusal and the request's id
Methods = Callable[[FastAPI, str], Sequence[str]]  # of a path


def install_handlers(api: FastAPI, problem_page: ProblemPage, methods: Methods) -> None:
    """One form for our exceptions, FastAPI's and unexpected ones; a page for browsers."""

    async def handle(request: Request, error: Exception) -> Response:
        refusal = _as_refusal(request, _of_the_disk(error) or error, methods)
        request.scope["why"] = refusal.in_log()
        return problem_response(request.scope, refusal, problem_page)

    ours = (Refusal, InvalidInput, TableError, RequestValidationError, HTTPException)
    for kind in (*ours, *_STATUS, StorageFailed, StoreMoved, DataError, IntegrityError, OperationalError, Exception):
        api.add_exception_handler(kind, handle)


def problem_response(scope: Scope, refusal: Refusal, problem_page: ProblemPage) -> Response:
    """A problem as the answer to a request, as a page for browsers."""
    path, request_id = scope["path"], scope["request_id"]
    if is_browsing(path, Headers(scope=scope).get("accept", "")):
        return problem_page(refusal, request_id)
    body, status = refusal.body(path, request_id), refusal.status_for(path)
    return Response(body, status, headers=refusal.headers, media_type=refusal.media_type(path))


def _of_the_disk(error: Exception) -> StorageFailed | None:
    """The problem of a disk error, such as on temporary files of long bodies, which FastAPI wraps."""
    cause = error.__cause__ if isinstance(error, HTTPException) else error
    return storage_failure(cause) if isinstance(cause, OSError) else None


def _as_refusal(request: Request, error: Exception, methods: Methods) -> Refusal:
    match error:
        case Refusal():
            return error
        case HTTPException(
            __cause__=Refusal() as refusal
        ):  # FastAPI wraps the exception that ends the reading of a body
            return refusal
        case HTTPException(__cause__=ClientDisconnect()):
            return Refusal(499, "The client left before its body was complete.", title="Client closed request")
        case SeveralInvalid():
            return invalid_input(error.errors)
        case InvalidInput():
            return invalid_input([error])
        case RequestValidationError():
            return _unreadable(error) or from_validation(error.errors())
        case HTTPException(status_code=404):
            return Refusal(404, f"There is nothing at {request.url.path}; /docs lists all routes.")
        case HTTPException(status_code=405):
            allowed = {"Allow": ", ".join(methods(request.app, request.scope["route"].path))}
            return Refusal(405, f"{request.url.path} does not take {request.method}.", headers=allowed)
        case HTTPException():
            return Refusal(error.status_code, str(error.detail), headers=error.headers)
        case _:
            return _of_the_store(request, error)


def _of_the_store(request: Request, error: Exception) -> Refusal:
    """The problem of exceptions of the store and of tables, and of unexpected ones."""
    match error:
        case Missing() | Conflict() | OtherRequest():
            return Refusal(_STATUS[type(error)], str(error))
        case StorageFull():
            return Refusal(507, "The disk is full: nothing of this request was kept. What is kept can be read.")
        case StorageFailed():
            logger.error("the disk failed: %s", error, extra={"fields": {"request_id": request.scope["request_id"]}})
            return Refusal(507, f"The disk takes nothing ({error}): nothing of this request was kept.")
        case StoreMoved():
            return Refusal(503, str(error), headers=RETRY_LATER)
        case TableError():
            return Refusal(503, str(error))
        case DataError():
            return Refusal(422, "A text has a character that cannot be kept, such as NUL.")
        case IntegrityError():
            wait = "look at what is there, and send it again."
            return Refusal(409, f"Another request kept the same at the same time: {wait}")
        case OperationalError():
            logger.error("the store failed: %s", error, extra={"fields": {"request_id": request.scope["request_id"]}})
            return Refusal(503, "The store does not answer; try again in a while.", headers=RETRY_LATER)
        case _:
            return unexpected()


def _unreadable(error: RequestValidationError) -> Refusal | None:
    """A body that is not JSON is not a field error."""
    reasons = [detail["ctx"]["error"] for detail in error.errors() if detail["type"] == "json_invalid"]
    return Refusal(400, f"The body is not JSON: {reasons[0]}.") if reasons else None
