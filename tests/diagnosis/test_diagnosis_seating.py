"""A tilted platen's toe is no stiffening, and stiffening is no toe."""

from typing import Any

import pytest

from rig.description import parse
from rig.elastomer import campaign_of_curves, record_curves
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import load_table


def pressed(seed: int, **effects: Any) -> Any:
    """The report of six curves of a pad, 10 % deep, without a declared modulus."""
    curves = {
        "heights_mm": [10.0], "diameters_mm": [20.0], "largest_displacement_mm": 1.0, "samples": 120, "repeats": 6,
        "force_noise_n": 0.1, "contact_point_mm": 0.03, "modulus_declared": False,
    }  # fmt: skip
    skin = {"thickness_mm": 10.0, "youngs_modulus_mpa": 0.5, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    document = {"schema": "experiment/1", "name": "pad", "seed": seed, "kind": "compression", "skin": skin}
    experiment = parse({**document, "curves": curves, "effects": effects})
    campaign, refused = from_dict(campaign_of_curves(experiment, record_curves(experiment)))
    assert not refused
    return diagnosis_report(campaign, load_table())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_seating_platen_is_named_and_no_stiffening(seed: int) -> None:
    report = pressed(seed, tilted_platen={"wedge_mm": 0.06})
    assert report["verdict"] == "no_mismatch"
    assert ("seating", "displacement_mm") in {(entry["code"], entry["field"]) for entry in report["findings"]}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_stiffening_stays(seed: int) -> None:
    report = pressed(seed, strain_stiffening={"coefficient": 2.0})
    assert (report["verdict"], [entry["name"] for entry in report["mechanisms"]]) == (
        "explained",
        ["strain_stiffening"],
    )
    assert "seating" not in {entry["code"] for entry in report["findings"]}
