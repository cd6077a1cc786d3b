"""How large the misfit is where it lies: one number in percent, and its 95 % interval.

Over the rows of the region, with weights 1/d²: rms² = (Σ|y − m|²/d² − what noise alone gives)/(Σ|m|²/d²), the noise
being that of lines and of recordings' gains; and the mean along the model, Σ Re m*(y − m)/d² over the same. Where the
misfit has one sign (|mean| at least 0.8 of the rms) the mean stands for it, with that sign; else the rms, which has
none: it is above the model in part of the region and below it in others. The interval is the bootstrap's over whole
recordings.
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.units import Array, Floats, Mask

_ONE_SIGN = 0.8
_DRAWS, _SEED = 1000, 20180207


@dataclass(frozen=True)
class EffectSize:
    """In percent of the base model's response; `signed` where all of the region lies on one side of the model."""

    percent: float
    low: float
    high: float
    signed: bool


def effect(lines: Lines, predicted: Array, rows: Mask, gain: float, level: float) -> EffectSize:
    """The size of the misfit on some rows.

    Parameters
    ----------
    lines : Lines
        The recordings.
    predicted : (rows,) complex array
        The base model's response, in the unit of the lines.
    rows : (rows,) array of bool
        Where the misfit lies.
    gain : float
        Scatter of a recording's gain, relative.
    level : float
        Noise of the lines over their deviations.

    Returns
    -------
    EffectSize
        The misfit with its 95 % interval, in percent of the base model's response.
    """
    weight = lines.deviation[rows] ** -2.0
    off, model = (lines.value - predicted)[rows], predicted[rows]
    _, recording = np.unique(lines.recording[rows], return_inverse=True)

    def summed(column: Floats) -> Floats:
        return np.bincount(recording, column).astype(float)

    parts = 1 if lines.curves else 2
    size = summed(weight * np.abs(model) ** 2)
    noise = parts * level**2 * np.bincount(recording) + gain**2 * size
    square = summed(weight * np.abs(off) ** 2) - noise
    along = summed(weight * (model.conj() * off).real)
    mean, rms = _ratios(square.sum(), along.sum(), size.sum())
    signed = bool(abs(mean) >= _ONE_SIGN * rms)
    drawn = np.random.default_rng(_SEED).integers(len(size), size=(_DRAWS, len(size)))
    means, sizes = _ratios(*(column[drawn].sum(axis=1) for column in (square, along, size)))
    low, high = np.quantile(means if signed else sizes, [0.025, 0.975])
    return EffectSize(100 * float(mean if signed else rms), 100 * float(low), 100 * float(high), signed)


def _ratios(square: Floats, along: Floats, size: Floats) -> tuple[Floats, Floats]:
    return along / size, np.sqrt(np.maximum(square, 0.0) / size)
