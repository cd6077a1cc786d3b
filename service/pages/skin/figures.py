"""The figure of a skin's page: its array as a map."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal
from urllib.parse import quote

from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, sensors_of
from service.pages.shared.history import RESTS, By
from service.schemas.skins import History, TrendAnswer
from service.store import AnyRow
from underskin.inversion.trend import interval

_MOST_NAMED = 5  # sensors, in a sentence

Shown = Literal["d33", "uncertainty", "trend"]

# Column of the values, column of their uncertainties, name, unit, what colours are compared against.
_QUANTITIES: dict[Shown, tuple[str, str, str, str, Literal["others", "zero", "nothing"]]] = {
    "d33": ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33", "pC/N", "others"),
    "uncertainty": ("d33_uncertainty_pc_per_n", "d33_uncertainty_pc_per_n", "uncertainty of d33", "pC/N", "nothing"),
    "trend": ("slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year", "trend", "pC/N a year", "zero"),
}
_ENDS: dict[Shown, tuple[str, str]] = {
    "d33": ("d33_low_pc_per_n", "d33_high_pc_per_n"),
    "trend": ("slope_low_pc_per_n_per_year", "slope_high_pc_per_n_per_year"),
}  # columns of 95 % intervals


def map_rows(row: AnyRow, answer: Mapping[str, Any], history: History) -> list[dict[str, Any]]:
    """Each sensor of a campaign's answer, with its place and, where it has one, its trend."""
    trends = {
        entry.sensor: _trend(entry.trend, len(entry.points)) for entry in history.sensors if entry.trend is not None
    }
    return [{**sensor, **trends.get(sensor["sensor"], {})} for sensor in sensors_of(row, answer)]


def _trend(line: TrendAnswer, count: int) -> dict[str, Any]:
    low, high = interval(line.slope_pc_per_n_per_year, line.slope_uncertainty_pc_per_n_per_year, count)
    return {**line.model_dump(), "slope_low_pc_per_n_per_year": low, "slope_high_pc_per_n_per_year": high}


def drawn_map(
    root: str, row: AnyRow, rows: Sequence[Mapping[str, Any]], show: Shown, by: By, sensor: str | None
) -> Drawn:
    """The sensors of `map_rows` where they lie, one of them chosen."""
    from underskin.figures.array_map import Quantity, array_map, disc_size, told_apart

    value, uncertainty, name, unit, against = _QUANTITIES[show]
    # A slope through few campaigns is surer by its uncertainty than by Student's t, so that its own test tells.
    significant = tuple(row.get("significant", False) for row in rows) if show == "trend" else None
    ends = _ENDS.get(show)
    own = None if ends is None else tuple((row.get(ends[0]), row.get(ends[1])) for row in rows)
    quantity = Quantity(name, unit, against, differing=significant, intervals=own)
    names, x_mm, y_mm, reasons = columns_of(rows, "sensor", "x_mm", "y_mm", "reasons")
    radius = row.about["skin"].get("sensor_radius_mm")
    values, uncertainties = columns_of(rows, value, uncertainty)
    figure = array_map(names, x_mm, y_mm, values, uncertainties, reasons, quantity, sensor, radius)
    about = (
        f"Each sensor where it lies, coloured by {name}, in {row.name}, the latest campaign with FRFs, {RESTS[by]}. "
    )
    sensors = len(row.about["skin"]["sensors"])
    about += f"It tells of {len(rows)} of the {sensors} sensors. " if len(rows) < sensors else ""
    about += f"{disc_size(x_mm, y_mm, radius)} {told_apart(values, uncertainties, quantity)} "
    about += _alone(rows) if show == "trend" else ""
    return drawn("map", figure, about + CLICK, f"/skins/{quote(root, safe='')}/map.csv?model={by}")


def _alone(rows: Sequence[Mapping[str, Any]]) -> str:
    """Which sensors have a trend by their own interval that is not told over the whole array: few campaigns of many
    sensors tell hardly any."""
    low, high = _ENDS["trend"]
    names = [
        row["sensor"] for row in rows if not row.get("significant", False) and row.get(low, 0) * row.get(high, 0) > 0
    ]
    if not names:
        return ""
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return (
        f"Taken alone, {', '.join(names[:_MOST_NAMED])}{more} would have a trend (95 %), as one sensor in twenty has "
        "by chance: more campaigns tell which, and Compare shows what differs between two. "
    )
