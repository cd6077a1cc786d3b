"""Columns out: one answer as JSON (null where there is no value) or as CSV (NaN there)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
import orjson
from fastapi import Header, Response
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from service.columns import Status
from underskin.findings.codes import FindingCode
from underskin.units import Floats

Accept = Annotated[str, Header(description="`text/csv` returns the columns as CSV with NaN; otherwise JSON with null.")]


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

    def status(self) -> list[Status]:
        """`ok` or `out_of_domain`, row by row."""
        if self.inside.all():
            return ["ok"] * self.rows
        inside = np.broadcast_to(self.inside, (self.rows,)).tolist()
        return ["ok" if row else "out_of_domain" for row in inside]

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
        header: list[str] = list(self.names)
        cells: list[list[str]] = [list(map(_quoted, texts)) for texts in self.names.values()]
        for name in self.columns:
            values = self.full(name)
            if values.ndim == 1:
                header.append(name)
                cells.append(_texts(values))
            elif self.line_hz is not None:
                header += [f"{name}[{frequency!r} Hz]" for frequency in self.line_hz.tolist()]
                cells += [_texts(line) for line in values.T]
        cells.append(list(self.status()))
        lines = [",".join([*header, "status"]), *map(",".join, zip(*cells, strict=True)), ""]
        return "\r\n".join(lines).encode()


def _texts(values: Floats) -> list[str]:
    return ["NaN" if value != value else repr(value) for value in values.tolist()]


def _quoted(text: str) -> str:
    """A text as a cell, quoted where it must be (RFC 4180)."""
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',"\r\n') else text


def wants_csv(accept: str) -> bool:
    """Whether an Accept header prefers text/csv to JSON."""
    weights = {"text/csv": 0.0, "application/json": 0.0, "application/*": 0.0, "*/*": 0.0}
    for part in accept.split(","):
        media_type, *parameters = (piece.strip() for piece in part.lower().split(";"))
        weight = next((value[2:] for value in parameters if value.startswith("q=")), "1")
        if media_type in weights:
            weights[media_type] = float(weight) if weight.replace(".", "", 1).isdecimal() else 0.0
    csv_weight = weights.pop("text/csv")
    return csv_weight > 0 and csv_weight >= max(weights.values())


def respond(answer: Columns, accept: str, *, one: bool = False) -> Response:
    """The answer in the form that the client asked for; beside CSV, model and table travel as headers."""
    if not wants_csv(accept):
        return Response(answer.json_of_one() if one else answer.json(), media_type="application/json")
    table = {} if answer.table_sha256 is None else {"Underskin-Table-SHA256": answer.table_sha256}
    return Response(answer.csv(), media_type="text/csv", headers={"Underskin-Model": answer.model, **table})
