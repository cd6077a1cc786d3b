"""Two designs beside each other, materials as presets, and the design the other way round, in a browser."""

import re

import pytest
from playwright.sync_api import expect

from tests.service.pages.conftest import Visit
from tests.support.cases import first
from tests.support.store_server import Server


def cell(visitor: Visit, name: str, column: str) -> str:
    return visitor.page.locator(f"[data-compared={name}] [data-{column}]").inner_text()


def fits_and_is_accessible(visitor: Visit) -> None:
    for width in first(1, (390, 1280)):
        visitor.page.set_viewport_size({"width": width, "height": 900})
        assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
        visitor.require_accessible()


@pytest.mark.soak
def test_a_design_is_pinned_and_the_other_one_moves_beside_it(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/design")
    visitor.drawn(2)
    page.get_by_role("button", name="Pin this as A").press("Enter")
    page.get_by_role("heading", name="A, pinned, and B, as the sliders stand").wait_for()
    assert cell(visitor, "thickness_mm", "change") == "same"
    assert page.get_by_role("columnheader", name="Change from A to B").is_visible()
    slider = page.get_by_label("thickness h, slider")
    assert slider.is_visible()
    page.emulate_media(media="print")
    assert not slider.is_visible()
    assert page.get_by_label("thickness h [mm]").is_visible()
    assert (
        page.locator("section[aria-labelledby=beside]").evaluate("one => getComputedStyle(one).breakInside") == "avoid"
    )
    page.emulate_media(media="screen")
    fits_and_is_accessible(visitor)
    with page.expect_response("**/design/answer?*"):
        page.locator("#thickness_mm").fill("1.25")
    expect(page.locator("[data-compared=thickness_mm] [data-stands]")).to_have_text("1.25 mm")
    assert cell(visitor, "thickness_mm", "change") == "−50 %"
    # Of half the thickness σ is less, for the stress is under a smaller part of the sensor, and the charge is more.
    assert cell(visitor, "told-sigma", "change").startswith("−")
    assert cell(visitor, "told-frf", "change").startswith("+")
    page.reload()  # the address has both
    assert cell(visitor, "thickness_mm", "stands") == "1.25 mm"
    assert "2.5 mm" in page.locator("[data-compared=thickness_mm]").inner_text()
    visitor.drawn(2)
    expect(page.locator("#figure-row").get_by_text("A, pinned")).to_be_visible()
    page.get_by_role("button", name="Unpin A").click()
    page.wait_for_url(lambda address: "pin" not in address)
    assert page.locator("#thickness_mm").input_value() == "1.25"
    expect(page.get_by_role("heading", name="A, pinned")).to_have_count(0)


def test_a_pinned_design_that_cannot_be_is_told(server: Server) -> None:
    answer = server.http.get("/design?pin=pitch_mm%3D1", headers={"Accept": "text/html"})
    assert answer.status_code == 200
    assert "cannot overlap" in answer.text
    answer = server.http.get("/design?pin=pitch_mm%3Dx", headers={"Accept": "text/html"})
    assert "pitch of the array [mm]: x – must be a number" in answer.text


def test_what_is_asked_is_searched_and_what_is_offered_leads_to_its_design(visitor: Visit) -> None:
    page = visitor.page
    visitor.go("/design")
    page.get_by_role("link", name="which skins resolve what you ask").press("Enter")
    visitor.drawn(1)
    fits_and_is_accessible(visitor)
    page.get_by_label("two-point separation, at most").fill("3,5")
    page.get_by_label("two-point separation, at most").press("Enter")
    page.wait_for_url("**resolution_mm=3%2C5**")
    best = page.get_by_role("row", name=re.compile("^Fewest sensors"))
    pitch = float(best.locator("td").nth(2).inner_text().split()[0])
    assert 1.4 < pitch < 1.8  # about half of what is to be resolved
    best.get_by_role("link").click()
    page.get_by_role("heading", name="Design", exact=True).wait_for()
    apart = float(page.locator("[data-result=apart] b").inner_text().split()[0])
    assert apart <= 3.5
    assert float(page.locator("#pitch_mm").input_value()) == pitch


def test_the_map_of_skins_comes_as_numbers(server: Server) -> None:
    lines = server.http.get("/design/search/region.csv?resolution_mm=2").text.splitlines()
    assert lines[0] == "thickness_mm,sensor_radius_mm,largest_pitch_mm,frf_pc_per_n,feasible"
    assert len(lines) == 49
    refused = server.http.get("/design/search/region.csv?resolution_mm=-1")
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "resolution_mm"
    text = server.http.get("/design/search?resolution_mm=60", headers={"Accept": "text/html"}).text
    assert "two-point separation, at most [mm]: 60" in text
