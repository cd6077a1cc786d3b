"""Numbers, times, words and noted conditions as pages show them: short, with the exact value as tooltip."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, time
from typing import Any

import orjson
from markupsafe import Markup, escape

from underskin.diagnosis.reporting.page_styles import in_readable_units, with_minus
from underskin.findings.formatting import in_digits, in_percent, significant
from underskin.recordings.readers.text import in_lab

_UNSAFE = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026", 0x2028: "\\u2028", 0x2029: "\\u2029"}
_LOPSIDED = 1.1  # how many times as far up as down: less is not seen in the digits of an interval

_RECORDINGS = {"frf": "FRFs", "indentation": "indentation curves", "compression": "compression or tension curves"}
_KIND = {"frf": "FRF", "compression": "compression or tension"}
Noted = Mapping[str, float | str]
_MOST_CONDITIONS = 8  # columns


def number(value: float | None, unit: str = "", digits: int = 3) -> Markup:
    """A computed number to so many digits, with its unit; the tooltip shows all digits."""
    shown, exact = short_and_exact(value, unit, digits)
    return _with_unit(shown, exact, unit)


def interval(value: float | None, low: float | None, high: float | None, unit: str = "") -> Markup:
    """A number with its 95 % interval, rounded according to its width: 13.25 (95 %: 13.11 to 13.39)."""
    if value is None or low is None or high is None or not all(map(math.isfinite, (value, low, high))):
        return number(value, unit)
    shown = [_to_places(bound, _places(low, high)) for bound in (value, low, high)]
    text = Markup('<b><span class="number" title="{}">{}</span></b>').format(f"{value!r} {unit}".strip(), shown[0])
    if unit:
        text += Markup('&nbsp;<span class="unit">{}</span>').format(unit)
    ends = Markup(
        ' <span class="quiet" title="with a probability of 95 % it lies between these">(95 %: {} to {})</span>'
    )
    return text + ends.format(*shown[1:])


def reaches_up(value: float | None, low: float | None, high: float | None) -> bool:
    """Whether an interval extends clearly further above its value than below."""
    return value is not None and low is not None and high is not None and high - value > _LOPSIDED * (value - low)


def end_of(value: float | None, low: float | None, high: float | None) -> Markup:
    """One of the three numbers of `interval`, to the same digits."""
    if value is None or low is None or high is None or not all(map(math.isfinite, (value, low, high))):
        return number(value)
    return _with_unit(_to_places(value, _places(low, high)), repr(value), "")


def _places(low: float, high: float) -> int:
    """Decimal places that show two digits of half an interval's width."""
    half = (high - low) / 2
    return 3 if not half > 0 else min(9, max(0, 1 - math.floor(math.log10(half))))


def _to_places(value: float, places: int) -> str:
    return f"{value:z.{places}f}".replace("-", "−")  # without a sign where 0 is shown


def given(value: float | None, unit: str = "") -> Markup:
    """A number as entered, with its unit."""
    if value is None:
        return _with_unit("–", "", "")
    return _with_unit(with_minus(f"{value or 0.0:.6g}"), repr(value), unit)


def short_and_exact(value: float | None, unit: str, digits: int) -> tuple[str, str]:
    """A number to so many digits, and with its unit all of it."""
    if value is None or not math.isfinite(value):
        return "–", "not known"
    shown = significant(value or 0.0, digits, trailing_zeros=1e-4 <= abs(value) < 1e5)  # 0 has no sign
    return shown.replace("-", "−"), f"{value!r} {unit}".strip()


def change_in_percent(percent: float, digits: int = 2) -> str:
    """A change with its sign, never as a power of ten."""
    return f"{'−' if percent < 0 else '+'}{in_digits(abs(percent), digits)}"


def _with_unit(shown: str, exact: str, unit: str) -> Markup:
    text = Markup('<span class="number" title="{}">{}</span>').format(exact, shown)
    return text + Markup('&nbsp;<span class="unit">{}</span>').format(unit) if unit else text


def limit(value: float) -> str:
    """A number that may be infinite."""
    return "∞" if math.isinf(value) else f"{value:g}"


def moment(text: str | None, *, date_only: bool = False) -> Markup:
    """A time of the store; a script turns it to the viewer's zone. A date without a time is that day everywhere."""
    if text is None:
        return Markup("–")
    when = datetime.fromisoformat(text)
    local = in_lab(when)
    if local.time() == time():  # midnight to the microsecond is a date that was given without a time
        return Markup('<time datetime="{0}" data-form="day">{0}</time>').format(local.date())
    shown = when.strftime("%Y-%m-%d" if date_only else "%Y-%m-%d %H:%M UTC")
    form = Markup(' data-form="date"') if date_only else ""
    return Markup('<time datetime="{}"{}>{}</time>').format(text, form, shown)


def json_inside(document: Any) -> Markup:
    """JSON (or an object that becomes JSON) that may stand inside a script element."""
    text = document if isinstance(document, str) else orjson.dumps(document).decode()
    return Markup(text.translate(_UNSAFE))  # noqa: S704 -- nothing in it can end the element


def words(name: str) -> str:
    """A name of the code as words."""
    return name.replace("_", " ")


def short(text: str, most: int = 60) -> Markup:
    """A name that may be long: cut, the whole under the pointer."""
    if len(text) <= most:
        return escape(text)
    return Markup('<span title="{}">{}…</span>').format(text[:1000], text[: most - 1])


def capitalize_first(text: str) -> str:
    """A text as a sentence begins."""
    return text[:1].upper() + text[1:]


def recordings(kinds: Sequence[str]) -> str:
    """Kinds of recordings in words."""
    return ", ".join(_RECORDINGS.get(kind, kind) for kind in kinds)


def kind(name: str) -> str:
    """The kind of a recording in words."""
    return _KIND.get(name, name)


FILTERS: Mapping[str, Callable[..., Any]] = {
    "number": number, "given": given, "moment": moment, "json_inside": json_inside, "words": words, "short": short,
    "in_percent": in_percent, "interval": interval, "end_of": end_of, "change_in_percent": change_in_percent,
    "capitalize_first": capitalize_first, "limit": limit, "recordings": recordings, "reaches_up": reaches_up,
    "in_readable_units": in_readable_units, "kind": kind,
}  # fmt: skip


@dataclass(frozen=True)
class ConditionColumn:
    """A name, and whether all that was noted under it are numbers."""

    name: str
    numeric: bool


@dataclass(frozen=True)
class ConditionColumns:
    """The shown columns, and the names of those without room."""

    shown: Sequence[ConditionColumn]
    others: Sequence[str]


def condition_columns(recordings: Iterable[Noted | None]) -> ConditionColumns:
    """Every name that any of the recordings has, in the order of their appearance."""
    numeric: dict[str, bool] = {}
    for noted in recordings:
        for name, value in (noted or {}).items():
            numeric[name] = numeric.get(name, True) and not isinstance(value, str)
    columns = [ConditionColumn(name, all_numbers) for name, all_numbers in numeric.items()]
    return ConditionColumns(columns[:_MOST_CONDITIONS], [column.name for column in columns[_MOST_CONDITIONS:]])
