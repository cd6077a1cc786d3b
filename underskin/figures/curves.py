"""Force-displacement curves, and Young's modulus of each: indentation of the skin, compression of its elastomer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from underskin.figures.style import COLOURS, MARKERS, as_columns, label, line_style, styled
from underskin.inversion.mixed_model import SDS_OF_95
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
    """The curve of each recording, in readable units; thinned evenly to the number of samples that a figure shows."""
    figure = go.Figure()
    length, per_mm = _readable("displacement_mm", [curve.displacement_mm for curve in curves])
    force, per_n = _readable("force_n", [curve.force_n for curve in curves])
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
            **line_style(groups.index(group) if curve.of else len(groups) - 1, 1.4),
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
        members = [index for index, which_group in enumerate(which) if which_group == group]
        figure.add_scatter(
            x=[index + 1 for index in members],
            y=modulus[members],
            error_y={"array": SDS_OF_95 * uncertainty[members]},
            mode="markers",
            name=label(group),
            marker={"color": COLOURS[number], "symbol": MARKERS[number], "size": 9},
            text=[label(names[index]) for index in members],
            hovertemplate="%{text}<br>%{y:.4g} MPa<extra></extra>",
        )
    figure.update_xaxes(title="curve", tickformat="d")
    figure.update_yaxes(title="Young's modulus [MPa]")
    return styled(figure, "Young's modulus of each curve")


def _readable(field: str, columns: Sequence[Floats]) -> tuple[str, float]:
    """The unit in which all values are readable, and its number per lab unit."""
    return readable_unit(field, max((float(np.nanmax(np.abs(column), initial=0.0)) for column in columns), default=0.0))
