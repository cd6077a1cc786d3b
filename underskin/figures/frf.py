"""FRFs over frequency: magnitude, phase and coherence, with the flat zone."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.colors import sample_colorscale
from plotly.subplots import make_subplots

from underskin.diagnosis.reporting.page_styles import LEAST_PHASE, WHOLE_NUMBERS, decade_ticks, is_logarithmic
from underskin.figures.style import ZONE, label, line_style, marked, styled
from underskin.recordings.frf.thinned_lines import FrfLines, FrfSpread
from underskin.units import Floats

PlotlyTrace = dict[str, Any]
Condition = tuple[float, float]  # radius of the indenter [mm], preload [N]

_AXES = ("", "2", "3")  # of the panels
_UNITS = (" pC/N", "°", "")
_HEIGHT = 640
_MOST_IN_LEGEND = 12
_MOST_PAIRS = _MOST_IN_LEGEND // 2
_BRIGHTEST = 0.85  # of Viridis; lighter colours are invisible on white


def frf_overview(spreads: Sequence[FrfSpread], zone_hz: tuple[float, float] | None) -> go.Figure:
    """Median magnitude and phase and lowest coherence of each condition, with the range of its magnitudes as a band."""
    traces: list[PlotlyTrace] = []
    for number, spread in enumerate(spreads):
        colour, look = _look(_condition(spread), list(map(_condition, spreads)))
        name = f"R {spread.indenter_radius_mm:.3g} mm, {spread.preload_n:.3g} N ({spread.recordings})"
        low, middle, high = spread.magnitude_pc_per_n
        band = {
            "type": "scatter",
            "x": _short(np.concatenate([spread.frequency_hz, spread.frequency_hz[::-1]])),
            "y": _short(np.concatenate([high, low[::-1]])),
            "fill": "toself",
            "fillcolor": colour.replace("rgb(", "rgba(").replace(")", ", 0.12)"),
            "line": {"width": 0},
            "hoverinfo": "skip",
            "showlegend": False,
            "legendgroup": str(number),
        }
        parts = (middle, spread.phase_deg[1], spread.coherence[0])
        traces += [band, *_lines(name, str(number), spread.frequency_hz, parts, look)]
    return _finished(traces, zone_hz, "FRF: median and range of the recordings alike")


def frf_recordings(
    recordings: Sequence[FrfLines], zone_hz: tuple[float, float] | None, conditions: Sequence[Condition] = ()
) -> go.Figure:
    """The lines of each recording; for many recordings names are in hover texts only. `conditions`: one per
    recording, which sets its style as in `frf_overview`; without them each recording has its own style."""
    traces: list[PlotlyTrace] = []
    looks = [_look(condition, conditions)[1] for condition in conditions] or [
        line_style(n, 1.2) for n in range(len(recordings))
    ]
    for number, (recording, look) in enumerate(zip(recordings, looks, strict=True)):
        parts = (recording.magnitude_pc_per_n, recording.phase_deg, recording.coherence)
        traces += _lines(label(recording.name), str(number), recording.frequency_hz, parts, look)
    figure = _finished(traces, zone_hz, "FRF of each recording")
    return figure.update_layout(showlegend=len(recordings) <= _MOST_IN_LEGEND)


def frf_pair(first: Sequence[FrfSpread], second: Sequence[FrfSpread]) -> go.Figure | None:
    """The medians of two campaigns laid over each other under the conditions that both have, the first dashed, of many
    conditions some; None without a common one."""
    of_first = {_condition(spread): spread for spread in first}
    common = [spread for spread in second if _condition(spread) in of_first]
    if not common:
        return None
    shown = [common[number] for number in sorted({*np.linspace(0, len(common) - 1, _MOST_PAIRS).astype(int).tolist()})]
    traces: list[PlotlyTrace] = []
    for number, after in enumerate(shown):
        _, look = _look(_condition(after), list(map(_condition, shown)))
        name = f"R {after.indenter_radius_mm:.3g} mm, {after.preload_n:.3g} N"
        for which, spread, dash in (("first", of_first[_condition(after)], "dash"), ("second", after, "solid")):
            parts = (spread.magnitude_pc_per_n[1], spread.phase_deg[1], spread.coherence[0])
            styled_look = {**look, "line": {**look["line"], "dash": dash}}
            traces += _lines(f"{which}, {name}", str(number), spread.frequency_hz, parts, styled_look)
    return _finished(traces, None, "FRFs of both campaigns")


def _lines(
    name: str, group: str, frequency_hz: Floats, parts: Sequence[Floats], look: dict[str, Any]
) -> Iterator[PlotlyTrace]:
    """Magnitude, phase and coherence in three panels, without those that were not recorded.

    Traces are given as dictionaries, which plotly validates once.
    """
    for axis, unit, values in zip(_AXES, _UNITS, parts, strict=True):
        if not np.isnan(values).all():
            yield {
                "type": "scatter",
                "x": _short(frequency_hz),
                "y": _short(values),
                "xaxis": f"x{axis}",
                "yaxis": f"y{axis}",
                "name": name,
                "legendgroup": group,
                "showlegend": axis == "",
                **look,
                "hovertemplate": f"{name}<br>%{{x:.4g}} Hz: %{{y:.5g}}{unit}<extra></extra>",
            }


def _finished(traces: Sequence[PlotlyTrace], zone_hz: tuple[float, float] | None, title: str) -> go.Figure:
    figure = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.04, row_heights=[0.5, 0.27, 0.23])
    figure.add_traces(traces)
    if zone_hz is not None:
        figure.add_vrect(x0=zone_hz[0], x1=zone_hz[1], fillcolor=ZONE, line_width=0, layer="below")
        figure.add_annotation(
            text="flat zone", x=np.log10(zone_hz[0]), y=1, yref="y domain", xanchor="left", yanchor="top",
            showarrow=False, font={"size": 12, "color": "#00664b"},
        )  # fmt: skip
    lines_hz = np.concatenate([np.asarray(trace["x"]) for trace in traces]) if traces else np.zeros(0)
    figure.update_xaxes(type="log", dtick=decade_ticks(lines_hz), **WHOLE_NUMBERS)
    # An axis without a line is not drawn: where no coherence was recorded, phase is the lowest panel.
    lowest = 3 if len(_values(traces, "y3")) else 2
    figure.update_xaxes(title="frequency [Hz]", showticklabels=True, row=lowest, col=1)
    for row, words in enumerate(("|FRF| [pC/N]", "phase [°]", "coherence"), start=1):
        figure.update_yaxes(title=words, row=row, col=1)
    figure.update_yaxes(**_magnitude_axis(traces), row=1, col=1)
    phases = _values(traces, "y2")
    low, high = np.nanmin(phases, initial=-LEAST_PHASE), np.nanmax(phases, initial=LEAST_PHASE)
    margin = 0.05 * (high - low)
    figure.update_yaxes(range=[low - margin, high + margin], row=2, col=1)
    figure.update_yaxes(range=[0, 1.02], row=3, col=1)
    return styled(figure, title, _HEIGHT)


def _magnitude_axis(traces: Sequence[PlotlyTrace]) -> dict[str, Any]:
    """A logarithmic axis where a resonance exceeds the other values by far."""
    values = _values(traces, "y")
    values = values[values > 0]
    if len(values) and is_logarithmic(values, float(np.median(values))):
        return {"type": "log", "dtick": decade_ticks(values), **WHOLE_NUMBERS}
    return {"rangemode": "tozero"}


def _values(traces: Sequence[PlotlyTrace], axis: str) -> Floats:
    """All values along an axis."""
    return np.concatenate([np.zeros(0), *(trace["y"] for trace in traces if trace.get("yaxis") == axis)])


def _condition(spread: FrfSpread) -> Condition:
    return spread.indenter_radius_mm, spread.preload_n


def _look(condition: Condition, conditions: Sequence[Condition]) -> tuple[str, dict[str, Any]]:
    """Colour by preload, from dark to bright, and the line style: with markers by indenter, except for the smallest."""
    radii, preloads = (sorted(set(values)) for values in zip(*conditions, strict=True))
    shade = _BRIGHTEST * preloads.index(condition[1]) / max(len(preloads) - 1, 1)
    colour = sample_colorscale("Viridis", [shade])[0]
    number = radii.index(condition[0])
    marks = marked(number - 1) if number else {"mode": "lines"}
    return colour, {"line": {"color": colour, "width": 1.5}, **marks}


def _short(values: Floats) -> "np.ndarray[Any, np.dtype[np.float32]]":
    """Values in single precision, which halves the bytes; seven digits are more than a figure shows."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32)
