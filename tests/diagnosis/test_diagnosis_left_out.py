"""A mechanism taken out of the catalogue is found as the law that it is: a constant, a gain of each sensor, a delay."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.html_report import body_of
from underskin.diagnosis.reporting.report import report
from underskin.errors import InvalidInput
from underskin.mechanisms.declared.saving import document
from underskin.prediction.adopted_model import adopted
from underskin.surrogate.sigma_table import SigmaTable

PLACES = Made(sensors=3, offsets_mm=(-0.9, 0.8), preloads_n=(0.2, 0.5, 1.0, 2.2, 5.0), lines=20, highest_hz=1000.0)


def without(mechanism: str, parameters: Sequence[float], table: SigmaTable) -> dict[str, Any]:
    """The report of a campaign that holds the mechanism, of a catalogue that does not."""
    made = campaign(replace(PLACES, mechanisms=(mechanism,), parameters=parameters), table)
    found = report(diagnose(made, table, without=[mechanism]))
    assert found["verdict"] == "unexplained"
    assert found["mechanisms"] == []
    held_out = found["unnamed"]["heldout_rmse_percent"]
    assert held_out["after"] < 1.3 * found["fit"]["noise_floor_percent"]
    return found


def holds(entry: Mapping[str, float], value: float) -> bool:
    return entry["low"] < value < entry["high"]


def test_a_thickness_that_is_off_everywhere(table: SigmaTable) -> None:
    found = without("thickness_error", [1.2], table)
    law = found["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("thickness", "preload_n", "linear")
    assert law["expression"] == f"h = h0·(1 + {law['parameters'][0]['value']:.3g})"
    assert holds(law["parameters"][0], 0.2)
    assert "changes the thickness, the same in all recordings: +" in found["statement"]


def test_a_place_that_is_off_everywhere_can_be_adopted(table: SigmaTable) -> None:
    found = without("misalignment", [0.5, -0.3], table)
    law = found["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("position", "x_mm", "linear")
    along_x, along_y = law["parameters"]
    assert holds(along_x, 0.5)
    assert holds(along_y, -0.3)
    with pytest.raises(InvalidInput, match="is a mechanism of the catalogue already"):
        document(found, "stage_off")
    made = campaign(replace(PLACES, mechanisms=("misalignment",), parameters=[0.5, -0.3]), table)
    assert adopted(found, made, table) is not None


def test_a_gain_of_each_sensor(table: SigmaTable) -> None:
    made = replace(PLACES, sensors=9, sensor_radius_mm=0.5, offsets_mm=(0.0,))
    spread = campaign(replace(made, mechanisms=("sensor_spread",), parameters=[0.25]), table)
    found = report(diagnose(spread, table, without=["sensor_spread"]))
    law = found["unnamed"]
    assert found["verdict"] == "unexplained"
    assert (law["acts_on"], law["axis"]) == ("gain", "sensor")
    assert [entry["at"] for entry in law["course"]] == [f"s{number}" for number in range(9)]
    assert all(entry["low"] < entry["change"] < entry["high"] for entry in law["course"])
    assert "s4" in body_of(found, {})


def test_a_delay_that_turns_the_phase_by_half_a_turn(table: SigmaTable) -> None:
    """So large that named mechanisms together follow it better than the tangent of any law."""
    law = without("timing_delay", [350.0], table)["unnamed"]
    assert (law["acts_on"], law["axis"], law["form"]) == ("frequency_response", "frequency_hz", "linear")


def test_what_a_named_mechanism_does_is_no_law(table: SigmaTable) -> None:
    made = campaign(replace(PLACES, mechanisms=("timing_delay",), parameters=[350.0]), table)
    found = report(diagnose(made, table))
    assert (found["verdict"], found["mechanisms"][0]["name"]) == ("explained", "timing_delay")
