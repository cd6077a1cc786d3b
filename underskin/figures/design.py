"""Figures of a design: σ and γ over their arguments, with the design's own point, and the response of an array; and the
designs that meet a demand, thickness against sensor radius, coloured by the largest pitch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.reporting.page_styles import BOUND
from underskin.figures.style import COLOURS, INK, MARKERS, styled
from underskin.prediction.skin_design import Design
from underskin.units import Floats, Mask, to_lab

_TITLES = {"a_over_h": "a/h", "rt_over_h": "rT/h", "load_parameter": "L = F/(R²E)"}
_SENSORS = 2  # drawn to each side of the middle one


@dataclass(frozen=True)
class Pinned:
    """Another design and its name, for comparison with the drawn one."""

    name: str
    design: Design


def design_overview(design: Design, pinned: Pinned | None) -> go.Figure:
    """σ and γ over each of a/h, rT/h and L, the others as designed; `pinned`: another design, drawn as a point."""
    figure = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03)
    marks = [] if pinned is None else [(pinned, "diamond-open", COLOURS[6])]
    marks.append((Pinned("this design", design), "circle", COLOURS[0]))
    for column, sweep in enumerate(design.sweeps, start=1):
        first = column == 1
        for number, (name, values) in enumerate((("σ, this sphere", sweep.sigma), ("γ, a point load", sweep.gamma))):
            figure.add_scatter(
                x=sweep.values, y=values, mode="lines", name=name, legendgroup=name, showlegend=first,
                line={"color": COLOURS[number], "width": (2.4, 1.2)[number]},
                hovertemplate=f"{_TITLES[sweep.axis]} %{{x:.4g}}<br>{name[0]} %{{y:.4g}}<extra></extra>",
                row=1, col=column,
            )  # fmt: skip
        for mark, symbol, colour in marks:
            contact = mark.design.contact
            figure.add_scatter(
                x=[float(getattr(contact, sweep.axis))], y=[float(contact.sigma)], mode="markers", name=mark.name,
                legendgroup=mark.name, showlegend=first,
                marker={"symbol": symbol, "color": colour, "size": 12, "line": {"width": 2}},
                hovertemplate=f"{mark.name}<br>{_TITLES[sweep.axis]} %{{x:.4g}}<br>σ %{{y:.5g}}<extra></extra>",
                row=1, col=column,
            )  # fmt: skip
        figure.update_xaxes(title=_TITLES[sweep.axis], row=1, col=column)
    figure.update_yaxes(title="σ and γ", rangemode="tozero", row=1, col=1)
    return styled(figure, "What reaches a sensor", 380)


def array_response(design: Design, pitch_mm: float, pinned: Pinned | None = None) -> go.Figure:
    """Response of each sensor of a row over the contact's position along it, relative to a contact above a sensor;
    of the `pinned` design the middle sensor's."""
    figure = go.Figure()
    places, mirrored = _both_sides(design)
    half_width = (_SENSORS + 0.5) * pitch_mm
    for number in range(-_SENSORS, _SENSORS + 1):
        near = np.abs(places + number * pitch_mm) <= half_width
        figure.add_scatter(
            x=(places + number * pitch_mm)[near], y=mirrored[near], mode="lines",
            name=f"sensor at {number * pitch_mm:g} mm",
            line={"color": COLOURS[number + _SENSORS], "width": 1.8},
            showlegend=False, hovertemplate="contact at %{x:.3g} mm<br>sensor reads %{y:.3g} %<extra></extra>",
        )  # fmt: skip
    if pinned is not None:
        other, reading = _both_sides(pinned.design)
        near = np.abs(other) <= half_width
        figure.add_scatter(
            x=other[near], y=reading[near], mode="lines", name=pinned.name,
            line={"color": "#6b7680", "dash": BOUND, "width": 2.5},
            hovertemplate=f"{pinned.name}<br>contact at %{{x:.3g}} mm<br>sensor reads %{{y:.3g}} %<extra></extra>",
        )  # fmt: skip
    half = 1e3 * design.resolution.width / 2
    if np.isfinite(half):
        figure.add_scatter(
            x=[-half, half], y=[50, 50], mode="lines+markers", name=f"response width {2 * half:.3g} mm",
            line={"color": COLOURS[6], "width": 2}, marker={"symbol": "line-ns-open", "size": 12},
            hoverinfo="name",
        )  # fmt: skip
    figure.update_xaxes(title="place of the contact [mm]", range=[-half_width, half_width])
    figure.update_yaxes(title="response [%]")
    return styled(figure, "What a row of sensors sees", 380)


