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
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """The answer in a JSON object; nothing is checked, since the server did."""
        values = {name: _value(hint, document.get(name)) for name, hint in _hints(cls).items()}
        return cls(document=document, **values)

    def __getitem__(self, name: str) -> Any:
        return self.document[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.document)

    def __len__(self) -> int:
        return len(self.document)


@dataclass(frozen=True, eq=False, kw_only=True)
class Sensor(Document):
    """A sensor of the array."""

    id: str
    """Its name, one of its own."""

    x_mm: float
    """Its centre along the skin's length [mm]."""

    y_mm: float
    """Its centre along the skin's width [mm]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Skin(Document):
    """The skin as a campaign declares it (`campaign/1`); None where it does not say."""

    poisson_ratio: float
    """Poisson's ratio ν of the elastomer, 0 to 0.5 [-]."""

    id: str | None
    """Its name, one of its own."""

    thickness_mm: float | None
    """Thickness h of the layer over the sensors [mm]."""

    youngs_modulus_mpa: float | None
    """Young's modulus E of the layer [MPa]."""

    sensor_radius_mm: float | None
    """Radius rT of a sensor [mm]."""

    d33_pc_per_n: float | None
    """Piezoelectric coefficient d33 [pC/N]."""

    width_mm: float | None
    """Extent of the skin along y [mm]."""

    length_mm: float | None
    """Extent of the skin along x [mm]."""

    tolerances: Mapping[str, float] | None
    """Standard deviations of the declared thickness, sensor radius and modulus [%]."""

    sensors: tuple[Sensor, ...] | None
    """The sensors of the array."""


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
    return hint.from_json(value) if isinstance(hint, type) and issubclass(hint, Document) else value
