"""Curves with slips of units, reversed forces and copies: named, put right or left out, before any law is tried."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.pressed_curves import pressed
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.fit_warnings import fit_warnings
from underskin.diagnosis.screening.curve_unit_errors import without_inconsistent
from underskin.recordings.campaign import Campaign, CompressionRecording
from underskin.recordings.conditions import SkinDescription
from underskin.surrogate.sigma_table import SigmaTable, load_table

Change = Callable[[CompressionRecording], CompressionRecording]
MODULUS_MPA = 0.5


def pad(name: str, seed: int) -> CompressionRecording:
    strain = np.concatenate([np.linspace(0, 0.1, 60), np.linspace(0.1, 0, 60)])
    force = MODULUS_MPA * 100 * np.pi * strain
    force = force + 2e-3 * force.max() * np.random.default_rng(seed).normal(size=len(force))
    return CompressionRecording(
        id=name, sample_height_mm=10.0, sample_diameter_mm=20.0, displacement_mm=10 * strain, force_n=force
    )


@pytest.fixture
def pads() -> Campaign:
    recordings = tuple(pad(f"c{number}", number) for number in range(4))
    return Campaign("pads", SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=None), recordings)


def times(factor: float, field: str) -> Change:
    return lambda entry: replace(entry, **{field: factor * getattr(entry, field)})


def changed(pads: Campaign, change: Change, *names: str) -> Campaign:
    entries = [entry for entry in pads.recordings if isinstance(entry, CompressionRecording)]
    return replace(pads, recordings=tuple(change(entry) if entry.id in names else entry for entry in entries))


def codes(found: Any) -> set[tuple[str, str, str]]:
    return {(entry.code, entry.recording, entry.field) for entry in found}


ALL = ("c0", "c1", "c2", "c3")
ONE = [
    (times(1e3, "force_n"), ("units_off_by_1000", "c1", "force_n"), 3),
    (times(1e-3, "force_n"), ("units_off_by_1000", "c1", "force_n"), 3),
    (times(1e3, "displacement_mm"), ("units_off_by_1000", "c1", "displacement_mm"), 3),
    (times(1e-3, "displacement_mm"), ("units_off_by_1000", "c1", "displacement_mm"), 3),
    (times(-1.0, "force_n"), ("sign_flipped", "c1", "force_n"), 4),
]


@pytest.mark.parametrize(("change", "finding", "left"), ONE)
def test_what_is_wrong_with_one_curve_is_named(
    change: Change, finding: tuple[str, str, str], left: int, pads: Campaign
) -> None:
    found = without_inconsistent(changed(pads, change, "c1"), "compression")
    assert codes(found.findings) == {finding}
    assert len(found.campaign.recordings) == left
    assert found.lacking is None


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("field", ["force_n", "displacement_mm"])
def test_where_all_curves_are_off_nothing_is_concluded(factor: float, field: str, pads: Campaign) -> None:
    wrong = changed(pads, times(factor, field), *ALL)
    report = diagnosis_report(wrong, load_table())
    assert report["verdict"] == "insufficient_data"
    assert "units_off_by_1000" in {entry["code"] for entry in report["findings"]}
    if (field, factor) != ("displacement_mm", 1e3):  # pressed through the sample: nobody can mean that
        meant = without_inconsistent(replace(wrong, units_checked=True), "compression")
        assert (meant.lacking, codes(meant.findings)) == (None, set())


def test_curves_far_from_the_declared_modulus_are_named(pads: Campaign) -> None:
    skin = replace(pads.skin, youngs_modulus_mpa=1000 * MODULUS_MPA)
    found = without_inconsistent(replace(pads, skin=skin), "compression")
    assert codes(found.findings) == {("units_off_by_1000", "", "force_n")}
    assert found.lacking


@pytest.mark.parametrize("change", [change for change, (code, *_), _ in ONE if code == "units_off_by_1000"])
def test_of_two_curves_the_declared_modulus_tells_which_is_off(change: Change, pads: Campaign) -> None:
    two = replace(pads, recordings=pads.recordings[:2])
    wrong = changed(two, change, "c1")
    found = without_inconsistent(wrong, "compression")
    assert {entry.code for entry in found.findings} == {"units_off_by_1000"}
    by_reach = {entry.id for entry in found.campaign.recordings} == {"c0"}  # pressed through its own height
    assert by_reach or found.lacking
    declared = replace(wrong, skin=replace(pads.skin, youngs_modulus_mpa=1.2 * MODULUS_MPA))
    told = without_inconsistent(declared, "compression")
    assert {(entry.code, entry.recording) for entry in told.findings} == {("units_off_by_1000", "c1")}
    assert (told.lacking, [entry.id for entry in told.campaign.recordings]) == (None, ["c0"])
    assert without_inconsistent(two, "compression").findings == []


@pytest.mark.slow
def test_reversed_forces_are_put_right_and_invent_nothing(pads: Campaign) -> None:
    for names in (ALL, ("c2",)):
        report = diagnosis_report(changed(pads, times(-1.0, "force_n"), *names), load_table())
        assert report["verdict"] == "no_mismatch"
        assert {entry["recording"] for entry in report["findings"]} == set(names)


def test_a_curve_that_does_not_move_is_left_out(pads: Campaign) -> None:
    report = diagnosis_report(changed(pads, times(0.0, "displacement_mm"), "c1"), load_table())
    assert report["verdict"] == "no_mismatch"
    assert [(entry["code"], entry["recording"], entry["field"]) for entry in report["findings"]] == [
        ("curve_not_usable", "c1", "displacement_mm")
    ]


def test_a_copy_of_a_curve_is_left_out(pads: Campaign) -> None:
    whole = replace(pads, recordings=(*pads.recordings, replace(pads.recordings[0], id="copy")))
    found = without_inconsistent(whole, "compression")
    assert codes(found.findings) == {("duplicated_recording", "copy", "force_n")}
    assert len(found.campaign.recordings) == len(pads.recordings)
    assert without_inconsistent(pads, "compression").findings == []


@pytest.mark.parametrize(("thickness_mm", "said"), [(None, ["thickness_unknown"]), (80.0, [])])
def test_a_layer_that_could_not_be_tried_is_said(
    thickness_mm: float | None, said: list[str], table: SigmaTable
) -> None:
    campaign = pressed(1e6, (4.0,))
    campaign = replace(campaign, skin=replace(campaign.skin, thickness_mm=thickness_mm))
    problem = FittingProblem(curve_lines(campaign, "indentation"), table)
    (null,) = problem.explain([Request(())])
    assert null is not None
    (found,) = problem.explain([Request(("strain_stiffening",), begin=null.point)])
    assert found is not None
    assert [entry.code.value for entry in fit_warnings(problem, found) if entry.field == "thickness_mm"] == said
    assert [entry for entry in fit_warnings(problem, null) if entry.field == "thickness_mm"] == []
