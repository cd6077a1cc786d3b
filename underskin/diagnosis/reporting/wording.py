"""Names and numbers of a report as a page shows them, with a minus sign for the hyphen of negative numbers."""

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from underskin.diagnosis.data.dataset import WORDS
from underskin.diagnosis.data.names import NONE_OF_THESE, NOTHING_MISSING, quantity_in_words
from underskin.diagnosis.reporting.figure_data import AXES
from underskin.diagnosis.reporting.page_styles import FIELD_OF, with_minus, without_powers
from underskin.findings.formatting import capital
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.vocabulary import AXES as FOLLOWED
from underskin.mechanisms.unlisted.vocabulary import followed
from underskin.units import readable_unit

_FINDINGS = {
    "bent": "not proportional to the force",
    "conjugated": "sign of the phase reversed",
    "constant_axis": "never varied",
    "contacts_kept": "contacts beyond the tables kept",
    "curve_not_usable": "curve cannot be used",
    "damaged_samples": "samples damaged",
    "duplicated_recording": "came twice",
    "far_contacts": "contacts far from the sensor",
    "force_acts_once": "a single sweep or blow",
    "force_contradicts_preload": "force and preload disagree",
    "force_steps": "the force leaps",
    "gain_steps": "amplitude off by a factor",
    "held_out_no_better": "no better on other recordings",
    "unusual_scatter": "recordings scatter",
    "curves_differ": "the curves' moduli differ",
    "line_noise_level": "noise differs from line to line",
    "lines_not_finite": "lines without a number",
    "behind_filter": "band behind a filter",
    "constant_phase": "constant phase",
    "noise_in_frf": "noise in force or charge",
    "no_finite_line": "no usable line",
    "no_line_in_band": "no line in the band",
    "no_simple_law": "no simple law found",
    "one_line": "one frequency only",
    "out_of_domain": "beyond the tables",
    "outlier": "unlike the others",
    "parameter_at_bound": "value at the end of what is possible",
    "remainder": "something is left unexplained",
    "seating": "seating of the sample",
    "series_not_usable": "samples cannot be used",
    "sign_flipped": "sign reversed",
    "units_off_by_1000": "a unit looks wrong",
    "strong": "strong sensor",
    "unusual_magnitude": "unusual size",
    "weak": "weak sensor",
}  # by code; other codes are words already
_UNITS = {"n": "N", "mm": "mm", "s": "s", "h": "h", "hz": "Hz"}  # by the suffix of an axis' name
_FIRST_UNIT = re.compile(r"([^·/]+)((?:[·/].+)?)$")
_POWERS = 1e-4  # below which four digits are written as a power of ten
_NOT_QUOTED = re.compile(r"d33 is not to be quoted: (.+?)(?:; |\.(?:\s|$))")  # the clause of a report's statement


def readable(text: str) -> str:
    """A statement with mechanisms and axes as words (contact resonance for contact_resonance), and small forces and
    lengths in readable units.

    For display only, since a stored report has nothing but sentences.
    """
    pattern, names = _names()
    return with_minus(without_powers(pattern.sub(lambda match: names[match[0]], text)))


@cache
def _names() -> tuple[re.Pattern[str], dict[str, str]]:
    """A pattern that matches any identifier, the longest first, and the words for each."""
    names = {name: name.replace("_", " ") for name in CATALOGUE} | {name: words for name, (words, _) in WORDS.items()}
    return re.compile(rf"\b({'|'.join(sorted(names, key=len, reverse=True))})\b"), names


def words(name: str) -> str:
    """An identifier as words."""
    return name.replace("_", " ")


def finding(code: str) -> str:
    """A short name of a finding."""
    return _FINDINGS.get(code) or words(code)


def axis(name: str) -> str:
    """An axis with its unit."""
    return AXES.get(name, words(name))


def law_range(name: str, ends: Sequence[Any]) -> str:
    """The measured range of a law: "the preload 0.2 to 3 N", or the words of a column."""
    field = name.removesuffix("_over_own")
    unit = _UNITS.get(field.rpartition("_")[2], "")
    description = followed(field if field in FOLLOWED else field.removesuffix("_h"))
    if all(isinstance(end, str) for end in ends):
        return f"{description}: {', '.join(ends)}"
    relative_words = ", over its own range" if field != name else ""
    return f"{description} {' to '.join(map(number, ends))} {unit}".rstrip() + relative_words


def group(name: str) -> str:
    """A group of recordings such as "preload_n 3.0" by its axis and value; another name unchanged."""
    field, _, value = name.partition(" ")
    return f"{axis(field)}: {value}" if field in {*AXES, *WORDS, *FOLLOWED} else name


def number(value: float | None, digits: int = 4) -> str:
    """A number to four digits, or to three as in the statement next to it."""
    return "–" if value is None else with_minus(f"{value:.{digits}g}")


def error(value: float | None) -> str:
    """An error [%]."""
    return "–" if value is None else f"{value:.3g} %"


def interval(parameter: Mapping[str, Any]) -> str:
    """From low to high."""
    return f"{number(parameter['low'])} to {number(parameter['high'])}"


def in_its_unit(parameter: Mapping[str, Any]) -> dict[str, Any]:
    """A parameter in a readable unit, where its value would be written as a power of ten; of N·s/mm, in nN·s/mm."""
    first = _FIRST_UNIT.match(parameter["unit"])
    field, rest = (FIELD_OF.get(first[1]), first[2]) if first else (None, "")
    ends = {name: parameter[name] for name in ("value", "low", "high")}
    if field is None or None in ends.values() or (largest := max(map(abs, ends.values()))) >= _POWERS:
        return dict(parameter)
    unit, count = readable_unit(field, largest)
    return {**parameter, **{name: count * end for name, end in ends.items()}, "unit": unit + rest}


def not_quoted(report: Mapping[str, Any]) -> str:
    """The interval of d33 and why it is not to be quoted, from the report's statement; empty where not stated."""
    match = _NOT_QUOTED.search(report["statement"])
    return readable(match[1]) if match else ""


def unit(label: str) -> str:
    """The unit; empty for a pure number."""
    return "" if label == "-" else label


def quantity(parameter: str) -> str:
    """A quantity of skins in words."""
    return capital(quantity_in_words(parameter))


def answers(report: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The stated answer, and the alternatives."""
    stated = {"no_mismatch": [NOTHING_MISSING], "unexplained": [NONE_OF_THESE]}
    leader = stated.get(report["verdict"]) or [mechanism["name"] for mechanism in report["mechanisms"]]
    return [{"mechanisms": leader, "probability": report["probability"], "why_not": ""}, *report["alternatives"]]


def columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """All fields of the rows, in the order of first occurrence."""
    return list(dict.fromkeys(name for row in rows for name in row))


def planned_columns(recordings: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Planned recordings as columns, None where a recording lacks the field; a position is one text."""
    return {name: [in_a_cell(recording.get(name)) for recording in recordings] for name in columns(recordings)}


def in_a_cell(value: Any) -> Any:
    """A value of a planned recording as it stands in a cell; the two coordinates of a position joined by a blank."""
    return " ".join(map(str, value)) if isinstance(value, list) else value


def plain(value: Any) -> str:
    """A value of a planned recording as text."""
    if isinstance(value, list):
        return ", ".join(map(plain, value))
    if isinstance(value, float) and math.isfinite(value):
        return number(value)
    return "" if value is None else str(value)
