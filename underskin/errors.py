"""Everything that underskin raises on purpose.

UnderskinError
├── InvalidInput      a value that cannot be used: names the field, the value and what is allowed
├── FileError         a file that cannot be read: names the file and the place in it
├── TableError        a table that is missing, damaged, altered or of another schema
├── ExtensionError    a mechanism or file format of another package that cannot be used: names package and field
├── SolverError       a finite-element solve that did not converge: names the point
├── ServiceError      an answer of the server that is not a success (raised by the client)
└── Unreachable       no answer from the server: nothing listens there, or time ran out (raised by the client)
"""

from typing import Any


class UnderskinError(Exception):
    """Base of all errors raised on purpose."""


class InvalidInput(UnderskinError, ValueError):
    """A value that cannot be used.

    Attributes: `field` (the name the user knows), `index` (row in a column, or None), `value`, `allowed`
    (what would be accepted, in words).
    """

    def __init__(self, field: str, value: Any, allowed: str, index: int | None = None) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        self.index = index
        place = field if index is None else f"{field}[{index}]"
        super().__init__(f"{place} = {value!r}: {allowed}")


class FileError(UnderskinError):
    """A file that cannot be read.

    Attributes: `file` (the name the user knows), `place` (line, field or byte; empty where the whole file is meant),
    `reason`.
    """

    def __init__(self, file: str, place: str, reason: str) -> None:
        self.file = file
        self.place = place
        self.reason = reason
        super().__init__(": ".join(part for part in (file, place, reason) if part))


class TableError(UnderskinError):
    """A table that cannot be trusted or read; the message says why and what to do."""


class ExtensionError(UnderskinError):
    """Something that another package adds and that cannot be used.

    Attributes: `package` (with its version), `name` (of the mechanism or file format), `field`, `reason`.
    """

    def __init__(self, package: str, name: str, field: str, reason: str) -> None:
        self.package = package
        self.name = name
        self.field = field
        self.reason = reason
        super().__init__(f"{name!r} of the package {package} cannot be used: {field}: {reason}")

    def __reduce__(self) -> tuple[type["ExtensionError"], tuple[str, str, str, str]]:
        """It crosses from worker processes."""
        return type(self), (self.package, self.name, self.field, self.reason)


class SolverError(UnderskinError):
    """A finite-element solve that did not converge, even with smaller steps; the message names the point."""


class ServiceError(UnderskinError):
    """The server refused or failed; carries the RFC 9457 problem (`problem`) and the HTTP `status`."""

    def __init__(self, status: int, problem: dict[str, Any]) -> None:
        self.status = status
        self.problem = problem
        super().__init__(f"{status} {problem.get('title', '')}: {problem.get('detail', '')}")


class Unreachable(UnderskinError):
    """No answer came from the service; the message names its address and the reason."""
