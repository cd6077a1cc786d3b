"""Which lines of an estimated FRF count.

Where mains put charge on the leads of a sensor: at their frequency and its harmonics.

Which lines of FRFs the force excited: those at which the charge follows it, as the coherence tells.

Lines are gathered in bins of equal width in log f. Those of a bin whose median coherence is low were not excited, but
for the few among them whose own is high: a force of a few sines excites one line in many.

Mains on the charge of a time series: how much, and the lines that they spoil.

Where mains are not synchronous with the force, the part of the charge that is not coherent with it, 1 − γ² of its
power, stands out at their multiples. Where they are synchronous, because both start anew together, charge is coherent
with force there all the same and γ² shows nothing. Then only the FRF does: one line is off the course of its
neighbours, by the charge of the mains over the force at this line. No law of a skin is as narrow as one line. Outside
the band of such a force, power of the charge beyond the response to the force counts.

Noise in the channels of force and charge, and what it makes of an FRF: an error-in-variables estimate.

With white noise of power m in the force and k in the charge, uncorrelated with all else, each line has (Bendat and
Piersol, Random Data, chapters 6 and 7)
    γ² = (1 − m/S_ff) (1 − k/S_qq)    H1 = H (1 − m/S_ff)    H2 = H/(1 − k/S_qq).
m and k are no larger than the least of S_ff and S_qq over the lines, and of many lines with different S_ff and S_qq γ²
tells which is which: where the force was not excited S_ff is m itself. Both have a uniform prior up to these bounds.
The FRF is then the total least-squares line with κ = k/m, and what the posterior leaves open is in its uncertainty; H2,
which somebody chose who knows the force to be noisy, is H2 (1 − k/S_qq). Where the lines' loss of coherence is more
than white noise explains (a disturbance inside the band), it may lie in either channel, so that H lies from H1 to H2.

Which lines of an FRF say something of the response, for d33 and for a diagnosis alike.

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
What is left is without the bias that noise of the force or the charge gives its estimator.

Of FRFs that were imported, with γ², the lines that the force did not excite in most recordings are idle (`excitation`),
and so are those that are exactly 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.frf.spectra import Frf, Stack, expected_coherence, information, stacked
from underskin.units import Floats, Indices, Mask

MAINS_HZ = (50.0, 60.0)
HARMONICS = np.arange(1, 6)  # 1: the fundamental
HARMONIC_WIDTH_HZ = 3.0  # from a harmonic: windows and the drift of mains make lines that wide


_BINS_PER_DECADE = 12
_LEAST_COHERENCE = 0.5  # of bins whose lines count as excited
_CLEAR_COHERENCE = 0.9  # of a line that does among others that do not: noise alone hardly reaches it


def excited_lines(stacks: Sequence[Stack], frequencies: Floats) -> Mask:
    """At which lines the charge follows the force.

    Parameters
    ----------
    stacks : sequence of Stack
        The FRFs, with their coherence γ², NaN where it is not known.
    frequencies : (lines,) array
        [Hz] all that the stacks have, rising and above 0.

    Returns
    -------
    (lines,) mask
        By the median γ² of a line's bin, or clearly by that of its own; also where none is known, and at all lines
        where it follows at none. Of an even number of γ² the lower middle one counts: a bin of which half was excited
        is judged line by line.
    """
    line = np.concatenate(
        [np.broadcast_to(np.searchsorted(frequencies, one.frequency), one.coherence.shape).ravel() for one in stacks]
    )
    coherence = np.concatenate([one.coherence.ravel() for one in stacks])
    line, coherence = line[np.isfinite(coherence)], coherence[np.isfinite(coherence)]
    edges = edges_over(frequencies)
    bins = bin_of(frequencies, edges)
    of_bins = _lower_medians(bins[line], coherence, len(edges) - 1)
    of_lines = _lower_medians(line, coherence, len(frequencies))
    follows = ~(of_bins[bins] < _LEAST_COHERENCE) | (of_lines >= _CLEAR_COHERENCE)
    return follows if follows.any() else np.ones_like(follows)


def edges_over(frequencies: Floats) -> Floats:
    """The edges [Hz] (bins + 1,) of bins of equal width in log f from the first of the frequencies to the last."""
    decades = float(np.log10(frequencies[-1] / frequencies[0]))
    return np.geomspace(frequencies[0], frequencies[-1], max(1, round(_BINS_PER_DECADE * decades)) + 1)


def bin_of(frequency: Floats, edges: Floats) -> Indices:
    """The number of each frequency's bin, of the same shape."""
    return np.asarray(np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, len(edges) - 2))


