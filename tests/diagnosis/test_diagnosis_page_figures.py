"""The figures of a report's page show its numbers, and where the misfit is."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.adhesive_curves import adhesive_curves
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import BESIDE_SKINS, COSTLY, lean_diagnosis
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.figures import explanations, figures
from underskin.diagnosis.reporting.report import DiagnosisResult, report
from underskin.recordings.campaign import Campaign, FrfRecording, parse
from underskin.surrogate.sigma_table import load_table
from underskin.units import readable_unit

RESONANT = Made(
    mechanisms=("contact_resonance",), parameters=(6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0, sensors=2
)


@pytest.fixture(scope="module")
def found() -> DiagnosisResult:
    return diagnose(campaign(RESONANT, load_table()), load_table())


@pytest.fixture(scope="module")
def document(found: DiagnosisResult) -> dict[str, Any]:
    return report(found)


@pytest.mark.slow
def test_figures_show_the_report_s_numbers(found: DiagnosisResult, document: dict[str, Any]) -> None:
    drawn = figures(found, document)
    bars = drawn["explanations"].data[0]
    assert next(iter(bars.y)) == "contact resonance"
    assert list(bars.x) == [document["probability"], *(entry["probability"] for entry in document["alternatives"])]
    intervals = [trace.x for trace in drawn["parameters"].data if trace.name == "95 % interval"]
    parameters = document["mechanisms"][0]["parameters"]
    assert [list(ends) for ends in intervals] == [[entry["low"], entry["high"]] for entry in parameters]
    for axis, (low, high) in zip(drawn["parameters"].select_xaxes(), intervals, strict=True):
        assert (high - low) / (axis.range[1] - axis.range[0]) == pytest.approx(1 / 3)  # it is seen, however narrow
    notes = [note.text for note in drawn["parameters"].layout.annotations]
    assert all("before the recordings" in note for note in notes)
    for plot in ("", "2"):
        x, y = (drawn["before_after"].layout[f"{axis}axis{plot}"].range for axis in "xy")
        assert x == y


@pytest.mark.slow
def test_after_the_points_lie_within_the_noise_s_band(found: DiagnosisResult, document: dict[str, Any]) -> None:
    traces = figures(found, document)["before_after"].data
    bands = [trace for trace in traces if trace.fill == "toself"]
    outside = []
    for band, name in zip(bands, ("before", "after"), strict=True):
        points = next(trace for trace in traces if trace.name == name)
        count = len(band.x) // 2
        high, low = band.y[:count], band.y[count:][::-1]
        above = points.y > np.interp(points.x, band.x[:count], high)
        below = points.y < np.interp(points.x, band.x[:count], low)
        outside.append(float(np.mean(above | below)))
    before, after = outside
    assert after < 0.1 < 0.2 < before


@pytest.mark.slow
def test_the_map_shows_where_the_misfit_is(found: DiagnosisResult, document: dict[str, Any]) -> None:
    drawn = figures(found, document)["where"]
    cells, (outline,) = np.abs(np.asarray(drawn.data[0].z, dtype=float)), drawn.layout.shapes
    inside = cells[:, int(outline.x0 + 0.5) : int(outline.x1 + 0.5)]
    assert set(document["location"]["region"]) == {"frequency_hz"}
    assert inside.size < cells.size / 2
    assert np.nanmean(inside) > 5 * np.nanmean(cells[:, : int(outline.x0 + 0.5)])
    lowest = float(drawn.layout.xaxis.ticktext[int(outline.x0 + 0.5)])
    assert lowest == pytest.approx(document["location"]["region"]["frequency_hz"][0], rel=5e-3)


def unevenly_recorded() -> Campaign:
    """A resonant campaign whose recordings have lines at frequencies of their own."""
    table = load_table()
    recordings = []
    for number in range(12):
        own = campaign(replace(RESONANT, highest_hz=1000.0 * 1.01**number), table).recordings[number]
        recordings.append(own)
    return replace(campaign(RESONANT, table), recordings=tuple(recordings))


@pytest.mark.slow
def test_steps_of_frequency_are_common_and_even_in_its_logarithm() -> None:
    found = diagnose(unevenly_recorded(), load_table())
    drawn = figures(found, report(found))["where"]
    steps = np.array([float(text) for text in drawn.layout.xaxis.ticktext])
    assert len(steps) > 4
    ratios = steps[1:] / steps[:-1]
    assert ratios.min() > 1.2
    assert ratios.max() < 1.6 * ratios.min()
    assert np.isfinite(np.asarray(drawn.data[0].z, dtype=float)).all()  # no gap
    assert "the paper's model" in drawn.layout.title.text


def test_a_long_explanation_is_broken_into_lines_that_an_axis_has_room_for() -> None:
    names = ["preload_dependent_d33", "sensor_spread", "contact_resonance"]
    one = {"verdict": "ambiguous", "probability": 0.7, "mechanisms": [{"name": name} for name in names]}
    figure = explanations({**one, "alternatives": [{"mechanisms": ["none_of_these"], "probability": 0.3}]})
    assert list(figure.data[0].y) == [
        "preload dependent d33 +<br>sensor spread +<br>contact resonance",
        "none of these",
    ]


@pytest.mark.slow
def test_a_map_of_curves_that_agree_is_pale_and_its_labels_differ() -> None:
    found = lean_diagnosis(parse(adhesive_curves(0.0)[0]), load_table(), *COSTLY)
    every = figures(found, report(found))
    largest = max(max(one["force_n"]) for one in adhesive_curves(0.0)[0]["recordings"])
    assert every["before_after"].layout.xaxis.title.text == f"predicted [{readable_unit('force_n', largest)[0]}]"
    drawn = every["where"]
    labels, (cells,) = drawn.layout.xaxis.ticktext, drawn.data
    assert 2 < len(set(labels)) == len(labels) <= 12
    assert max(map(len, labels)) <= 5
    assert drawn.layout.xaxis.title.text == "displacement as recorded [mm]"
    assert cells.zmax >= 2 * drawn.layout.meta["noise_percent"] > 0
    assert np.abs(np.asarray(cells.z, dtype=float)).max() < 0.5 * cells.zmax
    assert set(np.ravel(cells.text)) == {"0"}


@pytest.mark.slow
def test_the_noise_of_points_is_without_what_sensors_differ_by() -> None:
    made = campaign(Made(sensors=3, preloads_n=(0.5, 2.0)), load_table())
    weak = [
        replace(one, frf_re_pc_per_n=0.7 * one.frf_re_pc_per_n) if one.sensor == "s2" else one
        for one in made.recordings
        if isinstance(one, FrfRecording) and one.frf_re_pc_per_n is not None
    ]
    found = lean_diagnosis(replace(made, recordings=tuple(weak)), load_table(), *BESIDE_SKINS)
    drawn = figures(found, report(found))
    noise_percent = drawn["where"].layout.meta["noise_percent"]
    assert 2 < noise_percent < 8  # 1.96 times a gain's 2 % and a line's 1 %; sensors differ by 16 %
    bands = [np.asarray(trace.y) for trace in drawn["before_after"].data if trace.fill == "toself"]
    before, after = (np.abs(band[: len(band) // 2] - band[: len(band) // 2 - 1 : -1]).max() for band in bands)
    assert before < 1.5 * after  # the model alone takes its misfit for noise
