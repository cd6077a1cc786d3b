"""d33 of each sensor over time, or of many sensors together."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
import plotly.graph_objects as go

from underskin.diagnosis.reporting.page_styles import LINE_COLOURS
from underskin.figures.style import COLOURS, MARKERS, SDS_OF_95, label, styled
from underskin.inversion.many_sensors import MOST_NAMED, many_sensors

_MOST_POINTS = 600  # of a history that shows each sensor
_MOST_APART = 60  # points of a line, whose intervals can be told apart
_MOST_FAINT = 6000  # of a history that shows their median and spread
_LINE = 0.06  # of the span of all values: what the name of a point takes up
_MOST_BESIDE = 3  # names beside a point
_CHOSEN = COLOURS[2]
_DAY, _DAY_MS = timedelta(days=1), 86_400_000
_CALENDAR = datetime.min.replace(tzinfo=UTC) + _DAY, datetime.max.replace(tzinfo=UTC) - _DAY


@dataclass(frozen=True)
class SensorPoints:
    """One sensor: times (ISO 8601, UTC), d33 and its standard uncertainty [pC/N]; `trend`: its trend in words."""

    sensor: str
    times: Sequence[str]
    d33_pc_per_n: Sequence[float]
    d33_uncertainty_pc_per_n: Sequence[float]
    trend: str


def is_summarised(sensors: int, points: int) -> bool:
    """Whether so many sensors with so many points in all are drawn as their median and spread."""
    return sensors > MOST_NAMED or (points > _MOST_POINTS and sensors > 1)


def d33_history(sensors: Sequence[SensorPoints], chosen: str | None = None) -> go.Figure:
    """A line for each sensor, with 95 % intervals, or for the one that is `chosen`; of many sensors their median, the
    range of 90 % of them as a band, by name those that stand apart, and the chosen one's line."""
    times = [time for entry in sensors for time in entry.times]
    own = [(number, entry) for number, entry in enumerate(sensors) if chosen in (None, entry.sensor)]
    if is_summarised(len(sensors), len(times)):
        figure = go.Figure(_most(sensors))
        figure.add_traces([_one(COLOURS.index(_CHOSEN), entry) for _, entry in own if chosen is not None])
        return _finished(figure, f"d33 of {len(sensors)} sensors over time", times, legend=False)
    figure = go.Figure([_one(number, entry) for number, entry in own])
    return _finished(figure, "d33 of each sensor over time", times, legend=len(own) > 1)


