"""A plotly figure in a page: its JSON, its description, and the address of its numbers; FRFs, curves and histories."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal
from urllib.parse import quote

import numpy as np
import orjson
import plotly.graph_objects as go
from markupsafe import Markup

from service.pages.shared.assets import LIBRARY, gzipped
from service.pages.shared.formats import json_inside
from service.schemas.skins import History, SensorDeparture, SensorHistory
from service.store import AnyRow
from service.usecases.figure_data import MOST_SINGLE, measured, spreads, spreads_of
from underskin.diagnosis.reporting.page_styles import with_minus
from underskin.figures.curves import ForceCurve, force_curves
from underskin.figures.frf import frf_overview, frf_recordings
from underskin.figures.history import SensorPoints, d33_history, is_summarised
from underskin.recordings.campaign import Campaign, CurveRecording, FrfRecording, Recording
from underskin.recordings.frf import thinned_lines
from underskin.units import Floats

CLICK = "Click a sensor to choose it."
By = Literal["paper", "adopted"]
RESTS = {"adopted": "by the adopted model", "paper": "by the paper's model"}


@dataclass(frozen=True)
class Drawn:
    """A figure as the template has it."""

    name: str
    title: str
    height: int
    json: Markup
    numbers: str | None  # address of its numbers as CSV
    about: str
    choices: tuple[str, ...] = ()  # selectable views, the first is the default


def drawn(name: str, figure: go.Figure, about: str, numbers: str | None = None) -> Drawn:
    """For the template's macro `figure`; `about` says what is to be seen."""
    title, height = figure.layout.title.text, figure.layout.height
    return Drawn(name, title, height, json_inside(figure.to_json()), numbers, about)


@cache
def prepare() -> None:
    """Draw something, and compress the script, before the first request for a figure."""
    frf_overview([], None).to_json()
    gzipped(LIBRARY)


def drawn_before(name: str, text: str, about: str, numbers: str | None = None) -> Drawn:
    """The same of a figure's JSON; the choices are those of its menu."""
    layout = orjson.loads(text)["layout"]
    choices = tuple(button["name"] for menu in layout.get("updatemenus", []) for button in menu["buttons"])
    return Drawn(name, layout["title"]["text"], layout["height"], json_inside(text), numbers, about, choices)


def drawn_curves(recordings: Iterable[Recording], most: int, noun: str = "", numbers: str | None = None) -> list[Drawn]:
    """The first curve recordings in one figure, for a single one its loading and unloading; empty if there are none.
    `noun`: their name."""
    chosen = [recording for recording in recordings if not isinstance(recording, FrfRecording)]
    if not chosen:
        return []
    parts = _there_and_back(chosen[0]) if len(chosen) == 1 else []
    if parts:
        figure = force_curves([ForceCurve(*part) for part in parts])
        return [drawn("curves", figure, "Force against displacement, loading and way back.", numbers)]
    figure = force_curves(
        [ForceCurve(recording.id, recording.displacement_mm, recording.force_n) for recording in chosen[:most]]
    )
    about = f"Force against displacement of {min(len(chosen), most)} of {len(chosen)}{noun}."
    return [drawn("curves", figure, about, numbers)]


def _there_and_back(curve: CurveRecording) -> list[tuple[str, Floats, Floats]]:
    """Loading and unloading of a curve, split at the deepest sample, by name; empty if it lacks one."""
    depth, force = np.asarray(curve.displacement_mm), np.asarray(curve.force_n)
    turn = int(np.argmax(depth))
    if not 0 < turn < len(depth) - 1:
        return []
    return [("loading", depth[: turn + 1], force[: turn + 1]), ("way back", depth[turn:], force[turn:])]


def columns_of(rows: Sequence[Mapping[str, Any]], *names: str) -> list[list[Any]]:
    """Columns of rows; None where a row lacks it."""
    return [[row.get(name) for row in rows] for name in names]


