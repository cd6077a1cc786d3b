"""On which axes the residual depends, by permutation, and the smallest region that holds most of it.

A recording's axes: its gain residual, after what the other axes explain (Freedman and Lane 1983), is permuted among
whole recordings, within sensors or within days where there are several. For `frequency_hz` and `phase`, the real and
the imaginary part of the lines' residuals change sign by whole recordings. Each axis' statistic is standardised by its
own permutations; the p-values are those of the largest over all axes, (b + 1)/(B + 1) (Westfall and Young 1993). An
axis with too few arrangements, or that the others determine, is undecidable.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.residuals import Residuals
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.mechanisms.autodiff import Array
from underskin.units import Floats

PERMUTATIONS = 999
SEED = 20180205
_LEAST_ARRANGEMENTS = 40
_ALIASED = 0.98  # share of an axis' functions that the other axes' determine
_LEVELS = 6  # up to as many levels an axis is a set of levels, beyond it a polynomial
_MOST_OF_IT = 0.7
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class AxisResult:
    """`p_value` is None where the axis is undecidable, `reason` says why; `share` of the misfit that it explains."""

    axis: str
    p_value: float | None
    share: float
    reason: str = ""


def locate(lines: Lines, residuals: Residuals) -> list[AxisResult]:
    """Every axis that the campaign has, in the order of the campaign's fields."""
    random = np.random.default_rng(SEED)
    bases = _bases(lines)
    weight = 1 / residuals.gain_deviation
    blocks = _blocks(lines, bases)
    gain_misfit = float(((residuals.gain * weight) ** 2).sum())
    line_misfit = max(float((residuals.line_weight * np.abs(residuals.line) ** 2).sum()) - 2 * len(residuals.line), 0.0)
    total = gain_misfit + line_misfit
    found: list[AxisResult] = []
    statistics: dict[str, Floats] = {}
    shares: dict[str, float] = {}
    for name, basis in bases.items():
        others = [other for key, other in bases.items() if key != name]
        reason = _undecidable(basis, others, blocks[name])
        if reason:
            found.append(AxisResult(name, None, 0.0, reason))
            continue
        explained = _freedman_lane(residuals.gain, weight, basis, others, blocks[name], random)
        statistics[name] = explained
        shares[name] = explained[0] / total
    for name, explained in _sign_flips(lines, residuals, random).items():
        statistics[name] = explained
        shares[name] = explained[0] / total
    largest = [_standardised(values) for values in statistics.values()]
    highest = np.max(largest, axis=0)[1:] if largest else np.zeros(0)
    for name, values in zip(statistics, largest, strict=True):
        beyond = int((highest >= values[0] - 1e-12).sum())
        found.append(AxisResult(name, (beyond + 1) / (PERMUTATIONS + 1), min(shares[name], 1.0)))
    if lines.recordings < 6:
        why = "fewer than 6 recordings, whose signs could be changed"
        found += [AxisResult(name, None, 0.0, why) for name in lines.row_axes]
    return found


def _standardised(values: Floats) -> Floats:
    spread = values[1:].std()
    return (values - values[1:].mean()) / (spread if spread > 0 else 1.0)


def _bases(lines: Lines) -> dict[str, Floats]:
    """Of each axis a few functions over the recordings, their mean taken off."""
    found = {}
    for name, column in recording_axes(lines.campaign).items():
        levels, level = np.unique(np.round(column, 9), axis=0, return_inverse=True)
        if name == "sensor" or (len(levels) <= _LEVELS and column.shape[1] == 1):
            basis = np.eye(len(levels))[level.reshape(-1)][:, 1:]
        else:
            scaled = (column - column.mean(axis=0)) / np.maximum(np.ptp(column, axis=0), 1e-12)
            if column.shape[1] == 1:
                basis = np.concatenate([scaled**power for power in (1, 2, 3)], axis=1)
            else:
                distance = np.hypot(*column.T)[:, None]
                basis = np.concatenate([scaled, distance / distance.max(), (distance / distance.max()) ** 2], axis=1)
        found[name] = basis
    return found


