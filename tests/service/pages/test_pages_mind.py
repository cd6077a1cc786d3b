"""Changing one's mind with a mouse: a recording excluded, a campaign withdrawn; and what then is said of models."""

import re

import httpx
import pytest
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING, token_of
from tests.support.diagnosed import asked, diagnosed, report, resonant
from tests.support.store_server import Server, campaign


@pytest.mark.soak
def test_recording_excluded_campaign_withdrawn(visitor: Visit, server: Server) -> None:
    """A recording is excluded and the campaign withdrawn by clicks."""
    page = visitor.page
    kept = server.http.post("/v1/campaigns?skin=mind", json=campaign("a loose cable")).json()
    before = server.http.get(f"/v1/campaigns/{kept['id']}/d33").json()["array"]["d33_pc_per_n"]
    visitor.go(f"/campaigns/{kept['id']}")
    page.get_by_text("Exclude a recording, or correct or withdraw the campaign").click()
    exclude = page.locator("form", has=page.get_by_role("button", name="Exclude", exact=True))
    exclude.get_by_label("Recording").fill("s1-2N")
    exclude.get_by_label("Reason").fill("cable <b>loose</b>")
    exclude.get_by_label("Your name").fill("Maria <i>B</i>")
    exclude.get_by_role("button", name="Exclude").click()
    page.get_by_text("1 excluded").wait_for()
    row = page.get_by_role("row", name="s1-2N")
    assert "excluded by Maria <i>B</i>: cable <b>loose</b>" in row.inner_text()
    page.get_by_text("What was changed here").click()
    assert "by Maria <i>B</i>" in page.locator(".changes").inner_text()
    after = server.http.get(f"/v1/campaigns/{kept['id']}/d33").json()["array"]["d33_pc_per_n"]
    assert after != before
    assert f"{after:.3g}" in page.locator(".result").inner_text()
    visitor.require_accessible()
    page.get_by_text("Exclude a recording, or correct or withdraw the campaign").click()
    withdraw = page.locator("form", has=page.get_by_role("button", name="Withdraw the campaign"))
    withdraw.get_by_label("Reason").fill("wrong sphere")
    withdraw.get_by_role("button", name="Withdraw the campaign").click()
    page.get_by_text("Withdrawn").first.wait_for()
    assert "wrong sphere. Figures do not use it" in page.get_by_role("status").inner_text()
    assert page.get_by_role("button", name="Diagnose").count() == 0
    visitor.require_accessible()
    visitor.go("/skins/mind")
    assert "withdrawn: wrong sphere" in page.get_by_role("row", name="a loose cable").inner_text()
    visitor.require_accessible()
    visitor.go("/")
    assert "none in use" in page.get_by_role("row", name="mind").inner_text()


def test_a_key_tells_who_it_is_whatever_is_typed(locked: tuple[Server, dict[str, str]]) -> None:
    server, keys = locked
    kept = server.http.post("/v1/campaigns", json=campaign("signed")).json()["id"]
    own = {"Origin": str(server.http.base_url).rstrip("/")}
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as writer:
        writer.post("/login", data={"form_token": token_of(writer.get("/login").text), "key": keys["write"]})
        page = writer.get(f"/campaigns/{kept}").text
        assert 'name="who"' not in page
        assert "the name of your key, the writeer" in page
        form = {"form_token": token_of(page), "reason": "wrong sphere", "who": "somebody else"}
        assert writer.post(f"/campaigns/{kept}/withdraw", data=form, headers=own).status_code == 303
    assert server.http.get(f"/v1/campaigns/{kept}").json()["withdrawn_from"] == "the writeer"


@pytest.mark.soak
def test_recording_not_said(visitor: Visit, server: Server) -> None:
    """A recording that is not there is said so."""
    page = visitor.page
    kept = server.http.post("/v1/campaigns?skin=slip", json=campaign("a slip")).json()
    visitor.go(f"/campaigns/{kept['id']}")
    page.get_by_text("Exclude a recording, or correct or withdraw the campaign").click()
    exclude = page.locator("form", has=page.get_by_role("button", name="Exclude", exact=True))
    exclude.get_by_label("Recording").fill("s9")
    exclude.get_by_label("Reason").fill("a guess")
    exclude.get_by_role("button", name="Exclude").click()
    said = page.get_by_role("alert")
    assert "s9" in said.inner_text()
    expect(said).to_be_focused()  # far below the top of the page
    expect(said).to_be_in_viewport()
    visitor.require_accessible()
    visitor.wrong.clear()  # the browser says so of every 404
    page.go_back()
    assert "in use" in page.get_by_role("row", name="s0-1N").inner_text()


