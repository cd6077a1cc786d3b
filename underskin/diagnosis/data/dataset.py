"""Recordings as the rows that a diagnosis explains, with their noise.

- `recording_axes`: the conditions on which recordings differ, as numbers.
- `Inspected`: the usable recordings and the findings.
- `Lines` and `lines`: the lines of FRF recordings. A model without frequency has one value a recording, and then the
  recording's lines can be replaced by their weighted mean: with weights 1/d²,
  Σ|y − m|²/d² = Σ|y − ȳ|²/d² + |ȳ − m|²/d̄². `Lines.collapsed` does that, exactly; the first sum, which is the same
  for all such models, is kept in `scatter`.
- `curve_lines`: indentation and compression curves, thinned to means over blocks of neighbouring samples. Blocks are
  even along the curve and shorter towards jumps and the kinks where contact begins and ends. The deviation of a mean
  comes from the samples' noise, estimated from second differences of the force and, times the slope, of the
  displacement. All hypotheses fit the level of the noise, under the same prior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from underskin.diagnosis.noise import (
    USUAL_DRIFT,
    CurveError,
    LineNoise,
    Whitening,
    contact_samples,
    instrument_columns,
    line_noise,
    path_fractions,
)
from underskin.findings.codes import Lacking
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind
from underskin.mechanisms.models.composition import kind_of
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.block_modulus import ZERO_SD
from underskin.recordings.campaign import (
    Campaign,
    CurveRecording,
    FrfRecording,
    Recording,
    frf_recordings,
    offsets,
)
from underskin.recordings.curve_course import (
    CurveLandmarks,
    curve_landmarks,
    foot,
    hidden_samples,
    roughness,
    samples_of,
)
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Complexes, Floats, Indices, Mask

_LOGARITHMIC = ("preload_n", "indenter_radius_mm", "dynamic_force_n")
WORDS = {  # of each axis: its name and unit in sentences
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
    """The axes on which the recordings differ, with one row a recording (recordings, 1 or 2).

    `position_mm` is the contact's position relative to the sensor's centre, `sensor` the sensor's position on the skin
    [mm], `recorded_at` is in hours from the first. An axis is omitted where a recording lacks it or all values agree,
    on a logarithmic scale within a percent.
    """
    recordings = campaign.recordings
    columns_by_axis: dict[str, Floats] = {}
    for name in (*_LOGARITHMIC, *_FROM_ZERO):
        values: list[Any] = [getattr(recording, name, None) for recording in recordings]
        if None in values:
            continue
        if not agree(name, values):
            columns_by_axis[name] = _scaled(name, values)[:, None]
    if frf := campaign.of(FrfRecording):
        columns_by_axis["position_mm"] = 1e3 * offsets(campaign)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
        columns_by_axis["sensor"] = np.array([centres[recording.sensor] for recording in frf])
    times = [recording.recorded_at for recording in recordings]
    if None not in times:
        columns_by_axis["recorded_at"] = hours(times)[:, None]
    return {name: column for name, column in columns_by_axis.items() if np.ptp(column, axis=0).max() > 1e-9}


def agree(name: str, values: Sequence[float | None]) -> bool:
    """Whether values on a logarithmic axis are meant to be equal: they lie within a percent, or none is given."""
    present = [value for value in values if value is not None]
    return len(present) in (0, len(values)) and (not present or float(np.ptp(_scaled(name, present))) <= _SAME)


def _scaled(name: str, values: Sequence[float]) -> Floats:
    column = np.array(values, dtype=float)
    return np.asarray(np.log(column) if name in _LOGARITHMIC else np.log1p(column))


def hours(times: list[str | None]) -> Floats:
    """Hours since the first of these times (ISO 8601; UTC where they have no zone)."""
    read = [datetime.fromisoformat(str(time).replace("Z", "+00:00")) for time in times]
    zoned = [time if time.tzinfo else time.replace(tzinfo=UTC) for time in read]
    since = np.array([(time - zoned[0]).total_seconds() for time in zoned])
    return (since - since.min()) / 3600


@dataclass(frozen=True)
class Inspected:
    """The usable recordings and the findings; `lacking` says why nothing can be concluded from them.

    `uneven`: the relative noise of the lines of time series, by the recording's id; `unsure`: the relative uncertainty
    of all levels by noise in the channels; `beyond`: the ids of recordings whose contacts lie outside the tables as
    declared, and inside them with a plausible modulus.
    """

    campaign: Campaign
    findings: Sequence[Finding]
    lacking: Lacking | None = None
    uneven: Mapping[str, Floats] = field(default_factory=dict)
    unsure: float = 0.0
    beyond: frozenset[str] = frozenset()


_SAMPLES, _MOST_SAMPLES = 50, 160  # of a curve, before and after blocks are split
_STRAIGHT = 3.0  # standard deviations of χ² about a straight line above which a block is split
_LEAST_NOISE = 2e-5  # of the range of force: resolution of numbers with five digits
_NEAR_JUMP = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64])  # first samples of blocks, from a jump: in
# samples, or in steps as large as the noise of the travel, since noisy single displacements bias a non-linear law
_SIDE_SAMPLES = 5  # samples on either side of the deepest one
_STEP = 0.2  # of the larger step of both ways, which the smaller must exceed for their lines to meet in a corner
_RESTS = 1e-3  # of that step: the sphere was held where the deepest samples differ by less
_BELOW_AIR_SDS = 4.0  # standard deviations below the air at which a minimum may be a hidden jump
_DISTINCT = 5.0  # standard deviations by which two displacements differ, between which a slope is read


def thinned(
    columns: Sequence[Floats], seen: CurveLandmarks, slow: float, kind: Kind
) -> tuple[list[Floats], Floats, Floats, Floats]:
    """The means of displacement [mm], force [N] and, if given, time [s] over blocks (blocks,), the deviation of the
    force's [N], the position of each along the curve, 0 to 1, and the number of samples in each; `slow` is the noise
    that neighbouring samples of force share [N]."""
    unsteady = roughness(columns[0])
    columns = _with_corner(_with_still_hold(columns, seen), seen.turn)
    displacement, force = columns[:2]
    path_fraction = path_fractions(displacement, force, seen, kind)
    even = np.searchsorted(path_fraction, np.linspace(0.0, float(path_fraction[-1]), _SAMPLES, endpoint=False))
    steepness = float(np.ptp(force)) / max(float(displacement.max() - np.median(displacement)), 1e-300)
    unseen = seen.noise / steepness if steepness else float(np.ptp(displacement))  # travel within the noise of force
    straight = ((force, seen.noise), (displacement, max(unsteady, unseen)))
    starts = _split(np.union1d(even, _starts_near_corners(seen, displacement, force, kind)), straight)
    counts = np.diff(np.append(starts, len(path_fraction)))
    *means, position = [np.add.reduceat(column, starts) / counts for column in (*columns, path_fraction)]
    sag_deviation = np.zeros(len(starts))
    for number in range(len(columns)):
        sag, doubt = _sag(columns[number], starts, _corners(seen))
        means[number] = means[number] - sag
        sag_deviation = doubt if number == 1 else sag_deviation
    held = (starts >= seen.arrive) & (starts <= seen.leave) & (seen.arrive < seen.turn)
    slope = np.where(held, 0.0, _slopes(means[0], means[1], unsteady / np.sqrt(counts), starts >= seen.turn))
    least = _LEAST_NOISE * float(np.ptp(force))
    deviation = np.sqrt((seen.noise**2 + (slope * unsteady) ** 2) / counts + least**2 + sag_deviation**2 + slow**2)
    before = None if seen.snap_in is None else seen.snap_in - 1
    for event in ((before, seen.snap_in), (seen.detaches, seen.pull_off)) if kind == "indentation" else ():
        if None not in event:  # a sample during it may lie anywhere between
            first, last = np.searchsorted(starts, np.array(event), side="right") - 1
            near = slice(max(min(first, last - 1), 0), last + 1)
            deviation[near] = np.hypot(deviation[near], float(np.ptp(means[1][near])))
    return means, deviation, position, counts.astype(float)


def _slopes(displacement: Floats, force: Floats, noise: Floats, unloading: Mask) -> Floats:
    """The slope of force over displacement at each block (blocks,): the smaller of the slopes to either side.

    Each is that to the next block of the same way (loading or `unloading`) whose displacement differs by more than its
    `noise` (blocks,). At a jump one side has none; between blocks closer than the noise a slope would be noise too.
    """
    separation = displacement - displacement[:, None]
    distinct = (np.abs(separation) > _DISTINCT * np.hypot(noise, noise[:, None])) & (unloading == unloading[:, None])
    number = np.arange(len(displacement))
    after = distinct & (number > number[:, None])
    before = distinct & (number < number[:, None])
    slopes = []
    for neighbours, neighbour in ((after, after.argmax(axis=1)), (before, number[-1] - before[:, ::-1].argmax(axis=1))):
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.abs((force[neighbour] - force) / (displacement[neighbour] - displacement))
        slopes.append(np.where(neighbours.any(axis=1), slope, np.inf))
    least = np.minimum(*slopes)
    return np.where(np.isfinite(least), least, 0.0)


def _corners(seen: CurveLandmarks) -> Indices:
    """The first samples after jumps and corners."""
    samples = (seen.snap_in, seen.detaches, seen.pull_off, seen.turn, seen.leave)
    return np.unique(np.array([sample for sample in samples if sample is not None], dtype=np.intp))


def _sag(column: Floats, starts: Indices, corners: Indices) -> tuple[Floats, Floats]:
    """The difference between the mean over each block and the column's value in the block's middle, and its
    uncertainty.

    From the parabola through the means of the block and its neighbours, with a curvature no larger than theirs: at a
    kink the parabola has a curvature that the curve has not, and that excess counts as uncertainty. 0 where a corner
    lies among them.
    """
    ends = np.append(starts[1:], len(column))
    counts = ends - starts
    middle, mean = (starts + ends - 1) / 2, np.add.reduceat(column, starts) / counts
    sag, uncertainty = np.zeros(len(starts)), np.zeros(len(starts))
    if len(starts) < 3:
        return sag, uncertainty
    first, second = np.diff(middle[:-1]), np.diff(middle[1:])
    curvature = 2 * (np.diff(mean[1:]) / second - np.diff(mean[:-1]) / first) / (first + second)
    neighbours = np.stack([np.append(curvature[1:], curvature[-1]), curvature, np.append(curvature[0], curvature[:-1])])
    alike = (np.sign(neighbours) == np.sign(curvature)).all(axis=0)
    limited = np.where(alike, np.sign(curvature) * np.abs(neighbours).min(axis=0), 0.0)
    smooth = ~((corners[:, None] > starts[:-2]) & (corners[:, None] < ends[2:])).any(axis=0)
    unit = np.where(smooth, (counts[1:-1] ** 2 - 1) / 24, 0.0)
    sag[1:-1] = limited * unit
    uncertainty[1:-1] = np.abs(curvature - limited) * unit
    return sag, uncertainty


def _split(starts: Indices, columns: Sequence[tuple[Floats, float]]) -> Indices:
    """Blocks halved until each column is straight within its noise, as the mean over a curved block is biased.

    The most curved blocks first, up to `_MOST_SAMPLES`.
    """
    while len(starts) < _MOST_SAMPLES:
        ends = np.append(starts[1:], len(columns[0][0]))
        blocks = list(zip(starts, ends, strict=True))
        excess = np.array(
            [max(_curvature_excess(column[low:high], noise) for column, noise in columns) for low, high in blocks]
        )
        worst = np.argsort(-excess)[: max(_MOST_SAMPLES - len(starts), 0)]
        worst = worst[excess[worst] > _STRAIGHT]
        if not len(worst):
            break
        starts = np.union1d(starts, (starts[worst] + ends[worst]) // 2)
    return starts


def _curvature_excess(force: Floats, noise: float) -> float:
    """The excess of χ² about a straight line over its expectation, in standard deviations."""
    freedom = len(force) - 2
    if freedom < 1:
        return 0.0
    offset = np.arange(len(force)) - (len(force) - 1) / 2
    residual = force - force.mean() - offset * (offset @ force) / (offset @ offset)
    least = max(noise, _LEAST_NOISE * float(np.abs(force).max()))
    if not least**2 > 0:
        return 0.0
    return float((residual @ residual) / least**2 - freedom) / np.sqrt(2.0 * freedom)


def _starts_near_corners(seen: CurveLandmarks, displacement: Floats, force: Floats, kind: Kind) -> Indices:
    """The first samples of blocks near jumps, where single samples determine the size of the contact, near the turning
    point, and where contact begins and ends without a jump: a mean over that kink would be too large."""
    samples = _corners(seen)
    if kind == "indentation":
        samples = np.concatenate([samples, _hidden_jumps(seen, force), _feet(seen, displacement, force)])
    sample_offsets = hidden_samples(displacement) * np.concatenate([-_NEAR_JUMP[:0:-1], _NEAR_JUMP])
    near = (samples[:, None] + sample_offsets).ravel()
    return np.unique(near[(near >= 0) & (near < len(force))])


def _feet(seen: CurveLandmarks, displacement: Floats, force: Floats) -> Indices:
    """Where contact begins and ends, on the ways without a visible jump."""
    ways = (
        (seen.snap_in, np.arange(seen.arrive + 1)),
        (seen.pull_off, np.arange(len(force) - 1, seen.leave - 1, -1)),
    )
    feet = [(samples, foot(displacement[samples], force[samples])) for jump, samples in ways if jump is None]
    return np.array([samples[index] for samples, index in feet if index is not None], dtype=np.intp)


def _hidden_jumps(seen: CurveLandmarks, force: Floats) -> Indices:
    """The least force of each way without a visible jump, where it lies below the air: contact may begin or end there
    by a jump that noise hides, and means over it would reduce the adhesion."""
    ways = (seen.snap_in, 0, seen.turn), (seen.pull_off, seen.turn, len(force))
    least = [first + int(np.argmin(force[first:end])) for jump, first, end in ways if jump is None and first < end]
    return np.array([sample for sample in least if force[sample] < -_BELOW_AIR_SDS * seen.noise], dtype=np.intp)


def _with_still_hold(columns: Sequence[Floats], seen: CurveLandmarks) -> list[Floats]:
    """With the displacement of a noisy hold replaced by a straight line.

    Noise of the displacement moves no contact, but a law would respond to it, the more the steeper it is.
    """
    corrected = [column.copy() for column in columns]
    if seen.arrive < seen.turn:
        held = corrected[0][seen.arrive : seen.leave + 1]
        offset = np.arange(len(held)) - (len(held) - 1) / 2
        held[:] = held.mean() + offset * float(offset @ held) / float(offset @ offset)
    return corrected


def _with_corner(columns: Sequence[Floats], turn: int) -> list[Floats]:
    """With the deepest sample at the intersection of loading and unloading, which lay between two samples.

    The largest contact affects all of the unloading. From straight lines through the samples on either side; unchanged
    where the sphere was held.
    """
    corrected = [column.copy() for column in columns]
    displacement = columns[0]
    before, after = np.arange(turn - _SIDE_SAMPLES, turn), np.arange(turn + 1, turn + 1 + _SIDE_SAMPLES)
    if before[0] < 0 or after[-1] >= len(displacement):
        return corrected
    lines = [[np.polyfit(side - turn, column[side], 1) for side in (before, after)] for column in columns]
    (rise, high), (fall, low) = lines[0]
    steep = min(rise, -fall) > _STEP * max(rise, -fall)
    rests = displacement[turn] - max(displacement[turn - 1], displacement[turn + 1]) < _RESTS * max(rise, -fall)
    if not steep or rests:
        return corrected
    corner = (low - high) / (rise - fall)
    peak = high + rise * corner
    if abs(corner) > 1 or not 0 <= peak - displacement[turn] <= max(rise, -fall):
        return corrected
    for column, ((up, at_up), (down, at_down)) in zip(corrected, lines, strict=True):
        column[turn] = 0.5 * (at_up + up * corner + at_down + down * corner)
    return corrected


COLLAPSED_HZ = 30.0  # frequency of a collapsed line; models without frequency do not use it


@dataclass(frozen=True, eq=False)
class Lines:
    """Rows of all recordings one after another, lines of FRFs if not those of `CurveRows`; SI.

    `campaign` holds exactly these rows, so that a model composed for it predicts them. `deviation` is the standard
    deviation of real and of imaginary part each, up to the common factor that every hypothesis fits. `scatter` is the
    remainder of collapsing: Σ|y − ȳ|²/d² and its degrees of freedom. `smooth` is the error that a curve's samples
    share.
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

    curves: ClassVar[bool] = False  # whether the rows are samples of force
    parts: ClassVar[int] = 2  # real and imaginary, of a row
    row_axes: ClassVar[tuple[str, ...]] = ("frequency_hz", "phase")  # along which the rows of a recording run
    level_bounds: ClassVar[tuple[float, float]] = (0.1, 100.0)  # of the common factor of the deviations
    held_out: ClassVar[str] = "recordings"  # what is left out to be predicted, in a sentence

    @property
    def recordings(self) -> int:
        """The number of recordings."""
        return len(self.sensor)

    @cached_property
    def kind(self) -> Kind:
        """The kind of the recordings; all are of one kind."""
        return kind_of(self.campaign)

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
        """Σ|y − ȳ|²/d² about each recording's mean, and the number of real values of the lines, collapsed or not."""
        square, freedom = self.scatter
        weight = self.deviation**-2
        mean = np.add.reduceat(weight * self.value, self.first) / np.add.reduceat(weight, self.first)
        square += float(np.sum(weight * np.abs(self.value - mean[self.recording]) ** 2))
        return square, 2 * len(self.value) + freedom

    @cached_property
    def sensors(self) -> Floats:
        """1 where a recording is of a sensor, else 0 (recordings, sensors)."""
        return np.eye(int(self.sensor.max()) + 1)[self.sensor]

    @cached_property
    def whitening(self) -> Whitening | None:
        """The transformation that makes the samples of curves independent."""
        return None if self.smooth is None else Whitening(self.smooth, self.deviation, self.recording)

    def collapsed(self) -> "Lines":
        """One line a recording, the weighted mean of its lines; their scatter about it goes into `scatter`."""
        weight = self.deviation**-2
        total = np.add.reduceat(weight, self.first)
        mean = np.add.reduceat(weight * self.value, self.first).astype(np.complex128) / total
        square_sum = float(np.sum(weight * np.abs(self.value - mean[self.recording]) ** 2))
        recordings = tuple(
            FrfRecording.of_lines(recording, np.array([COLLAPSED_HZ]), mean[[number]])
            for number, recording in enumerate(frf_recordings(self.campaign))
        )
        return replace(
            self,
            campaign=replace(self.campaign, recordings=recordings),
            value=mean,
            deviation=total**-0.5,
            frequency=np.full(len(mean), COLLAPSED_HZ),
            recording=np.arange(len(mean)),
            scatter=(self.scatter[0] + square_sum, self.scatter[1] + 2 * (len(self.value) - len(mean))),
        )

    def part(self, rows: Mask) -> "Lines":
        """Some of the rows, with the noise that they had; recordings without a row are left out."""
        order = np.flatnonzero(rows)
        indices, first = np.unique(self.recording[order], return_index=True)
        rows_of = dict(zip(indices.tolist(), np.split(order, first[1:]), strict=True))
        return replace(
            self,
            campaign=replace(self.campaign, recordings=tuple(self._with_rows(rows_of))),
            value=self.value[order],
            deviation=self.deviation[order],
            frequency=self.frequency[order],
            recording=np.repeat(np.arange(len(indices)), np.diff([*first, len(order)])),
            sensor=self.sensor[indices],
            scatter=(0.0, 0),
            smooth=None if self.smooth is None else self.smooth.part(order),
        )

    def _with_rows(self, rows: Mapping[int, Indices]) -> list[Recording]:
        """Some of the recordings, by their indices, each with some of its rows."""
        recordings = frf_recordings(self.campaign)
        return [
            FrfRecording.of_lines(recordings[number], self.frequency[part], self.value[part])
            for number, part in rows.items()
        ]


