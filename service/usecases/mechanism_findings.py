"""Diagnoses of this lab that found a mechanism: those of campaigns in their present state.

Finished reports do not change, so the mechanisms of each are read once and cached by its id: after a restore a number
may be that of another.
"""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from sqlalchemy import Connection

from service.store import Database, diagnosed_together, diagnoses
from service.store.tables import AnyRow, campaigns
from service.store.tables import diagnoses as rows_of_diagnoses

_AT_ONCE = 50  # reports
_lock = threading.Lock()
_read: WeakKeyDictionary[Database, dict[str, tuple[tuple[str, float], ...]]] = WeakKeyDictionary()


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
        cached = _read.setdefault(store, {})
        missing = [number for number, name in ids.items() if name not in cached]
        for start in range(0, len(missing), _AT_ONCE):
            for number, report in store.read(diagnoses.reports_of, missing[start : start + _AT_ONCE]).items():
                cached[ids[number]] = tuple(
                    (mechanism["name"], mechanism["probability"]) for mechanism in report["mechanisms"]
                )
        return dict(cached)
