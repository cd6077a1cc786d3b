"""What to measure next within the reader's own rig, on the pages."""

import csv
import io
import re
from typing import Any

import pytest
from openpyxl import load_workbook

import underskin
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.diagnosed import diagnosed, report, resonant, sent, table
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside
from tests.support.store_server import Server
from underskin import Client, RigLimits
from underskin.diagnosis.reporting.wording import readable
from underskin.recordings import rig_description
from underskin.recordings.campaign import to_dict

NARROW = Made(("modulus_error",), (1.25,), preloads_n=(1.0, 2.0), spheres_mm=(4.0,), sensors=3, repeats=2, gain=0.01)
LIMITS = RigLimits(preload_n=(0.3, 2.5), indenter_radius_mm=[4.0, 8.0], recordings=5)
WITHOUT = beside("modulus_error", "thickness_error")


@pytest.fixture(scope="module")
def diagnosis_id(diagnosing: Server) -> str:
    """Of a campaign that leaves several explanations."""
    with Client(str(diagnosing.http.base_url)) as client:
        campaign_id = sent(diagnosing, to_dict(campaign(NARROW, table())), "narrow")
        found = client.diagnoses.wait(client.diagnoses.start(campaign_id, without=WITHOUT)["id"])
    assert found["report"]["next_experiment"] is not None
    return str(found["id"])


@pytest.fixture(scope="module")
def kept_id(server: Server) -> str:
    """Of a report that was kept."""
    return diagnosed(server, resonant("limits"), report(), "limits")[1]


def _ticked_off_as_they_arrive(visitor: Visit, server: Server, planned: list[dict[str, Any]]) -> None:
    """As CSV and as rig descriptions; a file of the first one, read by its description, ticks its row off."""
    plan = visitor.page.get_by_role("region", name="The plan")
    query = visitor.page.url.partition("?")[2]
    place = visitor.page.url.partition("?")[0]
    table = list(csv.DictReader(io.StringIO(visitor.page.request.get(f"{place}/recordings.csv?{query}").text())))
    assert [float(row["preload_n"]) for row in table] == [entry["preload_n"] for entry in planned]
    assert {row["arrived"] for row in table} == {"0"}
    with visitor.page.expect_download() as saving:
        plan.get_by_role("link", name="YAML of recording 1").click()
    rig = saving.value.path().read_bytes()
    lines = "frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n\n10,7,0\n20,7,0\n40,7.1,0\n"
    for number in range(planned[0]["repeats"]):
        files = {
            "file": (f"planned-{number}.csv", lines.replace("7.1", f"7.{number + 1}").encode()),
            "rig": ("rig.yaml", rig),
        }
        server.http.post("/v1/campaigns?skin=narrow", files=files).raise_for_status()
    visitor.page.reload()
    row = plan.get_by_role("region", name="Recordings to make").locator("tbody tr").first
    assert f"✓ {planned[0]['repeats']} of {planned[0]['repeats']}" in row.inner_text()
    count, repeats = sum(entry["repeats"] for entry in planned), planned[0]["repeats"]
    verb = "has" if repeats == 1 else "have"
    assert f"{repeats} of {count} recordings {verb} arrived." in plan.locator("[role=status]").inner_text()
    visitor.require_accessible()


