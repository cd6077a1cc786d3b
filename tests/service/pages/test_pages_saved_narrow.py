"""A saved report in a narrow window: nothing of its figures is cut off or lies over another text."""

from itertools import pairwise
from pathlib import Path

import plotly.io
import pytest

from tests.service.pages.conftest import Visit
from tests.service.pages.finished import made
from underskin.diagnosis.reporting.html_report import page as saved_page

LONG = "after: contact resonance + sensor relaxation + charge amplifier"
_CUT = """plot => [...plot.querySelectorAll(".gtitle, .legendtext, .annotation-text, .xtitle, .ytitle")]
.filter((text) => {
  const [one, all] = [text.getBoundingClientRect(), plot.getBoundingClientRect()];
  return one.left < all.left - 1 || one.right > all.right + 1 || one.top < all.top - 1 || one.bottom > all.bottom + 1;
}).map((text) => text.textContent)"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With a model of a long name, and a map of so many steps that they have no room for their names."""
    figures = {name: plotly.io.from_json(figure) for name, figure in made().figures.items()}
    figures["frf"].update_traces(name=LONG, selector={"name": "after: contact resonance"})
    assert LONG in {trace.name for trace in figures["frf"].data}
    rows, columns = len(figures["where"].layout.yaxis.ticktext), 24
    steps = {"tickvals": list(range(columns)), "ticktext": [f"{10 + step}.5" for step in range(columns)]}
    figures["where"].update_traces(z=[[1.0] * columns] * rows, text=[["+1"] * columns] * rows)
    figures["where"].update_layout(xaxis=steps, shapes=[])
    file = tmp_path_factory.mktemp("saved") / "report.html"
    file.write_text(saved_page(made().report, figures), encoding="utf-8")
    return file


@pytest.mark.soak
def test_texts_of_figures_are_whole_and_apart(visitor: Visit, saved: Path) -> None:
    page = visitor.page
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto(saved.as_uri())
    page.wait_for_function("() => document.querySelectorAll('.main-svg').length >= 4")
    page.wait_for_function(
        "() => /<br>/.test(document.querySelector('#figure-frf').data.map(({ name }) => name).join())"
    )
    page.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    for plot in page.locator(".plotly-graph-div").all():
        plot.scroll_into_view_if_needed()
        assert plot.evaluate(_CUT) == []
    frf, where = page.locator("#figure-frf"), page.locator("#figure-where")
    titles = [box for one in frf.locator("text[class^=y][class$=title]").all() if (box := one.bounding_box())]
    steps = [box for one in where.locator(".xtick text").all() if (box := one.bounding_box())]
    for ends in (
        sorted((box["y"], box["y"] + box["height"]) for box in titles),
        sorted((box["x"], box["x"] + box["width"]) for box in steps),
    ):
        assert len(ends) > 3
        assert all(one[1] <= following[0] + 1 for one, following in pairwise(ends)), ends
    below = where.bounding_box()
    legend = frf.locator(".legend").bounding_box()
    assert below is not None
    assert legend is not None
    assert legend["y"] + legend["height"] <= below["y"]
    visitor.wrong.clear()  # the file itself is not of the server
