"""The figure of a curve: what was measured, what the models predict and leave, and marks where they are in truth."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from tests.support.adhesive_curves import NOISE_N, adhesive_curves
from tests.support.mechanism_campaigns import compression_campaign
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.reporting.curve_data import ShownCurve, shown_curves
from underskin.diagnosis.reporting.curve_figure import curve_figure
from underskin.diagnosis.reporting.numbers import parameter
from underskin.mechanisms.base import Kind
from underskin.prediction.forward_model import predict
from underskin.recordings.campaign import Campaign, IndentationRecording, parse
from underskin.recordings.conditions import Conditions, IndentationConditions, SkinDescription
from underskin.recordings.curve_course import course
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats


@dataclass(frozen=True)
class Shown:
    """The curves of a campaign, what they were fitted with, and their figure."""

    campaign: Campaign
    before: Explanation
    after: Explanation
    curves: list[ShownCurve]
    figure: go.Figure


def shown(campaign: Campaign, kind: Kind, *names: str) -> Shown:
    problem = FittingProblem(curve_lines(campaign, kind), load_table())
    before, after = (problem.explain([Request(wanted)])[0] for wanted in ((), names))
    assert before is not None
    assert after is not None
    curves = shown_curves(problem, campaign, before, after)
    return Shown(
        campaign, before, after, curves, curve_figure(curves, kind, "Hertz's law" if names else "", "adhesion")
    )


@pytest.fixture(scope="module")
def sticky() -> Shown:
    return shown(parse(adhesive_curves()[0]), "indentation", "adhesion")


def trace_of(figure: go.Figure, recording: str, shows: str) -> go.Scatter:
    (trace,) = [one for one in figure.data if (one.meta["recording"], one.meta["shows"]) == (recording, shows)]
    return trace


def in_lab_units(figure: go.Figure, recording: str, shows: str) -> tuple[Floats, Floats]:
    """Depth [mm] and force [N] of a trace."""
    trace = trace_of(figure, recording, shows)
    return np.asarray(trace.x) * trace.meta["mm"], np.asarray(trace.y) * trace.meta["n"]


@pytest.mark.parametrize("of_wrong_law", [False, True])
def test_a_model_that_lacks_something_leaves_what_the_report_says_of_it(sticky: Shown, of_wrong_law: bool) -> None:
    """Weighed by noise that had to hold the adhesion too, it lay far below every sample."""
    seen = shown(sticky.campaign, "indentation", "instrument_compliance") if of_wrong_law else sticky
    explanation = seen.after if of_wrong_law else seen.before
    lines = explanation.best.hypothesis.lines
    assert lines.smooth is not None
    drawn = {curve.name: (curve.after if of_wrong_law else curve.before).force_n for curve in seen.curves}
    predicted = np.concatenate([drawn[entry.id] for entry in lines.campaign.recordings])
    measured, samples = lines.value.real, lines.smooth.count
    left = (samples * (measured - predicted) ** 2).sum() / (samples * measured**2).sum()
    _, stated = explanation.least_squares
    assert 100 * np.sqrt(left) == pytest.approx(stated, rel=0.1)


@pytest.mark.parametrize("recording", ["c01", "c02"])
def test_the_model_after_is_the_forward_model_at_the_parameters_of_the_report(sticky: Shown, recording: str) -> None:
    depth, drawn = in_lab_units(sticky.figure, recording, "after")
    stated = [parameter(sticky.after, place) for place in range(len(sticky.after.model.parameters))]
    values = {entry["name"]: entry["value"] for entry in stated if not entry["name"].startswith("contact_point")}
    (entry,) = [one for one in sticky.campaign.recordings if one.id == recording]
    assert isinstance(entry, IndentationRecording)
    planned = IndentationConditions(recording, entry.indenter_radius_mm, depth)
    conditions = Conditions("one", sticky.campaign.skin, (planned,))
    law = predict(conditions, load_table(), {**values, f"contact_point {recording}": 0.0}, mechanisms=["adhesion"])
    force = law.value.real
    clear = np.abs(depth) > 1e-3  # four digits of the works move the touch by less
    design = np.column_stack([force, np.ones(len(force))])[clear]
    (gain, zero), *_ = np.linalg.lstsq(design, drawn[clear], rcond=None)
    assert gain == pytest.approx(1.0, abs=0.02)
    assert abs(zero) < NOISE_N
    assert drawn[clear] == pytest.approx(design @ (gain, zero), abs=1e-3 * float(force.max()))


@pytest.mark.parametrize("which", ["before", "after"])
def test_the_residual_is_what_was_measured_less_what_is_predicted(sticky: Shown, which: str) -> None:
    depth, predicted = in_lab_units(sticky.figure, "c01", which)
    place, left = in_lab_units(sticky.figure, "c01", f"residual {which}")
    at, measured = in_lab_units(sticky.figure, "c01", "measured")
    np.testing.assert_array_equal(place, depth)
    turn, top = int(depth.argmax()), int(at.argmax())
    pressed = depth[:turn] > 0.02
    expected = np.interp(depth[:turn][pressed], at[:top], measured[:top])
    assert (predicted + left)[:turn][pressed] == pytest.approx(expected, abs=5 * NOISE_N)
    most = float(np.median(np.abs(left[:turn][pressed])))
    assert (most > 2 * NOISE_N) == (which == "before")


def test_only_the_true_law_leaves_its_residuals_on_the_noise_s_band(sticky: Shown) -> None:
    inside: dict[str, list[bool]] = {"before": [], "after": []}
    for curve in sticky.curves:
        for which, told in inside.items():
            depth, left = in_lab_units(sticky.figure, curve.name, f"residual {which}")
            turn = int(depth.argmax())
            for way, own in (("in", slice(None, turn + 1)), ("back", slice(turn + 1, None))):
                place, high = in_lab_units(sticky.figure, curve.name, f"noise {way} {which} high")
                low = in_lab_units(sticky.figure, curve.name, f"noise {way} {which} low")[1]
                np.testing.assert_array_equal(low, -high)
                assert (np.diff(place) >= 0).all()  # the area is filled in one direction
                told += list(np.abs(left[own]) <= np.interp(depth[own], place, high))
    assert len(inside["after"]) > 100
    assert np.mean(inside["after"]) > 0.9
    assert np.mean(inside["before"]) < 0.5
    shown_once = [trace for trace in sticky.figure.data if trace.visible and trace.showlegend and "noise" in trace.name]
    assert len(shown_once) == 1


@pytest.mark.parametrize("recording", ["c01", "c02"])
def test_marks_stand_where_contact_begins_and_where_it_jumps(sticky: Shown, recording: str) -> None:
    document, truth = adhesive_curves()
    (entry,) = [one for one in document["recordings"] if one["id"] == recording]
    (curve,) = [one for one in sticky.curves if one.name == recording]
    contact = curve.after.contact.displacement_mm
    assert contact == pytest.approx(0.0, abs=1e-3)
    assert f"as recorded: {contact:.6g} mm" in trace_of(sticky.figure, recording, "contact point after").hovertemplate
    assert in_lab_units(sticky.figure, recording, "contact point after")[0] == 0
    assert in_lab_units(sticky.figure, recording, "contact point before")[0] > 0.004  # Hertz's law has no pull
    for name, sample in (("snap-in", truth[recording].first), ("pull-off", truth[recording].last)):
        (depth,), (force,) = in_lab_units(sticky.figure, recording, name)
        assert depth + contact == pytest.approx(entry["displacement_mm"][sample], abs=1e-6)
        assert force == pytest.approx(entry["force_n"][sample], abs=NOISE_N)


def test_axes_have_units_in_which_the_numbers_read_well(sticky: Shown) -> None:
    titles = [axis.title.text for axis in sticky.figure.select_yaxes()]
    assert titles == ["force [N]", "residual<br>before [mN]", "residual<br>after [mN]"]
    nano = [replace(curve, **small(curve)) for curve in sticky.curves]
    figure = curve_figure(nano, "indentation", "Hertz's law", "adhesion")
    assert [axis.title.text for axis in figure.select_xaxes()][-1] == "depth from the contact point [µm]"
    assert figure.layout.yaxis.title.text == "force [µN]"
    assert np.abs(np.asarray(figure.data[0].y)).max() == pytest.approx(np.abs(sticky.curves[0].sample_n).max())


def small(curve: ShownCurve) -> dict[str, Any]:
    """Displacements and forces of a nanoindenter."""
    parts: dict[str, Any] = {name: 1e-3 * getattr(curve, name) for name in ("sample_mm", "displacement_mm")}
    parts |= {name: 1e-6 * getattr(curve, name) for name in ("sample_n", "force_n")}
    for name in ("before", "after"):
        one = getattr(curve, name)
        contact = replace(one.contact, displacement_mm=1e-3 * one.contact.displacement_mm)
        parts[name] = replace(one, force_n=1e-6 * one.force_n, contact=contact)
    return {**parts, "snap_in": None, "pull_off": None}


def test_a_long_recording_is_thinned_but_not_at_its_jumps(sticky: Shown) -> None:
    document, truth = adhesive_curves()
    for entry in document["recordings"]:
        depth, _ = in_lab_units(sticky.figure, entry["id"], "measured")
        (curve,) = [one for one in sticky.curves if one.name == entry["id"]]
        total = len(entry["force_n"])
        assert len(depth) < total / 2
        name = trace_of(sticky.figure, entry["id"], "measured").name
        assert name == f"measured ({len(depth)} of {total} samples)"
        for sample in (truth[entry["id"]].first, truth[entry["id"]].last):
            beside = entry["displacement_mm"][sample - 5 : sample + 6]
            assert set(np.round(beside, 12)) <= set(np.round(curve.sample_mm, 12))


def test_one_recording_is_seen_at_a_time_the_worst_explained_first(sticky: Shown) -> None:
    first, second = sticky.curves
    assert first.left_percent > second.left_percent
    (menu,) = sticky.figure.layout.updatemenus
    assert [button.name.partition(":")[0] for button in menu.buttons] == [first.name, second.name]
    for number, button in enumerate(menu.buttons):
        changed, layout = button.args
        seen = {trace.meta["recording"] for trace, on in zip(sticky.figure.data, changed["visible"], strict=True) if on}
        assert seen == {sticky.curves[number].name}
        assert layout["yaxis.title.text"].startswith("force [")
    assert {trace.meta["recording"] for trace in sticky.figure.data if trace.visible} == {first.name}


def test_the_figure_of_many_long_recordings_stays_small(sticky: Shown) -> None:
    curve = sticky.curves[0]
    many = [replace(curve, name=f"recording {number}") for number in range(40)]
    assert len(curve_figure(many, "indentation", "Hertz's law", "adhesion").to_json()) < 400_000


def test_names_reach_plotly_as_text(sticky: Shown) -> None:
    hostile = "<b>r</b> & co"
    figure = curve_figure([replace(one, name=hostile) for one in sticky.curves], "indentation", "", hostile)
    (menu,) = figure.layout.updatemenus
    shown_texts = [
        menu.buttons[0].label,
        *(one.name for one in figure.data),
        *(one.hovertemplate for one in figure.data),
    ]
    assert not any("<b>" in text for text in shown_texts)
    assert menu.buttons[0].name.startswith(hostile)


def test_a_compression_has_no_jumps_and_one_model_where_nothing_is_added() -> None:
    figure = shown(compression_campaign(), "compression").figure
    band = {f"noise {way} after {edge}" for way in ("in", "back") for edge in ("low", "high")}
    assert {trace.meta["shows"] for trace in figure.data} == {
        "measured", "after", "residual after", "contact point", *band
    }  # fmt: skip
    assert figure.layout.xaxis2.title.text == "displacement from the contact point [mm]"
    assert figure.layout.title.text == "Force against displacement"


def test_the_contact_point_lies_on_the_way_in_whatever_the_cell_drifts() -> None:
    random = np.random.default_rng(2)
    depth = np.concatenate([np.linspace(-0.1, 0.2, 300), np.linspace(0.2, -0.1, 300)])
    hertz = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0) ** 1.5
    drift = np.linspace(0.0, 0.4, len(depth)) * hertz.max()
    force = hertz + drift + 1e-3 * hertz.max() * random.normal(size=len(depth))
    skin = SkinDescription(poisson_ratio=0.5)
    campaign = Campaign("c", skin, (IndentationRecording("i", 5.0, depth, force, time_s=np.linspace(0, 60, 600)),))
    problem = FittingProblem(curve_lines(campaign, "indentation"), load_table())
    (null,) = problem.explain([Request(())])
    assert null is not None
    (curve,) = shown_curves(problem, campaign, null, null)
    at = int(np.argmax(depth > 0.0))
    zero = course(depth, force, np.linspace(0, 60, 600)).zero
    assert curve.after.contact.displacement_mm == pytest.approx(0.0, abs=5e-3)
    assert curve.after.contact.force_n == pytest.approx(drift[at] - zero, abs=0.02 * hertz.max())
