"""The figures of a skin's page: its array as a map, its sensors over time."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any, Literal
from urllib.parse import quote

from service.pages.shared.figures import Drawn, columns_of, drawn, sensors_of
from service.schemas.skins import History, SensorHistory
from service.store import AnyRow

Shown = Literal["d33", "uncertainty", "trend"]
By = Literal["paper", "adopted"]

# Column of the values, column of their uncertainties, name, unit, whether 0 is in the middle of the colours.
_QUANTITIES = {
    "d33": ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33", "pC/N", False),
    "uncertainty": ("d33_uncertainty_pc_per_n", "d33_uncertainty_pc_per_n", "uncertainty of d33", "pC/N", False),
    "trend": ("slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year", "trend", "pC/N a year", True),
}
_RESTS = {"adopted": "by the adopted model", "paper": "by the paper's model"}


def map_rows(row: AnyRow, answer: Mapping[str, Any], history: History) -> list[dict[str, Any]]:
    """Each sensor of a campaign's answer, with its place and, where it has one, its trend."""
    trends = {entry.sensor: entry.trend.model_dump() for entry in history.sensors if entry.trend is not None}
    return [{**sensor, **trends.get(sensor["sensor"], {})} for sensor in sensors_of(row, answer)]


def drawn_map(root: str, row: AnyRow, rows: Sequence[Mapping[str, Any]], show: Shown, by: By) -> Drawn:
    """The sensors of `map_rows` where they lie."""
    from underskin.figures.array import Quantity, array_map

    value, uncertainty, name, unit, diverging = _QUANTITIES[show]
    names, x_mm, y_mm, reasons = columns_of(rows, "sensor", "x_mm", "y_mm", "reasons")
    values, uncertainties = columns_of(rows, value, uncertainty)
    figure = array_map(names, x_mm, y_mm, values, uncertainties, reasons, Quantity(name, unit, diverging))
    about = (
        f"Each sensor where it lies, coloured by {name}, in {row.name}, the latest campaign with FRFs, {_RESTS[by]}."
    )
    known = [entry for entry in rows if entry["d33_pc_per_n"] is not None]
    if show == "d33" and known:
        about += f" {_range(known)}"
    return drawn("map", figure, about, f"/skins/{quote(root, safe='')}/map.csv?model={by}")


def _range(known: Sequence[Mapping[str, Any]]) -> str:
    """How far apart the ends of the colours are, and how sure each value is."""
    values, uncertainties = columns_of(known, "d33_pc_per_n", "d33_uncertainty_pc_per_n")
    return f"They go from {min(values):.3g} to {max(values):.3g} pC/N, each ± {median(uncertainties):.2g}."


def drawn_history(root: str, history: History, sensor: str | None, by: By) -> Drawn:
    """d33 over time: of one sensor, of all, or of many the median and the range."""
    from underskin.figures.history import SensorPoints, d33_history, is_summarised

    numbers = f"/skins/{quote(root, safe='')}/history.csv?model={by}"
    chosen = [entry for entry in history.sensors if sensor in (None, entry.sensor)]
    points = [
        SensorPoints(
            entry.sensor,
            [point.time for point in entry.points],
            [point.d33_pc_per_n for point in entry.points],
            [point.d33_uncertainty_pc_per_n for point in entry.points],
            _trend_in_words(entry),
        )
        for entry in chosen
    ]
    about = f"d33 of each sensor in every campaign, {_RESTS[by]}, ± its uncertainty."
    if is_summarised(len(chosen), sum(len(entry.points) for entry in chosen)):
        about = (
            f"Median d33 over the sensors in each campaign, {_RESTS[by]}, the range of 90 % of them, and by name those "
            "that stand apart."
        )
    return drawn("history", d33_history(points), about, numbers)


def _trend_in_words(entry: SensorHistory) -> str:
    """What the sensor's d33 does over time."""
    line = entry.trend
    if line is None:
        return f"no trend: {entry.no_trend}"
    slope = f"{line.slope_pc_per_n_per_year:+.2g} ± {line.slope_uncertainty_pc_per_n_per_year:.1g} pC/N a year"
    return slope if line.significant else f"no significant trend ({slope})"
