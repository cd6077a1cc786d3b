"""Findings that decide how far the statement of a report can be trusted, as clauses of that statement."""

from collections import Counter
from collections.abc import Mapping, Sequence

from underskin.diagnosis.reporting.sentences import clause
from underskin.findings.codes import FindingCode
from underskin.mechanisms.base import Kind, Mechanism, Stage
from underskin.mechanisms.registry import CATALOGUE

_SLIPS = (
    *(FindingCode.NO_RESPONSE, FindingCode.IMPOSSIBLE_GEOMETRY, FindingCode.NO_FINITE_LINE, FindingCode.REFUSED),
    *(FindingCode.IMPOSSIBLE_NUMBER, FindingCode.SERIES_NOT_USABLE, FindingCode.CURVE_NOT_USABLE),
    *(
        FindingCode.SENSORS_EXCHANGED,
        FindingCode.WEAK,
        FindingCode.STRONG,
        FindingCode.CONJUGATED,
        FindingCode.GAIN_STEPS,
    ),
    FindingCode.WARM_UP,
    *(FindingCode.FORCE_SATURATES, FindingCode.PERIODIC_ERROR),
    *(
        FindingCode.UNITS_OFF_BY_1000,
        FindingCode.CHANNELS_SWAPPED,
        FindingCode.SIGN_FLIPPED,
        FindingCode.MAINS_IN_CHARGE,
        FindingCode.OUT_OF_DOMAIN,
    ),
    *(FindingCode.CONTACTS_KEPT, FindingCode.DUPLICATED_RECORDING),
)
_RESERVES = (
    *(FindingCode.TIP_SHAPE, FindingCode.THICKNESS_UNKNOWN, FindingCode.IMPLAUSIBLE_D33, FindingCode.REMAINDER),
    *(FindingCode.HELD_OUT_NO_BETTER, FindingCode.IMITATED),
)
_MOST = 2  # findings that are quoted; the others are counted


def slips(findings: Sequence[Mapping[str, str]]) -> list[str]:
    """Clauses on errors in the recordings: on the most decisive ones what they are, on the others how many."""
    return _clauses(findings, _SLIPS)


def reserves(findings: Sequence[Mapping[str, str]]) -> list[str]:
    """Clauses on what the stated answer leaves open: a remainder, an error held out, a d33 that cannot be."""
    return _clauses(findings, _RESERVES)


def _clauses(findings: Sequence[Mapping[str, str]], decisive: Sequence[FindingCode]) -> list[str]:
    chosen = sorted(
        (entry for entry in findings if entry["code"] in decisive),
        key=lambda entry: decisive.index(FindingCode(entry["code"])),
    )
    further = Counter(entry["code"].replace("_", " ") for entry in chosen[_MOST:])
    counted = [f"{count} of {code}" for code, count in further.items()]
    more = [f"further findings: {', '.join(counted)}"] if counted else []
    return [*map(_quoted, chosen[:_MOST]), *more]


def _quoted(entry: Mapping[str, str]) -> str:
    text = clause(entry["statement"])
    return f"recording {entry['recording']!r}: {text}" if entry["recording"] else text


def not_tried(unsupported: Mapping[str, str], kind: Kind) -> list[str]:
    """Clauses on the mechanisms of curves that their recordings do not support, and why: one of them may be what is
    missing. Mechanisms of other kinds of recordings are none of it."""
    return [
        f"{name.replace('_', ' ')} was not tried: {reason}"
        for name, reason in unsupported.items()
        if kind != "frf" and name in CATALOGUE and kind in CATALOGUE[name].kinds and _is_physics(CATALOGUE[name])
    ]


def _is_physics(mechanism: Mechanism) -> bool:
    """Whether it is more than another value of what is declared, which curves without a declared value have free."""
    return mechanism.stage is not Stage.DECLARED
