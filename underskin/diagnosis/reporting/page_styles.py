"""Line styles, colours, axes and number formats of pages and figures.

Dashes have one meaning in every figure. Solid: what the figure is about (measured, stated or calculated). Dashed: the
reference model, which is the paper's, or Hertz's or the neo-Hookean law for curves. Dotted: bounds, edges, and what is
left out or shown for comparison only. Lines of one meaning differ by colour, width or markers.

`SCHEME` is the script that adapts figures to the reader's colour scheme in a browser. Numbers in sentences get a minus
sign for the hyphen and readable units for small forces and lengths; stored findings and reports are not changed.
"""

import math
import re
from pathlib import Path

import numpy as np

from underskin.units import Floats, readable_unit

SHOWN, PAPER, BOUND = "solid", "dash", "dot"
PLAIN = {"exponentformat": "none"}  # without it ticks would have prefixes as well as the axis its unit: 10μ of N
# Full labels of a logarithmic axis; plotly would label both 50 and 0.5 as 5.
WHOLE_NUMBERS = {"tickformat": "~g"}
LEAST_PHASE = 10.0  # ° to each side of an axis, so that noise is not magnified
_FEW_DECADES = 2.5  # up to which there is room for labels at 2 and 5
_MOST_POWERS = 9  # of ten, labelled on an axis
_WIDE, _DECADE = 3.0, 10.0  # largest magnitude over the typical and over the smallest, of a logarithmic axis
# The colours of Okabe and Ito, then four more that differ from them in both colour schemes
LINE_COLOURS = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"),
    *("#882255", "#999933", "#332288", "#8B5A2B"),
)


def is_logarithmic(magnitudes: Floats, typical: float) -> bool:
    """Whether an axis of magnitudes (at least one) is logarithmic: the largest is far above the typical, as at a
    resonance, and all are above 0 and span a decade."""
    smallest, largest = float(magnitudes.min()), float(magnitudes.max())
    return largest > _WIDE * typical and largest >= _DECADE * smallest > 0


def decade_ticks(values: Floats) -> str | int:
    """The `dtick` of a logarithmic axis for the values above 0: 1, 2 and 5 of each decade, or powers of ten where these
    would be too close. Plotly's default would print 8, 9 and 10 on top of each other."""
    shown = values[(values > 0) & np.isfinite(values)]
    decades = math.log10(shown.max()) - math.log10(shown.min()) if len(shown) else _MOST_POWERS
    return "D2" if decades <= _FEW_DECADES else math.ceil(decades / _MOST_POWERS)


SCHEME = Path(__file__).parent / "templates" / "scheme.js"


_MINUS = re.compile(r"(?<![\w.−-])-(?=\d)")
_NUMBER = r"[+−-]?\d+(?:\.\d+)?(?:e-\d+)?"
_MEASURED = re.compile(rf"(?<![\w.])({_NUMBER}) (N|mm)\b(?: \(({_NUMBER}) to ({_NUMBER})\))?")
FIELD_OF = {"N": "force_n", "mm": "displacement_mm"}  # a field for each unit that has smaller ones


def with_minus(text: str) -> str:
    """A text with minus signs for the hyphens of negative numbers; names and dates keep their hyphens."""
    return _MINUS.sub("−", text)


def in_readable_units(sentence: str) -> str:
    """A sentence with forces and lengths in readable units, as in figures, and minus signs."""
    return with_minus(_MEASURED.sub(_readable, sentence))


def without_powers(sentence: str) -> str:
    """A sentence in which forces and lengths written as a power of ten, with their intervals, are in readable units."""
    return _MEASURED.sub(lambda match: _readable(match) if "e-" in match[1] else match[0], sentence)


def _readable(match: re.Match[str]) -> str:
    unit, count = readable_unit(FIELD_OF[match[2]], abs(_value(match[1])))
    if count == 1:
        return match[0]
    value, *ends = (_scaled(text, count) for text in match.group(1, 3, 4) if text is not None)
    return f"{value} {unit}" + (f" ({ends[0]} to {ends[1]})" if ends else "")


def _value(text: str) -> float:
    return float(text.replace("−", "-"))


def _scaled(text: str, count: float) -> str:
    return f"{count * _value(text):{'+' if text.startswith('+') else ''}.4g}"
