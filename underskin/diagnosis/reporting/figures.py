"""Figures of reports, as plotly objects in lab units.

Of one diagnosis: where recordings and model differ, measured against predicted before and after, and the probability
of each explanation. Of several campaigns, from the report alone: d33 of each sensor over the campaigns, and each skin
against the band of its population. Colour scales run from purple to orange, which colour-blind readers can tell apart.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.data.names import SIMPLEST, quantity_in_words
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.reporting import wording
from underskin.diagnosis.reporting.facts import DiagnosisResult, Facts
from underskin.diagnosis.reporting.figure_data import Levels, Points, Thinned, shown_curves, shown_frfs
from underskin.diagnosis.reporting.page_styles import BOUND, LINE_COLOURS
from underskin.diagnosis.reporting.recording_figures import (
    AFTER,
    BAND,
    BAND_POINTS,
    BEFORE,
    BELOW,
    MARGIN,
    MEASURED,
    SMALL_TITLE,
    curve_figure,
    frf_figure,
    parameter_intervals,
    styled,
)
from underskin.findings.formatting import capital, in_percent
from underskin.inversion.mixed_model import MOST_NAMED, SDS_OF_95, many_sensors
from underskin.mechanisms.unlisted.laws import in_plain_words
from underskin.units import Complexes, Floats, readable_unit

_GREY = "#BBBBBB"
_MOST_LABELLED, _MOST_ABREAST = 80, 12  # cells of a map, and of one of its rows, up to which numbers are shown
_TITLE, _TITLE_LINE = 18, 16  # of a panel: characters per line; pixels of a line
_ABOVE_NOISE = 2.0  # least end of a map's colour scale, over the 95 % interval of the noise
_LABEL = 24  # characters per line of a label


def figures(diagnosis: DiagnosisResult, document: Mapping[str, Any]) -> dict[str, go.Figure]:
    """The figures by name: where, frf or curve, before_after, explanations, parameters. `document`: the report."""
    if diagnosis.search is None:
        return {}
    facts = Facts(diagnosis)
    problem, shown = facts.problem, facts.shown
    thinned = Thinned(diagnosis, problem, shown)
    before, after = thinned.points(facts.base), thinned.points(shown)
    part = _part(facts)
    drawn = {
        "where": residual_map(diagnosis, thinned, before, after, part),
        "before_after": before_and_after(facts, before, after, part),
        "explanations": explanations(document),
    }
    simplest = SIMPLEST[problem.kind]
    names = (simplest, _named(shown)) if shown.names else ("", f"{simplest}, nothing added")
    if diagnosis.curves is not None:
        curves = shown_curves(problem, diagnosis.curves, facts.base, shown)
        drawn["curve"] = curve_figure(curves, facts.traits, *names)
    else:
        drawn["frf"] = frf_figure(shown_frfs(problem, facts.base, shown), *names)
    if any(mechanism["parameters"] for mechanism in document["mechanisms"]):
        drawn["parameters"] = parameter_intervals(shown, document["mechanisms"])
    return drawn


class _Part(NamedTuple):
    """The real or imaginary part of responses, its name, and this after a comma; of curves nothing."""

    is_imaginary: bool
    name: str
    words: str

    def of(self, column: Complexes) -> Floats:
        return column.imag if self.is_imaginary else column.real


def _part(facts: Facts) -> _Part:
    """The real part, or the imaginary part where the misfit lies in the phase."""
    telling = [result for result in facts.diagnosis.axes if result.significant]
    largest = max(telling, key=lambda result: result.share, default=None)
    if largest is not None and largest.axis == "phase":
        return _Part(True, "out of phase", ", out of phase")
    return _Part(False, *facts.traits.part)


def explanations(document: Mapping[str, Any]) -> go.Figure:
    """The probability of each explanation in a report, the stated answer on top."""
    rows = wording.answers(document)
    names = [_in_lines([escape(name.replace("_", " ")) for name in row["mechanisms"]]) for row in rows]
    values = [row["probability"] for row in rows]
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
    """Mechanisms broken into lines of at most `_LABEL` characters, where names are short enough."""
    lines: list[str] = []
    for name in names:
        if lines and len(lines[-1]) + len(name) <= _LABEL:
            lines[-1] += f" + {name}"
        else:
            lines.append(name)
    return " +<br>".join(lines)


def residual_map(diagnosis: DiagnosisResult, thinned: Thinned, before: Points, after: Points, part: _Part) -> go.Figure:
    """Residual of the base model over the located axes, with the region outlined.

    A cell is the mean over its points; out of phase where the misfit lies in the phase, as the title says. Cells within
    the noise are pale. The noise is that of the stated explanation, since the base model counts its misfit as noise;
    `meta` of the layout has half its 95 % interval [%].
    """
    x_axis, y_axis = _map_axes(diagnosis, thinned)
    x, y = (None if axis is None else thinned.levels(axis) for axis in (x_axis, y_axis))
    single_level = Levels(np.zeros(len(before.recording), dtype=np.intp), [""], np.zeros(1), np.zeros(1))
    x, y = (single_level if levels is None else levels for levels in (x, y))
    cell = y.step * len(x.names) + x.step
    size = len(x.names) * len(y.names)
    count = np.bincount(cell, minlength=size)
    mean = np.where(count > 0, np.bincount(cell, part.of(before.residual_percent), size) / np.maximum(count, 1), np.nan)
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
        text=np.array([_percent_label(value) for value in mean]).reshape(shape) if labelled else None,
        texttemplate="%{text}" if labelled else None,
        textfont={"size": 10} if len(y.names) <= _MOST_ABREAST else None,
        xgap=1,
        ygap=1,
        colorbar={"title": {"text": f"{part.name} [%]", "side": "right"}},
        hovertemplate="%{z:+.3g} % (mean of %{customdata})<extra></extra>",
    )
    for levels, update in ((x, figure.update_xaxes), (y, figure.update_yaxes)):
        labels = [escape(label) for label in levels.names]
        update(title=levels.title, tickmode="array", tickvals=list(range(len(labels))), ticktext=labels)
    if diagnosis.region:
        (x0, x1), (y0, y1) = _outline(diagnosis, x_axis, x), _outline(diagnosis, y_axis, y)
        figure.add_shape(type="rect", x0=x0, x1=x1, y0=y0, y1=y1, line={"color": MEASURED, "width": 3})
    figure.update_layout(
        title=f"Where: measured less {SIMPLEST[thinned.lines.kind]}{part.words}, in percent of it",
        height=170 + 40 * max(4, min(len(y.names), 12)),
        meta={"noise_percent": noise},
    )
    return styled(figure)


def _percent_label(percent: float) -> str:
    """The signed number in a cell; empty for NaN."""
    if np.isnan(percent):
        return ""
    return f"{percent:+.0f}".replace("-", "−") if round(percent) else "0"


def before_and_after(facts: Facts, before: Points, after: Points, part: _Part) -> go.Figure:
    """Measured against predicted, by the base model and by the stated explanation, each with the band of the noise."""
    headings = f"before: {SIMPLEST[facts.problem.kind]}", f"after: {_named(facts.shown)}"
    titles = ["<br>".join(wrap(title, _TITLE)) for title in headings]
    figure = make_subplots(1, 2, subplot_titles=titles, horizontal_spacing=0.12)
    further = _TITLE_LINE * max(title.count("<br>") for title in titles)
    unit, scale = "pC/N", 1.0
    if facts.problem.lines.curves:
        unit, scale = readable_unit("force_n", float(np.abs(after.measured).max()))
    both = np.concatenate([column for points in (before, after) for column in (points.predicted, points.measured)])
    shown_part = scale * part.of(both)
    room = MARGIN * float(np.ptp(shown_part))
    axis_range = [float(shown_part.min()) - room, float(shown_part.max()) + room]
    ids = [escape(recording.id) for recording in facts.problem.lines.campaign.recordings]
    for panel, (points, colour, marker) in enumerate(
        ((before, BEFORE, "square-open"), (after, AFTER, "circle")), start=1
    ):
        predicted, measured = (scale * part.of(column) for column in (points.predicted, points.measured))
        # If all predictions were equal the band would have no width along the abscissa.
        spare = 0.0 if np.ptp(predicted) > 0 else MARGIN * (float(np.abs(predicted).max()) or 1.0)
        along = np.linspace(predicted.min() - spare, predicted.max() + spare, BAND_POINTS)
        # The noise of the stated explanation in both: the base model counts its misfit as noise.
        half = SDS_OF_95 * np.hypot(after.gain * along, scale * float(np.median(after.deviation)))
        figure.add_scatter(
            x=[*along, *along[::-1]],
            y=[*(along + half), *(along - half)[::-1]],
            fill="toself",
            fillcolor=BAND,
            line={"width": 0},
            hoverinfo="skip",
            name="95 % of the noise",
            showlegend=panel == 1,
            row=1,
            col=panel,
        )
        figure.add_scatter(
            x=along, y=along, mode="lines", name="measured = predicted", hoverinfo="skip",
            line={"color": MEASURED, "width": 1, "dash": BOUND}, showlegend=panel == 1, row=1, col=panel,
        )  # fmt: skip
        figure.add_scatter(
            x=predicted,
            y=measured,
            mode="markers",
            marker={"color": colour, "symbol": marker, "size": 6, "opacity": 0.7},
            name=("before", "after")[panel - 1],
            text=[ids[index] for index in points.recording],
            hovertemplate="%{text}<br>predicted %{x:.4g}<br>measured %{y:.4g}<extra></extra>",
            row=1,
            col=panel,
        )
        figure.update_yaxes(range=axis_range, scaleanchor=f"x{panel}", constrain="domain", row=1, col=panel)
        figure.update_xaxes(constrain="domain", row=1, col=panel)
    figure.update_xaxes(title=f"predicted [{unit}]", title_font_size=SMALL_TITLE, range=axis_range)
    figure.update_yaxes(
        title=f"measured {facts.traits.response}{part.words} [{unit}]", title_font_size=SMALL_TITLE, col=1
    )
    figure.update_layout(
        title="Measured against predicted",
        height=470 + further,
        margin={"t": 90 + further, "b": 100},
        legend=BELOW,
    )
    figure.update_annotations(font_size=SMALL_TITLE)
    return styled(figure)


def _named(shown: Explanation) -> str:
    mechanisms = shown.best.hypothesis.lines.mechanisms
    label = " + ".join(in_plain_words(mechanisms[name]) for name in shown.names)
    return label.replace("_", " ") or "nothing added"


def _map_axes(diagnosis: DiagnosisResult, thinned: Thinned) -> tuple[str | None, str | None]:
    """The first two axes along which points differ, those of the region first; frequency is on x."""
    every = thinned.axes()
    candidates = [name for name in dict.fromkeys([*diagnosis.region, *every]) if name in every]
    varying: list[str | None] = [name for name in candidates if thinned.levels(name) is not None]
    first, second = (*varying, None, None)[:2]
    return (second, first) if second in thinned.lines.row_axes else (first, second)


def _outline(diagnosis: DiagnosisResult, axis: str | None, levels: Levels) -> tuple[float, float]:
    """Ends of the region on an axis of the map, whose steps are 0, 1, …"""
    ends = diagnosis.region.get(axis or "")
    if ends is None:
        return -0.5, len(levels.names) - 0.5
    slack = 0.0 if isinstance(ends[0], str) else 1e-6 * abs(float(ends[-1]))
    low, high = (ends[0], ends[-1]) if isinstance(ends[0], str) else (float(ends[0]) - slack, float(ends[-1]) + slack)
    inside = np.flatnonzero((levels.high >= low) & (levels.low <= high))
    return (float(inside.min()) - 0.5, float(inside.max()) + 0.5) if len(inside) else (-0.5, len(levels.names) - 0.5)


_MARKERS = ("circle", "square", "diamond", "cross", "triangle-up", "x")
_SENSORS_WIDTH = 0.5  # of the distance between campaigns, over which the sensors of one are spread


def several_figures(document: Mapping[str, Any]) -> dict[str, go.Figure]:
    """The figures of the report by name: sensors, population."""
    drawn = {}
    rows = (document["d33"] or {}).get("per_sensor")
    if rows:
        drawn["sensors"] = sensors_over_campaigns(rows, document["campaigns"])
    if document.get("population"):
        drawn["population"] = skins_in_populations(document["population"])
    return drawn


def sensors_over_campaigns(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> go.Figure:
    """d33 with its 95 % interval of each sensor in each campaign; of many sensors the median, the range of 90 % and,
    by name, the outliers.

    `rows` are those of `d33.per_sensor`, `names` all campaigns in order, including those without d33.
    """
    with_d33 = dict.fromkeys(row["campaign"] for row in rows)
    campaigns = list(dict.fromkeys([*names, *with_d33]))
    sensors = list(dict.fromkeys(row["sensor"] for row in rows))
    few = len(sensors) <= MOST_NAMED
    figure = go.Figure(list(_by_sensor(rows, campaigns, sensors) if few else _summarised(rows, campaigns)))
    labels = [escape(name) + ("" if name in with_d33 else "<br>(no d33)") for name in campaigns]
    figure.update_xaxes(title="campaign", tickmode="array", tickvals=list(range(len(labels))), ticktext=labels)
    figure.update_yaxes(title=f"d33 [{rows[0]['unit']}]" + (", 95 %" if few else ""))
    title = "d33 of each sensor over the campaigns"
    if not few:
        title = (
            f"d33 of {len(sensors)} sensors over the campaigns: median, the range of 90 %, and those that stand apart"
        )
    figure.update_layout(title=title, height=470, showlegend=few and len(sensors) > 1)
    return styled(figure)


def _by_sensor(
    rows: Sequence[Mapping[str, Any]], campaigns: Sequence[str], sensors: Sequence[str]
) -> Iterator[go.Scatter]:
    offsets = _SENSORS_WIDTH * (np.arange(len(sensors)) - (len(sensors) - 1) / 2) / len(sensors)
    for index, sensor in enumerate(sensors):
        sensor_rows = [row for row in rows if row["sensor"] == sensor]
        yield go.Scatter(
            x=[campaigns.index(row["campaign"]) + offsets[index] for row in sensor_rows],
            y=[row["value"] for row in sensor_rows],
            error_y=_error_bars(sensor_rows),
            mode="lines+markers",
            name=escape(sensor),
            line={"color": LINE_COLOURS[index % len(LINE_COLOURS)], "width": 1},
            marker={"symbol": _MARKERS[index % len(_MARKERS)], "size": 8},
            text=[escape(row["campaign"]) for row in sensor_rows],
            hovertemplate="%{text}: %{y:.4g} pC/N<extra>%{fullData.name}</extra>",
        )


def _summarised(rows: Sequence[Mapping[str, Any]], campaigns: Sequence[str]) -> Iterator[go.Scatter]:
    """The median of each campaign's sensors with the range of 90 % of them, then the outliers."""
    of_campaign = {
        number: campaign_rows
        for number, name in enumerate(campaigns)
        if (campaign_rows := [row for row in rows if row["campaign"] == name])
    }
    summaries = [
        many_sensors(
            np.array([row["value"] for row in campaign_rows]),
            np.array([(row["high"] - row["low"]) / (2 * SDS_OF_95) for row in campaign_rows]),
        )
        for campaign_rows in of_campaign.values()
    ]
    ends = [{"value": summary.median, "low": summary.low, "high": summary.high} for summary in summaries]
    yield go.Scatter(
        x=list(of_campaign),
        y=[summary.median for summary in summaries],
        error_y=_error_bars(ends),
        mode="lines+markers",
        name="median",
        line={"color": AFTER, "width": 1},
        marker={"symbol": "circle", "size": 9},
        hovertemplate="median %{y:.4g} pC/N<extra></extra>",
    )
    outliers = [
        (number, campaign_rows[index])
        for (number, campaign_rows), summary in zip(of_campaign.items(), summaries, strict=True)
        for index in summary.apart
    ]
    yield go.Scatter(
        x=[number for number, _ in outliers],
        y=[row["value"] for _, row in outliers],
        error_y=_error_bars([row for _, row in outliers]),
        mode="markers+text",
        name="stands apart",
        marker={"color": BEFORE, "symbol": "square", "size": 8},
        text=[escape(row["sensor"]) for _, row in outliers],
        textposition="middle right",
        hovertemplate="%{text}: %{y:.4g} pC/N<extra></extra>",
    )


