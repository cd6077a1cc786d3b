"""Errors as RFC 9457 problems, in one shape over all routes (UM-Bridge's protocol has its own)."""

import math
import reprlib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from http import HTTPStatus
from itertools import islice
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, Field, ValidationError

from underskin.errors import ErrorCode, InvalidInput, SeveralInvalid

_MOST_LOGGED = 3
_MOST_LISTED_ERRORS = 100  # errors of one body
_MOST_FIELDS = 200  # of one body: no request has a quarter of them, and each unknown one is an error
RETRY_LATER = {"Retry-After": "5"}  # seconds
MEDIA_TYPE = "application/problem+json"
_Model = TypeVar("_Model", bound=BaseModel)


class FieldError(BaseModel):
    """What is wrong with one value."""

    code: ErrorCode = Field(description="The kind of error; docs/findings.md explains each.", examples=["out_of_range"])
    field: str = Field(description="Name of the field.", examples=["preload_n"])
    index: int | None = Field(description="Row in the column, from 0; null for a single value.", examples=[3])
    value: Any = Field(description="What was sent; null where nothing was.", examples=[-1.0])
    allowed: str = Field(description="What would be accepted.", examples=["must be finite and greater than 0 (N)"])


class Problem(BaseModel):
    """An error (RFC 9457)."""

    type: str = Field(description="What kind of problem, as a URN.", examples=["urn:underskin:problem:invalid-input"])
    title: str = Field(description="The kind in words.", examples=["Invalid input"])
    status: int = Field(description="The HTTP status.", examples=[422])
    detail: str = Field(description="What happened and what to do.")
    request_id: str = Field(description="Finds this request in the server's log; also in X-Request-ID.")
    errors: list[FieldError] = Field(
        description="The values that were refused, the first hundred of them; empty for other problems."
    )


class Refusal(Exception):
    """Ends a request with a problem; `errors` as in `Problem`."""

    def __init__(
        self,
        status: int,
        detail: str,
        *,
        title: str | None = None,
        errors: Sequence[Mapping[str, Any]] = (),
        headers: Mapping[str, str] | None = None,
    ) -> None:
        self.status = status
        self.detail = detail
        self.title = title or HTTPStatus(status).phrase
        self.errors = errors
        self.headers = dict(headers or {})
        super().__init__(detail)

    def status_for(self, path: str) -> int:
        """Status of the answer to `path`: UM-Bridge knows only 400 for invalid content."""
        return 400 if self.status == 422 and _is_umbridge(path) else self.status

    def in_log(self) -> str | None:
        """For the log: the rejected fields and what is allowed, never the values, which may be secret."""
        if self.status < HTTPStatus.BAD_REQUEST:
            return None
        if not self.errors:
            return self.detail
        shown = [f"{error['field']}: {error['allowed']}" for error in self.errors[:_MOST_LOGGED]]
        more = len(self.errors) - len(shown)
        return "; ".join([*shown, *([f"and {more} more"] if more > 0 else [])])

    def media_type(self, path: str) -> str:
        """Content-Type of the answer to `path`."""
        return "application/json" if _is_umbridge(path) else MEDIA_TYPE

    def body(self, path: str, request_id: str) -> bytes:
        """The problem document, or UM-Bridge's own form under /umbridge."""
        if _is_umbridge(path):
            error = {"type": self.title.title().replace(" ", ""), "message": self.detail}
            return orjson.dumps({"error": error})
        name = self.title.lower().replace(" ", "-")
        return orjson.dumps(
            {
                "type": f"urn:underskin:problem:{name}",
                "title": self.title,
                "status": self.status,
                "detail": self.detail,
                "request_id": request_id,
                "errors": self.errors,
            }
        )


_API = ("/v1/", "/umbridge/", "/health", "/ready", "/metrics", "/openapi.json")


def is_browsing(path: str, accept: str) -> bool:
    """Whether a browser asks for a page, so that an error is answered as a page."""
    return "text/html" in accept and not path.startswith(_API)


def _is_umbridge(path: str) -> bool:
    return path.startswith("/umbridge/")


def invalid_input(errors: Iterable[InvalidInput]) -> Refusal:
    """The problem of invalid values, of which the first hundred are listed: 422."""
    remaining = iter(errors)
    shortened = [_shortened(error) for error in islice(remaining, _MOST_LISTED_ERRORS)]
    more = sum(1 for _ in remaining)
    entries = [
        {
            "code": str(error.code),
            "field": error.field,
            "index": error.index,
            "value": _in_json(error.value),
            "allowed": error.allowed,
        }
        for error in shortened
    ]
    detail = "; ".join([*map(str, shortened), *([f"and {more:,} more"] if more else [])])
    return Refusal(422, detail, title="Invalid input", errors=entries)


def _shortened(error: InvalidInput) -> InvalidInput:
    return InvalidInput(
        _brief(error.field), _brief(error.value), _writable(error.allowed), error.index, code=error.code
    )


def given_twice(field: str, part: str) -> Refusal:
    """The problem of a repeated key in a JSON object, at `part`: 422."""
    name = _brief(field)
    allowed = f"is given twice: must be given once in its object; it comes again at {part}"
    error = {"code": str(ErrorCode.NOT_UNIQUE), "field": name, "index": None, "value": None, "allowed": allowed}
    return Refusal(422, f"{name} {allowed}", title="Invalid input", errors=[error])


