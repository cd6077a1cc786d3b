"""All errors that underskin raises on purpose.

UnderskinError
├── InvalidInput      an invalid value: names the field, the value and what is allowed
│   └── SeveralInvalid    several of one input, reported together so that its author can correct all at once
├── FileError         an unreadable file: names the file and the place in it
├── TableError        a table that is missing, damaged, altered or of another schema
├── ExtensionError    an unusable mechanism or file format of another package: names package and field
├── SolverError       a finite-element solve that did not converge: names the point
├── ServiceError      an answer of the server that is not a success (raised by the client)
└── Unreachable       no answer from the server: nothing listens there, or time ran out (raised by the client)
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from http import HTTPStatus
from pathlib import Path
from typing import Any, Self


class ErrorCode(StrEnum):
    """The kind of an error of a value or a file; docs/findings.md explains each."""

    INVALID_VALUE = "invalid_value"
    REQUIRED = "required"
    UNKNOWN_FIELD = "unknown_field"
    WRONG_TYPE = "wrong_type"
    NOT_FINITE = "not_finite"
    OUT_OF_RANGE = "out_of_range"
    UNLIKELY_MAGNITUDE = "unlikely_magnitude"
    NOT_ONE_OF = "not_one_of"
    NOT_UNIQUE = "not_unique"
    NOT_INCREASING = "not_increasing"
    UNEQUAL_LENGTHS = "unequal_lengths"
    TOO_FEW = "too_few"
    CONFLICTING = "conflicting"
    UNUSABLE_SIGNAL = "unusable_signal"
    UNREADABLE_FILE = "unreadable_file"
    WHOLE_SKIN = "whole_skin"


@dataclass(frozen=True)
class Mention:
    """A field named in a requirement; `words` replace its name where users know it by another one."""

    field: str
    words: str = ""

    def __str__(self) -> str:
        return self.words or self.field


class Requirement(str):
    """The requirement that a value must meet: text, and mentions of other fields kept apart from it.

    As a string it holds the mentions as they are. An interface whose users know the fields by other names, such as a
    form, replaces them.
    """

    __slots__ = ("parts",)
    parts: tuple[str | Mention, ...]

    def __new__(cls, *parts: str | Mention) -> Self:
        """Parts that are requirements themselves are flattened."""
        flat = tuple(piece for part in parts for piece in (part.parts if isinstance(part, Requirement) else (part,)))
        requirement = super().__new__(cls, "".join(map(str, flat)))
        requirement.parts = flat
        return requirement

    def worded(self, word: Callable[[Mention], str]) -> str:
        """The sentence with each mention replaced by `word`."""
        return "".join(word(part) if isinstance(part, Mention) else part for part in self.parts)


UNITS_CHECKED = Mention("units_checked", " (or set units_checked to true)")  # which takes an unlikely magnitude


class UnderskinError(Exception):
    """Base of all errors raised on purpose."""


class InvalidInput(UnderskinError, ValueError):
    """An invalid value.

    Attributes: `field` (the name the user knows), `index` (row in a column, or None), `place` (both), `value`,
    `allowed` (what would be accepted, in words), `code` (the kind of error).
    """

    def __init__(
        self,
        field: str,
        value: Any,
        allowed: str,
        index: int | None = None,
        *,
        code: ErrorCode = ErrorCode.INVALID_VALUE,
    ) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        self.index = index
        self.code = code
        self.place = field if index is None else f"{field}[{index}]"
        super().__init__(f"{self.place}{'' if value is None else f' = {value!r}'}: {allowed}")

    def at(self, field: str) -> "InvalidInput":
        """The same error under another field name."""
        return InvalidInput(field, self.value, self.allowed, self.index, code=self.code)


def required(field: str, allowed: str = "required") -> InvalidInput:
    """A missing field."""
    return InvalidInput(field, None, allowed, code=ErrorCode.REQUIRED)


def wrong_type(field: str, value: Any, allowed: str = "must be a number", index: int | None = None) -> InvalidInput:
    """A value of the wrong type, such as a text for a number."""
    return InvalidInput(field, value, allowed, index, code=ErrorCode.WRONG_TYPE)


def out_of_range(field: str, value: Any, allowed: str, index: int | None = None) -> InvalidInput:
    """A number, or a size, outside the allowed range."""
    return InvalidInput(field, value, allowed, index, code=ErrorCode.OUT_OF_RANGE)


def not_finite(field: str, value: Any, allowed: str = "must be finite", index: int | None = None) -> InvalidInput:
    """NaN or infinity."""
    return InvalidInput(field, value, allowed, index, code=ErrorCode.NOT_FINITE)


def not_one_of(field: str, value: Any, allowed: Iterable[str]) -> InvalidInput:
    """A name that is not among the `allowed` ones."""
    names = tuple(allowed)
    prefix = "one of " if len(names) != 1 else ""
    return InvalidInput(field, value, f"must be {prefix}{', '.join(names)}", code=ErrorCode.NOT_ONE_OF)


def not_unique(field: str, value: Any, allowed: str = "must be given once") -> InvalidInput:
    """A repeated value, or a name that is in use."""
    return InvalidInput(field, value, allowed, code=ErrorCode.NOT_UNIQUE)


def unequal_lengths(field: str, size: int, expected: int, like: str, noun: str = "entries") -> InvalidInput:
    """A column of another length than the one called `like`."""
    allowed = Requirement(f"must have {expected} {noun}, as many as ", Mention(like))
    return InvalidInput(field, f"{size} {noun}", allowed, code=ErrorCode.UNEQUAL_LENGTHS)


def too_few(field: str, value: Any, allowed: str) -> InvalidInput:
    """Too few entries, samples or recordings."""
    return InvalidInput(field, value, allowed, code=ErrorCode.TOO_FEW)


def conflicting(field: str, value: Any, allowed: str) -> InvalidInput:
    """A value that contradicts another field."""
    return InvalidInput(field, value, allowed, code=ErrorCode.CONFLICTING)


def unusable(field: str, value: Any, allowed: str) -> InvalidInput:
    """A time series or curve from which nothing can be computed."""
    return InvalidInput(field, value, allowed, code=ErrorCode.UNUSABLE_SIGNAL)


def unreadable(field: str, file: Any, allowed: str) -> InvalidInput:
    """A file that cannot be read, as the value of a field."""
    return InvalidInput(field, file, allowed, code=ErrorCode.UNREADABLE_FILE)


class FileError(UnderskinError):
    """An unreadable file.

    Attributes: `file` (the name the user knows), `place` (line, field or byte; empty for the file as a whole),
    `reason`, `code` (the kind of error).
    """

    def __init__(self, file: str, place: str, reason: str, *, code: ErrorCode = ErrorCode.UNREADABLE_FILE) -> None:
        self.file = file
        self.place = place
        self.reason = reason
        self.code = code
        super().__init__(": ".join(part for part in (file, place, reason) if part))

    def of_field(self, field: str, file: str | None) -> InvalidInput:
        """The same error for a field whose value is the file, under the name that it was sent with."""
        allowed = ": ".join(part for part in (self.place, self.reason) if part)
        return InvalidInput(field, file, allowed, code=self.code)


def of_file(file: str, error: Exception) -> str:
    """An error on a file, or on one joined to it, in one line that begins with the file's name as the user gave it."""
    line = " ".join(str(error).split())
    if isinstance(error, FileError) and Path(error.file).name == Path(file).name:
        return file + line.removeprefix(error.file)
    return f"{file}: {line}"