def _one(number: int, entry: SensorPoints) -> go.Scatter:
    bars = [SDS_OF_95 * value for value in entry.d33_uncertainty_pc_per_n]
    colour = LINE_COLOURS[number % len(LINE_COLOURS)]
    dense = len(entry.times) > _MOST_APART
    return go.Scatter(
        x=list(entry.times),
        y=list(entry.d33_pc_per_n),
        customdata=[entry.sensor] * len(entry.times),
        error_y={"type": "data", "array": bars, "thickness": 1, **(_faint(colour) if dense else {"width": 3})},
        mode="lines+markers",
        name=label(entry.sensor),
        line={"color": colour, "width": 1.5},
        marker={"symbol": MARKERS[(number + number // len(LINE_COLOURS)) % len(MARKERS)], "size": 4 if dense else 8},
        hovertemplate=f"{label(entry.sensor)}, %{{x|%d %b %Y %H:%M}} UTC<br>d33 %{{y:.5g}} "
        f"± %{{error_y.array:.2g}} pC/N (95 %)<br>{label(entry.trend)}<extra></extra>",
    )


def _faint(colour: str) -> dict[str, str | int]:
    """Error bars of points that lie close to each other: without ends, and with what they cross seen through them."""
    red, green, blue = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return {"width": 0, "color": f"rgba({red},{green},{blue},0.25)"}


def _most(sensors: Sequence[SensorPoints]) -> list[go.Scatter]:
    """The band and the median of all sensors at each time, the points of those that stand apart, all points, faint, and
    a line that is empty until one of them is pointed at."""
    at: dict[str, list[tuple[str, float, float]]] = {}
    for entry in sensors:
        for time, value, uncertainty in zip(
            entry.times, entry.d33_pc_per_n, entry.d33_uncertainty_pc_per_n, strict=True
        ):
            at.setdefault(time, []).append((entry.sensor, value, uncertainty))
    times = sorted(at)
    found = [many_sensors(*(np.array([row[part] for row in at[time]]) for part in (1, 2))) for time in times]
    apart = [(time, *at[time][place]) for time, one in zip(times, found, strict=True) for place in one.apart]
    band = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    return [
        go.Scatter(x=times, y=[one.high for one in found], name="90 % of the sensors", **band),
        go.Scatter(
            x=times, y=[one.low for one in found], name="90 % of the sensors", fill="tonexty",
            fillcolor="rgba(0,114,178,0.15)", **band,
        ),
        go.Scatter(
            x=times, y=[one.median for one in found], mode="lines+markers", name="median of the sensors",
            line={"color": COLOURS[0], "width": 1.5}, marker={"size": 6},
            hovertemplate="%{x|%d %b %Y %H:%M} UTC<br>median d33 %{y:.5g} pC/N<extra></extra>",
        ),
        go.Scatter(
            x=[time for time, *_ in apart],
            y=[value for _, _, value, _ in apart],
            customdata=[row[1] for row in apart],
            error_y={"type": "data", "array": [SDS_OF_95 * row[3] for row in apart], "thickness": 1, "width": 3},
            mode="markers+text",
            name="stands apart",
            text=_names(apart, float(np.ptp([value for rows in at.values() for _, value, _ in rows]))),
            textposition=["middle right" if time == times[0] else "middle left" for time, *_ in apart],
            hovertext=[label(sensor) for _, sensor, *_ in apart],
            marker={"color": COLOURS[1], "symbol": "square", "size": 8},
            hovertemplate="%{hovertext}, %{x|%d %b %Y %H:%M} UTC<br>d33 %{y:.5g} pC/N<extra></extra>",
        ),
        *_each(sensors),
    ]  # fmt: skip


def _names(apart: Sequence[tuple[str, str, float, float]], span: float) -> list[str]:
    """What is written beside each point that stands apart: of points of one time that lie too close to each other for
    a line each the first has the names of all, the others have none. `span`: of all values."""
    written = [""] * len(apart)
    close: list[int] = []
    for place in sorted(range(len(apart)), key=lambda each: (apart[each][0], apart[each][2])):
        before = apart[close[-1]] if close else None
        if before is None or before[0] != apart[place][0] or apart[place][2] - before[2] > _LINE * span:
            close = []
        close.append(place)
        names = [label(apart[one][1]) for one in sorted(close, key=lambda one: apart[one][1])[:_MOST_BESIDE]]
        more = len(close) - len(names)
        written[close[0]] = ", ".join(names) + (f" and {more} more" if more else "")
    return written


def _each(sensors: Sequence[SensorPoints]) -> list[go.Scatter]:
    """All points, faint, with their sensors, by which a page draws the line of the one that is pointed at."""
    points = [
        (time, value, entry.sensor)
        for entry in sensors
        for time, value in zip(entry.times, entry.d33_pc_per_n, strict=True)
    ]
    if len(points) > _MOST_FAINT:
        return []
    return [
        go.Scatter(
            x=[time for time, *_ in points],
            y=[value for _, value, _ in points],
            customdata=[sensor for *_, sensor in points],
            mode="markers",
            name="every sensor",
            marker={"color": "#8a949e", "size": 4, "opacity": 0.5},
            text=[label(sensor) for *_, sensor in points],
            hovertemplate="%{text}, %{x|%d %b %Y %H:%M} UTC<br>d33 %{y:.5g} pC/N<extra></extra>",
        ),
        go.Scatter(
            x=[],
            y=[],
            mode="lines+markers",
            name="pointed at",
            line={"color": _CHOSEN, "width": 2.5},
            hovertemplate="%{text}, %{x|%d %b %Y %H:%M} UTC<br>d33 %{y:.4g} pC/N<extra></extra>",
        ),
    ]


def _finished(figure: go.Figure, title: str, times: Sequence[str], *, legend: bool) -> go.Figure:
    figure.update_xaxes(title="recorded", type="date")
    moments = sorted(datetime.fromisoformat(time) for time in times)
    if moments and moments[-1] - moments[0] < _DAY:  # otherwise the axis of a single campaign would show milliseconds
        first, last = max(moments[0], _CALENDAR[0]) - _DAY, min(moments[-1], _CALENDAR[1]) + _DAY
        figure.update_xaxes(range=[first, last], dtick=_DAY_MS, tickformat="%d %b %Y")
    figure.update_yaxes(title="d33, 95 % [pC/N]")
    # Dates may have two lines of ticks above the axis' title.
    return styled(figure.update_layout(showlegend=legend, margin={"b": 75}), title)
