"""Diagnoses of kept campaigns as they are asked for and listed, while none is worked at."""

import threading

import pytest

from tests.support.diagnosed import asked, sent
from tests.support.store_server import Server, campaign
from underskin import Client


def test_diagnoses_are_listed(server: Server) -> None:
    campaigns = [sent(server, campaign(str(number), sensors=1), f"skin-{number % 2}") for number in range(5)]
    ids = [asked(server, campaign_id) for campaign_id in campaigns]
    with Client(str(server.http.base_url)) as client:
        assert [entry["id"] for entry in client.diagnoses.all()] == ids[::-1]
        assert [entry["id"] for entry in client.diagnoses.all(campaign=campaigns[2])] == [ids[2]]
        assert [entry["id"] for entry in client.diagnoses.all(skin="skin-1")] == [ids[3], ids[1]]
        client.diagnoses.cancel(ids[0])
        assert [entry["id"] for entry in client.diagnoses.all(state="cancelled")] == [ids[0]]
        with pytest.raises(TimeoutError):
            client.diagnoses.wait(ids[1], timeout=0.1)
    first = server.http.get("/v1/diagnoses?limit=3").json()
    second = server.http.get("/v1/diagnoses", params={"limit": 3, "cursor": first["next"]}).json()
    assert [entry["id"] for entry in first["diagnoses"] + second["diagnoses"]] == ids[::-1]
    assert second["next"] is None
    assert server.http.get("/v1/diagnoses/d-1").status_code == 404
    assert server.http.delete("/v1/diagnoses/d-1").status_code == 404
    assert server.http.post("/v1/campaigns/c-1/diagnosis").status_code == 404


def test_asked_twice_under_one_key_is_asked_once(server: Server) -> None:
    campaign_id, other = (sent(server, campaign(name, sensors=1)) for name in ("a", "b"))
    key = {"Idempotency-Key": "mine"}
    first = asked(server, campaign_id, **key)
    assert server.http.delete(f"/v1/diagnoses/{first}").status_code == 200
    assert asked(server, campaign_id, **key) == first
    assert asked(server, campaign_id) != first
    assert server.http.post(f"/v1/campaigns/{other}/diagnosis", headers=key).status_code == 422


def test_asked_at_once_is_asked_once(server: Server) -> None:
    campaign_id = sent(server, campaign("array", sensors=1))
    told: list[str] = []
    threads = [threading.Thread(target=lambda: told.append(asked(server, campaign_id))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(told) == 8
    assert len(set(told)) == 1
