"""Tables: sorted and filtered by keyboard, all recordings page by page, numbers as workbooks, in a dark scheme too."""

import csv
import io
from urllib.parse import quote

import numpy as np
import pytest
from openpyxl import load_workbook

from service.pages.shared.downloads import workbook
from tests.service.pages.conftest import Visit
from tests.support.cases import first
from tests.support.store_server import Server, campaign

SENSORS = 40


@pytest.fixture(scope="module")
def place(server: Server) -> str:
    """The page of a campaign of 80 recordings."""
    document = campaign("many", sensors=SENSORS, lines=4)
    return f"/campaigns/{server.http.post('/v1/campaigns?skin=many', json=document).raise_for_status().json()['id']}"


@pytest.mark.parametrize("width", first(1, [390, 1280]))
def test_a_table_is_sorted_and_filtered_with_the_keyboard(visitor: Visit, place: str, width: int) -> None:
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 844})
    visitor.go(place)
    table = page.get_by_role("region", name="d33 of each sensor")
    heading = table.get_by_role("button", name="d33 [pC/N]")
    heading.focus()
    page.keyboard.press("Enter")
    values = [float(text) for text in table.locator("tbody td:nth-child(2)").all_inner_texts()]
    assert values == sorted(values)
    assert len(values) == SENSORS
    page.keyboard.press("Enter")
    assert [float(text) for text in table.locator("tbody td:nth-child(2)").all_inner_texts()] == values[::-1]
    assert table.locator("[aria-sort=descending]").count() == 1
    page.locator(".filter", has=page.get_by_label("Filter")).first.get_by_label("Filter").fill("s39")
    assert table.locator("tbody tr:visible").count() == 1
    assert page.locator(".filter [role=status]").first.inner_text() == f"1 of {SENSORS}"
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    visitor.require_accessible()


def test_all_recordings_are_listed_page_by_page(visitor: Visit, place: str) -> None:
    page = visitor.page
    visitor.go(place)
    page.get_by_text(f"Recordings: {2 * SENSORS}").click()
    listed = page.get_by_role("region", name="Recordings").locator("tbody th")
    seen = listed.all_inner_texts()
    assert len(seen) == 60
    table = page.locator("#recordings")
    table.get_by_label("Filter this page").fill("s39")
    assert table.locator(".filter [role=status]").inner_text() == "0 of 60 on this page"
    page.get_by_role("link", name="61 to 80").click()
    page.wait_for_url("**first=60*")
    seen += listed.all_inner_texts()
    assert sorted(seen) == sorted(f"s{sensor}-{preload}N" for sensor in range(SENSORS) for preload in (1, 2))
    visitor.go(f"{place}?band_low_hz=5&band_high_hz=50&first=0")
    page.get_by_role("link", name="61 to 80").click()
    page.wait_for_url("**first=60*")
    assert "Averaged over your own band, 5 to 50" in page.get_by_role("main").inner_text()
    visitor.require_accessible()


def test_a_workbook_holds_what_the_csv_does(server: Server, place: str) -> None:
    table = list(csv.reader(io.StringIO(server.http.get(f"{place}/d33.csv").text)))
    book = load_workbook(io.BytesIO(server.http.get(f"{place}/d33.xlsx").content)).active
    rows = list(book.iter_rows(values_only=True))
    assert list(rows[0]) == table[0]
    assert len(rows) == len(table)
    assert [row[-1] for row in rows[1:]] == pytest.approx([float(row[-1]) for row in table[1:]])
    assert isinstance(rows[1][0], str)


def test_a_file_is_named_after_skin_and_campaign_however_odd_their_names(server: Server) -> None:
    skin = 'Hand "ä" 9\u624b'
    sent = server.http.post("/v1/campaigns", params={"skin": skin}, json=campaign('of "May", 1/2')).raise_for_status()
    name = "Hand-ä-9\u624b-of-May-1-2-d33.xlsx"
    told = server.http.get(f"/campaigns/{sent.json()['id']}/d33.xlsx").headers["content-disposition"]
    assert told.endswith(f"filename*=UTF-8''{quote(name)}")
    both = {"first": sent.json()["id"], "second": sent.json()["id"]}
    told = server.http.get("/compare/difference.csv", params=both).headers["content-disposition"]
    assert told.startswith('attachment; filename="Hand-a-9-of-May-1-2-of-May-1-2-difference.csv"')


def test_no_text_of_a_workbook_is_a_formula() -> None:
    made = workbook({"name": ["=1+1", "@x"], "value": [2.5, None]})
    sheet = load_workbook(io.BytesIO(made)).active
    assert [(cell.value, cell.data_type) for cell in sheet["A"]] == [("name", "s"), ("=1+1", "s"), ("@x", "s")]
    assert [cell.value for cell in sheet["B"]] == ["value", 2.5, None]


def test_a_workbook_keeps_texts_that_read_like_numbers() -> None:
    names = ["01", "1", "1_0", "1e3", "inf", "nan", "NaN", "'quoted"]
    made = workbook(
        {"sensor": names, "value": list(np.arange(8.0)), "preload_n": [1, float("nan"), *[np.float32(2)] * 6]}
    )
    header, *rows = load_workbook(io.BytesIO(made)).active.iter_rows(values_only=True)
    assert header == ("sensor", "value", "preload_n")
    assert [row[0] for row in rows] == names
    assert [row[1:] for row in rows] == [(0, 1), (1, None), *((number, 2) for number in range(2, 8))]
