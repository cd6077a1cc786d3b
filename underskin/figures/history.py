"""d33 of each sensor over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.figures.style import COLOURS, MARKERS, label, line, styled

_DAY = timedelta(days=1)


@dataclass(frozen=True)
class SensorPoints:
    """One sensor: times (ISO 8601, UTC), d33 and its standard uncertainty [pC/N]; `trend`: its trend in words."""

    sensor: str
    times: Sequence[str]
    d33_pc_per_n: Sequence[float]
    d33_uncertainty_pc_per_n: Sequence[float]
    trend: str


def d33_history(sensors: Sequence[SensorPoints]) -> go.Figure:
    """A line for each sensor, with standard uncertainties."""
    figure = go.Figure()
    for number, entry in enumerate(sensors):
        figure.add_scatter(
            x=list(entry.times),
            y=list(entry.d33_pc_per_n),
            error_y={"type": "data", "array": list(entry.d33_uncertainty_pc_per_n), "thickness": 1, "width": 3},
            mode="lines+markers",
            name=label(entry.sensor),
            line=line(number, 1.5),
            marker={"symbol": MARKERS[number % len(MARKERS)], "size": 8},
            hovertemplate=f"{label(entry.sensor)}, %{{x|%d %b %Y %H:%M}} UTC<br>d33 %{{y:.5g}} "
            f"± %{{error_y.array:.3g}} pC/N<br>{label(entry.trend)}<extra></extra>",
        )
    return _finished(figure, "d33 of each sensor over time", [time for entry in sensors for time in entry.times])


def array_history(
    times: Sequence[str], low_pc_per_n: ArrayLike, median_pc_per_n: ArrayLike, high_pc_per_n: ArrayLike
) -> go.Figure:
    """Median over the sensors at each time, with the range from the lowest to the highest sensor as a band."""
    figure = go.Figure()
    band = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    figure.add_scatter(x=list(times), y=np.asarray(high_pc_per_n), showlegend=False, **band)
    figure.add_scatter(
        x=list(times), y=np.asarray(low_pc_per_n), name="lowest to highest sensor", fill="tonexty",
        fillcolor="rgba(0,114,178,0.15)", **band,
    )  # fmt: skip
    figure.add_scatter(
        x=list(times), y=np.asarray(median_pc_per_n), mode="lines+markers", name="median of the sensors",
        line={"color": COLOURS[0], "width": 1.5}, marker={"size": 6},
        hovertemplate="%{x|%d %b %Y %H:%M} UTC<br>median d33 %{y:.5g} pC/N<extra></extra>",
    )  # fmt: skip
    return _finished(figure, "d33 of the array over time", times)


def _finished(figure: go.Figure, title: str, times: Sequence[str]) -> go.Figure:
    figure.update_xaxes(title="recorded", type="date")
    moments = sorted(datetime.fromisoformat(time) for time in times)
    if moments and moments[-1] - moments[0] < _DAY:  # otherwise the axis of a single campaign would show milliseconds
        figure.update_xaxes(range=[moments[0] - _DAY, moments[-1] + _DAY])
    figure.update_yaxes(title="d33 [pC/N]")
    return styled(figure, title)
