"""Where a misfit is: on which axes, in which region, and of which size.

Size: over the rows of the region, with weights 1/d², rms² = (Σ|y − m|²/d² − expected noise)/(Σ|m|²/d²), the noise being
that of lines and of recordings' gains, and mean = Σ Re m*(y − m)/d² over the same. Where the misfit has one sign
(|mean| at least 0.8 of the rms) the signed mean is given, otherwise the rms. The interval is a bootstrap over
recordings.

Axes, by permutation: the gain residual, after what the other axes explain (Freedman and Lane 1983), is permuted among
recordings, within sensors or days where there are several. For `frequency_hz` and `phase` the real and imaginary part
of the lines' residuals change sign by recording. Each statistic is standardised by its own permutations; p-values are
those of the largest over all axes, (b + 1)/(B + 1) (Westfall and Young 1993). An axis with too few arrangements, or
that the others determine, is undecidable.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from underskin.diagnosis.data.dataset import Lines, recording_axes
from underskin.diagnosis.inference.residuals import Residuals
from underskin.units import Array, Floats, Indices, Mask

_ONE_SIGN = 0.8
MOST_LINES = 160  # distinct frequencies, beyond which they are binned
_DRAWS, _SEED = 1000, 20180207


def _bins(frequency: Floats) -> Indices:
    """Of each row the number of its distinct frequency, or of its bin where there are too many (rows,)."""
    distinct, line = np.unique(np.round(frequency, 6), return_inverse=True)
    if len(distinct) <= MOST_LINES:
        return line
    edges = np.geomspace(distinct[0], distinct[-1] * (1 + 1e-9), MOST_LINES + 1)
    line = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, MOST_LINES - 1)
    return np.unique(line, return_inverse=True)[1]


@dataclass(frozen=True)
class EffectSize:
    """The misfit in percent of the base model's response; `signed` where it has one sign over the region."""

    percent: float
    low: float
    high: float
    signed: bool


def effect(lines: Lines, predicted: Array, rows: Mask, gain: float, level: float) -> EffectSize:
    """The misfit on some `rows`, with its 95 % interval, beside the base model's response (rows,) in the unit of the
    lines; `gain` is the relative scatter of recordings' gains, `level` the noise of the lines over their deviations."""
    weight = lines.deviation[rows] ** -2.0
    off, model = (lines.value - predicted)[rows], predicted[rows]
    _, recording = np.unique(lines.recording[rows], return_inverse=True)

    def summed(column: Floats) -> Floats:
        return np.bincount(recording, column).astype(float)

    size = summed(weight * np.abs(model) ** 2)
    noise = lines.parts * level**2 * np.bincount(recording) + gain**2 * size
    square = summed(weight * np.abs(off) ** 2) - noise
    along = summed(weight * (model.conj() * off).real)
    drawn = np.random.default_rng(_SEED).integers(len(size), size=(_DRAWS, len(size)))
    drawn = np.concatenate([np.arange(len(size))[None], drawn])  # as observed, then of each bootstrap
    squares, alongs, sizes = (column[drawn].sum(axis=1) for column in (square, along, size))
    means, rms = 100 * alongs / sizes, 100 * np.sqrt(np.maximum(squares, 0.0) / sizes)
    signed = bool(abs(means[0]) >= _ONE_SIGN * rms[0])
    percent = means if signed else rms
    low, high = np.quantile(percent[1:], [0.025, 0.975]).tolist()
    return EffectSize(float(percent[0]), low, high, signed)


PERMUTATIONS = 999
SEED = 20180205
_LEAST_ARRANGEMENTS = 40
_ALIASED = 0.98  # share of an axis' functions that those of the other axes determine
_MOST_SENSORS = 64  # with one function each: the time grows with the square of their number
_LEVELS = 6  # number of levels up to which an axis is a factor; above it a polynomial
SIGNIFICANT = 0.05
_WORTH_TELLING = 0.005  # share of the misfit below which an axis is not reported as its cause


class Undecidable(StrEnum):
    """Why it cannot be decided whether the residual depends on an axis."""

    FEW_EXCHANGEABLE = "few_exchangeable"
    FEW_RECORDINGS = "few_recordings"
    ALIASED = "aliased"
    FEW_SIGNS = "few_signs"


