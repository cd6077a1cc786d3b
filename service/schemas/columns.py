"""Requests in columns: a field is a number for all rows, or a list with an entry a row."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, WithJsonSchema

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
