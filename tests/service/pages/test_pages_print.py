"""A report on paper: its summary is the first page whole, what is folded below it follows."""

import re
from collections.abc import Sequence
from copy import deepcopy
from itertools import pairwise
from pathlib import Path
from typing import Literal

import orjson
import pytest
from playwright.sync_api import FloatRect, Page, expect

from tests.service.pages.conftest import Visit
from tests.service.pages.finished import Made, keep, made
from tests.support.cases import first
from tests.support.store_server import Server

_SENTENCE = "Compressible layer: the skin can be squeezed together a little in volume, which shows beside the sensors. "
_WIDE = "document.documentElement.scrollWidth <= innerWidth"


@pytest.fixture(params=first(1, ["long", "short", 3, 2, 4, 5]))
def printed(request: pytest.FixtureRequest) -> Made:
    """A report as it comes, some that have more to say, about where they are set smaller, and one with as much to say
    as any of thousands had."""
    if request.param == "short":
        return made()
    wordy = deepcopy(made().report)
    headline = wordy["statement"].partition(". ")[0]
    if request.param != "long":
        wordy["statement"] = f"{headline}, {_SENTENCE.rstrip('. ')}. " + request.param * _SENTENCE
        return Made(wordy, made().figures)
    wordy["statement"] = f"{headline}. " + 13 * _SENTENCE
    finding = {"code": "outlier", "recording": "r1", "field": "frf"}
    wordy["findings"] = [{**finding, "statement": f"{number}: {2 * _SENTENCE}"} for number in range(8)]
    return Made(wordy, made().figures)


def sheets(page: Page) -> int:
    """Pages of the PDF that the browser prints."""
    return len(re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4")))


def require_summary_on_first_sheet(page: Page) -> None:
    """The whole is longer than the summary, which is one sheet: alone, and before the rest begins on the next."""
    assert sheets(page) > 1
    assert page.evaluate("getComputedStyle(document.querySelector('.summary')).breakAfter") == "auto"  # on the screen
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.querySelector('.summary')).breakAfter") == "page"
    page.evaluate("document.querySelectorAll('details.part, .screen').forEach((part) => (part.style.display = 'none'))")
    page.evaluate("document.querySelector('.summary').style.breakAfter = 'auto'")  # nothing comes after it now
    assert sheets(page) == 1


def require_noise_told(page: Page) -> None:
    """Of the map, on the screen and on paper: which noise is meant, and why low frequencies may lie off 0."""
    page.emulate_media(media="print")
    note = page.locator(".summary .note")
    assert note.is_visible()
    assert "noise is that of single points" in note.inner_text()
    assert "where part of the band departs from it" in note.inner_text()
    page.emulate_media(media="screen")
    assert note.is_visible()


def with_numbers(made: Made) -> Made:
    """The report with a map of as many columns as show their numbers, of as many digits as misfits have."""
    where = orjson.loads(made.figures["where"])
    rows = len(where["layout"]["yaxis"]["ticktext"])
    numbers = {"z": [[-193.0] * 12] * rows, "customdata": [[4] * 12] * rows, "text": [["−193"] * 12] * rows}
    where["data"][0] |= {**numbers, "texttemplate": "%{text}"}
    where["layout"]["xaxis"] |= {"tickvals": list(range(12)), "ticktext": [f"{10 * n}.5" for n in range(12)]}
    where["layout"]["shapes"] = []  # the outline of a region of more columns
    return Made(made.report, {**made.figures, "where": orjson.dumps(where).decode()})


def require_apart(boxes: Sequence[FloatRect | None], along: Literal["x", "y"]) -> None:
    """None of the texts runs into the next, but for the air above and below its digits."""
    known = [box for box in boxes if box is not None]
    if along == "x":
        air, ends = 0.5, sorted((box["x"], box["x"] + box["width"]) for box in known)
    else:
        air, ends = 2.0, sorted((box["y"], box["y"] + box["height"]) for box in known)
    assert len(ends) > 1
    assert all(one[1] <= following[0] + air for one, following in pairwise(ends)), ends


