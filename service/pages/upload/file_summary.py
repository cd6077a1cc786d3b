"""Summary of an uploaded file: channels, recordings, errors, doubts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from service.ingest.reading import InspectedFile, checked
from service.ingest.uploads import Upload
from service.store.codec import recorded_at
from underskin import InvalidInput
from underskin.findings.sentences import more_alike
from underskin.recordings.campaign import Campaign, CompressionRecording, FrfRecording, Recording, SkinDescription
from underskin.recordings.channels import Channel, Contents
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.spectra import mean_of
from underskin.recordings.readers.unit_labels import unit
from underskin.recordings.regular_samples import even_rate
from underskin.units import readable_unit, to_lab

_ALIKE = 0.2  # allowed deviation of the measured preload, relative to the stated one
_REPORTED_RATIO = 3.0  # times the stated preload: beyond that, the findings of a campaign's d33 say so
_PARTS, _STEADY = 4, 0.2  # of a recording, in which the means of a static force are alike, as a part of its mean
MOST_LISTED = 60
_MOST_CHANNELS = 60
_LEAST_COHERENCE = 0.5  # of lines at which the charge follows the force
_MOST_PROPERTIES = 40
MOST_SENSORS = 300  # listed of a skin
_MOST_SKINS = 2


def measured_otherwise(recording: FrfRecording) -> float | None:
    """The static force [N] of the recording if it differs from the stated preload; None if they agree, or if the
    channel has no static force: that of a piezo sensor decays to 0."""
    force = recording.force_n
    mean = None if force is None or len(force) < _PARTS else mean_of(force)
    if force is None or mean is None:
        return None
    means = [float(part.mean()) for part in np.array_split(force, _PARTS)]
    is_steady = max(means) - min(means) <= _STEADY * abs(mean)
    return abs(mean) if is_steady and abs(abs(mean) / recording.preload_n - 1) > _ALIKE else None


def _force_in_words(force_n: float) -> str:
    """A force in the unit in which it reads well."""
    unit, count = readable_unit("force_n", force_n)
    return f"{count * force_n:#.3g} {unit}"


def doubts(campaign: Campaign) -> list[str]:
    """A sentence on the first recording of a campaign whose stated preload differs from the measured one, and how
    many more there are."""
    measured = [
        (recording, mean)
        for recording in campaign.of(FrfRecording)
        if (mean := measured_otherwise(recording)) is not None
    ]
    doubtful = [
        (recording, mean)
        for recording, mean in measured
        if 1 / _REPORTED_RATIO <= mean / recording.preload_n <= _REPORTED_RATIO
    ]
    if not doubtful:
        return []
    (first, mean), *further = doubtful
    which = f"{first.id}: " if len(campaign.recordings) > 1 else ""
    alike = more_alike(len(further), "recording")
    words = (
        f"{which}pressed by {first.preload_n:g} N as stated, but its force is {_force_in_words(mean)} on average"
        f"{alike}: is this the preload of this recording, and is its force measured from 0?"
    )
    return [words]


@dataclass(frozen=True)
class ChannelSummary:
    """A channel: over all parts of the file that have it."""

    name: str
    unit: str
    samples: int  # of the first part
    low: float | None
    high: float | None
    is_complex: bool = False


@dataclass(frozen=True)
class RecordingSummary:
    """A valid recording; `frf_pc_per_n` is the median magnitude over the lines where charge follows force."""

    id: str
    kind: str
    sensor: str | None
    pressed_by: str
    points: int
    frf_pc_per_n: float | None
    recorded_at: str | None = None
    conditions: Mapping[str, float | str] | None = None  # conditions under names of the lab's own


@dataclass(frozen=True)
class FileSummary:
    """One file."""

    label: str
    kind: str
    recordings: int
    listed: Sequence[RecordingSummary]
    refused: Sequence[dict[str, Any]]  # id and errors of each
    errors: Sequence[dict[str, Any]]  # of the whole
    notes: Sequence[str]
    campaigns: Sequence[str]  # their names
    skin: str | None
    described: Sequence[SkinDescription] = ()  # different ones, of its campaigns; of each the first sensors
    known: Sequence[str] = ()  # warnings before it is stored
    day: str | None = None  # of the first recording that has a time
    instrument: str | None = None  # that wrote it, as `instruments.recognised` has it
    parts: int = 0
    sample_rate_hz: float | None = None
    rate_from: str | None = None  # the channel of times that the sample rate follows from; None where it is stated
    began: str | None = None  # when, as the first part says itself
    channels: Sequence[ChannelSummary] = ()
    texts: Sequence[str] = ()  # columns of words
    properties: Mapping[str, str | float] = field(default_factory=dict)
    taken: Mapping[str, str] = field(default_factory=dict)  # by field, in words; under none how a text was read


def seen(upload: Upload, look: InspectedFile, known: Sequence[str]) -> FileSummary:
    """A summary of bounded size; `known`: warnings to be shown before it is stored. It does not contain yet how
    columns were interpreted."""
    arrived = [checked(campaign) for campaign in look.campaigns]
    campaigns = [checked_campaign.campaign for checked_campaign in arrived if checked_campaign.campaign is not None]
    recordings = [recording for campaign in campaigns for recording in campaign.recordings]
    written_by = [campaign_read.instrument for campaign_read in look.campaigns if campaign_read.instrument is not None]
    skins = {campaign.skin.id for campaign in campaigns if campaign.skin.id is not None}
    contents = look.contents
    about: dict[str, Any] = {} if contents is None else _about(contents)
    return FileSummary(
        label=upload.label or "the file",
        kind=look.kind,
        recordings=len(recordings),
        listed=[_recording(recording) for recording in recordings[:MOST_LISTED]],
        refused=[refusal for checked_campaign in arrived for refusal in checked_campaign.refused],
        # Not that all recordings of a campaign were refused, which are listed
        errors=[
            error for checked_campaign in arrived if not checked_campaign.refused for error in checked_campaign.errors
        ],
        notes=[note for checked_campaign in arrived for note in checked_campaign.notes],
        campaigns=[campaign.name for campaign in campaigns],
        described=_described(campaigns),
        skin=next(iter(skins)) if len(skins) == 1 else None,
        known=known,
        instrument=next(iter(written_by), None),
        day=min(
            (str(recording.recorded_at)[:10] for recording in recordings if recording.recorded_at is not None),
            default=None,
        ),
        **about,
    )


def may_state(files: Sequence[FileSummary], name: str) -> bool:
    """Whether one of the files may have a property of this name: a file already read by its mapping has what that
    needs, and long lists of properties are truncated."""
    return any(file.recordings or name in file.properties or len(file.properties) >= _MOST_PROPERTIES for file in files)


def listed(look: InspectedFile, first: int) -> list[RecordingSummary]:
    """One page of the list of recordings, from this number on."""
    campaigns = [
        checked_campaign.campaign
        for checked_campaign in map(checked, look.campaigns)
        if checked_campaign.campaign is not None
    ]
    recordings = [recording for campaign in campaigns for recording in campaign.recordings]
    return [_recording(recording) for recording in recordings[first : first + MOST_LISTED]]


def _described(campaigns: Sequence[Campaign]) -> list[SkinDescription]:
    """The first of the distinct skins that campaigns describe, ignoring their ids."""
    different: list[SkinDescription] = []
    for campaign in campaigns:
        skin = replace(campaign.skin, id=None, sensors=campaign.skin.sensors[:MOST_SENSORS])
        if skin not in different and len(different) < _MOST_SKINS:
            different.append(skin)
    return different


def _about(contents: Contents) -> dict[str, Any]:
    by_name: dict[str, list[Channel]] = {}
    for block in contents.blocks:
        for channel in block.channels:
            if channel.name in by_name or len(by_name) < _MOST_CHANNELS:
                by_name.setdefault(channel.name, []).append(channel)
    return {
        "parts": len(contents.blocks),
        **_rate(contents),
        "began": contents.blocks[0].recorded_at if contents.blocks else None,
        "channels": [_channel(parts) for parts in by_name.values()],
        "texts": list(dict.fromkeys(column.name for block in contents.blocks for column in block.texts))[
            :_MOST_CHANNELS
        ],
        "properties": _properties(contents),
    }


def _rate(contents: Contents) -> dict[str, Any]:
    """The sample rate that the first part states, or else that of its channel of times."""
    if not contents.blocks or contents.blocks[0].sample_rate_hz is not None:
        return {"sample_rate_hz": contents.blocks[0].sample_rate_hz if contents.blocks else None}
    for channel in contents.blocks[0].channels:
        time_unit = unit(channel.unit)
        if time_unit is not None and time_unit.dimension == "time" and len(channel.values) > 1:
            rate = even_rate(channel.values.real)
            return {"sample_rate_hz": rate and rate / time_unit.to_si, "rate_from": channel.name}
    return {}


def _channel(parts: Sequence[Channel]) -> ChannelSummary:
    """One channel, from all parts of the file that have it."""
    first, last = parts[0], parts[-1]
    limits = [limit for part in parts for limit in _range(part.values)]
    low, high = min(limits, default=None), max(limits, default=None)
    complex_numbers = bool(np.iscomplexobj(last.values))
    return ChannelSummary(first.name, last.unit, len(first.values), low, high, complex_numbers)


def _properties(contents: Contents) -> dict[str, str | float]:
    """The properties of the file and of its first part, those of the part under their own names, as mappings know
    them."""
    first = contents.blocks[0].name if contents.blocks else ""
    prefixes = tuple(f"{block.name}." for block in contents.blocks if block.name)
    prefix = f"{first}."
    properties = {
        name.removeprefix(prefix) if first else name: value
        for name, value in contents.properties.items()
        if not name.startswith(prefixes) or (first and name.startswith(prefix))
    }
    return dict(list(properties.items())[:_MOST_PROPERTIES])


def _range(values: Any) -> list[float]:
    """Lowest and highest of the finite values, if there are any; of complex ones of their magnitude."""
    real = np.abs(values) if np.iscomplexobj(values) else values
    finite = real[np.isfinite(real)]
    return [float(finite.min()), float(finite.max())] if len(finite) else []


def _recording(recording: Recording) -> RecordingSummary:
    """What it is, and when and under which conditions it was recorded."""
    return replace(_measured(recording), recorded_at=recorded_at(recording), conditions=recording.conditions)


def _measured(recording: Recording) -> RecordingSummary:
    if isinstance(recording, CompressionRecording):
        size = f"{recording.sample_height_mm:g} mm high, {recording.sample_diameter_mm:g} mm across"
        return RecordingSummary(recording.id, recording.kind, None, size, len(recording.force_n), None)
    if not isinstance(recording, FrfRecording):
        size = f"sphere, radius {recording.indenter_radius_mm:g} mm"
        return RecordingSummary(recording.id, recording.kind, recording.sensor, size, len(recording.force_n), None)
    column = recording.force_n if recording.force_n is not None else recording.frequency_hz
    measured = measured_otherwise(recording)
    addition = "" if measured is None else f" (its force: {_force_in_words(measured)})"
    pressed = f"{recording.preload_n:g} N{addition}, sphere radius {recording.indenter_radius_mm:g} mm"
    points = 0 if column is None else len(column)
    return RecordingSummary(recording.id, recording.kind, recording.sensor, pressed, points, _level(recording))


def _level(recording: FrfRecording) -> float | None:
    try:
        lines = lines_of(recording)
    except InvalidInput:
        return None
    coherent = ~(lines.coherence_or_nan < _LEAST_COHERENCE)
    values = lines.values[coherent] if coherent.any() else lines.values
    finite = values[np.isfinite(values)]
    return float(np.median(to_lab("frf_pc_per_n", np.abs(finite)))) if len(finite) else None
