"""The designs that meet a demand: thickness against sensor radius, coloured by the largest pitch."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from underskin.figures.style import COLOURS, INK, MARKERS, styled
from underskin.units import Floats, Mask

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
        scale = _pitches(largest_pitch_mm[feasible]) if colour is None else _plain(colour)
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


def _plain(colour: str) -> dict[str, Any]:
    """One colour for all values."""
    return {"colorscale": [[0, colour], [1, colour]], "showscale": False}
