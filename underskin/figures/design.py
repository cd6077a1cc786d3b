"""Figures of a design: σ and γ over their arguments, with the design's own point, and the response of an array."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.figures.style import COLOURS, DASHES, styled
from underskin.prediction.skin_design import Design
from underskin.units import to_lab

_TITLES = {"a_over_h": "a/h", "rt_over_h": "rT/h", "load_parameter": "L = F/(R²E)"}
_SENSORS = 2  # drawn to each side of the middle one


@dataclass(frozen=True)
class Mark:
    """A point on the sweeps: a/h, rT/h, L and σ there."""

    name: str
    a_over_h: float
    rt_over_h: float
    load_parameter: float
    sigma: float


def design_overview(design: Design, own: Mark | None) -> go.Figure:
    """σ and γ over each of a/h, rT/h and L, the others as designed; `own`: the skin that is varied."""
    figure = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03)
    contact = design.contact
    chosen = Mark(
        "this design",
        float(contact.a_over_h),
        float(contact.rt_over_h),
        float(contact.load_parameter),
        float(contact.sigma),
    )
    for column, sweep in enumerate(design.sweeps, start=1):
        first = column == 1
        for name, values, colour, dash in (
            ("σ, this sphere", sweep.sigma, COLOURS[0], DASHES[0]),
            ("γ, a point load", sweep.gamma, COLOURS[1], DASHES[1]),
        ):
            figure.add_scatter(
                x=sweep.values, y=values, mode="lines", name=name, legendgroup=name, showlegend=first,
                line={"color": colour, "dash": dash, "width": 1.8},
                hovertemplate=f"{_TITLES[sweep.axis]} %{{x:.4g}}<br>{name[0]} %{{y:.4g}}<extra></extra>",
                row=1, col=column,
            )  # fmt: skip
        for mark, symbol, colour in ((own, "diamond-open", COLOURS[6]), (chosen, "circle", COLOURS[0])):
            if mark is not None:
                figure.add_scatter(
                    x=[getattr(mark, sweep.axis)], y=[mark.sigma], mode="markers", name=mark.name,
                    legendgroup=mark.name, showlegend=first,
                    marker={"symbol": symbol, "color": colour, "size": 12, "line": {"width": 2}},
                    hovertemplate=f"{mark.name}<br>{_TITLES[sweep.axis]} %{{x:.4g}}<br>σ %{{y:.5g}}<extra></extra>",
                    row=1, col=column,
                )  # fmt: skip
        figure.update_xaxes(title=_TITLES[sweep.axis], row=1, col=column)
    figure.update_yaxes(title="σ and γ", rangemode="tozero", row=1, col=1)
    return styled(figure, "What reaches a sensor", 380)


def array_response(design: Design, pitch_mm: float) -> go.Figure:
    """Response of each sensor of a row over the contact's position along it, relative to a contact above a sensor."""
    figure = go.Figure()
    offset = to_lab("x_mm", design.offset)
    percent = 100 * design.response / design.response[0]
    places = np.concatenate([-offset[:0:-1], offset])
    mirrored = np.concatenate([percent[:0:-1], percent])
    half_width = (_SENSORS + 0.5) * pitch_mm
    for number in range(-_SENSORS, _SENSORS + 1):
        near = np.abs(places + number * pitch_mm) <= half_width
        figure.add_scatter(
            x=(places + number * pitch_mm)[near], y=mirrored[near], mode="lines",
            name=f"sensor at {number * pitch_mm:g} mm",
            line={"color": COLOURS[abs(number)], "dash": DASHES[(number + _SENSORS) % len(DASHES)], "width": 1.8},
            showlegend=False, hovertemplate="contact at %{x:.3g} mm<br>sensor reads %{y:.3g} %<extra></extra>",
        )  # fmt: skip
    half = 1e3 * design.resolution.width / 2
    if np.isfinite(half):
        figure.add_scatter(
            x=[-half, half], y=[50, 50], mode="lines+markers", name=f"resolution {2 * half:.3g} mm",
            line={"color": COLOURS[6], "width": 2}, marker={"symbol": "line-ns-open", "size": 12},
            hoverinfo="name",
        )  # fmt: skip
    figure.update_xaxes(title="place of the contact [mm]", range=[-half_width, half_width])
    figure.update_yaxes(title="response [%]")
    return styled(figure, "What a row of sensors sees", 380)
