"""Figures of a diagnosis: where recordings and model differ, measured against predicted before and after, how probable
each explanation is; those of single recordings and of parameters have files of their own. Maps have a scale from purple
to orange, which colour-blind people tell apart; lab units.
"""

from collections.abc import Mapping, Sequence
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.data.names import SIMPLEST
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.localisation.permutation_test import SIGNIFICANT
from underskin.diagnosis.reporting.curve_data import shown_curves
from underskin.diagnosis.reporting.curve_figure import curve_figure
from underskin.diagnosis.reporting.figure_data import Levels, Points, Thinned
from underskin.diagnosis.reporting.figure_style import AFTER, BAND, BEFORE, MEASURED, styled
from underskin.diagnosis.reporting.frf_data import shown_frfs
from underskin.diagnosis.reporting.frf_figure import frf_figure
from underskin.diagnosis.reporting.line_styles import BOUND
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.diagnosis.reporting.parameter_figure import parameter_intervals
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.findings.formatting import in_percent
from underskin.mechanisms.unnamed.laws import in_plain_words
from underskin.recordings.campaign import Campaign
from underskin.units import Floats, readable_unit

_GREY = "#BBBBBB"
_MOST_LABELLED, _MOST_ABREAST = 80, 12  # cells of a map, and of one of its rows, that show their number
_CELL = 10  # pixels, of those numbers: 7.5 points on paper
_TITLE, _TITLE_SIZE, _TITLE_LINE = 18, 12, 16  # of a panel: characters on a line; pixels of a letter and of a line
_ABOVE_NOISE = 2.0  # times what 95 % of the noise stays in: as far the colours of a map reach at least
_BAND = 60  # points along a band
_LABEL = 24  # characters on a line of a label
_EDGE = 0.04  # of what is shown: room at an axis' ends


def figures(diagnosis: DiagnosisResult, document: Mapping[str, Any]) -> dict[str, go.Figure]:
    """By name, those there are: where, frf or curve, before_after, explanations, parameters. `document`: its report."""
    if diagnosis.search is None or diagnosis.problem is None:
        return {}
    nothing = next(entry for entry in diagnosis.search.explanations if not entry.names)
    shown = diagnosis.search.shown_or_nothing(diagnosis.search.answers[0])
    thinned = Thinned(diagnosis, diagnosis.problem, shown)
    before, after = thinned.points(nothing), thinned.points(shown)
    drawn = {
        "where": residual_map(diagnosis, thinned, before, after),
        "before_after": before_and_after(diagnosis, thinned, before, after, shown),
        "explanations": explanations(document),
    }
    if diagnosis.curves is not None:
        drawn["curve"] = _curve(diagnosis.problem, diagnosis.curves, nothing, shown)
    elif not diagnosis.problem.lines.curves:
        recordings = shown_frfs(diagnosis.problem, nothing, shown)
        drawn["frf"] = frf_figure(recordings, *_models(diagnosis.problem, shown))
    if any(entry["parameters"] for entry in document["mechanisms"]):
        drawn["parameters"] = parameter_intervals(diagnosis.problem, shown, document)
    return drawn


def _curve(problem: FittingProblem, recorded: Campaign, nothing: Explanation, shown: Explanation) -> go.Figure:
    """Each curve with the model before and after; with one of them where nothing is added."""
    return curve_figure(shown_curves(problem, recorded, nothing, shown), problem.kind, *_models(problem, shown))


def _models(problem: FittingProblem, shown: Explanation) -> tuple[str, str]:
    """What the models before and after are called; before empty where nothing is added."""
    simplest = SIMPLEST[problem.kind]
    return (simplest, _named(shown)) if shown.names else ("", f"{simplest}, nothing added")


def explanations(document: Mapping[str, Any]) -> go.Figure:
    """The probability of each explanation in a report, the stated answer on top."""
    stated = {"no_mismatch": ["nothing_missing"], "unexplained": ["none_of_these"]}
    leader = stated.get(document["verdict"]) or [entry["name"] for entry in document["mechanisms"]]
    rows = [(leader, document["probability"])]
    rows += [(entry["mechanisms"], entry["probability"]) for entry in document["alternatives"]]
    names = [_in_lines([escape(name.replace("_", " ")) for name in entry]) for entry, _ in rows]
    values = [value for _, value in rows]
    figure = go.Figure()
    figure.add_bar(
        x=values,
        y=names,
        orientation="h",
        marker={"color": [AFTER, *[_GREY] * (len(rows) - 1)]},
        text=[in_percent(value) for value in values],
        textposition="outside",
        cliponaxis=False,
        hovertemplate="%{y}: %{text}<extra></extra>",
    )
    figure.update_layout(
        title="How probable each explanation is",
        height=130 + sum(16 + 18 * (1 + name.count("<br>")) for name in names),
        margin={"r": 110, "t": 60},
    )
    figure.update_xaxes(title="probability", range=[0, 1.0], tickformat=".0%")
    figure.update_yaxes(autorange="reversed")
    return styled(figure)


