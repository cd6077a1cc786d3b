"""The history of an array's d33 over campaigns: its change, and the sensors that depart from it or died, with
sentences."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from underskin.inversion.array_course import FEWEST_DATES, FEWEST_SENSORS, array_levels, changes
from underskin.inversion.invert import is_alive
from underskin.inversion.trend import SIGNIFICANT, holm
from underskin.units import Floats, Indices, Mask

TWO_DATES = (
    "two dates do not tell this from another gain of the chain, amplifier or mounting, which would look the same and "
    "is not in the interval"
)

_MOST_NAMED = 5  # sensors of each sort


def array_change_in_words(
    value: float, low: float, high: float, d33: Sequence[float], between: str, days: int | None
) -> str:
    """ "d33 of the array fell by 7.8 % (95 %: 7.1 to 8.5) in 182 days, between 2017-05-02 and … (14.29, … pC/N)".

    `value` with the 95 % interval `low` to `high` is relative; `d33` [pC/N] is that of each date.
    """
    span = between if days is None else f"in {days} day{'' if days == 1 else 's'}, {between}"
    values = f"{', '.join(f'{level:.4g}' for level in d33)} pC/N"
    if low * high <= 0:
        sizes = f"{100 * value:+.1f} % (95 %: {100 * low:+.1f} to {100 * high:+.1f})"
        return f"d33 of the array did not change beyond chance {span}: by {sizes}, {values}"
    way = "fell" if value < 0 else "rose"
    least, most = sorted((abs(100 * low), abs(100 * high)))
    return f"d33 of the array {way} by {abs(100 * value):.1f} % (95 %: {least:.1f} to {most:.1f}) {span} ({values})"


def departures_in_words(
    of_array: str,
    departures: Sequence[tuple[str, float, float, float]],
    dead: Mapping[str, str],
    *,
    few_dates: bool,
) -> str:
    """The clause on the array, then the departing sensors (relative change, low, high), and those dead since a date."""
    departing = [sensor for sensor, *_ in departures]
    without = f" without {', '.join(departing[:_MOST_NAMED])}" if 0 < len(departing) <= _MOST_NAMED else ""
    parts = [of_array.replace("d33 of the array", f"d33 of the array{without}", 1)]
    if few_dates:
        parts.append(TWO_DATES)
    parts += [
        f"{sensor} changed by {100 * value:+.1f} % ({100 * low:+.1f} to {100 * high:+.1f}) beside the others"
        for sensor, value, low, high in departures[:_MOST_NAMED]
    ]
    parts += [f"{sensor} is dead since {date}" for sensor, date in list(dead.items())[:_MOST_NAMED]]
    more = sum(max(len(sensors) - _MOST_NAMED, 0) for sensors in (departures, dead))
    return "; ".join([*parts, *([f"and {more} more sensors"] if more else [])])


_DAY_S = 86400.0


@dataclass(frozen=True)
class Departure:
    """The change of a sensor's d33 relative to the array's between its first and last campaign, with its 95 % interval;
    whether it is significant over all sensors (Holm)."""

    sensor: str
    value: float
    low: float
    high: float
    significant: bool


@dataclass(frozen=True, eq=False)
class ArrayHistory:
    """`d33` [pC/N] of the array on each of `dates`, with the standard uncertainty between dates, over the sensors
    `pooled`; `value` with `low` and `high` is its relative change from the first to the last in `days`."""

    dates: tuple[int, ...]  # numbers of the campaigns
    d33: Floats
    uncertainty: Floats
    pooled: tuple[str, ...]
    days: int
    value: float
    low: float
    high: float
    departures: tuple[Departure, ...]
    dead_since: dict[str, int]  # by sensor, the number of the campaign
    statement: str

    @property
    def significant(self) -> bool:
        """Whether the interval of the change excludes 0."""
        return self.low * self.high > 0


def array_history(
    sensors: Sequence[str], moments: Sequence[datetime], d33: Floats, uncertainty: Floats
) -> ArrayHistory | None:
    """The history from d33 with its standard uncertainty [pC/N] (sensors, campaigns), campaigns in order of time, NaN
    for missing values; None where fewer than two campaigns, at least a day apart, share a responding sensor.

    A sensor without charge beyond noise is excluded from the array from then on.
    """
    if len(moments) < 2:
        return None
    alive = _alive(d33, uncertainty)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(alive, np.log(np.abs(d33)), np.nan)
        deviation = np.where(alive, uncertainty / np.abs(d33), np.nan)
    levels = array_levels(value, deviation)
    dated = np.flatnonzero(np.isfinite(levels.level))
    times = np.array([moment.timestamp() for moment in moments]) / _DAY_S
    if len(dated) < 2 or times[dated[-1]] - times[dated[0]] < 1:
        return None
    change = changes(times[dated], levels.level[None, dated], levels.deviation[None, dated], gain_scatters=True)
    size, low, high = (float(np.expm1(part[0])) for part in (change.value, change.low, change.high))
    departures = _departures(sensors, times, levels.departure, levels.departure_deviation)
    dead = _dead_since(sensors, alive, np.isfinite(d33))
    of_array = np.exp(levels.level[dated])
    days = round(float(times[dated[-1]] - times[dated[0]]))
    first, last = (moments[date].strftime("%Y-%m-%d") for date in dated[[0, -1]])
    array_clause = array_change_in_words(size, low, high, of_array.tolist(), f"between {first} and {last}", days)
    significant = [
        (departure.sensor, departure.value, departure.low, departure.high)
        for departure in departures
        if departure.significant
    ]
    died = {sensor: moments[number].strftime("%Y-%m-%d") for sensor, number in dead.items()}
    return ArrayHistory(
        tuple(dated.tolist()),
        of_array,
        of_array * levels.deviation[dated],
        tuple(name for name, counts in zip(sensors, levels.pooled, strict=True) if counts),
        days,
        size,
        low,
        high,
        departures,
        dead,
        departures_in_words(array_clause, significant, died, few_dates=len(dated) < FEWEST_DATES and low * high > 0),
    )


def _alive(d33: Floats, uncertainty: Floats) -> Mask:
    """Which sensors respond (sensors, campaigns), compared with those of the same campaign."""
    columns = [is_alive(value, of_value) for value, of_value in zip(d33.T, uncertainty.T, strict=True)]
    return np.array(columns, dtype=bool).T.reshape(d33.shape)


def _dead_since(sensors: Sequence[str], alive: Mask, recorded: Mask) -> dict[str, int]:
    """The sensors that are dead in their last campaign, with the first campaign of that state."""
    dead_since: dict[str, int] = {}
    for name, alive_dates, recorded_dates in zip(sensors, alive, recorded, strict=True):
        present: Indices = np.flatnonzero(recorded_dates)
        responded = np.flatnonzero(alive_dates & recorded_dates)
        if len(present) and not alive_dates[present[-1]]:
            after = present if not len(responded) else present[present > responded[-1]]
            dead_since[name] = int(after[0])
    return dead_since


def _departures(sensors: Sequence[str], times: Floats, value: Floats, deviation: Floats) -> tuple[Departure, ...]:
    """The departures of sensors with at least two campaigns; empty with fewer than FEWEST_SENSORS of them."""
    estimates = changes(times, value, deviation, gain_scatters=False)
    rows = np.flatnonzero(np.isfinite(estimates.value)).tolist()
    if len(rows) < FEWEST_SENSORS:
        return ()
    adjusted = holm(estimates.p_value[rows].tolist())
    ends = np.expm1(np.column_stack([estimates.value, estimates.low, estimates.high])[rows]).tolist()
    return tuple(
        Departure(sensors[row], value, low, high, chance < SIGNIFICANT)
        for row, (value, low, high), chance in zip(rows, ends, adjusted, strict=True)
    )