@contextmanager
def damage_said(file: str, place: str, describe: Callable[[Exception], str]) -> Iterator[None]:
    """Convert any exception of a library on a damaged file into FileError; MemoryError is passed on."""
    try:
        yield
    except (MemoryError, FileError):
        raise
    except Exception as error:
        raise FileError(file, place, describe(error)) from None


class TableError(UnderskinError):
    """An untrusted or unreadable table; the message says why and what to do."""


class ExtensionError(UnderskinError):
    """An unusable extension of another package.

    Attributes: `package` (with its version), `name` (of the mechanism or file format), `field`, `reason`.
    """

    def __init__(self, package: str, name: str, field: str, reason: str) -> None:
        self.package = package
        self.name = name
        self.field = field
        self.reason = reason
        super().__init__(f"{name!r} of the package {package} cannot be used: {field}: {reason}")

    def __reduce__(self) -> tuple[type["ExtensionError"], tuple[str, str, str, str]]:
        """Make it picklable, for worker processes."""
        return type(self), (self.package, self.name, self.field, self.reason)


class SolverError(UnderskinError):
    """A finite-element solve that did not converge, even with smaller steps; the message names the point."""


_KEY = " (api_key of Client, --key or UNDERSKIN_API_KEY of the command line)"


class ServiceError(UnderskinError):
    """The server refused or failed; carries the RFC 9457 problem (`problem`) and the HTTP `status`."""

    def __init__(self, status: int, problem: dict[str, Any]) -> None:
        self.status = status
        self.problem = problem
        hint = _KEY if status == HTTPStatus.UNAUTHORIZED else ""
        super().__init__(f"{status} {problem.get('title', '')}: {problem.get('detail', '')}{hint}")

    @property
    def is_foreign(self) -> bool:
        """Whether another program answered, such as a proxy before the server."""
        return "type" not in self.problem


class Unreachable(UnderskinError):
    """No answer came from the service; the message names its address and the reason."""


class SeveralInvalid(InvalidInput):
    """The first of several `errors`, for callers that report one; as a text it is all of them."""

    def __init__(self, errors: Sequence[InvalidInput]) -> None:
        first = errors[0]
        super().__init__(first.field, first.value, first.allowed, first.index, code=first.code)
        self.errors = errors
        self.args = ("; ".join(map(str, errors)),)


def errors_of(error: InvalidInput) -> Sequence[InvalidInput]:
    """All errors of a SeveralInvalid, or the single one."""
    return error.errors if isinstance(error, SeveralInvalid) else [error]


@contextmanager
def noting(errors: list[InvalidInput]) -> Iterator[None]:
    """Append errors raised in the block to `errors`, and continue after it."""
    try:
        yield
    except InvalidInput as error:
        errors += errors_of(error)


def all_of(readings: Mapping[str, Callable[[], Any]]) -> dict[str, Any]:
    """The results of all readings; raises SeveralInvalid with the errors of any of them."""
    values: dict[str, Any] = {}
    wrong: list[InvalidInput] = []
    for name, reading in readings.items():
        with noting(wrong):
            values[name] = reading()
    if wrong:
        raise SeveralInvalid(wrong)
    return values
