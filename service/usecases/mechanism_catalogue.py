"""The catalogue for display: each mechanism with its parameters, similar mechanisms, the diagnoses of this lab that
found it, of campaigns in their present state, and its file."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from weakref import WeakKeyDictionary

from sqlalchemy import Connection

from service.schemas.mechanisms import MechanismEntry
from service.store import Database, diagnosed_together, diagnoses
from service.store.tables import AnyRow, campaigns
from service.store.tables import diagnoses as rows_of_diagnoses
from service.usecases import mechanisms
from underskin.diagnosis.data.names import EXPLAINED
from underskin.figures.law_effect import LawEffect, Twin, lacking, law_effect, law_twins
from underskin.mechanisms import Mechanism, Parameter
from underskin.mechanisms.declared.document import digest
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.mechanisms.unlisted.vocabulary import followed
from underskin.surrogate.sigma_table import SigmaTable

_AT_ONCE = 50  # reports
_lock = threading.Lock()
_read_before: WeakKeyDictionary[Database, dict[str, tuple[tuple[str, float], ...]]] = WeakKeyDictionary()
ALIKE = 0.7  # cosine from which on another mechanism is named
_MOST_TWINS = 4
_OTHER_AXES = {  # axes that no unlisted law follows
    "position_mm": "the place of the sphere",
    "phase": "the phase",
    "sample_height_mm": "the sample's height",
    "sample_diameter_mm": "the sample's diameter",
}


@dataclass(frozen=True)
class FoundIn:
    """A diagnosis that states a mechanism with a probability (0 to 1); `name` is the campaign's, or what several are
    called."""

    diagnosis_id: str
    campaign_id: str | None
    skin_id: str
    name: str
    at: str
    verdict: str
    probability: float


@dataclass(frozen=True)
class Findings:
    """The occurrences of each mechanism by name, the latest first; and the number of diagnoses examined."""

    by_mechanism: Mapping[str, Sequence[FoundIn]]
    diagnoses: int


def findings(store: Database) -> Findings:
    """From the latest diagnosis of each campaign in use, and of campaigns together, that used all mechanisms; one
    whose campaigns are all in a later one is skipped."""
    latest = store.read(_latest)
    stated = _stated(store, {row.number: row.id for row in latest})
    by_law: dict[str, list[FoundIn]] = {}
    for row in latest:
        of_campaign = row.kind == "campaign"
        for name, probability in stated[row.id]:
            occurrence = FoundIn(
                row.id,
                row.campaign_id if of_campaign else None,
                row.skin_id,
                row.campaign_name if of_campaign else row.name,
                row.ended_at,
                row.verdict,
                probability,
            )
            by_law.setdefault(name, []).append(occurrence)
    return Findings(by_law, len(latest))


def _latest(connection: Connection) -> list[AnyRow]:
    done = (rows_of_diagnoses.c.state == "done") & (rows_of_diagnoses.c.without == "[]")
    query = diagnoses.rows().add_columns(campaigns.c.name.label("campaign_name")).where(done)
    ordered = connection.execute(query.order_by(rows_of_diagnoses.c.number.desc()))
    rows = [row for row in ordered if diagnoses.outdated(row) is None]
    members = diagnosed_together.members_of(connection, [row.number for row in rows if row.kind != "campaign"])
    campaigns_seen, together = set(), list[tuple[str, frozenset[int]]]()
    latest: list[AnyRow] = []
    for row in rows:
        campaign_numbers = frozenset(member.number for member in members.get(row.number, ()))
        if row.kind == "campaign":
            covered = row.campaign in campaigns_seen
            campaigns_seen.add(row.campaign)
        else:
            covered = any(kind == row.kind and campaign_numbers <= later for kind, later in together)
            together.append((row.kind, campaign_numbers))
        if not covered:
            latest.append(row)
    return latest


def _stated(store: Database, ids: Mapping[int, str]) -> Mapping[str, tuple[tuple[str, float], ...]]:
    """Mechanisms with their probabilities by the diagnosis' id; `ids` by number. Those not yet read are read a few at
    a time."""
    with _lock:
        cached = _read_before.setdefault(store, {})
        missing = [number for number, name in ids.items() if name not in cached]
        for start in range(0, len(missing), _AT_ONCE):
            for number, report in store.read(diagnoses.reports_of, missing[start : start + _AT_ONCE]).items():
                cached[ids[number]] = tuple(
                    (mechanism["name"], mechanism["probability"]) for mechanism in report["mechanisms"]
                )
        return dict(cached)


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
    path: Path = mechanisms.folder_of_lab() / entry.package.rsplit(" ", 1)[0]
    try:
        return path.read_bytes().decode("utf-8", "replace")
    except OSError:
        return None
