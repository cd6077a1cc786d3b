"""A recording over its samples: loading, unloading, and the samples excluded by the trim; brushing sets the trim."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from service.ingest.reading import InspectedFile
from service.pages.shared.figures import Drawn, drawn
from service.pages.upload import turned_curves
from service.pages.upload.file_summary import FileSummary
from service.pages.upload.mapping import mapped_file, rig_of
from underskin.diagnosis.reporting.page_styles import BOUND, SHOWN
from underskin.recordings.rig_description import RigDescription, Trim
from underskin.units import LAB, Floats, Indices, Mask, readable_unit

if TYPE_CHECKING:
    import plotly.graph_objects as go

_NAME = "course"
_SHOWN = ("displacement_mm", "force_n", "charge_pc")
_MOST_BINS = 400  # of many samples, the lowest and the highest of each are drawn
_ROW, _EDGES = 150, 120  # pixels
_LOADING, _BACK, _USED, _EXCLUDED = "loading", "way back", "used", "left out"
_BLUE, _ORANGE, _GREY = "#0072B2", "#D55E00", "#8a949e"


def course(look: InspectedFile, summary: FileSummary, rig: RigDescription | None, *, turned: bool) -> list[Drawn]:
    """The first recording of the file over time or displacement; empty for a file without channels. `turned`:
    whether channels that count pressing negative are inverted."""
    used = rig_of(summary, rig)
    mapped = None if used is None else mapped_file(look, summary, replace(used, trim=None))
    if used is None or mapped is None or not mapped.document["recordings"]:
        return []
    first: Mapping[str, Any] = mapped.document["recordings"][0]
    columns = {name: first[name] for name in _SHOWN if name in first and "frequency_hz" not in first}
    if not columns or len({len(column) for column in columns.values()}) > 1:
        return []
    if turned:
        columns = turned_curves.turned(columns, _to_turn(look, summary, used))
    of = len(mapped.document["recordings"])
    which = "The recording" if of == 1 else f"{str(first['id'])[:60]!r}, the first of {of} recordings"
    about = f"{which}, sample by sample. Drag across the figure to choose the samples that are used."
    return [drawn(_NAME, _figure(columns, used.trim or Trim()), about)]


def _to_turn(look: InspectedFile, summary: FileSummary, used: RigDescription) -> Sequence[str]:
    """The channels of the first recording to be inverted, from the samples in use."""
    trimmed = mapped_file(look, summary, used)
    return () if trimmed is None else turned_curves.counted_negative(trimmed.document["recordings"][0])


def _figure(columns: Mapping[str, Floats], trim: Trim) -> "go.Figure":
    from plotly.subplots import make_subplots

    from underskin.figures.style import styled

    count = len(next(iter(columns.values())))
    sample = np.arange(1, count + 1)
    parts = _parts(columns, (sample >= (trim.first_sample or 1)) & (sample <= (trim.last_sample or count)))
    figure = make_subplots(len(columns), 1, shared_xaxes=True, vertical_spacing=0.08)
    for row, (field, column) in enumerate(columns.items(), start=1):
        unit, count_of_lab = _readable(field, column)
        chosen = _extremes(column)
        for name, (colour, mask) in parts.items():
            y = np.where(mask, column * count_of_lab, np.nan)[chosen]
            if np.isfinite(y).any():
                figure.add_scatter(
                    x=sample[chosen],
                    y=y.astype(np.float32),
                    mode="lines",
                    name=name,
                    legendgroup=name,
                    showlegend=row == 1,
                    line={"color": colour, "width": 1.4, "dash": BOUND if name == _EXCLUDED else SHOWN},
                    hovertemplate=f"{name}, sample %{{x}}: %{{y:.4g}} {unit}<extra></extra>",
                    row=row,
                    col=1,
                )
        figure.update_yaxes(title=f"{field.rpartition('_')[0]}<br>[{unit}]", fixedrange=True, row=row, col=1)
    figure.update_xaxes(title="sample", row=len(columns), col=1)
    figure.update_layout(dragmode="select", selectdirection="h")
    title = "Loading and way back" if _BACK in parts else "The samples"
    return styled(figure, title, _EDGES + _ROW * len(columns))


def _extremes(column: Floats) -> Indices:
    """Indices of the samples to draw: all, or minimum and maximum of as many bins as a figure resolves."""
    bins = np.array_split(np.arange(len(column)), min(_MOST_BINS, len(column)))
    ends = [(part[np.argmin(column[part])], part[np.argmax(column[part])]) for part in bins]
    return np.unique([0, *(end for pair in ends for end in pair), len(column) - 1])


def _readable(field: str, column: Floats) -> tuple[str, float]:
    """A readable unit for a column, and its factor to the lab's unit."""
    if field == "charge_pc":
        return LAB[field].unit, 1.0
    return readable_unit(field, float(np.nanmax(np.abs(column), initial=0.0)))


def _parts(columns: Mapping[str, Floats], used: Mask) -> dict[str, tuple[str, Mask]]:
    """Colour and mask (samples,) of each part by name; a curve is loading up to its deepest sample."""
    excluded = {_EXCLUDED: (_GREY, ~used)}
    if "displacement_mm" not in columns:
        return {_USED: (_BLUE, used)} | excluded
    depth = np.where(used & np.isfinite(columns["displacement_mm"]), columns["displacement_mm"], -np.inf)
    number, turn = np.arange(len(depth)), int(np.argmax(depth))
    if not (used & (number < turn)).any():  # nothing is pressed in yet, such as where a sign is to be turned
        return {_USED: (_BLUE, used)} | excluded
    return {_LOADING: (_BLUE, used & (number <= turn)), _BACK: (_ORANGE, used & (number >= turn))} | excluded
