"""A diagnosis in the browser: asked for, watched, read, saved, adopted; and what nobody else may do with it."""

import csv
from copy import deepcopy
from pathlib import Path

import orjson
import pytest
from playwright.sync_api import Locator

from tests.service.pages.conftest import Visit
from tests.service.pages.finished import LINES, Made, finish, keep, made
from tests.service.pages.forms import BROWSING, HOSTILE
from tests.support.cases import first
from tests.support.diagnosed import asked, resonant, sent
from tests.support.store_server import Server

SECTIONS = [
    "Where the model and the recordings differ", "What the model lacks, and the values found",
    "How well the models describe the recordings", "Adopt",
]  # fmt: skip


@pytest.fixture(scope="module")
def place(server: Server) -> str:
    """The page of a diagnosis that nothing changes."""
    return keep(server, "kept", made())


def test_a_diagnosis_is_watched_read_and_adopted(visitor: Visit, server: Server) -> None:
    page = visitor.page
    visitor.go(f"/campaigns/{sent(server, resonant('array', lines=LINES), 'resonating')}")
    page.get_by_role("button", name="Diagnose").click()
    page.wait_for_url("**/diagnoses/*")
    finish(server, made())
    page.get_by_role("heading", name=SECTIONS[0]).wait_for()  # without reloading by hand
    visitor.require_accessible()
    headings = page.get_by_role("heading", level=2).all_inner_texts()
    sections = [name for name in headings if name in SECTIONS]
    assert sections == SECTIONS
    assert page.locator(".first").inner_text().startswith("Contact resonance, tip mass")
    page.get_by_role("button", name="Adopt contact resonance of the rig").click()
    page.wait_for_url("**/skins/resonating?model=adopted")
    visitor.drawn(2)
    assert "by the adopted model" in page.locator("#figure-history figcaption").inner_text()
    assert page.get_by_label("d33 by").input_value() == "adopted"
    page.get_by_role("link", name="version 1").click()
    page.get_by_text("in force for skin resonating", exact=True).wait_for()
    assert page.get_by_role("button", name="Adopt contact resonance of the rig").count() == 0


def test_paper_report_nothing_press_saved_file(visitor: Visit, place: str, downloads: Path) -> None:
    """On paper there is the report and nothing to press and the saved file needs nothing else."""
    page = visitor.page
    visitor.go(place)
    visitor.drawn(4)
    assert page.get_by_role("button", name="Print or save as PDF").is_visible()
    page.emulate_media(media="print")
    assert [button for button in page.locator("button, .button").all() if button.is_visible()] == []
    sections = [heading for heading in page.get_by_role("heading", level=2).all() if heading.is_visible()]
    assert {*SECTIONS[:3]} <= {one.inner_text() for one in sections}
    for plot in page.locator(".plot:not(#array .plot)").all():
        assert plot.is_visible()
    page.emulate_media(media="screen")
    with page.expect_download() as saving:
        page.get_by_role("link", name="Save as one HTML file").click()
    file = downloads / "report.html"
    saving.value.save_as(file)
    asked_for: list[str] = []
    page.on("request", lambda request: asked_for.append(request.url))
    page.goto(file.as_uri())
    page.wait_for_function("() => document.querySelectorAll('.main-svg').length >= 4")
    assert asked_for == [file.as_uri()]
    visitor.wrong.clear()  # the file itself is not of the server


def test_a_figures_numbers_are_those_of_the_report(server: Server, place: str) -> None:
    tables = {
        name: list(csv.DictReader(server.http.get(f"{place}/{name}.csv").text.splitlines()))
        for name in ("where", "before_after", "explanations", "parameters")
    }
    mass = made().report["mechanisms"][0]["parameters"][0]
    told = tables["parameters"][0]
    assert (told["parameter"], float(told["value"])) == (mass["name"], mass["value"])
    assert float(tables["explanations"][0]["probability"]) == made().report["probability"]
    shown = {(row["model"], row["recording"]) for row in tables["before_after"]}
    assert shown == {(model, f"r{number}") for model in ("before", "after") for number in range(12)}
    lines = sum(int(row["points"]) for row in tables["where"])
    assert lines == len(tables["before_after"]) / 2  # each point is in one cell
    assert server.http.get(f"{place}/nothing.csv").status_code == 404