@dataclass(frozen=True)
class AxisResult:
    """Whether the residual depends on an axis: the p-value, and the share of the misfit that the axis explains.

    `p_value` is None where that is undecidable, for the `reason`. Where that is aliasing, `determined_by` are the axes
    each of which is needed for the others to determine this one.
    """

    axis: str
    p_value: float | None
    share: float
    reason: Undecidable | None = None
    determined_by: Sequence[str] = ()

    @property
    def significant(self) -> bool:
        """Whether the residual depends on the axis beyond chance."""
        return self.p_value is not None and self.p_value < SIGNIFICANT

    @property
    def telling(self) -> bool:
        """Whether it is significant and explains more than a trace of the misfit."""
        return self.significant and self.share >= _WORTH_TELLING


def locate(lines: Lines, residuals: Residuals) -> list[AxisResult]:
    """On which axes of the campaign the residuals against the base model depend: first the undecidable axes, then the
    others, with p-values corrected for their number (Freedman and Lane 1983; Westfall and Young 1993)."""
    random = np.random.default_rng(SEED)
    axes = recording_axes(lines.campaign)
    bases = {name: basis for name, column in axes.items() if (basis := _basis(name, column)) is not None}
    weight = 1 / residuals.gain_deviation
    gain_misfit = float(((residuals.gain * weight) ** 2).sum())
    line_misfit = max(float((residuals.line_weight * np.abs(residuals.line) ** 2).sum()) - 2 * len(residuals.line), 0.0)
    total = gain_misfit + line_misfit
    results = [AxisResult(name, None, 0.0, Undecidable.FEW_RECORDINGS) for name in axes if name not in bases]
    statistics: dict[str, Floats] = {}
    for name, basis in bases.items():
        others, block = {key: other for key, other in bases.items() if key != name}, _block(lines, name, axes[name])
        reason = _undecidable(basis, others, block)
        if reason is None:
            statistics[name] = _freedman_lane(residuals.gain, weight, basis, others, block, random)
            continue
        determining = [
            removed
            for removed in (others if reason is Undecidable.ALIASED else ())
            if not _determined(basis, {key: other for key, other in others.items() if key != removed})
        ]
        results.append(AxisResult(name, None, 0.0, reason, determining))
    statistics |= _sign_flips(lines, residuals, random)
    standardised = [_standardised(values) for values in statistics.values()]
    highest = np.max(standardised, axis=0)[1:] if standardised else np.zeros(0)
    for (name, explained), values in zip(statistics.items(), standardised, strict=True):
        beyond = int((highest >= values[0] - 1e-12).sum())
        results.append(AxisResult(name, (beyond + 1) / (PERMUTATIONS + 1), min(explained[0] / total, 1.0)))
    if lines.recordings < 6:
        results += [AxisResult(name, None, 0.0, Undecidable.FEW_SIGNS) for name in lines.row_axes]
    return results


def _standardised(values: Floats) -> Floats:
    spread = values[1:].std()
    return (values - values[1:].mean()) / (spread if spread > 0 else 1.0)


def _basis(name: str, column: Floats) -> Floats | None:
    """A few functions of an axis (recordings, coordinates) over the recordings (recordings, functions); None for too
    many sensors."""
    levels, level = np.unique(np.round(column, 9), axis=0, return_inverse=True)
    if name == "sensor" and len(levels) > _MOST_SENSORS:
        return None
    if name == "sensor" or (len(levels) <= _LEVELS and column.shape[1] == 1):
        return np.eye(len(levels))[level.reshape(-1)][:, 1:]
    scaled = (column - column.mean(axis=0)) / np.maximum(np.ptp(column, axis=0), 1e-12)
    if column.shape[1] == 1:
        return np.concatenate([scaled**power for power in (1, 2, 3)], axis=1)
    distance = np.hypot(*column.T)[:, None]
    return np.concatenate([scaled, distance / distance.max(), (distance / distance.max()) ** 2], axis=1)


