"""Diagnosis of the rig's indentation curves."""

from typing import Any

import numpy as np
import pytest

from rig.elastomer import campaign_of_curves, record_curves
from rig.experiment import parse as experiment
from underskin.diagnosis.diagnose import diagnosis_report
from underskin.recordings.campaign import parse
from underskin.surrogate import load_table


def creeping_pad(seed: int) -> dict[str, Any]:
    """A soft pad that creeps and does nothing else, pressed by two spheres at two speeds, only the way in kept."""
    described = experiment(
        {
            "schema": "experiment/1",
            "name": "creeping pad",
            "seed": seed,
            "kind": "indentation",
            "skin": {"thickness_mm": 8, "youngs_modulus_mpa": 0.5, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14},
            "curves": {
                "indenters_mm": [2.5, 5],
                "largest_displacement_mm": 1.5,
                "speeds_mm_per_s": [0.1, 1],
                "samples": 150,
            },
            "effects": {"contact_creep": {"fraction": 0.3, "time_s": 4}},
        }
    )
    campaign = campaign_of_curves(described, record_curves(described))
    for recording in campaign["recordings"]:
        peak = int(np.argmax(recording["displacement_mm"])) + 1
        for column in ("displacement_mm", "force_n", "time_s"):
            recording[column] = recording[column][:peak]
    return campaign


@pytest.mark.parametrize("seed", [2, 3])
def test_creep_alone_is_named_where_only_the_way_in_is_kept(seed: int) -> None:
    """A fit with adhesion hangs at the kink where the sphere first touches; it must not win by that."""
    report = diagnosis_report(parse(creeping_pad(seed)), load_table())
    assert report["verdict"] == "explained"
    (mechanism,) = report["mechanisms"]
    assert mechanism["name"] == "contact_creep"
    values = {entry["name"]: entry["value"] for entry in mechanism["parameters"]}
    assert values["relaxed_fraction"] == pytest.approx(0.3, abs=0.03)
