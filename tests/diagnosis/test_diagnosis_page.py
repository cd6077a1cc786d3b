"""The report as a page that the command writes: complete, self-contained, safe; its figures show what it says."""

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from tests.support.adhesive_curves import NOISE_N, adhesive_curves, adhesive_figure, adhesive_page
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import EVERY, beside
from tests.support.report_pages import figures_in, written
from underskin.mechanisms import CATALOGUE, compose
from underskin.recordings.campaign import Campaign, frf_recordings, to_dict
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;<a href='https://example.org'>x</a>"
RESONANT = Made(("contact_resonance",), (6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0, sensors=2)
D33 = 15.0
OF_LINES = beside("contact_resonance", "timing_delay", "ageing")
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


def hostile(table: SigmaTable) -> Campaign:
    """A resonant campaign whose every text is markup; one recording's sign is flipped, so that it is named."""
    whole = campaign(RESONANT, table)
    recordings = []
    for number, entry in enumerate(frf_recordings(whole)):
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        sign = -1 if number == 3 else 1
        real, imag = sign * entry.frf_re_pc_per_n, sign * entry.frf_im_pc_per_n
        named = replace(entry, id=f"{HOSTILE}{number}", sensor=f"{HOSTILE}{entry.sensor}")
        recordings.append(replace(named, frf_re_pc_per_n=real, frf_im_pc_per_n=imag))
    sensors = tuple(replace(sensor, id=f"{HOSTILE}{sensor.id}") for sensor in whole.skin.sensors)
    skin = replace(whole.skin, sensors=sensors)
    return replace(whole, name=f"palm {HOSTILE}", skin=skin, recordings=tuple(recordings))


@pytest.fixture(scope="module")
def attacked(table: SigmaTable) -> str:
    return written([to_dict(hostile(table))], without=OF_LINES)[1]


@pytest.fixture(scope="module")
def resonant(table: SigmaTable) -> tuple[dict[str, Any], str]:
    return written([to_dict(campaign(RESONANT, table))], without=OF_LINES)


@pytest.fixture(scope="module")
def figures(resonant: tuple[dict[str, Any], str]) -> dict[str, go.Figure]:
    return figures_in(resonant[1])


def test_it_says_all_that_the_report_says(resonant: tuple[dict[str, Any], str]) -> None:
    report, text = resonant
    tags = Tags(text)
    assert report["verdict"] == "explained"
    first = "The paper's model lacks contact resonance (probability 98.5 %)"
    assert tags.text.index(first) < tags.text.index("Where")
    assert re.findall(r"<h2>(.*?)</h2>", text) == [
        "Where the model and the recordings differ", "What the model lacks, and the values found",
        "How well the models describe the recordings", "Look at these recordings", "Made with",
    ]  # fmt: skip
    wanted = [report["location"]["statement"], *(entry["why_not"] for entry in report["alternatives"])]
    wanted += [f"{entry['value']:.4g}" for entry in report["mechanisms"][0]["parameters"]]
    errors = report["fit"]["noise_floor_percent"], report["fit"]["after"]["heldout_rmse_percent"]
    wanted += [report["provenance"]["tables"]["sigma"], f"{min(errors):.3g} %"]  # noise alone is never above the error
    wanted += [CATALOGUE["contact_resonance"].plain, "these recordings decide"]
    assert [piece for piece in wanted if piece not in tags.text] == []
    said = tags.text.replace(" ".join(report["provenance"]["without"]), "")
    assert "dynamic force is the same in all recordings" in said  # in words, no names of the code


def drawn_texts(figure: Any) -> Iterator[str]:
    """All texts of a figure but those that plotly never draws: what it is told to remember, and what buttons are called
    in a list of the page."""
    if isinstance(figure, str):
        yield figure
    elif isinstance(figure, list | tuple):
        for entry in figure:
            yield from drawn_texts(entry)
    elif isinstance(figure, dict):
        unseen = ("meta", "name") if "method" in figure else ("meta",)
        for name, entry in figure.items():
            if name not in unseen:
                yield from drawn_texts(entry)


def test_markup_in_a_campaign_stays_text(attacked: str) -> None:
    tags = Tags(attacked)
    assert f"Diagnosis of palm {HOSTILE}" in tags.text
    assert f"{HOSTILE}3" in tags.text
    assert tags.count("img") == tags.count("a") == 0
    assert tags.count("script") == 4 + 5 + 1  # plotly's, three of figures, one a figure, the page's
    assert "<script>alert" not in attacked
    # In the figures, too, texts reach plotly escaped: it would show <a> and <b> as such.
    texts = [one for figure in figures_in(attacked).values() for one in drawn_texts(json.loads(figure.to_json()))]
    assert not any("<a href" in one for one in texts)
    assert any("&lt;a href" in one for one in texts)


def test_it_needs_nothing_from_outside(attacked: str) -> None:
    tags = Tags(attacked)
    assert [attributes for tag, attributes in tags.tags if {"src", "href"} & set(attributes)] == []
    assert tags.count("link") == 0
    policy = next(a["content"] for tag, a in tags.tags if a.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy


def drawn_by_a_browser(text: str, folder: Path, script: str) -> tuple[str, Any]:
    """The document of a page in a narrow window after its scripts have run, and what `script` leaves in its title."""
    assert CHROMIUM is not None
    file = folder / "page.html"
    run = f"<script>addEventListener('load', () => setTimeout(() => {{{script}}}, 2000))</script></html>"
    file.write_text(text.replace("</html>", run), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000", "--dump-dom"]
    command = [CHROMIUM, *options, "--window-size=500,844", f"--user-data-dir={folder / 'profile'}", file.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600).stdout
    return shown, json.loads(re.findall("<title>(.*?)</title>", shown)[0])


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_browser_draws_every_figure_whole(attacked: str, tmp_path: Path) -> None:
    """A browser draws every figure whole and buttons lead from one frf to the next.

    Titles are seen whole in a narrow window, and no text of the campaign becomes an element.
    """
    look = "const right = (one) => one.getBoundingClientRect().right, wide = document.documentElement.clientWidth;"
    look += "const titles = [...document.querySelectorAll('.summary .gtitle')].map(right);"
    look += "const [back, on] = document.querySelectorAll('label + button, label + button + button');"
    look += "const seen = () => [back.disabled, on.disabled, document.getElementById('figure-frf').data[0].y[0]];"
    look += "const before = seen(); on.click(); document.title = JSON.stringify([wide, titles, before, seen()]);"
    shown, (wide, titles, before, after) = drawn_by_a_browser(attacked, tmp_path, look)
    for name in ("where", "frf", "before_after", "explanations", "parameters"):
        part = shown[shown.index(f'id="figure-{name}"') :]
        assert "main-svg" in part[: part.index("</script>")]
    assert "<img src=x" not in shown
    assert len(titles) >= 3
    assert max(titles) <= wide
    buttons = figures_in(attacked)["frf"].layout.updatemenus[0].buttons
    assert before == [True, False, buttons[0].args[0]["y"][0][0]]
    assert after == [False, False, buttons[1].args[0]["y"][0][0]]


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_list_that_keys_reach_chooses_the_recording(tmp_path: Path) -> None:
    choosing = "const list = document.querySelector('label select'); list.selectedIndex = 1; "
    choosing += "list.dispatchEvent(new Event('change')); const drawn = document.getElementById('figure-curve');"
    choosing += "const bottom = (one) => one.getBoundingClientRect().bottom;"
    choosing += "document.title = JSON.stringify([drawn.data.filter((t) => t.visible).map((t) => t.meta.recording),"
    choosing += "bottom(drawn) - bottom(drawn.parentElement)]);"
    _, (recordings, beyond) = drawn_by_a_browser(adhesive_page()[1], tmp_path, choosing)
    assert beyond <= 1  # pixels: what lies below its box is hidden by what follows
    assert set(recordings) == {adhesive_figure().layout.updatemenus[0].buttons[1].name.partition(":")[0]}


@pytest.mark.parametrize(
    ("made", "verdict", "names"),
    [
        (Made(), "no_mismatch", {"where", "frf", "before_after", "explanations"}),
        (Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,)), "insufficient_data", set()),
    ],
    ids=["nothing", "too little"],
)
def test_a_report_without_mechanisms_has_its_page(made: Made, verdict: str, names: set[str], table: SigmaTable) -> None:
    report, text = written([to_dict(campaign(made, table))], without=EVERY)
    tags = Tags(text)
    assert (report["verdict"], set(figures_in(text))) == (verdict, names)
    assert ("The grey band holds 95 %" in tags.text) == ("frf" in names)
    if not names:
        assert tags.count("script") == 1  # the page's own, without plotly
        assert "Before anything can be concluded: " in tags.text


def test_figures_show_the_report_s_numbers(resonant: tuple[dict[str, Any], str], figures: dict[str, go.Figure]) -> None:
    report, _ = resonant
    bars = figures["explanations"].data[0]
    assert next(iter(bars.y)) == "contact resonance"
    assert list(bars.x) == [report["probability"], *(entry["probability"] for entry in report["alternatives"])]
    intervals = [trace.x for trace in figures["parameters"].data if trace.name == "95 % interval"]
    parameters = report["mechanisms"][0]["parameters"]
    assert [list(ends) for ends in intervals] == [[entry["low"], entry["high"]] for entry in parameters]
    for axis, (low, high) in zip(figures["parameters"].select_xaxes(), intervals, strict=True):
        assert (high - low) / (axis.range[1] - axis.range[0]) == pytest.approx(1 / 3)  # it is seen, however narrow
    where = figures["where"]
    cells, (outline,) = np.abs(np.asarray(where.data[0].z, dtype=float)), where.layout.shapes
    inside = cells[:, int(outline.x0 + 0.5) : int(outline.x1 + 0.5)]
    assert set(report["location"]["region"]) == {"frequency_hz"}
    assert np.nanmean(inside) > 5 * np.nanmean(cells[:, : int(outline.x0 + 0.5)])
    lowest = float(where.layout.xaxis.ticktext[int(outline.x0 + 0.5)])
    assert lowest == pytest.approx(report["location"]["region"]["frequency_hz"][0], rel=5e-3)


def shown_frf(figure: go.Figure, recording: str) -> dict[str, Floats]:
    """What the figure shows once a recording was chosen, by what it is; and the frequencies."""
    meta = figure.layout.meta
    changed = figure.layout.updatemenus[0].buttons[list(meta["recordings"]).index(recording)].args[0]
    x = changed.get("x", [trace.x for trace in figure.data])
    named = zip(meta["shows"], changed["y"], strict=True)
    return {"frequency_hz": np.asarray(x[0]), **{name: np.asarray(y, dtype=float) for name, y in named}}


def test_frfs_shown_recorded_beside_truth_noise(figures: dict[str, go.Figure], table: SigmaTable) -> None:
    """Frfs are shown as recorded beside the truth and on the noise s band."""
    figure, made = figures["frf"], campaign(RESONANT, table)
    model = compose(RESONANT.mechanisms, made, table)
    values = [*RESONANT.parameters, D33, 1.0, 1.0]
    fit = [entry.to_fit(value) for entry, value in zip(model.parameters, values, strict=True)]
    truth = 1e12 * model.predict(np.array(fit)).value
    inside: dict[str, list[bool]] = {"before": [], "after": []}
    for number, entry in enumerate(frf_recordings(made)):
        drawn, exact = shown_frf(figure, entry.id), truth[model.recording == number]
        recorded = np.asarray(entry.frf_re_pc_per_n) + 1j * np.asarray(entry.frf_im_pc_per_n)
        np.testing.assert_allclose(drawn["frequency_hz"], np.asarray(entry.frequency_hz), rtol=1e-4)
        again = drawn["measured"] * np.exp(1j * np.radians(drawn["measured phase"]))
        np.testing.assert_allclose(again, recorded, atol=1e-2 * np.abs(recorded).max())
        np.testing.assert_allclose(drawn["after"], np.abs(exact), rtol=0.06)  # gains of sensors, and the fit
        turned = np.angle(np.exp(1j * np.radians(drawn["after phase"])) / exact, deg=True)
        assert np.abs(turned).max() < 4.0
        np.testing.assert_allclose(drawn["before phase"], 0.0, atol=1e-6)  # without mass, no phase
        for which, found in inside.items():
            for part in ("real", "imaginary"):
                found += (np.abs(drawn[f"residual {which} {part}"]) <= drawn[f"noise {part} high"]).tolist()
    assert np.mean(inside["after"]) == pytest.approx(0.95, abs=0.03)
    assert np.mean(inside["before"]) < 0.75
    (menu,) = figure.layout.updatemenus
    assert len(menu.buttons) == len(made.recordings)
    assert "% before" in menu.buttons[0].name


def trace_of(recording: str, shows: str) -> go.Scatter:
    meta = ("recording", "shows")
    (trace,) = [one for one in adhesive_figure().data if tuple(one.meta[name] for name in meta) == (recording, shows)]
    return trace


def in_lab_units(recording: str, shows: str) -> tuple[Floats, Floats]:
    """Depth [mm] and force [N] of a trace."""
    trace = trace_of(recording, shows)
    return np.asarray(trace.x) * trace.meta["mm"], np.asarray(trace.y) * trace.meta["n"]


def test_curves_are_explained_by_adhesion_alone_and_their_page_says_the_modulus() -> None:
    """A jump into contact between two samples asks for no companion."""
    report, text = adhesive_page()
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == ("explained", ["adhesion"])
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] <= 0.5 <= modulus["high"]
    assert report["fit"]["after"]["heldout_rmse_percent"] < 1.2 * report["fit"]["noise_floor_percent"]
    said = Tags(text).text.replace(" ", "")
    assert f"addtothelaw.{modulus['value']:.4g}" in said
    assert set(figures_in(text)) == {"where", "curve", "before_after", "explanations", "parameters"}
    titles = [axis.title.text for axis in adhesive_figure().select_yaxes()]
    assert titles == ["force [N]", "residual<br>before [mN]", "residual<br>after [mN]"]


