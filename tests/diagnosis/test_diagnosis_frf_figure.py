"""The figure of FRFs: what was measured, what the models predict and leave, on the band of the noise."""

from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.reporting.frf_data import MOST_RECORDINGS, ShownFrf, shown_frfs
from underskin.diagnosis.reporting.frf_figure import frf_figure
from underskin.mechanisms import compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats

TIP_MASS_G, DAMPING, D33 = 6.0, 0.05, 15.0
RESONANT = Made(
    mechanisms=("contact_resonance",),
    parameters=(TIP_MASS_G, DAMPING),
    highest_hz=1000.0,
    lines=40,
    modulus_mpa=16.0,
    sensors=3,
)


def shown(made: Campaign, *names: str) -> list[ShownFrf]:
    problem = FittingProblem(lines(made), load_table())
    before, after = (problem.explain([Request(wanted)])[0] for wanted in ((), names))
    assert before is not None
    assert after is not None
    return shown_frfs(problem, before, after)


@pytest.fixture(scope="module")
def resonant() -> list[ShownFrf]:
    return shown(campaign(RESONANT, load_table()), "contact_resonance")


@pytest.fixture(scope="module")
def figure(resonant: list[ShownFrf]) -> go.Figure:
    return frf_figure(resonant, "the paper's model", "contact resonance")


def numbers(figure: go.Figure, recording: str) -> dict[str, Floats]:
    """What the figure shows once a recording was chosen, by what it is; and the frequencies."""
    meta = figure.layout.meta
    changed = figure.layout.updatemenus[0].buttons[meta["recordings"].index(recording)].args[0]
    x = changed.get("x", [trace.x for trace in figure.data])
    return {
        "frequency_hz": np.asarray(x[0]),
        **{name: np.asarray(y) for name, y in zip(meta["shows"], changed["y"], strict=True)},
    }


def test_what_is_measured_is_shown_as_it_was_recorded(figure: go.Figure) -> None:
    for entry in campaign(RESONANT, load_table()).recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        assert entry.frequency_hz is not None
        drawn, recorded = numbers(figure, entry.id), entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n
        np.testing.assert_allclose(drawn["frequency_hz"], entry.frequency_hz, rtol=1e-4)
        again = drawn["measured"] * np.exp(1j * np.radians(drawn["measured phase"]))
        np.testing.assert_allclose(again, recorded, atol=1e-2 * np.abs(recorded).max())


def test_the_model_after_is_the_truth_of_the_campaign(figure: go.Figure) -> None:
    made = campaign(RESONANT, load_table())
    model = compose(("contact_resonance",), made, load_table())
    values = [TIP_MASS_G, DAMPING, D33, 1.0, 1.0]
    fit = [entry.to_fit(value) for entry, value in zip(model.parameters, values, strict=True)]
    truth = 1e12 * model.predict(np.array(fit)).value
    for number, entry in enumerate(made.recordings):
        drawn, exact = numbers(figure, entry.id), truth[model.recording == number]
        np.testing.assert_allclose(drawn["after"], np.abs(exact), rtol=0.06)  # gains of sensors, and the fit
        turned = np.angle(np.exp(1j * np.radians(drawn["after phase"])) / exact, deg=True)
        assert np.abs(turned).max() < 4.0
        np.testing.assert_allclose(drawn["before phase"], 0.0, atol=1e-6)  # without mass, no phase
        assert np.ptp(drawn["before"]) < 1e-6


def test_95_percent_of_what_the_true_model_leaves_lies_on_the_band_and_the_paper_s_model_leaves_more() -> None:
    inside: dict[str, list[bool]] = {"before": [], "after": []}
    for seed in range(4):
        made = replace(RESONANT, seed=50 + seed, repeats=2)
        drawn = frf_figure(shown(campaign(made, load_table()), "contact_resonance"), "the paper's model", "resonance")
        for name in drawn.layout.meta["recordings"]:
            own = numbers(drawn, name)
            for model, found in inside.items():
                for part in ("real", "imaginary"):
                    found += (np.abs(own[f"residual {model} {part}"]) <= own[f"noise {part} high"]).tolist()
    assert np.mean(inside["after"]) == pytest.approx(0.95, abs=0.03)
    assert np.mean(inside["before"]) < 0.75


