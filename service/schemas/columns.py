"""Columns. A field of a request is a number for all rows, or a list with an entry a row; an answer is JSON, null where
there is no value, or CSV, NaN there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import orjson
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, WithJsonSchema

from underskin.findings.codes import FindingCode
from underskin.prediction.columns import statuses, to_csv
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


class AnswerInColumns(BaseModel):
    """What every answer in columns says."""

    model: str = Field(description="The model that answered.")
    table_sha256: str | None = Field(description="SHA-256 of the table that was read; null where none was.")
    status: list[Status] = Field(
        description="Per row: `ok`, or `out_of_domain` (values that depend on σ are null, never extrapolated)."
    )


class FindingModel(BaseModel):
    """A value that looks wrong."""

    code: FindingCode = Field(description="The kind of finding; docs/findings.md explains each.")
    field: str = Field(description="Name of the field.")
    index: int | None = Field(description="First such row, from 0; null for a single value.")
    statement: str = Field(description="What is unusual, and a guess at the reason.")


@dataclass(frozen=True)
class Columns:
    """An answer: columns that broadcast to `rows`, which rows are inside the domain, and values for all rows.

    A column may have a second axis (lines of a spectrum), named by `line_hz`. `names`: columns of text, one a row, that
    go before the others.
    """

    rows: int
    model: str
    table_sha256: str | None
    inside: NDArray[np.bool_]
    columns: Mapping[str, Floats]
    shared: Mapping[str, Any] = field(default_factory=dict)
    line_hz: Floats | None = None
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def full(self, name: str) -> Floats:
        """A column in its full length, contiguous."""
        values = self.columns[name]
        shape = (self.rows, *values.shape[1:]) if values.ndim > 1 else (self.rows,)
        return np.ascontiguousarray(np.broadcast_to(values, shape))

    def status(self) -> list[str]:
        """`ok` or `out_of_domain`, row by row."""
        return statuses(self.inside, self.rows)

    def json(self) -> bytes:
        """The answer as a JSON object."""
        document = {
            "model": self.model,
            "table_sha256": self.table_sha256,
            **self.shared,
            **self.names,
            **{name: self.full(name) for name in self.columns},
            "status": self.status(),
        }
        return orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)

    def json_of_one(self) -> bytes:
        """The only row as a JSON object of single values."""
        document = {
            "model": self.model,
            "table_sha256": self.table_sha256,
            **{name: self.full(name)[0] for name in self.columns},
            "status": self.status()[0],
        }
        return orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)

    def csv(self) -> bytes:
        """The columns as CSV; a column of spectra becomes one CSV column a frequency, `name[10.0 Hz]`."""
        columns: dict[str, Floats | Sequence[str]] = dict(self.names)
        for name in self.columns:
            values = self.full(name)
            if values.ndim == 1:
                columns[name] = values
            elif self.line_hz is not None:
                frequencies = self.line_hz.tolist()
                columns |= {f"{name}[{one!r} Hz]": line for one, line in zip(frequencies, values.T, strict=True)}
        return to_csv({**columns, "status": self.status()}, "\r\n").encode()
