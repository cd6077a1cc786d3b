"""Figures of single recordings with their fits, and of the parameters' intervals.

Curves: force against depth with both models and the marks, and below the residual of each model on the band of the
noise. FRFs: magnitude and phase with both models, and below the residuals on the band of the noise. One recording is
shown at a time and chosen from a menu, which changes the numbers of the traces, not the traces, so that hundreds of
FRFs stay a small file.

Colour, dash and marker mean the same everywhere (colours of Okabe and Ito, for colour-blind readers): black is
measured; orange, dashed and square the model before; blue, solid and circle the model after; grey the noise.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
import plotly.io as pio
from plotly.subplots import make_subplots

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.reporting.figure_data import SMALLEST, Mark, ShownCurve, ShownFrf
from underskin.diagnosis.reporting.kinds import KindTraits
from underskin.diagnosis.reporting.numbers import multiple_of
from underskin.diagnosis.reporting.page_styles import (
    LEAST_PHASE,
    PAPER,
    PLAIN,
    SHOWN,
    WHOLE_NUMBERS,
    decade_ticks,
    is_logarithmic,
    with_minus,
)
from underskin.findings.formatting import in_digits
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.mechanisms.base import Parameter
from underskin.units import Floats, readable_unit

MEASURED, BEFORE, AFTER, BAND = "#000000", "#D55E00", "#0072B2", "rgba(0,0,0,0.15)"
BELOW = {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom"}  # a legend below the figure
SMALL_TITLE = 12  # pixels: of a panel, so that those of two do not touch
BAND_POINTS = 60  # along an edge of a band
MARGIN = 0.05  # of the range shown, at either end of an axis
PlotlyTrace = dict[str, Any]


def styled(figure: go.Figure) -> go.Figure:
    """The figure in the common layout."""
    return figure.update_layout(**_style())


@cache  # made where a figure is drawn: it takes longer than to import this module
def _style() -> dict[str, Any]:
    template = go.layout.Template(pio.templates["plotly_white"]).update(
        layout={"xaxis": PLAIN, "yaxis": PLAIN}, data={"heatmap": [{"colorbar": PLAIN}]}
    )
    return {"template": template, "font": {"size": 14, "color": "#222222"}}


class Model(NamedTuple):
    """Style of a model; `role` is before or after, `words` its name in a legend, `mark` the size of its contact points
    [pixels]."""

    role: str
    words: str
    colour: str
    dash: str
    symbol: str
    mark: int


def models_of(before: str, after: str) -> list[Model]:
    """The models by their names; `before` is empty where there is one."""
    if not before:
        return [Model("after", after, AFTER, SHOWN, "circle", 8)]
    return [
        Model("before", f"before: {before}", BEFORE, PAPER, "square-open", 13),
        Model("after", f"after: {after}", AFTER, SHOWN, "circle", 8),
    ]


def _with_menu(figure: go.Figure, labels: Sequence[str], args: Sequence[Any]) -> go.Figure:
    """The figure with a menu that shows one of several recordings; a button's `name` is its label without markup."""
    buttons = [
        {"label": escape(label), "name": label, "method": "update", "args": changed}
        for label, changed in zip(labels, args, strict=True)
    ]
    menu = {"buttons": buttons, "x": 1, "xanchor": "right", "y": 1.02, "yanchor": "bottom"}
    return figure.update_layout(updatemenus=[menu]) if len(buttons) > 1 else figure


_MOST_CURVES = 12
_LOADED = 0.02  # of the largest force, from which a curve is in the initial view
_AIR = 0.4  # of the initial view: additional range in the air, if recorded
_CURVE_HEIGHT, _PANEL = 460, 150  # pixels


