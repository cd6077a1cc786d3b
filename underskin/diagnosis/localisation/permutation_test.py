"""On which axes the residual depends, by permutation.

A recording's axes: its gain residual, after what the other axes explain (Freedman and Lane 1983), is permuted among
whole recordings, within sensors or within days where there are several. For `frequency_hz` and `phase`, the real and
the imaginary part of the lines' residuals change sign by whole recordings. Each axis' statistic is standardised by its
own permutations; the p-values are those of the largest over all axes, (b + 1)/(B + 1) (Westfall and Young 1993). An
axis with too few arrangements, or that the others determine, is undecidable.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import factorial

import numpy as np

from underskin.diagnosis.data.axes import recording_axes
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.residuals import Residuals
from underskin.diagnosis.selection.frequency_gp import frequency_bins
from underskin.units import Floats, Indices

PERMUTATIONS = 999
SEED = 20180205
_LEAST_ARRANGEMENTS = 40
_ALIASED = 0.98  # share of an axis' functions that the other axes' determine
_MOST_SENSORS = 64  # of which each has a function of its own: time grows with the square of their number
_LEVELS = 6  # up to as many levels an axis is a set of levels, beyond it a polynomial
SIGNIFICANT = 0.05
_WORTH_TELLING = 0.005  # share of the misfit below which an axis is no cause to look for


class Undecidable(StrEnum):
    """Why it cannot be decided whether the residual depends on an axis."""

    FEW_EXCHANGEABLE = "few_exchangeable"
    FEW_RECORDINGS = "few_recordings"
    ALIASED = "aliased"
    FEW_SIGNS = "few_signs"


@dataclass(frozen=True)
class AxisResult:
    """Whether the residual depends on an axis: the p-value, and the share of the misfit that the axis explains.

    `p_value` is None where that is undecidable, for the `reason`; `determined_by` are the axes without any of which
    the others would no longer determine it, where that is the reason.
    """

    axis: str
    p_value: float | None
    share: float
    reason: Undecidable | None = None
    determined_by: Sequence[str] = ()

    @property
    def significant(self) -> bool:
        """Whether the residual depends on it beyond chance."""
        return self.p_value is not None and self.p_value < SIGNIFICANT

    @property
    def telling(self) -> bool:
        """Whether it does so, and with more than a trace of the misfit."""
        return self.significant and self.share >= _WORTH_TELLING


def locate(lines: Lines, residuals: Residuals) -> list[AxisResult]:
    """On which axes the residual depends.

    Parameters
    ----------
    lines : Lines
        The recordings.
    residuals : Residuals
        Of each recording's gain and of each line, against the base model.

    Returns
    -------
    list of AxisResult
        Every axis that the campaign has: first those that are undecidable, then the others with p-values corrected for
        their number.

    Source
    ------
    Freedman and Lane 1983; Westfall and Young 1993.
    """
    random = np.random.default_rng(SEED)
    bases = _bases(lines)
    weight = 1 / residuals.gain_deviation
    blocks = _blocks(lines, bases)
    gain_misfit = float(((residuals.gain * weight) ** 2).sum())
    line_misfit = max(float((residuals.line_weight * np.abs(residuals.line) ** 2).sum()) - 2 * len(residuals.line), 0.0)
    total = gain_misfit + line_misfit
    results = [
        AxisResult(name, None, 0.0, Undecidable.FEW_RECORDINGS)
        for name in recording_axes(lines.campaign)
        if name not in bases
    ]
    statistics: dict[str, Floats] = {}
    for name, basis in bases.items():
        others = [other for key, other in bases.items() if key != name]
        reason = _undecidable(basis, others, blocks[name])
        if reason:
            results.append(AxisResult(name, None, 0.0, reason, _determining(name, bases, reason)))
        else:
            statistics[name] = _freedman_lane(residuals.gain, weight, basis, others, blocks[name], random)
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


def _bases(lines: Lines) -> dict[str, Floats]:
    """Of each axis a few functions over the recordings, their mean taken off; none of too many sensors."""
    bases = {}
    for name, column in recording_axes(lines.campaign).items():
        levels, level = np.unique(np.round(column, 9), axis=0, return_inverse=True)
        if name == "sensor" and len(levels) > _MOST_SENSORS:
            continue
        if name == "sensor" or (len(levels) <= _LEVELS and column.shape[1] == 1):
            basis = np.eye(len(levels))[level.reshape(-1)][:, 1:]
        else:
            scaled = (column - column.mean(axis=0)) / np.maximum(np.ptp(column, axis=0), 1e-12)
            if column.shape[1] == 1:
                basis = np.concatenate([scaled**power for power in (1, 2, 3)], axis=1)
            else:
                distance = np.hypot(*column.T)[:, None]
                basis = np.concatenate([scaled, distance / distance.max(), (distance / distance.max()) ** 2], axis=1)
        bases[name] = basis
    return bases


def _blocks(lines: Lines, bases: dict[str, Floats]) -> dict[str, Indices]:
    """Within which each axis' recordings may be exchanged: sensors, where each has several values of it; else days."""
    none = np.zeros(lines.recordings, dtype=np.intp)
    days = none
    times = [entry.recorded_at for entry in lines.campaign.recordings]
    if None not in times:
        days = np.unique([str(time)[:10] for time in times], return_inverse=True)[1].reshape(-1)
    axes = recording_axes(lines.campaign)
    blocks = {}
    for name in bases:
        if name == "sensor":
            blocks[name] = none
            continue
        varies = [len(np.unique(axes[name][lines.sensor == number], axis=0)) > 1 for number in np.unique(lines.sensor)]
        blocks[name] = lines.sensor if all(varies) else (days if name != "recorded_at" else none)
    return blocks