@dataclass(frozen=True, eq=False)
class CurveRows(Lines):
    """Samples of force of curves; none stands for others, and a force has no imaginary part."""

    curves: ClassVar[bool] = True
    parts: ClassVar[int] = 1
    row_axes: ClassVar[tuple[str, ...]] = ("displacement_mm",)
    level_bounds: ClassVar[tuple[float, float]] = (0.3, 5.0)  # larger noise would exceed the differences of neighbours
    held_out: ClassVar[str] = "samples"

    @cached_property
    def about_means(self) -> tuple[float, int]:
        """0, and the number of samples."""
        return 0.0, len(self.value)

    def collapsed(self) -> Lines:
        """The same rows."""
        return self

    def _with_rows(self, rows: Mapping[int, Indices]) -> list[Recording]:
        curves = self.campaign.curves
        return [samples_of(curves[number], part - self.first[number]) for number, part in rows.items()]


def lines(
    campaign: Campaign,
    uneven: Mapping[str, Floats] | None = None,
    predicted: tuple[Lines, Complexes] | None = None,
) -> Lines:
    """The finite FRF lines of a campaign, sorted by frequency.

    `uneven`: of recordings by their id, the noise of each line relative to its trend along frequency (default 1).
    `predicted`: the same lines and a prediction of the rows (rows,), whose change with frequency is no noise. The
    `campaign` of the result holds only the FRF recordings with finite lines.
    """
    measured = []
    for recording in campaign.of(FrfRecording):
        of_recording = lines_of(recording)
        order = np.argsort(of_recording.frequency, kind="stable")
        order = order[np.isfinite(of_recording.values[order]) & np.isfinite(of_recording.frequency[order])]
        if len(order):
            measured.append((recording, of_recording, order))
    value = np.concatenate([*(found.values[order] for _, found, order in measured), np.zeros(0)]).astype(complex)
    frequency = _joined([found.frequency[order] for _, found, order in measured])
    coherence = _joined([found.coherence_or_nan[order] for _, found, order in measured])
    even = [(uneven or {}).get(recording.id, np.ones(len(found.values))) for recording, found, _ in measured]
    unevenness = _joined([column[order] for column, (_, _, order) in zip(even, measured, strict=True)])
    recording_index = np.repeat(np.arange(len(measured)), [len(order) for _, _, order in measured]).astype(np.intp)
    change = None if predicted is None else predicted[1]
    noise = line_noise(value, frequency, recording_index, coherence, unevenness, change)
    if predicted is not None:
        return replace(predicted[0], deviation=noise.deviation, noise=noise)
    numbers = {sensor.id: index for index, sensor in enumerate(campaign.skin.sensors)}
    recordings = tuple(
        FrfRecording.of_lines(recording, found.frequency[order], found.values[order])
        for recording, found, order in measured
    )
    return Lines(
        campaign=replace(campaign, recordings=recordings),
        value=value,
        deviation=noise.deviation,
        frequency=frequency,
        recording=recording_index,
        sensor=np.array([numbers[recording.sensor] for recording in recordings], dtype=np.intp),
        noise=noise,
    )


