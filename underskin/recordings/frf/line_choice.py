"""Which lines of an FRF say something of the response, for d33 and for a diagnosis alike.

Of the FRF of a time series:
- Lines where the force has little power (outside the excited band, between the lines of a periodic sweep) are idle:
  less than a 25th of the power of those lines that hold most of it (the noise of an FRF goes as 1/√power), or less than
  is expected to give a relative standard uncertainty √((1 − γ²)/(2nγ²)) below a fifth. They are used where charge
  follows force well all the same: to a twentieth, to five times the best, and not by chance. The expected uncertainty
  decides, since choosing by the observed one would prefer lines that came out too large.
- So are lines where the force has power, but none that the charge follows: its own noise, or a disturbance. There γ² of
  the lines around tells the uncertainty to be expected, for the same reason.
- Lines that mains spoil are left out.
- The two lines next to 0 Hz are left out where enough others remain: the straight line removed from each block is a
  part of them and the window mixes them with 0 Hz, so that their FRF is wrong beside the high-pass of an amplifier.
- Of a force that acts once (a single sweep or blow) hardly more than one block holds a line, which the taper cuts
  short where a sweep begins: the first sixteen lines are left out, but not more than half. Lines of a periodic force
  have none of this.
What is left is without the bias that noise of the force or the charge gives its estimator (`channel_noise`).

Of FRFs that were imported, with γ², the lines that the force did not excite in most recordings are idle (`excitation`),
and so are those that are exactly 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.recordings.frf.channel_noise import without_noise_bias
from underskin.recordings.frf.excitation import excited_lines
from underskin.recordings.frf.mains_on_charge import MainsOnCharge, mains_on_charge
from underskin.recordings.frf.spectral_average import Frf
from underskin.recordings.frf.stacks import expected_coherence, stacked
from underskin.units import Floats, Indices, Mask

_UNSURE, _SURE = 0.2, 0.05  # relative uncertainty
_BESIDE_BEST, _BEST = 5.0, 0.1  # the best: this quantile
_BY_CHANCE = 1e-6
_LEAST_LINES = 8  # so that of a record of few lines all are kept
_BIASED, _BIASED_ONCE = 2, 16  # lines, next to 0 Hz
_ONCE = 2.0  # passes; noise has half as many as there are blocks


@dataclass(frozen=True)
class Choice:
    """The `lines` that say something, and those that are `idle`; the `mains` that spoil some; how `uneven` the noise of
    those lines is; whether the force has each but `once`, and whether neighbours among them share their noise."""

    lines: Indices
    idle: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    mains: MainsOnCharge | None = None
    uneven: Floats | None = None
    once: bool = False
    shared: bool = False

    @property
    def apart(self) -> Indices:
        """Places among `lines` of those whose noise is independent.

        Neighbouring lines of blocks of noise are correlated (a Hann window's by 4/9; two apart by 1/36): of two
        neighbours one is used.
        """
        if not self.shared:
            return np.arange(len(self.lines))
        places: list[int] = []
        for place, line in enumerate(self.lines.tolist()):
            if not places or line > self.lines[places[-1]] + 1:
                places.append(place)
        return np.array(places, dtype=np.intp)


@dataclass(frozen=True)
class Usable:
    """The idle and the used lines of an FRF, without the bias of its estimator, and the choice that was made of all.

    Where charge follows force at no line all are used, as of a dead sensor, and the choice has none.
    """

    frf: Frf
    choice: Choice


def usable_lines(measured: Sequence[Frf]) -> list[Usable]:
    """The FRFs of recordings of one campaign."""
    imported = [frf for frf in measured if frf.averages is None]
    excited = _excited(imported)
    return [
        _of_lines(frf, excited[frf.frequency.tobytes()]) if frf.averages is None else _of_series(frf)
        for frf in measured
    ]


def _excited(imported: Sequence[Frf]) -> dict[bytes, Mask]:
    """Of each grid of lines those that the force excited."""
    known = [frf for frf in imported if np.isfinite(frf.frequency).all() and (frf.frequency > 0).all()]
    every = {frf.frequency.tobytes(): np.ones(len(frf.frequency), dtype=bool) for frf in imported}
    if not any(np.isfinite(frf.coherence_or_nan).any() for frf in known):
        return every
    stacks = stacked(known)
    frequencies = np.unique(np.concatenate([stack.frequency for stack in stacks]))
    followed = frequencies[excited_lines(stacks, frequencies)]
    return every | {stack.frequency.tobytes(): np.isin(stack.frequency, followed) for stack in stacks}


def _of_lines(frf: Frf, excited: Mask) -> Usable:
    measured = excited & (frf.values != 0)  # an analyzer writes 0 outside its band
    used = measured if measured.any() else np.ones_like(excited)
    return Usable(replace(frf, used=used), Choice(np.flatnonzero(used), np.flatnonzero(~used)))


def _of_series(frf: Frf) -> Usable:
    choice = choose_lines(frf)
    if not len(choice.lines):
        return Usable(frf, choice)
    used = np.isin(np.arange(len(frf.frequency)), choice.lines)
    whole = replace(without_noise_bias(frf, used), used=used)
    return Usable(whole.at(np.sort(np.concatenate([choice.lines, choice.idle]))), choice)


def choose_lines(measured: Frf) -> Choice:
    """The choice of the lines of a time series; no line where charge follows force at none."""
    uncertainty, force = measured.relative_uncertainty, measured.force_power
    every = np.arange(len(measured.frequency))
    none = every[:0]
    if uncertainty is None or np.isnan(uncertainty).any():
        return Choice(every)
    if force is None:  # tones that the force dwells on: it has its power at each
        return Choice(every if (uncertainty <= _UNSURE).any() else none)
    usual = _usual(force)
    typical = float(np.median(uncertainty[force >= usual]))
    powerful = force >= usual * np.clip((typical / _UNSURE) ** 2, 1 / _BESIDE_BEST**2, 1.0)
    best = float(np.quantile(uncertainty[powerful], _BEST))
    if best > _UNSURE:
        return Choice(none)
    powerful[powerful] = _expected(measured, powerful) <= _UNSURE
    powerful |= (uncertainty <= min(_SURE, _BESIDE_BEST * best)) & _beyond_chance(measured)
    if not powerful.any():
        return Choice(none)
    mains = mains_on_charge(measured, powerful)
    strong = np.flatnonzero(powerful if mains is None else powerful & ~mains.spoilt)
    shared = not measured.independent and len(strong) >= _LEAST_LINES
    once = measured.passes is not None and float(np.median(measured.passes[powerful])) < _ONCE
    biased = min(_BIASED_ONCE, len(strong) // 2) if once else _BIASED
    kept = strong[strong >= biased] if shared else strong
    if not len(kept):  # mains spoil all, where lines are coarse
        return Choice(none, mains=mains)
    uneven = _uneven(force[kept], uncertainty[kept])
    return Choice(kept, np.flatnonzero(~powerful & (every >= (biased if shared else 0))), mains, uneven, once, shared)


def _expected(measured: Frf, lines: Mask) -> Floats:
    """The relative uncertainty that γ² of the lines around lets expect of each of these."""
    assert measured.coherence is not None
    assert measured.averages is not None
    around, count = expected_coherence(measured.coherence[lines]), measured.averages[lines]
    true = np.maximum(around - (1 - around) ** 2 / count, 0.0)  # of n blocks γ² is that much too large
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1 - true) / (2 * count * true)))


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
