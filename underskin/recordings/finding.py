"""A finding: what is wrong with the recordings themselves, or noteworthy about their diagnosis."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """`recording` and `field` name the place (recording empty: the whole campaign)."""

    code: str
    recording: str
    field: str
    statement: str
