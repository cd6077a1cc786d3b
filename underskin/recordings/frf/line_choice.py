"""Which lines of an estimated FRF count, and the bias of its estimator by noise.

Excitation. Lines are gathered in bins of equal width in log f. Those of a bin with a low median coherence γ² were not
excited, except single lines with a high one: a force of a few sines excites one line in many.

Mains on the charge. Where mains are not synchronous with the force, the incoherent power of the charge, 1 − γ², stands
out at their multiples. Where they are synchronous (both start together), γ² shows nothing; then one line of the FRF
departs from its neighbours by the charge of the mains over the force, and no law of a skin is as narrow as one line.
Outside the band of such a force, power of the charge beyond the response to the force counts.

Bias by noise (errors in variables). With white noise of power m in the force and k in the charge, uncorrelated with all
else, each line has (Bendat and Piersol, Random Data, chapters 6 and 7)
    γ² = (1 − m/S_ff) (1 − k/S_qq)    H1 = H (1 − m/S_ff)    H2 = H/(1 − k/S_qq).
m and k are at most the least S_ff and S_qq over the lines; lines of different S_ff and S_qq separate them: where the
force was not excited, S_ff is m itself. Both have a uniform prior up to these bounds. The FRF is the total
least-squares line with κ = k/m, and the posterior's width enters its uncertainty; H2, chosen where the force is known
to be noisy, is H2 (1 − k/S_qq). A loss of coherence beyond white noise (a disturbance inside the band) may lie in
either channel, so that H lies between H1 and H2.

Lines used for d33 and for a diagnosis, of the FRF of a time series:
- Idle lines have little force power (outside the band, or between the lines of a periodic sweep): below 1/25 of the
  power of the lines that hold most of it (the noise of an FRF goes as 1/√power), or below what gives an expected
  relative standard uncertainty √((1 − γ²)/(2nγ²)) of 1/5. They are used where charge follows force well all the same:
  an uncertainty below 1/20 and below five times the best, and not by chance. The expected uncertainty decides, since
  the observed one would select lines that came out too large.
- Lines with force power that the charge does not follow (noise, a disturbance) are idle too; γ² of the lines around
  gives their expected uncertainty, for the same reason.
- Lines near mains are left out.
- The two lines next to 0 Hz are left out where enough others remain: the straight line removed from each block is part
  of them, and the window mixes them with 0 Hz.
- With a force that acts once (a single sweep or blow) hardly more than one block holds a line, and the taper cuts the
  start of a sweep: the first sixteen lines are left out, at most half. Lines of a periodic force are unaffected.
The rest is corrected for the bias of the estimator. For imported FRFs with γ², lines that the force did not excite in
most recordings, and lines that are exactly 0, are idle.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import DefectKind
from underskin.recordings.frf.spectra import AROUND, Defect, Frf, Stack, expected_coherence, information, stacked
from underskin.units import Floats, Indices, Mask

MAINS_HZ = (50.0, 60.0)
HARMONICS = np.arange(1, 6)  # 1: the fundamental
HARMONIC_WIDTH_HZ = 3.0  # from a harmonic: windows and the drift of mains make lines that wide


_BINS_PER_DECADE = 12
_LEAST_COHERENCE = 0.5  # least median γ² of a bin whose lines count as excited
_CLEAR_COHERENCE = 0.9  # least γ² of an excited line in another bin: noise alone hardly reaches it


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
        By the median γ² of a line's bin, or its own median γ² where that is high; True where γ² is not known, and at
        all lines where no line is excited. The lower median is used: a half-excited bin is judged line by line.
    """
    line = np.concatenate(
        [
            np.broadcast_to(np.searchsorted(frequencies, stack.frequency), stack.coherence.shape).ravel()
            for stack in stacks
        ]
    )
    coherence = np.concatenate([stack.coherence.ravel() for stack in stacks])
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
    """The index of each frequency's bin, of the same shape."""
    return np.asarray(np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, len(edges) - 2))


