"""Figures of an array: its map, FRF against preload per indenter (Seminara 2018, figure 15), and the response of each
sensor (figure 16).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.errors import unequal_lengths
from underskin.figures.style import COLOURS, MARKERS, label, styled
from underskin.units import Floats

_HOVER_INTERVAL = "%{text}<br>d33 %{y:.5g} pC/N<br>%{customdata[0]:.5g} to %{customdata[1]:.5g} (95 %)<extra></extra>"


@dataclass(frozen=True)
class Quantity:
    """The quantity that a map shows of each sensor; `diverging`: the colour scale is centred on 0."""

    name: str
    unit: str
    diverging: bool = False


D33 = Quantity("d33", "pC/N")


def array_map(
    sensors: Sequence[str],
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    values: ArrayLike,
    uncertainties: ArrayLike,
    reasons: Sequence[str],
    quantity: Quantity = D33,
) -> go.Figure:
    """Map of the sensors, coloured by d33 or another quantity; `reasons` says why a sensor stands out, empty otherwise.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    x, y, value, uncertainty = _columns(sensors, x_mm=x_mm, y_mm=y_mm, values=values, uncertainties=uncertainties)
    plain = np.array([not reason for reason in reasons])
    size = 26 if len(sensors) <= 16 else 18 if len(sensors) <= 100 else 10
    figure = go.Figure()
    hover = f"%{{text}}<br>{quantity.name} %{{customdata[0]:.5g}} ± %{{customdata[1]:.3g}} {quantity.unit}"
    for name, chosen, symbol in (("sensor", plain, "circle"), ("stands out", ~plain, "x")):
        if not chosen.any():
            continue
        figure.add_scatter(
            x=x[chosen],
            y=y[chosen],
            mode="markers",
            name=name,
            text=[_with_reason(sensors[row], reasons[row]) for row in np.flatnonzero(chosen).tolist()],
            customdata=np.column_stack([value, uncertainty])[chosen],
            hovertemplate=f"{hover}<br>x %{{x:.4g}} mm, y %{{y:.4g}} mm<extra></extra>",
            marker={
                "symbol": symbol,
                "size": size,
                "color": value[chosen],
                "colorbar": {"title": {"text": f"{quantity.name} [{quantity.unit}]", "side": "right"}},
                "line": {"width": 1, "color": "#000000"},
                **_scale(value, quantity),
            },
        )
    figure.update_xaxes(title="x [mm]")
    figure.update_yaxes(title="y [mm]", scaleanchor="x", scaleratio=1)
    return styled(figure, f"{quantity.name} over the array")


def _scale(values: Floats, quantity: Quantity) -> dict[str, Any]:
    """The colours' scale and its ends: one for all traces."""
    known = values[np.isfinite(values)]
    if quantity.diverging:
        largest = float(np.abs(known).max(initial=0.0)) or 1.0
        return {"colorscale": "PuOr_r", "cmin": -largest, "cmax": largest}
    ends = {"cmin": float(known.min()), "cmax": float(known.max())} if len(known) else {}
    return {"colorscale": "Cividis", **ends}


