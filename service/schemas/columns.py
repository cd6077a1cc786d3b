"""Columns. A field of a request is a number for all rows, or a list with an entry a row; an answer is JSON, null where
there is no value, or CSV or NumPy's .npz, NaN there.
"""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import orjson
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, Discriminator, Field, InstanceOf, Tag, WithJsonSchema

from service.schemas.base import StrictRequest
from underskin.findings.codes import FindingCode
from underskin.prediction.columns import limits_and_statuses, statuses, to_csv
from underskin.prediction.pressed_skin import Words
from underskin.units import Floats

_ROWS_AT_ONCE = 65_536  # that become JSON in one call

Status = Literal["ok", "out_of_domain"]


def _kind(value: object) -> str:
    if isinstance(value, np.ndarray):
        return "array"
    return "column" if isinstance(value, list) else "scalar"


def _schema(**bounds: float) -> dict[str, Any]:
    number = {"type": "number", **bounds}
    return {"oneOf": [number, {"type": "array", "items": number, "minItems": 1}]}


_Number = Annotated[float, Field(strict=True)]
_Column = Annotated[
    Annotated[_Number, Tag("scalar")]
    | Annotated[list[_Number], Field(min_length=1, fail_fast=True), Tag("column")]
    | Annotated[InstanceOf[Floats], Tag("array")],  # a column whose type was checked where it was read
    Discriminator(_kind),
]
# pydantic checks types only, since it would report every bad row; values are checked as arrays, below and in underskin.
Signed = Annotated[_Column, WithJsonSchema(_schema())]
NonNegative = Annotated[_Column, WithJsonSchema(_schema(minimum=0))]
Positive = Annotated[_Column, WithJsonSchema(_schema(exclusiveMinimum=0))]


# Plain lists of numbers, shared by all rows or one a row.
Numbers = Annotated[list[_Number], Field(fail_fast=True)]
NumbersPerRow = Annotated[list[Numbers], Field(fail_fast=True)]


class ColumnsRequest(StrictRequest):
    """A request in columns. Subclasses name the fields that are not columns, since these are read otherwise."""

    # The same text or boolean in every row of a CSV body, and lists of numbers, which CSV cannot carry.
    constants: ClassVar[frozenset[str]] = frozenset({"model"})
    lists: ClassVar[frozenset[str]] = frozenset()

    @classmethod
    def is_column(cls, name: str) -> bool:
        """Whether this field is a number for all rows or a column."""
        return name in cls.model_fields and name not in cls.constants | cls.lists

    def column(self, name: str) -> Floats:
        """A field as an array: shape () for a scalar, (rows,) for a column."""
        return np.asarray(getattr(self, name), dtype=float)


class AnswerInColumns(BaseModel):
    """What every answer in columns says."""

    model: str = Field(description="The model that answered.")
    table_sha256: str | None = Field(description="SHA-256 of the table that was read; null where none was.")
    status: list[Status] = Field(
        description="Per row: `ok`, or `out_of_domain` (values that depend on σ are null, never extrapolated)."
    )

    limit: list[str | None] | None = Field(
        default=None,
        description="Of each row that is `out_of_domain` which limit it exceeds, with the highest force where a force "
        "does it; null where all rows are `ok`.",
        examples=[[None, "L = 1.17 exceeds 0.1: at most 25.6 N"]],
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
    go before the others. `limits`: of each row that is not inside which limit it exceeds.
    """

    rows: int
    model: str
    table_sha256: str | None
    inside: NDArray[np.bool_]
    columns: Mapping[str, Floats]
    shared: Mapping[str, Any] = field(default_factory=dict)
    line_hz: Floats | None = None
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)
    limits: Words | None = None

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
            "limit": self.limits,
            "status": _json_of_statuses(np.broadcast_to(self.inside, (self.rows,))),
        }
        if self.rows <= _ROWS_AT_ONCE:
            return orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)
        parts = [b"{"]
        for name, value in document.items():
            parts += [orjson.dumps(name), b":", *_json_in_pieces(value), b","]
        return b"".join([*parts[:-1], b"}"])

    def json_of_one(self) -> bytes:
        """The only row as a JSON object of single values."""
        document = {
            "model": self.model,
            "table_sha256": self.table_sha256,
            **{name: self.full(name)[0] for name in self.columns},
            "limit": self.limits[0] if self.limits else None,
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
                columns |= {
                    f"{name}[{frequency!r} Hz]": line for frequency, line in zip(frequencies, values.T, strict=True)
                }
        return to_csv({**columns, **limits_and_statuses(self.inside, self.limits, self.rows)}, "\r\n").encode()

    def npz(self) -> bytes:
        """The answer as arrays in NumPy's .npz, uncompressed, by the names of the JSON; what is null there is left out.

        Model, hash, ids and findings, which are JSON themselves, are texts of shape ().
        """
        inside = np.broadcast_to(self.inside, (self.rows,))
        arrays: dict[str, ArrayLike | None] = {
            "model": self.model,
            "table_sha256": self.table_sha256,
            **self.shared,
            **self.names,
            **{name: self.full(name) for name in self.columns},
            "limit": None if self.limits is None else np.array([words or "" for words in self.limits]),
            "status": np.full(self.rows, "ok") if inside.all() else np.where(inside, "ok", "out_of_domain"),
        }
        if "findings" in self.shared:
            arrays["findings"] = orjson.dumps(self.shared["findings"]).decode()
        file = io.BytesIO()
        np.savez(file, allow_pickle=False, **{name: values for name, values in arrays.items() if values is not None})
        return file.getvalue()


def _json_in_pieces(value: Any) -> Iterator[bytes]:
    """A member's value as JSON; a column a few rows at a time, since other threads wait for each call."""
    if not isinstance(value, np.ndarray | list) or len(value) <= _ROWS_AT_ONCE:
        yield orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)
        return
    step = max(1, _ROWS_AT_ONCE // (value.shape[1] if isinstance(value, np.ndarray) and value.ndim > 1 else 1))
    for start in range(0, len(value), step):
        yield b"," if start else b"["
        yield orjson.dumps(value[start : start + step], option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]
    yield b"]"


def _json_of_statuses(inside: NDArray[np.bool_]) -> orjson.Fragment:
    """The list of statuses, without a Python object for each: equally long cells, then without their padding."""
    cells = np.where(inside, b'"ok",', b'"out_of_domain",').tobytes().translate(None, b"\0")
    return orjson.Fragment(b"[" + cells[:-1] + b"]")
