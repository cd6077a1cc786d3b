"""Adopted models withdrawn: none is in force, the version stays, and goes where the skin goes."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import httpx
import numpy as np
import orjson
import pytest

from tests.service.usecases.test_adopted_models import FREQUENCY, PRESSED
from tests.support.diagnosed import D33, diagnosed, report, resonant
from tests.support.store_server import Server
from underskin import Client, ServiceError

BACKEND = "sqlite"
ASKED = {**PRESSED, "model": "adopted", "skin_id": "palm", "frequency_hz": FREQUENCY}
LINES = {"band_hz": [1, 1000], "frf_re_pc_per_n": [[7.0, 7.0, 7.0]], "frf_im_pc_per_n": [[0.0, 0.0, 0.0]]}


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(str(server.http.base_url)) as opened:
        yield opened


def by_the_adopted_model(server: Server, campaign_id: str) -> list[tuple[int, str]]:
    """Status and detail of all that is answered by a skin's adopted model."""
    answers = [
        server.http.post("/v1/frf", json={**ASKED, "d33_pc_per_n": D33}),
        server.http.post("/v1/d33", json={**ASKED, **LINES}),
        server.http.get(f"/v1/campaigns/{campaign_id}/d33?model=adopted"),
        server.http.get("/v1/skins/palm/history?model=adopted"),
        server.http.get("/v1/skins/palm/model"),
    ]
    return [(answer.status_code, str(answer.json().get("detail"))) for answer in answers]


def point_ids(client: Client) -> set[str]:
    """Ids of the models that the values of the skin's history rest on."""
    history = client.skins.history("palm", model="adopted")
    return {point["model_id"] for entry in history["sensors"] for point in entry["points"]}


def test_without_it_the_skin_answers_as_one_that_never_had_a_model(server: Server, client: Client) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("array"), report())
    never = by_the_adopted_model(server, campaign_id)
    assert {status for status, _ in never} == {404}
    first = client.skins.adopt("palm", diagnosis_id)
    assert {status for status, _ in by_the_adopted_model(server, campaign_id)} == {200}
    assert point_ids(client) == {first["id"]}
    paper = client.skins.history("palm")
    gone = client.skins.withdraw_model("palm", " wrong diagnosis ")
    assert by_the_adopted_model(server, campaign_id) == never
    assert client.skins.history("palm") == paper
    assert gone == {name: first[name] for name in gone} | {
        "withdrawn_at": gone["withdrawn_at"], "withdrawn_from": None, "withdraw_reason": "wrong diagnosis",
    }  # fmt: skip
    assert gone["withdrawn_at"] > first["adopted_at"]
    assert client.skins.models("palm") == [{**first, **gone}]  # nothing else of it has changed
    with pytest.raises(ServiceError, match=r"404.*no adopted model"):
        client.skins.withdraw_model("palm", "again")
    client.skins.annotate("palm", title="left palm")
    renamed, change = client.skins.changes("palm")
    assert renamed["may_be_undone"]
    assert (change["at"], change["reason"]) == (gone["withdrawn_at"], "wrong diagnosis")
    assert (change["statement"], change["may_be_undone"]) == ("adopted model, version 1, withdrawn", False)
    with pytest.raises(ServiceError, match=r"409.*adopted again from its diagnosis"):
        client.undo(change["id"])
    again = client.skins.adopt("palm", diagnosis_id)
    assert (again["version"], again["withdrawn_at"]) == (2, None)
    assert again["id"] != first["id"]
    assert point_ids(client) == {again["id"]}
    assert client.skins.models("palm") == [again, {**first, **gone}]


def test_a_reason_is_asked_for(server: Server, client: Client) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    adopted = client.skins.adopt("palm", diagnosis_id)
    for query in ("", "?reason=", "?reason=%20", f"?reason={'x' * 1001}"):
        refused = server.http.delete(f"/v1/skins/palm/model{query}")
        assert refused.status_code == 422, refused.text
        assert client.skins.model("palm") == adopted


def test_it_is_withdrawn_once(server: Server, client: Client) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    client.skins.adopt("palm", diagnosis_id)

    def withdraw(reason: str, **headers: str) -> httpx.Response:
        return server.http.delete("/v1/skins/palm/model", params={"reason": reason}, headers=headers)

    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(withdraw, [f"reason {number}" for number in range(4)]))
    assert sorted(answer.status_code for answer in answers) == [200, 404, 404, 404]
    (done,) = (answer.json() for answer in answers if answer.status_code == 200)
    assert [entry["withdraw_reason"] for entry in client.skins.models("palm")] == [done["withdraw_reason"]]
    client.skins.adopt("palm", diagnosis_id)
    first = withdraw("wrong", **{"Idempotency-Key": "once"})
    newest = client.skins.adopt("palm", diagnosis_id)
    assert withdraw("wrong", **{"Idempotency-Key": "once"}).json() == first.json()
    assert withdraw("other", **{"Idempotency-Key": "once"}).status_code == 422
    assert client.skins.model("palm") == newest


def test_files_of_an_older_underskin_come_in_and_spoilt_ones_do_not(
    server: Server, elsewhere: Server, client: Client, tmp_path: Path
) -> None:
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    adopted = client.skins.adopt("palm", diagnosis_id)
    file = tmp_path / "palm.h5"
    client.skins.export("palm", file)
    with h5py.File(file) as opened:
        (row,) = orjson.loads(opened["models"][()].tobytes())
    older = {name: value for name, value in row.items() if not name.startswith("withdr")}
    assert len(older) == len(row) - 3
    for model, status in (
        (row | {"withdrawn_at": "2026-11-21T20:00:00.000000Z"}, 422),  # without a reason
        (row | {"withdraw_reason": "without a time"}, 422),
        (row | {"withdrawn_at": "yesterday", "withdraw_reason": "wrong"}, 422),
        (older, 200),
    ):
        with h5py.File(file, "r+") as opened:
            del opened["models"]
            opened["models"] = np.frombuffer(orjson.dumps([model]), np.uint8)
        headers = {"Content-Type": "application/octet-stream"}
        answer = elsewhere.http.post("/v1/skins/import", content=file.read_bytes(), headers=headers)
        assert answer.status_code == status, answer.text
        found = elsewhere.http.get("/v1/skins/palm/model")
        assert (found.json() if status == 200 else found.status_code) == (adopted if status == 200 else 404)
