"""Several campaigns, of a skin or of a fleet, diagnosed together in the browser; hostile names, and no script."""

import httpx
from playwright.sync_api import Browser

from tests.service.pages.forms import BROWSING, HOSTILE, token_of
from tests.support.diagnosed import finished, sent
from tests.support.store_server import Server, campaign
from underskin import Client


def sent_to(server: Server, skin: str, *names: str) -> list[str]:
    return [sent(server, campaign(name, sensors=1), skin) for name in names]


def test_what_is_outdated_is_diagnosed_again(server: Server) -> None:
    first, second, _ = sent_to(server, "changing", "a", "b", "c")
    with (
        Client(str(server.http.base_url)) as client,
        httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as form,
    ):
        whole = client.skins.diagnose("changing", name="all of it")["id"]
        chosen = client.skins.diagnose("changing", [first, second], "two of it")["id"]
        finished(server)
        sent_to(server, "changing", "d")
        client.campaigns.exclude(second, "s0-1N", "cable loose")
        for diagnosis_id, count, why in ((whole, 4, "excluded since"), (chosen, 2, "excluded since")):
            shown = form.get(f"/diagnoses/{diagnosis_id}").text
            assert why in shown
            assert "campaign “b” was changed" in shown
            assert "Diagnose them again" in shown
            sent_form = {"form_token": token_of(shown), "without": "adhesion"}
            answer = form.post(f"/diagnoses/{diagnosis_id}/again", data=sent_form)
            again = client.diagnoses.get(answer.headers["location"].rpartition("/")[2])
            assert (len(again["campaign_ids"]), again["outdated"], again["without"]) == (count, None, ["adhesion"])
            assert again["name"] == client.diagnoses.get(diagnosis_id)["name"]
        client.campaigns.withdraw(first, "wrong sphere")
        answer = form.post(f"/diagnoses/{chosen}/again", data=sent_form)
        assert (answer.status_code, "withdrawn: wrong sphere" in answer.text) == (409, True)


def test_a_fleet_is_chosen_without_a_script(browser: Browser, server: Server) -> None:
    for number in range(3):
        sent_to(server, f"fleet-{number}", f"{HOSTILE[:20]} {number}")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    address = str(server.http.base_url).rstrip("/")
    page.goto(f"{address}/")
    page.get_by_role("navigation").get_by_role("link", name="Fleets").click()
    page.get_by_label("Find a skin").fill("fleet-")
    page.get_by_role("button", name="Find").click()
    boxes = page.get_by_role("checkbox")
    assert boxes.count() == 3
    for number in range(2):
        page.get_by_label(f"fleet-{number}").check()
    page.get_by_label("Name").fill(HOSTILE)
    page.get_by_role("button", name="Diagnose these skins together").click()
    page.get_by_role("alert").get_by_text("Skins: 2 chosen – must be 3 at least").wait_for()
    assert page.get_by_label("Name").input_value() == HOSTILE
    assert [page.get_by_label(f"fleet-{number}").is_checked() for number in range(3)] == [True, True, False]
    assert page.get_by_label("Find a skin").input_value() == "fleet-"
    page.get_by_label("fleet-2").check()
    page.get_by_role("button", name="Diagnose these skins together").click()
    page.wait_for_url("**/diagnoses/*")
    finished(server)
    page.reload()
    assert "<script>" in page.get_by_role("heading", level=1).inner_text()
    for number in range(3):
        assert page.get_by_role("link", name=f"fleet-{number}").get_attribute("href") == f"/skins/fleet-{number}"
    assert server.http.get(f"{page.url}/report.html", headers=BROWSING).status_code == 200
    page.get_by_role("navigation").get_by_role("link", name="Fleets").click()
    assert page.get_by_role("heading", name="Diagnosed before").count() == 1
    context.close()


def test_a_fleet_with_a_skin_that_has_nothing_to_diagnose_is_refused_in_the_form(server: Server) -> None:
    sent_to(server, "bare-0", "a")
    (only,) = sent_to(server, "bare-1", "b")
    sent_to(server, "bare-2", "c")
    with (
        Client(str(server.http.base_url)) as client,
        httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as form,
    ):
        client.campaigns.withdraw(only, "wrong sphere")
        fields = {"form_token": token_of(form.get("/fleets").text), "find": "bare-", "name": "<b>batch"}
        chosen = {f"skin-{number + 1}": f"bare-{number}" for number in range(3)}
        answer = form.post("/fleets/diagnosis", data={**fields, **chosen})
        assert answer.status_code == 409
        assert "leave it out of the fleet" in answer.text
        assert answer.text.count(" checked") == 3
        assert 'value="&lt;b&gt;batch"' in answer.text
        nameless = form.post("/fleets/diagnosis", data={**fields, **chosen, "name": " "})
        assert (nameless.status_code, "Name: " in nameless.text) == (422, True)
        unknown = form.post("/fleets/diagnosis", data={**fields, **chosen, "skin-1": "nobody"})
        assert (unknown.status_code, "Skins: nobody – must be the id of a skin" in unknown.text) == (422, True)