def _blocks(lines: Lines, bases: dict[str, Floats]) -> dict[str, NDArray[np.intp]]:
    """Within which each axis' recordings may be exchanged: sensors, where each has several values of it; else days."""
    none = np.zeros(lines.recordings, dtype=np.intp)
    days = none
    times = [entry.recorded_at for entry in lines.campaign.recordings]
    if None not in times:
        days = np.unique([str(time)[:10] for time in times], return_inverse=True)[1].reshape(-1)
    axes = recording_axes(lines.campaign)
    found = {}
    for name in bases:
        if name == "sensor":
            found[name] = none
            continue
        varies = [len(np.unique(axes[name][lines.sensor == number], axis=0)) > 1 for number in np.unique(lines.sensor)]
        found[name] = lines.sensor if all(varies) else (days if name != "recorded_at" else none)
    return found


def _undecidable(basis: Floats, others: list[Floats], blocks: NDArray[np.intp]) -> str:
    arrangements = 1.0
    for number in np.unique(blocks):
        arrangements *= float(factorial(min(int((blocks == number).sum()), 20)))
    if arrangements < _LEAST_ARRANGEMENTS:
        return "too few recordings that could be exchanged"
    if others:
        design = np.column_stack([np.ones(len(basis)), *others])
        if design.shape[1] >= len(basis):
            return "too few recordings to tell it from the other axes"
        fitted = design @ np.linalg.lstsq(design, basis, rcond=None)[0]
        centred = basis - basis.mean(axis=0)
        left = ((basis - fitted) ** 2).sum(axis=0) / np.maximum((centred**2).sum(axis=0), 1e-300)
        if left.max() < 1 - _ALIASED:
            return "the other axes determine it in this design"
    return ""


def _freedman_lane(
    gain: Floats,
    weight: Floats,
    basis: Floats,
    others: list[Floats],
    blocks: NDArray[np.intp],
    random: np.random.Generator,
) -> Floats:
    """The weighted square explained beyond the other axes: as observed, then under each permutation."""
    reduced = np.column_stack([np.ones(len(gain)), *others]) * weight[:, None]
    left, _, _ = np.linalg.svd(reduced, full_matrices=False)
    left = left[:, : np.linalg.matrix_rank(reduced)]

    def beyond(rows: Floats) -> Floats:
        return rows - left @ (left.T @ rows)

    residual = beyond((gain * weight)[:, None])
    direction, size, _ = np.linalg.svd(beyond(basis * weight[:, None]), full_matrices=False)
    direction = direction[:, size > 1e-8 * size.max()]
    shuffled = np.empty((len(gain), PERMUTATIONS))
    for number in range(PERMUTATIONS):
        shuffled[:, number] = residual[_permutation(blocks, random), 0]
    every = np.concatenate([residual, shuffled], axis=1)
    return ((direction.T @ beyond(every)) ** 2).sum(axis=0)


def _permutation(blocks: NDArray[np.intp], random: np.random.Generator) -> NDArray[np.intp]:
    order = np.lexsort((random.random(len(blocks)), blocks))
    place = np.argsort(blocks, kind="stable")
    permutation = np.empty(len(blocks), dtype=np.intp)
    permutation[place] = order
    return permutation


def _sign_flips(lines: Lines, residuals: Residuals, random: np.random.Generator) -> dict[str, Floats]:
    """For frequency (real part) and phase (imaginary part): the weighted square of the mean over recordings."""
    if lines.recordings < 6 or len(lines.value) < 2 * lines.recordings:
        return {}
    line, centres = frequency_bins(lines.frequency)
    if len(centres) < 2:
        return {}
    total = np.bincount(line, residuals.line_weight, len(centres))
    signs = np.concatenate(
        [np.ones((1, lines.recordings)), random.choice([-1.0, 1.0], (PERMUTATIONS, lines.recordings))]
    )
    found = {}
    parts = {"frequency_hz": residuals.line.real, "phase": residuals.line.imag}
    if lines.curves:
        parts = {"displacement_mm": residuals.line.real}
    for name, part in parts.items():
        sums = np.zeros((lines.recordings, len(centres)))
        np.add.at(sums, (lines.recording, line), residuals.line_weight * part)
        found[name] = ((signs @ sums) ** 2 / total).sum(axis=1)
    return found


