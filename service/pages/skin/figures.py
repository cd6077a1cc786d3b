"""The figure of a skin's page: its array as a map."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Literal
from urllib.parse import quote

from service.pages.shared.figures import CLICK, Drawn, columns_of, drawn, sensors_of
from service.pages.shared.history import RESTS, By
from service.schemas.skins import History, SensorHistory, TrendAnswer
from service.store import AnyRow
from underskin.inversion.array_history import interval
from underskin.recordings.readers.text import in_lab

_MOST_NAMED = 5  # sensors, in a sentence

Shown = Literal["d33", "uncertainty", "trend"]

# Column of the values, column of their uncertainties, name, unit, reference of the colour scale.
_QUANTITIES: dict[Shown, tuple[str, str, str, str, Literal["others", "zero", "nothing"]]] = {
    "d33": ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "d33", "pC/N", "others"),
    "uncertainty": ("d33_uncertainty_pc_per_n", "d33_uncertainty_pc_per_n", "uncertainty of d33", "pC/N", "nothing"),
    "trend": ("slope_pc_per_n_per_year", "slope_uncertainty_pc_per_n_per_year", "trend", "pC/N a year", "zero"),
}
_ENDS: dict[Shown, tuple[str, str]] = {
    "d33": ("d33_low_pc_per_n", "d33_high_pc_per_n"),
    "trend": ("slope_low_pc_per_n_per_year", "slope_high_pc_per_n_per_year"),
}  # columns of 95 % intervals


def map_rows(
    row: AnyRow, answer: Mapping[str, Any] | None, history: History, places: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """A row per sensor in `places`, with its trend if known: from the answer of a campaign, or else its last value
    in `history` with the date (`absent`), or else without a value."""
    answered = {} if answer is None else {sensor["sensor"]: sensor for sensor in sensors_of(row, answer)}
    histories = {sensor_history.sensor: sensor_history for sensor_history in history.sensors}
    rows = []
    for position in places:
        name = position["id"]
        of_sensor = histories.get(name)
        its = answered.get(name) or _last(of_sensor)
        trend: dict[str, Any] = {"no_trend": "never measured with FRFs" if of_sensor is None else of_sensor.no_trend}
        if of_sensor is not None and of_sensor.trend is not None:
            trend = _trend(of_sensor.trend, len(of_sensor.points))
        rows.append({"sensor": name, "x_mm": position["x_mm"], "y_mm": position["y_mm"], "absent": "", **its, **trend})
    return rows


def _last(of_sensor: SensorHistory | None) -> dict[str, Any]:
    """The last value of a sensor that the latest campaign did not measure."""
    if of_sensor is None or not of_sensor.points:
        return {"reasons": "", "absent": "never measured with FRFs"}
    from underskin.inversion.mixed_model import SDS_OF_95  # with numerical code, which is slow to import

    point = of_sensor.points[-1]
    half = SDS_OF_95 * point.d33_uncertainty_pc_per_n
    return {
        "d33_pc_per_n": point.d33_pc_per_n,
        "d33_uncertainty_pc_per_n": point.d33_uncertainty_pc_per_n,
        "d33_low_pc_per_n": point.d33_pc_per_n - half,
        "d33_high_pc_per_n": point.d33_pc_per_n + half,
        "reasons": "",
        "absent": f"last measured on {_day(point.time)}",
    }


def _day(time: str) -> str:
    """The day of a time of the store in the lab's zone, as the axis of a history has it."""
    return in_lab(datetime.fromisoformat(time)).strftime("%d %b %Y")


def _trend(line: TrendAnswer, count: int) -> dict[str, Any]:
    low, high = interval(line.slope_pc_per_n_per_year, line.slope_uncertainty_pc_per_n_per_year, count)
    return {**line.model_dump(), "slope_low_pc_per_n_per_year": low, "slope_high_pc_per_n_per_year": high}


def drawn_map(
    root: str, row: AnyRow, rows: Sequence[Mapping[str, Any]], show: Shown, by: By, sensor: str | None
) -> Drawn:
    """The sensors of `map_rows` at their positions, one of them chosen; `row`: the campaign of the answer."""
    from underskin.figures.array_map import Quantity, array_map, disc_size, significance_note

    value, uncertainty, name, unit, against = _QUANTITIES[show]
    # With few campaigns a slope's uncertainty is smaller than Student's t allows, so its own test decides.
    significant = tuple(row.get("significant", False) for row in rows) if show == "trend" else None
    ends = _ENDS.get(show)
    intervals = None if ends is None else tuple((row.get(ends[0]), row.get(ends[1])) for row in rows)
    quantity = Quantity(name, unit, against, differing=significant, intervals=intervals)
    names, x_mm, y_mm, reasons = columns_of(rows, "sensor", "x_mm", "y_mm", "reasons")
    radius = row.about["skin"].get("sensor_radius_mm")
    values, uncertainties = columns_of(rows, value, uncertainty)
    # A trend is of all campaigns, whichever measured a sensor last.
    absent = ["" if show == "trend" else row["absent"] for row in rows]
    figure = array_map(names, x_mm, y_mm, values, uncertainties, reasons, quantity, sensor, radius, absent)
    compared = [math.nan if away else shown_value for away, shown_value in zip(absent, values, strict=True)]
    about = (
        f"Each sensor where it lies, coloured by {name}, in {row.name}, the latest campaign with FRFs, {RESTS[by]}. "
    )
    measured = sum(not row["absent"] for row in rows)
    about += f"It tells of {measured} of the {len(rows)} sensors. " if measured < len(rows) else ""
    about += "The hollow ones stand at their last value, with its date under the pointer. " if any(absent) else ""
    about += f"{disc_size(x_mm, y_mm, radius)} {significance_note(compared, uncertainties, quantity)} "
    about += _trends_of_single_sensors(rows) + _without_trend(rows) if show == "trend" else ""
    return drawn("map", figure, about + CLICK, f"/skins/{quote(root, safe='')}/map.csv?model={by}")


def _without_trend(rows: Sequence[Mapping[str, Any]]) -> str:
    """How many sensors have no trend, and the most frequent reason."""
    reasons = Counter(row["no_trend"] for row in rows if row.get("no_trend"))
    if not reasons:
        return ""
    (most, count), of = reasons.most_common(1)[0], reasons.total()
    have = "sensor has" if of == 1 else "sensors have"
    return f"{of} {have} no trend, {'' if count == of else f'{count} of them since '}{most}. "


def _trends_of_single_sensors(rows: Sequence[Mapping[str, Any]]) -> str:
    """Which sensors have a trend by their own interval but not by the test over the whole array: few campaigns of
    many sensors hardly show any."""
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
