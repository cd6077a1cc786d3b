"""A newcomer's way: the example, its skin, a campaign, figures saved, with a real browser."""

import csv
from pathlib import Path

import pytest

from tests.service.pages.conftest import EXAMPLE, Visit
from tests.support.cases import first


def test_from_the_start_to_a_campaign(newcomer: Visit) -> None:
    page = newcomer.page
    newcomer.drawn(2)
    newcomer.require_accessible()
    page.get_by_role("link", name="Skins").first.click()
    row = page.get_by_role("row", name="example, after six months")
    assert "64 recordings" in row.inner_text()
    assert row.locator("svg polyline").count() == 1
    newcomer.require_accessible()
    row.get_by_role("link", name="example, after six months").click()
    newcomer.drawn(4)
    assert "d33 of the array" in page.get_by_role("main").inner_text()
    newcomer.require_accessible()
    page.get_by_label("Lines of").select_option("s03")
    page.wait_for_url("**show=s03*")
    newcomer.drawn(4)
    assert page.locator("#figure-frf .legend .traces").count() == 8


def test_skin_s_page_gives_figures_numbers(newcomer: Visit, downloads: Path) -> None:
    """A skin s page gives its figures numbers and request with times in the viewer s zone."""
    page = newcomer.page
    newcomer.drawn(2)
    figure = page.locator("#figure-history")
    for kind, start in (("SVG", b"<svg"), ("PNG", b"\x89PNG")):
        with page.expect_download() as saving:
            figure.get_by_role("button", name=kind).click()
        saving.value.save_as(downloads / kind)
        assert (downloads / kind).read_bytes().startswith(start)
    with page.expect_download() as saving:
        figure.get_by_role("link", name="CSV").click()
    saving.value.save_as(downloads / "numbers.csv")
    rows = list(csv.DictReader((downloads / "numbers.csv").read_text().splitlines()))
    assert len(rows) == 4 * 8
    assert 12 < float(rows[0]["d33_pc_per_n"]) < 15
    rows = list(csv.DictReader(page.request.get(f"{newcomer.address}{EXAMPLE}/map.csv").text().splitlines()))
    assert len(rows) == 8
    assert all(float(row["slope_pc_per_n_per_year"]) < 0 for row in rows)  # the example ages
    page.get_by_text("The same by request").click()
    command = page.get_by_label("Shell").inner_text()
    path = command.removeprefix("curl -s ").strip().removeprefix(newcomer.address)
    shown = page.request.get(newcomer.address + path).json()
    assert [entry["sensor"] for entry in shown["sensors"]] == [f"s{number:02d}" for number in range(1, 9)]
    time = page.locator("table time").last
    assert time.get_attribute("datetime") == "2024-05-14T08:30:00.000000Z"
    assert "10:30" in time.inner_text()  # in Rome
    earliest = page.locator("#figure-history .plot").evaluate("plot => plot.data[0].x[0]")
    assert earliest.startswith("2024-05-14T10:30")
    assert "Europe/Rome" in page.locator("#figure-history .plot").evaluate("plot => plot.layout.xaxis.title.text")


def test_what_is_not_there_is_said_on_a_page(visitor: Visit) -> None:
    visitor.go("/skins/nobody")
    assert "There is no skin 'nobody'." in visitor.page.get_by_role("alert").inner_text()
    visitor.require_accessible()
    assert visitor.wrong.pop().startswith("Failed to load resource")  # the browser says so of every 404


def test_a_slider_of_the_design_view_answers_at_once(newcomer: Visit) -> None:
    page = newcomer.page
    page.get_by_role("link", name="Design view").click()
    newcomer.drawn(2)
    newcomer.require_accessible()
    told = page.locator("[data-result=resolution] b")
    before = float(told.inner_text().split()[0])
    assert page.locator("#figure-row").get_by_text("response width 3.35 mm").is_visible()
    assert before == pytest.approx(3.35, abs=0.01)  # the paper's geometry in solved contact
    slider = page.get_by_label("thickness h, slider")
    with page.expect_response("**/design/answer?*"):
        for _ in range(5):
            slider.press("ArrowRight")
    page.wait_for_function(
        "before => parseFloat(document.querySelector('[data-result=resolution] b').textContent) > before", arg=before
    )
    page.wait_for_url("**thickness_mm=2.*")
    page.locator("#pitch_mm").fill("1")
    page.get_by_role("alert").get_by_text("cannot overlap").wait_for()
    page.locator("#pitch_mm").fill("8")
    page.locator("#preload_n").fill("200")
    page.locator("#outside").get_by_text("Outside the table").wait_for()
    page.locator("#preload_n").fill("abc")
    page.get_by_role("alert").get_by_text("force F [N]: abc").wait_for()
    assert not page.locator("#outside").is_visible()  # it was of 200 N


def test_no_page_is_wider_than_a_phone(newcomer: Visit) -> None:
    """And each is accessible."""
    page = newcomer.page
    page.set_viewport_size({"width": 390, "height": 844})
    campaign = str(page.get_by_role("link", name="example, as built").get_attribute("href"))
    others = (EXAMPLE, campaign, "/upload", "/design", "/loads", "/fleets", "/mechanisms", "/d33", "/field")
    for path in first(4, ("/tables", "/docs/glossary", "/", "/design/search", *others)):
        newcomer.go(path)
        newcomer.drawn(page.locator(".plot").count())
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, path
        newcomer.require_accessible()
