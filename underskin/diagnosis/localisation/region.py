"""The smallest region of the campaign's axes that holds most of the misfit."""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.residuals import Residuals
from underskin.diagnosis.localisation.permutation_test import AxisResult
from underskin.units import Array, Floats, Mask

_MOST_OF_IT = 0.7


def region(lines: Lines, residuals: Residuals, results: list[AxisResult]) -> dict[str, list[float | str]]:
    """The smallest ranges of up to two telling axes that hold most of the misfit; of sensors or days the one where
    it is largest.

    Along the lines it is the lines' misfit that counts, over recordings their gains'.

    Parameters
    ----------
    lines : Lines
        The recordings.
    residuals : Residuals
        As for `locate`.
    results : list of AxisResult
        As `locate` returns them.

    Returns
    -------
    dict
        By axis the two ends of its range in the units of the campaign, or one text; empty where no axis tells.
    """
    telling = sorted((entry for entry in results if entry.telling), key=lambda entry: -entry.share)[:2]
    if not telling:
        return {}
    by_line = telling[0].axis in lines.row_axes
    gain_misfit = (residuals.gain / residuals.gain_deviation) ** 2
    if by_line:
        gain_misfit = (gain_misfit / np.bincount(lines.recording))[lines.recording]
    line_misfit = residuals.line_weight * np.abs(residuals.line) ** 2
    columns = {}
    for entry in telling:
        name = "frequency_hz" if entry.axis == "phase" else entry.axis
        column = axis_values(lines, name, by_line)
        if column is not None:
            columns[name] = column
    inside = np.ones(len(gain_misfit), dtype=bool)
    ranges: dict[str, list[float | str]] = {}
    for name, column in columns.items():
        misfit = line_misfit if name in lines.row_axes else gain_misfit
        chosen = _smallest_range(column[inside], misfit[inside])
        if column.dtype.kind == "U":
            ranges[name] = [str(chosen[0])]
            inside &= column == chosen[0]
        else:
            ranges[name] = [float(chosen[0]), float(chosen[1])]
            inside &= (column >= chosen[0]) & (column <= chosen[1])
    return ranges


def in_region(lines: Lines, ranges: dict[str, list[float | str]]) -> Mask:
    """Which rows lie in a region."""
    inside = np.ones(len(lines.value), dtype=bool)
    for name, limits in ranges.items():
        column = axis_values(lines, name, True)
        assert column is not None
        inside &= (column == limits[0]) if len(limits) == 1 else ((column >= limits[0]) & (column <= limits[1]))
    return inside


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