def require_texts_apart(page: Page, plots: str) -> None:
    """On paper, of the summary's first figure and of the map; then the screen has them as they were."""
    first, where = page.locator(plots).first, page.locator(plots).nth(1)
    for plot in (first, where):
        plot.scroll_into_view_if_needed()
        plot.locator(".main-svg").first.wait_for()
    assert {"0.5", "5", "50"} <= set(first.locator(".ytick text").all_text_contents())
    on_screen = where.locator(".heatmap-label text").first.get_attribute("style")
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    titles = first.locator(".infolayer text[class^=y]").all()
    assert len(titles) == 4
    require_apart([one.bounding_box() for one in titles], "y")
    require_apart([one.bounding_box() for one in first.locator(".yaxislayer-above > .ytick text").all()], "y")
    require_apart([one.bounding_box() for one in where.locator(".heatmap-label").all()[:12]], "x")
    require_apart([one.bounding_box() for one in where.locator(".xtick text").all()], "x")
    require_apart([one.bounding_box() for one in where.locator(".cbaxis text").all()], "y")
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    expect(where.locator(".heatmap-label text").first).to_have_attribute("style", on_screen or "")


def with_long_names(made: Made) -> Made:
    """As many explanations as a report has, each of three mechanisms."""
    names = [f"contact resonance +<br>sensor relaxation +<br>charge amplifier {number}" for number in range(7)]
    bars = orjson.loads(made.figures["explanations"])
    bars["data"][0] |= {"y": names, "x": [0.4] + [0.1] * 6, "text": ["40 %"] + ["10 %"] * 6}
    return Made(made.report, {**made.figures, "explanations": orjson.dumps(bars).decode()})


@pytest.fixture
def place(server: Server, printed: Made) -> str:
    """The page of that report, with a map that shows its numbers and explanations of long names."""
    return keep(server, f"sheet{len(printed.report['statement'])}", with_long_names(with_numbers(printed)))


@pytest.mark.soak
def test_summary_page_sheet_no_texts_overlap(visitor: Visit, place: str) -> None:
    """The summary of a page is one sheet on which no texts overlap."""
    page = visitor.page
    visitor.go(place)
    folded = page.locator("details.part")
    assert folded.count() >= 5
    assert not any(part.get_attribute("open") is not None for part in folded.all())
    for plot in page.locator(".three .plot").all():
        plot.scroll_into_view_if_needed()
        plot.locator(".main-svg").first.wait_for()
    chosen = page.locator(".three .choice select")
    assert "Where: measured less the paper's model, in phase, in percent of it" in page.locator(".three").inner_text()
    require_texts_apart(page, ".three .plot")
    page.emulate_media(media="print")
    assert chosen.evaluate("list => getComputedStyle(list).appearance") == "none"  # printed as the name alone
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    bars = page.locator("#figure-explanations .plot")
    require_apart([one.bounding_box() for one in bars.locator(".ytick text").all()], "y")
    assert sum("charge amplifier" in text for text in bars.locator(".ytick text").all_text_contents()) == 7
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    require_noise_told(page)
    require_summary_on_first_sheet(page)
    assert not any(part.get_attribute("open") is not None for part in folded.all())  # as it was before printing


@pytest.mark.soak
def test_so_is_that_of_a_saved_file(visitor: Visit, server: Server, place: str, tmp_path: Path) -> None:
    page = visitor.page
    file = tmp_path / "report.html"
    file.write_bytes(server.http.get(f"{place}/report.html").content)
    page.goto(file.as_uri())
    page.wait_for_function("() => document.querySelectorAll('.three .main-svg').length >= 3")
    require_texts_apart(page, ".three .plotly-graph-div")
    require_noise_told(page)
    require_summary_on_first_sheet(page)
    visitor.wrong.clear()  # the file itself is not of the server


@pytest.mark.parametrize("width", first(1, [390, 1180]))
def test_folded_part_opened_keys_draws(visitor: Visit, server: Server, width: int) -> None:
    """A folded part is opened with keys and draws."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 800})
    place = keep(server, f"folded{width}", made())
    heading = server.http.get(f"{place}/where.csv").text.splitlines()[0]
    assert "measured less the paper's model, in phase, in percent of it" in heading
    visitor.go(place)
    summary = page.locator(".summary")
    summary.locator(".why > summary").click()
    assert "No d33" in summary.inner_text()
    assert "by noise alone" in summary.inner_text()
    assert "These recordings do not show whether there is also" in summary.inner_text()
    visitor.require_accessible()
    assert page.evaluate(_WIDE)
    better = page.locator("details.part > summary", has_text="How well the models describe the recordings")
    better.focus()
    page.keyboard.press("Enter")
    figure = page.locator("#figure-before_after .main-svg").first
    figure.wait_for()
    assert page.evaluate(_WIDE)
    visitor.require_accessible()
