"""What d33 of an array did over some dates, as a clause."""

from collections.abc import Mapping, Sequence

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
