"""The lab's own mechanisms on the pages: a law kept from its diagnosis, found in the catalogue, left out, discarded."""

from pathlib import Path

from playwright.sync_api import Browser, expect

from tests.service.pages.conftest import Visit, visit
from tests.service.routes.test_mechanisms import warmed
from tests.support.diagnosed import sent
from tests.support.store_server import Place, running


def test_a_law_is_kept_from_its_diagnosis_and_the_campaign_diagnosed_with_and_without_it(
    browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    with running(Place(folder), UNDERSKIN_DIAGNOSIS_WORKERS="1") as server:
        campaign_id = sent(server, warmed())
        for visitor in visit(browser, server):
            page = visitor.page
            visitor.go(f"/campaigns/{campaign_id}")
            page.get_by_role("button", name="Diagnose").click()
            page.get_by_role("heading", name="Keep this law under a name").wait_for(timeout=60_000)
            page.get_by_label("Name", exact=False).first.fill("Warm Amplifier")
            page.get_by_role("button", name="Keep it").click()  # which the browser refuses: capitals and a blank
            page.get_by_label("Name", exact=False).first.fill("warm_amplifier")
            page.get_by_label("What it is").fill("The gain follows the temperature.")
            page.get_by_role("button", name="Keep it").click()
            page.wait_for_url("**/mechanisms")
            own = page.get_by_role("region", name="The lab's own")
            expect(own.get_by_role("heading", name="warm_amplifier")).to_be_visible()
            expect(own.get_by_text("The gain follows the temperature.")).to_be_visible()
            expect(page.get_by_role("row", name="adhesion")).to_be_visible()
            _require_accessible_at_both_widths(visitor)

            visitor.go(f"/campaigns/{campaign_id}")
            page.get_by_role("button", name="Diagnose").first.click()
            page.get_by_role("heading", name="Suppose that it is not").wait_for(timeout=60_000)
            _require_accessible_at_both_widths(visitor)
            page.get_by_role("button", name="Without warm amplifier").click()
            page.get_by_text("Supposed that it is not warm amplifier").wait_for()
            page.get_by_role("heading", name="Keep this law under a name").wait_for(timeout=60_000)

            page.get_by_role("link", name="Mechanisms", exact=True).click()
            page.get_by_role("button", name="Discard warm_amplifier").click()
            expect(page.get_by_text("There is none yet.")).to_be_visible()


def _require_accessible_at_both_widths(visitor: Visit) -> None:
    for width in (390, 1280):
        visitor.page.set_viewport_size({"width": width, "height": 900})
        assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
        visitor.require_accessible()
