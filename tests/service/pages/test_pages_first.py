"""What a visitor reads first: what is wrong with a skin, what two campaigns differ by, what a report says."""

import re
from typing import Any

import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.finished import keep, made
from tests.service.pages.forms import BROWSING
from tests.support import store_server
from tests.support.cases import first
from tests.support.diagnosed import sent
from tests.support.store_server import Server

WIDTHS = (390, 1440)


def array(name: str, year: int, level: float, factors: dict[str, float]) -> dict[str, Any]:
    """A campaign of six sensors, each with its factor; one of its recordings is refused."""
    document = store_server.campaign(name, sensors=6, d33=level)
    for recording in document["recordings"]:
        recording["recorded_at"] = f"{year}-05-03T09:00:00Z"
        factor = factors.get(recording["sensor"], 1.0)
        for part in ("frf_re_pc_per_n", "frf_im_pc_per_n"):
            recording[part] = [factor * value for value in recording[part]]
    refused = {**document["recordings"][0], "id": "upside-down", "preload_n": -2.0}
    return {**document, "recordings": [*document["recordings"], refused]}


@pytest.fixture(scope="module")
def ids(server: Server) -> list[str]:
    """Two campaigns of a skin: in the second s1 is weak, s2 dead, and all fell by a tenth."""
    before = sent(server, array("before", 2017, 14.0, {}), "aged")
    return [before, sent(server, array("after", 2018, 12.6, {"s1": 0.8, "s2": 0.0}), "aged")]


@pytest.mark.parametrize("width", first(1, WIDTHS))
def test_overviews_name_what_is_wrong(visitor: Visit, ids: list[str], width: int) -> None:
    """Start, skin and campaign name the weak and the dead sensor and what was refused, in a line."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 900})
    lines = {}
    for path in ("/", "/skins/aged", f"/campaigns/{ids[1]}"):
        visitor.go(path)
        lines[path] = page.locator(".attention").inner_text()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert "1 recording refused" in lines[path]
        assert re.search(r"s1 weak: 8\d % of the array's median", lines[path])
        visitor.require_accessible()
    assert "s2 dead" in lines["/"]
    assert "s2 dead" in lines[f"/campaigns/{ids[1]}"]
    assert "s2 is dead since 2018-05-03" in (trend := visited(visitor, "/skins/aged", "#array-trend"))
    assert "fell by" in trend
    assert "fell by" not in lines["/"]  # where nothing tells it from chance


def visited(visitor: Visit, path: str, selector: str) -> str:
    visitor.go(path)
    return visitor.page.locator(selector).inner_text()


@pytest.mark.parametrize("width", first(1, WIDTHS))
def test_compare_leads_with_what_differs(visitor: Visit, ids: list[str], width: int) -> None:
    """A sentence says by how much the array and which sensors differ; rows have percent; FRFs lie over each other."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 900})
    visitor.go(f"/compare?first={ids[0]}&second={ids[1]}")
    lead = page.locator(".lead").inner_text().replace("−", "-")
    assert re.match(r"d33 of the array fell by \d+\.\d %", lead)
    assert "s2 -100 %" in lead
    row = page.get_by_role("row", name=re.compile("^s2"))
    assert "differs" in row.inner_text()
    assert "100" in row.get_by_role("cell").first.inner_text()
    visitor.drawn(4)
    names = page.locator("#figure-frf .plot").evaluate("plot => plot.data.map((one) => [one.name, one.line.dash])")
    assert ["first, R 4 mm, 1 N", "dash"] in names
    assert ["second, R 4 mm, 1 N", "solid"] in names
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    visitor.require_accessible()


@pytest.mark.parametrize("width", first(1, WIDTHS))
def test_first_screen_of_a_report(visitor: Visit, server: Server, width: int) -> None:
    """Headline, what to quote, what to do, one button; the rest is folded, and no percentage comes twice."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 900})
    place = keep(server, f"screen{width}", made())
    visitor.go(place)
    summary = page.locator(".summary")
    assert not summary.locator(".why p").first.is_visible()
    assert [one.inner_text() for one in summary.locator("> dl > dt").all()][:2] == ["To quote", "Next"]
    assert summary.locator("> dl").bounding_box()["y"] < 900  # type: ignore[index]
    whole = page.locator(".report").evaluate("one => one.innerText.slice(0, one.innerText.indexOf('Why, how well'))")
    percentages = re.findall(r"\d[\d.]* %", whole)
    assert len(percentages) == len(set(percentages)), whole
    buttons = page.locator(".head .button:not(.second), .summary .button").all()
    assert len([button for button in buttons if button.is_visible()]) == 1
    recorded = page.locator(".recorded").inner_text()
    assert f"Skin screen{width}; h 2.5 mm; E 2 MPa; rT 1.5 mm; spheres of radius" in recorded
    assert re.search(r"preloads .* N; 12 recordings, .*; underskin .*, table [0-9a-f]{8}", recorded)
    summary.locator(".why > summary").click()
    assert summary.locator(".why p").first.is_visible()
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.emulate_media(media="print")
    assert page.locator(".recorded").is_visible()
    page.emulate_media(media="screen")
    assert recorded in server.http.get(f"{place}/report.html").text


@pytest.mark.parametrize("width", first(1, WIDTHS))
def test_documentation_is_served(visitor: Visit, server: Server, ids: list[str], width: int) -> None:
    """Each page links to its part of the documentation; a route is tried by a click; no link leads nowhere."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 900})
    visitor.go("/compare")
    page.get_by_role("link", name="About this page").click()
    page.wait_for_url("**/docs/store#reading")
    assert page.locator("#reading").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    visitor.require_accessible()
    visitor.go("/docs")
    page.locator("details#list_skins > summary, details#skins > summary").first.click()
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.locator("details[open] form button").first.click()
    page.wait_for_url("**/v1/skins*")
    assert "aged" in page.locator("body").inner_text()
    visitor.wrong.clear()  # of JSON the browser asks for an icon at a place of its own
    for start in (
        "/",
        "/skins/aged",
        f"/campaigns/{ids[0]}",
        "/upload",
        "/d33",
        "/design",
        "/loads",
        "/field",
        "/fleets",
    ):
        place = re.search(r'href="(/docs/[^"#]+)(?:#([^"]+))?">About', server.http.get(start, headers=BROWSING).text)
        assert place is not None
        text = server.http.get(place[1], headers=BROWSING).text
        assert place[2] is None or f'id="{place[2]}"' in text, start


def test_plain_bytes_for_plain_clients(server: Server) -> None:
    """A client that does not ask for compression gets none, of pages and of their files."""
    style = re.search(r'href="(/static/underskin.css[^"]*)"', server.http.get("/docs", headers=BROWSING).text)
    assert style is not None
    for path in ("/docs", style[1]):
        answer = server.http.get(path, headers={**BROWSING, "Accept-Encoding": "identity"})
        assert "Content-Encoding" not in answer.headers
        assert "Content-Encoding" in server.http.get(path, headers={**BROWSING, "Accept-Encoding": "gzip"}).headers
