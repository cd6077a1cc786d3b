"""Columns of clock times, such as `00:01:05.250` or `2026-05-03 09:00:01.2`, as seconds after their first row."""

import re

import numpy as np

from underskin.recordings.channels import Channel, TextColumn
from underskin.units import Floats

_CLOCK = re.compile(
    r"(?P<day>\D*\d[^:]*[ T])?(?P<hour>\d{1,3}):(?P<minute>[0-5]?\d):(?P<second>[0-5]?\d(?:[.,]\d+)?)"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
_DAY_S, _HALF_DAY_H = 86_400.0, 12
_TICKING = 0.5  # least share of rows with a time of their own, unlike that of a recording


def seconds_of(column: TextColumn) -> Channel | None:
    """The times of a column (rows,) [s]; None where a cell holds something else, where most times repeat, or where they
    do not rise. A day begins where the clock falls; where dates stand beside it, they must change there and only there.
    """
    if len(column.texts) < max(2, _TICKING * len(column.codes)):
        return None
    matches = [_CLOCK.fullmatch(text.strip()) for text in column.texts]
    if not all(matches):
        return None
    found = [match for match in matches if match is not None]
    clock = np.array([_seconds(match) for match in found])[column.codes]
    days: dict[str, int] = {}
    day = np.array([days.setdefault((match["day"] or "").strip(" T"), len(days)) for match in found])[column.codes]
    falls = np.diff(clock) < 0
    if days.keys() != {""} and not np.array_equal(falls, np.diff(day) != 0):
        return None
    time: Floats = clock + _DAY_S * np.concatenate([[0], np.cumsum(falls)]) - clock[0]
    is_midnight = (-np.diff(clock)[falls] > _DAY_S / 2).all()
    return Channel(column.name, "s", time) if is_midnight else None


def _seconds(match: re.Match[str]) -> float:
    hour, half = int(match["hour"]), (match["half"] or "").lower()
    if half:
        hour = hour % _HALF_DAY_H + (_HALF_DAY_H if half == "p" else 0)
    return 3600.0 * hour + 60.0 * int(match["minute"]) + float(match["second"].replace(",", "."))
