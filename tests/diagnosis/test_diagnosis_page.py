"""The report as a page: complete, self-contained, and safe whatever a campaign holds."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.adhesive_curves import adhesive_figure
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import COSTLY, lean_diagnosis
from tests.support.mechanism_campaigns import indentation_campaign
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting import wording
from underskin.diagnosis.reporting.figures import figures
from underskin.diagnosis.reporting.html_report import page
from underskin.diagnosis.reporting.report import DiagnosisResult, report
from underskin.diagnosis.reporting.wording import readable
from underskin.mechanisms import compose
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign, FrfRecording, IndentationRecording
from underskin.surrogate.sigma_table import load_table

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;<a href='https://example.org'>x</a>"
RESONANT = Made(
    mechanisms=("contact_resonance",), parameters=(6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0, sensors=2
)
OFF_CENTRE = Made(("misalignment",), (0.5, 0.4), offsets_mm=(-2.0, 0.0, 2.0))
CHROMIUM = shutil.which("chromium")


class Tags(HTMLParser):
    """Every tag of a page and its attributes, and the text outside scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.cdata_elem is None:
            self.text += data

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.tags)


def hostile() -> Campaign:
    """A resonant campaign whose every text is markup; one recording's sign is flipped, so that it is named."""
    whole = campaign(RESONANT, load_table())
    recordings = []
    for number, entry in enumerate(whole.recordings):
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        sign = -1 if number == 3 else 1
        recordings.append(
            replace(
                entry,
                id=f"{HOSTILE}{number}",
                sensor=f"{HOSTILE}{entry.sensor}",
                frf_re_pc_per_n=sign * entry.frf_re_pc_per_n,
                frf_im_pc_per_n=sign * entry.frf_im_pc_per_n,
            )
        )
    sensors = tuple(replace(sensor, id=f"{HOSTILE}{sensor.id}") for sensor in whole.skin.sensors)
    return replace(
        whole, name=f"palm {HOSTILE}", skin=replace(whole.skin, sensors=sensors), recordings=tuple(recordings)
    )


@pytest.fixture(scope="module")
def found() -> DiagnosisResult:
    return diagnose(hostile(), load_table())


@pytest.fixture(scope="module")
def document(found: DiagnosisResult) -> dict[str, Any]:
    return report(found)


@pytest.fixture(scope="module")
def text(found: DiagnosisResult, document: dict[str, Any]) -> str:
    return page(document, figures(found, document))


@pytest.mark.slow
def test_it_says_all_that_the_report_says(text: str, document: dict[str, Any]) -> None:
    tags = Tags(text)
    assert document["verdict"] == "explained"
    first = "the paper's model lacks contact resonance (probability 98.5 %)"
    assert tags.text.index(first) < tags.text.index("Where")
    headings = re.findall(r"<h2>(.*?)</h2>", text)
    assert headings == [
        "Where the model and the recordings differ", "What the model lacks, and the values found",
        "How well the models describe the recordings", "Look at these recordings", "What to measure next", "Made with",
    ]  # fmt: skip
    wanted = [document["location"]["statement"], *(readable(entry["statement"]) for entry in document["findings"])]
    wanted += [entry["why_not"] for entry in document["alternatives"]]
    wanted += [readable(entry["reason"]) for entry in document["not_identifiable"]]
    wanted += [f"{entry['value']:.4g}" for entry in document["mechanisms"][0]["parameters"]]
    wanted += [document["provenance"]["tables"]["sigma"], f"{document['fit']['noise_floor_percent']:.3g} %"]
    wanted += [CATALOGUE["contact_resonance"].plain, "these recordings decide", "stays open"]
    assert [piece for piece in wanted if piece not in tags.text] == []
    assert [name for name in CATALOGUE if "_" in name and name in tags.text] == []  # no names of the code