def test_residuals_are_measured_less_predicted_over_what_is_predicted_after(resonant: list[ShownFrf]) -> None:
    figure = frf_figure(resonant, "the paper's model", "contact resonance")
    for one in resonant:
        drawn = numbers(figure, one.name)
        scale = np.maximum(np.abs(one.after), 0.05 * np.abs(one.after).max())
        for name, predicted in (("before", one.before), ("after", one.after)):
            left = 100 * (one.measured - predicted) / scale
            shown_left = drawn[f"residual {name} real"] + 1j * drawn[f"residual {name} imaginary"]
            np.testing.assert_allclose(shown_left, left, rtol=1e-2)
    misfit = [one.left_after for one in resonant]
    assert misfit == sorted(misfit, reverse=True)
    assert resonant[0].left_before > 5 * resonant[0].left_after


def test_one_recording_is_chosen_by_its_name_its_sensor_and_its_misfit(figure: go.Figure) -> None:
    (menu,) = figure.layout.updatemenus
    assert len(menu.buttons) == len(figure.layout.meta["recordings"]) == 24
    name, sensor = figure.layout.meta["recordings"][0], figure.layout.meta["sensors"][0]
    assert menu.buttons[0].name.startswith(f"{name} ({sensor}, ")
    assert "% before" in menu.buttons[0].name
    assert "e+" not in menu.buttons[0].name
    for button in menu.buttons:
        low, high = button.args[1]["yaxis3.range"]
        own = numbers(figure, button.name.partition(" ")[0])
        for part in ("noise real high", "residual after real"):
            assert low < own[part].min()
            assert own[part].max() < high
    assert {trace.name for trace in figure.data if trace.name} >= {"95 % of the noise", "measured"}


def test_of_very_many_recordings_each_sensor_s_worst_are_shown_and_the_figure_stays_small() -> None:
    made = replace(RESONANT, mechanisms=(), parameters=(), sensors=20, lines=300, highest_hz=100.0)
    many = shown(campaign(made, load_table()))
    assert len(many) == MOST_RECORDINGS
    counts = [sum(one.sensor == f"s{number}" for one in many) for number in range(20)]
    assert counts == [6] * 20
    for one in many:
        steps = np.diff(np.log(one.frequency_hz))
        assert len(one.frequency_hz) < one.count == 300
        assert steps.max() < 4 * np.median(steps)
    figure = frf_figure(many, "", "the paper's model, nothing added")
    assert len(figure.to_json()) < 900_000
    assert "of 300 lines" in figure.layout.updatemenus[0].buttons[0].name
    assert not any("before" in name for name in figure.layout.meta["shows"])


def test_names_reach_plotly_as_text(resonant: list[ShownFrf]) -> None:
    hostile = "<b>r</b> & co"
    figure = frf_figure([replace(one, name=hostile) for one in resonant[:2]], "", hostile)
    (menu,) = figure.layout.updatemenus
    texts: list[Any] = [menu.buttons[0].label, *(one.name for one in figure.data)]
    assert not any("<b>" in str(text) for text in texts)
    assert menu.buttons[0].name.startswith(hostile)


def test_a_recording_of_one_line_is_shown_too() -> None:
    (one, *_) = shown(campaign(replace(RESONANT, mechanisms=(), parameters=(), lines=1), load_table()))
    figure = frf_figure([one], "", "the paper's model, nothing added")
    assert not figure.layout.updatemenus
    (predicted,) = [trace for trace in figure.data if trace.name == "the paper&#x27;s model, nothing added"]
    assert predicted.mode == "lines+markers"
    low, high = figure.layout.yaxis.range
    assert low <= min(one.measured.real) <= high
