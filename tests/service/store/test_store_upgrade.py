"""Stores of every older version, with campaigns in them, are taken up by the server of today."""

from typing import Any

import pytest
from sqlalchemy import MetaData, Table, func, select, text

from bench.soak import SOAK
from service.store import Database, database, migrate
from service.store.tables import metadata
from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.store_server import Place, campaign, running

# Stores that servers of each version made are in test_old_stores.py
OLDER = migrate.VERSIONS[:-1] if SOAK else [migrate.VERSIONS[place] for place in (0,)]
Rows = dict[str, list[dict[str, Any]]]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    """All rows of a store of today: a diagnosed skin with its model, a campaign withdrawn, a recording excluded."""
    place = Place(tmp_path_factory.mktemp("today"))
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        _, diagnosis_id = diagnosed(server, resonant("explained"), report())
        posts: list[tuple[str, dict[str, Any]]] = [
            ("/v1/skins/palm/model", {"diagnosis_id": diagnosis_id}),
            ("/v1/campaigns?skin=finger", campaign("gone")),
            ("/v1/campaigns?skin=finger", campaign("stays")),
        ]
        ids = [server.http.post(path, json=body).raise_for_status().json()["id"] for path, body in posts]
        server.http.post(f"/v1/campaigns/{ids[1]}/withdraw", json={"reason": "wrong sphere"}).raise_for_status()
        excluded = {"recording": "s0-1N", "reason": "loose cable"}
        server.http.post(f"/v1/campaigns/{ids[2]}/exclusions", json=excluded).raise_for_status()
    store = database("", place.folder)
    with store.reading() as connection:
        found = {
            table.name: [dict(row) for row in connection.execute(select(table)).mappings()]
            for table in metadata.sorted_tables
        }
    store.close()
    return found


@pytest.fixture
def older(request: pytest.FixtureRequest, place: Place, rows: Rows, monkeypatch: pytest.MonkeyPatch) -> Place:
    """A store of the version that the test names, with what of the rows it could hold."""
    store = database(place.database_url, place.folder)
    with monkeypatch.context() as patch:
        patch.setattr(migrate, "VERSIONS", migrate.VERSIONS[: migrate.VERSIONS.index(request.param) + 1])
        migrate.migrate(store, place.folder)
    assert migrate.version(store) == request.param
    fill(store, rows)
    if "0007" <= request.param < "0014":  # whose first servers made digests otherwise
        with store.writing() as connection:
            connection.execute(text("UPDATE recording_digests SET digest = 'otherwise-' || digest"))
    store.close()
    return place


def fill(store: Database, rows: Rows) -> None:
    """Put rows into the tables there are, without the columns that there are not."""
    there = MetaData()
    there.reflect(store.engine)
    with store.writing() as connection:
        for name in (table.name for table in metadata.sorted_tables):
            table = there.tables.get(name)
            if table is None or not rows[name]:
                continue
            connection.execute(
                table.insert(), [{key: row[key] for key in row if key in table.columns} for row in rows[name]]
            )
            if not store.is_sqlite and "number" in table.columns:
                count_on(connection, table)


def count_on(connection: Any, table: Table) -> None:
    """Numbers go on after those that were put in."""
    last = connection.execute(select(func.max(table.c.number))).scalar()
    query = text("SELECT setval(pg_get_serial_sequence(:name, 'number'), :last)")
    connection.execute(query, {"name": table.name, "last": last})


@pytest.mark.parametrize("older", OLDER, indirect=True)
def test_older_store_taken_up_holds(older: Place, rows: Rows) -> None:
    """An older store is taken up with all that it holds."""
    store = database(older.database_url, older.folder)
    held = migrate.version(store)
    store.close()
    with running(older, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        listed = server.http.get("/v1/campaigns?state=all").json()["campaigns"]
        assert {entry["name"]: entry["state"] for entry in listed} == {
            "explained": "current", "gone": "withdrawn", "stays": "current",
        }  # fmt: skip
        assert {entry["id"] for entry in listed} == {row["id"] for row in rows["campaigns"]}
        for entry in listed:
            document = server.http.get(f"/v1/campaigns/{entry['id']}/document").raise_for_status().json()
            assert len(document["recordings"]) == entry["recordings"]
        history = server.http.get("/v1/skins/finger/history").raise_for_status().json()
        assert [entry["sensor"] for entry in history["sensors"]] == ["s0", "s1", "s2"]
        (left,) = history["left_out_recordings"]
        assert (left["recording"], left["reason"]) == ("s0-1N", "loose cable")
        known = str(held) >= "0003"  # which brought diagnoses and models
        told = server.http.get("/v1/diagnoses").json()["diagnoses"]
        assert [entry["id"] for entry in told] == [row["id"] for row in rows["diagnoses"] if known]
        model = server.http.get("/v1/skins/palm/model")
        assert model.status_code == (200 if known else 404)
        for path in ("/", "/skins/palm", "/skins/finger", *(f"/diagnoses/{entry['id']}" for entry in told)):
            page = server.http.get(path, headers={"Accept": "text/html"})
            assert page.status_code == 200, path
            assert ("In force: contact resonance" in page.text) == (known and path == "/skins/palm")
        withdrawn = server.http.delete("/v1/skins/palm/model", params={"reason": "after the upgrade"})
        assert withdrawn.status_code == (200 if known else 404), withdrawn.text
        added = server.http.post("/v1/campaigns?skin=palm", json=campaign("after")).raise_for_status().json()
        asked = server.http.post(f"/v1/campaigns/{added['id']}/diagnosis").raise_for_status().json()
        assert asked["state"] == "queued"
    (made,) = (older.folder / "backups").iterdir()
    assert made.stat().st_size > 0
    assert older.command("restore", str(made)).returncode == 0  # of the older version, and brought up to date with it
    with running(older, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        names = {entry["name"] for entry in server.http.get("/v1/campaigns?state=all").json()["campaigns"]}
        assert names == {"explained", "gone", "stays"}
        again = server.http.post("/v1/campaigns?skin=finger", json=campaign("stays")).raise_for_status().json()
        assert again["notes"][0].startswith("these recordings are in campaign stays of skin finger already")