@pytest.mark.soak
def test_next_experiment_planned_within_reader_s(patient: Visit, diagnosing: Server, diagnosis_id: str) -> None:
    """The next experiment is planned within the reader s rig."""
    expected = underskin.diagnose(campaign(NARROW, table()), table(), limits=LIMITS, without=WITHOUT)["next_experiment"]
    page = patient.page
    patient.go(f"/diagnoses/{diagnosis_id}")
    page.get_by_label("lowest preload").fill("0.3")
    page.get_by_label("radii of the spheres at hand").fill("4, 8")
    page.get_by_label("recordings at most").fill("5")
    page.get_by_role("button", name="Plan the next recordings").click()
    assert "lowest and highest preload [N] – give both" in page.get_by_role("alert").inner_text()
    patient.require_accessible()
    page.get_by_label("highest preload").fill("2.5")
    page.get_by_role("button", name="Plan the next recordings").click()
    plan = page.get_by_role("region", name="The plan")
    page.get_by_role("progressbar", name="How far the plan is").or_(plan).first.wait_for()
    patient.require_accessible()
    plan.wait_for()  # without reloading by hand
    assert readable(expected["statement"]) in plan.inner_text()
    assert plan.locator("tbody tr").count() == len(expected["recordings"])
    assert "None of them has arrived yet." in plan.inner_text()
    patient.require_accessible()
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    patient.require_accessible()
    rows = plan.get_by_role("region", name="Recordings to make")
    assert rows.evaluate("table => table.scrollWidth <= table.clientWidth")
    page.set_viewport_size({"width": 1280, "height": 844})
    assert rows.evaluate("table => table.scrollWidth <= table.clientWidth")
    _ticked_off_as_they_arrive(patient, diagnosing, expected["recordings"])
    page.get_by_text("The same by request").click()
    command = page.get_by_label("Shell").inner_text()
    assert "--preload-n 0.3 2.5 --indenter-radius-mm 4.0 --indenter-radius-mm 8.0 --recordings 5" in command


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ({"lowest_preload_n": "3", "highest_preload_n": "1"}, r"lowest and highest preload \[N\].*the lowest first"),
        ({"lowest_preload_n": "abc"}, r"lowest preload \[N\]: abc – must be a number"),
        ({"highest_preload_n": "1"}, "lowest and highest preload.*give both, or leave both empty"),
        ({"lowest_preload_n": "0", "highest_preload_n": "1"}, "must be above 0"),
        ({"indenter_radius_mm": "4 big"}, r"radii of the spheres at hand \[mm\]: big – must be a number"),
        ({"indenter_radius_mm": "4 nan"}, "must be above 0"),
        ({"indenter_radius_mm": "1 2 3 4 5 6 7 8 9"}, "at most 8 numbers"),
        ({"offset_mm": "-1"}, "distances from the sensor.*must be 0 or more"),
        ({"dynamic_force_n": "inf"}, "dynamic forces of the shaker.*must be above 0"),
        ({"recordings": "0"}, "recordings at most: 0 – must be a whole number from 1 to 50"),
        ({"recordings": "00501"}, "recordings at most: 00501 – must be a whole number from 1 to 50"),
        ({"recordings": "0001" + "9" * 4400}, "must be a whole number from 1 to 50"),
    ],
)
def test_limits_that_no_rig_has_are_refused(server: Server, kept_id: str, query: dict[str, str], told: str) -> None:
    shown = server.http.get(f"/diagnoses/{kept_id}/plan", params=query, headers=BROWSING).text
    assert re.search(told, shown) is not None, shown


def test_plan_report_taken_table_workbook(server: Server) -> None:
    """The plan of a report is taken as a table, a workbook, and a rig description of each recording."""
    first = {"sensor": "s1", "indenter_radius_mm": 4.0, "preload_n": 3.0, "position_mm": [0.0, 2.5], "repeats": 2}
    recordings = [first, {**first, "sensor": "=s2", "dwell_s": 60.0, "repeats": 1}]
    planned = {
        "recordings": recordings, "separates": [], "probability_of_deciding": 0.8, "without_it": 0.5, "minutes": 12.0,
        "statement": "2 recordings should tell.",
    }  # fmt: skip
    found = {**report(), "verdict": "ambiguous", "next_experiment": planned}
    _, diagnosis_id = diagnosed(server, resonant("planned"), found, "planned")
    place = f"/diagnoses/{diagnosis_id}"
    rig = server.http.get(f"{place}/planned/1/rig.yaml").content
    assert rig_description.parse(rig, "rig.yaml").recording["preload_n"] == 3.0
    assert server.http.get(f"{place}/planned/3/rig.yaml").status_code == 404
    table = [tuple(row) for row in csv.reader(io.StringIO(server.http.get(f"{place}/planned.csv").text))]
    book = load_workbook(io.BytesIO(server.http.get(f"{place}/planned.xlsx").content)).active
    rows = list(book.iter_rows(values_only=True))
    assert table[0] == rows[0] == ("sensor", "indenter_radius_mm", "preload_n", "position_mm", "repeats", "dwell_s")
    assert table[1:] == [("s1", "4.0", "3.0", "0.0 2.5", "2", "NaN"), ("'=s2", "4.0", "3.0", "0.0 2.5", "1", "60.0")]
    assert rows[1:] == [("s1", 4, 3, "0.0 2.5", 2, None), ("=s2", 4, 3, "0.0 2.5", 1, 60)]
    without = diagnosed(server, resonant("unplanned"), {**report(), "next_experiment": None}, "planned")[1]
    assert server.http.get(f"/diagnoses/{without}/planned.csv").status_code == 404