_READING, _FULL_SCALE = 2e-3, 1e-3  # of a testing machine, without samples in the air
_LEVEL_SD = 0.25  # of the logarithm of the noise's level
_LEAST_SAMPLES = 5
_ABSCISSA_RANGE = (1.0, 10.0)  # the abscissa: displacement over a curve's range, on this scale
_IN_THE_AIR, _AT_CONTACT = 0.2, 0.7  # of the largest force, what the smooth error counts where there is less
_SURE_STEP = 4.0  # standard deviations
_AIR_BLOCKS, _AIR_SAMPLES = 10, 4  # blocks of samples in the air, and samples of each at least
_FAR_SHARE = 0.6  # of the samples in the air: nearer ones may be in contact
_PLAINLY = 4.0  # times the variance that is expected: probability 1/4,000 by chance, of χ² with 7 degrees of freedom
_FEW_FOR_ZERO = 0.01  # of the largest force: uncertainty of a cell's zero without samples in the air


def curve_lines(campaign: Campaign, kind: Kind) -> Lines:
    """The thinned curves of one kind; curves with fewer than five finite samples are left out."""
    curves: list[CurveRecording] = []
    forces, deviations, abscissae, errors = [], [], [], []
    for curve in campaign.curves:
        columns = finite_samples(curve)
        if curve.kind != kind or len(columns[0]) < _LEAST_SAMPLES:
            continue
        seen = curve_landmarks(*columns)
        force_zero = seen.zero if kind == "indentation" else 0.0
        slow = _slow_noise(seen, columns[1]) if kind == "indentation" else 0.0
        columns[1] = columns[1] - force_zero
        means, deviation, path_fraction, counts = thinned(columns, seen, slow, kind)
        displacement, force = means[:2]
        if kind == "compression":
            largest = float(np.abs(force).max())
            deviation = np.sqrt(deviation**2 + (_READING * force) ** 2 + (_FULL_SCALE * largest) ** 2)
        time = means[2] if len(means) > 2 else None
        curves.append(replace(curve, displacement_mm=displacement, force_n=force, time_s=time))
        forces.append(force)
        deviations.append(deviation)
        errors.append(_error(kind, seen, columns, means, path_fraction, counts, slow))
        span = float(np.ptp(displacement)) or 1.0
        abscissae.append(
            _ABSCISSA_RANGE[0] + (_ABSCISSA_RANGE[1] - _ABSCISSA_RANGE[0]) * (displacement - displacement.min()) / span
        )
    value = _joined(forces)
    deviation = _joined(deviations)
    return CurveRows(
        campaign=replace(campaign, recordings=tuple(curves)),
        value=value.astype(complex),
        deviation=deviation,
        frequency=_joined(abscissae),
        recording=np.repeat(np.arange(len(forces)), [len(force) for force in forces]).astype(np.intp),
        sensor=np.zeros(len(forces), dtype=np.intp),
        noise=LineNoise(deviation, _LEVEL_SD, 0.0),
        smooth=CurveError.joined(errors),
    )


