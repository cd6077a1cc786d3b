"""Laws that nobody listed: found with the right place, axis and form, predicted, adopted, and not seen elsewhere."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.pipeline import diagnose, diagnosis_report
from underskin.diagnosis.reporting.hints import HINTS
from underskin.diagnosis.reporting.html_report import body_of
from underskin.diagnosis.reporting.report import report
from underskin.diagnosis.reporting.unnamed_law import LeadingLaw
from underskin.errors import InvalidInput
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unnamed.expressions import expression
from underskin.mechanisms.unnamed.grammar import Grammar
from underskin.mechanisms.unnamed.vocabulary import ACTS_ON, Form
from underskin.prediction.adopted_model import adopted, not_adopted
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.conditions import frf_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats


def changed(made: Campaign, factor: Callable[[FrfRecording, int, Floats], Complexes | complex]) -> Campaign:
    """Each recording's lines times a factor that its conditions, its number and its lines give."""
    entries = []
    for number, entry in enumerate(made.recordings):
        assert isinstance(entry, FrfRecording)
        assert entry.frequency_hz is not None
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        times = factor(entry, number, entry.frequency_hz)
        value = (entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n) * times
        entries.append(replace(entry, frf_re_pc_per_n=value.real, frf_im_pc_per_n=value.imag))
    return replace(made, recordings=tuple(entries))


def noted(made: Campaign, column: Callable[[int], dict[str, float | str]]) -> Campaign:
    entries = [replace(entry, conditions=column(number)) for number, entry in enumerate(made.recordings)]
    return replace(made, recordings=tuple(entries))


@pytest.fixture(scope="module")
def quiet(table: SigmaTable) -> Campaign:
    return campaign(Made(sensors=3, offsets_mm=(0.0, 0.8), lines=20, highest_hz=1000.0), table)


@pytest.fixture(scope="module")
def warming(quiet: Campaign) -> Campaign:
    """A gain that follows a temperature which comes and goes in no order."""
    temperature = np.random.default_rng(4).uniform(18.0, 28.0, len(quiet.recordings))
    warm = changed(quiet, lambda _, number, __: 1 + 0.03 * (temperature[number] - 18.0))
    return noted(warm, lambda number: {"temperature_c": float(temperature[number])})


@pytest.fixture(scope="module")
def warming_report(warming: Campaign, table: SigmaTable) -> dict[str, Any]:
    return diagnosis_report(warming, table)


def test_a_column_that_the_lab_added_is_what_the_gain_follows(warming_report: dict[str, Any]) -> None:
    law = warming_report["unnamed"]
    assert warming_report["verdict"] == "unexplained"
    assert warming_report["mechanisms"] == []
    assert (law["acts_on"], law["axis"], law["form"]) == ("gain", "temperature_c", "linear")
    (change,) = law["parameters"]
    low, high = law["range"]["temperature_c"]
    assert change["low"] < 0.03 * (high - low) < change["high"]
    held_out, fit = law["heldout_rmse_percent"], warming_report["fit"]
    assert held_out == {name: fit[name]["heldout_rmse_percent"] for name in ("before", "after")}
    assert held_out["after"] < 1.5 * fit["noise_floor_percent"] < held_out["before"]
    assert 0.5 < law["probability"] <= 1.0


def test_the_statement_says_what_changes_with_what_and_what_it_is_worth(warming_report: dict[str, Any]) -> None:
    statement = warming_report["statement"]
    assert statement.startswith("No known mechanism describes this")
    assert "changes the gain with temperature_c: +" in statement
    assert "recordings held out are predicted to" in statement


def test_the_plan_is_to_compare_the_ends_between_which_the_law_changes_the_charge_most(
    warming: Campaign, warming_report: dict[str, Any]
) -> None:
    planned = warming_report["next_experiment"]
    cold, warm = planned["recordings"]
    noted_c = [float(entry.conditions["temperature_c"]) for entry in frf_of(warming) if entry.conditions]
    assert (cold["temperature_c"], warm["temperature_c"]) == pytest.approx((min(noted_c), max(noted_c)), abs=0.01)
    assert {name: value for name, value in cold.items() if name != "temperature_c"} == {
        name: value for name, value in warm.items() if name != "temperature_c"
    }
    assert planned["separates"] == [[], ["unnamed"]]
    # 3 % a degree over some 9 degrees, and scatters of 2 %: one recording at each end is enough
    assert (cold["repeats"], planned["minutes"]) == (1, 10.0)
    assert planned["probability_of_deciding"] > 0.99
    told = re.search(r"the charge differs by (\d+) %", planned["statement"])
    assert told
    assert 22 <= int(told[1]) <= 32
    shown = body_of(warming_report, {})
    assert "temperature_c" in shown
    assert "Expected probability that they decide" in shown


