"""A power law that is a known one with another exponent is said to be that."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.unlisted.campaign import as_json, draw
from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.unnamed_law import LeadingLaw
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unnamed.grammar import Grammar
from underskin.mechanisms.unnamed.laws import RecordingLaw
from underskin.recordings.campaign import FrfRecording, parse
from underskin.surrogate.sigma_table import load_table

SEED, HERTZ = 4242, 67  # of a campaign drawn with a contact radius that grows with F^0.067
DELAY = "c6h8e3rgx"  # of an independent rig: a phase that grows with the square of frequency


@pytest.mark.slow
def test_a_contact_that_grows_with_another_power_of_the_force_is_hertz_s_with_another_exponent() -> None:
    drawn = draw(np.random.default_rng([SEED, HERTZ]), "hertz")
    assert "F^0.067 instead of F^(1/3)" in drawn.truth["law"]["expression"]
    report = diagnosis_report(parse(as_json(drawn)), load_table())
    (change,) = report["unnamed"]["parameters"]
    assert change["low"] < 0.067 - 1 / 3 < change["high"]
    said = f"the contact radius grows with the preload to the power {1 / 3 + change['value']:.2f} ("
    assert f"this is Hertz's law with another exponent: {said}" in report["statement"]
    assert "in place of 1/3" in report["statement"]


@pytest.mark.slow
@pytest.mark.skipif("UNDERSKIN_CAMPAIGNS" not in os.environ, reason="UNDERSKIN_CAMPAIGNS names no folder")
def test_a_delay_that_disperses_is_a_delay_with_another_exponent() -> None:
    file = Path(os.environ["UNDERSKIN_CAMPAIGNS"]) / "unlisted-open" / f"{DELAY}.json"
    report = diagnosis_report(parse(json.loads(file.read_text(encoding="utf-8"))), load_table())
    assert "this is a delay with another exponent: its phase grows with frequency to the power" in report["statement"]
    exponent = next(entry for entry in report["unnamed"]["parameters"] if entry["name"] == "exponent")
    assert exponent["value"] == pytest.approx(2.0, abs=0.05)


def test_a_constant_phase_beside_weak_sensors_is_told_apart_from_them() -> None:
    """Two sensors of six that lost a fifth and two fifths, and all FRFs turned by the same angle."""
    made = campaign(Made(sensors=6, gain=0.01, line=0.005, highest_hz=800.0), load_table())
    kept = {"s2": 0.8, "s4": 0.6}
    turned = []
    for entry in made.recordings:
        assert isinstance(entry, FrfRecording)
        assert entry.frf_re_pc_per_n is not None
        assert entry.frf_im_pc_per_n is not None
        frf = (entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n) * kept.get(entry.sensor, 1.0)
        frf = frf * np.exp(-1j * np.radians(1.2))
        turned.append(replace(entry, frf_re_pc_per_n=frf.real, frf_im_pc_per_n=frf.imag))
    report = diagnosis_report(replace(made, recordings=tuple(turned)), load_table())
    statement = report["statement"]
    assert "What is missing beside sensor spread turns the frequency response by the same angle at all" in statement
    assert "the phase by -1.2" in statement
    assert "with it and sensor spread, recordings held out are predicted to" in statement
    assert "the reference phase of a lock-in amplifier" in statement
    assert report["location"]["region"]["sensor"] == ["s4"]
    assert "it is largest at sensor s4, where the response is 4" in report["location"]["statement"]


def test_a_law_over_many_sensors_is_largest_at_one_of_them() -> None:
    """Between two sensors there is nothing: 41 places along 45 of them missed the one that changed."""
    table = load_table()
    made = campaign(Made(sensors=45, preloads_n=(0.5, 1.0), spheres_mm=(4.0,), lines=2, gain=0.01), table)
    problem = FittingProblem(lines(made), table)
    grammar = Grammar.of(
        problem.collapsed.campaign, problem.lines.frequency, table, tuple(CATALOGUE.values()), CATALOGUE
    )
    laws = [
        law for law in grammar.laws if law.spoken.acts_on == "thickness" and law.name.endswith("__sensor__step__s23")
    ]
    (law,) = laws
    assert isinstance(law, RecordingLaw)
    problem.lines.mechanisms.add(law)
    (found,) = problem.explain([Request((law.name,), kept=True)])
    assert found is not None
    leading = LeadingLaw.of(problem, found)
    assert leading is not None
    at, size, deviation = leading.largest()
    assert law.axis.words[round(at)] == "s23"
    assert size != 0
    assert deviation > 0
