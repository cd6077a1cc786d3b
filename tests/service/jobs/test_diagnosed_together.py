"""Diagnoses of several kept campaigns: asked for, queued, worked out, outdated; and requests that are refused."""

import threading
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest

from tests.service.requests import problem_of
from tests.support.diagnosed import found, resonant, sent
from tests.support.lean_reports import beside
from tests.support.store_server import Server, campaign
from underskin import Client, ServiceError

BACKEND = "postgresql"
MOST = beside("contact_resonance", "sensor_spread")  # what its diagnoses leave out, so that they take little time


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(str(server.http.base_url)) as opened:
        yield opened


def sent_to(server: Server, skin: str, count: int) -> list[str]:
    """The ids of some campaigns of a skin."""
    return [sent(server, campaign(f"{skin} {number}", sensors=1), skin) for number in range(count)]


def refused(server: Server, path: str, body: Any, status: int) -> dict[str, Any]:
    """The problem that a request is answered with."""
    return problem_of(server.http.post(path, json=body), status)


def test_campaigns_of_a_skin_are_diagnosed_together(working: Server) -> None:
    with Client(str(working.http.base_url)) as client:
        ids = [sent(working, resonant("array", preloads=(1.0,), lines=6, seed=seed)) for seed in range(2)]
        asked = partial(client.skins.diagnose, "palm", name="palm since May", without=MOST)
        started = asked()
        done = client.diagnoses.wait(started["id"])
        assert (done["state"], done["kind"], done["name"]) == ("done", "skin", "palm since May")
        assert (done["campaign_ids"], done["campaign_id"], done["outdated"]) == (ids, ids[-1], None)
        # Names that are the same are told apart by the ids.
        names = [f"array ({campaign_id})" for campaign_id in ids]
        assert (done["report"]["campaign"], done["report"]["campaigns"]) == ("palm since May", names)
        assert (done["verdict"], done["probability"]) == ("explained", done["report"]["probability"])
        assert asked() == {"id": started["id"], "state": "done"}
        with pytest.raises(ServiceError, match="is of several campaigns"):
            client.skins.adopt("palm", started["id"])
        client.campaigns.exclude(ids[0], "r3", "cable loose")
        again = client.diagnoses.wait(asked()["id"])
        assert (again["id"] != started["id"], again["excluded"]) == (True, 1)
        assert again["report"]["findings"][0]["statement"] == f"array ({ids[0]}): Left out: cable loose"


def test_skins_of_a_fleet_are_diagnosed_together(working: Server) -> None:
    with Client(str(working.http.base_url)) as client:
        ids = [
            sent(working, resonant("array", preloads=(1.0,), lines=6, seed=number), f"palm-{number}")
            for number in range(3)
        ]
        skins = ["palm-2", "palm-0", "palm-1"]
        done = client.diagnoses.wait(client.fleets.diagnose(skins, "batch 7", without=MOST)["id"])
        assert (done["state"], done["kind"], done["campaign_ids"]) == ("done", "fleet", ids)
        assert (done["report"]["campaign"], len(done["report"]["campaigns"])) == ("batch 7", 3)
        assert isinstance(done["report"]["population"], list)
        again = client.fleets.diagnose(sorted(skins), "batch 7", without=MOST)
        assert again == {"id": done["id"], "state": "done"}


def test_blocks_alone_are_refused_at_once_and_beside_one_campaign_of_frfs_are_not(server: Server) -> None:
    """Campaigns are compared by FRFs."""
    travel = [0.05 * step for step in range(20)]
    cylinder = {"id": "b", "kind": "compression", "sample_height_mm": 10.0, "sample_diameter_mm": 10.0}
    cylinder |= {"displacement_mm": travel, "force_n": [125.0 * one for one in travel]}
    skin = {"id": "palm", "youngs_modulus_mpa": 16.0, "poisson_ratio": 0.5}
    for name in ("block", "again"):
        recordings = [{**cylinder, "sample_height_mm": 10.0 + len(name)}]
        sent(server, {"schema": "campaign/1", "name": name, "skin": skin, "recordings": recordings}, "palm")
    detail = refused(server, "/v1/skins/palm/diagnosis", {}, 409)["detail"]
    assert "none has FRFs in use" in detail
    sent_to(server, "palm", 1)
    assert server.http.post("/v1/skins/palm/diagnosis").status_code == 202


