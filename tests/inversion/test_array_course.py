"""The change of an array's d33 between dates comes back, intervals cover it, and sensors that depart do not move it."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from underskin.inversion.array_history import ArrayHistory, array_history, array_levels, changes
from underskin.units import Floats

UNCERTAINTY = 0.007  # of a sensor's d33 on a date
STEADY = np.log([1.0, 0.969, 0.948, 0.922])


def recorded(generator: np.random.Generator, course: Floats, gain: float = 0.0, sensors: int = 8) -> Floats:
    """d33 [pC/N] of sensors that are spread by 5 % over dates whose common gain scatters (sensors, dates)."""
    own = 0.05 * generator.normal(size=(sensors, 1))
    common = gain * generator.normal(size=len(course))
    noise = UNCERTAINTY * generator.normal(size=(sensors, len(course)))
    return np.asarray(14.0 * np.exp(own + course + common + noise))


def told(d33: Floats, days: int = 182) -> ArrayHistory:
    start = datetime(2026, 1, 5, 9, tzinfo=UTC)
    moments = [start + timedelta(days=float(at)) for at in np.linspace(0, days, d33.shape[1])]
    found = array_history([f"s{row:02d}" for row in range(1, len(d33) + 1)], moments, d33, UNCERTAINTY * np.abs(d33))
    assert found is not None
    return found


def test_a_steady_fall_is_told_with_its_interval() -> None:
    """Of four dates, each sensor's uncertainty 0.7 %: the array is known to 0.25 % a date, its change to about 1 %."""
    found = told(recorded(np.random.default_rng(1), STEADY))
    assert found.significant
    assert 100 * found.low < -7.8 < 100 * found.high
    assert 0.5 < 50 * (found.high - found.low) < 2.5
    assert found.days == 182
    assert found.statement.startswith("d33 of the array fell by ")
    assert "in 182 days" in found.statement
    assert not any(one.significant for one in found.departures)


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.0, 0.01])
def test_intervals_cover_the_change_with_the_gain_that_a_date_has(gain: float) -> None:
    """The scatter common to a date is no change of d33: five dates tell it, and the interval holds it."""
    generator, covered, apart = np.random.default_rng(2), 0, 0
    course, unchanged, number = np.log(np.linspace(1.0, 0.92, 5)), np.zeros(5), 150
    times = np.arange(5.0)
    for truth in (course, unchanged):
        rows = [
            array_levels(np.log(recorded(generator, truth, gain)), np.full((8, 5), UNCERTAINTY)) for _ in range(number)
        ]
        found = changes(
            times, np.array([row.level for row in rows]), np.array([row.deviation for row in rows]), gain_scatters=True
        )
        covered += int(((found.low < truth[-1]) & (truth[-1] < found.high)).sum())
        apart += int((found.p_value < 0.05).sum()) if truth is unchanged else 0
    assert covered > 0.9 * 2 * number
    assert apart < 0.1 * number


def test_a_sensor_that_departs_does_not_move_the_array() -> None:
    d33 = recorded(np.random.default_rng(3), STEADY)
    d33[2, 2:] *= 0.85
    found = told(d33)
    assert 100 * found.low < -7.8 < 100 * found.high
    assert "s03" not in found.pooled
    (departure,) = [one for one in found.departures if one.significant]
    assert departure.sensor == "s03"
    assert departure.low < -0.15 < departure.high
    assert "s03 changed by -1" in found.statement


def test_a_sensor_that_dies_is_left_out_and_told_with_its_date() -> None:
    d33 = recorded(np.random.default_rng(4), STEADY)
    d33[5, 2:] *= 1e-3
    found = told(d33)
    assert 100 * found.low < -7.8 < 100 * found.high
    assert found.dead_since == {"s06": 2}
    assert "s06 is dead since 2026-05-06" in found.statement


def test_two_dates_tell_a_change_that_the_chain_may_have_made() -> None:
    found = told(recorded(np.random.default_rng(5), np.log([1.0, 0.9])))
    assert 100 * found.low < -10 < 100 * found.high
    assert "another gain of the chain" in found.statement


def test_dates_that_share_no_sensor_are_not_compared() -> None:
    """Sensors one to four on the first two dates, the others on two later ones, with another gain."""
    d33 = recorded(np.random.default_rng(6), np.log([1.0, 1.0, 0.5, 0.5]))
    d33[:4, 2:] = d33[4:, :2] = np.nan
    found = told(d33)
    assert len(found.dates) == 2
    assert not found.significant


def test_two_sensors_have_no_scatter() -> None:
    """The change of one of two sensors is no scatter of the other: their array is as certain as they are."""
    steady = np.log(np.full((2, 4), 30.0))
    stepped = steady + np.array([[0.0, 0.0, 0.1, 0.1], [0.0, 0.0, 0.0, 0.0]])
    found = [array_levels(value, np.full((2, 4), 0.01)).deviation for value in (steady, stepped)]
    assert found[0] == pytest.approx(0.01 / np.sqrt(2))
    assert found[1] == pytest.approx(found[0])
