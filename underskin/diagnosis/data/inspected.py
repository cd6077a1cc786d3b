"""The recordings that a diagnosis uses, with the findings on all recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from underskin.findings.finding import Finding
from underskin.findings.lacking import Lacking
from underskin.recordings.campaign import Campaign
from underskin.units import Floats


@dataclass(frozen=True)
class Inspected:
    """The recordings that can be used and the findings; what is `lacking` where nothing can be concluded from them.

    `uneven` is how uneven the noise of the lines of time series is, by the recording's id; `unsure` the relative
    uncertainty that noise in their channels leaves of all levels; `beyond` are the ids of
    those whose contacts lie beyond the tables as declared, and within them by a plausible modulus.
    """

    campaign: Campaign
    findings: Sequence[Finding]
    lacking: Lacking | None = None
    uneven: Mapping[str, Floats] = field(default_factory=dict)
    unsure: float = 0.0
    beyond: frozenset[str] = frozenset()