def curve_figure(curves: Sequence[ShownCurve], traits: KindTraits, before: str, after: str) -> go.Figure:
    """The figure of the first curves; `before` and `after` are names of the models, `before` empty where there is
    one."""
    models = models_of(before, after)
    drawings = [_Curve(curve, traits, models) for curve in curves[:_MOST_CURVES]]
    panels = len(models)
    height = _CURVE_HEIGHT + _PANEL * panels
    share = 0.8 * _PANEL / height
    figure = make_subplots(
        1 + panels, 1, shared_xaxes=True, vertical_spacing=0.035, row_heights=[1 - panels * share, *[share] * panels]
    )
    for index, drawing in enumerate(drawings):
        figure.add_traces([{**trace, "visible": index == 0} for trace in drawing.traces])
    for path, value in drawings[0].layout.items():
        figure.layout[path] = value
    visible = [[other is drawing for other in drawings for _ in other.traces] for drawing in drawings]
    figure.update_layout(
        title=traits.title,
        **_style(),
        height=height,
        margin={"r": 20, "t": 80, "b": 130},
        legend={**BELOW, "tracegroupgap": 0},
    )
    labels = [drawing.label for drawing in drawings]
    args = [[{"visible": shown}, drawing.layout] for shown, drawing in zip(visible, drawings, strict=True)]
    return _with_menu(figure, labels, args)


