"""The history of an array, in numbers and in words.

What d33 of an array did over some dates, as a clause. d33 of the sensors of a skin over its campaigns: what the array
did, and which sensors depart from it or died.
"""

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

    `value`, `low` and `high` are relative, with the 95 % interval; `d33` [pC/N] is that of each date.
    """
    span = between if days is None else f"in {days} day{'' if days == 1 else 's'}, {between}"
    values = f"{', '.join(f'{one:.4g}' for one in d33)} pC/N"
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
    """The clause on the array, then the sensors that depart from it (relative change, low, high), and those that are
    dead since a date."""
    left_out = [sensor for sensor, *_ in departures]
    without = f" without {', '.join(left_out[:_MOST_NAMED])}" if 0 < len(left_out) <= _MOST_NAMED else ""
    parts = [of_array.replace("d33 of the array", f"d33 of the array{without}", 1)]
    if few_dates:
        parts.append(TWO_DATES)
    parts += [
        f"{sensor} changed by {100 * value:+.1f} % ({100 * low:+.1f} to {100 * high:+.1f}) beside the others"
        for sensor, value, low, high in departures[:_MOST_NAMED]
    ]
    parts += [f"{sensor} is dead since {date}" for sensor, date in list(dead.items())[:_MOST_NAMED]]
    more = sum(max(len(each) - _MOST_NAMED, 0) for each in (departures, dead))
    return "; ".join([*parts, *([f"and {more} more sensors"] if more else [])])


_DAY_S = 86400.0


@dataclass(frozen=True)
class Departure:
    """The relative change of a sensor's d33 beside the array's between its first and last campaign, with its 95 %
    interval; whether it is beyond chance over all sensors (Holm)."""

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
        """Whether the interval of the change leaves out that there is none."""
        return self.low * self.high > 0


def array_history(
    sensors: Sequence[str], moments: Sequence[datetime], d33: Floats, uncertainty: Floats
) -> ArrayHistory | None:
    """Of campaigns in the order of their times, d33 with its standard uncertainty [pC/N] (sensors, campaigns), NaN
    where there is none; None where fewer than two campaigns, a day apart at least, share a sensor that answers.

    A sensor that shows no charge beyond noise is left out of what is said of the array from then on.
    """
    if len(moments) < 2:
        return None
    alive = _alive(d33, uncertainty)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(alive, np.log(np.abs(d33)), np.nan)
        deviation = np.where(alive, uncertainty / np.abs(d33), np.nan)
    levels = array_levels(value, deviation)
    has = np.flatnonzero(np.isfinite(levels.level))
    times = np.array([moment.timestamp() for moment in moments]) / _DAY_S
    if len(has) < 2 or times[has[-1]] - times[has[0]] < 1:
        return None
    change = changes(times[has], levels.level[None, has], levels.deviation[None, has], gain_scatters=True)
    size, low, high = (float(np.expm1(part[0])) for part in (change.value, change.low, change.high))
    departures = _departures(sensors, times, levels.departure, levels.departure_deviation)
    dead = _dead_since(sensors, alive, np.isfinite(d33))
    of_array = np.exp(levels.level[has])
    days = round(float(times[has[-1]] - times[has[0]]))
    first, last = (moments[place].strftime("%Y-%m-%d") for place in has[[0, -1]])
    said = array_change_in_words(size, low, high, of_array.tolist(), f"between {first} and {last}", days)
    told = [(one.sensor, one.value, one.low, one.high) for one in departures if one.significant]
    died = {sensor: moments[number].strftime("%Y-%m-%d") for sensor, number in dead.items()}
    return ArrayHistory(
        tuple(has.tolist()),
        of_array,
        of_array * levels.deviation[has],
        tuple(name for name, counts in zip(sensors, levels.pooled, strict=True) if counts),
        days,
        size,
        low,
        high,
        departures,
        dead,
        departures_in_words(said, told, died, few_dates=len(has) < FEWEST_DATES and low * high > 0),
    )


def _alive(d33: Floats, uncertainty: Floats) -> Mask:
    """Which sensors answer (sensors, campaigns), beside those of the same campaign."""
    columns = [is_alive(value, of_value) for value, of_value in zip(d33.T, uncertainty.T, strict=True)]
    return np.array(columns, dtype=bool).T.reshape(d33.shape)


def _dead_since(sensors: Sequence[str], alive: Mask, told: Mask) -> dict[str, int]:
    """The sensors that are dead in the last campaign that has them, with the first one since they are."""
    found: dict[str, int] = {}
    for name, own, has in zip(sensors, alive, told, strict=True):
        recorded: Indices = np.flatnonzero(has)
        answered = np.flatnonzero(own & has)
        if len(recorded) and not own[recorded[-1]]:
            after = recorded if not len(answered) else recorded[recorded > answered[-1]]
            found[name] = int(after[0])
    return found


def _departures(sensors: Sequence[str], times: Floats, value: Floats, deviation: Floats) -> tuple[Departure, ...]:
    """Of the sensors with two campaigns at least, where there are enough to tell one from the others."""
    found = changes(times, value, deviation, gain_scatters=False)
    rows = np.flatnonzero(np.isfinite(found.value)).tolist()
    if len(rows) < FEWEST_SENSORS:
        return ()
    adjusted = holm(found.p_value[rows].tolist())
    ends = np.expm1(np.column_stack([found.value, found.low, found.high])[rows]).tolist()
    return tuple(
        Departure(sensors[row], value, low, high, chance < SIGNIFICANT)
        for row, (value, low, high), chance in zip(rows, ends, adjusted, strict=True)
    )
