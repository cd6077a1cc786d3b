"""The figures of an uploaded file: its raw channels, its FRFs, its curves."""

from typing import Any

import numpy as np

from service.ingest.reading import InspectedFile
from service.pages.shared.figures import Drawn, drawn, drawn_curves
from service.usecases.figure_data import frf_columns, measured
from underskin.recordings.campaign import Campaign
from underskin.recordings.rig_mapping import MappedFile

_MOST_TRACES = 8
_MOST_FRF = 12
_MOST_CURVES = 12


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
    from underskin.figures.curves import ForceCurve, force_curves

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
    from underskin.figures.traces import raw_traces

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
    from underskin.figures.frf import frf_recordings
    from underskin.recordings.frf import thinned_lines

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
