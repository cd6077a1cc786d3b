"""Bodies of requests: JSON, and columns as JSON or CSV."""

from typing import Any, TypeVar

from pydantic_core import from_json

from service.middleware.unique_keys import require_unique_keys
from service.problems import Refusal, validated
from service.schemas.columns import ColumnsRequest
from underskin.errors import ErrorCode, InvalidInput, wrong_type
from underskin.prediction.columns import CsvError, from_csv

RequestKind = TypeVar("RequestKind", bound=ColumnsRequest)


def parse(kind: type[RequestKind], body: bytes, content_type: str) -> RequestKind:
    """The request in `body`; raises Refusal 400 (unreadable), 415 (another type) or 422 (a field is wrong)."""
    fields = (
        _from_csv(kind, body)
        if _media_type(content_type) == "text/csv"
        else json_document(body, content_type, " or text/csv")
    )
    return validated(kind, fields)


def json_document(body: bytes, content_type: str, also: str = "") -> Any:
    """What a JSON body holds; raises Refusal 400 (unreadable), 422 (a key comes twice) or 415 (another type).

    `also` says what else is read.
    """
    media_type = _media_type(content_type)
    if media_type not in ("", "application/json"):
        raise Refusal(415, f"Content-Type {media_type!r} cannot be read; send application/json{also}.")
    try:
        document = from_json(body)  # reads NaN too, so that it is refused by field and row
    except ValueError as error:
        raise Refusal(400, f"The body is not JSON: {error}.") from None
    require_unique_keys(body)
    return document


def _media_type(content_type: str) -> str:
    return content_type.split(";", 1)[0].strip().lower()


def _from_csv(kind: type[ColumnsRequest], body: bytes) -> dict[str, Any]:
    try:
        columns = from_csv(body.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise Refusal(400, f"The body is not CSV in UTF-8: {error}.") from None
    except CsvError as error:
        raise Refusal(400, f"The CSV of the body {error}.") from None
    return {name: _cells(kind, name, cells) for name, cells in columns.items()}


def _cells(kind: type[ColumnsRequest], name: str, cells: list[str]) -> Any:
    if name in kind.json_only:
        raise wrong_type(name, cells[0], "cannot be sent as CSV; send application/json")
    if name in kind.constants:
        return _constant(name, cells)
    numbers = []
    for row, cell in enumerate(cells):
        try:
            numbers.append(float(cell))
        except ValueError:
            raise wrong_type(name, cell, index=row) from None
    return numbers


def _constant(name: str, cells: list[str]) -> str | bool:
    for row, cell in enumerate(cells):
        if cell != cells[0]:
            raise InvalidInput(
                name, cell, f"must be the same in every row ({cells[0]!r})", row, code=ErrorCode.CONFLICTING
            )
    return {"true": True, "false": False}.get(cells[0].lower(), cells[0])
