"""A pressure map in the browser: seen, computed, saved; and what is wrong with a bad one said beside it."""

import csv
import json

import httpx
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING, token_of
from tests.service.pages.uploads import file
from tests.support.repository import ROOT
from tests.support.store_server import Server, campaign

EXAMPLE = ROOT / "examples" / "stress" / "fingertip.csv"
SMALL = "mm,-1,0,1\n-1,0,0.1,0\n0,0.1,0.3,0.1\n1,0,0.1,0\n"


def test_a_map_is_seen_computed_and_saved(visitor: Visit, server: Server) -> None:
    page = visitor.page
    sent = server.http.post("/v1/campaigns", params={"skin": "finger"}, json=campaign("for a map"))
    assert sent.status_code == 201
    visitor.go("/loads?skin=finger")
    page.get_by_role("link", name="a pressure map").click()
    page.get_by_role("heading", name="A pressure map on skin finger").wait_for()
    with page.expect_download() as saving:
        page.get_by_role("link", name="this one").click()
    assert saving.value.path().read_bytes() == EXAMPLE.read_bytes()
    page.get_by_label("The map as a file").set_input_files(file("mine.csv", SMALL))
    page.get_by_role("button", name="Compute").click()
    page.get_by_label("or as text").get_by_text("0.3").wait_for()
    visitor.drawn(2)
    visitor.require_accessible()
    shown = page.get_by_role("row", name="s0").locator("td").all_inner_texts()
    with page.expect_download() as saving:
        page.locator("#figure-charge").get_by_role("link", name="CSV").click()
    assert saving.value.suggested_filename == "charge.csv"
    rows = list(csv.DictReader(saving.value.path().read_text().splitlines()))
    assert [row["sensor"] for row in rows] == ["s0", "s1", "s2"]
    assert float(shown[2]) == pytest.approx(float(rows[0]["charge_pc"]), rel=2e-3)
    with page.expect_download() as saving:
        page.locator("#figure-pressure").get_by_role("button", name="SVG").click()
    assert "<svg" in saving.value.path().read_text()
    with page.expect_download() as saving:
        page.get_by_role("link", name="request.json").click()
    asked = json.loads(saving.value.path().read_text())
    assert asked["pressure_map"]["pressure_mpa"] == [[0, 0.1, 0], [0.1, 0.3, 0.1], [0, 0.1, 0]]
    answered = server.http.post("/v1/stress", json=asked).json()
    assert [float(row["charge_pc"]) for row in rows] == answered["charge_pc"]
    page.get_by_text("The same by request").click()
    assert "-d @request.json" in page.get_by_label("Shell").inner_text()
    page.get_by_label("or as text").fill(SMALL.replace(",", "\t"))  # as a spreadsheet copies it
    doubled = f"{2 * float(page.get_by_label('d33').input_value()):g}"
    page.get_by_label("d33").fill(doubled)
    page.get_by_role("button", name="Compute").click()
    page.wait_for_load_state()
    twice = page.get_by_role("row", name="s0").locator("td").all_inner_texts()
    assert float(twice[2]) == pytest.approx(2 * float(rows[0]["charge_pc"]), rel=2e-3)
    with page.expect_download() as saving:
        page.locator("#figure-pressure").get_by_role("link", name="CSV").click()
    page.get_by_label("The map as a file").set_input_files(saving.value.path())  # what is saved can be sent
    page.get_by_role("button", name="Compute").click()
    page.wait_for_load_state()
    assert page.get_by_role("row", name="s0").locator("td").all_inner_texts() == twice
    page.get_by_label("or as text").fill(SMALL.replace("0.3", "nan"))
    page.get_by_role("button", name="Compute").click()
    assert "must be a finite number (line 3, cell 3 of the map)" in page.get_by_role("alert").inner_text()
    assert page.get_by_label("or as text").input_value() == SMALL.replace("0.3", "nan")
    assert page.get_by_label("d33").input_value() == doubled
    visitor.require_accessible()


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "must be CSV"),
        (b"mm,0,1\n0,1,1\n1,1\n", "must have as many as line 1 has (3) (line 3 of pressed.csv)"),
        (b"mm,0,1\n0,1,inf\n1,1,1\n", "must be a finite number (line 2, cell 3 of pressed.csv)"),
        (b"mm,0,1\n0,1,1 MPa\n1,1,1\n", "must be a number (line 2, cell 3 of pressed.csv)"),
        (b"mm,0,1\n0,1,-1\n1,1,1\n", "a pressure does not pull (line 2, cell 3 of pressed.csv)"),
        (b"mm,0,1000\n0,1,1\n1,1,1\n", "is it in mm?"),
        (b"mm,0,0.001\n0,1,1\n0.001,1,1\n", "is it in mm?"),
        (b"mm,0,1\n0,1,40000\n1,1,1\n", "more than the layer"),
        (b"PK\x03\x04\x00\x00", "must be a readable CSV file"),
        (b"mm,0,1\n" + b"0,1,1\n" * 200_000, "at most 1 MB"),
    ],
)
def test_what_is_wrong_with_a_map_is_said_beside_it(server: Server, content: bytes, told: str) -> None:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as somebody:
        form = {"form_token": token_of(somebody.get("/loads/map").text), "thickness_mm": "2.25", "map": SMALL}
        answer = somebody.post("/loads/map", data=form, files={"file": ("pressed.csv", content)})
    assert answer.status_code == 200
    assert told in answer.text.replace("&#39;", "'")
    assert 'name="thickness_mm" value="2.25"' in answer.text


def test_much_more_than_a_map_is_not_taken(server: Server) -> None:
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as somebody:
        form = {"form_token": token_of(somebody.get("/loads/map").text)}
        answer = somebody.post("/loads/map", data=form, files={"file": ("a.csv", b"0,1,1\n" * 500_000)})
    assert answer.status_code == 413
    assert "exceeds 2.1 MB" in answer.text
