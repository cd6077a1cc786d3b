"""The array as navigation: a sensor that is clicked is the one that FRF, history, table and map show."""

import re

import pytest
from playwright.sync_api import Locator

from tests.service.pages.conftest import EXAMPLE, Visit
from tests.support.cases import first
from tests.support.diagnosed import sent, table
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.store_server import Server
from underskin.recordings.campaign import to_dict

WIDTHS = [1180, 390]


@pytest.fixture(params=first(1, WIDTHS))
def lab(visitor: Visit, request: pytest.FixtureRequest) -> Visit:
    """Somebody on the example's page, in a window of this width."""
    visitor.page.set_viewport_size({"width": request.param, "height": 800})
    newcomer: Visit = request.getfixturevalue("newcomer")
    newcomer.drawn(2)
    return newcomer


def place_of(figure: Locator, sensor: str) -> tuple[float, float]:
    """Where a sensor's disc is drawn in the window [pixels], once it is in view."""
    plot = figure.locator(".plot")
    plot.scroll_into_view_if_needed()
    x, y = plot.evaluate(
        """(plot, sensor) => {
        const trace = plot._fullData.find((one) => one.ids?.includes(sensor)), row = trace.ids.indexOf(sensor);
        const { xaxis, yaxis } = plot._fullLayout, box = plot.getBoundingClientRect();
        return [box.left + xaxis._offset + xaxis.d2p(trace.x[row]), box.top + yaxis._offset + yaxis.d2p(trace.y[row])];
        }""",
        sensor,
    )
    return float(x), float(y)


@pytest.mark.soak
def test_click_map_leads_sensor_s_history(lab: Visit) -> None:
    """A click on the map leads to a sensor s history and recordings."""
    page = lab.page
    page.mouse.click(*place_of(page.locator("#figure-map"), "s03"))
    page.wait_for_url("**sensor=s03*")
    lab.drawn(3)
    lab.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= page.evaluate("innerWidth")
    assert page.get_by_label("Sensor", exact=True).input_value() == "s03"
    history = page.locator("#figure-history .plot").evaluate("plot => plot.data.map((trace) => trace.name)")
    assert history == ["s03"]
    assert page.locator("#figure-history .yerror").count() == 4  # a bar at each campaign
    rings = page.locator("#figure-map .plot").evaluate("plot => plot.layout.shapes.map((disc) => disc.line.width)")
    assert [number for number, width in enumerate(rings) if width == max(rings)] == [2]
    assert page.get_by_role("columnheader", name="d33 of s03").count() == 1
    assert "FRF of s03 in example, after six months" in page.locator("#figure-frf figcaption").inner_text()
    assert page.locator("#figure-frf .legend .traces").count() == 8
    page.mouse.click(*place_of(page.locator("#figure-map"), "s05"))
    page.wait_for_url("**sensor=s05*")
    lab.drawn(3)
    assert "FRF of s05" in page.locator("#figure-frf figcaption").inner_text()
    assert page.get_by_role("columnheader", name="d33 of s05").count() == 1
    lab.go(f"{EXAMPLE}?sensor=s03")
    page.get_by_role("link", name="example, after six months").click()
    page.wait_for_url("**show=s03*")
    lab.drawn(4)
    lab.require_accessible()
    assert page.locator("#figure-frf .legend .traces").count() == 8
    assert page.locator("tr.chosen th").all_inner_texts() == ["s03"]
    points = page.locator("#figure-preload .plot").evaluate("plot => plot.data.flatMap((one) => one.text ?? [])")
    assert {text.rpartition(" ")[2] for text in points} == {"s03"}
    page.mouse.click(*place_of(page.locator("#figure-map"), "s05"))
    page.wait_for_url("**show=s05*")
    page.get_by_role("link", name="History of s05").click()
    page.wait_for_url("**sensor=s05*")