def test_all_or_chosen_campaigns_are_queued_once(server: Server, client: Client) -> None:
    ids = sent_to(server, "palm", 3)
    whole = client.skins.diagnose("palm")
    chosen = client.skins.diagnose("palm", ids[::-2])
    left_out = client.skins.diagnose("palm", without=["adhesion"])
    assert len({one["id"] for one in (whole, chosen, left_out)}) == 3
    assert client.skins.diagnose("palm", campaigns=[ids[0], ids[2]]) == chosen
    assert client.skins.diagnose("palm") == whole
    assert found(server, whole["id"])["name"] == "palm"
    assert found(server, chosen["id"])["campaign_ids"] == [ids[0], ids[2]]
    assert found(server, left_out["id"])["without"] == ["adhesion"]
    alone = client.diagnoses.start(ids[2])
    listed = {filters: [entry["id"] for entry in client.diagnoses.all(**{filters[0]: filters[1]})] for filters in (
        ("campaign", ids[0]), ("campaign", ids[1]), ("campaign", ids[2]), ("skin", "palm"), ("kind", "campaign"),
        ("kind", "skin"), ("kind", "fleet"),
    )}  # fmt: skip
    together = [left_out["id"], chosen["id"], whole["id"]]
    assert listed["campaign", ids[0]] == listed["kind", "skin"] == together
    assert listed["campaign", ids[1]] == [left_out["id"], whole["id"]]
    assert listed["campaign", ids[2]] == listed["skin", "palm"] == [alone["id"], *together]
    assert (listed["kind", "campaign"], listed["kind", "fleet"]) == ([alone["id"]], [])
    assert client.diagnoses.cancel(chosen["id"])["state"] == "cancelled"
    assert client.skins.diagnose("palm", ids[::2])["id"] != chosen["id"]
    with pytest.raises(ServiceError, match="no report"):
        client.skins.adopt("palm", whole["id"])


def test_asked_at_once_is_queued_once(server: Server) -> None:
    skins = ["palm", "finger", "thumb"]
    for skin in skins:
        sent_to(server, skin, 2)
    told: list[tuple[str, str]] = []

    def ask(path: str, body: dict[str, Any]) -> None:
        answer = server.http.post(path, json=body)
        assert answer.status_code == 202, answer.text
        told.append((path, answer.json()["id"]))

    requests = [("/v1/skins/finger/diagnosis", {}), ("/v1/fleets/diagnosis", {"skins": skins, "name": "fleet"})] * 4
    threads = [threading.Thread(target=ask, args=request) for request in requests]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(told), len(set(told))) == (8, 2)


def test_a_change_of_a_campaign_outdates_what_is_of_it(server: Server, client: Client) -> None:
    ids = sent_to(server, "palm", 4)
    whole = client.skins.diagnose("palm")["id"]
    chosen = client.skins.diagnose("palm", ids[:2])["id"]

    def outdated() -> list[str | None]:
        return [found(server, diagnosis_id)["outdated"] for diagnosis_id in (whole, chosen)]

    assert outdated() == [None, None]
    added = sent(server, campaign("new", sensors=1), "palm-b")
    assert outdated() == [None, None]
    client.skins.join("palm", "palm-b", "one skin, two labels")
    assert outdated() == [f"campaign {added} was added", None]
    client.skins.diagnose("palm")  # which has it, and does not make the earlier one have it
    assert outdated() == [f"campaign {added} was added", None]
    client.campaigns.withdraw(added, "of another skin")
    assert outdated() == [None, None]
    client.campaigns.exclude(ids[1], "s0-1N", "cable loose")
    changed = f"campaign {ids[1]} was changed: recordings were excluded since"
    assert outdated() == [changed, changed]
    again = client.skins.diagnose("palm", ids[:2])["id"]
    assert (again != chosen, found(server, again)["outdated"]) == (True, None)
    client.campaigns.withdraw(ids[0], "wrong sphere")
    withdrawn = f"campaign {ids[0]} was withdrawn: wrong sphere"
    assert outdated() == [withdrawn, withdrawn]


