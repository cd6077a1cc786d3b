"""Whether sensors changed between campaigns, over how the others scatter: seen where they did, rarely by chance."""

import numpy as np
import pytest

from underskin.diagnosis.several.sensors import SensorsOfCampaign, changes
from underskin.units import Floats

SURE = [0.0, 0.0]  # of ln d33, by mechanisms
NONE = [frozenset[str]()] * 2  # stand apart by either campaign alone


def sensors(name: str, d33: Floats, relative: float) -> SensorsOfCampaign:
    uncertainty = relative * d33
    ids = tuple(f"s{number}" for number in range(len(d33)))
    return SensorsOfCampaign(name, ids, d33, uncertainty, d33 - uncertainty, d33 + uncertainty)


def seen_by_chance(random: np.random.Generator, scatter: float, count: int) -> int:
    """In how many of 300 pairs of campaigns, whose sensors scatter as their uncertainties say, a change is seen."""
    seen = 0
    for _ in range(300):
        pair = [sensors(name, 14.0 * np.exp(scatter * random.normal(size=count)), scatter) for name in ("may", "june")]
        seen += bool(changes(pair, NONE, SURE))
    return seen


def test_a_sensor_that_changed_is_seen_over_how_the_others_scatter() -> None:
    """Uncertainties that allow for more scatter than there is hide no change of a sixth, and none is seen by chance."""
    random = np.random.default_rng(11)
    before, after = (14.0 * np.exp(0.01 * random.normal(size=8)) for _ in range(2))
    after[3] *= 0.84
    (change,) = changes([sensors("may", before, 0.03), sensors("june", after, 0.03)], NONE, SURE)
    assert (change.sensor, change.since) == ("s3", 1)
    assert change.value == pytest.approx(-0.16, abs=0.03)
    assert seen_by_chance(random, 0.04, 8) <= 6


def test_a_sensor_that_one_campaign_alone_says_stands_apart_needs_less_to_have_changed() -> None:
    random = np.random.default_rng(12)
    before, after = (14.0 * np.exp(0.03 * random.normal(size=20)) for _ in range(2))
    after[3] = 0.84 * before[3]
    pair = [sensors("may", before, 0.03), sensors("june", after, 0.03)]
    assert changes(pair, [frozenset(), frozenset()], SURE) == []
    (change,) = changes(pair, [frozenset(), frozenset({"s3"})], SURE)
    assert change.sensor == "s3"


def test_sensors_that_agree_better_than_they_might_show_a_smaller_change_of_all() -> None:
    random = np.random.default_rng(13)
    before, after = (14.0 * np.exp(0.006 * random.normal(size=4)) for _ in range(2))
    (change,) = changes([sensors("may", before, 0.021), sensors("june", 0.93 * after, 0.021)], NONE, SURE)
    assert change.sensor is None
    assert change.value == pytest.approx(-0.07, abs=0.015)
    assert seen_by_chance(random, 0.03, 4) <= 6
    assert changes([sensors("may", before, 0.021), sensors("june", 0.93 * after, 0.021)], NONE, [0.0, 0.05]) == []