def _block(lines: Lines, name: str, column: Floats) -> Indices:
    """The block of each recording, within which recordings may be permuted for an axis: the sensor, where each has
    several values of the axis, otherwise the day."""
    sensors = np.unique(lines.sensor)
    times = [recording.recorded_at for recording in lines.campaign.recordings]
    if name != "sensor" and all(len(np.unique(column[lines.sensor == sensor], axis=0)) > 1 for sensor in sensors):
        return lines.sensor
    if name in ("sensor", "recorded_at") or None in times:
        return np.zeros(lines.recordings, dtype=np.intp)
    return np.unique([str(time)[:10] for time in times], return_inverse=True)[1].reshape(-1)


def _undecidable(basis: Floats, others: Mapping[str, Floats], blocks: Indices) -> Undecidable | None:
    sizes = np.unique(blocks, return_counts=True)[1].tolist()
    if math.prod(float(math.factorial(min(size, 20))) for size in sizes) < _LEAST_ARRANGEMENTS:
        return Undecidable.FEW_EXCHANGEABLE
    if others and 1 + sum(other.shape[1] for other in others.values()) >= len(basis):
        return Undecidable.FEW_RECORDINGS
    return Undecidable.ALIASED if others and _determined(basis, others) else None


def _determined(basis: Floats, others: Mapping[str, Floats]) -> bool:
    """Whether the functions of other axes determine nearly all of each function of an axis."""
    design = np.column_stack([np.ones(len(basis)), *others.values()])
    fitted = design @ np.linalg.lstsq(design, basis, rcond=None)[0]
    centred = basis - basis.mean(axis=0)
    unexplained = ((basis - fitted) ** 2).sum(axis=0) / np.maximum((centred**2).sum(axis=0), 1e-300)
    return bool(unexplained.max() < 1 - _ALIASED)


def _freedman_lane(
    gain: Floats,
    weight: Floats,
    basis: Floats,
    others: Mapping[str, Floats],
    blocks: Indices,
    random: np.random.Generator,
) -> Floats:
    """The weighted sum of squares explained beyond the other axes: as observed, then under each permutation."""
    reduced = np.column_stack([np.ones(len(gain)), *others.values()]) * weight[:, None]
    reduced_basis, _, _ = np.linalg.svd(reduced, full_matrices=False)
    reduced_basis = reduced_basis[:, : np.linalg.matrix_rank(reduced)]

    def beyond(rows: Floats) -> Floats:
        return rows - reduced_basis @ (reduced_basis.T @ rows)

    residual = beyond((gain * weight)[:, None])
    direction, size, _ = np.linalg.svd(beyond(basis * weight[:, None]), full_matrices=False)
    direction = direction[:, size > 1e-8 * size.max()]
    every = np.concatenate([residual, residual[_permutations(blocks, random), 0].T], axis=1)
    return ((direction.T @ beyond(every)) ** 2).sum(axis=0)


def _permutations(blocks: Indices, random: np.random.Generator) -> Indices:
    """Orders of the recordings (permutations, recordings), each within its block."""
    drawn = random.random((PERMUTATIONS, len(blocks)))
    permutations = np.empty(drawn.shape, dtype=np.intp)
    permutations[:, np.argsort(blocks, kind="stable")] = np.lexsort((drawn, np.broadcast_to(blocks, drawn.shape)))
    return permutations


def _sign_flips(lines: Lines, residuals: Residuals, random: np.random.Generator) -> dict[str, Floats]:
    """For frequency (real part) and phase (imaginary part), the weighted square of the mean over recordings: as
    observed, then under each change of signs."""
    if lines.recordings < 6 or len(lines.value) < 2 * lines.recordings:
        return {}
    line = _bins(lines.frequency)
    count = int(line.max()) + 1
    if count < 2:
        return {}
    total = np.bincount(line, residuals.line_weight)
    signs = np.concatenate(
        [np.ones((1, lines.recordings)), random.choice([-1.0, 1.0], (PERMUTATIONS, lines.recordings))]
    )
    statistics = {}
    for name, part in zip(lines.row_axes, (residuals.line.real, residuals.line.imag), strict=False):
        sums = np.zeros((lines.recordings, count))
        np.add.at(sums, (lines.recording, line), residuals.line_weight * part)
        statistics[name] = ((signs @ sums) ** 2 / total).sum(axis=1)
    return statistics