def require_whole(figure: Locator, width: int) -> None:
    """All of a figure's panels are seen in a window so wide, without moving it sideways."""
    panel = figure.locator(".plot").evaluate(
        "plot => plot.getBoundingClientRect().left + plot._fullLayout.xaxis._offset + plot._fullLayout.xaxis._length"
    )
    assert panel <= width
    assert figure.evaluate("one => one.scrollWidth <= one.clientWidth")


@pytest.mark.parametrize("width", first(1, [390, 1180]))
def test_models_laid_over_frf_after_keys(visitor: Visit, server: Server, place: str, width: int) -> None:
    """The models are laid over one frf after another with keys."""
    page = visitor.page
    page.set_viewport_size({"width": width, "height": 800})
    visitor.go(place)
    visitor.drawn(5)
    visitor.require_accessible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    figure = page.locator("#figure-frf")
    assert "95 % of the noise" in figure.inner_text()
    require_whole(figure, width)
    rows = list(csv.DictReader(server.http.get(f"{place}/frf.csv").text.splitlines()))
    names = list(dict.fromkeys(row["recording"] for row in rows))
    assert len(names) == 12
    assert len(rows) == 12 * LINES
    of_plot = "document.querySelector('#figure-frf .plot').data[0].y[0]"
    listed, back, on = figure.locator("select"), *(figure.get_by_role("button", name=n) for n in ("Previous", "Next"))
    assert back.is_disabled()
    for number, key in ((1, "list"), (2, "Next"), (3, "Next"), (2, "Previous")):
        if key == "list":
            listed.focus()
            page.keyboard.press("ArrowDown")
        else:
            (on if key == "Next" else back).focus()
            page.keyboard.press("Enter")
        (first, *_) = [row for row in rows if row["recording"] == names[number]]
        page.wait_for_function(f"() => Math.abs({of_plot} - {first['measured_pc_per_n']}) < 1e-9")
        assert listed.locator("option").nth(number).inner_text().startswith(f"{names[number]} ({first['sensor']}, ")
        assert listed.input_value() == str(number)
    listed.select_option(str(len(names) - 1))
    assert on.is_disabled()


def test_one_that_waits_is_cancelled_and_asked_for_again(visitor: Visit, server: Server) -> None:
    page = visitor.page
    visitor.go(f"/diagnoses/{asked(server, sent(server, resonant('waits'), 'waits'))}")
    assert "waits for its turn" in page.get_by_role("status").inner_text()
    visitor.require_accessible()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("It was cancelled").wait_for()
    page.get_by_role("button", name="Diagnose it again").click()
    page.get_by_text("It waits for its turn").wait_for()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("It was cancelled").wait_for()


def test_hostile_names_in_a_report_stay_text(visitor: Visit, server: Server) -> None:
    hostile = Made(deepcopy(made().report), made().figures)
    hostile.report["statement"] = f"{HOSTILE}. {HOSTILE}"
    hostile.report["location"]["statement"] = HOSTILE
    hostile.report["findings"] = [{"code": HOSTILE, "recording": HOSTILE, "field": HOSTILE, "statement": HOSTILE}]
    hostile.report["alternatives"][0]["why_not"] = HOSTILE
    visitor.page.on("dialog", lambda dialog: visitor.wrong.append(dialog.message))
    visitor.go(keep(server, "hostile", hostile, HOSTILE))
    visitor.drawn(4)
    assert visitor.page.locator("img[src=x]").count() == 0
    assert HOSTILE.split(".")[0] in (visitor.page.locator(".summary").text_content() or "")


def test_a_report_without_its_figures_says_so(server: Server) -> None:
    place = keep(server, "bare", Made(made().report, {}))
    shown = server.http.get(place, headers=BROWSING).text
    assert "were not kept" in shown
    assert shown.count('class="plot"') == 1  # how probable each explanation is: of the report itself
    assert server.http.get(f"{place}/where.csv", headers=BROWSING).status_code == 422
    assert server.http.get(f"{place}/parameters.csv").status_code == 200


def test_an_imported_report_of_odd_shape_is_said_to_be_one(server: Server) -> None:
    place = keep(server, "odd", Made({**made().report, "location": None}, {}))
    for path in (place, f"{place}/report.html"):
        answer = server.http.get(path, headers=BROWSING)
        assert answer.status_code == 422
        assert "lacks what a page shows" in answer.text


def test_figures_of_older_versions_tell_the_recordings_by_name(server: Server) -> None:
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