class _Curve:
    """One recording in readable units: its label, its traces and its part of the layout by path.

    Samples and models above, residuals below, marks on top; depth is measured from the contact point of the model
    after.
    """

    def __init__(self, curve: ShownCurve, traits: KindTraits, models: Sequence[Model]) -> None:
        self._curve, self._models = curve, models
        self._zero = curve.contacts["after"].displacement_mm
        deepest = float(np.abs(curve.displacement_mm - self._zero).max())
        self._length, self._per_mm = readable_unit("displacement_mm", deepest)
        self.label = f"{curve.name}: {curve.misfit_percent:.2g} % left"
        every = len(curve.sample_n) == curve.count
        samples = f"{curve.count} samples" if every else f"{len(curve.sample_n)} of {curve.count} samples"
        largest = float(np.abs(curve.sample_n).max())
        dots = {"color": MEASURED, "symbol": "circle-open", "size": 4, "opacity": 0.45}
        measured = {"mode": "markers", "marker": dots, "name": f"measured ({samples})"}
        self.traces = [self._trace("measured", curve.sample_mm, curve.sample_n, largest, measured)]
        self.layout: dict[str, Any] = {"yaxis.title.text": f"force [{readable_unit('force_n', largest)[0]}]"}
        residuals = [curve.force_n - curve.predicted_n[model.role] for model in models]
        most = min(float(np.abs(residual).max()) for residual in residuals)  # the unit of all is the best one's
        for row, (model, residual) in enumerate(zip(models, residuals, strict=True), start=2):
            line = {"color": model.colour, "width": 2, "dash": model.dash}
            look: PlotlyTrace = {"mode": "lines", "line": line, "legendgroup": model.role, "name": escape(model.words)}
            predicted = curve.predicted_n[model.role]
            self.traces.append(self._trace(model.role, curve.displacement_mm, predicted, largest, look))
            look |= {"showlegend": False, "xaxis": f"x{row}", "yaxis": f"y{row}"}
            self.traces += self._band(model, most, row)
            self.traces.append(self._trace(f"residual {model.role}", curve.displacement_mm, residual, most, look))
            which = "residual" if len(models) == 1 else f"residual<br>{model.role}"
            self.layout[f"yaxis{row}.title.text"] = f"{which} [{readable_unit('force_n', most)[0]}]"
            self.layout[f"yaxis{row}.title.font.size"] = SMALL_TITLE
        self.traces += [self._mark(name, mark, largest, marker) for name, mark, marker in self._marks()]
        last = len(models) + 1
        self.layout[f"xaxis{last}.title.text"] = f"{traits.along} from the contact point [{self._length}]"
        view = self._view()
        self.layout |= {f"xaxis{row}.range": view for row in ("", *range(2, last + 1))}

    def _band(self, model: Model, most: float, row: int) -> list[PlotlyTrace]:
        """The band that holds 95 % of the residuals of an exact law, on loading and unloading."""
        curve = self._curve
        half = SDS_OF_95 * curve.deviation_n
        turn = int(curve.displacement_mm.argmax())
        edge: PlotlyTrace = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        edge |= {"xaxis": f"x{row}", "yaxis": f"y{row}", "showlegend": False}
        edge |= {"name": "95 % of the noise", "legendgroup": "band"}
        traces = []
        for name, way in (("in", slice(None, turn + 1)), ("back", slice(turn, None))):
            order = np.argsort(curve.displacement_mm[way])  # an area is filled in one direction
            order = order[np.unique(np.linspace(0, len(order) - 1, BAND_POINTS).astype(int))]
            displacement, high = curve.displacement_mm[way][order], half[way][order]
            filled = {**edge, "fill": "tonexty", "fillcolor": BAND}
            filled["showlegend"] = row == 2 and name == "in"
            traces.append(self._trace(f"noise {name} {model.role} low", displacement, -high, most, edge))
            traces.append(self._trace(f"noise {name} {model.role} high", displacement, high, most, filled))
        return traces

    def _marks(self) -> list[tuple[str, Mark, dict[str, Any]]]:
        marks = []
        for model in self._models:
            name = "contact point" if len(self._models) == 1 else f"contact point {model.role}"
            marker = {"color": model.colour, "symbol": model.symbol, "size": model.mark}
            marks.append((name, self._curve.contacts[model.role], marker))
        jumps = (("snap-in", self._curve.snap_in, "down"), ("pull-off", self._curve.pull_off, "up"))
        for name, mark, way in jumps:
            if mark is not None:
                marks.append((name, mark, {"color": MEASURED, "symbol": f"triangle-{way}", "size": 11}))
        return marks

    def _mark(self, name: str, mark: Mark, largest: float, marker: dict[str, Any]) -> dict[str, Any]:
        displacement, force = np.array([mark.displacement_mm]), np.array([mark.force_n])
        trace = self._trace(name, displacement, force, largest, {"mode": "markers", "marker": marker, "name": name})
        recorded = f"<br>displacement as recorded: {mark.displacement_mm:.6g} mm<extra></extra>"
        return {**trace, "hovertemplate": trace["hovertemplate"].replace("<extra></extra>", recorded)}

    def _trace(
        self, role: str, displacement_mm: Floats, force_n: Floats, largest: float, look: dict[str, Any]
    ) -> dict[str, Any]:
        """A trace in the readable unit of forces up to `largest` [N]; `meta` has its role and its units in mm and N."""
        unit, per_n = readable_unit("force_n", largest)
        return {
            "type": "scatter",
            "x": self._depth(displacement_mm),
            "y": (per_n * force_n).astype(np.float32),  # more than an eye can tell
            "meta": {"recording": self._curve.name, "shows": role, "mm": 1 / self._per_mm, "n": 1 / per_n},
            "hovertemplate": f"{escape(self._curve.name)}, {role}<br>"
            f"%{{x:.4g}} {self._length}: %{{y:.4g}} {unit}<extra></extra>",
            **look,
        }

    def _depth(self, displacement_mm: Floats) -> Floats:
        return (self._per_mm * (displacement_mm - self._zero)).astype(np.float32)

    def _view(self) -> list[float]:
        """The initial range of the abscissa: the loaded part and the marks, with some air."""
        curve = self._curve
        loaded = np.abs(curve.force_n) > _LOADED * np.abs(curve.force_n).max()
        marks = [mark.displacement_mm for _, mark, _ in self._marks()]
        depths = self._depth(np.concatenate([curve.displacement_mm[loaded], marks]))
        low, high = float(depths.min()), float(depths.max())
        air, edge = _AIR * (high - low), MARGIN * (high - low)
        return [max(low - air, float(self._depth(curve.sample_mm).min()) - edge), high + edge]


