"""Recordings as the rows that are explained, with their noise.

The campaign's axes as numbers: what each recording was made at, on a scale where like distances mean alike. The
recordings that a diagnosis uses, with the findings on all recordings.

A curve thinned to means over blocks of neighbouring samples.

They lie evenly along it, and ever closer towards its jumps and the kinks where contact begins and ends. The deviation
of a mean is the samples' noise, read from second differences, of the force and, times the slope, of the displacement.

The lines of a campaign's FRF recordings as the diagnosis uses them: what was measured, and how surely.

A model without frequency in it has one value a recording, and then the recording's lines can be replaced by their
weighted mean: with weights 1/d², Σ|y − m|²/d² = Σ|y − ȳ|²/d² + |ȳ − m|²/d̄². `collapsed` does that, exactly; the
first sum, which no such model changes, is carried along in `scatter`.

Indentation and compression curves as the diagnosis uses them: samples of force in place of lines of an FRF.

A curve is thinned to means over blocks of samples, with the deviation of each. How large that really is, the level of
the noise says, which every hypothesis fits under the same prior. What a cell adds, and what neighbouring samples share,
is in correlated_error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from underskin.diagnosis.noise import USUAL_DRIFT, CurveError, LineNoise, Whitening, instrument_columns, line_noise
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lacking
from underskin.mechanisms.base import Kind
from underskin.mechanisms.models.composition import kind_of
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import (
    Campaign,
    CurveRecording,
    FrfRecording,
    Recording,
    frf_recordings,
    offsets,
    samples_of,
)
from underskin.recordings.curve_course import CurveLandmarks, curve_landmarks, foot, hidden_samples, roughness
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Complexes, Floats, Indices, Mask

_LOGARITHMIC = ("preload_n", "indenter_radius_mm", "dynamic_force_n")
WORDS = {  # of each axis: what it is called, and its unit
    "preload_n": ("preload", "N"),
    "indenter_radius_mm": ("radius of the sphere", "mm"),
    "sensor": ("sensor", ""),
    "position_mm": ("distance from the sensor's centre", "mm"),
    "dwell_s": ("time under preload", "s"),
    "load_cycles": ("load cycles", ""),
    "dynamic_force_n": ("dynamic force", "N"),
    "recorded_at": ("day", ""),
    "frequency_hz": ("frequency", "Hz"),
    "phase": ("phase", ""),
    "displacement_mm": ("displacement", "mm"),
}
_FROM_ZERO = ("load_cycles", "dwell_s")  # log(1 + x)
_SAME = 0.01  # on a logarithmic scale: values within a percent were meant to be one


def recording_axes(campaign: Campaign) -> dict[str, Floats]:
    """Of each axis on which the recordings differ, one row a recording (recordings, 1 or 2).

    `position_mm` is the contact's place seen from the sensor's centre, `sensor` the sensor's own place on the skin
    [mm], `recorded_at` is in hours from the first. An axis that a recording lacks is left out, and one on which all
    agree, on a logarithmic scale within a percent.
    """
    entries = campaign.recordings
    columns_by_axis: dict[str, Floats] = {}
    for name in (*_LOGARITHMIC, *_FROM_ZERO):
        values: list[Any] = [getattr(entry, name, None) for entry in entries]
        if None in values:
            continue
        if not agree(name, values):
            columns_by_axis[name] = _scaled(name, values)[:, None]
    frf = [entry for entry in entries if isinstance(entry, FrfRecording)]
    if frf:
        columns_by_axis["position_mm"] = 1e3 * offsets(campaign)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
        columns_by_axis["sensor"] = np.array([centres[entry.sensor] for entry in frf])
    times = [entry.recorded_at for entry in entries]
    if None not in times:
        columns_by_axis["recorded_at"] = hours(times)[:, None]
    return {name: column for name, column in columns_by_axis.items() if np.ptp(column, axis=0).max() > 1e-9}


def agree(name: str, values: Sequence[float | None]) -> bool:
    """Whether values on an axis of a logarithmic scale were meant to be one: they lie within a percent, or none is
    known."""
    known = [value for value in values if value is not None]
    return len(known) in (0, len(values)) and (not known or float(np.ptp(_scaled(name, known))) <= _SAME)


def _scaled(name: str, values: Sequence[float]) -> Floats:
    column = np.array(values, dtype=float)
    return np.asarray(np.log(column) if name in _LOGARITHMIC else np.log1p(column))


def hours(times: list[str | None]) -> Floats:
    """Hours since the first of these times (ISO 8601; UTC where they do not say)."""
    read = [datetime.fromisoformat(str(time).replace("Z", "+00:00")) for time in times]
    known = [time if time.tzinfo else time.replace(tzinfo=UTC) for time in read]
    since = np.array([(time - known[0]).total_seconds() for time in known])
    return (since - since.min()) / 3600


@dataclass(frozen=True)
class Inspected:
    """The recordings that can be used and the findings; what is `lacking` where nothing can be concluded from them.

    `uneven` is how uneven the noise of the lines of time series is, by the recording's id; `unsure` the relative
    uncertainty that noise in their channels leaves of all levels; `beyond` are the ids of
    those whose contacts lie beyond the tables as declared, and within them by a plausible modulus.
    """

    campaign: Campaign
    findings: Sequence[Finding]
    lacking: Lacking | None = None
    uneven: Mapping[str, Floats] = field(default_factory=dict)
    unsure: float = 0.0
    beyond: frozenset[str] = frozenset()


_SAMPLES, _MOST_SAMPLES = 50, 160  # of a curve, before and after blocks are split
_STRAIGHT = 3.0  # standard deviations of χ² about a straight line beyond which a block is split
_LEAST_NOISE = 2e-5  # of the range of force: what numbers written with five digits are good to
_COARSE, _BEYOND_NOISE = 240, 4.0  # samples at which changes of force are summed, standard deviations of noise
_NEAR_JUMP = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64])  # from it, where blocks begin: in samples, or in
# as many of them as hide the travel, since a law of single displacements that are noisy is biased where it bends
_BESIDE = 5  # samples on either side of the deepest one
_STEP = 0.2  # of the larger step of both ways, which the smaller must exceed for their lines to meet in a corner
_RESTS = 1e-3  # of that step: where the deepest samples differ by less, the sphere was held
_SURE = 4.0  # standard deviations
_DISTINCT = 5.0  # standard deviations by which two displacements differ, between which a slope is read


def thinned(
    columns: Sequence[Floats], seen: CurveLandmarks, slow: float, kind: Kind
) -> tuple[list[Floats], Floats, Floats, Floats]:
    """The means of displacement [mm], force [N] and, where there is one, time [s] over blocks (blocks,), the deviation
    of the force's [N], how far along the curve each lies, 0 to 1, and the samples in each; `slow` is what neighbouring
    samples of force share [N]."""
    unsteady = roughness(columns[0])
    columns = _with_corner(_with_still_hold(columns, seen), seen.turn)
    displacement, force = columns[:2]
    way = way_along(displacement, force, seen.noise)
    even = np.searchsorted(way, np.linspace(0.0, 1.0, _SAMPLES, endpoint=False))
    steepness = float(np.ptp(force)) / max(float(displacement.max() - np.median(displacement)), 1e-300)
    unseen = seen.noise / steepness if steepness else float(np.ptp(displacement))  # travel that noise of force hides
    straight = ((force, seen.noise), (displacement, max(unsteady, unseen)))
    starts = _split(np.union1d(even, _around(seen, displacement, force, kind)), straight)
    counts = np.diff(np.append(starts, len(way)))
    *means, place = [np.add.reduceat(column, starts) / counts for column in (*columns, way)]
    unsure = np.zeros(len(starts))
    for number in range(len(columns)):
        sag, doubt = _sag(columns[number], starts, _corners(seen))
        means[number] = means[number] - sag
        unsure = doubt if number == 1 else unsure
    held = (starts >= seen.arrive) & (starts <= seen.leave) & (seen.arrive < seen.turn)
    slope = np.where(held, 0.0, _slopes(means[0], means[1], unsteady / np.sqrt(counts), starts >= seen.turn))
    least = _LEAST_NOISE * float(np.ptp(force))
    deviation = np.sqrt((seen.noise**2 + (slope * unsteady) ** 2) / counts + least**2 + unsure**2 + slow**2)
    return means, deviation, place, counts.astype(float)


def _slopes(displacement: Floats, force: Floats, noise: Floats, back: Mask) -> Floats:
    """How steep the force rises over displacement at each block (blocks,): the lesser of the slopes to either side.

    Each is that to the next block of the same way whose displacement differs by more than its `noise` (blocks,); `back`
    are blocks of the way back. Beside a jump, one side has none; between blocks as close as the noise, a slope would be
    noise too.
    """
    apart = displacement - displacement[:, None]
    distinct = (np.abs(apart) > _DISTINCT * np.hypot(noise, noise[:, None])) & (back == back[:, None])
    number = np.arange(len(displacement))
    after = distinct & (number > number[:, None])
    before = distinct & (number < number[:, None])
    slopes = []
    for beside, other in ((after, after.argmax(axis=1)), (before, number[-1] - before[:, ::-1].argmax(axis=1))):
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.abs((force[other] - force) / (displacement[other] - displacement))
        slopes.append(np.where(beside.any(axis=1), slope, np.inf))
    least = np.minimum(*slopes)
    return np.where(np.isfinite(least), least, 0.0)


def _corners(seen: CurveLandmarks) -> Indices:
    """The first samples of what is not smoothly joined to what was before."""
    places = (seen.snap_in, seen.pull_off, seen.turn, seen.leave)
    return np.unique(np.array([place for place in places if place is not None], dtype=np.intp))


def _sag(column: Floats, starts: Indices, corners: Indices) -> tuple[Floats, Floats]:
    """How far the mean over each block lies beside the column's value in the block's middle, and how surely.

    By the parabola through the means of the block and of those beside it, bent no more than those of its neighbours:
    beside a kink one is bent that the curve is not, and what it would add is doubtful. 0 where a corner lies among
    them.
    """
    ends = np.append(starts[1:], len(column))
    counts = ends - starts
    middle, mean = (starts + ends - 1) / 2, np.add.reduceat(column, starts) / counts
    sag, doubt = np.zeros(len(starts)), np.zeros(len(starts))
    if len(starts) < 3:
        return sag, doubt
    first, second = np.diff(middle[:-1]), np.diff(middle[1:])
    bend = 2 * (np.diff(mean[1:]) / second - np.diff(mean[:-1]) / first) / (first + second)
    beside = np.stack([np.append(bend[1:], bend[-1]), bend, np.append(bend[0], bend[:-1])])
    alike = (np.sign(beside) == np.sign(bend)).all(axis=0)
    limited = np.where(alike, np.sign(bend) * np.abs(beside).min(axis=0), 0.0)
    smooth = ~((corners[:, None] > starts[:-2]) & (corners[:, None] < ends[2:])).any(axis=0)
    unit = np.where(smooth, (counts[1:-1] ** 2 - 1) / 24, 0.0)
    sag[1:-1] = limited * unit
    doubt[1:-1] = np.abs(bend - limited) * unit
    return sag, doubt


def _split(starts: Indices, columns: Sequence[tuple[Floats, float]]) -> Indices:
    """Blocks halved until each column is straight within its noise: a mean over a bend lies beside the curve.

    The most bent ones first, as long as there are not too many.
    """
    while len(starts) < _MOST_SAMPLES:
        ends = np.append(starts[1:], len(columns[0][0]))
        blocks = list(zip(starts, ends, strict=True))
        excess = np.array([max(_bend(one[low:high], noise) for one, noise in columns) for low, high in blocks])
        worst = np.argsort(-excess)[: max(_MOST_SAMPLES - len(starts), 0)]
        worst = worst[excess[worst] > _STRAIGHT]
        if not len(worst):
            break
        starts = np.union1d(starts, (starts[worst] + ends[worst]) // 2)
    return starts


def _bend(force: Floats, noise: float) -> float:
    """How far χ² about a straight line lies above its expectation, in its standard deviations."""
    freedom = len(force) - 2
    if freedom < 1:
        return 0.0
    place = np.arange(len(force)) - (len(force) - 1) / 2
    left = force - force.mean() - place * (place @ force) / (place @ place)
    least = max(noise, _LEAST_NOISE * float(np.abs(force).max()))
    if not least**2 > 0:
        return 0.0
    return float((left @ left) / least**2 - freedom) / np.sqrt(2.0 * freedom)


def _around(seen: CurveLandmarks, displacement: Floats, force: Floats, kind: Kind) -> Indices:
    """The samples with which blocks begin near the jumps, where a force falls steeply, and where the way turns: how
    far a contact has grown is told by single samples; and where contact begins and ends without a jump: a mean over
    that kink lies above the curve."""
    places = _corners(seen)
    if kind == "indentation":
        places = np.concatenate([places, _hidden_jumps(seen, force), _feet(seen, displacement, force)])
    apart = hidden_samples(displacement) * np.concatenate([-_NEAR_JUMP[:0:-1], _NEAR_JUMP])
    near = (places[:, None] + apart).ravel()
    return np.unique(near[(near >= 0) & (near < len(force))])


def _feet(seen: CurveLandmarks, displacement: Floats, force: Floats) -> Indices:
    """Where contact begins, and where it ends, on the ways on which no jump is seen."""
    ways = (
        (seen.snap_in, np.arange(seen.arrive + 1)),
        (seen.pull_off, np.arange(len(force) - 1, seen.leave - 1, -1)),
    )
    feet = [(own, foot(displacement[own], force[own])) for jump, own in ways if jump is None]
    return np.array([own[place] for own, place in feet if place is not None], dtype=np.intp)


def _hidden_jumps(seen: CurveLandmarks, force: Floats) -> Indices:
    """The least force of each way on which no jump is seen, where it lies below the air: there contact may begin or
    end by a jump that noise hides, and means over it would take from the adhesion."""
    ways = (seen.snap_in, 0, seen.turn), (seen.pull_off, seen.turn, len(force))
    least = [first + int(np.argmin(force[first:end])) for jump, first, end in ways if jump is None and first < end]
    return np.array([place for place in least if force[place] < -_SURE * seen.noise], dtype=np.intp)


def _with_still_hold(columns: Sequence[Floats], seen: CurveLandmarks) -> list[Floats]:
    """With the displacement of a hold that is noisy on a straight line.

    Noise of the displacement moves no contact; a law would answer to it, the more the steeper it is.
    """
    whole = [column.copy() for column in columns]
    if seen.arrive < seen.turn:
        held = whole[0][seen.arrive : seen.leave + 1]
        place = np.arange(len(held)) - (len(held) - 1) / 2
        held[:] = held.mean() + place * float(place @ held) / float(place @ place)
    return whole


def _with_corner(columns: Sequence[Floats], turn: int) -> list[Floats]:
    """With the deepest sample where the way in and the way back meet, which was between two samples.

    How far the contact has grown is remembered on all of the way back. By straight lines through the samples on either
    side; as it is where the sphere was held.
    """
    whole = [column.copy() for column in columns]
    displacement = columns[0]
    before, after = np.arange(turn - _BESIDE, turn), np.arange(turn + 1, turn + 1 + _BESIDE)
    if before[0] < 0 or after[-1] >= len(displacement):
        return whole
    lines = [[np.polyfit(side - turn, column[side], 1) for side in (before, after)] for column in columns]
    (rise, high), (fall, low) = lines[0]
    steep = min(rise, -fall) > _STEP * max(rise, -fall)
    rests = displacement[turn] - max(displacement[turn - 1], displacement[turn + 1]) < _RESTS * max(rise, -fall)
    if not steep or rests:
        return whole
    place = (low - high) / (rise - fall)
    peak = high + rise * place
    if abs(place) > 1 or not 0 <= peak - displacement[turn] <= max(rise, -fall):
        return whole
    for column, ((up, at_up), (down, at_down)) in zip(whole, lines, strict=True):
        column[turn] = 0.5 * (at_up + up * place + at_down + down * place)
    return whole


def way_along(displacement: Floats, force: Floats, noise: float) -> Floats:
    """How far along the curve each sample lies, 0 to 1: as much by displacement, by force and by count.

    A sphere's way through the air is long and says little; force counts where it changes by more than its noise.
    """
    coarse = np.linspace(0, len(force) - 1, min(len(force), _COARSE)).round().astype(int)
    steps = np.maximum(np.abs(np.diff(force[coarse])) - _BEYOND_NOISE * noise, 0.0)
    changed = np.interp(np.arange(len(force)), coarse, np.concatenate([[0.0], np.cumsum(steps)]))
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(displacement)))])
    parts = [part / part[-1] for part in (moved, changed, np.arange(len(force), dtype=float)) if part[-1] > 0]
    return np.asarray(sum(parts) / len(parts))


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
    mechanisms: ActiveCatalogue = field(default_factory=ActiveCatalogue)  # that may explain them

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


_READING, _FULL_SCALE = 2e-3, 1e-3  # of a testing machine, whose samples in the air are none
_LEVEL_SD = 0.25  # of the logarithm of the noise's level
_LEAST_SAMPLES = 5
_PLACE = (1.0, 10.0)  # the abscissa: displacement over a curve's range, on this scale
_IN_THE_AIR, _AT_CONTACT = 0.2, 0.7  # of the largest force, what the smooth error counts where there is less
_SURE_STEP = 4.0  # standard deviations
_AIR_BLOCKS, _AIR_SAMPLES = 10, 4  # blocks of samples in the air, and samples of each at least
_AWAY = 0.6  # of the samples in the air: what lies near may belong to a contact
_PLAINLY = 4.0  # times the variance that is expected: by chance in 1 of 4,000, of χ² over 7
_FEW_FOR_ZERO = 0.01  # of the largest force: how well a cell's zero is known that no sample shows


def curve_lines(campaign: Campaign, kind: Kind) -> Lines:
    """The thinned curves of one kind; curves with fewer than five finite samples are left out."""
    entries: list[CurveRecording] = []
    forces, deviations, places, errors = [], [], [], []
    for entry in campaign.recordings:
        if not isinstance(entry, CurveRecording) or entry.kind != kind:
            continue
        columns = finite_samples(entry)
        if len(columns[0]) < _LEAST_SAMPLES:
            continue
        seen = curve_landmarks(*columns)
        force_zero = seen.zero if kind == "indentation" else 0.0
        slow = _slow_noise(seen, columns[1]) if kind == "indentation" else 0.0
        columns[1] = columns[1] - force_zero
        means, deviation, way, counts = thinned(columns, seen, slow, kind)
        displacement, force = means[:2]
        if kind == "compression":
            largest = float(np.abs(force).max())
            deviation = np.sqrt(deviation**2 + (_READING * force) ** 2 + (_FULL_SCALE * largest) ** 2)
        time = means[2] if len(means) > 2 else None
        entries.append(replace(entry, displacement_mm=displacement, force_n=force, time_s=time))
        forces.append(force)
        deviations.append(deviation)
        drift = _drift_in_air(seen, columns[1], columns[2] if len(columns) > 2 else None)
        error = _error(
            kind,
            seen,
            displacement,
            force,
            time,
            way,
            drift,
            (*_straight_lines(columns[1], counts), np.full(len(force), slow)),
        )
        errors.append(error)
        span = float(np.ptp(displacement)) or 1.0
        places.append(_PLACE[0] + (_PLACE[1] - _PLACE[0]) * (displacement - displacement.min()) / span)
    value = _joined(forces)
    deviation = _joined(deviations)
    return Lines(
        campaign=replace(campaign, recordings=tuple(entries)),
        value=value.astype(complex),
        deviation=deviation,
        frequency=_joined(places),
        recording=np.repeat(np.arange(len(forces)), [len(force) for force in forces]).astype(np.intp),
        sensor=np.zeros(len(forces), dtype=np.intp),
        noise=LineNoise(deviation, _LEVEL_SD, 0.0),
        scatter=(0.0, -len(value)),  # a force has no imaginary part
        smooth=CurveError.joined(errors),
    )


def finite_samples(entry: CurveRecording) -> list[Floats]:
    """Displacement [mm], force [N] and, where there is one, time [s] of the samples that have all of them."""
    columns = [entry.displacement_mm, entry.force_n, *([] if entry.time_s is None else [entry.time_s])]
    finite = np.isfinite(np.stack(columns)).all(axis=0)
    return [column[finite] for column in columns]


def _slow_noise(seen: CurveLandmarks, force: Floats) -> float:
    """The standard deviation of noise that neighbouring samples share, which second differences do not see: by how
    much means over blocks in the air, away from the contact, scatter about a parabola, which a drift is, beyond what a
    sample's noise gives; 0 where that is not plain."""
    away = int(_AWAY * len(seen.air))
    air = seen.air[:away] if len(seen.air) and seen.air[0] == 0 else seen.air[len(seen.air) - away :]
    count = len(air) // _AIR_BLOCKS
    if count < _AIR_SAMPLES:
        return 0.0
    means = force[air[: count * _AIR_BLOCKS]].reshape(_AIR_BLOCKS, count).mean(axis=1)
    place = np.arange(_AIR_BLOCKS)
    about = means - np.polyval(np.polyfit(place, means, 2), place)
    variance, expected = float(about @ about) / (_AIR_BLOCKS - 3), seen.noise**2 / count
    return float(np.sqrt(variance - expected)) if variance > _PLAINLY * expected else 0.0


