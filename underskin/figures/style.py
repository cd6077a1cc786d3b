"""Common style of all figures: the colours of Okabe and Ito, Cividis and Viridis, distinguishable by colour-blind
readers."""

from collections.abc import Sequence
from functools import cache
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.diagnosis.reporting.page_styles import LINE_COLOURS, PLAIN
from underskin.errors import unequal_lengths
from underskin.units import Floats

COLOURS = LINE_COLOURS[:7]
MARKERS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "star")
INK, GRID, ZONE = "#1b2733", "#e3e7eb", "rgba(0,158,115,0.12)"
_LONGEST_LABEL = 60
_MARKS = 8  # at most, along a line whose colour is not unique
_AXIS = {
    "gridcolor": GRID,
    "zerolinecolor": "#c3cad1",
    "linecolor": "#8a949e",
    "showline": True,
    "ticks": "outside",
    "tickcolor": "#8a949e",
    "ticklen": 4,
    "title": {"standoff": 8},
    **PLAIN,
    # No automargin: it makes the browser draw everything again, three times as long.
}


def styled(figure: go.Figure, title: str, height: int = 420) -> go.Figure:
    """The figure with its title in the common style; `height` in pixels."""
    return figure.update_layout(template=_template(), title=title, height=height)


@cache  # made where a figure is drawn: it takes longer than to import this module
def _template() -> go.layout.Template:
    return go.layout.Template(
        data={"heatmap": [{"colorbar": PLAIN}], "scatter": [{"marker": {"colorbar": PLAIN}}]},
        layout={
            "font": {
                "family": "system-ui, -apple-system, Segoe UI, Helvetica, Arial, sans-serif",
                "size": 13,
                "color": INK,
            },
            "paper_bgcolor": "#ffffff",
            "plot_bgcolor": "#ffffff",
            "colorway": list(COLOURS),
            "hoverlabel": {"font": {"size": 13}},
            "xaxis": _AXIS,
            "yaxis": _AXIS,
            "margin": {"l": 70, "r": 20, "t": 50, "b": 55},
            "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.02, "x": 0},
            "title": {"font": {"size": 16}, "x": 0},
        },
    )


def line_style(number: int, width: float) -> dict[str, Any]:
    """The style of one of many lines: with markers where the colours are used up."""
    line = {"color": COLOURS[number % len(COLOURS)], "width": width}
    if number < len(COLOURS):
        return {"mode": "lines", "line": line}
    return {"line": line, **marked(number // len(COLOURS) - 1)}


def marked(number: int) -> dict[str, Any]:
    """Marks along a line, the `number`th sort of them."""
    return {
        "mode": "lines+markers",
        "marker": {"symbol": MARKERS[number % len(MARKERS)], "size": 6, "maxdisplayed": _MARKS},
    }


def label(text: str) -> str:
    """A name from a campaign for plotly: shortened, with markup escaped."""
    return escape(text if len(text) <= _LONGEST_LABEL else text[: _LONGEST_LABEL - 1] + "…", quote=False)


def as_columns(rows: Sequence[str], **columns: ArrayLike) -> list[Floats]:
    """Columns as arrays (rows,); raises InvalidInput where a length differs from that of `rows`."""
    arrays = []
    for name, column in columns.items():
        array = np.asarray(column, dtype=float)
        if array.shape != (len(rows),):
            raise unequal_lengths(name, array.size, len(rows), "rows")
        arrays.append(array)
    return arrays
