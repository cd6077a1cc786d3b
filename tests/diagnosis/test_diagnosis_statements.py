"""What a report says: effects with their intervals, plain sentences, what stays open, and doubts about a fit."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.axes import WORDS
from underskin.diagnosis.data.dataset import Lines, lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.localisation.effect_size import EffectSize, effect
from underskin.diagnosis.localisation.permutation_test import AxisResult, Undecidable
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.answer_statement import answer_statement
from underskin.diagnosis.reporting.fit_warnings import fit_warnings
from underskin.diagnosis.reporting.html_report import page
from underskin.diagnosis.reporting.report import report
from underskin.diagnosis.reporting.statements import location_statement, why_not
from underskin.diagnosis.selection.answers import Answer
from underskin.diagnosis.selection.occam_correction import fit_and_plausibility, without_occam
from underskin.diagnosis.validation.identifiability import Confounding, Likeness, left_open
from underskin.findings.formatting import in_percent
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

GAIN = 0.02


@pytest.fixture(scope="module")
def recorded(table: SigmaTable) -> Lines:
    return lines(campaign(Made(repeats=3, gain=GAIN), table))


def effect_of(recorded: Lines, off: Floats) -> EffectSize:
    """Of recordings that lie above a model by `off` (recordings,)."""
    model = recorded.value / (1 + off)[recorded.recording]
    return effect(recorded, model, np.ones(len(model), dtype=bool), 0.0, 1.0)


def test_an_effect_of_one_sign_is_its_mean(recorded: Lines) -> None:
    found = effect_of(recorded, -0.2 + GAIN * np.random.default_rng(1).normal(size=recorded.recordings))
    assert found.signed
    assert found.percent == pytest.approx(-20.0, abs=1.5)
    assert found.low < found.percent < found.high < 0
    assert found.high - found.low == pytest.approx(2 * 1.96 * 100 * GAIN / np.sqrt(recorded.recordings), rel=0.4)


def test_an_effect_of_both_signs_is_its_root_mean_square(recorded: Lines) -> None:
    off = np.where(np.arange(recorded.recordings) % 2, 0.3, -0.2)
    found = effect_of(recorded, off)
    assert not found.signed
    assert 18.0 < found.low < found.percent < found.high < 32.0


def test_noise_alone_is_no_effect(recorded: Lines) -> None:
    noise = 0.03 * np.random.default_rng(3).normal(size=recorded.recordings)
    model = recorded.value / (1 + noise)[recorded.recording]
    found = effect(recorded, model, np.ones(len(model), dtype=bool), 0.03, 1.0)
    assert abs(found.percent) < 2.0


AXES = [AxisResult("preload_n", 0.001, 0.5), AxisResult("load_cycles", None, 0.0, Undecidable.ALIASED)]


def test_a_location_has_units_and_leaves_out_what_spans_a_whole_axis() -> None:
    ranges: dict[str, list[float | str]] = {"preload_n": [2.0, 3.0], "load_cycles": [0.0, 108200.0]}
    size = EffectSize(-36.94, -40.04, -33.02, True)
    said = location_statement(AXES, ranges, {"preload_n": False, "load_cycles": True}, size)
    assert said == (
        "The misfit depends on preload; most of it lies at preload 2 to 3 N, where the response is 36.9 % below the "
        "model (95 %: 33 to 40 %); whether it depends on load cycles, this design cannot tell."
    )
    both = location_statement(
        AXES, ranges, {"preload_n": True, "load_cycles": True}, EffectSize(12.0, 9.0, 15.0, False)
    )
    assert "spread over all of the recordings" in both
    assert "off by 12 % (root mean square" in both
    worst: dict[str, list[float | str]] = {"preload_n": [2.0, 3.0], "sensor": ["s04"]}
    axes = [AXES[0], AxisResult("sensor", 0.001, 0.3)]
    largest = location_statement(axes, worst, dict.fromkeys(worst, False), size)
    assert "; most of it lies at preload 2 to 3 N and it is largest at sensor s04, where the response is" in largest
    hidden = location_statement([entry for entry in AXES if entry.p_value is None], {}, {}, size)
    assert hidden == "Whether the misfit depends on load cycles, this design cannot tell."


def test_an_axis_with_a_trace_of_the_misfit_is_no_cause_to_look_for() -> None:
    size = EffectSize(1.0, 0.5, 1.5, True)
    trace = [AxisResult("preload_n", 0.01, 0.0004)]
    said = location_statement(trace, {}, {}, size)
    assert said == (
        "The misfit changes with preload beyond chance, but no more than a trace of it goes along with that."
    )
    beside = location_statement([*trace, AxisResult("sensor", 0.001, 0.6)], {"sensor": ["s2"]}, {"sensor": False}, size)
    assert beside.startswith("The misfit depends on sensor; it is largest at sensor s2, where")


def test_what_keeps_an_axis_undecidable_is_named(table: SigmaTable) -> None:
    """Each sphere on a day of its own: what differs between the spheres may have come with the day."""
    plain = campaign(Made(sensors=4), table)
    on_days = []
    for number, entry in enumerate(plain.recordings):
        assert isinstance(entry, FrfRecording)
        time = f"2020-01-{int(entry.indenter_radius_mm):02d}T10:{number:02d}:00Z"
        on_days.append(replace(entry, recorded_at=time, load_cycles=None, dwell_s=None))
    document = report(diagnose(replace(plain, recordings=tuple(on_days)), table))
    (entry,) = [one for one in document["location"]["axes"] if one["axis"] == "indenter_radius_mm"]
    assert entry["undecidable"] == "the time of recording determines it in this design"
    assert "whether it depends on" in document["location"]["statement"]


def test_each_mechanism_of_a_set_has_its_own_part_of_the_misfit(table: SigmaTable) -> None:
    made = Made(("ageing", "amplifier_high_pass"), (0.3, 300.0, 0.0, 0.3))
    document = report(diagnose(campaign(made, table), table))
    parts = {entry["name"]: entry["explains_percent"] for entry in document["mechanisms"]}
    assert set(parts) == set(made.mechanisms)
    assert 10 < parts["ageing"] < 50 < parts["amplifier_high_pass"] < 90
    assert sum(parts.values()) == pytest.approx(100, abs=5)
    assert "without it, " in page(document)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (
            EffectSize(-132.0, -140.0, -125.0, True),
            "the other sign than the model's, -0.32 times it (95 %: -0.4 to -0.25)",
        ),
        (EffectSize(-95.0, -96.0, -94.0, True), "the response is 0.05 times the model's (95 %: 0.04 to 0.06)"),
        (EffectSize(2820.0, 2700.0, 2970.0, True), "the response is 29 times the model's (95 %: 28 to 31)"),
        (EffectSize(1500.0, 1400.0, 1600.0, False), "off by 1500 % (root mean square"),
        (EffectSize(0.5, -0.3, 0.9, True), "0.5 % above the model (95 %: -0.3 to +0.9 %)"),
    ],
)
def test_large_effects_are_factors(size: EffectSize, said: str) -> None:
    assert said in location_statement(AXES, {}, {}, size)


@pytest.mark.slow
def test_a_probability_is_never_certain_and_the_same_everywhere(table: SigmaTable) -> None:
    document = report(diagnose(campaign(Made(("ageing",), (0.3, 300.0, 0.0), sensors=3, repeats=2), table), table))
    assert document["probability"] == 0.985
    assert document["alternatives"][0]["mechanisms"] == ["none_of_these"]
    assert "what nobody thought of" in document["alternatives"][0]["why_not"]
    assert "(probability 98.5 %)" in document["statement"]
    assert "probability 98.5 %" in page(document)
    assert in_percent(0.9996) == "over 99.9 %"
    assert in_percent(0.9994) == "99.9 %"
    assert in_percent(0.0004) == "under 0.1 %"
    assert in_percent(0.0) == "under 0.1 %"


def test_within_the_noise_nothing_is_said_to_lie_anywhere() -> None:
    said = location_statement(
        AXES, {"preload_n": [2.0, 3.0]}, {"preload_n": False}, EffectSize(0.05, -1, 1, True), agrees=True
    )
    assert said.startswith("What is left is within the noise, though more of it goes along with preload than chance")
    assert "above the model" not in said


def test_agreement_names_what_it_does_not_rule_out(table: SigmaTable) -> None:
    adhesion, misalignment = answers_of(table, {("adhesion",): 0.32, ("misalignment",): 0.01})
    nothing = replace(adhesion.explanation, names=()) if adhesion.explanation is not None else None
    torn = [Answer(nothing, 0.61), adhesion, misalignment]
    said = answer_statement(torn, "no_mismatch")
    assert said.startswith(
        "Recordings and the paper's model agree within the noise (probability 61 %), but they do not rule out: "
        "adhesion (32 %). Adhesion: the skin sticks"
    )
    assert "nothing needs to be added" in answer_statement([Answer(nothing, 0.97), adhesion], "no_mismatch")


@pytest.mark.parametrize(("missed", "reserve"), [(0.3, False), (2.21, True), (None, False)])
def test_an_answer_that_misses_what_was_held_out_says_so_in_its_first_sentence(
    missed: float | None, reserve: bool, table: SigmaTable
) -> None:
    (only,) = answers_of(table, {("strain_stiffening",): 0.985})
    after = {"heldout_rmse_percent": missed, "youngs_modulus": {"value": 1.0, "low": 0.9, "high": 1.1, "unit": "MPa"}}
    fit = {"before": after, "after": after, "noise_floor_percent": 0.257}
    first = answer_statement([only], "explained", kind="compression", fit=fit).split(". ")[0]
    assert ("; but what was held out is missed by 2.2 %, where noise gives 0.26 %" in first) is reserve


@pytest.mark.parametrize(
    ("kind", "named"), [("frf", "The paper's model"), ("indentation", "Hertz's law"), ("compression", "Hooke's law")]
)
def test_the_model_that_lacks_something_is_called_by_its_name(table: SigmaTable, kind: Kind, named: str) -> None:
    (only,) = answers_of(table, {("thickness_error",): 0.9})
    said = answer_statement([only], "explained", kind=kind)
    assert said.startswith(f"{named} lacks thickness error (probability 90 %). Thickness error: ")
    assert "_" not in said


def test_every_axis_has_words() -> None:
    from underskin.diagnosis.reporting.figure_data import AXES as LABELS

    assert set(LABELS) == set(WORDS)
    assert LABELS["preload_n"] == "preload [N]"


def answers_of(table: SigmaTable, weights: dict[tuple[str, ...], float]) -> list[Answer]:
    """Answers of given probabilities, fitted to a small campaign."""
    problem = FittingProblem(lines(campaign(Made(("ageing",), (0.3, 300.0, 0.0)), table)), table)
    found = []
    for names, probability in weights.items():
        (explanation,) = problem.explain([Request(names)])
        assert explanation is not None
        found.append(Answer(explanation, probability))
    return found


def test_what_was_found_is_not_called_unidentifiable(table: SigmaTable) -> None:
    answers = answers_of(table, {("ageing",): 0.6, ("misalignment",): 0.38, ("modulus_error",): 0.02})
    design = [
        Confounding("ageing", "d33", Likeness.TAKEN_UP),
        Confounding("ageing", "modulus_error", Likeness.TAKEN_UP),
        Confounding("adhesion", "noise", Likeness.TAKEN_UP),
        Confounding("modulus_error", "thickness_error", Likeness.TAKEN_UP),
    ]
    left = {(entry.mechanism, entry.confounded_with) for entry in left_open(design, answers)}
    assert left == {("adhesion", "noise"), ("modulus_error", "thickness_error"), ("ageing", "misalignment")}


@pytest.mark.slow
def test_sentences_hold_no_statistics(table: SigmaTable) -> None:
    made = Made(("ageing",), (0.3, 300.0, 0.0), sensors=3, repeats=2)
    document = report(diagnose(campaign(made, table), table))
    assert document["verdict"] == "explained"
    assert "recordings after many load cycles are lower" in document["statement"]
    texts = [document["statement"], document["location"]["statement"]]
    texts += [entry["why_not"] for entry in document["alternatives"]]
    texts += [entry["reason"] for entry in document["not_identifiable"]]
    texts += [entry["statement"] for entry in document["findings"]]
    assert [text for text in texts if re.search(r"e\^|χ|cosine|evidence|residual|nats|_n\b|_mm\b|_hz\b", text)] == [
        "dynamic_force_n is the same in all recordings"
    ]
    assert "ageing" not in {entry["mechanism"] for entry in document["not_identifiable"]}
    low, high = document["location"]["effect_interval_percent"]
    assert low < document["location"]["effect_percent"] < high


def test_prior_widths_decide_between_equals_neither_way(table: SigmaTable) -> None:
    """What fits as well is raised to the leader's weight and stays behind it; what fits worse, and nothing, are not."""
    ageing, wrong = (answer.explanation for answer in answers_of(table, {("ageing",): 0.9, ("adhesion",): 0.1}))
    assert ageing is not None
    assert wrong is not None
    equal = replace(ageing, names=("ageing",))
    raised = without_occam([equal, ageing, wrong], [-3.0, 0.0, -50.0])
    assert raised[1] == 0.0
    assert raised[0] == pytest.approx(0.0, abs=1e-5)
    assert raised[0] < raised[1]
    gap = fit_and_plausibility(wrong) - fit_and_plausibility(ageing)
    assert raised[2] == pytest.approx(max(-50.0, gap))
    assert gap < -10.0