def _straight_lines(force: Floats, counts: Floats) -> tuple[Floats, Floats, Floats]:
    """The samples of each block, the slope [N per sample] of the straight line through them, and the sum of their
    squares about it [N²]."""
    starts = (np.cumsum(counts) - counts).astype(np.intp)
    block = np.repeat(np.arange(len(counts)), counts.astype(np.intp))
    place = np.arange(len(force)) - (starts + (counts - 1) / 2)[block]
    about = force - (np.add.reduceat(force, starts) / counts)[block]
    slope = np.add.reduceat(place * about, starts) / np.maximum(np.add.reduceat(place**2, starts), 0.5)
    return counts, slope, np.add.reduceat((about - slope[block] * place) ** 2, starts)


def _drift_in_air(seen: CurveLandmarks, force: Floats, time: Floats | None) -> float:
    """How far [N] the cell runs off over the whole curve if it goes on as in the air; 0 where no plain drift and no
    snap-in tells the air from the foot of a contact.

    Without times, samples are taken at a steady rate.
    """
    along = np.arange(float(len(force))) if time is None else time
    if seen.drift:
        return abs(seen.drift) * float(np.ptp(along))
    if seen.snap_in is None or not seen.has_air:
        return 0.0
    air = along[seen.air] - along[seen.air].mean()
    square = float(air @ air)
    if not square > 0:
        return 0.0
    slope = abs(float(air @ force[seen.air])) / square
    return slope * float(np.ptp(along)) if slope > _SURE_STEP * seen.noise / np.sqrt(square) else 0.0


