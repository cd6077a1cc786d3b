"""The lines of a campaign's FRF recordings as the diagnosis uses them: what was measured, and how surely.

A model without frequency in it has one value a recording, and then the recording's lines can be replaced by their
weighted mean: with weights 1/d², Σ|y − m|²/d² = Σ|y − ȳ|²/d² + |ȳ − m|²/d̄². `collapsed` does that, exactly; the
first sum, which no such model changes, is carried along in `scatter`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from underskin.diagnosis.noise.correlated_error import CurveError, Whitening
from underskin.diagnosis.noise.line_noise import LineNoise, line_noise
from underskin.mechanisms.base import Kind
from underskin.mechanisms.models.composition import kind_of
from underskin.mechanisms.registry import Known
from underskin.recordings.campaign import Campaign, FrfRecording, Recording, frf_recordings, samples_of
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Complexes, Floats, Indices, Mask

COLLAPSED_HZ = 30.0  # stands for the frequency of a collapsed line; no model that is given one asks for it


@dataclass(frozen=True, eq=False)
class Lines:
    """Rows run over all recordings one after another; SI.

    `campaign` holds exactly these rows, so that a model composed for it predicts them. `deviation` is the standard
    deviation of real and of imaginary part each, up to the common factor that every hypothesis fits. `scatter` is what
    collapsing left out: Σ|y − ȳ|²/d² and its degrees of freedom. `smooth` is the error that a curve's
    samples share.
    """

    campaign: Campaign
    value: Complexes  # (rows,)
    deviation: Floats  # (rows,)
    frequency: Floats  # (rows,)
    recording: Indices  # (rows,)
    sensor: Indices  # (recordings,)
    noise: LineNoise
    scatter: tuple[float, int] = (0.0, 0)
    smooth: CurveError | None = None  # of curves
    mechanisms: Known = field(default_factory=Known)  # that may explain them

    @property
    def recordings(self) -> int:
        """How many there are."""
        return len(self.sensor)

    @cached_property
    def kind(self) -> Kind:
        """Of the recordings; all are of one kind."""
        return kind_of(self.campaign)

    @property
    def curves(self) -> bool:
        """Whether the rows are samples of force, not lines of an FRF."""
        return self.kind != "frf"

    @property
    def row_axes(self) -> tuple[str, ...]:
        """The axes along which the rows of a recording run."""
        return ("displacement_mm",) if self.curves else ("frequency_hz", "phase")

    @cached_property
    def first(self) -> Indices:
        """The first row of each recording."""
        return np.searchsorted(self.recording, np.arange(self.recordings))

    @cached_property
    def spans(self) -> list[slice]:
        """The rows of each recording."""
        return [slice(low, high) for low, high in pairwise((*self.first.tolist(), len(self.value)))]

    @cached_property
    def about_means(self) -> tuple[float, int]:
        """Σ|y − ȳ|²/d² about each recording's mean, and how many real numbers the lines are, collapsed or not."""
        square, freedom = self.scatter
        if not self.curves:
            weight = self.deviation**-2
            mean = np.add.reduceat(weight * self.value, self.first) / np.add.reduceat(weight, self.first)
            square += float(np.sum(weight * np.abs(self.value - mean[self.recording]) ** 2))
        return square, 2 * len(self.value) + freedom

    @cached_property
    def sensors(self) -> Floats:
        """1 where a recording is of a sensor (recordings, sensors)."""
        return np.eye(int(self.sensor.max()) + 1)[self.sensor]

    @cached_property
    def whitening(self) -> Whitening | None:
        """What makes the samples of curves independent."""
        return None if self.smooth is None else Whitening(self.smooth, self.deviation, self.recording)

    def collapsed(self) -> "Lines":
        """One line a recording, the weighted mean of its lines; what the lines scatter about it goes into `scatter`."""
        weight = self.deviation**-2
        total = np.add.reduceat(weight, self.first)
        mean = np.add.reduceat(weight * self.value, self.first).astype(np.complex128) / total
        left = float(np.sum(weight * np.abs(self.value - mean[self.recording]) ** 2))
        recordings = tuple(
            FrfRecording.of_lines(entry, np.array([COLLAPSED_HZ]), mean[[number]])
            for number, entry in enumerate(frf_recordings(self.campaign))
        )
        return replace(
            self,
            campaign=replace(self.campaign, recordings=recordings),
            value=mean,
            deviation=total**-0.5,
            frequency=np.full(len(mean), COLLAPSED_HZ),
            recording=np.arange(len(mean)),
            scatter=(self.scatter[0] + left, self.scatter[1] + 2 * (len(self.value) - len(mean))),
        )

    def part(self, kept: Mask) -> "Lines":
        """Only some of the rows, each with the noise it had; recordings without a row are left out."""
        order = np.flatnonzero(kept)
        recordings, first = np.unique(self.recording[order], return_index=True)
        value, frequency = self.value[order], self.frequency[order]
        ends = [*first[1:].tolist(), len(order)]
        entries: list[Recording] = []
        for number, low, high in zip(recordings.tolist(), first.tolist(), ends, strict=True):
            entry = self.campaign.recordings[number]
            if isinstance(entry, FrfRecording):
                entries.append(FrfRecording.of_lines(entry, frequency[low:high], value[low:high]))
            else:
                entries.append(samples_of(entry, order[low:high] - self.first[number]))
        return replace(
            self,
            campaign=replace(self.campaign, recordings=tuple(entries)),
            value=value,
            deviation=self.deviation[order],
            frequency=frequency,
            recording=np.repeat(np.arange(len(entries)), np.diff([*first, len(order)])),
            sensor=self.sensor[recordings],
            scatter=(0.0, self.scatter[1] and -len(order)),
            smooth=None if self.smooth is None else self.smooth.part(order),
        )


