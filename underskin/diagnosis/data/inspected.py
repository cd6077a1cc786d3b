"""The recordings that a diagnosis uses, and what was found on the way to them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from underskin.recordings.campaign import Campaign
from underskin.recordings.finding import Finding
from underskin.units import Floats


@dataclass(frozen=True)
class Inspected:
    """The recordings that can be used, what was found, what is lacking where nothing can be told from them, and by
    their id how `uneven` the noise of the lines of time series is."""

    campaign: Campaign
    found: Sequence[Finding]
    lacking: str = ""
    uneven: Mapping[str, Floats] = field(default_factory=dict)