def test_map_says_differs_prints(lab: Visit) -> None:
    """The map says who differs and prints who is who."""
    figure = lab.page.locator("#figure-map")
    assert "beyond chance" in figure.locator("figcaption").inner_text()
    drawn = figure.locator(".plot .textpoint").all_text_contents()
    assert sorted(drawn) == [f"s{number:02d}" for number in range(1, 9)]


@pytest.mark.soak
def test_the_same_is_chosen_with_keys(lab: Visit) -> None:
    page = lab.page
    page.get_by_label("Sensor", exact=True).focus()
    page.keyboard.press("s")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_url("**sensor=s01*")


def test_every_page_says_bars_95_percent(lab: Visit) -> None:
    """Every page says that its bars are 95 percent."""
    page = lab.page
    title = "plot => plot.layout.yaxis.title.text"
    assert "95 %" in page.locator("#figure-history .plot").evaluate(title)
    page.get_by_role("link", name="example, after six months").click()
    lab.drawn(4)
    for name in ("preload", "response"):
        assert "95 %" in page.locator(f"#figure-{name} .plot").evaluate(title)


@pytest.mark.soak
def test_many_sensors_pointed_gets_line(visitor: Visit, server: Server) -> None:
    """Of many sensors the one that is pointed at gets its line."""
    made = Made(sensors=14, spheres_mm=(4.0,), preloads_n=(1.0, 2.0), lines=6)
    sent(server, to_dict(campaign(made, table())), "many")
    page = visitor.page
    visitor.go("/skins/many")
    visitor.drawn(2)
    history = page.locator("#figure-history .plot")
    assert history.evaluate("plot => plot.layout.showlegend") is False
    pointed = "document.querySelector('#figure-history .plot').data.find((one) => one.name === 'pointed at')"
    assert page.evaluate(f"{pointed}.x.length") == 0
    for sensor in ("s4", "s9"):
        page.mouse.move(*place_of(page.locator("#figure-map"), sensor))
        page.wait_for_function(f"() => {pointed}.customdata?.[0] === {sensor!r}")


@pytest.mark.soak
def test_map_many_sensors_names_many_room_dims(visitor: Visit, server: Server) -> None:
    """A map of many sensors names as many as have room and dims those alike in the dark."""
    document = to_dict(campaign(Made(sensors=40, spheres_mm=(4.0,), preloads_n=(1.0, 2.0), lines=6), table()))
    for number, sensor in enumerate(document["skin"]["sensors"]):  # in two rows
        sensor["x_mm"], sensor["y_mm"] = 8.0 * (number % 20), 8.0 * (number // 20)
    for one in document["recordings"]:
        one.pop("position_mm", None)
        if one["sensor"] == "s7":
            one["frf_re_pc_per_n"] = [0.7 * value for value in one["frf_re_pc_per_n"]]
    sent(server, document, "forty")
    page = visitor.page
    page.emulate_media(color_scheme="dark")
    for width in first(1, (390, 1180)):
        page.set_viewport_size({"width": width, "height": 800})
        visitor.go("/skins/forty")
        visitor.drawn(2)
        ids = [text for text in page.locator("#figure-map .textpoint").all_text_contents() if text]
        differing = page.locator("#figure-map .plot").evaluate(
            "plot => plot.data.find((one) => one.name === 'd33').ids"
        )
        assert "s7" in differing
        assert (sorted(ids) == sorted(differing)) if width == 390 else (len(ids) == 40)
        discs = page.locator("#figure-map .plot").evaluate("plot => plot.layout.shapes")
        grey, coloured = discs[0], discs[7]
        assert max(map(int, re.findall(r"\d+", grey["fillcolor"]))) < 100  # near the ground
        assert min(map(int, re.findall(r"\d+", coloured["line"]["color"]))) > 200  # ringed, however dark it is
        visitor.require_accessible()
    page.emulate_media(color_scheme="light")
    page.wait_for_function("() => document.querySelector('#figure-map .plot').layout.shapes[0].fillcolor === '#cfd4d9'")
