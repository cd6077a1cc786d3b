"""The part of the proof on slips: each is committed where it shows, judged and counted."""

from typing import Any

import numpy as np
import pytest

from proof.slip_kinds import SLIPS, Case, cables
from proof.slip_rivals import conjugated_residual, over_one_sign
from proof.slips import judged_campaign
from rig.draw import drawn, record
from rig.recorded import RecordedLines, campaign
from underskin.recordings.campaign import frf_recordings, from_dict


def recorded(effect: str, **values: Any) -> RecordedLines:
    """A campaign of the rig that hides one effect of given strength."""
    description = drawn(900811, 3, "none")
    description["lines"] |= {"high_hz": 1000.0, "count": 40}
    description["effects"] = {effect: values}
    return record(description)


@pytest.mark.soak
def test_slips_in_a_few_campaigns_are_committed_and_named() -> None:
    judged = [judged_campaign(900810, number) for number in (23, 7, 8)]
    assert not any(entry["false"] for entry in judged)
    committed = [(slip, one) for entry in judged for slip, one in entry["slips"].items()]
    assert {slip for slip, _ in committed} <= set(SLIPS)
    assert all(one["over_rivals"] <= one["chi2"] + 1e-9 for _, one in committed)
    plain = [one["named"] for slip, one in committed if slip == "charge peak-to-peak" and one["over_rivals"] > 100]
    assert plain
    assert all(plain)


@pytest.mark.slow
def test_a_conjugated_delay_is_one_of_the_other_sign() -> None:
    made = recorded("timing_delay", delay_us=80.0)
    assert (4 * made.exact.imag**2 / made.line_variance).sum() > 100
    assert conjugated_residual(made) < 1.0


@pytest.mark.parametrize(
    ("effect", "values"),
    [("amplifier_high_pass", {"corner_hz": 1.5}), ("sensor_relaxation", {"law": "ladder", "exponent": 0.05})],
)
@pytest.mark.slow
def test_a_conjugated_high_pass_or_relaxation_is_nothing_else(effect: str, values: dict[str, Any]) -> None:
    assert conjugated_residual(recorded(effect, **values)) > 20.0


def test_a_third_that_is_conjugated_shows_by_two_signs_and_one_course_does_not() -> None:
    made = recorded("timing_delay", delay_us=80.0)
    turned = np.arange(len(made.exact)) % 3 == 0
    assert over_one_sign(made, turned, 1 / 3) > 20.0
    assert over_one_sign(made, np.zeros_like(turned), 1 / 3) <= 0.0


def test_an_exchange_of_cables_leaves_no_more_than_a_step_of_either_sensor_leaves() -> None:
    """Against least squares, with a level of each sensor and a step of one of the two."""
    description = drawn(8, 3, "none")
    description["skin"]["array"] |= {"columns": 2, "rows": 2}
    description["design"].pop("offsets_mm", None)
    description["effects"] = {"sensor_spread": {"sd": 0.2}}
    recorded = record(description)
    made, _ = from_dict(campaign(recorded))
    case = Case(made, recorded, np.full(len(recorded.exact), 0.03))
    gain = dict(zip((sensor.id for sensor in made.skin.sensors), recorded.response.sensor_gains, strict=True))
    seen = 0
    for seed in range(8):
        slip = cables(case, np.random.default_rng(seed))
        assert slip is not None
        given = np.array([entry.sensor for entry in frf_recordings(slip.campaign)])
        level = np.log([gain[entry.sensor] for entry in case.entries]) / 0.03
        turned = given != np.array([entry.sensor for entry in case.entries])
        late = np.arange(len(given)) >= np.flatnonzero(turned).min()
        sensors = (given[:, None] == np.unique(given)).astype(float)
        steps = [late & (given == name) for name in np.unique(given[turned])]
        left = [_least(np.column_stack([sensors, step]), level) for step in steps]
        assert slip.over_rivals is not None
        np.testing.assert_allclose([slip.chi2, slip.over_rivals], [_least(sensors, level), min(left)], atol=1e-6)
        seen += slip.over_rivals > 20
    assert seen > 0


def _least(columns: np.ndarray, value: np.ndarray) -> float:
    return float(((value - columns @ np.linalg.lstsq(columns, value, rcond=None)[0]) ** 2).sum())
