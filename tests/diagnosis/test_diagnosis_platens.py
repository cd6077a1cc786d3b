"""Friction at the platens: cylinders of one shape cannot tell it from the modulus, whose interval then holds both."""

from typing import Any

import pytest

from rig.description import parse
from rig.elastomer import campaign_of_curves, record_curves
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import load_table

_TRUE_MPA = 12.0


def compressed(friction: float, heights_mm: list[float]) -> Any:
    """The report on cylinders of 4 mm diameter without a declared modulus."""
    curves = {
        "heights_mm": heights_mm, "diameters_mm": [4.0], "largest_displacement_mm": 0.25, "samples": 120, "repeats": 3,
        "force_noise_n": 0.05, "gain": 0.005, "modulus_declared": False,
    }  # fmt: skip
    skin = {"thickness_mm": 2.5, "youngs_modulus_mpa": _TRUE_MPA, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    document = {"schema": "experiment/1", "name": "cylinder", "seed": 4, "kind": "compression", "skin": skin}
    effects = {"platen_friction": {"friction": friction}} if friction else {}
    experiment = parse({**document, "curves": curves, "effects": effects})
    campaign, refused = from_dict(campaign_of_curves(experiment, record_curves(experiment)))
    assert not refused
    return diagnosis_report(campaign, load_table())


@pytest.mark.parametrize("friction", [0.0, 0.9])
def test_the_modulus_of_one_shape_holds_what_friction_may_hide(friction: float) -> None:
    modulus = compressed(friction, [2.5])["fit"]["before"]["youngs_modulus"]
    assert modulus["low"] < _TRUE_MPA < modulus["high"]
    assert modulus["high"] / modulus["low"] == pytest.approx(1.32, rel=0.05)  # 1 + 2 S² of a cylinder that sticks


@pytest.mark.slow
def test_two_shapes_tell_friction_and_modulus() -> None:
    report = compressed(0.9, [2.5, 8.0])
    assert [entry["name"] for entry in report["mechanisms"]] == ["platen_friction"]
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] < _TRUE_MPA < modulus["high"]
    assert modulus["high"] / modulus["low"] < 1.1
