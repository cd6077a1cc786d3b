"""Numbers, times and words as pages show them: short, with the exact value under the pointer."""

import math
from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

import orjson
from markupsafe import Markup, escape

from underskin.findings.formatting import in_percent, significant

_UNSAFE = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026", 0x2028: "\\u2028", 0x2029: "\\u2029"}


def number(value: float | None, unit: str = "", digits: int = 3) -> Markup:
    """A computed number to so many digits, with its unit; the pointer shows all its digits."""
    shown, exact = short_and_exact(value, unit, digits)
    return _with_unit(shown, exact, unit)


def given(value: float | None, unit: str = "") -> Markup:
    """A number as somebody gave it, with its unit."""
    return _with_unit("–" if value is None else f"{value:.6g}", "" if value is None else repr(value), unit)


def short_and_exact(value: float | None, unit: str, digits: int) -> tuple[str, str]:
    """A number to so many digits, and with its unit all of it."""
    if value is None or not math.isfinite(value):
        return "–", "not known"
    shown = significant(value, digits, trailing_zeros=1e-4 <= abs(value) < 1e5)
    return shown.replace("-", "−"), f"{value!r} {unit}".strip()


def _with_unit(shown: str, exact: str, unit: str) -> Markup:
    text = Markup('<span class="number" title="{}">{}</span>').format(exact, shown)
    return text + Markup('&nbsp;<span class="unit">{}</span>').format(unit) if unit else text


def moment(text: str | None, *, date_only: bool = False) -> Markup:
    """A time of the store; a script turns it to the viewer's zone."""
    if text is None:
        return Markup("–")
    when = datetime.fromisoformat(text)
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


FILTERS: Mapping[str, Callable[..., Any]] = {
    "number": number, "given": given, "moment": moment, "json_inside": json_inside, "words": words, "short": short,
    "in_percent": in_percent,
}  # fmt: skip
