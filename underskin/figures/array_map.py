"""The map of an array: a disc at each sensor's position, coloured by d33 or another quantity, with its id."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Literal

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.colors import sample_colorscale

from underskin.diagnosis.reporting.page_styles import with_minus
from underskin.figures.style import COLOURS, INK, as_columns, label, styled
from underskin.inversion.array_history import differ_from_others, differ_from_zero, threshold
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.units import Floats, Mask

SHARE = 0.42  # radius of a disc over the smallest distance of two sensors, so that none overlap at any size
_LEAST_SHARE = 1 / 80  # of the map's longer side: a smaller radius cannot be seen
AROUND = 1.17  # times it, the ring around the chosen one, which touches no neighbour's disc
_SINGLE_RADIUS_MM = 1.0  # radius where there is no other


def disc_size(x_mm: ArrayLike, y_mm: ArrayLike, sensor_radius_mm: float | None) -> str:
    """A sentence on the size of the discs relative to the sensors."""
    if sensor_radius_mm is None:
        return "Discs do not have the sensors' size, which is not declared."
    drawn = radius_of(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float), sensor_radius_mm)
    if drawn == sensor_radius_mm:
        return "Discs have the sensors' size."
    return f"Discs are {drawn / sensor_radius_mm:.3g} times as wide as the sensors."


def smallest_distance(x: Floats, y: Floats) -> float:
    """The smallest distance between sensors at different positions [mm]; for a single sensor a default."""
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    distance = distance[distance > 0]
    return float(distance.min()) if len(distance) else _SINGLE_RADIUS_MM / SHARE


def radius_of(x: Floats, y: Floats, sensor_radius_mm: float | None) -> float:
    """The radius of all discs [mm]: the sensors', unless it is unknown, too small to be seen, or discs would
    overlap."""
    widest = SHARE * smallest_distance(x, y)
    side = max(float(np.ptp(x)), float(np.ptp(y)))
    if sensor_radius_mm is None or sensor_radius_mm < _LEAST_SHARE * side:
        return widest
    is_single = side == 0
    return sensor_radius_mm if is_single else min(sensor_radius_mm, widest / SHARE / 2)


def ring(x: float, y: float, radius: float) -> dict[str, Any]:
    """The shape of the ring around a disc in (x, y) of this radius [mm]."""
    around = AROUND * radius
    ends = {"x0": x - around, "x1": x + around, "y0": y - around, "y1": y + around}
    return {"type": "circle", "line": {"color": INK, "width": 2}, "layer": "below", **ends}


_WITH_ROOM = 0.3  # of the smallest distance: a disc of such a radius has room for its id
_OUTLIER = {"color": COLOURS[1], "width": 3}  # the ring around an outlier
_ABSENT = {"color": "#5b6670", "width": 2}  # the edge of one that was not measured with the others
_EDGE = {"color": "#5b6670", "width": 1}  # of the others
_PALE, _RINGED = ("absent", "unknown"), ("absent", "unknown", "marked")  # without a colour of a value; with a ring
_BELOW = 6  # pixels, of a mark that is not seen, by which an id keeps off the edge of the disc above it
_FROM_ZERO = ("zero", "bound")
_SCALE = "Viridis"  # which has no grey: that means alike here
_ALIKE, _UNKNOWN = "#cfd4d9", "#ffffff"
_MOST_WITH_ID, _LONGEST_ID = 100, 6
_MIXED = 0.01  # of the largest size, from which on colours show the other sign
# Colours end at _FAR times the _MOST quantile of the sensors that differ, so that one outlier does not fade the rest.
_FAR, _MOST = 3.0, 0.9
_DARK = 0.55  # luminance below which an id is written in white


@dataclass(frozen=True)
class Quantity:
    """The quantity that a map shows of each sensor.

    `against`: `others` greys sensors that do not differ from the others beyond chance, and the colours reach at
    least as far as chance does; `zero` the same from 0, with 0 in the middle of the colours; `bound` greys values
    that are 0 within their uncertainty, here a bound and not a standard uncertainty, with 0 in the middle where
    signs are mixed; `nothing` colours from 0 upwards, or between `ends`, which several maps may share. `differing`:
    which sensors differ, where a separate test decides, such as that of a trend. `intervals`: the 95 % interval of
    each sensor; without them 1.96 uncertainties to each side.
    """

    name: str
    unit: str
    against: Literal["others", "zero", "bound", "nothing"] = "others"
    ends: tuple[float, float] | None = None
    differing: tuple[bool, ...] | None = None
    intervals: tuple[tuple[float | None, float | None], ...] | None = None


D33 = Quantity("d33", "pC/N")


def array_map(
    sensors: Sequence[str],
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    values: ArrayLike,
    uncertainties: ArrayLike,
    reasons: Sequence[str],
    quantity: Quantity = D33,
    chosen: str | None = None,
    sensor_radius_mm: float | None = None,
    absent: Sequence[str] = (),
) -> go.Figure:
    """Map of the sensors; `uncertainties` are standard ones, `reasons` says why a sensor is marked, empty otherwise,
    `chosen` is ringed. Discs have the sensors' radius where it is given and large enough (see `disc_size`). `absent`
    says of a sensor that was not measured in this campaign from when its value is; it is not compared, and its disc is
    hollow.

    Raises InvalidInput where a column's length differs from that of `sensors`.
    """
    x, y, value, uncertainty = as_columns(sensors, x_mm=x_mm, y_mm=y_mm, values=values, uncertainties=uncertainties)
    absences = absent or [""] * len(sensors)
    away = np.array([bool(absence) for absence in absences], dtype=bool)
    notes = [reason or absence for reason, absence in zip(reasons, absences, strict=True)]
    stated, value = value, np.where(away, np.nan, value)
    coloured = _coloured(value, uncertainty, quantity)
    scale, low, high = _scale(value, uncertainty, quantity)
    fraction = np.clip((value - low) / ((high - low) or 1.0), 0.0, 1.0)
    colours = [
        sample_colorscale(scale, [float(fraction[row])])[0] if coloured[row] else _ALIKE if is_known else _UNKNOWN
        for row, is_known in enumerate(np.isfinite(value).tolist())
    ]
    plain = np.array([not reason for reason in reasons])
    radius, distance = radius_of(x, y, sensor_radius_mm), smallest_distance(x, y)
    inside = radius >= _WITH_ROOM * distance
    bar = {"title": {"text": f"{quantity.name} [{quantity.unit}]", "side": "right"}}
    figure, below, unknown = go.Figure(), [], plain & ~away & ~np.isfinite(value)
    for name, mask in (
        ("differs", coloured & plain),
        ("alike", ~coloured & plain & ~away & ~unknown),
        ("unknown", unknown),
        ("absent", plain & away),
        ("marked", ~plain),
    ):
        if mask.any():
            rows, meta = np.flatnonzero(mask).tolist(), "alike" if name in _PALE else name
            figure.add_scatter(
                x=x[mask].tolist(),
                y=y[mask].tolist(),
                ids=[sensors[row] for row in rows],
                mode="markers+text" if len(sensors) <= _MOST_WITH_ID and inside else "markers",
                name=_names(quantity)[name],
                text=[_id(sensors[row]) for row in rows],
                textfont={"size": 12 if len(sensors) <= 16 else 9, "color": [_ink(colours[row]) for row in rows]},
                customdata=[
                    _hover_text(
                        sensors[row], notes[row], stated[row], _interval(row, stated, uncertainty, quantity), quantity
                    )
                    for row in rows
                ],
                hovertemplate="%{customdata}<br>x %{x:.4g} mm, y %{y:.4g} mm<extra></extra>",
                # In the middle of its disc, in the disc's colour: it carries the colours' scale and the legend.
                marker={
                    "size": 6,
                    "color": value[mask] if name == "differs" else [colours[row] for row in rows],
                    **({"colorscale": scale, "cmin": low, "cmax": high} if name == "differs" else {}),
                    **({"colorbar": bar} if name == "differs" else {}),
                    "line": {"width": 0},
                },
                meta=meta,
                showlegend=name not in _RINGED,
            )
            if not inside and len(sensors) <= _MOST_WITH_ID:
                edges = np.array([AROUND * radius if sensors[row] == chosen else radius for row in rows])
                below.append({**_below([sensors[row] for row in rows], x[mask], y[mask] - edges), "meta": meta})
    figure.add_traces(
        [go.Scatter(**ids, textfont={"size": 11 if len(sensors) <= 16 else 9, "color": INK}) for ids in below]
    )
    # In the legend as their discs are ringed.
    for name, ringed_mask, border in (
        ("unknown", unknown, _EDGE),
        ("absent", away & plain, _ABSENT),
        ("marked", ~plain, _OUTLIER),
    ):
        if ringed_mask.any():
            ringed = {"symbol": "circle-open", "size": 10, "color": border["color"], "line": border}
            figure.add_scatter(x=[None], y=[None], mode="markers", marker=ringed, name=_names(quantity)[name])
    discs = []
    for row, name in enumerate(sensors):
        emphasis = {"color": INK, "width": 4} if name == chosen else _OUTLIER if reasons[row] else None
        disc = {"x0": x[row] - radius, "x1": x[row] + radius, "y0": y[row] - radius, "y1": y[row] + radius}
        line = emphasis or ({**_ABSENT, "dash": "dot"} if away[row] else _EDGE)
        discs.append(
            {"type": "circle", "fillcolor": colours[row], "line": line, "layer": "below", "name": "sensor", **disc}
        )
    if chosen in sensors:  # below the disc too, which may have the colour of its ring
        discs.append(ring(x[sensors.index(chosen)], y[sensors.index(chosen)], radius))
    figure.update_layout(shapes=discs, showlegend=sum(trace.hoverinfo != "skip" for trace in figure.data) > 1)
    figure.update_layout(meta={"alike": _ALIKE, "unknown": _UNKNOWN})  # for a page, which has others in the dark
    for update, coordinates in ((figure.update_xaxes, x), (figure.update_yaxes, y)):
        edge = 1.3 * max(radius, SHARE * distance)
        update(range=[float(coordinates.min()) - edge, float(coordinates.max()) + edge])
    figure.update_xaxes(title="x [mm]", constrain="domain", showgrid=False, zeroline=False)
    figure.update_yaxes(
        title="y [mm]", scaleanchor="x", scaleratio=1, constrain="domain", showgrid=False, zeroline=False
    )
    return styled(figure, f"{quantity.name} over the array")


def significance_note(values: ArrayLike, uncertainties: ArrayLike, quantity: Quantity = D33) -> str:
    """A sentence: how many sensors differ beyond chance, and what grey means; empty where nothing is compared."""
    value, uncertainty = np.asarray(values, dtype=float), np.asarray(uncertainties, dtype=float)
    count, measured = int(_coloured(value, uncertainty, quantity).sum()), int(np.isfinite(value).sum())
    if quantity.against == "nothing" or measured < 2:
        return ""
    what = "the others" if quantity.against == "others" else "0"
    if count == 0:
        return f"Grey: no sensor's differs from {what} beyond chance (5 % over the whole array)."
    sentence = f"{count} of {measured} differ from {what} beyond chance (5 % over the whole array)"
    sentence += "." if count == measured else "; the rest is grey."
    _, low, high = _scale(value, uncertainty, quantity)
    beyond = int(((value < low) | (value > high)).sum())
    has = "has" if beyond == 1 else "have"
    return f"{sentence} {beyond} beyond the scale {has} the colour of its end." if beyond else sentence


def _names(quantity: Quantity) -> dict[str, str]:
    alike = {
        "others": "not different from the others",
        "zero": "not different from 0",
        "bound": "0 within its ±",
    }
    return {
        "differs": quantity.name,
        "alike": alike.get(quantity.against, ""),  # without comparison every known value is coloured
        "unknown": f"no {quantity.name} known",
        "absent": "not in this campaign",
        "marked": "marked",
    }


def _coloured(value: Floats, uncertainty: Floats, quantity: Quantity) -> Mask:
    if quantity.against == "nothing":
        return np.isfinite(value)
    if quantity.differing is not None:
        return np.array(quantity.differing, dtype=bool)
    if quantity.against == "bound":
        return np.abs(value) > uncertainty
    return (differ_from_others if quantity.against == "others" else differ_from_zero)(value, uncertainty)


def _scale(value: Floats, uncertainty: Floats, quantity: Quantity) -> tuple[str, float, float]:
    """The colour scale and the values at its ends: the range of the values without a few far beyond the rest, and at
    least that of chance."""
    finite = value[np.isfinite(value)]
    if quantity.ends is not None:
        return _SCALE, *quantity.ends
    if len(finite) == 0:
        return _SCALE, 0.0, 1.0
    if quantity.against == "nothing":
        return _SCALE, 0.0, float(finite.max()) or 1.0
    if quantity.against == "bound" and not _mixed(finite):
        low, high = min(0.0, float(finite.min())), max(0.0, float(finite.max()))
        return _SCALE, low, high if high > low else 1.0
    middle = 0.0 if quantity.against in _FROM_ZERO else float(np.median(finite))
    finite_uncertainty = uncertainty[np.isfinite(uncertainty)]
    by_chance = threshold(len(finite)) * float(np.median(finite_uncertainty)) if len(finite_uncertainty) else 0.0
    sizes = np.abs(finite - middle)
    coloured = np.abs(value - middle)[_coloured(value, uncertainty, quantity) & np.isfinite(value)]
    most = _FAR * float(np.quantile(coloured, _MOST)) if len(coloured) else np.inf
    reach = max(min(float(sizes.max()), most), by_chance) or 1.0
    return "PuOr_r" if quantity.against in _FROM_ZERO else _SCALE, middle - reach, middle + reach


def _mixed(values: Floats) -> bool:
    """Whether values lie on both sides of 0 so far that colours should show the sign."""
    least, most = sorted((abs(float(values.min())), abs(float(values.max()))))
    return bool(values.min() < 0 < values.max()) and least > _MIXED * most


def _below(sensors: Sequence[str], x: Floats, y: Floats) -> dict[str, Any]:
    """Ids below discs that have no room for them."""
    return {
        "x": x.tolist(),
        "y": y.tolist(),
        "mode": "markers+text",
        "marker": {"size": _BELOW, "opacity": 0},
        "text": list(map(_id, sensors)),
        "textposition": "bottom center",
        "hoverinfo": "skip",
        "showlegend": False,
    }


def _id(name: str) -> str:
    return label(name if len(name) <= _LONGEST_ID else name[: _LONGEST_ID - 1] + "…")


def _interval(row: int, value: Floats, uncertainty: Floats, quantity: Quantity) -> tuple[float, float] | None:
    """The 95 % interval, or the bounds; None where unknown."""
    if quantity.against == "nothing" or not np.isfinite(uncertainty[row]):
        return None
    if quantity.intervals is not None:
        low, high = quantity.intervals[row]
        return None if low is None or high is None else (low, high)
    half = (1.0 if quantity.against == "bound" else SDS_OF_95) * uncertainty[row]
    return value[row] - half, value[row] + half


def _hover_text(name: str, reason: str, value: float, interval: tuple[float, float] | None, quantity: Quantity) -> str:
    """The text under the pointer."""
    text = f"{label(name)}: {escape(reason, quote=False)}" if reason else label(name)
    if not np.isfinite(value):
        return f"{text}<br>{quantity.name} not known"
    text += with_minus(f"<br>{quantity.name} {value:.5g} {quantity.unit}")
    of = "within its ±" if quantity.against == "bound" else "95 %"
    return text if interval is None else text + with_minus(f"<br>{of}: {interval[0]:.4g} to {interval[1]:.4g}")


def _ink(colour: str) -> str:
    """The text colour that is readable on a disc's colour."""
    if colour.startswith("#"):
        return INK
    red, green, blue = (float(part) / 255 for part in colour.removeprefix("rgb(").removesuffix(")").split(","))
    return "#ffffff" if 0.2126 * red + 0.7152 * green + 0.0722 * blue < _DARK else INK