def test_a_skin_with_too_few_campaigns_is_refused(server: Server, client: Client) -> None:
    assert "no skin 'palm'" in refused(server, "/v1/skins/palm/diagnosis", {}, 404)["detail"]
    first, second = sent_to(server, "palm", 2)
    client.campaigns.withdraw(second, "wrong sphere")
    assert "one campaign in use" in refused(server, "/v1/skins/palm/diagnosis", {}, 409)["detail"]
    gone = refused(server, "/v1/skins/palm/diagnosis", {"campaigns": [first, second]}, 409)
    assert "campaigns[1]" in gone["detail"]
    assert "withdrawn: wrong sphere" in gone["detail"]
    for recording in ("s0-1N", "s0-2N"):
        client.campaigns.exclude(first, recording, "cable loose")
    assert "no campaign in use" in refused(server, "/v1/skins/palm/diagnosis", {}, 409)["detail"]
    sent_to(server, "palm", 2)
    emptied = refused(server, "/v1/skins/palm/diagnosis", {"campaigns": [first, second]}, 409)
    assert "campaigns[0]" in emptied["detail"]
    assert "all of its recordings are excluded" in emptied["detail"]


Wrong = list[tuple[dict[str, Any], str, int | None, str | None]]
WRONG_OF_A_SKIN: Wrong = [
    ({"campaigns": []}, "campaigns", None, "too_few"),
    ({"campaigns": ["FIRST"]}, "campaigns", None, "too_few"),
    ({"campaigns": ["FIRST", "FIRST"]}, "campaigns", 1, "not_unique"),
    ({"campaigns": ["FIRST", "FOREIGN"]}, "campaigns", 1, "not_one_of"),
    ({"campaigns": ["FIRST", "c-1"]}, "campaigns", 1, "not_one_of"),
    ({"name": ""}, "name", None, None),
    ({"name": " \n"}, "name", None, "wrong_type"),
    ({"without": ["nothing"]}, "without", None, "not_one_of"),
    ({"skins": ["palm"]}, "skins", None, "unknown_field"),
]
WRONG_OF_A_FLEET: Wrong = [
    ({"name": "fleet"}, "skins", None, "required"),
    ({"skins": ["a", "b", "c"]}, "name", None, "required"),
    ({"skins": ["a", "b"], "name": "fleet"}, "skins", None, "too_few"),
    ({"skins": ["a", "b", "a"], "name": "fleet"}, "skins", 2, "not_unique"),
    ({"skins": ["a", "b", "joined"], "name": "fleet"}, "skins", 2, "not_unique"),
    ({"skins": ["a", "nowhere", "c"], "name": "fleet"}, "skins", 1, "not_one_of"),
    ({"skins": ["a", "b", "c"], "name": "fleet", "without": ["x"]}, "without", None, "not_one_of"),
    ({"skins": ["a", "b", "c"], "name": "fleet", "campaigns": []}, "campaigns", None, "unknown_field"),
]


def test_a_wrong_request_names_the_field(server: Server, client: Client) -> None:
    first, _ = sent_to(server, "palm", 2)
    (foreign,) = sent_to(server, "finger", 1)
    named = {"FIRST": first, "FOREIGN": foreign}
    for body, field, index, code in WRONG_OF_A_SKIN:
        if isinstance(body.get("campaigns"), list):
            body = {"campaigns": [named.get(one, one) for one in body["campaigns"]]}
        (error,) = refused(server, "/v1/skins/palm/diagnosis", body, 422)["errors"]
        assert (error["field"], error["index"]) == (field, index), body
        assert code in (None, error["code"]), body
        assert code != "too_few" or error["allowed"] == "must have at least 2 entries"
    for skin in ("a", "b", "c", "joined"):
        sent_to(server, skin, 1)
    client.skins.join("a", "joined", "one skin, two labels")
    for body, field, index, code in WRONG_OF_A_FLEET:
        (error,) = refused(server, "/v1/fleets/diagnosis", body, 422)["errors"]
        assert (error["field"], error["index"]) == (field, index), body
        assert code in (None, error["code"]), body
