"""A few measured numbers typed into a page: the d33 that they mean."""

import csv

import httpx
import pytest

from tests.pages.conftest import Visit
from tests.pages.test_pages_security import BROWSING
from tests.store.server import Server


def test_d33_from_a_few_numbers(visitor: Visit, server: Server) -> None:
    page = visitor.page
    visitor.go("/upload")
    page.get_by_role("link", name="d33 from measured values").click()
    frf = server.http.post("/v1/frf", json={**SKIN, "preload_n": [1, 3], "d33_pc_per_n": [14, 22]}).json()
    one, three = frf["frf_pc_per_n"]
    page.get_by_label("Measurements, one a line").fill(f"4 1 {one!r} 0.07\n4, 3, {three!r}, 0.1")
    page.get_by_role("button", name="Compute").click()
    page.wait_for_load_state()
    found = page.get_by_role("region").locator("tbody tr td:nth-child(4)").all_inner_texts()
    assert [float(text) for text in found] == pytest.approx([14, 22], abs=0.005)
    visitor.require_accessible()
    with page.expect_download() as saving:
        page.get_by_role("link", name="CSV").click()
    rows = list(csv.DictReader(saving.value.path().read_text().splitlines()))
    assert [float(row["d33_pc_per_n"]) for row in rows] == pytest.approx([14, 22], rel=1e-12)
    page.get_by_label("Measurements, one a line").fill("4 1 7 0.1\n4 2 7")
    page.get_by_role("button", name="Compute").click()
    assert "all with an uncertainty or none" in page.get_by_role("alert").inner_text()
    assert page.get_by_label("Measurements, one a line").input_value() == "4 1 7 0.1\n4 2 7"


SKIN = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4}


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ({"rows": ""}, "must be one or more"),
        ({"rows": "4 1"}, "must be R F FRF"),
        ({"rows": "4 -1 7"}, "preload_n"),
        ({"rows": "4 nan 7"}, "preload_n"),
        ({"rows": "4 1 inf"}, "frf_pc_per_n"),
        ({"rows": "4 1 7", "thickness_mm": "2500"}, "thickness_mm"),
        ({"rows": "4 1 7e-12"}, "Look at"),
        ({"rows": "4 900 7"}, "outside the table"),
        ({"rows": "4 1 7", "skin": "nobody's"}, "There is no skin"),
    ],
)
def test_what_is_wrong_is_said_on_the_page(server: Server, query: dict[str, str], told: str) -> None:
    answer = httpx.get(f"{server.http.base_url}/d33", params=query, headers=BROWSING, timeout=60)
    assert answer.status_code in (200, 404)
    assert told in answer.text
