"""Findings that decide how far the statement of a report can be trusted, as sentences of that statement."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

from underskin.findings.codes import FindingCode

_DECISIVE = (
    *(FindingCode.NO_RESPONSE, FindingCode.IMPOSSIBLE_GEOMETRY, FindingCode.NO_FINITE_LINE, FindingCode.REFUSED),
    *(FindingCode.IMPOSSIBLE_NUMBER, FindingCode.SERIES_NOT_USABLE, FindingCode.CURVE_NOT_USABLE),
    *(FindingCode.SENSORS_EXCHANGED, FindingCode.WEAK, FindingCode.CONJUGATED, FindingCode.GAIN_STEPS),
    FindingCode.WARM_UP,
    *(FindingCode.UNITS_OFF_BY_1000, FindingCode.SIGN_FLIPPED, FindingCode.MAINS_IN_CHARGE, FindingCode.OUT_OF_DOMAIN),
    FindingCode.CONTACTS_KEPT,
    *(FindingCode.IMPLAUSIBLE_D33, FindingCode.DUPLICATED_RECORDING),
    *(FindingCode.REMAINDER, FindingCode.HELD_OUT_NO_BETTER, FindingCode.NO_SIMPLE_LAW),
    FindingCode.IMITATED,
)
_MOST = 6  # findings of one code that are quoted in full


def caveats(findings: Sequence[Mapping[str, str]]) -> str:
    """Sentences on the decisive ones of a report's findings, empty where there are none; many of a code are counted."""
    decisive = sorted((entry for entry in findings if entry["code"] in _DECISIVE), key=_rank)
    return " ".join(text for _, alike in groupby(decisive, key=_rank) for text in _sentences(list(alike)))


def _rank(entry: Mapping[str, str]) -> int:
    return _DECISIVE.index(FindingCode(entry["code"]))


def _sentences(alike: Sequence[Mapping[str, str]]) -> Iterator[str]:
    if len(alike) > _MOST:
        yield f"{len(alike)} findings of {alike[0]['code'].replace('_', ' ')}, see the findings."
        return
    for entry in alike:
        text = entry["statement"].rstrip(".")
        about = f"Recording {entry['recording']!r}: {text}" if entry["recording"] else f"{text[0].upper()}{text[1:]}"
        yield f"{about}."
