"""The array on a diagnosis' page: a sensor that is clicked gets FRFs with both models, a table and its history."""

import csv

import orjson
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.finished import Made, keep, made
from tests.service.pages.forms import BROWSING
from tests.service.pages.test_pages_array import WIDTHS, place_of
from tests.support.cases import first
from tests.support.store_server import Server

_OF_PLOT = "document.querySelector('#figure-frf-of-sensor .plot').data"


@pytest.mark.soak
@pytest.mark.parametrize("width", first(1, WIDTHS))
def test_click_sensor_leads_frfs_table_history(visitor: Visit, server: Server, width: int) -> None:
    """A click on a sensor leads to its frfs table and history."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 800})
    place = keep(server, f"sensors{width}", made())
    visitor.go(place)
    page.locator("#figure-map .plot").scroll_into_view_if_needed()
    page.locator("#figure-map .main-svg").first.wait_for()
    page.mouse.click(*place_of(page.locator("#figure-map"), "s2"))
    page.wait_for_url("**sensor=s2*")
    visitor.drawn(8)
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.get_by_label("Sensor", exact=True).input_value() == "s2"
    rows = list(csv.DictReader(server.http.get(f"{place}/frf.csv").text.splitlines()))
    own = list(dict.fromkeys(row["recording"] for row in rows if row["sensor"] == "s2"))
    assert len(own) == 6
    table = page.get_by_role("region", name="Recordings of the sensor")
    assert table.locator("tbody th").all_inner_texts() == own
    before, after = (float(cell) for cell in table.locator("tbody tr").first.locator("td").all_inner_texts()[2:])
    assert after < 5 < 100 < before  # the resonance is what the model lacks
    figure = page.locator("#figure-frf-of-sensor")
    listed = figure.locator("option").all_inner_texts()
    assert [text.partition(" ")[0] for text in listed] == own
    figure.get_by_role("button", name="Next").focus()
    page.keyboard.press("Enter")
    first = next(float(row["measured_pc_per_n"]) for row in rows if row["recording"] == own[1])
    page.wait_for_function(f"() => Math.abs({_OF_PLOT}[0].y[0] - {first}) < 1e-9")
    assert {"before", "after"} <= set(page.evaluate(f"{_OF_PLOT}.map((trace) => trace.legendgroup)"))
    history = page.locator("#figure-history .plot").evaluate("plot => plot.data.map((trace) => trace.name)")
    assert history == ["s2"]
    rings = page.locator("#figure-map .plot").evaluate("plot => plot.layout.shapes.map((disc) => disc.line.width)")
    assert [number for number, ring in enumerate(rings) if ring == max(rings)] == [1]
    page.emulate_media(media="print")
    assert not page.locator("#array").is_visible()


def test_figures_older_versions_tell_recordings(server: Server) -> None:
    """Figures of older versions tell the recordings by name."""
    figures = dict(made().figures)
    older = orjson.loads(figures["frf"])
    for name in ("indenters_mm", "preloads_n", "left_percent"):
        del older["layout"]["meta"][name]
    figures["frf"] = orjson.dumps(older).decode()
    place = keep(server, "older", Made(made().report, figures))
    shown = server.http.get(f"{place}?sensor=s1", headers=BROWSING)
    assert shown.status_code == 200
    assert shown.text.count('<th scope="row">r') == 6
    assert "Recordings of s1" in shown.text
    assert "Recordings of" not in server.http.get(f"{place}?sensor=nothing", headers=BROWSING).text
