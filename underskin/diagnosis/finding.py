"""A finding: what is wrong with the recordings themselves, or noteworthy about their diagnosis."""

from collections.abc import Sequence
from dataclasses import dataclass

from underskin.recordings.campaign import Campaign


@dataclass(frozen=True)
class Finding:
    """`recording` and `field` name the place (recording empty: the whole campaign)."""

    code: str
    recording: str
    field: str
    statement: str


@dataclass(frozen=True)
class Inspected:
    """The recordings that can be used, what was found, and what is lacking where nothing can be told from them."""

    campaign: Campaign
    found: Sequence[Finding]
    lacking: str = ""
