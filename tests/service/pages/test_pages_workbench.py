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
def test_wrong_term_named_beside_formula(sized: Visit) -> None:
    """A wrong term is named beside its formula."""
    page = sized.page
    look_at(sized, [file("wrong.txt", text_of_raw_curve(above="# wrong"))])
    fill_in(page)
    assert page.get_by_role("region", name="Formulas").evaluate("box => box.scrollWidth <= box.clientWidth")
    for typed, said in first(
        1,
        (
            ("'Height (nm)' - 5 [N]", "5 [N] has the unit N; only what has units of one kind"),
            ("'Height (nm)' ** 2", "'Height (nm)' ** 2: is not allowed"),
            ("", "it has a name and no formula: write one, or clear its name"),
        ),
    ):
        formula = page.get_by_label("Formula of derived channel 1", exact=True)
        formula.fill(typed)
        read_it(page)
        formula = page.get_by_label("Formula of derived channel 1", exact=True)
        expect(formula).to_have_value(typed)
        expect(formula).to_have_attribute("aria-invalid", "true")
        expect(page.locator("#derived-wrong-0")).to_contain_text(said)
        expect(page.get_by_label("Formula of derived channel 2", exact=True)).to_have_value(LOAD)
        sized.require_accessible()
    page.get_by_label("Formula of derived channel 1", exact=True).fill(DEPTH)
    read_it(page)
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")


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


@pytest.mark.soak
def test_instrument_s_template_offered_next_time(sized: Visit, server: Server) -> None:
    """An instrument s template is offered next time."""
    page = sized.page
    width = page.viewport_size["width"] if page.viewport_size else 0
    text = text_of_raw_curve().replace("Height (nm)", f"Z{width} (nm)")
    look_at(sized, [file("monday.txt", text)], skin=f"monday-{width}")
    expect(page.get_by_role("button", name="Read them so again")).to_have_count(0)
    fill_in(page)
    page.get_by_label("Formula of derived channel 1", exact=True).fill(DEPTH.replace("Height", f"Z{width}"))
    page.get_by_label("Instrument").fill("force microscope 2")
    page.get_by_label("first sample used").fill("5")
    read_it(page)
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    look_at(sized, [file("tuesday.txt", text)], skin=f"tuesday-{width}")
    template = page.get_by_role("region", name="Template of the instrument")
    expect(template).to_contain_text("force microscope 2")
    expect(template).to_contain_text("It keeps the trim: first sample used 5. It keeps the zero: force is 0")
    expect(template).to_contain_text("over the first 10 % of the curve. It keeps “units checked”")
    sized.require_accessible()
    page.get_by_role("button", name="Read them so again").click()
    page.wait_for_load_state()
    expect(page.get_by_role("status").first).to_contain_text("1 recording understood")
    page.get_by_text("What the channels are").click()
    expect(page.get_by_label("first sample used")).to_have_value("5")
    page.get_by_role("button", name="Keep 1 recording").click()
    page.wait_for_url("**/campaigns/*")
    bodies = []
    for day in ("monday", "tuesday"):
        (kept,) = campaigns_of(server, f"{day}-{width}")
        bodies.append(server.http.get(f"/v1/campaigns/{kept}/document").json()["recordings"][0]["force_n"])
    assert bodies[0] == bodies[1]
    look_at(sized, [file("others.txt", text.replace("Deflection", "Bending"))])
    expect(page.get_by_role("button", name="Read them so again")).to_have_count(0)


@pytest.mark.soak
def test_recordings_file_listed_page_page(sized: Visit) -> None:
    """Recordings of a file are listed page by page."""
    page = sized.page
    head = (
        "schema,campaign/1\nname,many\nskin.poisson_ratio,0.5\n\nid,kind,indenter_radius_mm,displacement_mm,force_n\n"
    )
    rows = [
        f"r{number:03},indentation,4,0,0\n,,,0.1,{0.01 * number:g}\n,,,0.2,{0.03 * number:g}\n"
        for number in range(1, 131)
    ]
    look_at(sized, [file("many.csv", head + "".join(rows))])
    pager = page.get_by_role("navigation", name="Recordings")
    assert re.findall(r"\d+ to \d+", pager.inner_text()) == ["1 to 60", "61 to 120", "121 to 130"]
    seen: list[str] = []
    for pages in ("1 to 60", "61 to 120", "121 to 130"):
        pager.get_by_role("link", name=pages).click()
        expect(pager.get_by_role("link", name=pages)).to_have_attribute("aria-current", "page")
        seen += page.locator('[aria-label="Recordings"] tbody th').all_inner_texts()
    assert seen == [f"r{number:03}" for number in range(1, 131)]
