"""What was left out or put right before the diagnosis, where that decides how far its statement can be trusted."""

from collections.abc import Mapping, Sequence
from itertools import groupby

_DECISIVE = (
    "no_response",
    "impossible_geometry",
    "no_finite_line",
    "refused",
    "impossible_number",
    "series_not_usable",
    "curve_not_usable",
    "units_off_by_1000",
    "sign_flipped",
    "mains_in_charge",
    "out_of_domain",
    "implausible_d33",
    "duplicated_recording",
    "remainder",
    "held_out_no_better",
)
_MOST = 6  # findings of one code that are told in full


def caveats(findings: Sequence[Mapping[str, str]]) -> str:
    """Sentences on the decisive ones of a report's findings, empty where there are none; many of a code are counted."""
    decisive = sorted((entry for entry in findings if entry["code"] in _DECISIVE), key=_rank)
    return " ".join(text for _, alike in groupby(decisive, key=_rank) for text in _sentences(list(alike)))


def _rank(entry: Mapping[str, str]) -> int:
    return _DECISIVE.index(entry["code"])


def _sentences(alike: Sequence[Mapping[str, str]]) -> list[str]:
    if len(alike) > _MOST:
        return [f"{len(alike)} findings of {alike[0]['code'].replace('_', ' ')}, see the findings."]
    return [_sentence(entry) for entry in alike]


def _sentence(entry: Mapping[str, str]) -> str:
    text = entry["statement"].rstrip(".")
    if entry["recording"] and "recordings of sensor" not in text:
        return f"Recording {entry['recording']!r}: {text}."
    return f"{text[0].upper()}{text[1:]}."
