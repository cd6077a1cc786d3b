"""An answer of the service: fields with types for editors and type checkers, and the JSON object that came."""

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, Self, Union, get_args, get_origin, get_type_hints


@dataclass(frozen=True, eq=False, kw_only=True)
class Document(Mapping[str, Any]):
    """A JSON object of the HTTP interface; its fields are attributes, with their units in the names.

    As a mapping it is the object as it came, with what a newer server adds: `answer["id"]`, `dict(answer)`. An
    attribute that an older server does not answer is None, a list of it empty.
    """

    document: Mapping[str, Any] = field(repr=False)
    """The JSON object as it came."""

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> Self:
        """The answer in a JSON object; nothing is checked, since the server did."""
        values = {name: _value(hint, document.get(name)) for name, hint in _hints(cls).items()}
        return cls(document=document, **values)

    def __getitem__(self, name: str) -> Any:
        return self.document[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.document)

    def __len__(self) -> int:
        return len(self.document)


@cache
def _hints(kind: type[Document]) -> dict[str, Any]:
    """The type of each field."""
    hints = get_type_hints(kind)
    return {entry.name: hints[entry.name] for entry in fields(kind) if entry.name != "document"}


def _value(hint: Any, value: Any) -> Any:
    """A JSON value as a field of this type holds it."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        chosen = next((one for one in arguments if one is not type(None)), None)
        return None if value is None else _value(chosen, value)
    if origin is tuple:
        return tuple(_value(arguments[0], entry) for entry in value or ())
    if value is None:
        return None
    if origin is Mapping:
        return {name: _value(arguments[1], entry) for name, entry in value.items()}
    return hint.of(value) if isinstance(hint, type) and issubclass(hint, Document) else value