def _lower_medians(group: Indices, values: Floats, groups: int) -> Floats:
    """The lower median of the values of each group (groups,); NaN for an empty one."""
    medians = np.full(groups, np.nan)
    order = np.argsort(group, kind="stable")
    filled, first = np.unique(group[order], return_index=True)
    parts = np.split(values[order], first[1:])
    medians[filled] = [np.sort(part)[(len(part) - 1) // 2] for part in parts] if len(filled) else []
    return medians


_BETWEEN, _AROUND = 2.5, 12.5  # distances in lines from a multiple of the mains: the neighbourhood compared with it
_LEAST_AROUND = 10
_RESPONSE = 4.0  # times the power by the median FRF: up to it a response to the force
_STANDS_OUT = 25.0  # times the median around; a line's noise reaches that once in a million
_SPREAD = 3.0  # lines to each side over which the window spreads mains


@dataclass(frozen=True)
class MainsOnCharge:
    """Mains at `mains_hz`: the largest `charge` at one of their multiples (peak) [C], and the lines near any multiple,
    `spoilt` (lines,)."""

    mains_hz: float
    charge: float
    spoilt: Mask


def near_mains(frequency: Floats) -> Mask:
    """Which lines (lines,) [Hz] lie within the width of a mains harmonic."""
    harmonics = np.outer(MAINS_HZ, HARMONICS).ravel()
    return np.asarray(np.abs(frequency[:, None] - harmonics).min(axis=1) <= HARMONIC_WIDTH_HZ)


def excited_at_mains(chosen: Mapping[str, "Usable"]) -> list[Finding]:
    """The finding on recordings all of whose used lines lie near mains harmonics: there pick-up in the charge adds to
    the response, and no other line tells them apart. `chosen`: the lines by the recordings' ids."""
    at_mains = {}
    for name, usable in chosen.items():
        lines = usable.frf.frequency[usable.frf.used_or_all]
        if len(lines) and np.isfinite(lines).all() and near_mains(lines).all():
            at_mains[name] = float(lines[0])
    if not at_mains:
        return []
    (first, frequency), *others = at_mains.items()
    arguments = {"affected": len(at_mains), "recordings": len(chosen), "frequency_hz": frequency}
    return [Finding(Reason.EXCITED_AT_MAINS, "" if others else first, "frequency_hz", arguments)]


@dataclass(frozen=True)
class _Indicator:
    """A quantity of each line (lines,) that mains raise: its `value`, the equivalent `power` of charge [C²], and its
    value for `noise` alone."""

    value: Floats
    power: Floats
    noise: Floats


def mains_on_charge(measured: Frf, powerful: Mask) -> MainsOnCharge | None:
    """The mains at a multiple of which the charge stands out and the force does not.

    None without mains, or where the lines are too coarse to distinguish 50 from 60 Hz. `powerful` (lines,): the lines
    where the force has its power.
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
            _Indicator(
                *_departure_from_neighbours(measured, np.flatnonzero(powerful)), noise=incoherent / measured.averages
            ),
            _Indicator(outside, outside, incoherent),
        ]
    candidates = [_of_mains(measured, mains, indicators) for mains in MAINS_HZ]
    outstanding, strongest = max(candidates, key=lambda candidate: candidate[0])
    return strongest if outstanding >= _STANDS_OUT else None


def _of_mains(measured: Frf, mains: float, indicators: Sequence[_Indicator]) -> tuple[float, MainsOnCharge]:
    """The largest ratio of an indicator at a multiple of the mains to its neighbourhood, and the spoilt lines."""
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
        outstanding = max(_over_usual(indicator, near, around) for indicator in indicators) / of_force
        if outstanding >= _STANDS_OUT:
            power = max([power, *(float(indicator.power[near].max()) for indicator in indicators)])
        highest = max(highest, outstanding)
    return highest, MainsOnCharge(mains, float(np.sqrt(power)), spoilt)


def _over_usual(indicator: _Indicator, near: Mask, around: Mask) -> float:
    """The largest value near a multiple over the median around, or over that of its noise; 0 with too few lines."""
    usual = indicator.value[around & (indicator.value > 0)]
    if len(usual) < _LEAST_AROUND:
        return 0.0
    return float(indicator.value[near].max() / max(np.median(usual), np.median(indicator.noise[around])))


def _departure_from_neighbours(measured: Frf, rows: Indices) -> tuple[Floats, Floats]:
    """The departure of each of these lines from the prediction by its two neighbours on each side, as power of charge
    [C²]: if shared by all five lines, and if of the middle line alone; 0 at the other lines.

    The prediction is the cubic through the four neighbours or, where nearer, a single pole (a resonance): the quotient
    of a parabola and 1 + px, whose p makes the third divided difference of y (1 + px) vanish.
    """
    assert measured.force_power is not None
    of_all, of_middle = np.zeros((2, len(measured.frequency)))
    if len(rows) > 4:
        middle = rows[2:-2]
        neighbours = np.stack([rows[n : len(rows) - 4 + n] for n in (0, 1, 3, 4)])
        x = (measured.frequency[neighbours] - measured.frequency[middle]) / measured.frequency[0]
        difference = 1 / np.stack([np.prod(x[n] - np.delete(x, n, axis=0), axis=0) for n in range(4)])
        weight = -np.prod(x, axis=0) * difference / x  # Lagrange's, at the middle
        values, noise = measured.values[neighbours], 1 / measured.force_power
        below = (difference * values * x).sum(axis=0)
        pole = -(difference * values).sum(axis=0) / np.where(below == 0, np.inf, below)
        cubic = (weight * values).sum(axis=0)
        off = measured.values[middle] - np.stack([cubic, cubic + pole * (weight * values * x).sum(axis=0)])
        square = np.min(np.abs(off) ** 2, axis=0)
        of_all[middle] = square / (noise[middle] + (weight**2 * noise[neighbours]).sum(axis=0))
        of_middle[middle] = square / noise[middle]
    return of_all, of_middle


_LEAST_LOSS = 2e-3  # 1 − γ² of the used lines: below it H1 and H2 differ by less
_FEWEST_LINES, _FEWEST_AVERAGES = 16, 3.0
_NODES = 33  # grid nodes of each noise power, from 0 to its bound
_WORST = 0.9  # largest share of a line's power that may be noise
_MODEL = 5e-3  # error of γ² by leakage and other defects of an estimate
_CORRELATED = 2.0  # neighbouring lines of Hann's window that carry the information of one
_TINY = float(np.finfo(float).tiny)
_TOGETHER = 16  # lines of a group
_MARGIN = 1.3  # mean over power of a group: three standard deviations with 8 blocks and 16 lines
_WORTH_SAYING = 0.01  # least reported bias, relative


def without_noise_bias(measured: Frf, used: Mask) -> Frf:
    """The FRF corrected for the `bias` of its estimator by noise, with the remaining uncertainty `bias_unsure`, both
    for the `used` lines (lines,).

    Unchanged where their coherence is nearly 1, or where power or γ² is not known. Where the gain changes within the
    series, what the FRF leaves is not noise: nothing is corrected, and the uncertainty is the scatter of the gain.
    """
    if measured.gain_change is not None:
        return replace(measured, bias_unsure=measured.gain_change.scatter)
    force, charge, coherence, averages = (
        measured.force_power, measured.charge_power, measured.coherence, measured.averages
    )  # fmt: skip
    if force is None or charge is None or coherence is None or averages is None or measured.passes is None:
        return measured
    count = np.minimum(averages, measured.passes)
    valid = np.isfinite(coherence) & (force > 0) & (charge > 0) & (count > 1)
    used = used & valid
    if used.sum() < 1 or valid.sum() < _FEWEST_LINES or float(np.median(averages)) < _FEWEST_AVERAGES:
        return measured
    weight = information(expected_coherence(coherence[used]))
    weight /= weight.sum()
    true_coherence = coherence - (1 - coherence) ** 2 / averages  # of n blocks γ² is that much too large
    loss = float(weight @ (1 - true_coherence[used]))
    if loss < _LEAST_LOSS:
        return measured
    noise = _posterior(force, charge, coherence, averages, count, _groups(used, valid))
    in_force = np.minimum(noise.force / force, _WORST)
    in_charge = np.minimum(noise.charge / charge, _WORST)
    if measured.estimator == "H2":
        size = np.sqrt(charge / np.maximum(coherence * force, _TINY)) * (1 - in_charge)
        sensitive, share = noise.charge_sd / charge, in_charge
    elif noise.force == noise.charge == 0.0:
        return replace(measured, bias_unsure=loss / float(np.sqrt(3.0)))
    else:
        size = _total_least_squares(force, charge, coherence, noise)
        sensitive, share = noise.force_sd / force, in_force
    raw = np.abs(measured.values)
    factor = np.where(valid & (raw > 0), size / np.where(raw > 0, raw, 1.0), 1.0)
    explained = float(weight @ (1 - (1 - in_force[used]) * (1 - in_charge[used])))
    unexplained = max(loss - explained, 0.0)
    second_order = float(weight @ ((share / (1 - share)) ** 2 / averages)[used])  # variance of what noise leaves
    uncertainty = float(np.hypot(weight @ sensitive[used], np.hypot(unexplained, second_order) / np.sqrt(3.0)))
    bias = float(weight @ (1 / factor[used] - 1))
    return replace(measured, values=measured.values * factor, bias=bias, bias_unsure=uncertainty)


def _total_least_squares(force: Floats, charge: Floats, coherence: Floats, noise: "_Noise") -> Floats:
    """|FRF| by total least squares of (F, Q) with these noise powers: Hv of `estimators` with known κ = k/m, which is
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
    """Posterior means and standard deviations of the noise powers."""

    def __init__(self, force: Floats, charge: Floats, weight: Floats) -> None:
        of_force, of_charge = weight.sum(axis=1), weight.sum(axis=0)
        self.force, self.charge = float(force @ of_force), float(charge @ of_charge)
        self.force_sd = float(np.sqrt(max(force**2 @ of_force - self.force**2, 0.0)))
        self.charge_sd = float(np.sqrt(max(charge**2 @ of_charge - self.charge**2, 0.0)))


def _posterior(
    force: Floats, charge: Floats, coherence: Floats, averages: Floats, passes: Floats, groups: Sequence[Indices]
) -> _Noise:
    """The posterior of the noise powers of both channels from powers, estimated γ², the number n of averaged blocks and
    that of blocks in which the force has its power (lines,), which decides how much γ² scatters.

    The grid ends at the least power of any group of lines, or the share of it that its loss of coherence allows. Over
    the lines of a group γ² is Σ |S_fq|²/Σ S_ff S_qq; for n blocks the expected sums are those of the spectra times
    γ² + 1/n and 1 + γ²/n for a random force, γ² + (1 − γ²)/n and 1 for one that acts in some blocks alone.
    """
    product = force * charge
    sums = np.array([[part[group].sum() for part in (product, coherence * product, force, charge)] for group in groups])
    lines = np.array([len(group) for group in groups])
    blocks, in_blocks = (np.array([float(np.mean(part[group])) for group in groups]) for part in (averages, passes))
    estimated = sums[:, 1] / sums[:, 0]
    true = np.clip((estimated - 1 / blocks) / (1 - estimated / blocks), 0.0, 1.0)
    inverse_force, inverse_charge = sums[:, 3] / sums[:, 0], sums[:, 2] / sums[:, 0]  # 1/S_ff and 1/S_qq of a group
    independent = np.maximum(lines / _CORRELATED, 1.0)
    variance = (2 * true + 1 / in_blocks) * (1 - true) ** 2 / (in_blocks * independent) + _MODEL**2
    loss = 1 - true + 3 * np.sqrt(variance)  # of coherence: no noise takes a larger share of a group's power
    most_force, most_charge = (
        _MARGIN * float((np.minimum(loss, 1.0) / inverse).min()) for inverse in (inverse_force, inverse_charge)
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


def _groups(used: Mask, valid: Mask) -> list[Indices]:
    """Groups of neighbouring lines, used and other ones apart: powers of single lines are too uncertain, and excited
    lines have other powers than the lines between them."""
    groups: list[Indices] = []
    for lines in (np.flatnonzero(used), np.flatnonzero(valid & ~used)):
        if len(lines):
            groups += np.array_split(lines, max(1, len(lines) // _TOGETHER))
    return groups


def gain_findings(measured: Mapping[str, Frf]) -> list[Finding]:
    """A finding on the first series whose gain changes, with the number of those like it. `measured`: by their ids."""
    changing = {name: frf.gain_change for name, frf in measured.items() if frf.gain_change is not None}
    if not changing:
        return []
    (first, change), *others = changing.items()
    affected = {"affected": len(changing), "recordings": len(measured), "more": len(others)}
    reason = Reason.GAIN_DRIFTS if change.step_s is None else Reason.GAIN_STEP
    return [Finding(reason, first, "charge_pc", {**asdict(change), **affected})]


def noise_findings(measured: Sequence[Frf]) -> list[Finding]:
    """A finding on the bias of FRFs by noise, for the median recording, where it is large enough."""
    biased = [frf for frf in measured if (frf.bias or frf.bias_unsure) and frf.gain_change is None]
    if 2 * len(biased) <= len(measured):
        return []
    bias, uncertainty = (float(np.median([getattr(frf, name) for frf in biased])) for name in ("bias", "bias_unsure"))
    if max(abs(bias), uncertainty) < _WORTH_SAYING:
        return []
    arguments = {"percent": 100 * bias, "estimator": biased[0].estimator, "unsure_percent": 100 * uncertainty}
    return [Finding(Reason.NOISE_IN_FRF, "", "force_n" if biased[0].estimator == "H1" else "charge_pc", arguments)]


_UNSURE, _SURE = 0.2, 0.05  # relative uncertainty
_TIMES_BEST, _BEST = 5.0, 0.1  # times the best uncertainty, which is this quantile
_BY_CHANCE = 1e-6
_FOLLOWS = 4.75  # standard deviations: as improbable by chance
_LEAST_LINES = 8  # with fewer lines all are kept
_BIASED, _BIASED_ONCE = 2, 16  # lines, next to 0 Hz
_ONCE = 2.0  # passes; noise has half as many as there are blocks


@dataclass(frozen=True)
class Choice:
    """The used `lines` and the `idle` ones; the `mains` that spoil some; the relative noise along the used lines
    (`uneven`); whether the force acts `once` at each, and whether neighbours share their noise (`shared`)."""

    lines: Indices
    idle: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    mains: MainsOnCharge | None = None
    uneven: Floats | None = None
    once: bool = False
    shared: bool = False

    @property
    def apart(self) -> Indices:
        """Indices into `lines` of those with independent noise.

        Neighbouring lines of blocks of noise are correlated (with a Hann window by 4/9; two apart by 1/36): one of two
        neighbours is used.
        """
        if not self.shared:
            return np.arange(len(self.lines))
        indices: list[int] = []
        for index, line in enumerate(self.lines.tolist()):
            if not indices or line > self.lines[indices[-1]] + 1:
                indices.append(index)
        return np.array(indices, dtype=np.intp)


@dataclass(frozen=True)
class Usable:
    """The idle and the used lines of an FRF, corrected for the bias of its estimator, and the choice among all lines.

    Where charge follows force at no line, as of a dead sensor, all are used and the choice has none.
    """

    frf: Frf
    choice: Choice

    @property
    def all_spoilt_by_hz(self) -> float | None:
        """The mains frequency that may spoil all lines where the force has its power; None where others remain."""
        return None if self.choice.mains is None or len(self.choice.lines) else self.choice.mains.mains_hz

    @property
    def overload(self) -> Defect | None:
        """The first overload, where charge follows force at no line of what is left beside it; None otherwise."""
        overloads = [defect for defect in self.frf.defects if defect.kind == DefectKind.OVERLOAD]
        return overloads[0] if overloads and not len(self.choice.lines) else None


def usable_lines(measured: Sequence[Frf]) -> list[Usable]:
    """The FRFs of recordings of one campaign."""
    imported = [frf for frf in measured if frf.averages is None]
    excited = _excited(imported)
    return [
        _of_lines(frf, excited[frf.frequency.tobytes()]) if frf.averages is None else _of_series(frf)
        for frf in measured
    ]


def _excited(imported: Sequence[Frf]) -> dict[bytes, Mask]:
    """The excited lines of each grid of lines."""
    valid = [frf for frf in imported if np.isfinite(frf.frequency).all() and (frf.frequency > 0).all()]
    excited = {frf.frequency.tobytes(): np.ones(len(frf.frequency), dtype=bool) for frf in imported}
    if not any(np.isfinite(frf.coherence_or_nan).any() for frf in valid):
        return excited
    stacks = stacked(valid)
    frequencies = np.unique(np.concatenate([stack.frequency for stack in stacks]))
    followed = frequencies[excited_lines(stacks, frequencies)]
    return excited | {stack.frequency.tobytes(): np.isin(stack.frequency, followed) for stack in stacks}


def _of_lines(frf: Frf, excited: Mask) -> Usable:
    measured = excited & (frf.values != 0)  # an analyzer writes 0 outside its band
    used = measured if measured.any() else np.ones_like(excited)
    return Usable(replace(frf, used=used), Choice(np.flatnonzero(used), np.flatnonzero(~used)))


def _of_series(frf: Frf) -> Usable:
    choice = choose_lines(frf)
    if not len(choice.lines):
        return Usable(frf, choice)
    used = np.isin(np.arange(len(frf.frequency)), choice.lines)
    corrected = replace(without_noise_bias(frf, used), used=used)
    return Usable(corrected.at(np.sort(np.concatenate([choice.lines, choice.idle]))), choice)


def choose_lines(measured: Frf) -> Choice:
    """The choice of the lines of a time series; no line where charge follows force at none."""
    uncertainty, force = measured.relative_uncertainty, measured.force_power
    every = np.arange(len(measured.frequency))
    none = every[:0]
    coherence, averages = measured.coherence, measured.averages
    if uncertainty is None or coherence is None or averages is None or np.isnan(uncertainty).any():
        return Choice(every)
    if force is None:  # tones that the force dwells on: it has its power at each
        return Choice(every if (uncertainty <= _UNSURE).any() else none)
    usual = _usual(force)
    typical = float(np.median(uncertainty[force >= usual]))
    powerful = force >= usual * np.clip((typical / _UNSURE) ** 2, 1 / _TIMES_BEST**2, 1.0)
    expected = _expected(coherence[powerful], averages[powerful])
    if not (expected <= _UNSURE).any():  # no line by itself: those that follow together with the lines around
        powerful[powerful] = _follows(coherence[powerful], averages[powerful])
    else:
        powerful[powerful] = expected <= _UNSURE
    best = float(np.quantile(uncertainty[powerful], _BEST)) if powerful.any() else np.inf
    powerful |= (uncertainty <= min(_SURE, _TIMES_BEST * best)) & _beyond_chance(coherence, averages)
    if not powerful.any():
        return Choice(none)
    mains = mains_on_charge(measured, powerful)
    strong = np.flatnonzero(powerful if mains is None else powerful & ~mains.spoilt)
    shared = not measured.independent and len(strong) >= _LEAST_LINES
    once = measured.passes is not None and float(np.median(measured.passes[powerful])) < _ONCE
    biased = min(_BIASED_ONCE, len(strong) // 2) if once else _BIASED
    chosen = strong[strong >= biased] if shared else strong
    if not len(chosen):  # mains spoil all, where lines are coarse
        return Choice(none, mains=mains)
    uneven = _uneven(force[chosen], uncertainty[chosen])
    return Choice(chosen, np.flatnonzero(~powerful & (every >= (biased if shared else 0))), mains, uneven, once, shared)


def _expected(coherence: Floats, averages: Floats) -> Floats:
    """The expected relative uncertainty of each of these lines by γ² of the lines around."""
    around = expected_coherence(coherence)
    true = np.maximum(around - (1 - around) ** 2 / averages, 0.0)  # of n blocks γ² is that much too large
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1 - true) / (2 * averages * true)))


def _beyond_chance(coherence: Floats, averages: Floats) -> Mask:
    """Where noise alone would not give this γ²: for n blocks it is exceeded with (1 − γ²)^(n − 1) (Carter 1987)."""
    return np.asarray((1 - coherence) ** (averages - 1) < _BY_CHANCE)


def _follows(coherence: Floats, averages: Floats) -> Mask:
    """At which of these lines the mean γ² of the lines around is beyond chance: that of noise of n blocks has mean 1/n
    and variance (n − 1)/(n² (n + 1)) (Carter 1987)."""
    around = uniform_filter1d(coherence, AROUND)
    deviation = np.sqrt((averages - 1) / (averages + 1) * _CORRELATED / AROUND) / averages
    return np.asarray(around - 1 / averages > _FOLLOWS * deviation + _MODEL)


def _usual(power: Floats) -> float:
    """The least power among the strongest lines that together hold half of the total."""
    falling = np.sort(power)[::-1]
    return float(falling[np.searchsorted(np.cumsum(falling), 0.5 * falling.sum())])


def _uneven(force: Floats, uncertainty: Floats) -> Floats:
    """The relative noise of lines as a power of their force power: exponent −½ for noise of the charge, 0 for that of
    the gain."""
    size, noise = np.log(force), np.log(np.maximum(uncertainty, 1e-12))
    size = size - size.mean()
    exponent = float(np.clip(size @ noise / max(size @ size, 1e-12), -0.5, 0.0))
    return np.asarray(np.exp(exponent * size))
