"""Force against displacement: indentation of the skin, compression of its elastomer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from underskin.figures.style import label, line, styled
from underskin.units import Floats

_MOST_SAMPLES = 400  # of one curve


@dataclass(frozen=True)
class ForceCurve:
    """One recording: displacement [mm] and force [N], each (samples,)."""

    name: str
    displacement_mm: Floats
    force_n: Floats


def force_curves(curves: Sequence[ForceCurve]) -> go.Figure:
    """Each recording's curve, thinned evenly if it has more samples than a figure shows."""
    figure = go.Figure()
    for number, curve in enumerate(curves):
        count = len(curve.force_n)
        chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_SAMPLES)).round().astype(int))
        figure.add_scatter(
            x=curve.displacement_mm[chosen].astype(np.float32),
            y=curve.force_n[chosen].astype(np.float32),
            mode="lines",
            name=label(curve.name),
            line=line(number, 1.4),
            hovertemplate=f"{label(curve.name)}<br>%{{x:.4g}} mm: %{{y:.4g}} N<extra></extra>",
        )
    figure.update_xaxes(title="displacement [mm]")
    figure.update_yaxes(title="force [N]")
    return styled(figure, "Force against displacement")
