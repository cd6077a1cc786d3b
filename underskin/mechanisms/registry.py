"""All mechanisms by name, in order of composition: of this package, of other packages, and of the lab.

A mechanism of this package is a module of `underskin.mechanisms.laws`; one of another package is named by an entry
point of the group `underskin.mechanisms`, as a subclass of `Mechanism` or an instance; the lab's are files
(`mechanism/1`) in the folder that `UNDERSKIN_MECHANISMS` names. Unusable files there are listed as refused, and
prevent any diagnosis.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from inspect import isclass
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from underskin import extensions
from underskin.errors import FileError, InvalidInput, not_one_of
from underskin.mechanisms import laws
from underskin.mechanisms.base import Kind, Mechanism

if TYPE_CHECKING:
    from underskin.recordings.campaign import Conditions
    from underskin.surrogate.sigma_table import SigmaTable

GROUP = "underskin.mechanisms"
_FORMER = {"amplitude_nonlinearity": "moving_contact_edge", "edge_mobility": "mobile_fraction"}


def current_name(name: str) -> str:
    """The name of a mechanism or parameter today, as stored reports and truths may hold an older one."""
    return _FORMER.get(name, name)


class Catalogue(Mapping[str, Mechanism]):
    """The mechanisms by name, in order of composition. Those of other packages are loaded at the first access.

    Every access raises ExtensionError where a mechanism of another package cannot be used. `refused` holds the
    errors of unusable files in the lab's folder.
    """

    def __init__(self) -> None:
        self._loaded: _Loaded | None = None

    def __getitem__(self, name: str) -> Mechanism:
        return self.load().mechanisms[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.load().mechanisms)

    def __len__(self) -> int:
        return len(self.load().mechanisms)

    def load(self) -> _Loaded:
        """The loaded catalogue, loading it if necessary; raises ExtensionError for an unusable mechanism of another
        package."""
        if self._loaded is None:
            self._loaded = _load()
        return self._loaded

    def reload(self) -> None:
        """Load the mechanisms of other packages and of the lab again; the former ones stay in use until that is
        done."""
        self._loaded = _load()

    @property
    def refused(self) -> Sequence[FileError]:
        """The errors of unusable files in the lab's folder."""
        return self.load().refused

    def require_complete(self) -> None:
        """Raise FileError where a file of the lab's folder cannot be used: without it a diagnosis would be another
        one."""
        for error in self.refused:
            raise FileError(error.file, error.place, error.reason, code=error.code)

    @property
    def packages(self) -> Mapping[str, str]:
        """Package and version of each mechanism that comes from another package, by its name."""
        return self.load().packages


CATALOGUE = Catalogue()


class ActiveCatalogue(Mapping[str, Mechanism]):
    """The mechanisms of one diagnosis: the catalogue without those left out, then laws bound to its recordings.

    Bound laws are added as a screening finds them.
    """

    def __init__(self, without: Collection[str] = ()) -> None:
        """Raises InvalidInput where `without` is not in the catalogue, FileError where a file of the lab cannot be
        used."""
        CATALOGUE.require_complete()
        without = [current_name(name) for name in without]
        for name in without:
            if name not in CATALOGUE:
                raise not_one_of("without", name, CATALOGUE)
        self._named = {name: mechanism for name, mechanism in CATALOGUE.items() if name not in without}
        self._bound: dict[str, Mechanism] = {}
        self.without = tuple(name for name in CATALOGUE if name in without)

    def __getitem__(self, name: str) -> Mechanism:
        return self._named[name] if name in self._named else self._bound[name]

    def __iter__(self) -> Iterator[str]:
        yield from self._named
        yield from self._bound

    def __len__(self) -> int:
        return len(self._named) + len(self._bound)

    @property
    def named(self) -> Mapping[str, Mechanism]:
        """The mechanisms of the catalogue."""
        return self._named

    def bind(self, conditions: Conditions, table: SigmaTable, kind: Kind) -> None:
        """Bind the lab's mechanisms to the recordings of this diagnosis, which are of one kind."""
        from underskin.mechanisms.declared.mechanism import DeclaredMechanism  # the models, which few callers need

        for name, mechanism in self._named.items():
            if isinstance(mechanism, DeclaredMechanism) and kind in mechanism.kinds:
                self._named[name] = mechanism.bind(conditions, table)

    def replace(self, mechanism: Mechanism) -> None:
        """Use another form of a mechanism of the catalogue, unless it is left out."""
        if mechanism.name in self._named:
            self._named[mechanism.name] = mechanism

    def add(self, law: Mechanism) -> None:
        """Add a law that is bound to the recordings of this diagnosis."""
        self._bound[law.name] = law


@cache
def built_in() -> tuple[Mechanism, ...]:
    """The mechanisms of this package in order of composition."""
    modules = [import_module(f"{laws.__name__}.{module.name}") for module in iter_modules(laws.__path__)]
    return _in_order(
        value()
        for module in modules
        for value in vars(module).values()
        if isclass(value) and issubclass(value, Mechanism) and value.__module__ == module.__name__
    )


@dataclass(frozen=True)
class _Loaded:
    mechanisms: Mapping[str, Mechanism]
    packages: Mapping[str, str]
    refused: Sequence[FileError]


def _load() -> _Loaded:
    mechanisms = list(built_in())
    packages: dict[str, str] = {}
    for extension in extensions.load(GROUP):
        mechanism = _checked(extension, mechanisms)
        packages[mechanism.name] = extension.package
        mechanisms.append(mechanism)
    refused = _add_declared(mechanisms, packages) if os.environ.get("UNDERSKIN_MECHANISMS") else []
    return _Loaded({mechanism.name: mechanism for mechanism in _in_order(mechanisms)}, packages, refused)


def _add_declared(mechanisms: list[Mechanism], packages: dict[str, str]) -> list[FileError]:
    """Add the mechanisms of the lab's folder with their file names; return the errors of unusable ones."""
    from underskin.mechanisms.declared.document import in_folder  # the models, which few callers need

    folder = in_folder()
    refused = [*folder.refused]
    for declared, file in folder.mechanisms:
        if declared.name in {other.name for other in mechanisms}:
            refused.append(
                FileError(file.rsplit(" ", 1)[0], "name", f"{declared.name!r} is taken by another mechanism")
            )
            continue
        packages[declared.name] = file
        mechanisms.append(declared)
    return refused


def _checked(extension: extensions.Extension, others: list[Mechanism]) -> Mechanism:
    """The mechanism that an entry point names; raises ExtensionError where it breaks the contract."""
    from underskin.mechanisms.contract import check  # the models, which few callers need

    value = extension.value
    if not (isinstance(value, Mechanism) or (isclass(value) and issubclass(value, Mechanism))):
        raise extension.refused("the entry point", "must name a subclass of underskin.mechanisms.Mechanism")
    try:
        mechanism = value() if isclass(value) else value
    except TypeError as error:
        raise extension.refused("the class", f"must be made without arguments ({error})") from error
    name = getattr(mechanism, "name", None)
    try:
        check(mechanism, others)
    except InvalidInput as refusal:
        reason = f"{refusal.value!r}: {refusal.allowed}" if refusal.value is not None else refusal.allowed
        raise extension.refused(refusal.field, reason, str(name or extension.name)) from refusal
    return mechanism


def _in_order(mechanisms: Iterator[Mechanism] | list[Mechanism]) -> tuple[Mechanism, ...]:
    return tuple(sorted(mechanisms, key=lambda mechanism: mechanism.rank))