def unexpected() -> Refusal:
    """The problem of an unexpected error: 500."""
    return Refusal(500, "Something went wrong in the server; its log has the request's id.")


def from_validation(errors: ValidationError | Sequence[Any]) -> Refusal:
    """The same problem from pydantic's list of errors."""
    return invalid_input(_listed(errors))


def require_few_fields(document: Any) -> None:
    """Raises Refusal (422) where a body has more fields than any request."""
    if isinstance(document, dict) and len(document) > _MOST_FIELDS:
        raise Refusal(
            422, f"The body has {len(document):,} fields; no request has more than {_MOST_FIELDS}.",
            title="Invalid input",
        )  # fmt: skip


def _listed(errors: ValidationError | Sequence[Any]) -> Iterator[InvalidInput]:
    details = errors.errors(include_url=False) if isinstance(errors, ValidationError) else errors
    return map(_as_invalid_input, details)


def _guessed(error: InvalidInput, names: Collection[str]) -> InvalidInput:
    """The error; for an unknown field with the most similar known one."""
    unknown = error.code == ErrorCode.UNKNOWN_FIELD and error.field not in names
    close = _nearest(error.field, names) if unknown else None
    if close is None:
        return error
    return InvalidInput(error.field, error.value, f"{error.allowed}; did you mean {close}?", code=error.code)


def _nearest(name: str, names: Collection[str]) -> str | None:
    return next(iter(get_close_matches(name.lower(), names, n=1)), None)


def validated(kind: type[_Model], document: Any) -> _Model:
    """The model of a document; raises Refusal with all errors."""
    require_few_fields(document)
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise invalid_input(_guessed(error_of_field, kind.model_fields) for error_of_field in _listed(error)) from None


def parsed(kind: type[_Model], document: Any) -> _Model:
    """The model of a document; raises SeveralInvalid with all errors."""
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise SeveralInvalid([_shortened(error_of_field) for error_of_field in _listed(error)]) from None


# Of pydantic's errors the code and, where a lab's words are clearer than pydantic's, those.
_CODES = {
    "greater_than": (ErrorCode.OUT_OF_RANGE, ""),
    "greater_than_equal": (ErrorCode.OUT_OF_RANGE, "must be at least {ge:g}"),
    "less_than": (ErrorCode.OUT_OF_RANGE, ""),
    "less_than_equal": (ErrorCode.OUT_OF_RANGE, "must be at most {le:g}"),
    "missing": (ErrorCode.REQUIRED, "is required"),
    "extra_forbidden": (ErrorCode.UNKNOWN_FIELD, "is not a field of this request"),
    "float_type": (ErrorCode.WRONG_TYPE, "must be a number (NaN and null are not)"),
    "float_parsing": (ErrorCode.WRONG_TYPE, "must be a number"),
    "model_type": (ErrorCode.WRONG_TYPE, "must be a JSON object with the fields as columns"),
    "bool_type": (ErrorCode.WRONG_TYPE, "must be true or false"),
    "bool_parsing": (ErrorCode.WRONG_TYPE, "must be true or false"),
    "finite_number": (ErrorCode.NOT_FINITE, "must be finite"),
    "literal_error": (ErrorCode.NOT_ONE_OF, ""),
    "too_short": (ErrorCode.TOO_FEW, "must not be empty"),
}
_NOT_FIELDS = {"body", "query", "scalar", "column"}


def _as_invalid_input(detail: Mapping[str, Any]) -> InvalidInput:
    path = [part for part in detail["loc"] if part not in _NOT_FIELDS]
    names = [part for part in path if isinstance(part, str)]
    indices = [part for part in path if isinstance(part, int)]
    message = str(detail["msg"])
    code, words = _CODES.get(detail["type"], (ErrorCode.INVALID_VALUE, ""))
    if detail["type"] == "too_short" and detail["ctx"]["min_length"] > 1:
        words = f"must have at least {detail['ctx']['min_length']} entries"
    return InvalidInput(
        names[0] if names else "body",
        None if detail["type"] == "missing" else detail.get("input"),
        words.format(**detail.get("ctx", {})) or message[:1].lower() + message[1:],
        index=indices[0] if indices else None,
        code=code,
    )


def _brief(value: Any) -> Any:
    """A rejected value, shortened: a whole batch may have been sent in place of a number."""
    if isinstance(value, int) and abs(value) >= 2**53:
        return "a very large integer"
    if value is None or isinstance(value, int | float):
        return value
    text = _writable(value if isinstance(value, str) else reprlib.repr(value))
    return text if len(text) <= 80 else text[:77] + "..."


def _writable(text: str) -> str:
    """Half of a surrogate pair, which JSON can escape, cannot be written as UTF-8."""
    return text.encode("utf-8", "replace").decode()


def _in_json(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def unknown_name(name: str, value: str, names: Collection[str], noun: str) -> InvalidInput:
    """The error of a name that is none of those `names`; `noun`: what such a name is, such as a query parameter."""
    if not names:
        words = ", which has none"
    else:
        close = _nearest(name, names)
        guess = f"; did you mean {close}?" if close else "."
        words = f"{guess} Known: {', '.join(names)}"
    return InvalidInput(name, value, f"is not a {noun} of this request{words}", code=ErrorCode.UNKNOWN_FIELD)
