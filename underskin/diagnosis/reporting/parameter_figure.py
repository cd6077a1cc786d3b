"""The figure of what the recordings say of the parameters of the stated mechanisms."""

from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.reporting.figure_style import AFTER, MEASURED, styled
from underskin.diagnosis.reporting.numbers import multiple_of
from underskin.diagnosis.reporting.typeset import with_minus
from underskin.mechanisms.parameter import Parameter

_BESIDE = 1.0  # of an interval: room beside it
_ROW, _BETWEEN = 140, 0.73  # height of a parameter's row [pixels], and the share of it that labels need
_TITLE = 13  # pixels


def parameter_intervals(problem: FittingProblem, shown: Explanation, document: Mapping[str, Any]) -> go.Figure:
    """Each parameter's 95 % interval in its own unit, and in words that of its prior, which would hide it."""
    places = own_places(shown.names, problem.lines)
    rows = [
        (entry["name"], parameter, prior, multiple_of(shown, prior))
        for entry in document["mechanisms"]
        for parameter, prior in zip(entry["parameters"], shown.model.parameters[places[entry["name"]]], strict=True)
    ]
    titles = [
        f"{name.replace('_', ' ')}<br>{_labelled(entry)}<br><sup>{_before(prior, scale, entry['unit'])}</sup>"
        for name, entry, prior, scale in rows
    ]
    figure = make_subplots(len(rows), 1, subplot_titles=titles, vertical_spacing=_BETWEEN / len(rows))
    figure.update_annotations(font_size=_TITLE)
    for place, (_, entry, *_) in enumerate(rows, start=1):
        low, high = entry["low"], entry["high"]
        figure.add_scatter(
            x=[low, high], y=[0, 0], mode="lines", line={"color": AFTER, "width": 8}, name="95 % interval",
            showlegend=place == 1, row=place, col=1,
        )  # fmt: skip
        figure.add_scatter(
            x=[entry["value"]], y=[0], mode="markers", name="most probable", showlegend=place == 1,
            marker={"color": MEASURED, "symbol": "line-ns-open", "size": 16, "line": {"width": 2}}, row=place, col=1,
        )  # fmt: skip
        beside = _BESIDE * (high - low) or 0.1 * abs(low) or 1.0
        left = low - beside if low < 0 else max(low - beside, 0.0)  # what is positive stays so
        figure.update_xaxes(range=[left, high + beside], row=place, col=1)
    figure.update_yaxes(visible=False, range=[-1, 1])
    figure.update_layout(
        title="What the recordings say of the parameters",
        height=200 + _ROW * len(rows),
        legend={"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom"},
        margin={"t": 110, "b": 90},
    )
    return styled(figure)


def _labelled(entry: Mapping[str, Any]) -> str:
    unit = "" if entry["unit"] == "-" else f" {entry['unit']}"
    interval = f"{entry['value']:.3g} ({entry['low']:.3g} to {entry['high']:.3g}){unit}"
    return with_minus(f"{entry['name'].replace('_', ' ')} {interval}")


def _before(prior: Parameter, scale: float, unit: str) -> str:
    """What was known before the recordings, in words."""
    low, high = (scale * prior.from_fit(prior.quantile(q)) for q in (0.025, 0.975))
    return with_minus(
        f"before the recordings (prior), 95 %: {low:.3g} to {high:.3g}{'' if unit == '-' else f' {unit}'}"
    )
