"""What an earlier underskin derived and kept is computed anew, not shown, whatever its shape was."""

import hashlib
import re
from typing import Any

import orjson
import pytest
from sqlalchemy import insert, select, text, update

from service.schemas.campaign_d33 import ANSWER_VERSION, D33
from service.store import campaigns, database, open_store
from service.store.codec import compressed, decompressed
from service.store.tables import inversions, sensor_d33
from service.usecases import d33_cache
from tests.service.store.old_stores.contents import take_over
from tests.support.store_server import Place, Server, campaign, running
from underskin import load_table
from underskin.inversion.invert import invert
from underskin.recordings.campaign import parse

BACKEND = "sqlite"
# Of each version: the digest of the answer's fields, and the array's d33 with its uncertainty [pC/N].
KNOWN = {
    1: ("6feb4e2d51f904c6", 13.402, 0.105487),
    2: ("c41e6ef11406b7c7", 13.402, 0.105487),
    3: ("c41e6ef11406b7c7", 13.402, 0.105487),  # findings of times and places
    4: ("53a90e4aa097fad6", 13.402, 0.105487),  # tolerances of the skin in the array's interval
    5: ("596c8b1b59e43529", 13.402, 0.105487),  # by the solved contact too
    6: ("596c8b1b59e43529", 13.402, 0.105487),  # recordings that are left out by their ids
    7: ("596c8b1b59e43529", 13.402, 0.105487),  # sensors marked at three standard errors and 5 %
    8: ("596c8b1b59e43529", 13.402, 0.105487),  # beyond the spread of the array, too
}


def test_an_answer_of_an_earlier_version_is_computed_anew(server: Server) -> None:
    campaign_id = server.http.post("/v1/campaigns?skin=palm", json=campaign("one")).json()["id"]
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    history = server.http.get("/v1/skins/palm/history").json()
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        old = {"answer_version": ANSWER_VERSION - 1, "document": compressed({"campaign_id": campaign_id, "d33": 99})}
        connection.execute(update(inversions).values(old))
        connection.execute(update(sensor_d33).values(d33_pc_per_n=99.0))
    assert server.http.get("/v1/skins/palm/history").json() == history
    with store.writing() as connection:
        connection.execute(update(inversions).values(old))
    assert server.http.get(f"/v1/campaigns/{campaign_id}/d33").json() == answer
    with store.reading() as connection:
        kept = connection.execute(select(inversions.c.answer_version, inversions.c.document)).one()
    assert (kept.answer_version, decompressed(kept.document)) == (ANSWER_VERSION, answer)
    store.close()


def test_figures_are_drawn_alike_from_kept_numbers_and_from_recordings(place: Place) -> None:
    many = campaign("many", sensors=25, lines=5)
    del many["recordings"][7]["coherence"]  # a gap in what is kept
    seen = []
    for kept in (True, False, True):
        with running(place) as server:
            campaign_id = server.http.post(
                "/v1/campaigns?skin=palm", json=many, headers={"Idempotency-Key": "once"}
            ).json()["id"]
            if not kept:
                store = database(server.place.database_url, server.place.folder)
                with store.writing() as connection:
                    connection.execute(update(inversions).values(numbers=None))
                store.close()
            pages = [f"/campaigns/{campaign_id}", f"/campaigns/{campaign_id}/preload.csv"]
            seen.append([server.http.get(path, headers={"Accept": "text/html"}).text for path in pages])
    figures = [[_figures(page), columns] for page, columns in seen]
    assert len(figures[0][0]) == 4
    assert "50 recordings" in seen[0][0]
    assert figures[0] == figures[1] == figures[2]
    store = database(place.database_url, place.folder)
    with store.reading() as connection:
        assert connection.execute(select(inversions.c.numbers)).scalar() is not None
    store.close()


def _figures(page: str) -> list[str]:
    return re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)


def test_what_a_store_of_the_first_schema_kept_is_computed_anew(place: Place) -> None:
    table = load_table()
    take_over(place, "0001")
    store = database(place.database_url, place.folder)
    with store.writing() as connection:
        number, campaign_id, revision = connection.execute(text("SELECT number, id, revision FROM campaigns")).all()[0]
        connection.execute(text("DELETE FROM inversions"))
        connection.execute(text("DELETE FROM sensor_d33"))
        old = "INSERT INTO inversions (campaign, revision, table_sha256, document) VALUES (:number, :at, :table, :old)"
        kept = {"number": number, "at": revision, "table": table.sha256, "old": compressed({"d33": 99})}
        connection.execute(text(old), kept)
        point = {"sensor": "s0", "d33_pc_per_n": 99.0, "d33_uncertainty_pc_per_n": 1.0}
        connection.execute(insert(sensor_d33), {"campaign": number, **point})
    store.close()
    store = open_store(place.database_url, place.folder)
    with store.reading() as connection:
        row = campaigns.find(connection, campaign_id)
    assert D33(**d33_cache.answer(store, table, row, None)).status == "ok"
    with store.reading() as connection:
        assert 99.0 not in connection.execute(select(sensor_d33.c.d33_pc_per_n)).scalars().all()
    store.close()


def test_another_answer_is_another_version() -> None:
    """Fields or figures that differ from those of this version need a new ANSWER_VERSION, and its line in KNOWN."""
    fields, d33, uncertainty = KNOWN[ANSWER_VERSION]
    schema = orjson.dumps(without_words(D33.model_json_schema()), option=orjson.OPT_SORT_KEYS)
    assert hashlib.sha256(schema).hexdigest()[:16] == fields
    found = invert(parse(campaign("one")), load_table()).campaign_d33
    assert found is not None
    assert [1e12 * float(found.value), 1e12 * float(found.uncertainty)] == pytest.approx([d33, uncertainty], rel=1e-3)


def without_words(schema: Any) -> Any:
    """A JSON schema without what is said about its fields."""
    if isinstance(schema, dict):
        return {
            name: without_words(part)
            for name, part in schema.items()
            if not isinstance(part, str) or name != "description"
        }
    return [without_words(part) for part in schema] if isinstance(schema, list) else schema