def _undecidable(basis: Floats, others: list[Floats], blocks: Indices) -> Undecidable | None:
    arrangements = 1.0
    for number in np.unique(blocks):
        arrangements *= float(factorial(min(int((blocks == number).sum()), 20)))
    if arrangements < _LEAST_ARRANGEMENTS:
        return Undecidable.FEW_EXCHANGEABLE
    if others:
        design = np.column_stack([np.ones(len(basis)), *others])
        if design.shape[1] >= len(basis):
            return Undecidable.FEW_RECORDINGS
        if _determined(basis, others):
            return Undecidable.ALIASED
    return None


def _determined(basis: Floats, others: Sequence[Floats]) -> bool:
    """Whether functions of other axes make nearly all of each of an axis' own."""
    design = np.column_stack([np.ones(len(basis)), *others])
    fitted = design @ np.linalg.lstsq(design, basis, rcond=None)[0]
    centred = basis - basis.mean(axis=0)
    left = ((basis - fitted) ** 2).sum(axis=0) / np.maximum((centred**2).sum(axis=0), 1e-300)
    return bool(left.max() < 1 - _ALIASED)


def _determining(name: str, bases: Mapping[str, Floats], reason: Undecidable) -> tuple[str, ...]:
    """The axes without any of which an aliased one would not be determined."""
    if reason is not Undecidable.ALIASED:
        return ()
    others = {key: basis for key, basis in bases.items() if key != name}
    return tuple(
        left_out
        for left_out in others
        if not _determined(bases[name], [basis for key, basis in others.items() if key != left_out])
    )


def _freedman_lane(
    gain: Floats, weight: Floats, basis: Floats, others: list[Floats], blocks: Indices, random: np.random.Generator
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
    every = np.concatenate([residual, residual[_permutations(blocks, random), 0].T], axis=1)
    return ((direction.T @ beyond(every)) ** 2).sum(axis=0)


def _permutations(blocks: Indices, random: np.random.Generator) -> Indices:
    """Orders of the recordings (permutations, recordings), each within its block."""
    drawn = random.random((PERMUTATIONS, len(blocks)))
    permutations = np.empty(drawn.shape, dtype=np.intp)
    permutations[:, np.argsort(blocks, kind="stable")] = np.lexsort((drawn, np.broadcast_to(blocks, drawn.shape)))
    return permutations


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
    statistics = {}
    parts = {"frequency_hz": residuals.line.real, "phase": residuals.line.imag}
    if lines.curves:
        parts = {"displacement_mm": residuals.line.real}
    for name, part in parts.items():
        sums = np.zeros((lines.recordings, len(centres)))
        np.add.at(sums, (lines.recording, line), residuals.line_weight * part)
        statistics[name] = ((signs @ sums) ** 2 / total).sum(axis=1)
    return statistics
