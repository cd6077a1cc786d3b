"""Which lines of the FRF of a time series a diagnosis uses.

- Lines where the force has little power (outside the excited band, between the lines of a periodic sweep) are left
  out: less than a 25th of the power of those lines that hold most of it (the noise of an FRF goes as 1/√power), or
  less than is expected to give a relative standard uncertainty √((1 − γ²)/(2nγ²)) below a fifth. They are used where
  charge follows force well all the same: to a twentieth, to five times the best, and not by chance. The expected
  uncertainty decides, since choosing by the observed one would prefer lines that came out too large.
- Lines that mains spoil are left out.
- Neighbouring lines of blocks of noise are correlated (a Hann window's by 4/9; two apart by 1/36): of two neighbours
  one is used.
- The two lines next to 0 Hz are left out where enough others remain: the straight line removed from each block is a
  part of them and the window mixes them with 0 Hz, so that their FRF is wrong beside the high-pass of an amplifier.
- Of a force that acts once (a single sweep or blow) hardly more than one block holds a line, which the taper cuts
  short where a sweep begins: the first sixteen lines are left out, but not more than half. Lines of a periodic force
  have none of this.
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.screening.mains import MainsOnCharge, mains_on_charge
from underskin.recordings.frf.estimation import Frf
from underskin.units import Floats, Indices, Mask

_UNSURE, _SURE = 0.2, 0.05  # relative uncertainty
_BESIDE_BEST, _BEST = 5.0, 0.1  # the best: this quantile
_BY_CHANCE = 1e-6
_LEAST_LINES = 8  # so that of a record of few lines all are kept
_BIASED, _BIASED_ONCE = 2, 16  # lines, next to 0 Hz
_ONCE = 2.0  # passes; noise has half as many as there are blocks


@dataclass(frozen=True)
class Choice:
    """The `lines` that are used, of `measured` many; how many are left out as `faint` or `beside` others; the `mains`
    that spoil some; how `uneven` the noise of those used is; and whether the force has each but `once`."""

    lines: list[int]
    measured: int
    faint: int = 0
    beside: int = 0
    mains: MainsOnCharge | None = None
    uneven: Floats | None = None
    once: bool = False


def choose_lines(measured: Frf) -> Choice:
    """The choice; no line where charge follows force at none."""
    uncertainty, force = measured.relative_uncertainty, measured.force_power
    lines = list(range(len(measured.frequency)))
    if uncertainty is None or np.isnan(uncertainty).any():
        return Choice(lines, len(lines))
    if force is None:  # tones that the force dwells on: it has its power at each
        return Choice(lines if (uncertainty <= _UNSURE).any() else [], len(lines))
    usual = _usual(force)
    typical = float(np.median(uncertainty[force >= usual]))
    powerful = force >= usual * np.clip((typical / _UNSURE) ** 2, 1 / _BESIDE_BEST**2, 1.0)
    best = float(np.quantile(uncertainty[powerful], _BEST))
    if best > _UNSURE:
        return Choice([], len(lines))
    mains = mains_on_charge(measured, powerful)
    powerful |= (uncertainty <= min(_SURE, _BESIDE_BEST * best)) & _beyond_chance(measured)
    strong = np.flatnonzero(powerful if mains is None else powerful & ~mains.spoilt)
    shared = not measured.independent and len(strong) >= _LEAST_LINES
    once = measured.passes is not None and float(np.median(measured.passes[powerful])) < _ONCE
    biased = min(_BIASED_ONCE, len(strong) // 2) if once else _BIASED
    kept = _apart(strong[strong >= biased]) if shared else [int(line) for line in strong]
    if not kept:  # mains spoil all, where lines are coarse
        return Choice([], len(lines), mains=mains)
    uneven = _uneven(force[kept], uncertainty[kept])
    return Choice(kept, len(lines), int((~powerful).sum()), len(strong) - len(kept), mains, uneven, once)


def _beyond_chance(measured: Frf) -> Mask:
    """Where noise alone would not give this γ²: of n blocks of it, (1 − γ²)^(n − 1) are larger (Carter 1987)."""
    assert measured.coherence is not None
    assert measured.averages is not None
    return np.asarray((1 - measured.coherence) ** (measured.averages - 1) < _BY_CHANCE)


def _usual(power: Floats) -> float:
    """The power of lines that hold half of all, at least."""
    falling = np.sort(power)[::-1]
    return float(falling[np.searchsorted(np.cumsum(falling), 0.5 * falling.sum())])


def _uneven(force: Floats, uncertainty: Floats) -> Floats:
    """The lines' noise over its course along frequency. It goes as a power of the force that a line has: −½ where it is
    noise of the charge, 0 where it is one of the gain."""
    size, noise = np.log(force), np.log(np.maximum(uncertainty, 1e-12))
    size = size - size.mean()
    exponent = float(np.clip(size @ noise / max(size @ size, 1e-12), -0.5, 0.0))
    return np.asarray(np.exp(exponent * size))


def _apart(lines: Indices) -> list[int]:
    """Those of which none is the next to another."""
    kept: list[int] = []
    for line in lines:
        if not kept or line > kept[-1] + 1:
            kept.append(int(line))
    return kept
