"""A plotly figure in a page: its JSON, its description, and the address of its numbers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
from markupsafe import Markup

from service.pages.shared.assets import LIBRARY, gzipped
from service.pages.shared.formats import json_inside
from service.store import AnyRow
from underskin.recordings.campaign import CurveRecording, FrfRecording, Recording
from underskin.units import Floats

if TYPE_CHECKING:
    import plotly.graph_objects as go

CLICK = "Click a sensor to choose it."


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


def drawn(name: str, figure: "go.Figure", about: str, numbers: str | None = None) -> Drawn:
    """For the template's macro `figure`; `about` says what is to be seen."""
    title, height = figure.layout.title.text, figure.layout.height
    return Drawn(name, title, height, json_inside(figure.to_json()), numbers, about)


@cache
def prepare() -> None:
    """Load the plotting code before the first request for a figure: it takes half a second."""
    import underskin.figures.campaign_figures
    from underskin.figures.frf import frf_overview

    assert underskin.figures.campaign_figures
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
    from underskin.figures.curves import ForceCurve, force_curves

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
