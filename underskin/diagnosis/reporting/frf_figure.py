"""The figure of FRFs: magnitude and phase with the models before and after, below what each leaves on the noise's band.

One recording is shown at a time; a menu chooses. A colour, a dash and a marker mean the same as in the figure of
curves: orange, dashed and a square are the model before; blue, solid and a circle the one after; black is what was
measured. The menu changes the numbers of the traces, not the traces, so that hundreds of recordings stay a small file.
"""

from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.reporting.figure_style import AFTER, BAND, BEFORE, MEASURED, TEMPLATE
from underskin.diagnosis.reporting.frf_data import ShownFrf
from underskin.diagnosis.reporting.line_styles import PAPER, SHOWN, WHOLE_NUMBERS, decade_ticks, is_logarithmic
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.units import Floats

_ROWS = (0.34, 0.2, 0.23, 0.23)  # heights of the panels
_HEIGHT = 700  # pixels
_LEAST_PHASE = 10.0  # ° to each side, so that noise is not magnified
_LONG_TITLE = 11  # pixels: as long as a panel is high where a window is narrow
_ROOM = 0.08  # at either end of an axis
_IN_VIEW = 10.0  # times the noise's band: as far as residuals are in view at first
_FEW = 3  # lines, up to which a model's have markers
_SMALLEST, _NONE = 0.05, 1e-9  # of a recording's largest response, and pC/N: smaller ones are no scale for a residual
_RESPONSES = ("measured", "before", "after")
_DIGITS, _DIGITS_LEFT = 5, 3  # of responses and frequencies, and of phases and residuals


class _Model(NamedTuple):
    """How a model is called and drawn."""

    shows: str
    name: str
    colour: str
    dash: str
    marker: str


class _Trace(NamedTuple):
    """What it shows, on which of the four panels, and how."""

    shows: str
    panel: int
    unit: str
    look: dict[str, Any]


def frf_figure(recordings: Sequence[ShownFrf], before: str, after: str) -> go.Figure:
    """Of recordings, the first at first; `before` and `after`: what the models are called, `before` empty where they
    are one. `layout.meta` has the recordings' names, sensors, spheres and preloads, what either model leaves of them,
    and what each trace shows."""
    models = [_Model("after", after, AFTER, SHOWN, "circle")]
    if before:
        models.insert(0, _Model("before", before, BEFORE, PAPER, "square-open"))
    few = min(len(one.frequency_hz) for one in recordings) <= _FEW
    traces = _traces(models, few)
    figure = make_subplots(4, 1, shared_xaxes=True, vertical_spacing=0.035, row_heights=_ROWS)
    numbers = [_numbers(one, [trace.shows for trace in traces]) for one in recordings]
    for place, trace in enumerate(traces):
        axis = "" if trace.panel == 1 else str(trace.panel)
        figure.add_trace(
            {
                "type": "scatter",
                "xaxis": f"x{axis}",
                "yaxis": f"y{axis}",
                "hovertemplate": f"%{{x:.4g}} Hz: %{{y:.4g}} {trace.unit}<extra></extra>",
                **{name: column[place] for name, column in numbers[0].items()},
                **trace.look,
            }
        )
    lines_hz = np.concatenate([one.frequency_hz for one in recordings])
    figure.update_xaxes(type="log", dtick=decade_ticks(lines_hz), **WHOLE_NUMBERS)
    figure.update_xaxes(title="frequency [Hz]", row=4, col=1)
    titles = ("|FRF| [pC/N]", "phase [°]", "residual,<br>in phase [%]", "residual, out<br>of phase [%]")
    for row, title in enumerate(titles, start=1):
        figure.update_yaxes(title=title, row=row, col=1)
    for row in (3, 4):
        figure.update_yaxes(title_font_size=_LONG_TITLE, row=row, col=1)
    figure.update_yaxes(**WHOLE_NUMBERS, row=1, col=1)
    views = [_view(one, bool(before)) for one in recordings]
    for path, value in views[0].items():
        figure.layout[path] = value
    figure.update_layout(
        title="Measured and predicted, recording by recording",
        template=TEMPLATE,
        font={"size": 14, "color": "#222222"},
        height=_HEIGHT,
        margin={"l": 90, "r": 20, "t": 80, "b": 100},
        legend={"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom"},
        meta={
            "recordings": [one.name for one in recordings],
            "sensors": [one.sensor for one in recordings],
            "indenters_mm": [one.indenter_radius_mm for one in recordings],
            "preloads_n": [one.preload_n for one in recordings],
            "left_percent": [
                [float(f"{left:.3g}") for left in (one.left_before, one.left_after)] for one in recordings
            ],
            "shows": [trace.shows for trace in traces],
        },
    )
    if len(recordings) > 1:
        figure.update_layout(updatemenus=[_menu(recordings, numbers, views, bool(before))])
    return figure