_IN_VIEW = 10.0  # times the noise's band: initial range of residuals
_FEW = 3  # lines up to which a model has markers
_NONE = 1e-9  # pC/N: least scale of a residual
_RESPONSES = ("measured", "before", "after")
_DIGITS, _RESIDUAL_DIGITS = 5, 3  # of responses and frequencies, and of phases and residuals


class _Trace(NamedTuple):
    """The quantity of a trace (`role`), its panel of four, unit and style."""

    role: str
    panel: int
    unit: str
    look: PlotlyTrace


def frf_figure(recordings: Sequence[ShownFrf], before: str, after: str) -> go.Figure:
    """The figure of FRFs, the first recording in view; `before` and `after` are names of the models, `before` empty
    where there is one. `layout.meta` has the recordings' names, sensors, spheres, preloads and misfits, and the role of
    each trace."""
    models = models_of(before, after)
    few = min(len(recording.frequency_hz) for recording in recordings) <= _FEW
    traces = _traces(models, few)
    figure = make_subplots(4, 1, shared_xaxes=True, vertical_spacing=0.035, row_heights=(0.34, 0.2, 0.23, 0.23))
    numbers = [_numbers(recording, [trace.role for trace in traces]) for recording in recordings]
    for index, trace in enumerate(traces):
        axis = "" if trace.panel == 1 else str(trace.panel)
        figure.add_trace(
            {
                "type": "scatter",
                "xaxis": f"x{axis}",
                "yaxis": f"y{axis}",
                "hovertemplate": f"%{{x:.4g}} Hz: %{{y:.4g}} {trace.unit}<extra></extra>",
                **{name: column[index] for name, column in numbers[0].items()},
                **trace.look,
            }
        )
    lines_hz = np.concatenate([recording.frequency_hz for recording in recordings])
    figure.update_xaxes(type="log", dtick=decade_ticks(lines_hz), **WHOLE_NUMBERS)
    figure.update_xaxes(title="frequency [Hz]", row=4, col=1)
    titles = ("|FRF| [pC/N]", "phase [°]", "residual,<br>in phase [%]", "residual, out<br>of phase [%]")
    for row, title in enumerate(titles, start=1):
        figure.update_yaxes(title=title, row=row, col=1)
    for row in (3, 4):
        figure.update_yaxes(title_font_size=11, row=row, col=1)  # fits the height of a panel in a narrow window
    figure.update_yaxes(**WHOLE_NUMBERS, row=1, col=1)
    views = [_view(recording, bool(before)) for recording in recordings]
    for path, value in views[0].items():
        figure.layout[path] = value
    figure.update_layout(
        title="Measured and predicted, recording by recording",
        **_style(),
        height=700,
        margin={"l": 90, "r": 20, "t": 80, "b": 100},
        legend=BELOW,
        meta={
            "recordings": [shown.recording.id for shown in recordings],
            "sensors": [shown.recording.sensor for shown in recordings],
            "indenters_mm": [shown.recording.indenter_radius_mm for shown in recordings],
            "preloads_n": [shown.recording.preload_n for shown in recordings],
            "left_percent": [[float(f"{misfit:.3g}") for misfit in shown.misfits.values()] for shown in recordings],
            "shows": [trace.role for trace in traces],
        },
    )
    first = recordings[0].frequency_hz
    alike = all(np.array_equal(recording.frequency_hz, first) for recording in recordings)
    changed = [{"y": columns["y"]} if alike else columns for columns in numbers]
    labels = [_label(recording, bool(before)) for recording in recordings]
    return _with_menu(figure, labels, [[*pair] for pair in zip(changed, views, strict=True)])


