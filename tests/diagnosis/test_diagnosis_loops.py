"""Diagnosis of the rig's whole loops of indentation, that relax, stick and jump; curves that cannot be used."""

from typing import Any

import numpy as np
import pytest

from tests.diagnosis.rig_pads import pressed
from tests.support.lean_reports import lean_report
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import parse
from underskin.recordings.curve_jumps import jumps
from underskin.surrogate.sigma_table import load_table


def loops(effects: dict[str, dict[str, float]], seed: int = 5, **curves: Any) -> dict[str, Any]:
    usual = {"largest_displacement_mm": 0.5, "speeds_mm_per_s": [0.05], "samples": 240, "force_noise_n": 3e-4}
    return pressed("loops", seed, 8, usual | curves, effects)


def standard_errors(report: dict[str, Any], name: str, truth: float) -> float:
    """How far the truth lies from the value, in standard errors of the stated 95 % interval."""
    (found,) = [entry for found in report["mechanisms"] for entry in found["parameters"] if entry["name"] == name]
    return float(abs(truth - found["value"]) / (found["high"] - found["low"]) * 2 * 1.96)


@pytest.mark.slow
def test_a_loop_with_a_hold_gives_creep_and_no_more() -> None:
    made = parse(loops({"contact_creep": {"fraction": 0.3, "time_s": 8}}, hold_s=10))
    report = lean_report(made, load_table(), "adhesion", "compressible_layer")
    assert report["verdict"] == "explained"
    assert [entry["name"] for entry in report["mechanisms"]] == ["contact_creep"]
    assert standard_errors(report, "relaxed_fraction", 0.3) < 3
    assert standard_errors(report, "relaxation_time", 8) < 3


@pytest.mark.slow
def test_a_loop_that_snaps_and_tears_off_gives_the_work_of_adhesion() -> None:
    made = parse(loops({"adhesion": {"work_j_per_m2": 0.3}}))
    report = lean_report(made, load_table(), "contact_creep", "compressible_layer")
    assert "adhesion" in [entry["name"] for entry in report["mechanisms"]]
    assert standard_errors(report, "work_of_adhesion", 0.3) < 3


@pytest.mark.slow
def test_a_curve_that_cannot_be_used_is_named_and_the_others_are_diagnosed() -> None:
    campaign = loops({"contact_creep": {"fraction": 0.3, "time_s": 8}})
    short = campaign["recordings"][1]
    for column in ("displacement_mm", "force_n", "time_s"):
        short[column] = short[column][:6]
    report = lean_report(parse(campaign), load_table(), "adhesion", "compressible_layer")
    (finding,) = [entry for entry in report["findings"] if entry["code"] != "imitated"]
    assert (finding["code"], finding["recording"], finding["field"]) == ("curve_not_usable", short["id"], "force_n")
    assert "at least 8 entries" in finding["statement"]
    assert [entry["name"] for entry in report["mechanisms"]] == ["contact_creep"]


def test_where_no_curve_can_be_used_nothing_is_said_but_that() -> None:
    campaign = loops({})
    for recording in campaign["recordings"]:
        for column in ("displacement_mm", "force_n", "time_s"):
            recording[column] = recording[column][:4]
    report = diagnosis_report(parse(campaign), load_table())
    assert report["verdict"] == "insufficient_data"
    assert [entry["code"] for entry in report["findings"]] == ["curve_not_usable"] * 2


@pytest.mark.parametrize("place", [3, 40, 101, 196])
def test_a_jump_is_found_where_it_is(place: int) -> None:
    along = np.linspace(0, 1, 200)
    noise = 0.01 * np.random.default_rng(place).normal(size=200)
    found = jumps(along**1.5 + noise - 0.15 * (np.arange(200) >= place), 0.01, 5)
    assert place in found
    assert len(found) < 8


def test_a_smooth_curve_does_not_jump() -> None:
    along = np.concatenate([np.zeros(50), np.linspace(0, 1, 150)])
    assert len(jumps(along**1.5, 0.01, 5)) == 0
    assert len(jumps(np.arange(200.0) % 7, 0.01, 1)) == 0  # nothing is averaged