def test_what_followed_the_order_is_confirmed_by_repeating_recordings_of_both_ends(
    quiet: Campaign, table: SigmaTable
) -> None:
    broken = changed(quiet, lambda _, number, __: 1.15 if number >= 30 else 1.0)
    found = diagnosis_report(broken, table)
    assert found["unnamed"]["axis"] in ("order", "recorded_at")
    planned = found["next_experiment"]
    assert re.match(r"Repeating \S+ and \S+ after one another", planned["statement"])
    assert {"order", "recorded_at"}.isdisjoint(planned["recordings"][0])


def test_the_same_recordings_give_the_same_report(
    warming: Campaign, warming_report: dict[str, Any], table: SigmaTable
) -> None:
    assert json.dumps(diagnosis_report(warming, table)) == json.dumps(warming_report)


def test_a_resonance_of_the_frame_is_a_peak_over_frequency(quiet: Campaign, table: SigmaTable) -> None:
    def frame(_: FrfRecording, __: int, frequency: Floats) -> Complexes:
        u = frequency / 150.0
        return np.asarray(1 + 0.1 * u**2 / (1 - u**2 + 0.1j * u))

    law = diagnosis_report(changed(quiet, frame), table)["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("frequency_response", "frequency_hz", "peak")
    values = {entry["name"]: entry for entry in law["parameters"]}
    assert values["centre"]["low"] < 150.0 < values["centre"]["high"]
    assert values["damping"]["value"] == pytest.approx(0.05, rel=0.2)


def test_a_loss_that_follows_the_amplitude_is_a_lag(table: SigmaTable) -> None:
    made = campaign(Made(sensors=3, dynamic_forces_n=(0.03, 0.06, 0.12), lines=16), table)
    lossy = changed(made, lambda entry, _, __: complex(np.exp(-2j * entry.dynamic_force_n)))
    law = diagnosis_report(lossy, table)["unnamed"]
    assert (law["acts_on"], law["axis"]) == ("frequency_response", "dynamic_force_n")
    assert law["form"] in ("power", "linear")


def test_what_is_taken_out_of_the_catalogue_is_found_as_a_law(table: SigmaTable) -> None:
    made = campaign(Made(("ageing",), (0.5, 300.0, 0.0), sensors=3, repeats=2), table)
    named = diagnosis_report(made, table)
    assert named["verdict"] == "explained"
    assert named["unnamed"] is None
    document = report(diagnose(made, table, without=["ageing"]))
    assert document["verdict"] == "unexplained"
    assert document["unnamed"]["acts_on"] == "gain"
    assert document["unnamed"]["axis"] in ("load_cycles", "order", "recorded_at")  # one and the same here
    assert document["provenance"]["without"] == ["ageing"]
    held_out = document["unnamed"]["heldout_rmse_percent"]
    assert held_out["after"] < 1.5 * document["fit"]["noise_floor_percent"]
    with pytest.raises(InvalidInput, match="without"):
        diagnose(made, table, without=["gravity"])


def test_nothing_is_found_where_nothing_is_missing(quiet: Campaign, table: SigmaTable) -> None:
    """Nor in twenty columns of chance."""
    random = np.random.default_rng(7)
    columns = noted(quiet, lambda _: {f"column_{place}": float(x) for place, x in enumerate(random.normal(size=20))})
    for recordings in (quiet, columns):
        document = diagnosis_report(recordings, table)
        assert document["verdict"] == "no_mismatch"
        assert document["unnamed"] is None


def test_a_law_is_adopted_within_its_range(
    warming: Campaign, warming_report: dict[str, Any], quiet: Campaign, table: SigmaTable
) -> None:
    model = adopted(warming_report, warming, table)
    plain = replace(model, law=None, of_law={})
    ratio = model.response(warming, table).value / plain.response(warming, table).value
    low = warming_report["unnamed"]["range"]["temperature_c"][0]
    for number, entry in enumerate(frf_of(warming)):
        assert entry.conditions is not None
        expected = 1 + 0.03 * (float(entry.conditions["temperature_c"]) - low)
        assert ratio[model.response(warming, table).recording == number] == pytest.approx(expected, rel=0.03)
    hotter = noted(quiet, lambda number: {"temperature_c": 20.0 if number else 60.0})
    inside = model.response(hotter, table)
    assert not inside.inside[inside.recording == 0].any()
    assert inside.inside[inside.recording > 0].all()
    assert not model.response(quiet, table).inside.any()  # which says nothing of its temperature


def test_an_order_cannot_be_adopted(warming_report: dict[str, Any]) -> None:
    assert not_adopted(warming_report) is None
    of_order = {**warming_report, "unnamed": {**warming_report["unnamed"], "axis": "order"}}
    assert not_adopted(of_order) is not None


def test_points_of_several_models_that_press_alike_contacts_keep_their_order(
    quiet: Campaign, table: SigmaTable
) -> None:
    """A model with a material of its own between two without one."""
    problem = FittingProblem(lines(quiet), table)
    names = [("misalignment",), ("strain_stiffening",), ("preload_dependent_d33",)]
    (nothing,) = problem.explain([Request(())])
    together = problem.explain([Request(()), *map(Request, names)])
    for own, explanation in zip(names, together[1:], strict=True):
        (alone,) = problem.explain([Request(own)])
        assert explanation is not None
        assert alone is not None
        assert explanation.log_evidence == pytest.approx(alone.log_evidence, abs=1e-3)
        assert explanation.best.at.cost[0] == pytest.approx(explanation.best.cost, abs=1e-6)
    assert nothing is not None


def test_the_hints_are_those_of_the_page() -> None:
    page = Path("docs/unnamed.md").read_text(encoding="utf-8")
    for (acts_on, axis), hint in HINTS.items():
        place = f"`{axis}`" if axis else "any other"
        assert f"| `{acts_on}` | {place} | {hint} |" in page


def test_shares_are_those_among_laws_and_a_course_of_no_form_that_is_more_probable_is_said(table: SigmaTable) -> None:
    made = campaign(Made(sensors=3, offsets_mm=(0.0, 0.8), lines=20, highest_hz=1000.0, repeats=2, gain=0.005), table)
    apart = np.abs(np.subtract.outer(*[np.arange(len(made.recordings))] * 2)) * np.sqrt(3) / 10
    matern = (1 + apart) * np.exp(-apart) + 1e-9 * np.eye(len(apart))
    wandering = np.exp(0.08 * np.linalg.cholesky(matern) @ np.random.default_rng(1).normal(size=len(apart)))
    found = diagnosis_report(changed(made, lambda _, number, __: complex(wandering[number])), table)
    assert found["verdict"] == "unexplained"
    law = found["unnamed"]
    shares = [law["probability"], *(entry["probability"] for entry in law["rivals"])]
    assert 0.9 < sum(shares) <= 1.01
    assert law["probability"] == max(shares)
    assert "more probable still is a course of no listed form" in found["statement"]


def test_a_high_pass_of_another_order_is_said_to_be_one(quiet: Campaign, table: SigmaTable) -> None:
    document = diagnosis_report(
        changed(quiet, lambda _, __, hz: np.asarray((1 / (1 - 2j / hz)) ** 0.4, complex)), table
    )
    law = document["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("frequency_response", "frequency_hz", "threshold")
    order = next(entry for entry in law["parameters"] if entry["name"] == "exponent")
    assert order["low"] < 0.4 < order["high"]
    assert f"this is a high pass of order {order['value']:.2f} (" in document["statement"]
    assert "Hz/(i·f))^(-" in law["expression"]


def test_what_the_lab_declared_is_recognised_by_name(
    warming: Campaign, table: SigmaTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("UNDERSKIN_MECHANISMS", "examples/mechanisms")
    CATALOGUE.reload()
    try:
        document = diagnosis_report(warming, table)
    finally:
        CATALOGUE.reload()
    assert document["verdict"] == "explained"
    (mechanism,) = document["mechanisms"]
    assert mechanism["name"] == "warm_film"
    assert mechanism["parameters"][0]["unit"] == "1/°C"
    assert document["provenance"]["mechanisms"]["warm_film"].startswith("warm_film.yaml ")


def test_every_law_of_the_grammar_can_be_put_into_words(warming: Campaign, table: SigmaTable) -> None:
    """Of a place, of a lag and over frequency too, whose parameters have other names than a factor's."""
    problem = FittingProblem(lines(warming), table)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    frequency = problem.lines.frequency
    grammar = Grammar.of(problem.collapsed.campaign, frequency, table, tuple(CATALOGUE.values()), CATALOGUE)
    for law in grammar.laws:
        values = {entry.name: entry.from_fit(entry.quantile(0.7)) for entry in law.parameters_bound}
        assert LeadingLaw(law, values, nothing).form in get_args(Form), law.name
        assert expression(law, values), law.name
    assert {law.spoken.acts_on for law in grammar.laws} == set(ACTS_ON)
