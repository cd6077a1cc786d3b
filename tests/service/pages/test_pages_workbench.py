"""The workbench of an upload in a real browser: derived channels, zero, trim, signs, and the instrument's template."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.service.pages.conftest import Visit
from tests.service.pages.uploads import campaigns_of, file, look_at
from tests.support.cases import first
from tests.support.raw_curves import DEPTH_MM, FORCE_N, OFFSET_NM, RADIUS_MM, text_of_raw_curve
from tests.support.store_server import Server

DEPTH, LOAD = "-'Height (nm)' - 'Deflection (nm)'", "3 [N/m] * 'Deflection (nm)'"


def fill_in(page: Page) -> None:
    """Depth and force of a raw curve, as a person types them."""
    page.get_by_label("Kind of recording").select_option("indentation")
    for number, (name, formula, field) in enumerate((("depth", DEPTH, "displacement"), ("load", LOAD, "force")), 1):
        page.get_by_label(f"Name of derived channel {number}").fill(name)
        page.get_by_label(f"Formula of derived channel {number}", exact=True).fill(formula)
        page.get_by_label(f"What derived channel {number} is", exact=True).select_option(label=field)
    page.get_by_label("force is 0 over the first").fill("10")
    page.get_by_label("sphere radius R [mm]").fill(f"{RADIUS_MM}")
    page.get_by_label("These values are right").check()


def read_it(page: Page) -> None:
    page.get_by_role("button", name="Read it with these settings").click()
    page.wait_for_load_state()


@pytest.fixture(params=first(1, [(390, 844), (1280, 900)]), ids=first(1, ["phone", "desktop"]))
def sized(request: pytest.FixtureRequest, visitor: Visit) -> Iterator[Visit]:
    width, height = request.param
    visitor.page.set_viewport_size({"width": width, "height": height})
    yield visitor
    assert visitor.page.evaluate("document.documentElement.scrollWidth") <= width
    visitor.require_accessible()


def test_a_raw_curve_becomes_depth_and_force(sized: Visit, server: Server) -> None:
    page = sized.page
    skin = f"afm-{page.viewport_size['width'] if page.viewport_size else 0}"
    look_at(sized, [file("afm.txt", text_of_raw_curve(above=f"# {skin}"))], skin=skin)
    expect(page.get_by_role("status").first).to_contain_text("No recording understood yet")
    fill_in(page)
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")
    expect(page.get_by_text(f"channel 'depth' is derived: {DEPTH}")).to_be_visible()
    expect(page.get_by_role("heading", name="Loading and way back")).to_be_visible()
    sized.drawn(2)
    for figure in ("course", "curves"):
        names = page.evaluate(f"document.querySelector('#figure-{figure} .plot').data.map(trace => trace.name)")
        assert set(names) == {"loading", "way back"}
    sized.require_accessible()
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    expect(page.get_by_text(f"channel 'load' is derived: {LOAD}")).to_be_attached()
    expect(
        page.get_by_text(
            re.compile(
                r"contact from [−-]?[\d.]+ (µm|nm), pressed [\d.e-]+ of the radius deep; it leaves [\d.e-]+ (nN|pN) "
            )
        )
    ).to_be_visible()
    (kept,) = campaigns_of(server, skin)
    (recording,) = server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"]
    np.testing.assert_allclose(recording["force_n"], FORCE_N, atol=1e-11)
    np.testing.assert_allclose(recording["displacement_mm"], DEPTH_MM - 1e-6 * OFFSET_NM, atol=1e-9)


@pytest.mark.soak
def test_brushing_the_figure_fills_in_the_trim(visitor: Visit) -> None:
    page = visitor.page
    look_at(visitor, [file("brush.txt", text_of_raw_curve(above="# brush"))])
    fill_in(page)
    read_it(page)
    visitor.drawn(2)
    area = page.locator("#figure-course .nsewdrag").first
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    assert box is not None
    low, high = page.evaluate("document.querySelector('#figure-course .plot')._fullLayout.xaxis.range")
    page.mouse.move(box["x"] + 0.1 * box["width"], box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 45, steps=4)
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 45, steps=4)
    page.mouse.up()
    expect(page.locator("[data-brushed]")).to_contain_text("are filled in below")
    lowest, highest = (int(page.get_by_label(f"{name} sample used").input_value()) for name in ("first", "last"))
    per_pixel = (high - low) / box["width"]
    assert lowest == pytest.approx(low + 0.1 * (high - low), abs=2 + 2 * per_pixel)
    assert highest == pytest.approx(low + 0.8 * (high - low), abs=2 + 2 * per_pixel)
    read_it(page)
    expect(page.get_by_text(f"of each curve, samples {lowest} to {highest} are used")).to_be_visible()
    visitor.drawn(2)
    names = page.evaluate("document.querySelector('#figure-course .plot').data.map(trace => trace.name)")
    assert set(names) == {"loading", "way back", "left out"}


@pytest.mark.soak
def test_everything_is_done_by_keyboard_alone(visitor: Visit) -> None:
    page = visitor.page
    look_at(visitor, [file("keys.txt", text_of_raw_curve(above="# keys"))])
    page.get_by_label("Kind of recording").focus()
    page.keyboard.type("ind")
    told = {
        "Formula of derived channel 1": DEPTH,
        "What derived channel 1 is": "displ",
        "Formula of derived channel 2": LOAD,
        "What derived channel 2 is": "force",
        "first sample used": "11",
        "last sample used": "380",
        "sphere radius R [mm]": f"{RADIUS_MM}",
    }
    for _ in range(120):
        page.keyboard.press("Tab")
        name = page.evaluate(
            "(document.activeElement.labels?.[0]?.textContent ?? document.activeElement.ariaLabel ?? '').trim()"
        )
        if name in told:
            page.keyboard.type(told.pop(name))
        elif name.startswith("These values are right"):
            page.keyboard.press("Space")
            break
    assert told == {}
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_load_state()
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")
    expect(page.get_by_text("of each curve, samples 11 to 380 are used")).to_be_visible()


def test_a_second_file_is_read_as_the_first_or_afresh(visitor: Visit) -> None:
    """What it is read by is said, and it can start without."""
    page = visitor.page
    look_at(visitor, [file("afm.txt", text_of_raw_curve(above="# first"))], skin="pdms-8")
    fill_in(page)
    page.locator("#instrument").fill("force microscope 7")
    read_it(page)
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    look_at(visitor, [file("next.txt", text_of_raw_curve(above="# next"))], skin="pdms-8")
    told = page.get_by_role("form", name="Read as before")
    expect(told).to_contain_text("afm.txt of force microscope 7 of skin pdms-8 was, kept")
    told.get_by_role("button", name="Start without it").click()
    page.wait_for_load_state()
    expect(page.get_by_role("form", name="Read as before")).to_have_count(0)
    expect(page.get_by_label("force is 0 over the first")).to_have_value("")
    expect(page.get_by_label("Formula of derived channel 1", exact=True)).to_have_value("")
