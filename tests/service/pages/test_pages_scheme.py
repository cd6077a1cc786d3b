"""Figures in the colours that the reader prefers: dark on a screen, on white wherever they are printed or saved."""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from tests.service.pages.conftest import Visit, visit
from tests.service.pages.finished import keep, made
from tests.support.cases import first
from tests.support.diagnosed import resonant, table
from tests.support.store_server import Server
from underskin.figures.campaign_figures import page as campaign_page
from underskin.inversion.invert import invert
from underskin.recordings.campaign import parse

GROUND = (20, 25, 31)
# What has a colour of its own for the ground: ids on the discs of a map are written on the discs.
TEXTS = ".infolayer text, .xtick text, .ytick text, .x2tick text, .y2tick text, .legendtext, .annotation-text"
LINES = "path.js-line, .errorbar path, .xlines-above, .legendlines path"
_COLOURS = """([css, name]) => [...document.querySelectorAll(css)].map((one) => getComputedStyle(one))
  .filter((style) => style[name] !== "none" && style.strokeWidth !== "0px" && style.visibility !== "hidden")
  .map((style) => style[name])"""

_ON_WHITE = """() => [...document.querySelectorAll(".main-svg:first-child")].every(
  (one) => getComputedStyle(one).backgroundColor === "rgb(255, 255, 255)")"""


@pytest.fixture
def dark(browser: Browser, server: Server) -> Iterator[Visit]:
    for seen in visit(browser, server):
        seen.page.emulate_media(color_scheme="dark")
        yield seen


def rgb(colour: str) -> tuple[float, ...]:
    return tuple(map(float, re.findall(r"[\d.]+", colour)[:3]))


def luminance(colour: tuple[float, ...]) -> float:
    """WCAG's relative one."""
    linear = [v / 12.92 if (v := part / 255) <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for part in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(colour: str, ground: tuple[float, ...] = GROUND) -> float:
    low, high = sorted([luminance(rgb(colour)), luminance(ground)])
    return (high + 0.05) / (low + 0.05)


def colours(page: Page, css: str, name: str) -> set[str]:
    return set(page.evaluate(_COLOURS, [css, name]))


def require_dark(page: Page) -> None:
    assert colours(page, ".main-svg:first-child", "backgroundColor") == {"rgba(0, 0, 0, 0)"}
    texts, lines = colours(page, TEXTS, "fill"), colours(page, LINES, "stroke")
    assert texts
    assert min(map(contrast, texts)) >= 4.5, texts
    assert lines
    assert min(map(contrast, lines)) >= 3, lines


def require_light(page: Page) -> None:
    page.wait_for_function(_ON_WHITE)  # the event of another medium comes with the next frame
    texts = colours(page, TEXTS, "fill")
    assert min(contrast(one, (255, 255, 255)) for one in texts) >= 4.5, texts


@pytest.fixture(scope="module")
def addresses(server: Server) -> dict[str, str]:
    """Ids of a campaign, and of a diagnosis that is done."""
    diagnosis = keep(server, "dark", made()).rpartition("/")[2]
    return {"diagnosis": diagnosis, "campaign": server.http.get(f"/v1/diagnoses/{diagnosis}").json()["campaign_id"]}


@pytest.mark.parametrize(
    ("path", "figures"),
    first(
        2,
        [
            ("/skins/dark", 2),
            ("/diagnoses/{diagnosis}", 6),
            ("/field", 2),
            ("/campaigns/{campaign}", 4),
            ("/design", 2),
            ("/loads", 1),
        ],
    ),
)
def test_figures_dark_screen_light_paper(dark: Visit, addresses: dict[str, str], path: str, figures: int) -> None:
    """Figures are dark on the screen and light on paper."""
    dark.go(path.format(**addresses))
    dark.drawn(figures)
    require_dark(dark.page)
    dark.require_accessible()
    dark.page.emulate_media(media="print")
    require_light(dark.page)


@pytest.mark.soak
def test_saved_figure_browser_prints_white(dark: Visit, addresses: dict[str, str], downloads: Path) -> None:
    """A saved figure and what a browser prints are on white."""
    page = dark.page
    dark.go(f"/campaigns/{addresses['campaign']}")
    dark.drawn(4)
    with page.expect_download() as saving:
        page.locator("#figure-frf").get_by_role("button", name="SVG").click()
    saving.value.save_as(downloads / "frf.svg")
    assert "rgb(255, 255, 255)" in (downloads / "frf.svg").read_text()
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    require_light(page)
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    require_dark(page)


@pytest.mark.soak
def test_files_without_a_server_are_dark_too(
    dark: Visit, server: Server, addresses: dict[str, str], downloads: Path
) -> None:
    document = parse(resonant("dark"))
    files = {
        "report.html": server.http.get(f"/diagnoses/{addresses['diagnosis']}/report.html").text,
        "campaign.html": campaign_page(document, invert(document, table())),
    }
    for name, text in files.items():
        (downloads / name).write_text(text)
        dark.page.goto((downloads / name).as_uri())
        dark.page.wait_for_function("() => document.querySelectorAll('.main-svg').length > 2")
        assert dark.page.evaluate("getComputedStyle(document.documentElement).backgroundColor") == f"rgb{GROUND}"
        require_dark(dark.page)
        dark.page.emulate_media(media="print")
        require_light(dark.page)
        dark.page.emulate_media(media="screen")
    dark.wrong.clear()  # the files themselves are not of the server


def test_pictures_of_mechanisms_follow_too(dark: Visit) -> None:
    page = dark.page
    dark.go("/mechanisms")
    picture = page.locator("img.picture").first
    grounds: dict[Literal["dark", "light"], tuple[int, int, int]] = {"dark": GROUND, "light": (255, 255, 255)}
    for scheme, ground in grounds.items():
        page.emulate_media(color_scheme=scheme)
        picture.scroll_into_view_if_needed()
        page.wait_for_function("one => one.complete && one.naturalWidth > 0", arg=picture.element_handle())
        pixels = Image.open(io.BytesIO(picture.screenshot())).convert("RGB")
        assert pixels.getpixel((20, 20)) == ground
    dark.go(str(picture.get_attribute("src")))  # by itself, under its own policy
    assert "stroke:#38434e" in page.content()
