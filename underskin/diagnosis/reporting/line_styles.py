"""What the dash of a line means, the same in every figure.

Solid is what a figure is about: measured, stated by a diagnosis, or calculated for what was asked. Dashed is the
paper's model beside it, Hertz's or the neo-Hookean law for curves. Dotted is a bound or an edge, and what is left
out or stands there for comparison alone. Lines of one meaning are told apart by colour, width or markers.
"""

import math

import numpy as np

from underskin.units import Floats

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
