"""Times of recordings: the lab's time zone, and dates as spreadsheets write them, 24.12.2025 09:30, 24/12/2025
9:30:15."""

import os
import re
from datetime import UTC, date, datetime, tzinfo
from zoneinfo import ZoneInfo

from underskin.errors import InvalidInput

TIME_ZONE = "UNDERSKIN_TIME_ZONE"  # the setting; UTC where it is not set


def time_zone() -> tzinfo:
    """The time zone of the setting; raises InvalidInput for an unknown one."""
    name = os.environ.get(TIME_ZONE) or "UTC"
    if name == "UTC":
        return UTC
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise InvalidInput(TIME_ZONE, name, "must be a time zone such as Europe/Rome") from None


def in_lab(moment: datetime) -> datetime:
    """A moment in the lab's zone, assumed in UTC where it states none; unchanged where it overflows the calendar."""
    zoned = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    try:
        return zoned.astimezone(time_zone())
    except OverflowError:
        return zoned


_WRITTEN = re.compile(
    r"(?P<one>\d{1,2})(?P<mark>[./])(?P<two>\d{1,2})(?P=mark)(?P<year>\d{4})"
    r"(?:[ ,T]+(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}))?)?"
)
_MONTHS = 12
_ISO_DATE = re.compile(r"(\d{4})-(\d{2})-(\d{2})")


def iso_time(cell: str, zone: tzinfo) -> str:
    """A date and time in a zone as ISO 8601; other texts are unchanged.

    With points the day comes first; with slashes it may be the month. Raises ValueError where that is ambiguous, or
    where there is no such day or time.
    """
    match = _WRITTEN.fullmatch(cell.strip())
    if match is None:
        return cell
    day, month = int(match["one"]), int(match["two"])
    if match["mark"] == "/" and day != month:
        if max(day, month) <= _MONTHS:
            raise ValueError(_two_days(match))
        day, month = (day, month) if month <= _MONTHS else (month, day)
    hour, minute, second = (int(match[part] or 0) for part in ("hour", "minute", "second"))
    try:
        time = f"{match['year']}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
        return datetime.fromisoformat(time).replace(tzinfo=zone).isoformat()
    except ValueError as error:
        raise ValueError(f"is no date and time: {error}") from None


def _two_days(match: re.Match[str]) -> str:
    """The message that a date is ambiguous, with both days and their ISO forms."""
    numbers = int(match["one"]), int(match["two"])
    clock = f"T{int(match['hour']):02}:{match['minute']}" if match["hour"] else ""
    days = [date(int(match["year"]), month, day) for day, month in (numbers, numbers[::-1])]
    named = " or ".join(f"{day.day} {day:%B %Y}" for day in days)
    return f"can be two days, {named}: write it as {' or '.join(f'{day}{clock}' for day in days)}"


def with_zone(text: str, zone: tzinfo) -> str:
    """A date, or a date and time, in ISO 8601 or as for `iso_time`, with its zone: `zone` where it states none.

    Raises ValueError for other texts.
    """
    text_with_zone = iso_time(text.strip(), zone)
    moment = datetime.fromisoformat(text_with_zone)
    return text_with_zone if moment.tzinfo is not None else moment.replace(tzinfo=zone).isoformat()


def of_two_cells(day: str, clock: str) -> str:
    """A date, or the date of an ISO time, and a time of day in separate cells, as one text for `iso_time`; an ISO time
    without another time of day is unchanged."""
    day, clock = day.strip(), clock.strip()
    iso = _ISO_DATE.match(day)
    if iso is None or not (clock or iso.end() == len(day)):
        return f"{day} {clock}".strip()
    return f"{'.'.join(reversed(iso.groups()))} {clock}".strip()
