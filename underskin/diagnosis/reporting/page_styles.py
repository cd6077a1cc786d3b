"""How pages and figures look.

What the dash of a line means, the same in every figure.

Solid is what a figure is about: measured, stated by a diagnosis, or calculated for what was asked. Dashed is the
paper's model beside it, Hertz's or the neo-Hookean law for curves. Dotted is a bound or an edge, and what is left
out or stands there for comparison alone. Lines of one meaning are told apart by colour, width or markers.

The script that shows figures in the reader's colours, wherever a browser draws them: in a page or a file.

Numbers in sentences as pages and figures set them: a minus sign for a hyphen, small forces and lengths in a unit in
which they read well. Stored findings and reports stay as they are.
"""

import math
import re
from pathlib import Path

import numpy as np

from underskin.units import Floats, readable_unit

SHOWN, PAPER, BOUND = "solid", "dash", "dot"
# Labels of a logarithmic axis in full, else 50 and 0.5 were both a 5 beside it.
WHOLE_NUMBERS = {"tickformat": "~g"}
_FEW_DECADES = 2.5  # up to which 2 and 5 have room beside each other
_MOST_POWERS = 9  # of ten, that an axis labels
_WIDE, _DECADE = 3.0, 10.0  # largest magnitude over the typical and over the smallest, of a logarithmic axis
# Of many lines beside each other: the colours of Okabe and Ito, then four more that differ from them in both schemes.
LINE_COLOURS = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"),
    *("#882255", "#999933", "#332288", "#8B5A2B"),
)


def is_logarithmic(magnitudes: Floats, typical: float) -> bool:
    """Whether an axis of magnitudes, of which there are any, is logarithmic: where a resonance exceeds what is typical
    by far, and all are above 0 and span a decade."""
    smallest, largest = float(magnitudes.min()), float(magnitudes.max())
    return largest > _WIDE * typical and largest >= _DECADE * smallest > 0


def decade_ticks(values: Floats) -> str | int:
    """The `dtick` of a logarithmic axis of those values that are above 0: 1, 2 and 5 of each decade, or, where these
    would be too close, the powers of ten; plotly's own would label 8, 9 and 10 on top of each other."""
    shown = values[(values > 0) & np.isfinite(values)]
    decades = math.log10(shown.max()) - math.log10(shown.min()) if len(shown) else _MOST_POWERS
    return "D2" if decades <= _FEW_DECADES else math.ceil(decades / _MOST_POWERS)


SCHEME = Path(__file__).parent / "templates" / "scheme.js"


_MINUS = re.compile(r"(?<![\w.−-])-(?=\d)")
_NUMBER = r"[+−-]?\d+(?:\.\d+)?(?:e-\d+)?"
_MEASURED = re.compile(rf"(?<![\w.])({_NUMBER}) (N|mm)\b(?: \(({_NUMBER}) to ({_NUMBER})\))?")
FIELD_OF = {"N": "force_n", "mm": "displacement_mm"}  # a field of each unit that has smaller ones


def with_minus(text: str) -> str:
    """A text with the sign of its negative numbers as a minus; names and dates keep their hyphens."""
    return _MINUS.sub("−", text)


def in_readable_units(sentence: str) -> str:
    """A sentence with each force and length in the unit in which it reads well, as figures have it, and minus signs."""
    return with_minus(_MEASURED.sub(_readable, sentence))


def without_powers(sentence: str) -> str:
    """A sentence with those forces and lengths in such a unit that are written as a power of ten, and the interval
    behind each."""
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