def _in_lines(names: Sequence[str]) -> str:
    """Mechanisms as an axis has room for them: as many on a line as are short."""
    lines: list[str] = []
    for name in names:
        if lines and len(lines[-1]) + len(name) <= _LABEL:
            lines[-1] += f" + {name}"
        else:
            lines.append(name)
    return " +<br>".join(lines)


def residual_map(diagnosis: DiagnosisResult, thinned: Thinned, before: Points, after: Points) -> go.Figure:
    """Measured less the model to which nothing is added, over the located axes; the region outlined.

    A cell is the mean over the points in it; out of phase where the misfit lies in the phase, as the title says. What
    is within the noise is pale: that of what is stated, since the model alone takes its misfit for noise. `meta` of the
    layout has what 95 % of it stays in [%].
    """
    part, name = _part(diagnosis, before.residual_percent)
    which = "" if thinned.lines.curves else f", {name}"
    x_axis, y_axis = _map_axes(diagnosis, thinned)
    x, y = (None if axis is None else thinned.levels(axis) for axis in (x_axis, y_axis))
    one_place = Levels(np.zeros(len(before.recording), dtype=np.intp), [""], np.zeros(1), np.zeros(1))
    x, y = (one_place if entry is None else entry for entry in (x, y))
    cell = y.step * len(x.names) + x.step
    size = len(x.names) * len(y.names)
    count = np.bincount(cell, minlength=size)
    mean = np.where(count > 0, np.bincount(cell, part, size) / np.maximum(count, 1), np.nan)
    shape = (len(y.names), len(x.names))
    noise = SDS_OF_95 * float(np.median(after.noise_percent))
    limit = max(float(np.nanmax(np.abs(mean))), _ABOVE_NOISE * noise) or 1.0
    labelled = size <= _MOST_LABELLED and len(x.names) <= _MOST_ABREAST
    figure = go.Figure()
    figure.add_heatmap(
        z=mean.reshape(shape),
        zmid=0,
        zmin=-limit,
        zmax=limit,
        colorscale="PuOr_r",
        customdata=count.reshape(shape),
        text=np.array([_whole(value) for value in mean]).reshape(shape) if labelled else None,
        texttemplate="%{text}" if labelled else None,
        textfont={"size": _CELL} if len(y.names) <= _MOST_ABREAST else None,
        xgap=1,
        ygap=1,
        colorbar={"title": {"text": f"{name} [%]", "side": "right"}},
        hovertemplate="%{z:+.3g} % (mean of %{customdata})<extra></extra>",
    )
    for entry, update in ((x, figure.update_xaxes), (y, figure.update_yaxes)):
        labels = [escape(label) for label in entry.names]
        update(title=entry.title, tickmode="array", tickvals=list(range(len(labels))), ticktext=labels)
    if diagnosis.region:
        (x0, x1), (y0, y1) = _outline(diagnosis, x_axis, x), _outline(diagnosis, y_axis, y)
        figure.add_shape(type="rect", x0=x0, x1=x1, y0=y0, y1=y1, line={"color": MEASURED, "width": 3})
    figure.update_layout(
        title=f"Where: measured less {SIMPLEST[thinned.lines.kind]}{which}, in percent of it",
        height=170 + 40 * max(4, min(len(y.names), 12)),
        meta={"noise_percent": noise},
    )
    return styled(figure)


def _whole(percent: float) -> str:
    """A number of a cell with its sign; empty where there is none."""
    if np.isnan(percent):
        return ""
    return f"{percent:+.0f}".replace("-", "−") if round(percent) else "0"


