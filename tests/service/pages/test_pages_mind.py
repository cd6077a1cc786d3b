"""Changing one's mind with a mouse: a recording excluded, a campaign withdrawn; and what then is said of models."""

import httpx
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING, token_of
from tests.support.store_server import Server, campaign


@pytest.mark.soak
def test_a_recording_is_excluded_and_the_campaign_withdrawn_by_clicks(visitor: Visit, server: Server) -> None:
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
