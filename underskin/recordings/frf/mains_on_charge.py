"""Mains on the charge of a time series: how much, and the lines that they spoil.

Where mains are not synchronous with the force, the part of the charge that is not coherent with it, 1 − γ² of its
power, stands out at their multiples. Where they are synchronous, because both start anew together, charge is coherent
with force there all the same and γ² shows nothing. Then only the FRF does: one line is off the course of its
neighbours, by the charge of the mains over the force at this line. No law of a skin is as narrow as one line. Outside
the band of such a force, power of the charge beyond the response to the force counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.recordings.frf.mains import HARMONICS, MAINS_HZ
from underskin.recordings.frf.spectral_average import Frf
from underskin.units import Floats, Indices, Mask

_BETWEEN, _AROUND = 2.5, 12.5  # lines from a multiple of the mains: what is usual there
_LEAST_AROUND = 10
_RESPONSE = 4.0  # times the power that the usual FRF gives: a response to the force
_STANDS_OUT = 25.0  # times the median around; a line's noise reaches that once in a million
_SPREAD = 3.0  # lines to each side that the window of neighbouring lines spreads mains over


@dataclass(frozen=True)
class MainsOnCharge:
    """Mains at `mains_hz`: the largest `charge` at one of their multiples (peak) [C], and the lines near any multiple,
    which they may have `spoilt` (lines,)."""

    mains_hz: float
    charge: float
    spoilt: Mask


@dataclass(frozen=True)
class _Indicator:
    """A quantity of each line (lines,) that mains raise: its `value`, the `power` of charge [C²] that it stands for,
    and what `noise` alone makes of it."""

    value: Floats
    power: Floats
    noise: Floats


def mains_on_charge(measured: Frf, powerful: Mask) -> MainsOnCharge | None:
    """The mains at a multiple of which the charge stands out and the force does not.

    None where there are none, or the lines are too coarse to distinguish 50 from 60 Hz. `powerful` (lines,) are the
    lines where the force has its power.
    """
    assert measured.coherence is not None
    assert measured.force_power is not None
    assert measured.charge_power is not None
    assert measured.averages is not None
    incoherent = measured.charge_power * (1 - measured.coherence)
    indicators = [_Indicator(incoherent, incoherent, np.zeros(len(incoherent)))]
    if measured.independent:
        response = _RESPONSE * np.median(np.abs(measured.values[powerful])) ** 2 * measured.force_power
        beyond = np.where(measured.charge_power < response, incoherent, measured.charge_power)
        outside = np.where(powerful, 0.0, beyond)
        indicators += [
            _Indicator(*_off_course(measured, np.flatnonzero(powerful)), noise=incoherent / measured.averages),
            _Indicator(outside, outside, incoherent),
        ]
    candidates = [_of_mains(measured, mains, indicators) for mains in MAINS_HZ]
    outstanding, strongest = max(candidates, key=lambda one: one[0])
    return strongest if outstanding >= _STANDS_OUT else None


def _of_mains(measured: Frf, mains: float, indicators: Sequence[_Indicator]) -> tuple[float, MainsOnCharge]:
    """The largest indicator at a multiple of the mains over what is usual around it, and the lines that are spoilt."""
    assert measured.force_power is not None
    spacing = measured.frequency[0]
    at, spread = (0.999, 0.999) if measured.independent else (1.0, _SPREAD)
    highest, power, spoilt = 0.0, 0.0, np.zeros(len(measured.frequency), dtype=bool)
    for multiple in mains * HARMONICS:
        away = np.abs(measured.frequency - multiple) / spacing
        spoilt |= away <= spread
        near, around = away <= at, (away > _BETWEEN) & (away <= _AROUND)
        if not near.any() or not around.any() or (_BETWEEN * spacing >= np.ptp(MAINS_HZ) and away.min() > 0.01):
            continue
        of_force = max(float(measured.force_power[near].max() / np.median(measured.force_power[around])), 1.0)
        outstanding = max(_over_usual(one, near, around) for one in indicators) / of_force
        if outstanding >= _STANDS_OUT:
            power = max([power, *(float(one.power[near].max()) for one in indicators)])
        highest = max(highest, outstanding)
    return highest, MainsOnCharge(mains, float(np.sqrt(power)), spoilt)


def _over_usual(indicator: _Indicator, near: Mask, around: Mask) -> float:
    """The largest near a multiple over its median around, or over that of its noise; 0 where too few lines have it."""
    usual = indicator.value[around & (indicator.value > 0)]
    if len(usual) < _LEAST_AROUND:
        return 0.0
    return float(indicator.value[near].max() / max(np.median(usual), np.median(indicator.noise[around])))


def _off_course(measured: Frf, rows: Indices) -> tuple[Floats, Floats]:
    """How far each of these lines is off what the two to each side of it predict, as powers of charge [C²].

    First the power that each of the five lines would need for that, then that which the line would need alone; 0 at the
    other lines.

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
