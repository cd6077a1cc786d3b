"""Names, remarks, tags, withdrawals, exclusions, joins, skins put away: who did it, and the way back."""

import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from tests.service.pages.forms import BROWSING, token_of
from tests.support.store_server import Server, campaign

BACKEND = "postgresql"


@pytest.fixture
def lab(server: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as client:
        yield client


def sent(server: Server, name: str, skin: str = "palm") -> str:
    return str(server.http.post(f"/v1/campaigns?skin={skin}", json=campaign(name)).raise_for_status().json()["id"])


def change(lab: httpx.Client, path: str, action: str, **fields: str) -> int:
    form = {"form_token": token_of(lab.get(path).text), **fields}
    return lab.post(f"{path}/{action}", data=form).status_code


def undoable(lab: httpx.Client, path: str) -> list[str]:
    """Ids of the changes that the page offers to undo, the latest first."""
    return re.findall(r'action="/changes/([^/"]+)/undo"', lab.get(path).text)


def undo(lab: httpx.Client, path: str, change_id: str) -> httpx.Response:
    """Sent from the page at `path`."""
    return lab.post(f"/changes/{change_id}/undo", data={"form_token": token_of(lab.get(path).text)})


def detail(server: Server, campaign_id: str) -> dict[str, Any]:
    answer: dict[str, Any] = server.http.get(f"/v1/campaigns/{campaign_id}").raise_for_status().json()
    return answer


def test_a_withdrawal_is_undone_until_something_builds_on_it(server: Server, lab: httpx.Client) -> None:
    campaign_id = sent(server, "monday")
    place = f"/campaigns/{campaign_id}"
    before = server.http.get("/v1/skins/palm/history").json()["sensors"]
    assert change(lab, place, "withdraw", reason="wrong sphere") == 303
    assert detail(server, campaign_id)["state"] == "withdrawn"
    assert server.http.get("/v1/skins/palm/history").json()["sensors"] == []
    (own,) = undoable(lab, place)
    assert undo(lab, place, own).status_code == 303
    assert detail(server, campaign_id)["state"] == "current"
    assert detail(server, campaign_id)["withdraw_reason"] is None
    assert server.http.get("/v1/skins/palm/history").json()["sensors"] == before
    text = lab.get(place).text
    assert "“wrong sphere”" in text  # what was done stays readable
    assert "undone: withdrawn" in text
    assert undoable(lab, place) == []
    assert undo(lab, place, own).status_code == 409
    assert undo(lab, place, "ch-nothing").status_code == 404


def test_what_is_written_to_a_campaign_is_found_and_taken_back(server: Server, lab: httpx.Client) -> None:
    campaign_id = sent(server, "wednesday")
    place = f"/campaigns/{campaign_id}"
    d33 = server.http.get(f"/v1/campaigns/{campaign_id}/d33").json()
    fields = {"name": "after the bath", "remark": "wet\nfor a day", "tags": "wet,  batch 7 , wet"}
    assert change(lab, place, "annotate", **fields) == 303
    assert detail(server, campaign_id)["name"] == "after the bath"
    listed = server.http.get("/v1/campaigns", params={"name_contains": "BATH"}).json()["campaigns"]
    assert [entry["id"] for entry in listed] == [campaign_id]
    assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json()["name"] == "wednesday"  # as it came
    assert server.http.get(f"/v1/campaigns/{campaign_id}/d33").json() == d33
    text = lab.get(place).text
    assert "wet, batch 7" in text
    assert "renamed from “wednesday”" in text
    assert change(lab, place, "annotate", name=" ") == 422
    (own,) = undoable(lab, place)
    assert undo(lab, place, own).status_code == 303
    assert detail(server, campaign_id)["name"] == "wednesday"


def test_only_a_skin_without_campaigns_in_use_is_put_away(server: Server, lab: httpx.Client) -> None:
    campaign_id = sent(server, "trial", "trial")
    sent(server, "kept", "kept")
    assert change(lab, "/skins/trial", "discard", reason="a trial") == 409
    assert change(lab, f"/campaigns/{campaign_id}", "withdraw", reason="a trial") == 303
    assert change(lab, "/skins/trial", "discard", reason="a trial") == 303
    assert ">trial</a>" not in lab.get("/").text
    assert [entry["id"] for entry in server.http.get("/v1/skins").json()["skins"]] == ["kept"]
    document = server.http.get(f"/v1/campaigns/{campaign_id}/document").json()
    assert len(document["recordings"]) == 6  # nothing is lost
    own = undoable(lab, "/skins/trial")[0]
    assert undo(lab, "/skins/trial", own).status_code == 303
    assert ">trial</a>" in lab.get("/").text
    assert change(lab, "/skins/trial", "discard", reason="again") == 303
    sent(server, "another", "trial")  # what arrives brings it back
    assert ">trial</a>" in lab.get("/").text


def test_an_export_brings_changes_and_who_made_them(server: Server, elsewhere: Server, lab: httpx.Client) -> None:
    campaign_id = sent(server, "moved")
    place = f"/campaigns/{campaign_id}"
    assert change(lab, place, "annotate", name="renamed", remark="as it was", tags="one, two") == 303
    assert change(lab, place, "exclude", recording="s0-1N", reason="loose") == 303
    assert change(lab, "/skins/palm", "annotate", title="left palm") == 303
    exported = server.http.get("/v1/skins/palm/export").content
    headers = {"Content-Type": "application/x-hdf5"}
    answer = elsewhere.http.post("/v1/skins/import", content=exported, headers=headers)
    assert answer.status_code in (200, 201), answer.text
    there = elsewhere.http.get(place, headers=BROWSING).text
    for text in ("renamed from “moved”", "recording s0-1N excluded", "as it was", "one, two"):
        assert text in there
    assert "left palm" in elsewhere.http.get("/skins/palm", headers=BROWSING).text
    again = elsewhere.http.post("/v1/skins/import", content=exported, headers=headers)
    assert again.json()["present"] == 1, again.text
