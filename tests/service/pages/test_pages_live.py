"""What arrives while a skin's page is open is shown there without a reload; what the reader does stays."""

from tests.service.pages.conftest import Visit
from tests.support.diagnosed import asked, finished, report, sent
from tests.support.store_server import Server, campaign

# Gone with a reload, and with a page that another one takes the place of.
MARK = "window.sameDocument = true"
STAYED = "window.sameDocument === true"


def test_a_campaign_that_arrives_is_shown_without_a_reload(visitor: Visit, server: Server) -> None:
    page = visitor.page
    sent(server, campaign("first", sensors=1), "live")
    visitor.go("/skins/live")
    visitor.drawn(2)
    page.evaluate(MARK)
    page.get_by_text("Join another skin to this one").click()
    page.get_by_label("Id of the other skin").fill("half ty")
    second = sent(server, campaign("second", sensors=1, d33=11.0), "live")
    page.get_by_role("link", name="second", exact=True).wait_for()
    page.wait_for_function("() => document.querySelectorAll('tbody tr').length === 2")
    assert page.get_by_role("link", name="second", exact=True).get_attribute("href") == f"/campaigns/{second}"
    page.get_by_text("Renewed at").wait_for()
    assert page.get_by_label("Id of the other skin").input_value() == "half ty"
    points = "document.querySelectorAll('#figure-history .plot')[0].data[0].x.length"
    visitor.drawn(2)
    assert page.evaluate(points) == 2
    times = page.locator("tbody time").all_inner_texts()
    assert len(set(times)) == 1
    assert "11:00" in times[0]  # 9:00 UTC, in the viewer's zone
    assert page.evaluate(STAYED)
    visitor.require_accessible()


def test_a_verdict_and_a_withdrawal_are_shown_without_a_reload(visitor: Visit, server: Server) -> None:
    page = visitor.page
    campaign_id = sent(server, campaign("only", sensors=1), "verdict")
    visitor.go("/skins/verdict")
    page.evaluate(MARK)
    asked(server, campaign_id)
    page.get_by_text("queued").or_(page.get_by_text("waits")).first.wait_for()
    finished(server)
    tag = page.get_by_role("row", name="only").get_by_role("link").nth(1)
    page.wait_for_function(
        "verdict => document.querySelector('tbody .tag')?.textContent.includes(verdict)",
        arg=report()["verdict"],
    )
    assert "/diagnoses/" in str(tag.get_attribute("href"))
    server.http.post(f"/v1/campaigns/{campaign_id}/withdraw", json={"reason": "wrong sphere"})
    page.get_by_text("withdrawn: wrong sphere").wait_for()
    assert page.evaluate(STAYED)
