"""Every error that a route raises, as a problem."""

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from service.openapi import methods
from service.problems import Refusal, from_validation, invalid_input, unexpected
from underskin import InvalidInput


def install_handlers(api: FastAPI) -> None:
    """One shape for what we raise, what FastAPI raises, and what nobody expected."""
    api.add_exception_handler(Refusal, _handle)
    api.add_exception_handler(InvalidInput, _handle)
    api.add_exception_handler(RequestValidationError, _handle)
    api.add_exception_handler(HTTPException, _handle)
    api.add_exception_handler(Exception, _handle)


async def _handle(request: Request, error: Exception) -> Response:
    refusal = _as_refusal(request, error)
    path = request.scope["path"]
    content = refusal.body(path, request.scope["request_id"])
    return Response(content, refusal.status_for(path), headers=refusal.headers, media_type=refusal.media_type(path))


def _as_refusal(request: Request, error: Exception) -> Refusal:
    match error:
        case Refusal():
            return error
        case HTTPException(__cause__=Refusal() as refusal):  # FastAPI wraps what ends the reading of a body
            return refusal
        case HTTPException(__cause__=ClientDisconnect()):
            return Refusal(499, "The client left before its body was complete.", title="Client closed request")
        case InvalidInput():
            return invalid_input([error])
        case RequestValidationError():
            return from_validation(error.errors())
        case HTTPException(status_code=404):
            return Refusal(404, f"There is nothing at {request.url.path}; /openapi.json lists all routes.")
        case HTTPException(status_code=405):
            allowed = {"Allow": ", ".join(methods(request.app, request.scope["route"].path))}
            return Refusal(405, f"{request.url.path} does not take {request.method}.", headers=allowed)
        case HTTPException():
            return Refusal(error.status_code, str(error.detail), headers=error.headers)
        case _:
            return unexpected()
