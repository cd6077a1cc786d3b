"""What the tour looks at, in order."""

from collections.abc import Callable
from dataclasses import dataclass

from playwright.sync_api import Page

from docs.tour.photographer import drawn


@dataclass(frozen=True)
class Step:
    """A picture: how to come there from the step before, and what is to be said."""

    name: str
    title: str
    text: str
    walk: Callable[[Page], object]


def _example(page: Page) -> None:
    page.get_by_role("button", name="Load the example skin").click()
    page.wait_for_url("**/skins/example")
    drawn(page, "map")
    drawn(page, "history")
    page.evaluate("scrollTo(0, 0)")


def _campaign(page: Page) -> None:
    page.get_by_role("link", name="example, after six months").click()
    drawn(page, "frf")
    page.evaluate("scrollTo(0, 0)")


def _response(page: Page) -> None:
    for name in ("preload", "response"):
        drawn(page, name)
    page.locator("#figure-preload").evaluate("figure => figure.scrollIntoView()")


def _design(page: Page) -> None:
    page.get_by_role("link", name="example", exact=True).click()
    page.get_by_role("link", name="Design view").click()
    slider = page.get_by_label("pitch of the array, slider")
    with page.expect_response("**/design/answer?*"):
        slider.fill("450")
    drawn(page, "design")
    page.evaluate("scrollTo(0, 0)")


STEPS = (
    Step(
        "start",
        "Start",
        "An empty server offers an example: a 4 × 2 array over half a year, recorded by the [virtual rig](rig.md) "
        "(`python scripts/make_example.py`). Later this page lists your skins: the last campaign, d33 over time, and "
        "whether the recordings agree with the model.",
        lambda page: page.goto("/"),
    ),
    Step(
        "skin",
        "A skin",
        "*Load the example skin* leads here: the array as a map, coloured by d33, its uncertainty or its trend, and "
        "each sensor over time. Point at anything for exact values. Every figure is saved as SVG or PNG, its numbers "
        "as CSV; *The same by request*, at the foot of each page, is what your own program would send.",
        _example,
    ),
    Step(
        "campaign",
        "A campaign",
        "Magnitude, phase and coherence of its recordings, with the flat zone that d33 is averaged over and why it "
        "ends there: here a resonance moves with preload and sphere. Choose a sensor to see its recordings one by one.",
        _campaign,
    ),
    Step(
        "response",
        "What it tells of the array",
        "The FRF against preload, for each sphere, with the model's line; d33 of each sensor with its 95 % interval. "
        "Below are the map, the table, every recording, and what was left out and why. A recording is excluded, or the "
        "campaign withdrawn, with a reason; nothing is ever deleted.",
        _response,
    ),
    Step(
        "design",
        "Design",
        "The design view starts from a skin and answers while you move a slider: what reaches a sensor, how finely the "
        "array tells where a sphere presses, and how far apart two of them must be. "
        "[What the words mean](../README.md#before-you-build-one).",
        _design,
    ),
)