def finite_samples(curve: CurveRecording) -> list[Floats]:
    """Displacement [mm], force [N] and, if given, time [s] of the samples where all of these are finite."""
    columns = [curve.displacement_mm, curve.force_n, *([] if curve.time_s is None else [curve.time_s])]
    finite = np.isfinite(np.stack(columns)).all(axis=0)
    return [column[finite] for column in columns]


def _slow_noise(seen: CurveLandmarks, force: Floats) -> float:
    """The standard deviation of noise that neighbouring samples share, which second differences do not show.

    The scatter of means over blocks in the air, away from the contact, about a parabola (a drift), beyond that by the
    samples' noise; 0 where it is not significant.
    """
    count_far = int(_FAR_SHARE * len(seen.air))
    air = seen.air[:count_far] if len(seen.air) and seen.air[0] == 0 else seen.air[len(seen.air) - count_far :]
    block_size = len(air) // _AIR_BLOCKS
    if block_size < _AIR_SAMPLES:
        return 0.0
    means = force[air[: block_size * _AIR_BLOCKS]].reshape(_AIR_BLOCKS, block_size).mean(axis=1)
    block = np.arange(_AIR_BLOCKS)
    about = means - np.polyval(np.polyfit(block, means, 2), block)
    variance, expected = float(about @ about) / (_AIR_BLOCKS - 3), seen.noise**2 / block_size
    return float(np.sqrt(variance - expected)) if variance > _PLAINLY * expected else 0.0


