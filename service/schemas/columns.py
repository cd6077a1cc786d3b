"""Columns in: JSON or CSV bodies into checked arrays. A scalar broadcasts; columns must be equally long."""

import csv
import io
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError, WithJsonSchema
from pydantic_core import from_json

from service.middleware.unique_keys import require_unique_keys
from service.problems import Refusal, from_validation
from underskin import InvalidInput
from underskin.units import Floats

Status = Literal["ok", "out_of_domain"]


def _kind(value: object) -> str:
    return "column" if isinstance(value, list) else "scalar"


def _schema(**bounds: float) -> dict[str, Any]:
    number = {"type": "number", **bounds}
    return {"oneOf": [number, {"type": "array", "items": number, "minItems": 1}]}


_Number = Annotated[float, Field(strict=True)]
_Column = Annotated[
    Annotated[_Number, Tag("scalar")] | Annotated[list[_Number], Field(min_length=1, fail_fast=True), Tag("column")],
    Discriminator(_kind),
]
# pydantic checks types only, since it would report every bad row; values are checked as arrays, below and in underskin.
Signed = Annotated[_Column, WithJsonSchema(_schema())]
NonNegative = Annotated[_Column, WithJsonSchema(_schema(minimum=0))]
Positive = Annotated[_Column, WithJsonSchema(_schema(exclusiveMinimum=0))]


# Plain lists of numbers, shared by all rows or one a row.
Numbers = Annotated[list[_Number], Field(fail_fast=True)]
NumbersPerRow = Annotated[list[Numbers], Field(fail_fast=True)]


class ColumnsRequest(BaseModel):
    """A request in columns. Subclasses name the fields that are not columns, so that CSV can treat them."""

    model_config = ConfigDict(extra="forbid", strict=True)

    # The same value in every row of a CSV body, and fields that only JSON can carry.
    constants: ClassVar[frozenset[str]] = frozenset({"model"})
    json_only: ClassVar[frozenset[str]] = frozenset()

    def column(self, name: str) -> Floats:
        """A field as an array: shape () for a scalar, (rows,) for a column."""
        return np.array(getattr(self, name), dtype=float)


Request = TypeVar("Request", bound=ColumnsRequest)


def rows(columns: Mapping[str, Floats]) -> int:
    """How many rows the columns have; raises InvalidInput that names two of different length."""
    first = None
    for name, values in columns.items():
        if values.ndim and first is None:
            first = name
        elif first is not None and values.ndim and len(values) != len(columns[first]):
            allowed = f"must have as many rows as {first} ({len(columns[first])}), or be a single number"
            raise InvalidInput(name, f"{len(values)} rows", allowed)
    return 1 if first is None else len(columns[first])


def parse(kind: type[Request], body: bytes, content_type: str) -> Request:
    """The request in `body`; raises Refusal 400 (unreadable), 415 (another type) or 422 (a field is wrong)."""
    fields = (
        _from_csv(kind, body)
        if _media_type(content_type) == "text/csv"
        else json_document(body, content_type, " or text/csv")
    )
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise from_validation(error) from None


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
        lines = list(csv.reader(io.StringIO(body.decode("utf-8-sig"), newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise Refusal(400, f"The body is not CSV in UTF-8: {error}.") from None
    lines = [line for line in lines if line]
    if len(lines) < 2:
        raise Refusal(400, "The body needs a header of field names and at least one row.")
    header = [name.strip() for name in lines[0]]
    if len(set(header)) != len(header):
        raise Refusal(400, "The header names a field twice.")
    if len(header) == 1 and any(separator in header[0] for separator in ";\t"):
        raise Refusal(400, "The header has no comma; separate cells by commas and write numbers with a point.")
    for number, line in enumerate(lines[1:]):
        if len(line) != len(header):
            raise Refusal(400, f"Row {number} has {len(line)} cells; the header has {len(header)}.")
    return {
        name: _cells(kind, name, list(cells)) for name, cells in zip(header, zip(*lines[1:], strict=True), strict=True)
    }


def _cells(kind: type[ColumnsRequest], name: str, cells: list[str]) -> Any:
    if name in kind.json_only:
        raise InvalidInput(name, cells[0], "cannot be told in CSV; send application/json")
    if name in kind.constants:
        return _constant(name, cells)
    numbers = []
    for row, cell in enumerate(cells):
        try:
            numbers.append(float(cell))
        except ValueError:
            raise InvalidInput(name, cell, "must be a number", index=row) from None
    return numbers


def _constant(name: str, cells: list[str]) -> str | bool:
    for row, cell in enumerate(cells):
        if cell != cells[0]:
            raise InvalidInput(name, cell, f"must be the same in every row ({cells[0]!r})", index=row)
    return {"true": True, "false": False}.get(cells[0].lower(), cells[0])