def before_and_after(
    diagnosis: DiagnosisResult, thinned: Thinned, before: Points, after: Points, shown: Explanation
) -> go.Figure:
    """Measured against predicted, by the model alone and by what is stated, each with the band that noise allows."""
    called = f"before: {SIMPLEST[thinned.lines.kind]}", f"after: {_named(shown)}"
    titles = ["<br>".join(wrap(title, _TITLE)) for title in called]
    figure = make_subplots(1, 2, subplot_titles=titles, horizontal_spacing=0.12)
    further = _TITLE_LINE * max(title.count("<br>") for title in titles)
    _, name = _part(diagnosis, before.measured)
    what, unit = f"FRF, {name} ", "pC/N"
    if thinned.lines.curves:
        largest = max(float(np.abs(points.measured).max()) for points in (before, after))
        readable, per_n = readable_unit("force_n", largest)
        what, unit, before, after = "force ", readable, before.times(per_n), after.times(per_n)
    both = np.concatenate([column for points in (before, after) for column in (points.predicted, points.measured)])
    shown_part = _part(diagnosis, both)[0]
    room = _EDGE * float(np.ptp(shown_part))
    whole = [float(shown_part.min()) - room, float(shown_part.max()) + room]
    ids = [escape(entry.id) for entry in thinned.lines.campaign.recordings]
    for place, (points, colour, marker) in enumerate(
        ((before, BEFORE, "square-open"), (after, AFTER, "circle")), start=1
    ):
        predicted, measured = (_part(diagnosis, column)[0] for column in (points.predicted, points.measured))
        along = np.linspace(predicted.min(), predicted.max(), _BAND)
        # Where all predictions are alike the band would have no width along the abscissa.
        along = along if np.ptp(along) > 0 else along + np.linspace(-1, 1, _BAND) * (np.abs(along).max() or 1.0) * 0.05
        # That of what is stated in both: the model alone takes its misfit for noise.
        half = SDS_OF_95 * np.hypot(after.gain * along, float(np.median(after.deviation)))
        figure.add_scatter(
            x=[*along, *along[::-1]],
            y=[*(along + half), *(along - half)[::-1]],
            fill="toself",
            fillcolor=BAND,
            line={"width": 0},
            hoverinfo="skip",
            name="95 % of the noise",
            showlegend=place == 1,
            row=1,
            col=place,
        )
        figure.add_scatter(
            x=along, y=along, mode="lines", name="measured = predicted", hoverinfo="skip",
            line={"color": MEASURED, "width": 1, "dash": BOUND}, showlegend=place == 1, row=1, col=place,
        )  # fmt: skip
        figure.add_scatter(
            x=predicted,
            y=measured,
            mode="markers",
            marker={"color": colour, "symbol": marker, "size": 6, "opacity": 0.7},
            name=("before", "after")[place - 1],
            text=[ids[number] for number in points.recording],
            hovertemplate="%{text}<br>predicted %{x:.4g}<br>measured %{y:.4g}<extra></extra>",
            row=1,
            col=place,
        )
    figure.update_xaxes(title=f"predicted [{unit}]", title_font_size=_TITLE_SIZE, range=whole)
    figure.update_yaxes(title=f"measured {what}[{unit}]", title_font_size=_TITLE_SIZE, col=1)
    for place in (1, 2):
        figure.update_yaxes(range=whole, scaleanchor=f"x{place}", constrain="domain", row=1, col=place)
        figure.update_xaxes(constrain="domain", row=1, col=place)
    figure.update_layout(
        title="Measured against predicted",
        height=470 + further,
        margin={"t": 90 + further, "b": 100},
        legend={"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom"},
    )
    figure.update_annotations(font_size=_TITLE_SIZE)
    return styled(figure)


def _named(shown: Explanation) -> str:
    known = shown.best.hypothesis.lines.mechanisms
    said = " + ".join(in_plain_words(known[name]) for name in shown.names)
    return said.replace("_", " ") or "nothing added"


def _part(diagnosis: DiagnosisResult, column: np.ndarray[Any, Any]) -> tuple[Floats, str]:
    """The real part, or the imaginary where the misfit lies in the phase alone, and what it is called."""
    if diagnosis.problem is not None and diagnosis.problem.lines.curves:
        return column.real, "force"
    telling = [entry for entry in diagnosis.axes if entry.p_value is not None and entry.p_value < SIGNIFICANT]
    largest = max(telling, key=lambda entry: entry.share, default=None)
    if largest is not None and largest.axis == "phase":
        return column.imag, "out of phase"
    return column.real, "in phase"


def _map_axes(diagnosis: DiagnosisResult, thinned: Thinned) -> tuple[str | None, str | None]:
    """Those of the region, then the campaign's, as far as points differ along them; frequency lies on x."""
    every = thinned.axes()
    wanted = [name for name in dict.fromkeys([*diagnosis.region, *every]) if name in every]
    varying: list[str | None] = [name for name in wanted if thinned.levels(name) is not None]
    first, second = (*varying, None, None)[:2]
    return (second, first) if second in thinned.lines.row_axes else (first, second)


def _outline(diagnosis: DiagnosisResult, axis: str | None, levels: Levels) -> tuple[float, float]:
    """From where to where the region reaches on an axis of the map, whose steps are 0, 1, …"""
    ends = diagnosis.region.get(axis or "")
    if ends is None:
        return -0.5, len(levels.names) - 0.5
    slack = 0.0 if isinstance(ends[0], str) else 1e-6 * abs(float(ends[-1]))
    low, high = (ends[0], ends[-1]) if isinstance(ends[0], str) else (float(ends[0]) - slack, float(ends[-1]) + slack)
    inside = np.flatnonzero((levels.high >= low) & (levels.low <= high))
    return (float(inside.min()) - 0.5, float(inside.max()) + 0.5) if len(inside) else (-0.5, len(levels.names) - 0.5)