def _traces(models: Sequence[_Model], few: bool) -> list[_Trace]:
    """In the order in which they are drawn."""
    dots = {"mode": "markers", "marker": {"color": MEASURED, "symbol": "circle-open", "size": 5}}
    traces = [_Trace("measured", 1, "pC/N", {**dots, "name": "measured", "legendgroup": "measured"})]
    traces.append(_Trace("measured phase", 2, "°", {**dots, "legendgroup": "measured", "showlegend": False}))
    for panel, part in ((3, "real"), (4, "imaginary")):
        edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "legendgroup": "band"}
        named = {"name": "95 % of the noise", "fill": "tonexty", "fillcolor": BAND, "showlegend": panel == 3}
        traces.append(_Trace(f"noise {part} low", panel, "%", {**edge, "showlegend": False}))
        traces.append(_Trace(f"noise {part} high", panel, "%", {**edge, **named}))
    for model in models:
        name = model.name if len(models) == 1 else f"{model.shows}: {model.name}"
        marker = {"color": model.colour, "symbol": model.marker, "size": 5}
        line = {
            "mode": "lines+markers" if few else "lines",
            "line": {"color": model.colour, "width": 2, "dash": model.dash},
            "marker": marker,
            "legendgroup": model.shows,
        }
        traces.append(_Trace(model.shows, 1, "pC/N", {**line, "name": escape(name)}))
        traces.append(_Trace(f"{model.shows} phase", 2, "°", {**line, "showlegend": False}))
        left = {"mode": "markers", "marker": marker, "legendgroup": model.shows, "showlegend": False}
        traces.append(_Trace(f"residual {model.shows} real", 3, "%", left))
        traces.append(_Trace(f"residual {model.shows} imaginary", 4, "%", left))
    return traces


def _columns(one: ShownFrf) -> dict[str, Floats]:
    """What the traces show of a recording, by their `shows`: each (shown,); residuals and noise in percent of what is
    predicted after, or of 5 % of the largest where that is less."""
    before, phase = (np.degrees(np.unwrap(np.angle(predicted))) for predicted in (one.before, one.after))
    columns = {
        "measured": np.abs(one.measured),
        "measured phase": phase + np.degrees(np.angle(one.measured * one.after.conj())),
        "after phase": phase,
        "before phase": before + 360 * np.round((phase[0] - before[0]) / 360),
    }
    size = np.abs(one.after)
    percent = 100 / np.maximum(size, max(_SMALLEST * float(size.max()), _NONE))
    for part, deviation in zip(("real", "imaginary"), one.deviation, strict=True):
        half = SDS_OF_95 * deviation * percent
        columns |= {f"noise {part} low": -half, f"noise {part} high": half}
    for name, predicted in (("before", one.before), ("after", one.after)):
        left = (one.measured - predicted) * percent
        columns |= {name: np.abs(predicted)}
        columns |= {f"residual {name} real": left.real, f"residual {name} imaginary": left.imag}
    return columns


def _numbers(one: ShownFrf, shows: Sequence[str]) -> dict[str, list[Any]]:
    """x and y of every trace, to the digits that a figure shows."""
    columns, frequency = _columns(one), _short(one.frequency_hz, _DIGITS)
    return {
        "x": [frequency for _ in shows],
        "y": [_short(columns[name], _DIGITS if name in _RESPONSES else _DIGITS_LEFT) for name in shows],
    }


def _short(values: Floats, digits: int) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in values.tolist()]


def _view(one: ShownFrf, both: bool) -> dict[str, Any]:
    """What of the layout is a recording's own, by path; `both`: whether there is a model before."""
    columns = _columns(one)
    names = ("measured", "before", "after") if both else ("measured", "after")
    sizes = np.concatenate([columns[name] for name in names])
    wide = is_logarithmic(sizes, float(np.median(columns["measured"])))
    low, high = (np.log10([sizes.min(), sizes.max()]) if wide else (0.0, sizes.max())) if sizes.max() > 0 else (0, 1)
    room = _ROOM * (high - low)
    view: dict[str, Any] = {
        "yaxis.type": "log" if wide else "linear",
        "yaxis.dtick": decade_ticks(sizes) if wide else None,
        "yaxis.range": [float(low - room) if wide else 0.0, float(high + room)],
    }
    phases = [columns["measured phase" if name == "measured" else f"{name} phase"] for name in names]
    low, high = min(-_LEAST_PHASE, *map(np.min, phases)), max(_LEAST_PHASE, *map(np.max, phases))
    view["yaxis2.range"] = [float(low - _ROOM * (high - low)), float(high + _ROOM * (high - low))]
    for axis, part in ((3, "real"), (4, "imaginary")):
        band = float(columns[f"noise {part} high"].max())
        left = [float(np.abs(columns[f"residual {name} {part}"]).max()) for name in names[1:]]
        reach = max(band, left[-1], min(max(left), _IN_VIEW * band)) * (1 + _ROOM)
        view[f"yaxis{axis}.range"] = [-reach, reach]
    return view


def _menu(
    recordings: Sequence[ShownFrf], numbers: Sequence[dict[str, list[Any]]], views: Sequence[dict[str, Any]], both: bool
) -> dict[str, Any]:
    """Shows one recording; a button's `name` is its label without markup."""
    first = recordings[0].frequency_hz
    alike = all(np.array_equal(one.frequency_hz, first) for one in recordings)
    buttons = []
    for one, own, view in zip(recordings, numbers, views, strict=True):
        label = _label(one, both)
        changed = {"y": own["y"]} if alike else own
        buttons.append({"label": escape(label), "name": label, "method": "update", "args": [changed, view]})
    return {"buttons": buttons, "x": 1, "xanchor": "right", "y": 1.02, "yanchor": "bottom"}


def _label(one: ShownFrf, both: bool) -> str:
    where = f"{one.sensor}, R {one.indenter_radius_mm:.3g} mm, {one.preload_n:.3g} N"
    lines = "" if len(one.frequency_hz) == one.count else f"; {len(one.frequency_hz)} of {one.count} lines"
    before = f"{_percent(one.left_before)} before, " if both else ""
    return f"{one.name} ({where}): misfit {before}{_percent(one.left_after)}{' after' if both else ''}{lines}"


def _percent(value: float) -> str:
    """Two digits, never as a power of ten."""
    return np.format_float_positional(value, precision=2, fractional=False, trim="-") + " %"
