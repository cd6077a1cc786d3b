"""A d33 is to be quoted only where no wrong declared number that the recordings would not show moves it."""

from typing import Any

import pytest

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import SigmaTable

D33 = 14.0
CENTRED, BESIDE = [[0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]


def report(offsets_mm: list[list[float]], factor: float, table: SigmaTable, spheres: tuple[float, ...]) -> Any:
    """Of a skin whose thickness is `factor` times what is declared, pressed at these places beside its sensors."""
    described: dict[str, Any] = {
        "schema": "experiment/1",
        "name": "declared",
        "seed": 7,
        "skin": {
            "thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "d33_pc_per_n": D33,
            "array": {"columns": 2, "rows": 2, "pitch_mm": 4.0}, "width_mm": 20.0, "length_mm": 40.0,
        },
        "design": {
            "indenters_mm": list(spheres), "preloads_n": [0.5, 1.0, 2.0, 3.0], "dynamic_forces_n": [0.09],
            "offsets_mm": offsets_mm, "start": "2017-05-03T09:00:00Z",
        },
        "lines": {"low_hz": 10.0, "high_hz": 130.0, "count": 20},
        "noise": {"gain": 0.01, "line": 0.01},
        "effects": {"thickness_error": {"factor": factor}} if factor != 1.0 else {},
    }  # fmt: skip
    return diagnosis_report(parse(campaign_of_lines(record_lines(experiment(described)))), table)


def test_a_thickness_that_centred_presses_do_not_show_keeps_d33_from_being_quoted(table: SigmaTable) -> None:
    """Told 15 % too thin, the skin answers like another d33."""
    found = report(CENTRED, 1.15, table, (4.0,))
    assert found["verdict"] == "no_mismatch"
    assert not found["d33"]["low"] < D33 < found["d33"]["high"]
    assert not found["d33"]["quotable"]
    assert "d33 is not to be quoted" in found["statement"]
    assert "thickness error by " in found["statement"]
    (entry,) = [one for one in found["not_identifiable"] if one["mechanism"] == "thickness_error"]
    assert "d33 would then be " in entry["reason"]


@pytest.mark.parametrize("factor", [1.0, 1.15])
def test_presses_beside_the_sensors_tell_the_thickness_and_d33(factor: float, table: SigmaTable) -> None:
    found = report(BESIDE, factor, table, (4.0, 10.0))
    assert [entry["name"] for entry in found["mechanisms"]] == (["thickness_error"] if factor != 1.0 else [])
    assert found["d33"]["low"] < D33 < found["d33"]["high"]
    assert found["d33"]["quotable"]


def test_physics_that_would_not_show_stands_beside_the_value_to_quote(table: SigmaTable) -> None:
    """A glue line that slips changes d33 alone; presses 1 mm beside the sensor tell the thickness, but not that."""
    found = report([[0.0, 0.0], [1.0, 0.0]], 1.0, table, (4.0,))
    assert found["d33"]["quotable"]
    (entry,) = [one for one in found["not_identifiable"] if one["mechanism"] == "interface_slip"]
    percent = entry["reason"].partition("d33 would then be ")[2].partition(" too large")[0]
    assert float(percent.removesuffix(" %")) > 100 * (found["d33"]["high"] / found["d33"]["value"] - 1)
    assert f"provided that no interface slip ({percent}) hides" in found["statement"]
