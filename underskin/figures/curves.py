"""Curves of force against displacement, and Young's modulus as each has it: indentation of the skin, compression of its
elastomer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.figures.style import COLOURS, MARKERS, SDS_OF_95, as_columns, label, one_of_many, styled
from underskin.units import Floats, readable_unit

_MOST_SAMPLES = 400  # of one curve


@dataclass(frozen=True)
class ForceCurve:
    """One recording: displacement [mm] and force [N], each (samples,). Curves `of` the same share a colour and an entry
    in the legend; where it is empty, a curve has its own."""

    name: str
    displacement_mm: Floats
    force_n: Floats
    of: str = ""


def force_curves(curves: Sequence[ForceCurve]) -> go.Figure:
    """Each recording's curve, in units in which the numbers read well; thinned evenly if it has more samples than a
    figure shows."""
    figure = go.Figure()
    length, per_mm = _readable("displacement_mm", [one.displacement_mm for one in curves])
    force, per_n = _readable("force_n", [one.force_n for one in curves])
    groups: list[str] = []
    for curve in curves:
        group = curve.of or curve.name
        is_new = not curve.of or group not in groups
        groups += [group] if is_new else []
        count = len(curve.force_n)
        chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_SAMPLES)).round().astype(int))
        figure.add_scatter(
            x=(per_mm * curve.displacement_mm[chosen]).astype(np.float32),
            y=(per_n * curve.force_n[chosen]).astype(np.float32),
            name=label(group),
            legendgroup=label(group) if curve.of else None,
            showlegend=is_new,
            **one_of_many(groups.index(group) if curve.of else len(groups) - 1, 1.4),
            hovertemplate=f"{label(curve.name)}<br>%{{x:.4g}} {length}: %{{y:.4g}} {force}<extra></extra>",
        )
    figure.update_xaxes(title=f"displacement [{length}]")
    figure.update_yaxes(title=f"force [{force}]")
    return styled(figure, "Force against displacement")


def curve_moduli(
    which: Sequence[str], names: Sequence[str], modulus_mpa: ArrayLike, uncertainty_mpa: ArrayLike
) -> go.Figure:
    """Young's modulus [MPa] of each curve, those of each of `which` together, with 95 % intervals; all (curves,)."""
    modulus, uncertainty = as_columns(names, modulus_mpa=modulus_mpa, uncertainty_mpa=uncertainty_mpa)
    figure = go.Figure()
    for number, group in enumerate(dict.fromkeys(which)):
        own = [place for place, one in enumerate(which) if one == group]
        figure.add_scatter(
            x=[place + 1 for place in own],
            y=modulus[own],
            error_y={"array": SDS_OF_95 * uncertainty[own]},
            mode="markers",
            name=label(group),
            marker={"color": COLOURS[number], "symbol": MARKERS[number], "size": 9},
            text=[label(names[place]) for place in own],
            hovertemplate="%{text}<br>%{y:.4g} MPa<extra></extra>",
        )
    figure.update_xaxes(title="curve", tickformat="d")
    figure.update_yaxes(title="Young's modulus [MPa]")
    return styled(figure, "Young's modulus of each curve")


def _readable(field: str, columns: Sequence[Floats]) -> tuple[str, float]:
    """The unit in which all read well, and how many make the lab's."""
    return readable_unit(field, max((float(np.nanmax(np.abs(one), initial=0.0)) for one in columns), default=0.0))
