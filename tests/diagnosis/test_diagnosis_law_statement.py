"""A power law that is a known one with another exponent is said to be that."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from rig.unlisted.campaign import as_json, draw
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import parse
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
