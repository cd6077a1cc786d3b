"""The array as navigation: a sensor that is clicked is the one that FRF, history, table and map show."""

import pytest
from playwright.sync_api import Locator

from tests.service.pages.conftest import EXAMPLE, Visit


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
def test_a_click_on_the_map_leads_to_a_sensors_history_and_recordings(newcomer: Visit) -> None:
    page = newcomer.page
    newcomer.drawn(2)
    page.mouse.click(*place_of(page.locator("#figure-map"), "s03"))
    page.wait_for_url("**sensor=s03*")
    newcomer.drawn(3)
    newcomer.require_accessible()
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
    newcomer.drawn(3)
    assert "FRF of s05" in page.locator("#figure-frf figcaption").inner_text()
    assert page.get_by_role("columnheader", name="d33 of s05").count() == 1
    newcomer.go(f"{EXAMPLE}?sensor=s03")
    page.get_by_role("link", name="example, after six months").click()
    page.wait_for_url("**show=s03*")
    newcomer.drawn(4)
    newcomer.require_accessible()
    assert page.locator("#figure-frf .legend .traces").count() == 8
    assert page.locator("tr.chosen th").all_inner_texts() == ["s03"]
    points = page.locator("#figure-preload .plot").evaluate("plot => plot.data.flatMap((one) => one.text ?? [])")
    assert {text.rpartition(" ")[2] for text in points} == {"s03"}
    page.mouse.click(*place_of(page.locator("#figure-map"), "s05"))
    page.wait_for_url("**show=s05*")
    page.get_by_role("link", name="History of s05").click()
    page.wait_for_url("**sensor=s05*")
