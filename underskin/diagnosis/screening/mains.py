"""Mains on the charge of a time series: how much, and the lines that they spoil.

Where mains are not synchronous with the force, the part of the charge that is not coherent with it, 1 − γ² of its
power, stands out at their multiples. Where they are synchronous, because both start anew together, charge is coherent
with force there all the same and γ² shows nothing. Then only the FRF does: one line is off the course of its
neighbours, by the charge of the mains over the force at this line. No law of a skin is as narrow as one line. Outside
the band of such a force, power of the charge beyond the response to the force counts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.recordings.frf.estimation import Frf
from underskin.recordings.frf.mains import HARMONICS, MAINS_HZ
from underskin.units import Floats

_BETWEEN, _AROUND = 2.5, 12.5  # lines from a multiple of the mains: what is usual there
_LEAST_AROUND = 10
_ANSWER = 4.0  # times the power that the usual FRF gives: an answer to the force
_STANDS_OUT = 25.0  # times the median around; a line's noise reaches that once in a million
_SPREAD = 3.0  # lines to each side that the window of neighbouring lines spreads mains over


@dataclass(frozen=True)
class Pickup:
    """The `mains` [Hz], the largest `charge` that they put on one of their multiples (peak) [C], and the lines that
    they may spoil (lines,): near any multiple."""

    mains: float
    charge: float
    spoilt: NDArray[np.bool_]


def pickup(measured: Frf, powerful: NDArray[np.bool_]) -> Pickup | None:
    """The mains at a multiple of which the charge stands out and the force does not; None where there are none, or the
    lines are too coarse to tell which. `powerful` (lines,) are those where the force has its power."""
    assert measured.coherence is not None
    assert measured.force_power is not None
    assert measured.charge_power is not None
    stray = measured.charge_power * (1 - measured.coherence)
    assert measured.averages is not None
    signs = [(stray, stray, np.zeros(len(stray)))]
    if measured.independent:
        answer = _ANSWER * np.median(np.abs(measured.values[powerful])) ** 2 * measured.force_power
        beside = np.where(powerful, 0.0, np.where(measured.charge_power < answer, stray, measured.charge_power))
        signs += [
            (*_off_course(measured, np.flatnonzero(powerful)), stray / measured.averages),
            (beside, beside, stray),
        ]
    candidates = [_of_mains(measured, mains, signs) for mains in MAINS_HZ]
    outstanding, strongest = max(candidates, key=lambda one: one[0])
    return strongest if outstanding >= _STANDS_OUT else None


def _of_mains(measured: Frf, mains: float, signs: list[tuple[Floats, Floats, Floats]]) -> tuple[float, Pickup]:
    """How many times what is usual the signs are at a multiple of the mains, at most. A sign of mains (lines,) is what
    is alike from line to line without them, the power [C²] that it stands for, and what noise alone makes of it."""
    assert measured.force_power is not None
    spacing = measured.frequency[0]
    reach, spread = (0.999, 0.999) if measured.independent else (1.0, _SPREAD)
    highest, power, spoilt = 0.0, 0.0, np.zeros(len(measured.frequency), dtype=bool)
    for multiple in mains * HARMONICS:
        away = np.abs(measured.frequency - multiple) / spacing
        spoilt |= away <= spread
        near, around = away <= reach, (away > _BETWEEN) & (away <= _AROUND)
        if not near.any() or not around.any() or (_BETWEEN * spacing >= np.ptp(MAINS_HZ) and away.min() > 0.01):
            continue
        of_force = max(float(measured.force_power[near].max() / np.median(measured.force_power[around])), 1.0)
        outstanding = max(_beyond(sign, noise, near, around) for sign, _, noise in signs) / of_force
        if outstanding >= _STANDS_OUT:
            power = max([power, *(float(one[near].max()) for _, one, _ in signs)])
        highest = max(highest, outstanding)
    return highest, Pickup(mains, float(np.sqrt(power)), spoilt)


def _beyond(sign: Floats, noise: Floats, near: NDArray[np.bool_], around: NDArray[np.bool_]) -> float:
    """How many times its median around, or that of its noise, the largest is; 0 where too few lines around have it."""
    usual = sign[around & (sign > 0)]
    if len(usual) < _LEAST_AROUND:
        return 0.0
    return float(sign[near].max() / max(np.median(usual), np.median(noise[around])))


def _off_course(measured: Frf, rows: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """How far each of these lines is off what the two to each side of it let expect: as the power of the charge that
    each of the five would need for that, and that it would need alone; 0 of the others.

    Expected is the cubic through the four, or where that is nearer, what a single pole (a resonance) leaves between
    them: the quotient of a parabola and 1 + px, whose p makes the third divided difference of y (1 + px) vanish.
    """
    assert measured.force_power is not None
    of_all, alone = np.zeros((2, len(measured.frequency)))
    if len(rows) > 4:
        middle = rows[2:-2]
        beside = np.stack([rows[n : len(rows) - 4 + n] for n in (0, 1, 3, 4)])
        x = (measured.frequency[beside] - measured.frequency[middle]) / measured.frequency[0]
        difference = 1 / np.stack([np.prod(x[n] - np.delete(x, n, axis=0), axis=0) for n in range(4)])
        weight = -np.prod(x, axis=0) * difference / x  # Lagrange's, at the middle
        values, noise = measured.values[beside], 1 / measured.force_power
        below = (difference * values * x).sum(axis=0)
        pole = -(difference * values).sum(axis=0) / np.where(below == 0, np.inf, below)
        cubic = (weight * values).sum(axis=0)
        off = measured.values[middle] - np.stack([cubic, cubic + pole * (weight * values * x).sum(axis=0)])
        square = np.min(np.abs(off) ** 2, axis=0)
        of_all[middle] = square / (noise[middle] + (weight**2 * noise[beside]).sum(axis=0))
        alone[middle] = square / noise[middle]
    return of_all, alone
