"""Which campaign of a skin is the latest, and which one describes it, on every page alike."""

import csv
import re
from typing import Any

import pytest

from tests.service.conftest import emptied
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING, said
from tests.service.pages.test_pages_array import place_of
from tests.support.blocks import block
from tests.support.diagnosed import diagnosed, report, resonant, sent
from tests.support.store_server import Server, campaign

SKIN = "aged"


def recorded(document: dict[str, Any], day: str) -> dict[str, Any]:
    for recording in document["recordings"]:
        recording["recorded_at"] = f"{day}T09:00:00Z"
    return document


@pytest.fixture(scope="module")
def aged(server: Server) -> Server:
    """A skin whose campaigns arrived in another order than they were recorded, the last one of a block alone."""
    for document in (
        recorded(campaign("in September", sensors=4, thickness_mm=3.0), "2024-09-02"),
        recorded(campaign("in May", sensors=2), "2024-05-02"),
        block("the block", recorded_at="2024-11-02T09:00:00Z"),
    ):
        server.http.post(f"/v1/campaigns?skin={SKIN}", json=document).raise_for_status()
    return server


@pytest.mark.usefixtures("aged")
def test_a_block_leaves_the_skin_its_geometry_and_map(server: Server) -> None:
    """Campaigns are in the order of recording; the latest with FRFs describes the skin, and its loads."""
    text = server.http.get(f"/skins/{SKIN}", headers=BROWSING).text
    names = re.findall(r">(the block|in September|in May)</a></th>", text)
    assert names == ["the block", "in September", "in May"]
    assert "the block" in said(server, "/", SKIN)
    facts = said(server, f"/skins/{SKIN}")
    assert "3 mm" in facts
    assert "16 MPa" in facts
    assert "in September" in re.findall(r'id="figure-map".*?<figcaption.*?</figcaption>', text, re.DOTALL)[0]
    assert 'name="thickness_mm" value="3"' in server.http.get(f"/loads?skin={SKIN}", headers=BROWSING).text


def test_a_campaign_of_one_sensor_leaves_the_others_on_the_map(server: Server, visitor: Visit) -> None:
    of_one = recorded(campaign("in October", sensors=1), "2026-10-01")
    for document in (recorded(campaign("in May", sensors=3), "2026-05-03"), of_one):
        server.http.post("/v1/campaigns?skin=parts", json=document).raise_for_status()
    page = visitor.page
    visitor.go("/skins/parts")
    visitor.drawn(2)
    assert "from 1 of 3 sensors" in page.locator(".facts").inner_text()
    about = page.locator("#figure-map figcaption").inner_text()
    assert "It tells of 1 of the 3 sensors. The hollow ones stand at their last value" in about
    told = page.locator("#figure-map .plot").evaluate("plot => plot.data.flatMap((one) => one.customdata ?? [])")
    old = "last measured on 03 May 2026"
    assert [f"s{number}: {old}<br>d33 1" in text for number, text in enumerate(told)] == [False, True, True]
    page.mouse.click(*place_of(page.locator("#figure-map"), "s2"))
    page.wait_for_url("**sensor=s2*")
    assert "FRF of s2 in in May" in page.locator("#figure-frf figcaption").inner_text()
    rows = list(csv.DictReader(server.http.get("/skins/parts/map.csv", headers=BROWSING).text.splitlines()))
    assert [row["absent"] for row in rows] == ["", old, old]


def test_a_skin_whose_last_campaign_is_not_diagnosed_shows_the_diagnosis_before(server: Server) -> None:
    earlier, last = (resonant(name) for name in ("May", "September"))
    diagnosed(server, earlier, report(), skin="half")
    assert "not diagnosed" not in said(server, "/?find=half", "half")
    sent(server, last, "half")
    row = said(server, "/?find=half", "half")
    assert "Contact resonance" in row
    assert "of May; the last campaign is not diagnosed" in row


def test_skins_are_in_the_order_of_recording_from_page_to_page(server: Server) -> None:
    """Whatever the order they arrived in; a campaign over several days says so."""
    emptied(server)
    for number in range(30):
        day = f"2022-{1 + 7 * number % 30 // 3:02d}-{1 + 7 * number % 30 % 3:02d}"
        document = recorded(campaign(f"day {day}", sensors=1, lines=3), day)
        server.http.post(f"/v1/campaigns?skin=skin-{day}", json=document).raise_for_status()
    first = server.http.get("/", headers=BROWSING).text
    link = re.search(r'href="(/\?find=[^"]*before=\d+)"', first)
    assert link is not None
    second = server.http.get(link[1].replace("&amp;", "&"), headers=BROWSING).text
    seen = [re.findall(r'href="/skins/skin-(2022-[0-9-]+)"', page) for page in (first, second)]
    days = [*dict.fromkeys(seen[0]), *dict.fromkeys(seen[1])]
    assert [len(dict.fromkeys(one)) for one in seen] == [25, 5]
    assert days == sorted(days, reverse=True)
    document = recorded(campaign("two days", sensors=1, lines=3), "2022-05-03")
    document["recordings"][1]["recorded_at"] = "2022-06-04T09:00:00Z"
    kept = server.http.post("/v1/campaigns?skin=skin-2022-01-01", json=document).raise_for_status().json()
    facts = server.http.get(f"/campaigns/{kept['id']}", headers=BROWSING).text.split('class="facts"')[1]
    assert re.search(r"2022-05-03</time> to <time[^>]*>2022-06-04", facts)
