"""Shares with their intervals, and the calibration of probabilities."""

import numpy as np
import pytest
from scipy.stats import binom

from proof.statistics import calibration, chance_of_so_few, share


def test_wilson_interval_against_its_known_values() -> None:
    """Brown, Cai, DasGupta (2001): 0 of 10 gives 0 to 0.2775."""
    assert share([False] * 10).interval == pytest.approx((0.0, 0.2775), abs=1e-4)
    low, high = share([True] * 5 + [False] * 5).interval
    assert low + high == pytest.approx(1.0)


def test_a_calibrated_tool_lies_inside_the_range_of_chance_and_a_boaster_outside() -> None:
    random = np.random.default_rng(3)
    stated = random.uniform(0.3, 1.0, 400)
    honest = calibration(stated.tolist(), (random.random(400) < stated).tolist())
    boasting = calibration(stated.tolist(), (random.random(400) < stated - 0.25).tolist())
    assert honest.error <= honest.chance_range[1] < boasting.error
    assert boasting.error == pytest.approx(0.25, abs=0.06)
    assert sum(honest.count) == 400


def test_the_chance_of_so_few_right_answers_is_the_binomials_where_all_are_stated_alike() -> None:
    for hits in (0, 3, 17, 20):
        assert chance_of_so_few([0.9] * 20, hits) == pytest.approx(binom.cdf(hits, 20, 0.9))
    assert chance_of_so_few([0.5, 1.0], 1) == pytest.approx(0.5)


def test_a_tool_that_states_one_probability_has_the_plain_difference_as_its_error() -> None:
    found = calibration([0.75] * 8, [True] * 4 + [False] * 4)
    assert found.error == pytest.approx(0.25)
