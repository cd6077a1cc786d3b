"""Stores that servers of this repository's history made, taken up by today's: nothing is lost, and answers are equal.

What they hold, and how they were made, is in `old_stores/`. With UNDERSKIN_SOAK=1 all of them, and on PostgreSQL too.
"""

import math
import re
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from bench.figures import Figure
from bench.soak import SOAK, record
from service.store import database, migrate
from service.store.tables import metadata
from tests.service.store.old_stores.contents import LANDED, SECOND, WITH_THE_NEXT, answers, asked_of, take_over
from tests.support.store_server import Place, campaign, running

ON_ALL = set(LANDED) if SOAK else {"0007"}
"""Those of PostgreSQL too, each of which takes a second or two."""
# Numbers of d33 are computed anew, by today's estimate of FRFs and of their band: d33 itself within 2 %
COMPUTED = re.compile(r"/(band/\w+|\w+_(scatter|spread)_\w+/\w+|d33_(uncertainty|low|high)_pc_per_n)$")
STEP = 1 if SOAK else 3  # of the versions on SQLite, from the last one back


def differences(old: Any, new: Any, at: str = "") -> list[str]:
    """Where an answer of today lacks, or says otherwise, what an old one said; it may say more."""
    if COMPUTED.search(at) and type(old) is type(new):
        return []
    if isinstance(old, dict) and isinstance(new, dict):
        gone = [f"{at}/{key} is gone" for key in old.keys() - new.keys()]
        return gone + [
            line for key in old.keys() & new.keys() for line in differences(old[key], new[key], f"{at}/{key}")
        ]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [line for number, (was, now) in pairs for line in differences(was, now, f"{at}/{number}")]
    near = 0.02 if at.endswith("/d33_pc_per_n") else 1e-6
    if isinstance(old, float) and isinstance(new, float) and math.isclose(old, new, rel_tol=near, abs_tol=1e-9):
        return []
    if isinstance(old, str) and isinstance(new, str):
        each = old, re.sub(r"the (\S+ mm) sphere", r"the sphere of \1 radius", old)  # as it was kept, or said anew
        same = any(new == one or new.startswith(f"{one}; ") for one in each)
        return [] if same else [f"{at}: {old!r}, now {new!r}"]
    return [] if old == new else [f"{at}: {old!r}, now {new!r}"]


def without_tolerances(answers: dict[str, Any]) -> dict[str, Any]:
    """Answers in which the array's interval is what it was before version 4 of the answer on d33, relative."""
    plain = {}
    for path, answer in answers.items():
        if isinstance(answer, dict) and "declared_percent" in answer:
            answer = {**answer, "array": answer.get("array_relative", answer["array"]), "declared_percent": None}
        plain[path] = answer
    return plain


@pytest.mark.parametrize(
    ("place", "version"),
    [("sqlite", version) for version in list(LANDED)[::-STEP]]
    + [("postgresql", version) for version in sorted(ON_ALL)],
    indirect=["place"],
)
def test_an_old_store_answers_as_it_did(place: Place, version: str) -> None:
    take_over(place, version)
    before = answers(place, version)
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        assert sorted(asked_of(server.http)) == sorted(before)
        found = {path: server.http.get(path).raise_for_status().json() for path in before}
        assert differences(without_tolerances(before), without_tolerances(found)) == []
        again = server.http.post(f"/v1/campaigns?skin={SECOND}", json=campaign("stays")).raise_for_status().json()
        assert again["notes"][0].startswith("these recordings are in campaign stays of skin finger already")
    store = database(place.database_url, place.folder)
    with store.reading() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, metadata) == []
    store.close()
    if version in ON_ALL:
        require_the_way_back(place)
    record(Figure("Stores of earlier versions that answer as they did", 1, "", 2 * len(LANDED)))


def require_the_way_back(place: Place) -> None:
    """What the migration saved first is of the older version, and comes back, brought up to date; pages are shown."""
    (made,) = (place.folder / "backups").iterdir()
    assert place.command("restore", str(made)).returncode == 0
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        campaigns = server.http.get("/v1/campaigns?state=all").json()["campaigns"]
        assert campaigns
        addresses = {f"/campaigns/{entry['id']}" for entry in campaigns} | {f"/skins/{e['skin_id']}" for e in campaigns}
        told = server.http.get("/v1/diagnoses").json()["diagnoses"]
        for path in ("/", *sorted(addresses), *(f"/diagnoses/{entry['id']}" for entry in told)):
            assert server.http.get(path, headers={"Accept": "text/html"}).status_code == 200, path
        added = server.http.post("/v1/campaigns?skin=palm", json=campaign("after")).raise_for_status().json()
        asked = server.http.post(f"/v1/campaigns/{added['id']}/diagnosis").raise_for_status().json()
        assert asked["state"] == "queued"


def test_every_earlier_schema_has_a_store_here() -> None:
    wanted = "add the commit with which it landed to LANDED, and make its store (old_stores/remake.py)"
    assert list(LANDED) == [version for version in migrate.VERSIONS[:-1] if version not in WITH_THE_NEXT], wanted
