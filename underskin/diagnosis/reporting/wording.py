"""Names and numbers of a report as a page has them, numbers with a minus for a hyphen."""

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from underskin.diagnosis.data.dataset import WORDS
from underskin.diagnosis.data.names import quantity_in_words
from underskin.diagnosis.reporting.figure_data import AXES
from underskin.diagnosis.reporting.law_statement import capital
from underskin.diagnosis.reporting.page_styles import FIELD_OF, with_minus, without_powers
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
    "force_acts_once": "a single sweep or blow",
    "force_contradicts_preload": "force and preload disagree",
    "gain_steps": "amplitude off by a factor",
    "held_out_no_better": "no better on other recordings",
    "imitated": "another cause looks the same",
    "line_noise_level": "noise differs from line to line",
    "lines_not_finite": "lines without a number",
    "behind_filter": "band behind a filter",
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
    "units_off_by_1000": "unit off by a factor of 1000",
    "unusual_magnitude": "unusual size",
}  # by code; the other codes are words already
_UNITS = {"n": "N", "mm": "mm", "s": "s", "h": "h", "hz": "Hz"}  # by the end of an axis' name
_POWERS = 1e-4  # below which four digits are written as a power of ten
_NOT_QUOTED = re.compile(r"d33 is not to be quoted: (.+?)(?:; |\.(?:\s|$))")  # the clause of a report's statement


def readable(text: str) -> str:
    """A statement with the names of mechanisms and axes as words, contact resonance for contact_resonance, and its
    small forces and lengths in units in which they read well.

    A stored report has sentences alone. This is for display; nothing is decided by it.
    """
    pattern, names = _names()
    return with_minus(without_powers(pattern.sub(lambda match: names[match[0]], text)))


@cache
def _names() -> tuple[re.Pattern[str], dict[str, str]]:
    """What each name of the code is in words, and what matches any of them, the longest first."""
    names = {name: name.replace("_", " ") for name in CATALOGUE} | {name: words for name, (words, _) in WORDS.items()}
    return re.compile(rf"\b({'|'.join(sorted(names, key=len, reverse=True))})\b"), names


def words(name: str) -> str:
    """A name of the code as words."""
    return name.replace("_", " ")


def finding(code: str) -> str:
    """What a finding is about, in short."""
    return _FINDINGS.get(code) or words(code)


def axis(name: str) -> str:
    """An axis with its unit."""
    return AXES.get(name, words(name))


def law_range(name: str, ends: Sequence[Any]) -> str:
    """Where such a law was measured: "the preload 0.2 to 3 N", or the words that a column has."""
    field = name.removesuffix("_over_own")
    unit = _UNITS.get(field.rpartition("_")[2], "")
    description = followed(field if field in FOLLOWED else field.removesuffix("_h"))
    if all(isinstance(end, str) for end in ends):
        return f"{description}: {', '.join(ends)}"
    relative_words = ", over its own range" if field != name else ""
    return f"{description} {' to '.join(map(number, ends))} {unit}".rstrip() + relative_words


def group(name: str) -> str:
    """A group of recordings, "preload_n 3.0", by its axis and value; another as it is called."""
    field, _, value = name.partition(" ")
    return f"{axis(field)}: {value}" if field in {*AXES, *WORDS, *FOLLOWED} else name


def number(value: float | None) -> str:
    """Four digits."""
    return "–" if value is None else with_minus(f"{value:.4g}")


def as_stated(value: float | None) -> str:
    """To the three digits of a statement, beside which it stands."""
    return "–" if value is None else with_minus(f"{value:.3g}")


def error(value: float | None) -> str:
    """An error [%]."""
    return "–" if value is None else f"{value:.3g} %"


def interval(parameter: Mapping[str, Any]) -> str:
    """From low to high."""
    return f"{number(parameter['low'])} to {number(parameter['high'])}"


def in_its_unit(parameter: Mapping[str, Any]) -> dict[str, Any]:
    """A parameter in the unit in which its value reads well, where that would be a power of ten."""
    field, ends = FIELD_OF.get(parameter["unit"]), {name: parameter[name] for name in ("value", "low", "high")}
    if field is None or None in ends.values() or (largest := max(map(abs, ends.values()))) >= _POWERS:
        return dict(parameter)
    unit, count = readable_unit(field, largest)
    return {**parameter, **{name: count * end for name, end in ends.items()}, "unit": unit}


def not_quoted(report: Mapping[str, Any]) -> str:
    """Where its d33 lies and why it is not to be quoted, as the report states it; empty where that is not stated."""
    match = _NOT_QUOTED.search(report["statement"])
    return readable(match[1]) if match else ""


def unit(label: str) -> str:
    """Empty for a pure number."""
    return "" if label == "-" else label


def quantity(parameter: str) -> str:
    """A quantity of skins, in words."""
    return capital(quantity_in_words(parameter))


def columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The fields that any of them has, in the order in which they first come."""
    return list(dict.fromkeys(name for row in rows for name in row))


def planned_columns(recordings: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Planned recordings as columns, None where a recording lacks the field; a position, two numbers, is one text."""
    return {name: [in_a_cell(recording.get(name)) for recording in recordings] for name in columns(recordings)}


def in_a_cell(value: Any) -> Any:
    """A value of a planned recording; a position, which has two, with a blank between them."""
    return " ".join(map(str, value)) if isinstance(value, list) else value


def plain(value: Any) -> str:
    """A value of a planned recording."""
    if isinstance(value, list):
        return ", ".join(map(plain, value))
    if isinstance(value, float) and math.isfinite(value):
        return number(value)
    return "" if value is None else str(value)