@pytest.mark.soak
def test_who_undoes_is_asked_without_keys(visitor: Visit, server: Server) -> None:
    page = visitor.page
    kept = server.http.post("/v1/campaigns?skin=hasty", json=campaign("hasty")).raise_for_status().json()
    place = f"/campaigns/{kept['id']}"
    server.http.post(f"/v1{place}/exclusions", json={"recording": "s0-1N", "reason": "cable"}).raise_for_status()
    visitor.go(place)
    page.get_by_text("What was changed here: 1").click()
    changes = page.locator(".changes")
    name = changes.get_by_label("Your name")
    name.fill("Mara")
    name.press("Enter")  # undoes nothing
    assert name.input_value() == "Mara"
    changes.get_by_role("button", name="Undo").click()
    page.get_by_text("What was changed here: 2").click()
    expect(changes.get_by_text("by Mara")).to_be_visible()
    assert server.http.get(f"/v1{place}").json()["excluded"] == 0


def test_excluded_cannot_undone_said(server: Server) -> None:
    """Where all is excluded and where that cannot be undone is said."""
    kept = server.http.post("/v1/campaigns?skin=bare", json=campaign("bare", sensors=1)).json()
    place = f"/campaigns/{kept['id']}"

    def page_after(path: str, **sent: str) -> str:
        server.http.post(f"/v1{path}", json=sent).raise_for_status()
        return server.http.get(place, headers=BROWSING).text

    assert "Where there is no Undo" not in page_after(f"{place}/exclusions", recording="s0-1N", reason="cable")
    both = page_after(f"{place}/exclusions", recording="s0-2N", reason="cable")
    assert "No d33 and no modulus: all its recordings are excluded." in both
    assert "Where there is no Undo, something builds on it: a later change" in both
    assert "An excluded recording comes back with a corrected version" in both
    latest, _ = server.http.get(f"/v1{place}/changes").json()["changes"]
    one = page_after(f"/changes/{latest['id']}/undo")
    assert "are excluded" not in one
    assert "Where there is no Undo" not in one
    waiting = asked(server, kept["id"])
    assert "Where there is no Undo" in server.http.get(place, headers=BROWSING).text
    server.http.delete(f"/v1/diagnoses/{waiting}").raise_for_status()  # so that no other test here claims it


@pytest.mark.soak
def test_excluded_recording_takes_model(visitor: Visit, server: Server) -> None:
    """An excluded recording takes the model out of force."""
    page = visitor.page
    campaign_id, diagnosis_id = diagnosed(server, resonant("explained"), report(), "adopts")
    visitor.go(f"/diagnoses/{diagnosis_id}")
    page.get_by_role("link", name=re.compile("^Adopt ")).click()
    page.get_by_role("button", name="Adopt contact resonance of the rig").click()
    page.wait_for_url("**/skins/adopts?model=adopted")
    assert "In force: contact resonance" in page.get_by_role("region", name="Adopted model").inner_text()
    visitor.go(f"/campaigns/{campaign_id}")
    page.get_by_text("Exclude a recording, or correct or withdraw the campaign").click()
    exclude = page.locator("form", has=page.get_by_role("button", name="Exclude", exact=True))
    exclude.get_by_label("Recording").fill("r0")
    exclude.get_by_label("Reason").fill("cable loose")
    exclude.get_by_role("button", name="Exclude").click()
    page.get_by_text("1 excluded").wait_for()
    visitor.go("/skins/adopts?model=adopted")
    assert "is outdated and serves no figures" in page.get_by_role("status").inner_text()
    assert "by the paper's model" in page.locator("#figure-history figcaption").inner_text()
    visitor.go(f"/diagnoses/{diagnosis_id}")
    assert "recordings were excluded since" in page.get_by_role("status").first.inner_text()
    assert page.get_by_role("button", name="Adopt contact resonance of the rig").count() == 0


def test_ambiguous_diagnosis_names_rivals_settle(visitor: Visit, server: Server) -> None:
    """An ambiguous diagnosis names its rivals and what would settle it."""
    page = visitor.page
    rivals = [
        {"mechanisms": ["timing_delay"], "probability": 0.41, "why_not": "the recordings hardly tell it apart"},
        {"mechanisms": ["none_of_these"], "probability": 0.03, "why_not": "a smooth discrepancy explains less"},
    ]
    said = "Best explained by contact_resonance (56 %), but these rivals remain: timing delay (41 %)."
    found = {**report(), "verdict": "ambiguous", "probability": 0.56, "alternatives": rivals, "statement": said}
    _, diagnosis_id = diagnosed(server, resonant("two ways"), found, "ambiguous")
    visitor.go(f"/diagnoses/{diagnosis_id}")
    page.locator("summary", has_text="what to keep in mind").click()
    assert "Best explained by contact resonance (56 %)" in page.locator(".summary").inner_text()
    assert "several explanations remain · probability 56 %" in page.locator(".verdict").inner_text()
    page.get_by_role("heading", name="What the model lacks, and").click()  # which is folded below the summary
    table = page.get_by_role("table").filter(has_text="why not")
    assert "timing delay" in table.inner_text()
    assert "41 %" in table.inner_text()
    assert (
        "It cannot be adopted as the skin's model: several explanations remain" in page.get_by_role("main").inner_text()
    )
    visitor.require_accessible()
    answer = server.http.post("/v1/skins/ambiguous/model", json={"diagnosis_id": diagnosis_id})
    assert (answer.status_code, "several explanations remain" in answer.json()["detail"]) == (422, True)
