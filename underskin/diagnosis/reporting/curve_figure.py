"""The figure of curves: force against depth with the models before and after and the marks, below what each leaves on
the noise's band.

One recording is shown at a time; a menu chooses. What a colour means, a dash and a marker mean as well: orange, dashed
and a square are the model before; blue, solid and a circle the one after; black is what was measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.reporting.curve_data import CurvePrediction, Mark, ShownCurve
from underskin.diagnosis.reporting.figure_style import AFTER, BAND, BEFORE, MEASURED, TEMPLATE
from underskin.diagnosis.reporting.line_styles import PAPER, SHOWN
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.mechanisms.base import Kind
from underskin.units import Floats, readable_unit

_MOST_CURVES = 12
_TITLES = {"indentation": "Force against depth", "compression": "Force against displacement"}
_LOADED = 0.02  # of the largest force, from which on a curve is in view from the start
_ROOM = 0.4, 0.05  # of what is in view: the air beside it, if there is any, and the edge
_ALONG = 40  # points along an edge of the band
_HEIGHT, _PANEL = 460, 150  # pixels
_PANEL_TITLE = 12  # smaller than others, that those of two panels do not touch


class _Model(NamedTuple):
    """How a model is called and drawn."""

    shows: str
    name: str
    colour: str
    dash: str
    marker: dict[str, Any]


@dataclass(frozen=True)
class _Drawing:
    """One recording: its traces, and of the layout what is its own, by path."""

    label: str
    traces: list[dict[str, Any]]
    layout: dict[str, Any]


def curve_figure(curves: Sequence[ShownCurve], kind: Kind, before: str, after: str) -> go.Figure:
    """Of the first curves; `before` and `after` are what the models are called, `before` empty where they are one."""
    models = [_Model("after", after, AFTER, SHOWN, {"symbol": "circle", "size": 8})]
    if before:
        models.insert(0, _Model("before", before, BEFORE, PAPER, {"symbol": "square-open", "size": 13}))
    drawings = [_Curve(curve, kind, models).drawing() for curve in curves[:_MOST_CURVES]]
    panels = len(models)
    height = _HEIGHT + _PANEL * panels
    share = 0.8 * _PANEL / height
    figure = make_subplots(
        1 + panels, 1, shared_xaxes=True, vertical_spacing=0.035, row_heights=[1 - panels * share, *[share] * panels]
    )
    for number, drawing in enumerate(drawings):
        figure.add_traces([{**trace, "visible": number == 0} for trace in drawing.traces])
    for path, value in drawings[0].layout.items():
        figure.layout[path] = value
    figure.update_layout(
        title=_TITLES[kind],
        template=TEMPLATE,
        font={"size": 14, "color": "#222222"},
        height=height,
        margin={"r": 20, "t": 80, "b": 130},
        legend={"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "tracegroupgap": 0},
    )
    if len(drawings) > 1:
        figure.update_layout(updatemenus=[_menu(drawings)])
    return figure


class _Curve:
    """One recording in the units in which its numbers read well; depth is counted from the contact point after."""

    def __init__(self, curve: ShownCurve, kind: Kind, models: Sequence[_Model]) -> None:
        self._curve, self._models = curve, models
        self._zero = curve.after.contact.displacement_mm
        deepest = float(np.abs(curve.displacement_mm - self._zero).max())
        self._length, self._per_mm = readable_unit("displacement_mm", deepest)
        self._along = "depth" if kind == "indentation" else "displacement"

    def drawing(self) -> _Drawing:
        """Samples and models above, what each model leaves below, marks on top."""
        curve = self._curve
        every = len(curve.sample_n) == curve.count
        samples = f"{curve.count} samples" if every else f"{len(curve.sample_n)} of {curve.count} samples"
        largest = float(np.abs(curve.sample_n).max())
        dots = {"color": MEASURED, "symbol": "circle-open", "size": 4, "opacity": 0.45}
        measured = {"mode": "markers", "marker": dots, "name": f"measured ({samples})"}
        traces = [self._trace("measured", curve.sample_mm, curve.sample_n, largest, measured)]
        layout: dict[str, Any] = {"yaxis.title.text": f"force [{readable_unit('force_n', largest)[0]}]"}
        residuals = [curve.force_n - self._predicted(model).force_n for model in self._models]
        most = min(float(np.abs(left).max()) for left in residuals)  # the unit of all is the best one's
        for row, (model, left) in enumerate(zip(self._models, residuals, strict=True), start=2):
            alone = len(self._models) == 1
            name = model.name if alone else f"{model.shows}: {model.name}"
            line = {"color": model.colour, "width": 2, "dash": model.dash}
            look: dict[str, Any] = {"mode": "lines", "line": line, "legendgroup": model.shows, "name": escape(name)}
            predicted = self._predicted(model).force_n
            traces.append(self._trace(model.shows, curve.displacement_mm, predicted, largest, look))
            look |= {"showlegend": False, "xaxis": f"x{row}", "yaxis": f"y{row}"}
            traces += self._band(model, most, row)
            traces.append(self._trace(f"residual {model.shows}", curve.displacement_mm, left, most, look))
            which = "residual" if alone else f"residual<br>{model.shows}"
            layout[f"yaxis{row}.title.text"] = f"{which} [{readable_unit('force_n', most)[0]}]"
            layout[f"yaxis{row}.title.font.size"] = _PANEL_TITLE
        traces += [self._mark(name, mark, largest, marker) for name, mark, marker in self._marks()]
        last = len(self._models) + 1
        layout[f"xaxis{last}.title.text"] = f"{self._along} from the contact point [{self._length}]"
        view = self._view()
        layout |= {f"xaxis{row}.range": view for row in ("", *range(2, last + 1))}
        return _Drawing(f"{curve.name}: {curve.left_percent:.2g} % left", traces, layout)

    def _band(self, model: _Model, most: float, row: int) -> list[dict[str, Any]]:
        """What holds 95 % of the residuals of an exact law, on the way in and on the way back."""
        curve = self._curve
        half = SDS_OF_95 * curve.after.deviation_n
        turn = int(curve.displacement_mm.argmax())
        edge: dict[str, Any] = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        edge |= {"xaxis": f"x{row}", "yaxis": f"y{row}", "showlegend": False}
        edge |= {"name": "95 % of the noise", "legendgroup": "band"}
        traces = []
        for name, way in (("in", slice(None, turn + 1)), ("back", slice(turn, None))):
            order = np.argsort(curve.displacement_mm[way])  # an area is filled in one direction
            order = order[np.unique(np.linspace(0, len(order) - 1, _ALONG).astype(int))]
            place, high = curve.displacement_mm[way][order], half[way][order]
            filled = {**edge, "fill": "tonexty", "fillcolor": BAND}
            filled["showlegend"] = row == 2 and name == "in"
            traces.append(self._trace(f"noise {name} {model.shows} low", place, -high, most, edge))
            traces.append(self._trace(f"noise {name} {model.shows} high", place, high, most, filled))
        return traces

    def _predicted(self, model: _Model) -> CurvePrediction:
        return self._curve.before if model.shows == "before" else self._curve.after

    def _marks(self) -> list[tuple[str, Mark, dict[str, Any]]]:
        marks = []
        for model in self._models:
            name = "contact point" if len(self._models) == 1 else f"contact point {model.shows}"
            marks.append((name, self._predicted(model).contact, {"color": model.colour, **model.marker}))
        jumps = (("snap-in", self._curve.snap_in, "down"), ("pull-off", self._curve.pull_off, "up"))
        for name, mark, way in jumps:
            if mark is not None:
                marks.append((name, mark, {"color": MEASURED, "symbol": f"triangle-{way}", "size": 11}))
        return marks

    def _mark(self, name: str, mark: Mark, largest: float, marker: dict[str, Any]) -> dict[str, Any]:
        place, force = np.array([mark.displacement_mm]), np.array([mark.force_n])
        trace = self._trace(name, place, force, largest, {"mode": "markers", "marker": marker, "name": name})
        recorded = f"<br>displacement as recorded: {mark.displacement_mm:.6g} mm<extra></extra>"
        return {**trace, "hovertemplate": trace["hovertemplate"].replace("<extra></extra>", recorded)}

    def _trace(
        self, shows: str, displacement_mm: Floats, force_n: Floats, largest: float, look: dict[str, Any]
    ) -> dict[str, Any]:
        """In the unit in which forces up to `largest` [N] read well. `meta`: what it is, and its units in the lab's."""
        unit, per_n = readable_unit("force_n", largest)
        return {
            "type": "scatter",
            "x": self._depth(displacement_mm),
            "y": (per_n * force_n).astype(np.float32),  # more than an eye can tell
            "meta": {"recording": self._curve.name, "shows": shows, "mm": 1 / self._per_mm, "n": 1 / per_n},
            "hovertemplate": f"{escape(self._curve.name)}, {shows}<br>"
            f"%{{x:.4g}} {self._length}: %{{y:.4g}} {unit}<extra></extra>",
            **look,
        }

    def _depth(self, displacement_mm: Floats) -> Floats:
        return (self._per_mm * (displacement_mm - self._zero)).astype(np.float32)

    def _view(self) -> list[float]:
        """From where to where the abscissa reaches at first: the loaded part and the marks, with some air."""
        curve = self._curve
        loaded = np.abs(curve.force_n) > _LOADED * np.abs(curve.force_n).max()
        marks = [mark.displacement_mm for _, mark, _ in self._marks()]
        places = self._depth(np.concatenate([curve.displacement_mm[loaded], marks]))
        low, high = float(places.min()), float(places.max())
        air, edge = (share * (high - low) for share in _ROOM)
        return [max(low - air, float(self._depth(curve.sample_mm).min()) - edge), high + edge]


def _menu(drawings: Sequence[_Drawing]) -> dict[str, Any]:
    """Shows one recording; a button's `name` is its label without markup."""
    buttons = []
    for drawing in drawings:
        visible = [other is drawing for other in drawings for _ in other.traces]
        args = [{"visible": visible}, drawing.layout]
        buttons.append({"label": escape(drawing.label), "name": drawing.label, "method": "update", "args": args})
    return {"buttons": buttons, "x": 1, "xanchor": "right", "y": 1.02, "yanchor": "bottom"}