def test_the_residual_of_a_curve_is_what_was_measured_less_what_is_predicted() -> None:
    for which in ("before", "after"):
        depth, predicted = in_lab_units("c01", which)
        place, left = in_lab_units("c01", f"residual {which}")
        at, measured = in_lab_units("c01", "measured")
        np.testing.assert_array_equal(place, depth)
        turn, top = int(depth.argmax()), int(at.argmax())
        pressed = depth[:turn] > 0.02
        expected = np.interp(depth[:turn][pressed], at[:top], measured[:top])
        assert (predicted + left)[:turn][pressed] == pytest.approx(expected, abs=5 * NOISE_N)
        assert (float(np.median(np.abs(left[:turn][pressed]))) > 2 * NOISE_N) == (which == "before")


@pytest.mark.parametrize("recording", ["c01", "c02"])
def test_marks_stand_where_contact_begins_and_where_it_jumps_and_samples_there_are_kept(recording: str) -> None:
    document, truth = adhesive_curves()
    (entry,) = [one for one in document["recordings"] if one["id"] == recording]
    said = re.search(r"as recorded: (\S+) mm", trace_of(recording, "contact point after").hovertemplate)
    assert said
    contact = float(said[1])
    assert contact == pytest.approx(0.0, abs=1e-3)
    assert in_lab_units(recording, "contact point after")[0] == 0
    assert in_lab_units(recording, "contact point before")[0] > 0.003  # Hertz's law has no pull
    measured, _ = in_lab_units(recording, "measured")
    name, total = trace_of(recording, "measured").name, len(entry["force_n"])
    assert len(measured) < total / 2
    assert name == f"measured ({len(measured)} of {total} samples)"
    for mark, sample in (("snap-in", truth[recording].first), ("pull-off", truth[recording].last)):
        (depth,), (force,) = in_lab_units(recording, mark)
        assert depth + contact == pytest.approx(entry["displacement_mm"][sample], abs=1e-5)
        assert force == pytest.approx(entry["force_n"][sample], abs=NOISE_N)
        for beside_it in entry["displacement_mm"][sample - 3 : sample + 4]:
            assert np.abs(measured + contact - beside_it).min() < 1e-5