def drawn_texts(figure: Any) -> Iterator[str]:
    """All texts of a figure but those that plotly never draws: what it is told to remember, and what buttons are called
    in a list of the page."""
    if isinstance(figure, str):
        yield figure
    elif isinstance(figure, list):
        for entry in figure:
            yield from drawn_texts(entry)
    elif isinstance(figure, dict):
        unseen = ("meta", "name") if "method" in figure else ("meta",)
        for name, entry in figure.items():
            if name not in unseen:
                yield from drawn_texts(entry)


@pytest.mark.slow
def test_markup_in_a_campaign_stays_text(text: str, found: DiagnosisResult, document: dict[str, Any]) -> None:
    tags = Tags(text)
    assert f"Diagnosis of palm {HOSTILE}" in tags.text
    assert f"{HOSTILE}3" in tags.text
    assert tags.count("img") == tags.count("a") == 0
    assert tags.count("script") == 4 + 5 + 1  # plotly's, three of figures, one a figure, the page's
    assert "<script>alert" not in text
    # In the figures, too, texts reach plotly escaped: it would show <a> and <b> as such.
    texts = [one for figure in figures(found, document).values() for one in drawn_texts(json.loads(figure.to_json()))]
    assert not any("<a href" in one for one in texts)
    assert any("&lt;a href" in one for one in texts)