def _both_sides(design: Design) -> tuple[Floats, Floats]:
    """Positions of the contact along the row [mm] and the reading of the sensor at 0 [%]."""
    offset = np.asarray(to_lab("x_mm", design.offset))
    percent = 100 * design.response / design.response[0]
    return np.concatenate([-offset[:0:-1], offset]), np.concatenate([percent[:0:-1], percent])


# Translucent, so that they recede on white paper and on a dark ground.
_UNRESOLVED, _INFEASIBLE = "rgba(127,137,147,0.18)", "rgba(127,137,147,0.6)"
_LEAST_SPAN = 0.05  # of the largest pitch: the least range of the colours
_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20)
_BAR = {"title": {"text": "largest pitch [mm]", "side": "top"}, "orientation": "h", "y": -0.5, "thickness": 14}


@dataclass(frozen=True)
class Offered:
    """A proposed design [mm], and the criterion in which it is best."""

    name: str
    thickness_mm: float
    sensor_radius_mm: float


def design_region(
    thickness_mm: Floats,
    sensor_radius_mm: Floats,
    largest_pitch_mm: Floats,
    frf_pc_per_n: Floats,
    feasible: Mask,
    offered: Sequence[Offered],
) -> go.Figure:
    """Where the demand is met.

    Parameters
    ----------
    thickness_mm, sensor_radius_mm
        (n,) and (m,), equally spaced in the logarithm [mm].
    largest_pitch_mm, frf_pc_per_n, feasible
        (m, n) the largest pitch with the required resolution [mm], charge over force [pC/N], and which pairs meet all
        limits; NaN where there is none.
    offered
        Designs to be marked.
    """
    figure = go.Figure()
    resolved = np.isfinite(largest_pitch_mm)
    for name, mask, colour in (
        ("cannot resolve it", ~resolved, _UNRESOLVED),
        ("resolves it, another limit is missed", resolved & ~feasible, _INFEASIBLE),
        ("meets the demand", feasible, None),
    ):
        plain = {"colorscale": [[0, colour], [1, colour]], "showscale": False}
        scale = _pitches(largest_pitch_mm[feasible]) if colour is None else plain
        figure.add_heatmap(
            x=thickness_mm, y=sensor_radius_mm, z=np.where(mask, np.nan_to_num(largest_pitch_mm), np.nan), name=name,
            xgap=2, ygap=2, customdata=frf_pc_per_n, hoverongaps=False, showlegend=colour is not None, **scale,
            hovertemplate=f"h %{{x:.3g}} mm, rT %{{y:.3g}} mm<br>{name}<br>"
            "pitch up to %{z:.3g} mm, %{customdata:.3g} pC/N<extra></extra>",
        )  # fmt: skip
    for number, design in enumerate(offered):
        figure.add_scatter(
            x=[design.thickness_mm], y=[design.sensor_radius_mm], mode="markers", name=design.name,
            marker={"symbol": MARKERS[number], "size": 13, "color": COLOURS[1], "line": {"width": 2, "color": INK}},
            hovertemplate=f"{design.name}<br>h %{{x:.3g}} mm, rT %{{y:.3g}} mm<extra></extra>",
        )  # fmt: skip
    for update, title in ((figure.update_xaxes, "thickness h [mm]"), (figure.update_yaxes, "sensor radius rT [mm]")):
        update(title=title, type="log", tickvals=_TICKS, ticktext=[f"{tick:g}" for tick in _TICKS], zeroline=False)
    return styled(figure, "Which skins resolve it", 520).update_layout(margin={"l": 70, "r": 20, "t": 90, "b": 150})


def _pitches(pitches: Floats) -> dict[str, Any]:
    """A scale from the smallest to the largest, unless these are nearly equal."""
    high = float(np.max(pitches, initial=0.0)) or 1.0
    low = min(float(np.min(pitches, initial=high)), (1 - _LEAST_SPAN) * high)
    return {"colorscale": "Cividis", "zmin": low, "zmax": high, "colorbar": _BAR}
