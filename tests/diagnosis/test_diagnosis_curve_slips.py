"""Curves with slips of units, reversed forces and copies, and curves that cannot be used: named before any law."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.rig_pads import pressed
from tests.support.cases import first
from tests.support.slip_campaigns import looked_at
from underskin.recordings.campaign import Campaign, CompressionRecording, SkinDescription, parse
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

Change = Callable[[CompressionRecording], CompressionRecording]
MODULUS_MPA = 0.5


def pad(name: str, seed: int) -> CompressionRecording:
    strain = np.concatenate([np.linspace(0, 0.1, 60), np.linspace(0.1, 0, 60)])
    stretch = 1 - strain
    force = MODULUS_MPA * 100 * np.pi * (stretch**-2 - stretch) / 3
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


def codes(report: dict[str, Any]) -> set[tuple[str, str, str]]:
    return {(entry["code"], entry["recording"], entry["field"]) for entry in report["findings"]}


def modulus(report: dict[str, Any]) -> dict[str, Any]:
    return dict(report["fit"]["before"]["youngs_modulus"])


ALL = ("c0", "c1", "c2", "c3")
ONE = [
    (times(1e3, "force_n"), ("units_off_by_1000", "c1", "force_n")),
    (times(1e-3, "displacement_mm"), ("units_off_by_1000", "c1", "displacement_mm")),
    (times(-1.0, "force_n"), ("sign_flipped", "c1", "force_n")),
    (times(0.0, "displacement_mm"), ("curve_not_usable", "c1", "displacement_mm")),
    (times(1e-3, "force_n"), ("units_off_by_1000", "c1", "force_n")),
    (times(1e3, "displacement_mm"), ("units_off_by_1000", "c1", "displacement_mm")),
]


@pytest.mark.parametrize(("change", "finding"), first(4, ONE))
def test_what_is_wrong_with_one_curve_is_named_and_invents_nothing(
    change: Change, finding: tuple[str, str, str], pads: Campaign, table: SigmaTable
) -> None:
    report = looked_at(changed(pads, change, "c1"), table, "strain_stiffening")
    assert codes(report) == {finding}
    assert report["verdict"] == "no_mismatch"
    assert modulus(report)["low"] < MODULUS_MPA < modulus(report)["high"]


def test_reversed_forces_of_all_are_put_right(pads: Campaign, table: SigmaTable) -> None:
    report = looked_at(changed(pads, times(-1.0, "force_n"), *ALL), table, "strain_stiffening")
    assert report["verdict"] == "no_mismatch"
    assert codes(report) == {("sign_flipped", ALL[0], "force_n")}
    assert "(3 more recordings like it)" in report["findings"][0]["statement"]


@pytest.mark.parametrize(("field", "factor"), [("displacement_mm", 1e3), ("force_n", 1e-3)])
def test_curves_off_nothing_concluded(field: str, factor: float, pads: Campaign, table: SigmaTable) -> None:
    """Where all curves are off nothing is concluded.

    Unless they are meant: but to be pressed through the sample nobody can mean.
    """
    wrong = changed(pads, times(factor, field), *ALL)
    report = looked_at(wrong, table)
    assert report["verdict"] == "insufficient_data"
    assert "units_off_by_1000" in {code for code, _, _ in codes(report)}
    meant = looked_at(replace(wrong, units_checked=True), table)
    assert (meant["verdict"] == "insufficient_data") == ((field, factor) == ("displacement_mm", 1e3))


def test_curves_far_from_the_declared_modulus_are_named(pads: Campaign, table: SigmaTable) -> None:
    skin = replace(pads.skin, youngs_modulus_mpa=1000 * MODULUS_MPA)
    report = looked_at(replace(pads, skin=skin), table)
    assert codes(report) == {("units_off_by_1000", "", "force_n")}
    assert report["verdict"] == "insufficient_data"


def test_of_two_curves_the_declared_modulus_tells_which_is_off(pads: Campaign, table: SigmaTable) -> None:
    wrong = changed(replace(pads, recordings=pads.recordings[:2]), times(1e3, "force_n"), "c1")
    report = looked_at(wrong, table)
    assert {code for code, _, _ in codes(report)} == {"units_off_by_1000"}
    assert report["verdict"] == "insufficient_data"
    declared = replace(wrong, skin=replace(pads.skin, youngs_modulus_mpa=1.2 * MODULUS_MPA))
    told = looked_at(declared, table, "modulus_error")
    assert {entry for entry in codes(told) if entry[0] == "units_off_by_1000"} == {
        ("units_off_by_1000", "c1", "force_n")
    }
    assert told["verdict"] != "insufficient_data"


def test_a_copy_of_a_curve_does_not_count(pads: Campaign, table: SigmaTable) -> None:
    whole = replace(pads, recordings=(*pads.recordings, replace(pads.recordings[0], id="copy")))
    report = looked_at(whole, table)
    assert codes(report) == {("duplicated_recording", "copy", "force_n")}
    assert report["fit"] == looked_at(pads, table)["fit"]


def loops(*lengths: int | None) -> Campaign:
    """Two whole loops of the rig on a pad, cut after so many samples."""
    usual = {"largest_displacement_mm": 0.5, "speeds_mm_per_s": [0.05], "samples": 240, "force_noise_n": 3e-4}
    document = pressed("loops", 5, 8, usual)
    for recording, length in zip(document["recordings"], lengths, strict=True):
        for column in ("displacement_mm", "force_n", "time_s"):
            recording[column] = recording[column][:length]
    return parse(document)


def test_a_curve_that_cannot_be_used_is_named_and_the_others_are_diagnosed(table: SigmaTable) -> None:
    report = looked_at(loops(None, 6), table, "layered_contact")
    (finding,) = [entry for entry in report["findings"] if entry["code"] == "curve_not_usable"]
    assert (finding["recording"], finding["field"]) == ("c02", "force_n")
    assert "at least 8 entries" in finding["statement"]
    assert report["verdict"] != "insufficient_data"


def test_where_no_curve_can_be_used_nothing_is_said_but_that(table: SigmaTable) -> None:
    report = looked_at(loops(4, 4), table)
    assert report["verdict"] == "insufficient_data"
    assert [entry["code"] for entry in report["findings"]] == ["curve_not_usable"] * 2
