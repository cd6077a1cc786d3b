"""The steps of the tour, in order."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Page

from docs.tour.photographer import drawn, raw_recordings

_DIAGNOSIS_MS = 300_000
VERDICT = "a contact resonance with a tip mass of 6.00 g, at a probability of 98.5 %"  # tests hold it to the code


@dataclass(frozen=True)
class TourStep:
    """A picture: how to reach it from the previous step, and its text."""

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


def _diagnosis(page: Page) -> None:
    page.get_by_role("button", name="Diagnose").click()
    page.get_by_role("heading", name="Where the model and the recordings differ").wait_for(timeout=_DIAGNOSIS_MS)
    drawn(page, "where")
    page.evaluate("scrollTo(0, 0)")


def _better(page: Page) -> None:
    drawn(page, "frf")
    page.locator("#figure-frf .choice").evaluate("list => list.scrollIntoView({ behavior: 'instant' })")


def _adopted(page: Page) -> None:
    page.get_by_role("button", name="Adopt contact resonance of the rig").click()
    page.wait_for_url("**/skins/example?model=adopted")
    drawn(page, "history")
    page.evaluate("scrollTo(0, 0)")


def _upload(page: Page) -> None:
    page.get_by_role("link", name="Upload").first.click()
    with tempfile.TemporaryDirectory() as folder:
        recordings, rig = raw_recordings(Path(folder))
        page.get_by_label("Files").set_input_files(recordings)
        page.get_by_label("Rig description").set_input_files(rig)
        page.get_by_role("button", name="Look at them").click()
        page.wait_for_url("**/upload/*")
    drawn(page, "frf")
    page.evaluate("scrollTo(0, 0)")
    page.get_by_text("What the channels are").click()


def _design(page: Page) -> None:
    page.get_by_role("link", name="Skins").first.click()
    page.get_by_role("link", name="example", exact=True).click()
    page.get_by_role("link", name="Design view").click()
    slider = page.get_by_label("pitch of the array, slider")
    with page.expect_response("**/design/answer?*"):
        slider.fill("450")
    drawn(page, "design")
    page.evaluate("scrollTo(0, 0)")


STEPS = (
    TourStep(
        "start",
        "Start",
        "An empty server offers an example: a 4 × 2 array over half a year, recorded by the [virtual rig](rig.md) "
        "(`python scripts/make_example.py`). Later this page lists your skins: the last campaign, d33 over time, and "
        "what is to be looked at, and whether the recordings agree with the model.",
        lambda page: page.goto("/"),
    ),
    TourStep(
        "skin",
        "A skin",
        "*Load the example skin* leads here: the array as a map, coloured by d33, its uncertainty or its trend, "
        "grey where it differs by chance, and each sensor over time. Click a sensor to choose it. Point at "
        "anything for exact values. Every figure is saved as SVG or PNG, its numbers as CSV; *The same by "
        "request*, at the foot of each page, is what your own program would send.",
        _example,
    ),
    TourStep(
        "campaign",
        "A campaign",
        "Magnitude, phase and coherence of its recordings, with the flat zone that d33 is averaged over and why it "
        "ends there: here a resonance moves with preload and sphere. Choose a sensor to see its recordings one by one.",
        _campaign,
    ),
    TourStep(
        "response",
        "What it tells of the array",
        "The FRF against preload, for each sphere, with the model's line; d33 of each sensor with its 95 % interval. "
        "Below are the map, the table, every recording, and what was left out and why. A recording is excluded, or the "
        "campaign withdrawn, with a reason; nothing is ever deleted.",
        _response,
    ),
    TourStep(
        "diagnosis",
        "A diagnosis",
        "*Diagnose* asks what the model leaves out; for these 64 recordings the answer takes some seconds. The page "
        f"begins with a summary: the answer in one sentence, here {VERDICT}; what to quote, what to do next and "
        "what was left out; why, and how well it fits, is folded. Printed, or saved as PDF from the "
        "browser's print dialog, the summary and its three figures are the first page. Folded below: where recordings "
        "and model disagree, the parameters with intervals, the alternatives and why not, what these recordings do "
        "not show, and what to measure next. [How to read it](diagnosis.md), [how it works](how-it-works.md).",
        _diagnosis,
    ),
    TourStep(
        "better",
        "Measured and predicted",
        "Recording by recording, magnitude and phase as measured, with the paper's model and the explanation laid "
        "over them; below, what either leaves, on the band in which 95 % of the noise lies. *Sensor by sensor*, "
        "further down, is the array: click a sensor for its recordings and its history. What to measure next, where "
        "something is left open, is also planned within the limits of your own rig: the spheres at hand, the preloads "
        "it holds. The whole is saved as one HTML file that opens anywhere.",
        _better,
    ),
    TourStep(
        "adopted",
        "Adopted",
        "Adopted, the explanation is the skin's model: skin and start head it, with d33 by it next to the paper's; map "
        "and history show either, and every value says by which. Withdrawn, with a reason, it stays as that version, "
        "and the paper's model is in force again.",
        _adopted,
    ),
    TourStep(
        "upload",
        "Your own files",
        "*Upload* takes what your instruments wrote, such as this TDMS file of a load cell and a charge amplifier. You "
        "see what each channel was taken for, which can be put right in the form, then each channel as it came and the "
        "FRFs, and of a bad recording what is wrong, field by field. Nothing is kept until you say so.",
        _upload,
    ),
    TourStep(
        "design",
        "Design",
        "The design view starts from a skin and answers while you move a slider: what reaches a sensor, how finely the "
        "array tells where a sphere presses, and how far apart two of them must be. "
        "[What the words mean](http-api.md#design-of-a-skin).",
        _design,
    ),
)
