"""d33 of each sensor over time, or of many sensors together."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
import plotly.graph_objects as go

from underskin.diagnosis.reporting.page_styles import LINE_COLOURS
from underskin.figures.style import COLOURS, MARKERS, label, styled
from underskin.inversion.mixed_model import MOST_NAMED, SDS_OF_95, many_sensors

_MOST_POINTS = 600  # of a history that shows each sensor
_MOST_WITH_CAPS = 60  # points of a line, up to which error bars have caps
_MOST_FAINT = 6000  # of a history that shows their median and spread
_LINE_HEIGHT = 0.06  # of the span of all values: height of a label
_MOST_NAMES = 3  # names in one label
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
    """Whether this many sensors and points are drawn as their median and spread."""
    return sensors > MOST_NAMED or (points > _MOST_POINTS and sensors > 1)


def d33_history(sensors: Sequence[SensorPoints], chosen: str | None = None) -> go.Figure:
    """A line for each sensor, with 95 % intervals, or for the one that is `chosen`. Many sensors are drawn as their
    median, the range of 90 % of them as a band, outliers by name, and the chosen one's line."""
    times = [time for series in sensors for time in series.times]
    drawn = [(number, series) for number, series in enumerate(sensors) if chosen in (None, series.sensor)]
    if is_summarised(len(sensors), len(times)):
        figure = go.Figure(_summary_traces(sensors))
        figure.add_traces([_sensor_line(COLOURS.index(_CHOSEN), series) for _, series in drawn if chosen is not None])
        return _finished(figure, f"d33 of {len(sensors)} sensors over time", times, legend=False)
    figure = go.Figure([_sensor_line(number, series) for number, series in drawn])
    return _finished(figure, "d33 of each sensor over time", times, legend=len(drawn) > 1)


def _sensor_line(number: int, series: SensorPoints) -> go.Scatter:
    bars = [SDS_OF_95 * value for value in series.d33_uncertainty_pc_per_n]
    colour = LINE_COLOURS[number % len(LINE_COLOURS)]
    dense = len(series.times) > _MOST_WITH_CAPS
    return go.Scatter(
        x=list(series.times),
        y=list(series.d33_pc_per_n),
        customdata=[series.sensor] * len(series.times),
        error_y={"type": "data", "array": bars, "thickness": 1, **(_faint(colour) if dense else {"width": 3})},
        mode="lines+markers",
        name=label(series.sensor),
        line={"color": colour, "width": 1.5},
        marker={"symbol": MARKERS[(number + number // len(LINE_COLOURS)) % len(MARKERS)], "size": 4 if dense else 8},
        hovertemplate=f"{label(series.sensor)}, %{{x|%d %b %Y %H:%M}} UTC<br>d33 %{{y:.5g}} "
        f"± %{{error_y.array:.2g}} pC/N (95 %)<br>{label(series.trend)}<extra></extra>",
    )


def _faint(colour: str) -> dict[str, str | int]:
    """Error bars of dense points: without caps, translucent."""
    red, green, blue = (int(colour[start : start + 2], 16) for start in (1, 3, 5))
    return {"width": 0, "color": f"rgba({red},{green},{blue},0.25)"}


def _summary_traces(sensors: Sequence[SensorPoints]) -> list[go.Scatter]:
    """The band and the median of all sensors at each time, the outliers, all points, faint, and an empty line for
    the sensor under the pointer."""
    at: dict[str, list[tuple[str, float, float]]] = {}
    for series in sensors:
        for time, value, uncertainty in zip(
            series.times, series.d33_pc_per_n, series.d33_uncertainty_pc_per_n, strict=True
        ):
            at.setdefault(time, []).append((series.sensor, value, uncertainty))
    times = sorted(at)
    summaries = [many_sensors(*(np.array([row[part] for row in at[time]]) for part in (1, 2))) for time in times]
    outliers = [
        (time, *at[time][index]) for time, summary in zip(times, summaries, strict=True) for index in summary.apart
    ]
    band = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    return [
        go.Scatter(x=times, y=[summary.high for summary in summaries], name="90 % of the sensors", **band),
        go.Scatter(
            x=times, y=[summary.low for summary in summaries], name="90 % of the sensors", fill="tonexty",
            fillcolor="rgba(0,114,178,0.15)", **band,
        ),
        go.Scatter(
            x=times, y=[summary.median for summary in summaries], mode="lines+markers", name="median of the sensors",
            line={"color": COLOURS[0], "width": 1.5}, marker={"size": 6},
            hovertemplate="%{x|%d %b %Y %H:%M} UTC<br>median d33 %{y:.5g} pC/N<extra></extra>",
        ),
        go.Scatter(
            x=[time for time, *_ in outliers],
            y=[value for _, _, value, _ in outliers],
            customdata=[row[1] for row in outliers],
            error_y={"type": "data", "array": [SDS_OF_95 * row[3] for row in outliers], "thickness": 1, "width": 3},
            mode="markers+text",
            name="stands apart",
            text=_names(outliers, float(np.ptp([value for rows in at.values() for _, value, _ in rows]))),
            textposition=["middle right" if time == times[0] else "middle left" for time, *_ in outliers],
            hovertext=[label(sensor) for _, sensor, *_ in outliers],
            marker={"color": COLOURS[1], "symbol": "square", "size": 8},
            hovertemplate="%{hovertext}, %{x|%d %b %Y %H:%M} UTC<br>d33 %{y:.5g} pC/N<extra></extra>",
        ),
        *_all_points(sensors),
    ]  # fmt: skip


def _names(outliers: Sequence[tuple[str, str, float, float]], span: float) -> list[str]:
    """The label of each outlier. Outliers of one time that are too close for a line each share one label at the first.
    `span`: range of all values."""
    written = [""] * len(outliers)
    cluster: list[int] = []
    for index in sorted(range(len(outliers)), key=lambda index: (outliers[index][0], outliers[index][2])):
        before = outliers[cluster[-1]] if cluster else None
        if before is None or before[0] != outliers[index][0] or outliers[index][2] - before[2] > _LINE_HEIGHT * span:
            cluster = []
        cluster.append(index)
        names = [
            label(outliers[index][1]) for index in sorted(cluster, key=lambda index: outliers[index][1])[:_MOST_NAMES]
        ]
        more = len(cluster) - len(names)
        written[cluster[0]] = ", ".join(names) + (f" and {more} more" if more else "")
    return written


def _all_points(sensors: Sequence[SensorPoints]) -> list[go.Scatter]:
    """All points, faint, with their sensors: a page draws the line of the one under the pointer."""
    points = [
        (time, value, series.sensor)
        for series in sensors
        for time, value in zip(series.times, series.d33_pc_per_n, strict=True)
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
