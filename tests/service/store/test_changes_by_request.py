"""Names, notes, tags, trials put away and changes undone: by request, through the client and by command."""

import json
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

import underskin
from tests.service.pages.forms import BROWSING
from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.store_server import Server, campaign

BACKEND = "postgresql"


@pytest.fixture
def client(server: Server) -> Iterator[underskin.Client]:
    with underskin.Client(str(server.http.base_url)) as opened:
        yield opened


def sent(server: Server, name: str, skin: str = "palm", **query: str) -> str:
    answer = server.http.post("/v1/campaigns", params={"skin": skin, **query}, json=campaign(name, sensors=1))
    return str(answer.raise_for_status().json()["id"])


def listed(server: Server, **query: str) -> list[str]:
    page = server.http.get("/v1/campaigns", params={"state": "all", **query}).raise_for_status().json()
    return [entry["id"] for entry in page["campaigns"]]


def history(server: Server, skin: str = "palm") -> set[str]:
    """Campaigns that the skin's history uses."""
    sensors = server.http.get(f"/v1/skins/{skin}/history").raise_for_status().json()["sensors"]
    return {point["campaign_id"] for sensor in sensors for point in sensor["points"]}


def changes(server: Server, campaign_id: str) -> list[dict[str, Any]]:
    answer = server.http.get(f"/v1/campaigns/{campaign_id}/changes").raise_for_status()
    return list(answer.json()["changes"])


def undo(server: Server, change: dict[str, Any]) -> httpx.Response:
    return server.http.post(f"/v1/changes/{change['id']}/undo")


def test_fields_that_are_not_sent_stay(server: Server) -> None:
    place = f"/v1/campaigns/{sent(server, 'monday')}"
    fields = {"name": " after the bath ", "remark": "wet", "tags": ["wet", "batch  7, wet"]}
    answer = server.http.patch(place, json=fields).raise_for_status().json()
    assert (answer["name"], answer["remark"], answer["tags"]) == ("after the bath", "wet", ["wet", "batch 7"])
    answer = server.http.patch(place, json={"remark": None}).raise_for_status().json()
    assert (answer["name"], answer["remark"], answer["tags"]) == ("after the bath", None, ["wet", "batch 7"])
    skin = server.http.patch("/v1/skins/palm", json={"title": "left palm", "tags": ["soft"]}).raise_for_status().json()
    assert (skin["title"], skin["tags"]) == ("left palm", ["soft"])
    entries = server.http.get("/v1/skins", params={"id_contains": "left"}).json()["skins"]
    assert [(entry["id"], entry["title"]) for entry in entries] == [("palm", "left palm")]


@pytest.mark.parametrize(
    ("path", "body", "field"),
    [
        ("campaigns", {"name": " "}, "name"),
        ("campaigns", {"remark": "x" * 10_001}, "remark"),
        ("campaigns", {"tags": ["x" * 501]}, "tags"),
        ("campaigns", {"title": "a skin's"}, "title"),
        ("campaigns", {}, "at least one"),
        ("skins", {"remark": "nul\x00"}, "remark"),
    ],
)
def test_what_cannot_be_kept_is_refused(server: Server, path: str, body: dict[str, Any], field: str) -> None:
    name = sent(server, "monday") if path == "campaigns" else "palm"
    server.http.post("/v1/campaigns", params={"skin": "palm"}, json=campaign("other", sensors=1))
    answer = server.http.patch(f"/v1/{path}/{name}", json=body)
    assert answer.status_code == 422
    assert field in answer.text


def test_a_trial_is_put_away_beside_campaigns_in_use(server: Server) -> None:
    kept, trial = sent(server, "kept"), sent(server, "trial")
    answer = server.http.post(f"/v1/campaigns/{trial}/discard", json={"reason": "a trial"}).raise_for_status().json()
    assert (answer["state"], answer["withdraw_reason"]) == ("withdrawn", "a trial")
    assert answer["discarded_at"] is not None
    assert listed(server, skin="palm") == [kept]
    assert history(server) == {kept}
    left_out = server.http.get("/v1/skins/palm/history").json()["left_out_campaigns"]
    assert trial not in {entry["campaign_id"] for entry in left_out}
    assert trial not in server.http.get("/skins/palm", headers=BROWSING).text
    assert len(server.http.get(f"/v1/campaigns/{trial}/document").json()["recordings"]) == 2  # nothing is lost
    assert server.http.post(f"/v1/campaigns/{trial}/discard", json={"reason": "again"}).status_code == 409
    assert undo(server, changes(server, trial)[0]).status_code == 200
    assert listed(server, skin="palm") == [trial, kept]
    assert history(server) == {kept, trial}


def test_what_something_builds_on_is_no_trial(server: Server) -> None:
    diagnosed, corrected = sent(server, "diagnosed"), sent(server, "corrected", "hand")
    server.http.post(f"/v1/campaigns/{diagnosed}/diagnosis").raise_for_status()
    newer = sent(server, "corrected", "hand", corrects=corrected, reason="E was mistyped")
    for campaign_id, why in ((diagnosed, "was diagnosed"), (corrected, "a correction"), (newer, "a correction")):
        answer = server.http.post(f"/v1/campaigns/{campaign_id}/discard", json={"reason": "a trial"})
        assert answer.status_code == 409
        assert why in answer.json()["detail"]


