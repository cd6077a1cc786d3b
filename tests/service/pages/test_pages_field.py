"""The stress under a sphere as a page: what it shows, the load as a slider and an animation, and the ways there."""

import csv
import html
import re
from typing import Any

import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.forms import BROWSING
from tests.support.cases import first
from tests.support.store_server import Server

QUERY = "thickness_mm=2.5&youngs_modulus_mpa=16&sensor_radius_mm=1.5&indenter_radius_mm=4&preload_n=3"
WIDTHS = [1280, 390]
LOAD = "Load"


def told(visitor: Visit) -> list[str]:
    return visitor.page.locator("[data-told]").all_inner_texts()


def trace(visitor: Visit, figure: str, name: str | None = None) -> dict[str, Any]:
    """A trace of a drawn figure by its name; without one the stress."""
    found: dict[str, Any] = visitor.page.locator(f"#figure-{figure} .plot").evaluate(
        "(plot, name) => { const one = plot._fullData.find(t => name ? t.name === name : t.type === 'heatmap');"
        " return {x: Array.from(one.x), y: Array.from(one.y), z: one.z && Array.from(one.z, row => Array.from(row)),"
        " zmin: one.zmin, zmax: one.zmax}; }",
        name,
    )
    return found


@pytest.mark.parametrize("width", first(1, WIDTHS[::-1]))
def test_section_and_base_are_what_the_interface_serves(visitor: Visit, width: int) -> None:
    visitor.page.set_viewport_size({"width": width, "height": 844})
    visitor.go(f"/field?{QUERY}")
    visitor.drawn(2)
    visitor.require_accessible()
    assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
    served = visitor.page.request.get(f"{visitor.address}/v1/field?{QUERY}&r_points=73&depth_points=21").json()
    section, base = trace(visitor, "section"), trace(visitor, "base")
    assert section["y"] == pytest.approx(served["depth_mm"])
    middle = section["x"].index(0.0)
    on_axis = [-row[0] for row in served["sigma_zz_mpa"]]  # compression is positive on pages
    assert [row[middle] for row in section["z"]] == pytest.approx(on_axis, abs=2e-3)
    assert [row[:middle] for row in section["z"]] == [row[:middle:-1] for row in section["z"]]  # symmetric
    assert base["z"][20][20] == pytest.approx(on_axis[-1], abs=2e-4)
    assert (section["zmin"], base["zmin"]) == (0, 0)
    assert (section["zmax"], base["zmax"]) == pytest.approx((on_axis[0], on_axis[-1]))
    assert "compression is positive" in visitor.page.locator("#figure-section figcaption").inner_text()
    a = served["contact_radius_mm"]
    assert max(trace(visitor, "section", "contact")["x"]) == pytest.approx(a, rel=1e-3)
    assert max(trace(visitor, "base", "contact")["y"]) == pytest.approx(a, rel=1e-3)
    assert max(trace(visitor, "base", "sensor")["x"]) == pytest.approx(1.5, rel=1e-3)
    assert trace(visitor, "section", "sensor")["y"] == [2.5, 2.5]
    assert told(visitor) == ["3 N", "0.75 mm", "2.55 MPa", "0.339 MPa", "0.221 MPa", "52.2 %"]
    for figure in ("section", "base"):  # a millimetre is as long along both axes
        lengths = visitor.page.locator(f"#figure-{figure} .plot").evaluate(
            "plot => ['xaxis', 'yaxis'].map(name => { const axis = plot._fullLayout[name];"
            " return axis._length / Math.abs(axis.range[1] - axis.range[0]); })"
        )
        assert lengths[0] == pytest.approx(lengths[1], rel=0.01)