def skins_in_populations(populations: Sequence[Mapping[str, Any]]) -> go.Figure:
    """Each quantity of each skin with its 95 % interval on the 95 % band of the population, departing skins in another
    colour; `populations` is the report's `population`."""
    titles = [
        capital(quantity_in_words(population["parameter"]))
        + ("" if population["unit"] == "-" else f" [{population['unit']}]")
        for population in populations
    ]
    skins = max(len(population["skins"]) for population in populations)
    figure = make_subplots(len(populations), 1, subplot_titles=titles)
    for panel, population in enumerate(populations, start=1):
        departing = {departure["skin"] for departure in population["departures"]}
        for departs, colour, name in ((False, AFTER, "as the others"), (True, BEFORE, "departs")):
            skin_rows = [row for row in population["skins"] if (row["skin"] in departing) is departs]
            figure.add_scatter(
                x=[row["value"] for row in skin_rows],
                y=[escape(row["skin"]) for row in skin_rows],
                error_x=_error_bars(skin_rows),
                mode="markers",
                marker={"color": colour, "symbol": "square" if departs else "circle", "size": 9},
                name=name,
                legendgroup=name,
                showlegend=panel == 1,
                hovertemplate="%{y}: %{x:.4g}<extra></extra>",
                row=panel,
                col=1,
            )
        half = SDS_OF_95 * population["sd"]  # plotly draws bands on subplots that have points alone
        low, high = population["mean"] - half, population["mean"] + half
        figure.add_vrect(x0=low, x1=high, fillcolor="rgba(0,0,0,0.12)", line_width=0, row=panel, col=1)
        figure.add_vline(x=population["mean"], line={"color": "#000000", "width": 1}, row=panel, col=1)
    figure.update_layout(
        title="Each skin, and the band in which 95 % of such skins lie",
        height=150 + len(populations) * (130 + 22 * skins),
    )
    return styled(figure)


def _error_bars(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The 95 % intervals of rows as plotly's error bars: distances from the value."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [row["high"] - row["value"] for row in rows],
        "arrayminus": [row["value"] - row["low"] for row in rows],
        "width": 4,
    }
