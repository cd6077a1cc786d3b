"""The figures of an uploaded file: a recording over its samples, its raw channels, its FRFs, its curves."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from service.ingest.reading import InspectedFile
from service.pages.shared.figures import Drawn, drawn, drawn_curves
from service.pages.upload.file_summary import FileSummary
from service.pages.upload.mapping import mapped_file, rig_of
from service.usecases.figure_data import frf_columns, measured
from underskin.diagnosis.reporting.page_styles import BOUND, SHOWN
from underskin.figures.curves import ForceCurve, force_curves
from underskin.figures.frf import frf_recordings
from underskin.figures.style import styled
from underskin.figures.traces import raw_traces
from underskin.recordings.campaign import Campaign
from underskin.recordings.curve_preparation import falling
from underskin.recordings.frf import thinned_lines
from underskin.recordings.rig_description import RigDescription, Trim
from underskin.recordings.rig_mapping import MappedFile, range_of
from underskin.units import LAB, Floats, Indices, Mask, readable_unit

_COURSE = "course"
_SHOWN = ("displacement_mm", "force_n", "charge_pc")
_MOST_BINS = 400  # of many samples, the lowest and the highest of each are drawn
_ROW, _EDGES = 150, 120  # pixels
_LOADING, _BACK, _USED, _EXCLUDED = "loading", "way back", "used", "left out"
_BLUE, _ORANGE, _GREY = "#0072B2", "#D55E00", "#8a949e"
_MOST_TRACES = 8
_MOST_FRF = 12
_MOST_CURVES = 12


def counted_negative(recording: Mapping[str, Any]) -> Sequence[str]:
    """Those of `force_n` and `displacement_mm` that decrease while a curve is pressed."""
    if recording["kind"] == "frf" or not {"force_n", "displacement_mm"} <= recording.keys():
        return ()
    columns = np.asarray(recording["force_n"]), np.asarray(recording["displacement_mm"])
    return falling(*columns, sphere=recording["kind"] == "indentation")


def inverted(columns: Mapping[str, Any], fields: Sequence[str]) -> dict[str, Any]:
    """The columns, with those of `fields` inverted."""
    return {name: -np.asarray(column) if name in fields else column for name, column in columns.items()}


def with_curves_turned(mapped: MappedFile) -> MappedFile:
    """A file with every such curve inverted; the note on each channel says so, with the range of the first curve."""
    before: Sequence[dict[str, Any]] = mapped.document["recordings"]
    recordings = [inverted(recording, counted_negative(recording)) for recording in before]
    taken = dict(mapped.taken)
    for field in counted_negative(before[0]) if before else ():
        channel = taken[field].rpartition(": ")[0]  # before the range that it came in
        taken[field] = f"{channel}, turned round: {range_of(field, recordings[0][field])}"
    return replace(mapped, document={**mapped.document, "recordings": recordings}, taken=taken)


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
        columns = inverted(columns, _to_turn(look, summary, used))
    of = len(mapped.document["recordings"])
    which = "The recording" if of == 1 else f"{str(first['id'])[:60]!r}, the first of {of} recordings"
    about = f"{which}, sample by sample. Drag across the figure to choose the samples that are used."
    return [drawn(_COURSE, _course_figure(columns, used.trim or Trim()), about)]


def _to_turn(look: InspectedFile, summary: FileSummary, used: RigDescription) -> Sequence[str]:
    """The channels of the first recording to be inverted, from the samples in use."""
    trimmed = mapped_file(look, summary, used)
    return () if trimmed is None else counted_negative(trimmed.document["recordings"][0])


def _course_figure(columns: Mapping[str, Floats], trim: Trim) -> go.Figure:
    count = len(next(iter(columns.values())))
    sample = np.arange(1, count + 1)
    parts = _course_parts(columns, (sample >= (trim.first_sample or 1)) & (sample <= (trim.last_sample or count)))
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


def _course_parts(columns: Mapping[str, Floats], used: Mask) -> dict[str, tuple[str, Mask]]:
    """Colour and mask (samples,) of each part by name; a curve is loading up to its deepest sample."""
    excluded = {_EXCLUDED: (_GREY, ~used)}
    if "displacement_mm" not in columns:
        return {_USED: (_BLUE, used)} | excluded
    depth = np.where(used & np.isfinite(columns["displacement_mm"]), columns["displacement_mm"], -np.inf)
    number, turn = np.arange(len(depth)), int(np.argmax(depth))
    if not (used & (number < turn)).any():  # nothing is pressed in yet, such as where a sign is to be turned
        return {_USED: (_BLUE, used)} | excluded
    return {_LOADING: (_BLUE, used & (number <= turn)), _BACK: (_ORANGE, used & (number >= turn))} | excluded


def figures(look: InspectedFile, page: str, mapped: MappedFile | None) -> list[Drawn]:
    """The figures of a file; `page`: the address of the upload's file, for its numbers; `mapped`: the document that
    a mapping makes of the file, however incomplete."""
    campaigns = _campaigns(look)
    recordings = [recording for campaign in campaigns for recording in campaign.recordings]
    return [
        *(drawn_curves(recordings, _MOST_CURVES) or _mapped_curves(mapped)),
        *_traces(look, page),
        *_frf(campaigns, page),
    ]


def _mapped_curves(mapped: MappedFile | None) -> list[Drawn]:
    """Force against displacement as soon as a mapping has both, even without the sphere's radius."""
    recordings = (
        []
        if mapped is None
        else [recording for recording in mapped.document["recordings"] if recording["kind"] != "frf"]
    )
    curves = [
        ForceCurve(recording["id"], recording["displacement_mm"], recording["force_n"])
        for recording in recordings
        if "displacement_mm" in recording
        and "force_n" in recording
        and len(recording["displacement_mm"]) == len(recording["force_n"])
    ]
    if not curves:
        return []
    of = min(len(curves), _MOST_CURVES)
    about = f"Force against displacement of {of} of {len(curves)}, as the form now says what the channels are."
    return [drawn("curves", force_curves(curves[:_MOST_CURVES]), about)]


