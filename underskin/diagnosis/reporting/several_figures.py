"""Figures of reports on several campaigns: d33 of each sensor from campaign to campaign, and what each skin of a fleet
has beside the band of the population; from the report alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from underskin.diagnosis.data.names import quantity_in_words
from underskin.diagnosis.reporting.figure_style import AFTER, BEFORE, styled
from underskin.diagnosis.reporting.line_styles import LINE_COLOURS
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.diagnosis.reporting.sentences import capital
from underskin.inversion.many_sensors import MOST_NAMED, many_sensors

_MARKERS = ("circle", "square", "diamond", "cross", "triangle-up", "x")
_BESIDE = 0.5  # of a campaign's place on the axis, over which its sensors lie side by side
_ROW, _OF_SKIN = 130, 22  # height of a quantity, and of a skin in it [pixels]


def several_figures(document: Mapping[str, Any]) -> dict[str, go.Figure]:
    """By name: sensors, population; those that the report has."""
    drawn = {}
    rows = (document["d33"] or {}).get("per_sensor")
    if rows:
        drawn["sensors"] = sensors_over_campaigns(rows, document["campaigns"])
    if document.get("population"):
        drawn["population"] = skins_in_populations(document["population"])
    return drawn


def sensors_over_campaigns(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> go.Figure:
    """d33 with its 95 % interval of each sensor in each campaign, sensors side by side; of many their median, the range
    of most and, by name, those that stand apart. `rows` are those of `d33.per_sensor`, `names` all campaigns in their
    order: one of which no d33 is told has its place too."""
    told = dict.fromkeys(row["campaign"] for row in rows)
    campaigns = list(dict.fromkeys([*names, *told]))
    sensors = list(dict.fromkeys(row["sensor"] for row in rows))
    few = len(sensors) <= MOST_NAMED
    figure = go.Figure(list(_each(rows, campaigns, sensors) if few else _most(rows, campaigns)))
    labels = [escape(name) + ("" if name in told else "<br>(no d33)") for name in campaigns]
    figure.update_xaxes(title="campaign", tickmode="array", tickvals=list(range(len(labels))), ticktext=labels)
    figure.update_yaxes(title=f"d33 [{rows[0]['unit']}]" + (", 95 %" if few else ""))
    title = "d33 of each sensor over the campaigns"
    if not few:
        title = (
            f"d33 of {len(sensors)} sensors over the campaigns: median, the range of 90 %, and those that stand apart"
        )
    figure.update_layout(title=title, height=470, showlegend=few and len(sensors) > 1)
    return styled(figure)


def _each(rows: Sequence[Mapping[str, Any]], campaigns: Sequence[str], sensors: Sequence[str]) -> Iterator[go.Scatter]:
    beside = _BESIDE * (np.arange(len(sensors)) - (len(sensors) - 1) / 2) / len(sensors)
    for number, sensor in enumerate(sensors):
        own = [row for row in rows if row["sensor"] == sensor]
        yield go.Scatter(
            x=[campaigns.index(row["campaign"]) + beside[number] for row in own],
            y=[row["value"] for row in own],
            error_y=_reaching(own),
            mode="lines+markers",
            name=escape(sensor),
            line={"color": LINE_COLOURS[number % len(LINE_COLOURS)], "width": 1},
            marker={"symbol": _MARKERS[number % len(_MARKERS)], "size": 8},
            text=[escape(row["campaign"]) for row in own],
            hovertemplate="%{text}: %{y:.4g} pC/N<extra>%{fullData.name}</extra>",
        )


def _most(rows: Sequence[Mapping[str, Any]], campaigns: Sequence[str]) -> Iterator[go.Scatter]:
    """The median of each campaign's sensors with the range of 90 % of them, then those that stand apart."""
    of_campaign = {
        number: own
        for number, name in enumerate(campaigns)
        if (own := [row for row in rows if row["campaign"] == name])
    }
    found = [
        many_sensors(
            np.array([row["value"] for row in own]),
            np.array([(row["high"] - row["low"]) / (2 * SDS_OF_95) for row in own]),
        )
        for own in of_campaign.values()
    ]
    ends = [{"value": one.median, "low": one.low, "high": one.high} for one in found]
    yield go.Scatter(
        x=list(of_campaign),
        y=[one.median for one in found],
        error_y=_reaching(ends),
        mode="lines+markers",
        name="median",
        line={"color": AFTER, "width": 1},
        marker={"symbol": "circle", "size": 9},
        hovertemplate="median %{y:.4g} pC/N<extra></extra>",
    )
    apart = [
        (number, own[place])
        for (number, own), one in zip(of_campaign.items(), found, strict=True)
        for place in one.apart
    ]
    yield go.Scatter(
        x=[number for number, _ in apart],
        y=[row["value"] for _, row in apart],
        error_y=_reaching([row for _, row in apart]),
        mode="markers+text",
        name="stands apart",
        marker={"color": BEFORE, "symbol": "square", "size": 8},
        text=[escape(row["sensor"]) for _, row in apart],
        textposition="middle right",
        hovertemplate="%{text}: %{y:.4g} pC/N<extra></extra>",
    )


def skins_in_populations(populations: Sequence[Mapping[str, Any]]) -> go.Figure:
    """Each quantity of each skin with its 95 % interval on the band of the population (95 %), those that depart in
    another colour; `populations` is the report's `population`."""
    titles = [
        capital(quantity_in_words(entry["parameter"])) + ("" if entry["unit"] == "-" else f" [{entry['unit']}]")
        for entry in populations
    ]
    skins = max(len(entry["skins"]) for entry in populations)
    figure = make_subplots(len(populations), 1, subplot_titles=titles)
    for place, entry in enumerate(populations, start=1):
        departing = {one["skin"] for one in entry["departures"]}
        for departs, colour, name in ((False, AFTER, "as the others"), (True, BEFORE, "departs")):
            own = [one for one in entry["skins"] if (one["skin"] in departing) is departs]
            figure.add_scatter(
                x=[one["value"] for one in own],
                y=[escape(one["skin"]) for one in own],
                error_x=_reaching(own),
                mode="markers",
                marker={"color": colour, "symbol": "square" if departs else "circle", "size": 9},
                name=name,
                legendgroup=name,
                showlegend=place == 1,
                hovertemplate="%{y}: %{x:.4g}<extra></extra>",
                row=place,
                col=1,
            )
        half = SDS_OF_95 * entry["sd"]  # plotly draws bands on subplots that have points alone
        low, high = entry["mean"] - half, entry["mean"] + half
        figure.add_vrect(x0=low, x1=high, fillcolor="rgba(0,0,0,0.12)", line_width=0, row=place, col=1)
        figure.add_vline(x=entry["mean"], line={"color": "#000000", "width": 1}, row=place, col=1)
    figure.update_layout(
        title="Each skin, and the band in which 95 % of such skins lie",
        height=150 + len(populations) * (_ROW + _OF_SKIN * skins),
    )
    return styled(figure)


def _reaching(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The 95 % intervals of some rows as plotly has them: how far beside the value."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [row["high"] - row["value"] for row in rows],
        "arrayminus": [row["value"] - row["low"] for row in rows],
        "width": 4,
    }