def region(lines: Lines, residuals: Residuals, results: list[AxisResult]) -> dict[str, list[float | str]]:
    """The smallest ranges of the two most telling axes that hold most of the misfit; empty where none is telling."""
    telling = [entry for entry in results if entry.p_value is not None and entry.p_value < SIGNIFICANT]
    telling = sorted(telling, key=lambda entry: -entry.share)[:2]
    recording_misfit = (residuals.gain / residuals.gain_deviation) ** 2
    line_misfit = residuals.line_weight * np.abs(residuals.line) ** 2
    if not telling:
        return {}
    by_line = telling[0].axis in lines.row_axes
    misfit = line_misfit if by_line else recording_misfit
    columns = {}
    for entry in telling:
        name = "frequency_hz" if entry.axis == "phase" else entry.axis
        column = axis_values(lines, name, by_line)
        if column is not None:
            columns[name] = column
    kept = np.ones(len(misfit), dtype=bool)
    found: dict[str, list[float | str]] = {}
    for name, column in columns.items():
        chosen = _smallest_range(column[kept], misfit[kept])
        if column.dtype.kind == "U":
            found[name] = [str(chosen[0])]
            kept &= column == chosen[0]
        else:
            found[name] = [float(chosen[0]), float(chosen[1])]
            kept &= (column >= chosen[0]) & (column <= chosen[1])
    return found


def in_region(lines: Lines, ranges: dict[str, list[float | str]]) -> NDArray[np.bool_]:
    """Which rows lie in a region."""
    kept = np.ones(len(lines.value), dtype=bool)
    for name, limits in ranges.items():
        column = axis_values(lines, name, True)
        assert column is not None
        kept &= (column == limits[0]) if len(limits) == 1 else ((column >= limits[0]) & (column <= limits[1]))
    return kept


def reaches_all_along(lines: Lines, name: str, ends: Sequence[float | str]) -> bool:
    """Whether a region holds every value that the campaign has of one of its axes."""
    column = axis_values(lines, name, True)
    assert column is not None
    if column.dtype.kind == "U":
        return bool((column == ends[0]).all())
    return bool(column.min() >= float(ends[0]) and column.max() <= float(ends[1]))


def axis_values(lines: Lines, name: str, by_line: bool) -> Array | None:
    """A field's values in lab units, of each row or of each recording; the distance in mm stands for a position."""
    if name == "frequency_hz":
        return lines.frequency if by_line else None
    entries = lines.campaign.recordings
    if name == "displacement_mm":
        curves = [np.asarray(getattr(entry, name)) for entry in entries]
        return np.concatenate(curves) if by_line else None
    column: Array
    if name == "position_mm":
        x, y = recording_axes(lines.campaign)[name].T
        column = np.round(np.hypot(x, y), 6)
    elif name == "recorded_at":
        column = np.array([str(entry.recorded_at)[:10] for entry in entries])
    else:
        column = np.array([getattr(entry, name) for entry in entries])
    return column[lines.recording] if by_line else column


def _smallest_range(column: Array, misfit: Floats) -> tuple[float | str, float | str]:
    """The contiguous levels, fewest rows, that hold `_MOST_OF_IT` of the misfit; one level where they have no order."""
    levels, level, counts = np.unique(column, return_inverse=True, return_counts=True)
    held = np.bincount(level.reshape(-1), misfit, len(levels))
    if column.dtype.kind == "U":
        worst = str(levels[int(np.argmax(held / counts))])
        return worst, worst
    best = (0, len(levels) - 1)
    fewest = int(counts.sum())
    summed, rows = np.concatenate([[0.0], np.cumsum(held)]), np.concatenate([[0], np.cumsum(counts)])
    for low in range(len(levels)):
        high = int(np.searchsorted(summed, summed[low] + _MOST_OF_IT * summed[-1] - 1e-9 * summed[-1]))
        if high <= len(levels) and high > low and rows[high] - rows[low] < fewest:
            fewest, best = int(rows[high] - rows[low]), (low, high - 1)
    return float(levels[best[0]]), float(levels[best[1]])
