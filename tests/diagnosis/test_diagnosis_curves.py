"""Diagnosis of curves, the rig's and real ones."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proof.real import recorded
from tests.diagnosis.rig_pads import pressed
from tests.support.cases import first
from tests.support.lean_reports import lean_report
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import load_table


def creeping_pad(seed: int) -> dict[str, Any]:
    """A soft pad that creeps and does nothing else, pressed by two spheres at two speeds, only the way in kept."""
    curves = {"largest_displacement_mm": 1.5, "speeds_mm_per_s": [0.1, 1], "samples": 150}
    campaign = pressed("creeping pad", seed, 8, curves, {"contact_creep": {"fraction": 0.3, "time_s": 4}})
    for recording in campaign["recordings"]:
        peak = int(np.argmax(recording["displacement_mm"])) + 1
        for column in ("displacement_mm", "force_n", "time_s"):
            recording[column] = recording[column][:peak]
    return campaign


@pytest.mark.slow
@pytest.mark.parametrize("seed", first(1, [2, 3]))
def test_creep_alone_is_named_where_only_the_way_in_is_kept(seed: int) -> None:
    """A fit with adhesion hangs at the kink where the sphere first touches; it must not win by that."""
    report = diagnosis_report(parse(creeping_pad(seed)), load_table())
    assert report["verdict"] == "explained"
    (mechanism,) = report["mechanisms"]
    assert mechanism["name"] == "contact_creep"
    values = {entry["name"]: entry["value"] for entry in mechanism["parameters"]}
    assert values["relaxed_fraction"] == pytest.approx(0.3, abs=0.03)


def pressed_pad(seed: int, bump: float) -> dict[str, Any]:
    """A pad with nothing missing, but for a bump of so many times the largest force in the middle of each way in."""
    curves = {"largest_displacement_mm": 0.6, "speeds_mm_per_s": [0.1], "samples": 200, "modulus_declared": False}
    campaign = pressed("pad", seed, 100, curves)
    for recording in campaign["recordings"]:
        displacement, force = np.array(recording["displacement_mm"]), np.array(recording["force_n"])
        recording["force_n"] = (force + bump * force.max() * np.exp(-(((displacement - 0.4) / 0.06) ** 2))).tolist()
    return campaign


@pytest.mark.slow
@pytest.mark.parametrize("bump", first(1, [0.01, 0.15]))
def test_a_bump_that_no_mechanism_describes_is_found_where_it_is(bump: float) -> None:
    document = pressed_pad(4, bump)
    largest = max(max(recording["force_n"]) for recording in document["recordings"])
    report = lean_report(parse(document), load_table(), "adhesion", "contact_creep")
    assert report["verdict"] == "unexplained"  # no all-clear over a remainder above the noise
    assert report["mechanisms"] == []
    law = report["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("force", "displacement_mm", "peak")
    values = {entry["name"]: entry["value"] for entry in law["parameters"]}
    assert values["centre"] == pytest.approx(0.4, abs=0.01)
    assert values["change"] == pytest.approx(bump * largest, rel=0.2)
    assert law["heldout_rmse_percent"]["after"] < 0.5 * law["heldout_rmse_percent"]["before"]
    assert report["fit"]["before"]["youngs_modulus"]["value"] == pytest.approx(0.5, rel=0.05)
    assert "adds to the force that is read with the depth" in report["statement"]
    assert "Hz" not in report["statement"]


@pytest.mark.slow
@pytest.mark.skipif("UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS names no folder")
@pytest.mark.parametrize("name", ["compression-EF10", "compression-EF50", "tension-RTV615"])
def test_silicone_stiffens_and_does_not_creep_where_nothing_tells_time(name: str) -> None:
    (entry,) = [entry for entry in recorded() if entry.name == name]
    report = diagnosis_report(parse(entry.make(Path(os.environ["UNDERSKIN_RECORDINGS"]))), load_table())
    assert report["verdict"] == "explained"
    assert [mechanism["name"] for mechanism in report["mechanisms"]] == ["strain_stiffening"]
    fit = report["fit"]
    assert fit["after"]["heldout_rmse_percent"] < fit["before"]["heldout_rmse_percent"]
