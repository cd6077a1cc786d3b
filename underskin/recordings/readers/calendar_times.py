"""Times of recordings, and the zone in which they were written.

The lab's time zone: that of the time of day, and of times that are written without one. Dates and times as spreadsheets
write them: 24.12.2025 09:30, 24/12/2025 9:30:15.
"""

import os
import re
from datetime import UTC, date, datetime, tzinfo
from zoneinfo import ZoneInfo

from underskin.errors import InvalidInput

TIME_ZONE = "UNDERSKIN_TIME_ZONE"  # the setting; UTC where it is not set


def time_zone() -> tzinfo:
    """The zone that the setting names; raises InvalidInput where there is none of that name."""
    name = os.environ.get(TIME_ZONE) or "UTC"
    if name == "UTC":
        return UTC
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise InvalidInput(TIME_ZONE, name, "must be a time zone such as Europe/Rome") from None


def in_lab(moment: datetime) -> datetime:
    """A moment in the lab's zone, taken as UTC where it states none; where the calendar ends in that zone, as it is."""
    known = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    try:
        return known.astimezone(time_zone())
    except OverflowError:
        return known


_WRITTEN = re.compile(
    r"(?P<one>\d{1,2})(?P<mark>[./])(?P<two>\d{1,2})(?P=mark)(?P<year>\d{4})"
    r"(?:[ ,T]+(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}))?)?"
)
_MONTHS = 12
_ISO_DATE = re.compile(r"(\d{4})-(\d{2})-(\d{2})")


def iso_time(cell: str, zone: tzinfo) -> str:
    """A date and time in a zone as ISO 8601 writes it; what is not written as above stays as it is.

    With points the day comes first; with strokes it may be the month. Raises ValueError where that cannot be told, or
    where there is no such day or time.
    """
    found = _WRITTEN.fullmatch(cell.strip())
    if found is None:
        return cell
    day, month = int(found["one"]), int(found["two"])
    if found["mark"] == "/" and day != month:
        if max(day, month) <= _MONTHS:
            raise ValueError(_two_days(found))
        day, month = (day, month) if month <= _MONTHS else (month, day)
    hour, minute, second = (int(found[part] or 0) for part in ("hour", "minute", "second"))
    try:
        time = f"{found['year']}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
        return datetime.fromisoformat(time).replace(tzinfo=zone).isoformat()
    except ValueError as error:
        raise ValueError(f"is no date and time: {error}") from None


def _two_days(found: re.Match[str]) -> str:
    """That a date can be two days, which, and how either is written so that it is one alone."""
    numbers = int(found["one"]), int(found["two"])
    clock = f"T{int(found['hour']):02}:{found['minute']}" if found["hour"] else ""
    days = [date(int(found["year"]), month, day) for day, month in (numbers, numbers[::-1])]
    named = " or ".join(f"{day.day} {day:%B %Y}" for day in days)
    return f"can be two days, {named}: write it as {' or '.join(f'{day}{clock}' for day in days)}"


def with_zone(text: str, zone: tzinfo) -> str:
    """A date, or a date and time, as ISO 8601 writes it or as above, with its zone: `zone` where it states none.

    Raises ValueError where it is none of these.
    """
    told = iso_time(text.strip(), zone)
    moment = datetime.fromisoformat(told)
    return told if moment.tzinfo is not None else moment.replace(tzinfo=zone).isoformat()


def of_two_cells(day: str, clock: str) -> str:
    """A date, also one that begins an ISO time, and a time of day in cells of their own, as `iso_time` reads them; an
    ISO time beside which there is no other time of day as it is."""
    day, clock = day.strip(), clock.strip()
    iso = _ISO_DATE.match(day)
    if iso is None or not (clock or iso.end() == len(day)):
        return f"{day} {clock}".strip()
    return f"{'.'.join(reversed(iso.groups()))} {clock}".strip()