def test_a_correction_is_undone_until_something_builds_on_it(server: Server) -> None:
    older = sent(server, "older")
    newer = sent(server, "newer", corrects=older, reason="E was mistyped")
    assert history(server) == {newer}
    (correction,) = changes(server, newer)
    assert (correction["action"], correction["reason"]) == ("correct", "E was mistyped")
    body = {"recording": "s0-1N", "reason": "loose"}
    server.http.post(f"/v1/campaigns/{newer}/exclusions", json=body).raise_for_status()
    assert undo(server, correction).status_code == 409  # the exclusion builds on it
    assert undo(server, changes(server, newer)[0]).status_code == 200
    assert undo(server, correction).status_code == 200
    told = {name: server.http.get(f"/v1/campaigns/{name}").json() for name in (older, newer)}
    assert [told[name]["state"] for name in (older, newer)] == ["current", "withdrawn"]
    assert told[newer]["withdraw_reason"] == "the correction was undone"
    assert history(server) == {older}
    again = sent(server, "again", corrects=older, reason="better")
    assert history(server) == {again}
    server.http.post(f"/v1/campaigns/{again}/diagnosis").raise_for_status()
    assert undo(server, changes(server, again)[0]).status_code == 409


def test_correction_skin_not_undone_once_skin_left(server: Server, client: underskin.Client) -> None:
    """A correction on another skin is not undone once the skin it left adopted a model."""
    older = sent(server, "older")
    newer = sent(server, "newer", "hand", corrects=older, reason="it was the hand")
    _, diagnosis_id = diagnosed(server, resonant("array"), report())
    (correction,) = changes(server, newer)
    assert correction["may_be_undone"]
    client.skins.adopt("palm", diagnosis_id)
    refused = undo(server, correction)
    assert (refused.status_code, "a model was adopted since" in refused.text) == (409, True)
    assert history(server, "hand") == {newer}


def test_a_correction_that_was_corrected_is_undone_after_the_later_one(server: Server) -> None:
    first = sent(server, "first")
    second = sent(server, "second", corrects=first, reason="E was mistyped")
    third = sent(server, "third", corrects=second, reason="and the sphere")
    (earlier,), (later,) = changes(server, second), changes(server, third)
    assert (earlier["may_be_undone"], later["may_be_undone"]) == (False, True)
    refused = undo(server, earlier)
    assert refused.status_code == 409
    assert f"was corrected since, by '{third}'" in refused.json()["detail"]
    assert history(server) == {third}  # and not the first one beside it
    assert undo(server, later).status_code == 200
    assert history(server) == {second}
    assert undo(server, earlier).status_code == 200
    assert history(server) == {first}


def test_an_export_brings_trials_and_corrections(server: Server, elsewhere: Server) -> None:
    older = sent(server, "older")
    newer = sent(server, "newer", corrects=older, reason="E was mistyped")
    trial = sent(server, "trial")
    server.http.post(f"/v1/campaigns/{trial}/discard", json={"reason": "a trial"}).raise_for_status()
    exported = server.http.get("/v1/skins/palm/export").content
    elsewhere.http.post("/v1/skins/import", content=exported).raise_for_status()
    assert listed(elsewhere, skin="palm") == [newer, older]
    assert undo(elsewhere, changes(elsewhere, newer)[0]).status_code == 200
    assert undo(elsewhere, changes(elsewhere, trial)[0]).status_code == 200
    assert history(elsewhere) == {older, trial}


def test_the_client_has_the_same(server: Server, client: underskin.Client) -> None:
    campaign_id = sent(server, "monday")
    assert client.campaigns.annotate(campaign_id, name="tuesday", tags=["wet"]).tags == ("wet",)
    (renamed,) = client.campaigns.changes(campaign_id)
    assert (renamed.action, renamed.statement) == ("annotate", "renamed from “monday”, tags changed")
    assert client.undo(renamed.id).undone
    assert client.campaigns.get(campaign_id).name == "monday"
    assert client.campaigns.discard(campaign_id, "a trial").discarded_at is not None
    assert client.skins.annotate("palm", title="left palm").title == "left palm"
    assert client.skins.discard("palm", "empty").discarded_at is not None
    assert [entry.action for entry in client.skins.changes("palm")] == ["discard", "annotate"]
    with pytest.raises(underskin.ServiceError, match="There is no change"):
        client.undo("ch-0")


def test_the_commands_have_the_same(server: Server) -> None:
    def told(*arguments: str) -> str:
        done = server.place.command(*arguments, "--url", str(server.http.base_url))
        return str(done.stdout + done.stderr)

    campaign_id = sent(server, "monday")
    named = told("annotate", "--campaign", campaign_id, "--name", "tuesday", "--tags", "wet,cold", "--notes", "by hand")
    assert f"campaign {campaign_id} is called tuesday; tags: wet, cold; notes: by hand" in named
    assert "skin palm is called left palm" in told("annotate", "--skin", "palm", "--name", "left palm")
    assert "is discarded" in told("discard", "--campaign", campaign_id, "--reason", "a trial")
    assert "discarded: a trial" in told("campaigns", campaign_id)
    entries = json.loads(told("changes", "--campaign", campaign_id, "--json"))
    assert [entry["action"] for entry in entries] == ["discard", "annotate"]
    assert f"undone of campaign {campaign_id}: discarded" in told("undo", entries[0]["id"])
    assert "can be undone" in told("changes", "--campaign", campaign_id)
    assert "give one of --campaign ID and --skin ID" in told("discard", "--reason", "a trial")
    assert "give at least one of" in told("annotate", "--skin", "palm")
    assert "was undone already" in told("undo", entries[0]["id"])
