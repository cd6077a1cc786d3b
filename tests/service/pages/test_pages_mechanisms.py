"""The catalogue on its page: pictures, twins, where each law was found; the lab's own, kept, left out, discarded."""

import re
from xml.etree import ElementTree

import pytest
from playwright.sync_api import expect

from service.store import database, diagnosed_together, diagnoses
from service.usecases.mechanism_catalogue import findings
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import said
from tests.support.cases import first
from tests.support.diagnosed import diagnosed, report, resonant, sent, table
from tests.support.store_server import Server
from underskin import __version__
from underskin.mechanisms.registry import built_in


def _require_accessible_at_both_widths(visitor: Visit) -> None:
    for width in first(1, (390, 1280)):
        visitor.page.set_viewport_size({"width": width, "height": 900})
        assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
        visitor.require_accessible()


def test_each_law_has_its_picture_its_twins_and_where_it_was_found(server: Server, visitor: Visit) -> None:
    campaign_id, diagnosis_id = diagnosed(server, resonant("swinging"), report(), skin="found")
    page = visitor.page
    visitor.go("/mechanisms")
    law = page.locator("#contact_resonance")
    expect(law.get_by_text(re.compile("Found in 1 of "))).to_be_visible()
    expect(law.get_by_role("link", name="swinging", exact=True)).to_have_attribute("href", f"/campaigns/{campaign_id}")
    probability = law.get_by_role("link", name=re.compile("in the diagnosis of swinging"))
    told = next(one["probability"] for one in report()["mechanisms"] if one["name"] == "contact_resonance")
    assert float(probability.inner_text().removesuffix("%")) == pytest.approx(100 * told, abs=0.5)
    expect(page.locator("#adhesion").get_by_text(re.compile("Found in none of "))).to_be_visible()
    edge = page.locator("#moving_contact_edge")
    twin = edge.get_by_role("listitem").filter(has_text="modulus error")
    assert "indentation" in twin.inner_text()
    for image in page.locator("img.picture").all():
        image.scroll_into_view_if_needed()
    page.wait_for_function("() => [...document.images].every(one => one.complete && one.naturalWidth > 0)")
    assert page.locator("img.picture").count() == len(built_in())
    _require_accessible_at_both_widths(visitor)
    page.get_by_role("row", name="ageing").get_by_role("link").press("Enter")  # the table leads to each by keyboard
    page.wait_for_url("**/mechanisms#ageing")
    expect(page.locator("#ageing")).to_be_in_viewport()
    probability.click()
    page.wait_for_url(f"**/diagnoses/{diagnosis_id}")


@pytest.mark.parametrize("verdict", ["ambiguous", "unexplained"])
def test_a_mechanism_is_found_where_it_is_surely_present_whatever_the_verdict(server: Server, verdict: str) -> None:
    counted = []
    for probability in (None, 0.9, 0.55):
        if probability is not None:
            stated = [{**one, "probability": probability} for one in report()["mechanisms"]]
            made = {**report(), "verdict": verdict, "mechanisms": stated}
            diagnosed(server, resonant(f"{verdict} {probability}"), made, skin=verdict)
        row = re.search(r"(\d+)(?:, possible in (\d+))?$", said(server, "/mechanisms", "Contact resonance"))
        assert row is not None
        counted.append((int(row[1]), int(row[2] or 0)))
    (was_found, was_possible), *after = counted
    assert after == [(was_found + 1, was_possible), (was_found + 1, was_possible + 1)]


def test_what_was_withdrawn_or_left_out_counts_as_found_nowhere(server: Server) -> None:
    campaign_id, _ = diagnosed(server, resonant("taken back"), report(), skin="back")
    rows = server.http.get("/mechanisms/contact_resonance/found.csv").text.splitlines()
    assert rows[0] == "diagnosis,campaign,skin,name,ended_at,verdict,probability"
    assert [row.split(",")[1] for row in rows[1:]].count(campaign_id) == 1
    answer = server.http.post(f"/v1/campaigns/{campaign_id}/withdraw", json={"reason": "another rig"})
    assert answer.status_code == 200, answer.text
    left = server.http.get("/mechanisms/contact_resonance/found.csv").text
    assert campaign_id not in left


def test_pictures_are_drawings_with_a_line_for_each_strength(server: Server) -> None:
    answer = server.http.get("/mechanisms/adhesion/picture.svg")
    assert answer.headers["content-type"] == "image/svg+xml"
    tree = ElementTree.fromstring(answer.text)
    lines = tree.findall("{http://www.w3.org/2000/svg}polyline")
    assert len(lines) == 2 * 4  # without it and at three strengths, magnitude and phase
    assert sum("stroke-dasharray" in line.attrib for line in lines) == 2  # the paper's model, without it
    assert len({line.get("stroke-width") for line in lines if "stroke-dasharray" not in line.attrib}) == 3
    tag = {"If-None-Match": answer.headers["etag"]}
    assert server.http.get("/mechanisms/adhesion/picture.svg", headers=tag).status_code == 304
    header = server.http.get("/mechanisms/adhesion/effect.csv").text.splitlines()[0]
    assert header.count("magnitude") == 4
    for path in ("picture.svg", "effect.csv", "found.csv"):
        assert server.http.get(f"/mechanisms/cheese/{path}").status_code == 404


def test_campaigns_diagnosed_together_count_once(server: Server) -> None:
    """A diagnosis of two of three, then of all three, then of two of them again."""
    sent_ids = [sent(server, resonant(f"counted {number}"), "counted") for number in range(3)]
    store = database(server.place.database_url, server.place.folder)
    with store.writing() as connection:
        members = diagnosed_together.usable(connection, "counted")
        assert [one.campaign_id for one in members] == sent_ids
        basis = diagnoses.Basis(table().sha256, __version__)
        for name, chosen in (("two", members[:2]), ("all", members), ("two again", members[:2])):
            diagnoses.ask_together(connection, diagnosed_together.Together("skin", name, chosen, ()), basis, None)
            claimed = diagnoses.claim(connection, "test", basis)
            assert claimed is not None
            assert diagnoses.finish(connection, claimed.number, "test", report())
    names = [one.name for one in findings(store).by_mechanism["contact_resonance"] if one.skin_id == "counted"]
    store.close()
    assert names == ["two again", "all"]