def _error(
    kind: Kind,
    seen: CurveLandmarks,
    displacement: Floats,
    force: Floats,
    time: Floats | None,
    way: Floats,
    drift: float,
    samples: tuple[Floats, Floats, Floats, Floats],
) -> CurveError:
    """What the samples of one curve share; `drift` [N] is what the air shows, `samples` as CurveError has them."""
    largest = float(np.abs(force).max()) or 1.0
    if kind == "compression":
        return CurveError(np.full(len(force), largest), way, np.zeros((len(force), 0)), *samples)
    in_air = np.abs(force) < 4 * seen.noise + 1e-3 * largest
    if seen.pull_off is None and seen.snap_in is None:
        in_air &= displacement < displacement[np.argmax(displacement)]
    scale = np.maximum(np.abs(force), np.where(in_air, _IN_THE_AIR, _AT_CONTACT) * largest)
    zero = largest if seen.has_air else _FEW_FOR_ZERO * largest
    # Without times, samples are taken at a steady rate: an hour's drift follows their order, not the travel.
    counts = samples[0]
    order = np.cumsum(counts) - counts / 2
    size = max(USUAL_DRIFT * largest, drift) if seen.has_air else 0.0
    columns = instrument_columns(displacement, order if time is None else time, zero, size)
    return CurveError(scale, way, columns, *samples)


def _joined(columns: Sequence[Floats]) -> Floats:
    return np.concatenate([*columns, np.zeros(0)])