@pytest.mark.slow
def test_it_needs_nothing_from_outside(text: str) -> None:
    tags = Tags(text)
    assert [attributes for tag, attributes in tags.tags if {"src", "href"} & set(attributes)] == []
    assert tags.count("link") == 0
    policy = next(a["content"] for tag, a in tags.tags if a.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy


def drawn_by_a_browser(text: str, folder: Path, width: int = 1280) -> str:
    """The document of a page after its scripts have run, in a window of that many pixels."""
    assert CHROMIUM is not None
    file = folder / "page.html"
    file.write_text(text, encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000", "--dump-dom"]
    options.append(f"--window-size={width},844")
    command = [CHROMIUM, *options, f"--user-data-dir={folder / 'profile'}", file.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_draws_every_figure(text: str, tmp_path: Path) -> None:
    drawn = drawn_by_a_browser(text, tmp_path)
    for name in ("where", "frf", "before_after", "explanations", "parameters"):
        part = drawn[drawn.index(f'id="figure-{name}"') :]
        assert "main-svg" in part[: part.index("</script>")]
    assert "<img src=x" not in drawn


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_titles_of_figures_are_seen_whole_in_a_narrow_window(text: str, tmp_path: Path) -> None:
    look = "const right = (one) => one.getBoundingClientRect().right, wide = document.documentElement.clientWidth;"
    look += "const titles = [...document.querySelectorAll('.summary .gtitle')].map(right);"
    look += "document.title = JSON.stringify([wide, titles]);"
    script = f"<script>addEventListener('load', () => setTimeout(() => {{{look}}}, 2000))</script></html>"
    shown = drawn_by_a_browser(text.replace("</html>", script), tmp_path, width=500)
    wide, titles = json.loads(re.findall("<title>(.*?)</title>", shown)[0])
    assert len(titles) >= 3
    assert max(titles) <= wide


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_list_that_keys_reach_chooses_the_recording(document: dict[str, Any], tmp_path: Path) -> None:
    choosing = "const list = document.querySelector('label select'); list.selectedIndex = 1; "
    choosing += "list.dispatchEvent(new Event('change')); document.title = "
    choosing += "document.getElementById('figure-curve').data.filter((t) => t.visible).map((t) => t.meta.recording);"
    choosing += "const bottom = (one) => one.getBoundingClientRect().bottom;"
    choosing += "const drawn = document.getElementById('figure-curve'); document.title += '|';"
    choosing += "document.title += bottom(drawn) - bottom(drawn.parentElement);"
    script = f"<script>addEventListener('load', () => setTimeout(() => {{{choosing}}}, 500))</script></html>"
    text = page(document, {"curve": adhesive_figure()}).replace("</html>", script)
    shown = drawn_by_a_browser(text, tmp_path)
    title, beyond = re.findall("<title>(.*?)</title>", shown)[0].split("|")
    assert float(beyond) <= 1  # pixels: what lies below its box is hidden by what follows
    menu = adhesive_figure().layout.updatemenus[0]
    assert set(title.split(",")) == {menu.buttons[1].name.partition(":")[0]}


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_buttons_lead_from_one_frf_to_the_next(
    found: DiagnosisResult, document: dict[str, Any], tmp_path: Path
) -> None:
    figure = figures(found, document)["frf"]
    look = "const [back, on] = document.querySelectorAll('label + button, label + button + button');"
    look += "const seen = () => [back.disabled, on.disabled, document.getElementById('figure-frf').data[0].y[0]];"
    look += "const before = seen(); on.click(); document.title = JSON.stringify([before, seen()]);"
    script = f"<script>addEventListener('load', () => setTimeout(() => {{{look}}}, 500))</script></html>"
    shown = drawn_by_a_browser(page(document, {"frf": figure}).replace("</html>", script), tmp_path)
    first, second = json.loads(re.findall("<title>(.*?)</title>", shown)[0])
    buttons = figure.layout.updatemenus[0].buttons
    assert (first, second) == (
        [True, False, buttons[0].args[0]["y"][0][0]],
        [False, False, buttons[1].args[0]["y"][0][0]],
    )


def curves() -> Campaign:
    """A thin layer's indentation."""
    table, empty = load_table(), indentation_campaign()
    model = compose(("layered_contact",), empty, table, "indentation")
    force = model.predict(np.array([entry.start for entry in model.parameters])).value.real
    random = np.random.default_rng(1)
    recordings = []
    for number, entry in enumerate(empty.recordings):
        assert isinstance(entry, IndentationRecording)
        own = force[model.recording == number]
        recordings.append(replace(entry, force_n=own + 1e-3 * np.abs(own).max() * random.normal(size=len(own))))
    return replace(empty, recordings=tuple(recordings))


EVERY = {"where", "frf", "before_after", "explanations", "parameters"}
ALONE = Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,))
KINDS = [
    (lambda: campaign(Made(), load_table()), "no_mismatch", EVERY - {"parameters"}),
    (lambda: campaign(OFF_CENTRE, load_table()), "explained", EVERY),
    (lambda: campaign(ALONE, load_table()), "insufficient_data", set()),
    (curves, "explained", EVERY - {"parameters", "frf"} | {"curve"}),  # a thin layer has no parameter
]


@pytest.mark.slow
@pytest.mark.parametrize(("make", "verdict", "names"), KINDS, ids=["nothing", "off centre", "too little", "curves"])
def test_every_kind_of_report_has_its_page(make: Callable[[], Campaign], verdict: str, names: set[str]) -> None:
    whole = make()
    found = lean_diagnosis(whole, load_table(), *COSTLY)
    document = report(found)
    drawn = figures(found, document)
    assert (document["verdict"], set(drawn)) == (verdict, names)
    tags = Tags(page(document, drawn))
    assert readable(document["statement"]).partition(". ")[0].rstrip(".") in tags.text
    if not names:
        assert tags.count("script") == 1  # the page's own, without plotly
    assert ("The grey band holds 95 %" in tags.text) == ("frf" in names)
    assert ("Depth is counted from the fitted contact point" in tags.text) == ("curve" in names)
    fitted = document["fit"]["after"].get("youngs_modulus") if document["fit"] else None
    assert ("Young's modulus [MPa]" in tags.text) == (fitted is not None) == ("curve" in names)
    if fitted is not None:
        stated = f"{wording.number(fitted['value'])}{wording.interval(fitted)}".replace(" ", "")
        settled = document["verdict"] in ("explained", "no_mismatch")
        label = "addstothelaw." if settled else "donotsettleit."
        assert f"{label}{stated}" in tags.text.replace(" ", "")
    for figure in drawn.values():
        json.loads(figure.to_json())