def _traces(models: Sequence[Model], few: bool) -> list[_Trace]:
    """The traces in the order of drawing."""
    dots = {"mode": "markers", "marker": {"color": MEASURED, "symbol": "circle-open", "size": 5}}
    traces = [_Trace("measured", 1, "pC/N", {**dots, "name": "measured", "legendgroup": "measured"})]
    traces.append(_Trace("measured phase", 2, "°", {**dots, "legendgroup": "measured", "showlegend": False}))
    for panel, part in ((3, "real"), (4, "imaginary")):
        edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "legendgroup": "band"}
        named = {"name": "95 % of the noise", "fill": "tonexty", "fillcolor": BAND, "showlegend": panel == 3}
        traces.append(_Trace(f"noise {part} low", panel, "%", {**edge, "showlegend": False}))
        traces.append(_Trace(f"noise {part} high", panel, "%", {**edge, **named}))
    for model in models:
        marker = {"color": model.colour, "symbol": model.symbol, "size": 5}
        line = {
            "mode": "lines+markers" if few else "lines",
            "line": {"color": model.colour, "width": 2, "dash": model.dash},
            "marker": marker,
            "legendgroup": model.role,
        }
        traces.append(_Trace(model.role, 1, "pC/N", {**line, "name": escape(model.words)}))
        traces.append(_Trace(f"{model.role} phase", 2, "°", {**line, "showlegend": False}))
        residual = {"mode": "markers", "marker": marker, "legendgroup": model.role, "showlegend": False}
        traces.append(_Trace(f"residual {model.role} real", 3, "%", residual))
        traces.append(_Trace(f"residual {model.role} imaginary", 4, "%", residual))
    return traces


def _columns(recording: ShownFrf) -> dict[str, Floats]:
    """The ordinates of a recording's traces by `role`, each (shown,); residuals and noise in percent of the prediction
    after, or of 5 % of the largest where that is more."""
    after = recording.predicted["after"]
    before, phase = (np.degrees(np.unwrap(np.angle(predicted))) for predicted in recording.predicted.values())
    columns = {
        "measured": np.abs(recording.measured),
        "measured phase": phase + np.degrees(np.angle(recording.measured * after.conj())),
        "after phase": phase,
        "before phase": before + 360 * np.round((phase[0] - before[0]) / 360),
    }
    size = np.abs(after)
    percent = 100 / np.maximum(size, max(SMALLEST * float(size.max()), _NONE))
    for part, deviation in zip(("real", "imaginary"), recording.deviation, strict=True):
        half = SDS_OF_95 * deviation * percent
        columns |= {f"noise {part} low": -half, f"noise {part} high": half}
    for name, predicted in recording.predicted.items():
        residual = (recording.measured - predicted) * percent
        columns |= {name: np.abs(predicted)}
        columns |= {f"residual {name} real": residual.real, f"residual {name} imaginary": residual.imag}
    return columns


def _numbers(recording: ShownFrf, roles: Sequence[str]) -> dict[str, list[Any]]:
    """x and y of every trace, rounded to the digits of a figure."""
    columns, frequency = _columns(recording), _short(recording.frequency_hz, _DIGITS)
    return {
        "x": [frequency for _ in roles],
        "y": [_short(columns[name], _DIGITS if name in _RESPONSES else _RESIDUAL_DIGITS) for name in roles],
    }


def _short(values: Floats, digits: int) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in values.tolist()]


def _view(recording: ShownFrf, both: bool) -> dict[str, Any]:
    """A recording's part of the layout, by path; `both`: whether there is a model before."""
    columns = _columns(recording)
    names = ("measured", "before", "after") if both else ("measured", "after")
    sizes = np.concatenate([columns[name] for name in names])
    wide = is_logarithmic(sizes, float(np.median(columns["measured"])))
    low, high = (np.log10([sizes.min(), sizes.max()]) if wide else (0.0, sizes.max())) if sizes.max() > 0 else (0, 1)
    room = MARGIN * (high - low)
    view: dict[str, Any] = {
        "yaxis.type": "log" if wide else "linear",
        "yaxis.dtick": decade_ticks(sizes) if wide else None,
        "yaxis.range": [float(low - room) if wide else 0.0, float(high + room)],
    }
    phases = [columns["measured phase" if name == "measured" else f"{name} phase"] for name in names]
    low, high = min(-LEAST_PHASE, *map(np.min, phases)), max(LEAST_PHASE, *map(np.max, phases))
    view["yaxis2.range"] = [float(low - MARGIN * (high - low)), float(high + MARGIN * (high - low))]
    for axis, part in ((3, "real"), (4, "imaginary")):
        band = float(columns[f"noise {part} high"].max())
        largest = [float(np.abs(columns[f"residual {name} {part}"]).max()) for name in names[1:]]
        reach = max(band, largest[-1], min(max(largest), _IN_VIEW * band)) * (1 + MARGIN)
        view[f"yaxis{axis}.range"] = [-reach, reach]
    return view


