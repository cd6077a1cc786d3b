"""Several loads, or a map of pressure, on an array, and the charge on its sensors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.array_stress.answer import BaseStress
from underskin.diagnosis.reporting.page_styles import BOUND
from underskin.figures.array_map import Quantity, array_map
from underskin.figures.style import COLOURS, styled

_ROOM = 0.06  # of the map, between a load and its edge
_TENSION = 0.01  # of the largest compression, below which colours do not show tension
_CHARGE = Quantity("charge", "pC", "bound")


def loaded_array(
    sensors: Sequence[str],
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    charge_pc: ArrayLike,
    charge_error_pc: ArrayLike,
    loads_mm: Sequence[tuple[float, float]],
    sensor_radius_mm: float | None = None,
) -> go.Figure:
    """Each sensor coloured by its charge, grey where that is 0 within its error, at its true size where
    `sensor_radius_mm` is given, with the loads that have positions.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    figure = array_map(
        sensors, x_mm, y_mm, charge_pc, charge_error_pc, [""] * len(sensors), _CHARGE, None, sensor_radius_mm
    )
    if loads_mm:
        figure.add_scatter(
            x=[x for x, _ in loads_mm],
            y=[y for _, y in loads_mm],
            mode="markers",
            name="load",
            text=[f"load {number}" for number in range(1, len(loads_mm) + 1)],
            hovertemplate="%{text}: x %{x:.4g} mm, y %{y:.4g} mm<extra></extra>",
            marker={"symbol": "x-thin", "size": 14, "line": {"width": 3, "color": "#D55E00"}},
        )
        for axis, coordinate in ((figure.layout.xaxis, 0), (figure.layout.yaxis, 1)):
            positions = [position[coordinate] for position in loads_mm]
            low, high = axis.range
            room = _ROOM * (max(high, *positions) - min(low, *positions))
            axis.range = [min(low, min(positions) - room), max(high, max(positions) + room)]
    return styled(figure, "Charge on the array")


def pressure_on_array(
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    pressure_mpa: ArrayLike,
    sensors_mm: Sequence[tuple[float, float]],
    sensor_radius_mm: float,
) -> go.Figure:
    """The pressure (y, x) over the skin, with the outlines of the sensors."""
    figure = go.Figure(
        go.Heatmap(
            x=np.asarray(x_mm),
            y=np.asarray(y_mm),
            z=np.asarray(pressure_mpa),
            colorscale="Cividis",
            colorbar={"title": {"text": "pressure [MPa]", "side": "right"}},
            hovertemplate="x %{x:.4g} mm, y %{y:.4g} mm<br>%{z:.5g} MPa<extra></extra>",
        )
    )
    look = {"showlegend": True, "line": {"color": "#D55E00", "width": 2}}
    _outline(figure, "sensor", sensors_mm, [sensor_radius_mm] * len(sensors_mm), look)
    figure.update_xaxes(title="x [mm]", showgrid=False, zeroline=False)
    figure.update_yaxes(title="y [mm]", showgrid=False, zeroline=False, scaleanchor="x", scaleratio=1)
    return styled(figure, "Pressure on the array")


def stress_on_base(
    stress: BaseStress,
    contacts_mm: Sequence[tuple[float, float]],
    sensors_mm: Sequence[tuple[float, float]],
    sensor_radius_mm: float,
) -> go.Figure:
    """Compression (−σ_zz) on the base under all loads, with the outlines of contacts and sensors.

    Where tension reaches a share of the compression, 0 is in the middle of the colours.
    """
    compression = 0.0 - stress.sigma_zz_mpa
    low, high = float(compression.min()), float(compression.max())
    pulls = -low > _TENSION * high
    reach = max(-low, high) or 1.0
    figure = go.Figure(
        go.Heatmap(
            x=stress.x_mm,
            y=stress.y_mm,
            z=compression,
            zmin=-reach if pulls else 0.0,
            zmax=reach,
            zsmooth="best",
            colorscale="PuOr_r" if pulls else "Cividis",
            colorbar={"title": {"text": "compression −σ<sub>zz</sub> [MPa]", "side": "right"}},
            hovertemplate="x %{x:.4g} mm, y %{y:.4g} mm<br>compression %{z:.4g} MPa<extra></extra>",
        )
    )
    edge = {"line": {"color": COLOURS[3], "width": 2, "dash": BOUND}}
    _outline(figure, "contact", contacts_mm, stress.contact_radius_mm, edge)
    disc = {"line": {"color": COLOURS[1], "width": 2}}
    _outline(figure, "sensor", sensors_mm, [sensor_radius_mm] * len(sensors_mm), disc)
    for update, coordinates in ((figure.update_xaxes, stress.x_mm), (figure.update_yaxes, stress.y_mm)):
        update(
            range=[float(coordinates[0]), float(coordinates[-1])], constrain="domain", showgrid=False, zeroline=False
        )
    figure.update_xaxes(title="x [mm]")
    figure.update_yaxes(title="y [mm]", scaleanchor="x", scaleratio=1)
    return styled(figure, "Stress on the base")


def _outline(
    figure: go.Figure, name: str, centres: Sequence[tuple[float, float]], radii: ArrayLike, look: dict[str, Any]
) -> None:
    """Draw circles, each followed by a gap."""
    angle = np.append(np.linspace(0, 2 * np.pi, 33), np.nan)
    (x, y), radius = np.reshape(centres, (-1, 2)).T[..., None], np.asarray(radii)[:, None]
    along, across = (x + radius * np.cos(angle)).ravel(), (y + radius * np.sin(angle)).ravel()
    figure.add_scatter(x=along, y=across, mode="lines", name=name, hoverinfo="skip", **look)
