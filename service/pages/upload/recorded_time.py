"""Times of recordings in the form of an upload: in the lab's time zone, unless a zone is typed."""

from datetime import datetime
from typing import Any

from underskin.errors import wrong_type
from underskin.recordings.readers.text import in_lab, time_zone, with_zone

FIELD = "recorded_at"


def zone() -> str:
    """The name of the lab's time zone."""
    return str(time_zone())


def said(typed: str) -> str:
    """A typed time as ISO 8601 with its zone; raises InvalidInput."""
    try:
        return with_zone(typed, time_zone())
    except ValueError as error:
        why = f" ({error})" if "two days" in str(error) else ""
        must = f"must be a date, or a date and time, such as 2026-05-03 14:30{why}"
        raise wrong_type(f"recording.{FIELD}", typed.strip()[:80], must) from None


def shown(value: Any) -> str:
    """A time of a campaign or a rig description as it is typed here; what is none as it is."""
    try:
        moment = datetime.fromisoformat(value)
    except (TypeError, ValueError):
        return str(value)
    moment = in_lab(moment).replace(tzinfo=None)
    return moment.isoformat(" ", "minutes" if moment.second == moment.microsecond == 0 else "auto")
