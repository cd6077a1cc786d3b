"""A few measured numbers typed into a page: the d33 that they mean."""

import csv

import httpx
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.service.pages.test_pages_adopted import mistuned
from tests.support.diagnosed import diagnosed, resonant
from tests.support.store_server import Server


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
    assert "in every row or in none: row 2 has none" in page.get_by_role("alert").inner_text()
    assert page.get_by_label("Measurements, one a line").input_value() == "4 1 7 0.1\n4 2 7"


SKIN = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5, "indenter_radius_mm": 4}


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ({"rows": ""}, "fill in at least one row"),
        ({"rows": "4 1"}, "must be R F FRF"),
        ({"rows": "4,1 7.06 0.1"}, "not both"),
        ({"rows": "4,1,7"}, "with spaces between them"),
        ({"rows": "4 nan 7"}, "row 1, preload F: nan"),
        ({"rows": "4 1 7", "thickness_mm": "2500"}, "thickness h [mm]: 2500.0 – must be 0.01 to 100 mm"),
        ({"rows": "4 1 7e-12"}, "Check FRF, row 1"),
        ({"rows": "4 1 7\n4 1 7400"}, "Check d33, row 2:</b> d33 is 1.4e+04 pC/N, more than sensors have: was mV/pC"),
        ({"rows": "4 1 -7"}, "d33 is -13.3 pC/N, negative: is the sign of charge or force turned?"),
        ({"rows": "4 1 7\n4 300 7"}, "Outside the table: row 2, F = 300 N, R = 4 mm, E = 16 MPa, L = 1.17"),
        ({"rows": "4 300 7"}, "L = 1.17 exceeds 0.1: at most 25.6 N with this sphere"),
        ({"rows": "4 1 7", "poisson_ratio": "0.45"}, "of incompressible elastomer, 0.5"),
        ({"rows": "4 1 7", "skin": "nobody's"}, "There is no skin"),
    ],
)
def test_what_is_wrong_is_said_on_the_page(server: Server, query: dict[str, str], told: str) -> None:
    answer = httpx.get(f"{server.http.base_url}/d33", params=query, headers=BROWSING, timeout=300)
    assert answer.status_code in (200, 404)
    assert told in answer.text


def test_d33_by_the_adopted_model_stands_beside_the_papers(server: Server) -> None:
    _, diagnosis_id = diagnosed(server, resonant("monday"), mistuned(), "palm-m")
    query = {"skin": "palm-m", "rows": "4 1 7.06 0.1\n8 2 7.45 0.1"}
    assert "d33_adopted_pc_per_n" not in server.http.get("/d33/rows.csv", params=query).text
    server.http.post("/v1/skins/palm-m/model", json={"diagnosis_id": diagnosis_id}).raise_for_status()
    rows = list(csv.DictReader(server.http.get("/d33/rows.csv", params=query).text.splitlines()))
    request = {**SKIN, "youngs_modulus_mpa": 2.0, "indenter_radius_mm": [4, 8], "preload_n": [1, 2]}
    request |= {"frf_pc_per_n": [7.06, 7.45], "frf_uncertainty_pc_per_n": 0.1}
    for model, column in (({}, ""), ({"model": "adopted", "skin_id": "palm-m"}, "adopted_")):
        expected = server.http.post("/v1/d33", json={**request, **model}).json()
        for part in ("", "uncertainty_"):
            told = [float(row[f"d33_{column}{part}pc_per_n"]) for row in rows]
            assert told == pytest.approx(expected[f"d33_{part}pc_per_n"], rel=1e-12)
    other = server.http.get("/d33", params={**query, "thickness_mm": "3"}, headers=BROWSING).text
    assert "By the adopted model: thickness" in other
    assert "d33 by the adopted model [pC/N]" not in other


@pytest.mark.parametrize("rows", ["4 1 7,06", "4;1;7,06;", "4\t1\t7,06", "4, 1, 7.06", "4,0 1,0 7,06"])
def test_a_decimal_comma_is_one(server: Server, rows: str) -> None:
    answer = httpx.get(f"{server.http.base_url}/d33/rows.csv", params={"rows": rows}, headers=BROWSING, timeout=300)
    found = list(csv.DictReader(answer.text.splitlines()))
    expected = server.http.post("/v1/d33", json={**SKIN, "preload_n": [1], "frf_pc_per_n": [7.06]}).json()
    assert [float(row["frf_pc_per_n"]) for row in found] == [7.06]
    assert [float(row["d33_pc_per_n"]) for row in found] == pytest.approx(expected["d33_pc_per_n"])
    assert [row["frf_uncertainty_pc_per_n"] for row in found] == ["nan"]
