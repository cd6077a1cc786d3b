"""The catalogue for display: each mechanism with its parameters, similar mechanisms, the diagnoses that found it,
and its file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from service.schemas.mechanisms import MechanismEntry
from service.store import Database
from service.usecases import mechanism_files, mechanisms
from service.usecases.mechanism_findings import FoundIn, findings
from underskin.diagnosis.data.names import EXPLAINED
from underskin.figures.law_effect import LawEffect, Twin, lacking, law_effect, law_twins
from underskin.mechanisms import Mechanism, Parameter
from underskin.mechanisms.declared.document import digest
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.mechanisms.unlisted.vocabulary import followed
from underskin.surrogate.sigma_table import SigmaTable

ALIKE = 0.7  # cosine from which on another mechanism is named
_MOST_TWINS = 4
_OTHER_AXES = {  # axes that no unlisted law follows
    "position_mm": "the place of the sphere",
    "phase": "the phase",
    "sample_height_mm": "the sample's height",
    "sample_diameter_mm": "the sample's diameter",
}


@dataclass(frozen=True)
class CatalogueEntry:
    """A mechanism. `twins`: mechanisms with a similar effect on the reference recordings, the most similar first; if
    there are none, `nearest` is the closest. `found`: diagnoses that state it with a probability that needs no
    alternative, `possible`: the number of diagnoses with less. `lacking`: why there is no picture of it; `file`: the
    document of a mechanism of the lab's own."""

    entry: MechanismEntry
    needs: str
    axes: Sequence[str]
    parameters: Sequence[Parameter]
    twins: Sequence[Twin]
    nearest: Twin | None
    found: Sequence[FoundIn]
    possible: int
    lacking: str | None
    file: str | None


@dataclass(frozen=True)
class Catalogue:
    """All entries, and the number of diagnoses that could have found one."""

    entries: Sequence[CatalogueEntry]
    diagnoses: int


def catalogue(store: Database, table: SigmaTable) -> Catalogue:
    """The present catalogue."""
    laws, listed = mechanisms.catalogue(), {item.name: item for item in mechanisms.entries()}
    alike, seen = _twins(table, digest()), findings(store)
    return Catalogue(
        [
            _entry(mechanism, listed[name], alike.get(name, ()), seen.by_mechanism.get(name, ()))
            for name, mechanism in laws.items()
        ],
        seen.diagnoses,
    )


def read_ahead(store: Database, table: SigmaTable) -> None:
    """Load what is slow at first use."""
    mechanisms.catalogue()
    _twins(table, digest())
    findings(store)


def effect(name: str, table: SigmaTable) -> LawEffect:
    """The effect of a mechanism on the reference rig; raises Unsupported if that lacks the quantity on which it
    depends."""
    return _effect(name, table, digest())


@lru_cache(maxsize=256)
def _effect(name: str, table: SigmaTable, _digest: str) -> LawEffect:
    return law_effect(name, table)


@lru_cache(maxsize=4)
def _twins(table: SigmaTable, _digest: str) -> Mapping[str, tuple[Twin, ...]]:
    return law_twins(table)


def _entry(
    mechanism: Mechanism, entry: MechanismEntry, alike: Sequence[Twin], occurrences: Sequence[FoundIn]
) -> CatalogueEntry:
    is_of_lab = isinstance(mechanism, DeclaredMechanism)
    by_name = {
        parameter.name: parameter
        for kind in mechanism.kinds
        for parameter in mechanism.parameters(reference_campaign(kind), kind)
    }
    return CatalogueEntry(
        entry,
        mechanism.needs,
        [_axis(name) for name in mechanism.axes],
        list(by_name.values()),
        [replace(twin, axes=tuple(map(_axis, twin.axes))) for twin in alike if twin.alike >= ALIKE][:_MOST_TWINS],
        alike[0] if alike else None,
        [occurrence for occurrence in occurrences if occurrence.probability >= EXPLAINED],
        sum(occurrence.probability < EXPLAINED for occurrence in occurrences),
        lacking(mechanism) if is_of_lab else None,
        _file(entry) if is_of_lab else None,
    )


def _axis(name: str) -> str:
    """An axis in words, a column of the lab's own by its heading."""
    return _OTHER_AXES[name] if name in _OTHER_AXES else followed(name)


def _file(entry: MechanismEntry) -> str | None:
    """The document from which a lab's own mechanism was read; None if it is gone."""
    assert entry.package is not None
    path: Path = mechanism_files.folder_of_lab() / entry.package.rsplit(" ", 1)[0]
    try:
        return path.read_bytes().decode("utf-8", "replace")
    except OSError:
        return None