def lines(
    campaign: Campaign, uneven: Mapping[str, Floats] | None = None, known: tuple[Lines, Complexes] | None = None
) -> Lines:
    """The FRF lines of a campaign, sorted by frequency, those that are not finite left out. `uneven` is, of recordings
    by their id, the noise of each line over its course along frequency (1 where not given); `known` the same lines and
    a prediction of the rows (rows,), whose course is not counted as noise.

    Recordings of another kind and recordings without a finite line are left out of the `campaign` that comes with them.
    """
    measured = _measured(campaign, uneven or {})
    recording = np.repeat(np.arange(len(measured.entries)), measured.counts).astype(np.intp)
    expected = None if known is None else known[1]
    of_lines = measured.frequency, recording, measured.coherence, measured.unevenness
    noise = line_noise(measured.value, *of_lines, expected)
    if known is not None:
        return replace(known[0], deviation=noise.deviation, noise=noise)
    each = zip(measured.entries, np.cumsum(measured.counts).tolist(), measured.counts, strict=True)
    entries = tuple(
        FrfRecording.of_lines(entry, measured.frequency[end - count : end], measured.value[end - count : end])
        for entry, end, count in each
    )
    return Lines(
        campaign=replace(campaign, recordings=entries),
        value=measured.value,
        deviation=noise.deviation,
        frequency=measured.frequency,
        recording=recording,
        sensor=measured.sensor,
        noise=noise,
    )


@dataclass(frozen=True, eq=False)
class _Measured:
    """The recordings with finite lines, the sensor of each and how many lines it has; and columns over all these lines
    (rows,), `coherence` NaN where not given."""

    entries: list[FrfRecording]
    sensor: Indices
    counts: list[int]
    value: Complexes
    frequency: Floats
    coherence: Floats
    unevenness: Floats


def _measured(campaign: Campaign, uneven: Mapping[str, Floats]) -> _Measured:
    numbers = {sensor.id: index for index, sensor in enumerate(campaign.skin.sensors)}
    entries: list[FrfRecording] = []
    values, frequencies, coherences, unevens = [], [], [], []
    for entry in campaign.recordings:
        if not isinstance(entry, FrfRecording):
            continue
        measured = lines_of(entry)
        order = np.argsort(measured.frequency, kind="stable")
        order = order[np.isfinite(measured.values[order]) & np.isfinite(measured.frequency[order])]
        if len(order) == 0:
            continue
        entries.append(entry)
        values.append(measured.values[order])
        frequencies.append(measured.frequency[order])
        coherences.append(measured.coherence_or_nan[order])
        unevens.append(uneven.get(entry.id, np.ones(len(measured.values)))[order])
    sensor = np.array([numbers[entry.sensor] for entry in entries], dtype=np.intp)
    counts = [len(value) for value in values]
    value = np.concatenate([*values, np.zeros(0, dtype=complex)])
    columns = (np.concatenate([*each, np.zeros(0)]) for each in (frequencies, coherences, unevens))
    return _Measured(entries, sensor, counts, value, *columns)