def _straight_lines(force: Floats, counts: Floats) -> tuple[Floats, Floats, Floats]:
    """The number of samples of each block, the slope [N per sample] of the straight line through them, and the sum of
    their squares about it [N²]."""
    starts = (np.cumsum(counts) - counts).astype(np.intp)
    block = np.repeat(np.arange(len(counts)), counts.astype(np.intp))
    offset = np.arange(len(force)) - (starts + (counts - 1) / 2)[block]
    about = force - (np.add.reduceat(force, starts) / counts)[block]
    slope = np.add.reduceat(offset * about, starts) / np.maximum(np.add.reduceat(offset**2, starts), 0.5)
    return counts, slope, np.add.reduceat((about - slope[block] * offset) ** 2, starts)


def _drift_in_air(seen: CurveLandmarks, force: Floats, time: Floats | None = None) -> float:
    """The drift [N] of the cell over the whole curve, extrapolated from the air; 0 without a significant drift, or
    without a snap-in to separate the air from the beginning of contact.

    Without times, a constant sampling rate is assumed.
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
    columns: Sequence[Floats],
    means: Sequence[Floats],
    path_fraction: Floats,
    counts: Floats,
    slow: float,
) -> CurveError:
    """The error that the samples of one curve share, from its samples and their `means`; `slow` [N] is the noise that
    neighbouring samples share."""
    displacement, force = means[:2]
    samples = *_straight_lines(columns[1], counts), np.full(len(force), slow)
    largest = float(np.abs(force).max()) or 1.0
    if kind == "compression":
        of_zero = np.full((len(force), 1), ZERO_SD * largest)
        return CurveError(np.full(len(force), largest), path_fraction, of_zero, *samples)
    in_air = np.abs(force) < 4 * seen.noise + 1e-3 * largest
    if seen.pull_off is None and seen.snap_in is None:
        in_air &= displacement < displacement[np.argmax(displacement)]
    # Without times, a constant sampling rate is assumed: drift follows the order of samples, not the travel.
    order = np.cumsum(counts) - counts / 2
    in_air |= order > contact_samples(columns[0], columns[1], seen)[1]
    scale = np.maximum(np.abs(force), np.where(in_air, _IN_THE_AIR, _AT_CONTACT) * largest)
    zero = largest if seen.has_air else _FEW_FOR_ZERO * largest
    size = max(USUAL_DRIFT * largest, _drift_in_air(seen, *columns[1:])) if seen.has_air else 0.0
    instrument = instrument_columns(displacement, means[2] if len(means) > 2 else order, zero, size)
    return CurveError(scale, path_fraction, instrument, *samples)


def _joined(columns: Sequence[Floats]) -> Floats:
    return np.concatenate([*columns, np.zeros(0)])