@pytest.mark.parametrize("width", first(1, WIDTHS[::-1]))
def test_the_slider_moves_the_load_by_keys(visitor: Visit, width: int) -> None:
    visitor.page.set_viewport_size({"width": width, "height": 844})
    visitor.go(f"/field?{QUERY}")
    visitor.drawn(2)
    full = trace(visitor, "base")
    slider = visitor.page.get_by_label(LOAD)
    slider.focus()
    for _ in range(10):
        slider.press("ArrowLeft")
    visitor.page.wait_for_function("() => document.querySelector('[data-told]').textContent === '1.5 N'")
    visitor.page.wait_for_function(
        "() => document.querySelector('#figure-base .plot')._fullData[0].z[20][20] < 0.2"  # half of the stress or so
    )
    half = trace(visitor, "base")
    served = visitor.page.request.get(f"{visitor.address}/v1/field?{QUERY.replace('_n=3', '_n=1.5')}").json()
    assert half["z"][20][20] == pytest.approx(-served["sigma_zz_mpa"][-1][0], abs=3e-4)
    assert half["zmax"] == full["zmax"]  # one scale of colours for all loads
    assert max(trace(visitor, "section", "contact")["x"]) == pytest.approx(served["contact_radius_mm"], rel=1e-3)
    assert slider.get_attribute("aria-valuetext") == "1.5 N"
    slider.press("End")
    visitor.page.wait_for_function("() => document.querySelector('[data-told]').textContent === '3 N'")
    slider.press("Home")  # what is saved is the load in sight
    visitor.page.wait_for_function("() => document.querySelector('[data-told]').textContent === '0.15 N'")
    peak = "JSON.parse(document.querySelector('#figure-base script').textContent).data[0].z[20][20]"
    visitor.page.wait_for_function(f"() => {peak} > -0.03")
    with visitor.page.expect_download():
        visitor.page.locator("#figure-base").get_by_role("button", name="SVG").click()


def test_the_request_that_does_the_same_accepts_what_the_page_accepts(server: Server) -> None:
    small = QUERY.replace("indenter_radius_mm=4", "indenter_radius_mm=0.007").replace(
        "preload_n=3", "preload_n=0.00001"
    )
    for query, units_checked in ((QUERY, False), (f"{small}&units_checked=yes", True)):
        text = html.unescape(server.http.get(f"/field?{query}", headers=BROWSING).raise_for_status().text)
        path, call = re.search(r"/v1/field\?[^'\s<]+", text), re.search(r"client\.field\(([^)]*)\)", text)
        assert path is not None
        assert call is not None
        assert ("units_checked=True" in call[1]) == units_checked
        assert server.http.get(path[0]).raise_for_status().json()["status"] == "ok"
        fields = dict(part.split("=") for part in call[1].split(", "))
        assert server.http.get("/v1/field", params=fields).raise_for_status().json()["status"] == "ok"


def test_errors_stand_in_the_form_and_the_limit_is_named(visitor: Visit) -> None:
    visitor.go("/field?thickness_mm=0.0025")
    assert "thickness h [mm]" in visitor.page.get_by_role("alert").inner_text()
    assert visitor.page.get_by_label("thickness h").input_value() == "0.0025"
    visitor.require_accessible()
    visitor.page.get_by_label("thickness h").fill("2,5")
    visitor.page.get_by_label("force F").fill("100")
    visitor.page.get_by_role("button", name="Compute").click()
    visitor.page.get_by_text("L = 0.391 exceeds 0.1: at most 25.6 N").wait_for()
    assert visitor.page.locator(".plot").count() == 0
    visitor.require_accessible()


@pytest.mark.parametrize("width", first(1, WIDTHS[::-1]))
def test_loads_show_the_base_and_lead_to_each_sphere(visitor: Visit, width: int) -> None:
    visitor.page.set_viewport_size({"width": width, "height": 844})
    visitor.go("/loads?loads=0 0 4 1%0A%0A12 8 10 2")
    visitor.drawn(2)
    visitor.require_accessible()
    assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
    figure = visitor.page.locator("#figure-base")
    shown = trace(visitor, "base")
    numbers = visitor.page.request.get(
        visitor.address + str(figure.get_by_role("link", name="CSV").get_attribute("href"))
    )
    rows = list(csv.DictReader(numbers.text().splitlines()))
    lowest = min(rows, key=lambda row: float(row["sigma_zz_mpa"]))
    assert -float(lowest["sigma_zz_mpa"]) == pytest.approx(max(map(max, shown["z"])))
    assert (float(lowest["x_mm"]), float(lowest["y_mm"])) == pytest.approx((12.0, 8.0), abs=0.6)
    assert shown["zmin"] == 0  # nothing pulls
    visitor.page.get_by_role("link", name="load in line 3").click()
    visitor.drawn(2)
    assert told(visitor)[0] == "2 N"
    assert visitor.page.get_by_label("sphere radius R").input_value() == "10.0"