def trace_columns(look: InspectedFile) -> dict[str, list[Any]]:
    """The channels of the file's first part, a row a sample."""
    if look.contents is None or not look.contents.blocks:
        return {}
    block = look.contents.blocks[0]
    length = max((len(channel.values) for channel in block.channels), default=0)
    columns = {}
    for channel in block.channels:
        values = np.abs(channel.values) if np.iscomplexobj(channel.values) else channel.values
        filled = [*values.tolist(), *[None] * (length - len(values))]
        unit = f"[{channel.unit}]" if channel.unit else ""
        columns[channel.name if channel.name.endswith(unit) else f"{channel.name} {unit}"] = filled
    return columns


def lines_columns(look: InspectedFile) -> dict[str, list[Any]]:
    """Every line of every FRF in the file."""
    parts = [frf_columns(campaign) for campaign in _campaigns(look)]
    return {name: [value for part in parts for value in part[name]] for name in parts[0]} if parts else {}


def _campaigns(look: InspectedFile) -> list[Campaign]:
    return [campaign.reading.campaign for campaign in look.campaigns if campaign.reading is not None]


def _traces(look: InspectedFile, page: str) -> list[Drawn]:
    if look.contents is None or not look.contents.blocks:
        return []
    block = look.contents.blocks[0]
    real = [channel for channel in block.channels if len(channel.values) and not np.iscomplexobj(channel.values)]
    if not real:
        return []
    of = (
        f" of {block.name[:60]!r}, the first of {len(look.contents.blocks)} parts"
        if len(look.contents.blocks) > 1
        else ""
    )
    most = f" (the first {_MOST_TRACES} of {len(real)})" if len(real) > _MOST_TRACES else ""
    about = f"The channels{of}{most}, in the units of the file."
    return [drawn("traces", raw_traces(real[:_MOST_TRACES], block.sample_rate_hz), about, f"{page}traces.csv")]


def _frf(campaigns: list[Campaign], page: str) -> list[Drawn]:
    measured_frfs = [recording_frf for campaign in campaigns for recording_frf in measured(campaign)]
    if not measured_frfs:
        return []
    lines = [
        thinned_lines.lines_of(
            f"{recording.id}: {recording.sensor}, R {recording.indenter_radius_mm:g} mm, {recording.preload_n:g} N", frf
        )
        for recording, frf in measured_frfs[:_MOST_FRF]
    ]
    some = (
        f" of the first {_MOST_FRF} of {len(measured_frfs)} recordings"
        if len(measured_frfs) > _MOST_FRF
        else " of each recording"
    )
    about = f"Magnitude, phase and coherence{some}. R is the sphere's radius."
    return [drawn("frf", frf_recordings(lines, None), about, f"{page}frf.csv")]
