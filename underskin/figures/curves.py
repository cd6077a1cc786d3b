"""Force against displacement: indentation of the skin, compression of its elastomer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from underskin.figures.style import label, one_of_many, styled
from underskin.units import Floats, readable_unit

_MOST_SAMPLES = 400  # of one curve


@dataclass(frozen=True)
class ForceCurve:
    """One recording: displacement [mm] and force [N], each (samples,)."""

    name: str
    displacement_mm: Floats
    force_n: Floats


def force_curves(curves: Sequence[ForceCurve]) -> go.Figure:
    """Each recording's curve, in units in which the numbers read well; thinned evenly if it has more samples than a
    figure shows."""
    figure = go.Figure()
    length, per_mm = _readable("displacement_mm", [one.displacement_mm for one in curves])
    force, per_n = _readable("force_n", [one.force_n for one in curves])
    for number, curve in enumerate(curves):
        count = len(curve.force_n)
        chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_SAMPLES)).round().astype(int))
        figure.add_scatter(
            x=(per_mm * curve.displacement_mm[chosen]).astype(np.float32),
            y=(per_n * curve.force_n[chosen]).astype(np.float32),
            name=label(curve.name),
            **one_of_many(number, 1.4),
            hovertemplate=f"{label(curve.name)}<br>%{{x:.4g}} {length}: %{{y:.4g}} {force}<extra></extra>",
        )
    figure.update_xaxes(title=f"displacement [{length}]")
    figure.update_yaxes(title=f"force [{force}]")
    return styled(figure, "Force against displacement")


def _readable(field: str, columns: Sequence[Floats]) -> tuple[str, float]:
    """The unit in which all read well, and how many make the lab's."""
    return readable_unit(field, max((float(np.nanmax(np.abs(one), initial=0.0)) for one in columns), default=0.0))