_MOST_OF_IT = 0.7


def region(lines: Lines, residuals: Residuals, results: list[AxisResult]) -> dict[str, list[float | str]]:
    """The smallest ranges of up to two significant axes that hold most of the misfit; of sensors or days the one where
    it is largest.

    The misfit is that of the lines for axes of the lines, and that of the gains for axes of the recordings. By axis the
    two ends of its range in the units of the campaign, or one text; empty where no axis is significant.
    """
    telling = sorted((result for result in results if result.telling), key=lambda result: -result.share)[:2]
    if not telling:
        return {}
    by_line = telling[0].axis in lines.row_axes
    gain_misfit = (residuals.gain / residuals.gain_deviation) ** 2
    if by_line:
        gain_misfit = (gain_misfit / np.bincount(lines.recording))[lines.recording]
    line_misfit = residuals.line_weight * np.abs(residuals.line) ** 2
    inside = np.ones(len(gain_misfit), dtype=bool)
    ranges: dict[str, list[float | str]] = {}
    for name in dict.fromkeys("frequency_hz" if result.axis == "phase" else result.axis for result in telling):
        column = axis_values(lines, name, by_line)
        if column is not None:
            misfit = line_misfit if name in lines.row_axes else gain_misfit
            ranges[name] = _smallest_range(column[inside], misfit[inside])
            inside &= _within(column, ranges[name])
    return ranges


def _within(column: Array, ends: Sequence[float | str]) -> Mask:
    """Which values lie between two ends, or are one text."""
    return np.asarray(column == ends[0] if len(ends) == 1 else (column >= ends[0]) & (column <= ends[1]))


def in_region(lines: Lines, ranges: dict[str, list[float | str]]) -> Mask:
    """Which rows lie in a region."""
    inside = np.ones(len(lines.value), dtype=bool)
    for name, limits in ranges.items():
        column = axis_values(lines, name, True)
        assert column is not None
        inside &= _within(column, limits)
    return inside


def reaches_all_along(lines: Lines, name: str, ends: Sequence[float | str]) -> bool:
    """Whether a region holds all values of one of its axes in the campaign."""
    column = axis_values(lines, name, True)
    assert column is not None
    return bool(_within(column, ends).all())


def axis_values(lines: Lines, name: str, by_line: bool) -> Array | None:
    """A field's values in lab units, by row or by recording; of a position the distance [mm]."""
    if name == "frequency_hz":
        return lines.frequency if by_line else None
    recordings = lines.campaign.recordings
    if name == "displacement_mm":
        curves = [np.asarray(getattr(recording, name)) for recording in recordings]
        return np.concatenate(curves) if by_line else None
    column: Array
    if name == "position_mm":
        x, y = recording_axes(lines.campaign)[name].T
        column = np.round(np.hypot(x, y), 6)
    elif name == "recorded_at":
        column = np.array([str(recording.recorded_at)[:10] for recording in recordings])
    else:
        column = np.array([getattr(recording, name) for recording in recordings])
    return column[lines.recording] if by_line else column


def _smallest_range(column: Array, misfit: Floats) -> list[float | str]:
    """The contiguous levels with the fewest rows that hold `_MOST_OF_IT` of the misfit; one level of an axis without
    order."""
    levels, level, counts = np.unique(column, return_inverse=True, return_counts=True)
    held = np.bincount(level.reshape(-1), misfit, len(levels))
    if column.dtype.kind == "U":
        return [str(levels[int(np.argmax(held / counts))])]
    best = (0, len(levels) - 1)
    fewest = int(counts.sum())
    summed, rows = np.concatenate([[0.0], np.cumsum(held)]), np.concatenate([[0], np.cumsum(counts)])
    for low in range(len(levels)):
        high = int(np.searchsorted(summed, summed[low] + _MOST_OF_IT * summed[-1] - 1e-9 * summed[-1]))
        if high <= len(levels) and high > low and rows[high] - rows[low] < fewest:
            fewest, best = int(rows[high] - rows[low]), (low, high - 1)
    return [float(levels[end]) for end in best]