def _lower_medians(group: Indices, values: Floats, groups: int) -> Floats:
    """The lower median of the values of each group (groups,); NaN of those without any."""
    medians = np.full(groups, np.nan)
    order = np.argsort(group, kind="stable")
    known, first = np.unique(group[order], return_index=True)
    parts = np.split(values[order], first[1:])
    medians[known] = [np.sort(part)[(len(part) - 1) // 2] for part in parts] if len(known) else []
    return medians


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


_LEAST_LOSS = 2e-3  # 1 − γ² of the lines that are used: below, H1 and H2 differ by less
_FEWEST_LINES, _FEWEST_AVERAGES = 16, 3.0
_NODES = 33  # of each noise's share of its bound
_WORST = 0.9  # of a line's power, that may be taken for noise
_MODEL = 5e-3  # of γ², that leakage and other defects of an estimate make
_CORRELATED = 2.0  # neighbouring lines of Hann's window that tell as much as one
_TINY = float(np.finfo(float).tiny)
_TOGETHER = 16  # lines
_MARGIN = 1.3  # that a group's power may lie below its mean: three standard deviations of 8 blocks and 16 lines
_WORTH_SAYING = 0.01  # of the FRF


def without_noise_bias(measured: Frf, used: Mask) -> Frf:
    """The FRF without the bias by noise of its estimator, which was `bias`, and the uncertainty `bias_unsure` that is
    left, both of the lines that are `used` (lines,).

    As it is where their coherence is nearly 1, or where power or γ² is not known.
    """
    force, charge, coherence, averages = (
        measured.force_power, measured.charge_power, measured.coherence, measured.averages
    )  # fmt: skip
    if force is None or charge is None or coherence is None or averages is None or measured.passes is None:
        return measured
    count = np.minimum(averages, measured.passes)
    known = np.isfinite(coherence) & (force > 0) & (charge > 0) & (count > 1)
    used = used & known
    if used.sum() < 1 or known.sum() < _FEWEST_LINES or float(np.median(averages)) < _FEWEST_AVERAGES:
        return measured
    weight = information(expected_coherence(coherence[used]))
    weight /= weight.sum()
    true_coherence = coherence - (1 - coherence) ** 2 / np.maximum(count, 1.0)  # of n blocks γ² is that much too large
    loss = float(weight @ (1 - true_coherence[used]))
    if loss < _LEAST_LOSS:
        return measured
    noise = _posterior(force, charge, coherence, count, _groups(used, known))
    in_force = np.minimum(noise.force / force, _WORST)
    in_charge = np.minimum(noise.charge / charge, _WORST)
    if measured.estimator == "H2":
        size = np.sqrt(charge / np.maximum(coherence * force, _TINY)) * (1 - in_charge)
        sensitive = noise.charge_sd / charge
    elif noise.force == noise.charge == 0.0:
        return replace(measured, bias_unsure=loss / float(np.sqrt(3.0)))
    else:
        size = _total_least_squares(force, charge, coherence, noise)
        sensitive = noise.force_sd / force
    raw = np.abs(measured.values)
    factor = np.where(known & (raw > 0), size / np.where(raw > 0, raw, 1.0), 1.0)
    explained = float(weight @ (1 - (1 - in_force[used]) * (1 - in_charge[used])))
    unexplained = max(loss - explained, 0.0)
    unsure = float(np.hypot(weight @ sensitive[used], unexplained / np.sqrt(3.0)))
    bias = float(weight @ (1 / factor[used] - 1))
    return replace(measured, values=measured.values * factor, bias=bias, bias_unsure=unsure)


def _total_least_squares(force: Floats, charge: Floats, coherence: Floats, noise: "_Noise") -> Floats:
    """|FRF| of the line through (F, Q), whose noise has these powers: Hv of `estimators` with κ = k/m known, which is
    H1 for m = 0 and H2 for k = 0."""
    unit_force, unit_charge = float(force.max()), float(charge.max())  # N²/Hz, C²/Hz: their squares underflow
    force, charge = force / unit_force, charge / unit_charge
    of_force, of_charge = noise.force / unit_force, noise.charge / unit_charge
    cross = np.sqrt(np.maximum(coherence, _TINY) * force * charge)
    difference = of_force * charge - of_charge * force
    root = np.sqrt(difference**2 + 4 * of_force * of_charge * cross**2)
    above = (difference + root) / (2 * max(of_force, _TINY) * cross)
    beneath = 2 * of_charge * cross / np.maximum(root - difference, _TINY)
    return np.where(difference > 0, above, beneath) * np.sqrt(unit_charge / unit_force)


class _Noise:
    """Means and standard deviations of the powers of noise."""

    def __init__(self, force: Floats, charge: Floats, weight: Floats) -> None:
        of_force, of_charge = weight.sum(axis=1), weight.sum(axis=0)
        self.force, self.charge = float(force @ of_force), float(charge @ of_charge)
        self.force_sd = float(np.sqrt(max(force**2 @ of_force - self.force**2, 0.0)))
        self.charge_sd = float(np.sqrt(max(charge**2 @ of_charge - self.charge**2, 0.0)))


def _posterior(force: Floats, charge: Floats, coherence: Floats, count: Floats, groups: Sequence[Indices]) -> _Noise:
    """That of the noise of both channels, from powers, γ² as estimated and the number of blocks of lines (lines,), on a
    grid up to the least power that any group of lines has and the least share of it that its loss of coherence allows.

    Over the lines of a group γ² is Σ |S_fq|²/Σ S_ff S_qq. Of n blocks the expected sums are those of the spectra times
    γ² + 1/n and 1 + γ²/n.
    """
    product = force * charge
    sums = np.array([[part[own].sum() for part in (product, coherence * product, force, charge)] for own in groups])
    lines = np.array([len(own) for own in groups])
    blocks = np.array([float(np.mean(count[own])) for own in groups])
    seen = sums[:, 1] / sums[:, 0]
    true = np.clip((seen - 1 / blocks) / (1 - seen / blocks), 0.0, 1.0)
    inverse_force, inverse_charge = sums[:, 3] / sums[:, 0], sums[:, 2] / sums[:, 0]  # 1/S_ff and 1/S_qq of a group
    independent = np.maximum(lines / _CORRELATED, 1.0)
    variance = (2 * true + 1 / blocks) * (1 - true) ** 2 / (blocks * independent) + _MODEL**2
    loss = 1 - true + 3 * np.sqrt(variance)  # of coherence: no noise takes a larger share of a group's power
    most_force, most_charge = (
        min(_MARGIN / float(inverse.max()), float((loss / inverse).min()))
        for inverse in (inverse_force, inverse_charge)
    )
    shares = np.linspace(0.0, 1.0, _NODES)
    of_force = 1 - np.minimum(np.outer(shares, most_force * inverse_force), 1.0)
    of_charge = 1 - np.minimum(np.outer(shares, most_charge * inverse_charge), 1.0)
    gap = np.abs(true - of_force[:, None] * of_charge[None]) / np.sqrt(variance)
    misfit = np.where(gap < 3.0, gap**2, 6.0 * gap - 9.0).sum(axis=2)
    common = float((_MODEL**2 / variance).sum())  # groups for one, where all share the defect of the estimate
    excess = max(float(misfit.min()) / len(groups), common, 1.0)
    weight = np.exp(-0.5 * (misfit - misfit.min()) / excess)
    return _Noise(shares * most_force, shares * most_charge, weight / weight.sum())


def _groups(used: Mask, known: Mask) -> list[Indices]:
    """Neighbours among the lines that are used, and among the others: powers of single lines are too unsure, and where
    few lines were excited those beside them have others."""
    groups: list[Indices] = []
    for lines in (np.flatnonzero(used), np.flatnonzero(known & ~used)):
        if len(lines):
            groups += np.array_split(lines, max(1, len(lines) // _TOGETHER))
    return groups


def noise_findings(measured: Sequence[Frf]) -> list[Finding]:
    """What noise made of FRFs, where it is worth saying: of the median recording."""
    biased = [frf for frf in measured if frf.bias or frf.bias_unsure]
    if 2 * len(biased) <= len(measured):
        return []
    bias, unsure = (float(np.median([getattr(frf, name) for frf in biased])) for name in ("bias", "bias_unsure"))
    if max(abs(bias), unsure) < _WORTH_SAYING:
        return []
    arguments = {"percent": 100 * bias, "estimator": biased[0].estimator, "unsure_percent": 100 * unsure}
    return [Finding(Reason.NOISE_IN_FRF, "", "force_n" if biased[0].estimator == "H1" else "charge_pc", arguments)]


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