def test_how_much_less_probable_is_said_in_numbers(table: SigmaTable) -> None:
    ageing, wrong = answers_of(table, {("ageing",): 0.99, ("thickness_error",): 0.01})
    assert re.fullmatch(
        r"the recordings are (about \d+|more than a million) times less probable under it", why_not(wrong, ageing)
    )


def moved(explanation: Explanation, **values: float) -> Explanation:
    """The explanation with some parameters put elsewhere."""
    fit = explanation.point.fit.copy()
    for place, entry in enumerate(explanation.model.parameters):
        if entry.name in values:
            fit[place] = entry.to_fit(values[entry.name])
    return replace(explanation, best=replace(explanation.best, point=replace(explanation.point, fit=fit)))


def test_contacts_beyond_the_tables_at_the_fitted_values_are_named(table: SigmaTable) -> None:
    problem = FittingProblem(
        lines(campaign(Made(modulus_mpa=0.5, thickness_mm=1.0, sensor_radius_mm=0.5), table)), table
    )
    (explanation,) = problem.explain([Request(("modulus_error",))])
    assert explanation is not None
    entry = next(one for one in explanation.model.parameters if not one.name.startswith(("d33", "youngs", "thick")))
    soft = moved(explanation, **{entry.name: entry.low})
    inside = soft.best.prediction.inside
    assert not inside.all()
    found = {one.recording for one in fit_warnings(problem, soft) if one.code == "out_of_domain"}
    assert found == {f"r{number}" for number in np.flatnonzero(~inside)}


def test_noise_larger_than_the_lines_own_is_named(table: SigmaTable) -> None:
    problem = FittingProblem(lines(campaign(Made(), table)), table)
    (explanation,) = problem.explain([Request(())])
    assert explanation is not None
    assert "line_noise_level" not in {one.code for one in fit_warnings(problem, explanation)}
    point = explanation.point
    loud = replace(point, covariance=point.covariance + np.array([0.0, np.log(3.0)]))
    noisy = replace(explanation, best=replace(explanation.best, point=loud))
    assert "line_noise_level" in {one.code for one in fit_warnings(problem, noisy)}
