"""Figures in the colours that the reader prefers: dark on a screen, on white wherever they are printed or saved."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from tests.service.pages.conftest import Visit, visit
from tests.service.pages.finished import keep, made
from tests.support.cases import first
from tests.support.store_server import Server

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