def frf_versus_preload(
    recordings: Sequence[str],
    indenter_radius_mm: ArrayLike,
    preload_n: ArrayLike,
    frf_pc_per_n: ArrayLike,
    frf_uncertainty_pc_per_n: ArrayLike,
    model_frf_pc_per_n: ArrayLike,
) -> go.Figure:
    """The measured FRF of each recording and the model's line, per indenter.

    Raises InvalidInput where a column's length differs from that of `recordings`.
    """
    radius, preload, frf, uncertainty, model = _columns(
        recordings,
        indenter_radius_mm=indenter_radius_mm,
        preload_n=preload_n,
        frf_pc_per_n=frf_pc_per_n,
        frf_uncertainty_pc_per_n=frf_uncertainty_pc_per_n,
        model_frf_pc_per_n=model_frf_pc_per_n,
    )
    figure = go.Figure()
    for number, size in enumerate(np.unique(radius)):
        chosen = radius == size
        colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
        figure.add_scatter(
            x=preload[chosen],
            y=frf[chosen],
            error_y={"type": "data", "array": uncertainty[chosen], "thickness": 1},
            mode="markers",
            name=f"{size:.3g} mm, measured",
            text=[label(recordings[row]) for row in np.flatnonzero(chosen).tolist()],
            hovertemplate=f"%{{text}}<br>sphere {size:g} mm, %{{x:.3g}} N<br>FRF %{{y:.5g}} pC/N<extra></extra>",
            marker={"color": colour, "symbol": marker, "size": 8, "opacity": 0.7},
        )
        at, first = np.unique(preload[chosen], return_index=True)
        figure.add_scatter(
            x=at,
            y=model[chosen][first],
            mode="lines",
            name=f"{size:.3g} mm, model",
            hovertemplate=f"model, sphere {size:g} mm, %{{x:.3g}} N<br>FRF %{{y:.5g}} pC/N<extra></extra>",
            line={"color": colour, "dash": ("solid", "dash", "dot")[number % 3]},
        )
    figure.update_xaxes(title="preload [N]", rangemode="tozero")
    figure.update_yaxes(title="FRF in the flat zone [pC/N]", rangemode="tozero")
    return styled(figure, "FRF against preload")


def response_per_sensor(
    sensors: Sequence[str],
    d33_pc_per_n: ArrayLike,
    low_pc_per_n: ArrayLike,
    high_pc_per_n: ArrayLike,
    array_pc_per_n: tuple[float, float] | None,
    reasons: Sequence[str],
) -> go.Figure:
    """d33 of each sensor with its 95 % interval, and that of the array (low, high), where there is one, as a band.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    d33, low, high = _columns(
        sensors, d33_pc_per_n=d33_pc_per_n, low_pc_per_n=low_pc_per_n, high_pc_per_n=high_pc_per_n
    )
    figure = go.Figure()
    if array_pc_per_n is not None:
        low_end, high_end = array_pc_per_n
        figure.add_hrect(
            y0=low_end, y1=high_end, fillcolor=COLOURS[5], opacity=0.35, line_width=0, annotation_text="array, 95 %"
        )
    plain = np.array([not reason for reason in reasons])
    for name, chosen, style in (("sensor", plain, 0), ("stands out", ~plain, 1)):
        if not chosen.any():
            continue
        figure.add_scatter(
            x=[label(sensors[row]) for row in np.flatnonzero(chosen).tolist()],
            y=d33[chosen],
            error_y={
                "type": "data",
                "symmetric": False,
                "array": (high - d33)[chosen],
                "arrayminus": (d33 - low)[chosen],
                "thickness": 1,
            },
            mode="markers",
            name=name,
            text=[_with_reason(sensors[row], reasons[row]) for row in np.flatnonzero(chosen).tolist()],
            customdata=np.column_stack([low, high])[chosen],
            hovertemplate=_HOVER_INTERVAL,
            marker={"color": COLOURS[style], "symbol": MARKERS[(0, 5)[style]], "size": 9},
        )
    # Names may be long.
    figure.update_xaxes(title="sensor", automargin=True, categoryorder="array", categoryarray=list(map(label, sensors)))
    figure.update_yaxes(title="d33 [pC/N]")
    return styled(figure, "Response of each sensor")


def _columns(rows: Sequence[str], **columns: ArrayLike) -> list[Floats]:
    arrays = []
    for name, column in columns.items():
        array = np.asarray(column, dtype=float)
        if array.shape != (len(rows),):
            raise unequal_lengths(name, array.size, len(rows), "rows")
        arrays.append(array)
    return arrays


def _with_reason(name: str, reason: str) -> str:
    return f"{label(name)}: {escape(reason, quote=False)}" if reason else label(name)
