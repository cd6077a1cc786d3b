"""When campaigns were recorded, and how a report calls them by that."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime

import numpy as np

from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.time_zone import time_zone
from underskin.units import Floats


@dataclass(frozen=True)
class Dated:
    """Names of campaigns in their order, with the dates of their first recordings, None of those without a time."""

    names: Sequence[str]
    dates: Sequence[str | None]

    @property
    def ordered(self) -> bool:
        """Whether their order is one of time: all have a date."""
        return None not in self.dates

    def since(self, number: int) -> str | None:
        """The date from which on something is there that begins with this campaign; None where the order is not one of
        time."""
        return self.dates[number] if self.ordered else None

    @property
    def times(self) -> Floats:
        """When the campaigns were recorded, in days; where not all have a date of their own, their places in the
        order."""
        days = [date.fromisoformat(own).toordinal() for own in self.dates if own is not None]
        ordered = self.ordered and days == sorted(days) and len(set(days)) == len(days)
        return np.array(days if ordered else range(len(self.dates)), dtype=float)

    def days(self, first: int, last: int) -> int | None:
        """Between two campaigns; None where their order is not one of time."""
        begin, end = self.dates[first], self.dates[last]
        if begin is None or end is None or not self.ordered:
            return None
        return (date.fromisoformat(end) - date.fromisoformat(begin)).days

    def called(self, number: int) -> str:
        """A campaign by its date where that says which it is, else by its name: "campaign B (no date)"."""
        own = self.dates[number]
        if own is not None and self.ordered and self.dates.count(own) == 1:
            return own
        return f"campaign {self.names[number]} ({own or 'no date'})"

    def order_clause(self) -> str:
        """That the order is not one of time; empty where it is."""
        if self.ordered:
            return ""
        listed = ", ".join(self.called(number) for number in range(len(self.names)))
        return f"not every campaign has a date, so they count in the order in which they were given: {listed}"


def in_order(campaigns: Sequence[Campaign]) -> list[Campaign]:
    """By the first time of each; as they come where one has none."""
    times = [_first_time(campaign) for campaign in campaigns]
    known = [time for time in times if time is not None]
    if len(known) < len(times):
        return list(campaigns)
    return [campaigns[number] for number in np.argsort(known, kind="stable")]


def _first_time(campaign: Campaign) -> float | None:
    """In seconds; None where none of its recordings has a time."""
    written = [entry.recorded_at for entry in campaign.recordings if isinstance(entry, FrfRecording)]
    times = [datetime.fromisoformat(time) for time in written if time is not None]
    zone = time_zone()
    return min((time if time.tzinfo else time.replace(tzinfo=zone)).timestamp() for time in times) if times else None


def date_of(campaign: Campaign) -> str | None:
    """The date of its first recording; None where none has a time."""
    times = [str(entry.recorded_at)[:10] for entry in campaign.recordings if isinstance(entry, FrfRecording)]
    known = [time for time in times if time != "None"]
    return min(known, default=None)
