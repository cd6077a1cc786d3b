"""The charge on the sensors of an array under several loads."""

from collections.abc import Sequence

import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.figures.array import Quantity, array_map
from underskin.figures.style import styled

_CHARGE = Quantity("charge", "pC")


def loaded_array(
    sensors: Sequence[str],
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    charge_pc: ArrayLike,
    charge_error_pc: ArrayLike,
    loads_mm: Sequence[tuple[float, float]],
) -> go.Figure:
    """Each sensor coloured by its charge, and where the loads are.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    figure = array_map(sensors, x_mm, y_mm, charge_pc, charge_error_pc, [""] * len(sensors), _CHARGE)
    figure.add_scatter(
        x=[x for x, _ in loads_mm],
        y=[y for _, y in loads_mm],
        mode="markers",
        name="load",
        text=[f"load {number}" for number in range(1, len(loads_mm) + 1)],
        hovertemplate="%{text}: x %{x:.4g} mm, y %{y:.4g} mm<extra></extra>",
        marker={"symbol": "x-thin", "size": 14, "line": {"width": 3, "color": "#D55E00"}},
    )
    return styled(figure, "Charge on the array")
