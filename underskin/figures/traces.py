"""Raw channels in panels, one above the other."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.figures.style import COLOURS, label, styled
from underskin.recordings.channels import Channel
from underskin.units import Floats, Indices

_MOST_POINTS = 700  # of one channel
_ROW = 130  # pixels
_EDGES = 110
_LEFT_MARGIN = 110  # pixels, for ticks such as -1.25e-7 beside a title of two lines
_LONGEST = 18  # letters of a name beside its axis


def raw_traces(traces: Sequence[Channel], sample_rate_hz: float | None) -> go.Figure:
    """Each real channel over time, or over the sample number; long channels are drawn by their extremes."""
    figure = make_subplots(len(traces), 1, shared_xaxes=True, vertical_spacing=0.12 / len(traces))
    abscissa = "sample %{x}" if sample_rate_hz is None else "%{x:.6g} s"
    for row, trace in enumerate(traces, start=1):
        values = trace.values.real
        chosen = _extremes(values)
        x = chosen if sample_rate_hz is None else chosen / sample_rate_hz
        name = label(trace.name)
        figure.add_scatter(
            x=x,
            y=values[chosen].astype(np.float32),
            mode="lines",
            name=name,
            line={"color": COLOURS[(row - 1) % len(COLOURS)], "width": 1},
            hovertemplate=f"{name}<br>{abscissa}: %{{y:.5g}} {label(trace.unit)}<extra></extra>",
            showlegend=False,
            row=row,
            col=1,
        )
        bare = trace.name.removesuffix(f"[{trace.unit}]").removesuffix(f"({trace.unit})").strip() or trace.name
        short = label(bare if len(bare) <= _LONGEST else bare[: _LONGEST - 1] + "…")
        figure.update_yaxes(title=f"{short}<br>[{label(trace.unit) or '?'}]", tickformat="~g", row=row, col=1)
    figure.update_xaxes(title="sample" if sample_rate_hz is None else "time [s]", row=len(traces), col=1)
    figure.update_layout(margin={"l": _LEFT_MARGIN})
    return styled(figure, "As it came", _EDGES + _ROW * len(traces))


def _extremes(values: Floats) -> Indices:
    """Indices of the samples to draw: all, or the lowest and the highest of each bin."""
    count = len(values)
    if count <= _MOST_POINTS:
        return np.arange(count)
    size = -(-2 * count // _MOST_POINTS)
    bins = values[: count // size * size].reshape(-1, size)
    start = np.arange(len(bins)) * size
    return np.unique(np.concatenate([start + bins.argmin(axis=1), start + bins.argmax(axis=1), [count - 1]]))
