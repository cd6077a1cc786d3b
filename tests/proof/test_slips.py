"""Judging slips: each is committed where it shows, and counted."""

import numpy as np

from proof.slip_kinds import SLIPS, Case, cables
from proof.slips import judged, shown
from rig.draw import drawn, record
from rig.recorded import campaign
from underskin.recordings.campaign import frf_recordings, from_dict


def test_slips_in_a_few_campaigns_are_committed_named_and_shown() -> None:
    tally = judged(8, 3)
    assert tally.clean == 6
    assert tally.false == []
    assert {slip for _, slip in tally.visible} <= set(SLIPS)
    assert {"polarity at random", "charge peak-to-peak"} <= {slip for _, slip in tally.visible}
    assert sum(tally.named.values()) + len(tally.missed) == sum(tally.visible.values())
    assert tally.named["none", "polarity at random"] == tally.visible["none", "polarity at random"]
    assert "| polarity at random | none |" in shown(tally)


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