def sensors_of(row: AnyRow, answer: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Each sensor of the d33 of a campaign, with its position and in words why it is an outlier (`reasons`)."""
    places = {sensor["id"]: sensor for sensor in row.about["skin"]["sensors"]}
    return [
        {
            **of_sensor,
            **places[of_sensor["sensor"]],
            "reasons": "; ".join(flag["reason"] for flag in of_sensor["flags"]),
        }
        for of_sensor in answer["sensors"]
    ]


def drawn_frf(
    row: AnyRow,
    loaded: Callable[[], Campaign],
    answer: Mapping[str, Any],
    stored_spreads: Sequence[Mapping[str, Any]] | None,
    show: str,
) -> list[Drawn]:
    """Empty where no recording is shown. `loaded`: the campaign with all numbers; `answer`: its d33; `stored_spreads`:
    those of its conditions, if stored; `show`: a sensor or a recording, empty for all."""
    band = answer["band"]
    zone = None if band is None else (band["low_hz"], band["high_hz"])
    page = f"/campaigns/{row.id}/frf.csv?show={quote(show, safe='')}"
    if show or stored_spreads is None:
        chosen = measured(loaded(), show)
        if not chosen:
            return []
        if len(chosen) <= MOST_SINGLE:
            lines = [thinned_lines.lines_of(_title(recording, show), frf) for recording, frf in chosen]
            conditions = _conditions([recording for recording, _ in chosen])
            about = "Magnitude, phase and coherence of each recording; R is the sphere's radius."
            about += " Colours tell preloads apart, marks along the lines spheres." if conditions else ""
            return [drawn("frf", frf_recordings(lines, zone, conditions), about, page)]
        summaries = spreads_of(chosen)
    else:
        summaries = spreads(stored_spreads)
    count = sum(spread.recordings for spread in summaries)
    about = (
        f"{count} recordings: for each sphere and preload the median magnitude "
        "and phase and the lowest coherence; as a band, the magnitudes of all its recordings. R is the sphere's radius."
    )
    return [drawn("frf", frf_overview(summaries, zone), about, page)]


def _conditions(recordings: Sequence[FrfRecording]) -> list[tuple[float, float]]:
    """Sphere [mm] and preload [N] of each recording, where these are of one sensor under several loads."""
    conditions = [(recording.indenter_radius_mm, recording.preload_n) for recording in recordings]
    of_one_sensor = len({recording.sensor for recording in recordings}) == 1
    return conditions if of_one_sensor and len(set(conditions)) > 1 else []


def _title(recording: FrfRecording, show: str) -> str:
    where = "" if show == recording.sensor else f"{recording.sensor}, "
    return f"{where}R {recording.indenter_radius_mm:.3g} mm, {recording.preload_n:.3g} N"


def drawn_history(root: str, history: History, sensor: str | None, by: By) -> Drawn:
    """d33 over time: of one sensor, of all, or of many the median and the range."""
    numbers = f"/skins/{quote(root, safe='')}/history.csv?model={by}"
    points = [
        SensorPoints(
            sensor_history.sensor,
            [point.time for point in sensor_history.points],
            [point.d33_pc_per_n for point in sensor_history.points],
            [point.d33_uncertainty_pc_per_n for point in sensor_history.points],
            _trend_in_words(sensor_history),
        )
        for sensor_history in history.sensors
    ]
    whose = "each sensor" if sensor is None else sensor
    about = f"d33 of {whose} in every campaign, {RESTS[by]}, with its 95 % interval."
    if is_summarised(len(points), sum(len(sensor_history.times) for sensor_history in points)):
        about = (
            f"Median d33 over the sensors in each campaign, {RESTS[by]}, the range of 90 % of them, and by name those "
            f"that stand apart{'' if sensor is None else f'; the line is {sensor}'}. Point at a sensor for its line."
        )
    return drawn("history", d33_history(points, sensor), about, numbers)


def _trend_in_words(sensor: SensorHistory) -> str:
    """The trend of the sensor's d33, relative to the array's if there are enough sensors."""
    if sensor.departure is not None:
        return with_minus(_besides(sensor.departure))
    line = sensor.trend
    if line is None:
        return f"no trend: {sensor.no_trend}"
    slope = f"{line.slope_pc_per_n_per_year:+.2g} ± {line.slope_uncertainty_pc_per_n_per_year:.1g} pC/N a year"
    slope = with_minus(slope)
    return slope if line.significant else f"no significant trend ({slope})"


def _besides(departure: SensorDeparture) -> str:
    low, high = departure.change_low_percent, departure.change_high_percent
    size = f"{departure.change_percent:+z.1f} % ({low:+z.1f} to {high:+z.1f})"
    return f"besides the array {size}" if departure.significant else f"as the array does, within chance: {size}"
