"""The lab's time zone: that of the time of day, and of times that are written without one."""

import os
from datetime import UTC, datetime, tzinfo
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