def _label(shown: ShownFrf, both: bool) -> str:
    recording, drawn = shown.recording, len(shown.frequency_hz)
    where = f"{recording.sensor}, R {recording.indenter_radius_mm:.3g} mm, {recording.preload_n:.3g} N"
    lines = "" if drawn == shown.count else f"; {drawn} of {shown.count} lines"
    before, after = (f"{in_digits(misfit, 2)} %" for misfit in shown.misfits.values())
    return f"{recording.id} ({where}): misfit {f'{before} before, {after} after' if both else after}{lines}"


def parameter_intervals(shown: Explanation, mechanisms: Sequence[Mapping[str, Any]]) -> go.Figure:
    """Each parameter's 95 % interval in its unit; that of its prior is in words, since drawn it would dwarf it."""
    priors = shown.spans
    rows = [
        (mechanism["name"], parameter, prior, multiple_of(shown, prior))
        for mechanism in mechanisms
        if mechanism["name"] in priors
        for parameter, prior in zip(
            mechanism["parameters"], shown.model.parameters[priors[mechanism["name"]]], strict=True
        )
    ]
    titles = [
        f"{name.replace('_', ' ')}<br>{_labelled(parameter)}<br><sup>{_before(prior, scale, parameter['unit'])}</sup>"
        for name, parameter, prior, scale in rows
    ]
    figure = make_subplots(len(rows), 1, subplot_titles=titles, vertical_spacing=0.73 / len(rows))  # labels
    figure.update_annotations(font_size=SMALL_TITLE)
    for panel, (_, parameter, *_) in enumerate(rows, start=1):
        low, high = parameter["low"], parameter["high"]
        figure.add_scatter(
            x=[low, high], y=[0, 0], mode="lines", line={"color": AFTER, "width": 8}, name="95 % interval",
            showlegend=panel == 1, row=panel, col=1,
        )  # fmt: skip
        figure.add_scatter(
            x=[parameter["value"]], y=[0], mode="markers", name="most probable", showlegend=panel == 1,
            marker={"color": MEASURED, "symbol": "line-ns-open", "size": 16, "line": {"width": 2}}, row=panel, col=1,
        )  # fmt: skip
        margin = (high - low) or 0.1 * abs(low) or 1.0
        start = low - margin if low < 0 else max(low - margin, 0.0)  # positive parameters have no negative range
        figure.update_xaxes(range=[start, high + margin], row=panel, col=1)
    figure.update_yaxes(visible=False, range=[-1, 1])
    figure.update_layout(
        title="What the recordings say of the parameters",
        height=200 + 140 * len(rows),
        legend=BELOW,
        margin={"t": 110, "b": 90},
    )
    return styled(figure)


def _labelled(parameter: Mapping[str, Any]) -> str:
    unit = "" if parameter["unit"] == "-" else f" {parameter['unit']}"
    interval = f"{parameter['value']:.3g} ({parameter['low']:.3g} to {parameter['high']:.3g}){unit}"
    return with_minus(f"{parameter['name'].replace('_', ' ')} {interval}")


def _before(prior: Parameter, scale: float, unit: str) -> str:
    """The 95 % interval of the prior, in words."""
    low, high = (scale * prior.from_fit(prior.quantile(q)) for q in (0.025, 0.975))
    return with_minus(
        f"before the recordings (prior), 95 %: {low:.3g} to {high:.3g}{'' if unit == '-' else f' {unit}'}"
    )
