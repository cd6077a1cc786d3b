"""Figures of an array: FRF against preload per indenter (Seminara 2018, figure 15), and the response of each sensor
(figure 16)."""

from collections.abc import Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.diagnosis.reporting.page_styles import PAPER
from underskin.figures.style import COLOURS, INK, MARKERS, as_columns, label, styled
from underskin.inversion.mixed_model import SDS_OF_95

_HOVER_INTERVAL = "%{text}<br>d33 %{y:.5g} pC/N<br>%{customdata[0]:.5g} to %{customdata[1]:.5g} (95 %)<extra></extra>"


def frf_versus_preload(
    recordings: Sequence[str],
    indenter_radius_mm: ArrayLike,
    preload_n: ArrayLike,
    frf_pc_per_n: ArrayLike,
    frf_uncertainty_pc_per_n: ArrayLike,
    model_frf_pc_per_n: ArrayLike,
) -> go.Figure:
    """The measured FRF of each recording with its 95 % interval, and the paper's model as a dashed line, per indenter;
    uncertainties are standard ones.

    Raises InvalidInput where a column's length differs from that of `recordings`.
    """
    radius, preload, frf, uncertainty, model = as_columns(
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
            error_y={"type": "data", "array": SDS_OF_95 * uncertainty[chosen], "thickness": 1},
            mode="markers",
            name=f"R {size:.3g} mm, measured",
            text=[label(recordings[row]) for row in np.flatnonzero(chosen).tolist()],
            hovertemplate=f"%{{text}}<br>sphere of radius {size:g} mm, %{{x:.3g}} N<br>FRF %{{y:.5g}} "
            "± %{error_y.array:.2g} pC/N (95 %)<extra></extra>",
            marker={"color": colour, "symbol": marker, "size": 8, "opacity": 0.7},
        )
        at, first = np.unique(preload[chosen], return_index=True)
        figure.add_scatter(
            x=at,
            y=model[chosen][first],
            mode="lines",
            name=f"R {size:.3g} mm, model",
            hovertemplate=f"model, sphere of radius {size:g} mm, %{{x:.3g}} N<br>FRF %{{y:.5g}} pC/N<extra></extra>",
            line={"color": colour, "dash": PAPER},
        )
    figure.update_xaxes(title="preload [N]", rangemode="tozero")
    figure.update_yaxes(title="FRF in the flat zone, 95 % [pC/N]", rangemode="tozero")
    return styled(figure, "FRF against preload")


def response_per_sensor(
    sensors: Sequence[str],
    d33_pc_per_n: ArrayLike,
    low_pc_per_n: ArrayLike,
    high_pc_per_n: ArrayLike,
    array_pc_per_n: tuple[float, float] | None,
    reasons: Sequence[str],
    chosen: str | None = None,
) -> go.Figure:
    """d33 of each sensor with its 95 % interval, and that of the array (low, high), where there is one, as a band;
    `chosen` is ringed.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    d33, low, high = as_columns(
        sensors, d33_pc_per_n=d33_pc_per_n, low_pc_per_n=low_pc_per_n, high_pc_per_n=high_pc_per_n
    )
    figure = go.Figure()
    if array_pc_per_n is not None:
        low_end, high_end = array_pc_per_n
        figure.add_hrect(
            y0=low_end, y1=high_end, fillcolor=COLOURS[5], opacity=0.22, line_width=0, annotation_text="array, 95 %"
        )
    plain = np.array([not reason for reason in reasons])
    for name, mask, style in (("sensor", plain, 0), ("marked", ~plain, 1)):
        if not mask.any():
            continue
        rows = np.flatnonzero(mask).tolist()
        figure.add_scatter(
            x=[label(sensors[row]) for row in rows],
            y=d33[mask],
            ids=[sensors[row] for row in rows],
            error_y={
                "type": "data",
                "symmetric": False,
                "array": (high - d33)[mask],
                "arrayminus": (d33 - low)[mask],
                "thickness": 1,
            },
            mode="markers",
            name=name,
            text=[_with_reason(sensors[row], reasons[row]) for row in rows],
            customdata=np.column_stack([low, high])[mask],
            hovertemplate=_HOVER_INTERVAL,
            marker={
                "color": COLOURS[style],
                "symbol": MARKERS[(0, 5)[style]],
                "size": [14 if sensors[row] == chosen else 9 for row in rows],
                "line": {"color": INK, "width": [3 if sensors[row] == chosen else 0 for row in rows]},
            },
        )
    # Names may be long.
    figure.update_xaxes(title="sensor", automargin=True, categoryorder="array", categoryarray=list(map(label, sensors)))
    figure.update_yaxes(title="d33, 95 % [pC/N]")
    return styled(figure, "Response of each sensor")


def _with_reason(name: str, reason: str) -> str:
    return f"{label(name)}: {escape(reason, quote=False)}" if reason else label(name)
