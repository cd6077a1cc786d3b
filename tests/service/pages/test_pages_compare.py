"""Two campaigns side by side: the same colours, the difference and what of it is beyond chance."""

import csv
from dataclasses import replace

import pytest

from service.pages.compare.page import drawn_maps
from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.diagnosed import sent, table
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.store_server import Server
from underskin.recordings.campaign import Campaign, FrfRecording, to_dict

BEFORE = Made(sensors=4, spheres_mm=(4.0,), preloads_n=(1.0, 2.0), lines=8, gain=0.005, repeats=3)


def weakened(made: Campaign, sensor: str, factor: float) -> Campaign:
    """The campaign with one sensor's charge times a factor, and all others' a thousandth larger, which is noise."""
    entries = []
    for entry in made.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        by = factor if entry.sensor == sensor else 1.001
        entries.append(
            replace(entry, frf_re_pc_per_n=by * entry.frf_re_pc_per_n, frf_im_pc_per_n=by * entry.frf_im_pc_per_n)
        )
    return replace(made, name="after", recordings=tuple(entries))


@pytest.mark.parametrize("width", [1180, 390])
def test_a_skin_before_and_after_and_the_sensor_that_changed(reader: Visit, idle: Server, width: int) -> None:
    skin = f"aged{width}"
    first = sent(idle, to_dict(campaign(BEFORE, table())), skin)
    second = sent(idle, to_dict(weakened(campaign(BEFORE, table()), "s2", 0.7)), skin)
    page = reader.page
    page.set_viewport_size({"width": width, "height": 800})
    reader.go(f"/skins/{skin}")
    page.get_by_role("link", name="Compare").click()
    page.wait_for_url("**/compare?skin=*")
    reader.drawn(3)
    reader.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.get_by_label("First", exact=True).input_value() == first
    ends = [
        page.locator(f"#figure-map-{name} .plot").evaluate(
            "plot => [plot.data[0].marker.cmin, plot.data[0].marker.cmax]"
        )
        for name in ("first", "second")
    ]
    assert ends[0] == ends[1]
    told = page.locator("#figure-map-difference figcaption").inner_text()
    assert "1 of 4 differ from 0 beyond chance" in told
    changed = page.locator("#figure-map-difference .plot").evaluate(
        "plot => plot.data.find((one) => one.name === 'difference of d33').ids"
    )
    assert changed == ["s2"]
    page.get_by_label("First", exact=True).select_option(second)
    page.get_by_label("Second", exact=True).select_option(first)
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url(f"**first={second}*")
    rows = csv.DictReader(
        idle.http.get("/compare/difference.csv", params={"first": second, "second": first}).text.splitlines()
    )
    gaps = {row["sensor"]: float(row["difference_pc_per_n"]) for row in rows}
    assert gaps["s2"] == pytest.approx(0.3 * BEFORE.d33_pc_per_n, abs=0.5)
    assert max(abs(gap) for sensor, gap in gaps.items() if sensor != "s2") < 0.05


def test_nothing_to_compare_is_said(idle: Server) -> None:
    assert idle.http.get("/compare?first=c-none", headers=BROWSING).status_code == 404


def test_first_is_the_one_recorded_first_however_late_it_arrives(idle: Server) -> None:
    ids = {}
    for year in (2020, 2017):
        made = campaign(BEFORE, table())
        entries = tuple(replace(entry, recorded_at=f"{year}-05-03T09:00:00Z") for entry in made.recordings)
        ids[year] = sent(idle, to_dict(replace(made, name=str(year), recordings=entries)), "by-time")
    text = idle.http.get("/compare?skin=by-time", headers=BROWSING).text
    chosen = [option.split('"')[1] for option in text.split("<option ")[1:] if " selected>" in option[:80]]
    assert chosen == [ids[2017], ids[2020]]


def test_sensors_without_d33_leave_nothing_to_draw() -> None:
    nothing = dict.fromkeys(("d33_pc_per_n", "d33_uncertainty_pc_per_n"))
    rows = [{"sensor": "s0", "first_pc_per_n": None, "second_pc_per_n": None}]
    assert drawn_maps([], [{"sensors": [{"sensor": "s0", **nothing}]}] * 2, rows) == []
