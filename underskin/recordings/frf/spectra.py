"""Spectra of time series of force and charge: periods, defects, block averages, and FRFs on common grids.

Periodic forces (a repeated sweep, burst or noise of period T) and their charge have lines at the multiples of 1/T only.
Hann's window over two periods is exact there: it mixes a line with those half a line away, which are empty (Pintelon
and Schoukens, System Identification, 2012, chapter 2). A straight-line fit would remove parts of both signals and bias
the lowest lines; the difference of the means of two periods is drift alone.

Blocks with a defect (overload, held samples, jumps) are left out of the average.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter, uniform_filter1d
from scipy.special import stdtr

from underskin.errors import InvalidInput, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import DefectKind
from underskin.recordings.frf.estimators import Estimator, noise_ratio, ratio
from underskin.recordings.frf.gain_change import GainChange, gain_change
from underskin.units import Complexes, Floats, Indices, Mask

_FEWEST_PERIODS = 4
_LEAST_SAMPLES = 16  # of a period
_PARTS = 8  # parts of a record whose moving mean is removed as drift
_ALIKE = 0.9  # least correlation of one period with each later one
_AS_GOOD = 0.002  # difference of correlations within which the shorter period is chosen
_ROUNDING = 1e-9  # of the force: smaller variations of a constant one are rounding
_DIP = 0.5  # correlation below which neighbouring samples are no longer alike


def period_of(force: Floats) -> int:
    """The period of a force in samples, of which there are at least four; 0 without one."""
    samples = len(force)
    longest = samples // _FEWEST_PERIODS
    if longest < _LEAST_SAMPLES:
        return 0
    width = samples // _PARTS
    steady = (force - uniform_filter1d(force, width))[width:-width]  # filtered alike everywhere: as periodic as before
    power = float(np.mean(steady**2))
    if power <= (_ROUNDING * float(np.abs(force).max())) ** 2:
        return 0
    lags = np.arange(len(steady) // 2 + 1)
    from scipy.signal import correlate  # takes 0.3 s to load, which few need

    products = correlate(steady, steady, method="fft")[len(steady) - 1 :]
    likeness = products[: len(lags)] / (len(steady) - lags) / power
    dips = np.flatnonzero(likeness < _DIP)
    first = max(_LEAST_SAMPLES, int(dips[0])) if len(dips) else longest + 1
    if first > longest:
        return 0
    least = max(_ALIKE, likeness[first : longest + 1].max() - _AS_GOOD)
    lag = np.arange(first, min(longest + 1, len(likeness) - 1))
    peak = (likeness[lag] >= least) & (likeness[lag] >= likeness[lag - 1]) & (likeness[lag] >= likeness[lag + 1])
    return next((int(period) for period in lag[peak] if likeness[period::period].min() > _ALIKE), 0)


def without_drift(blocks: Floats) -> Floats:
    """Blocks of two periods (blocks, samples) less their mean and the drift from the first period to the second."""
    period = blocks.shape[1] // 2
    first, second = blocks[:, :period].mean(axis=1), blocks[:, period:].mean(axis=1)
    time = (np.arange(blocks.shape[1]) - (blocks.shape[1] - 1) / 2) / period
    return np.asarray(blocks - ((first + second) / 2)[:, None] - (second - first)[:, None] * time)


_CLIPPED_RUN = 3  # samples in a row at the extreme value
_CLIPPED_RATIO = 5.0  # a quantised sine's top level holds at most 1/(√2 − 1) = 2.4 times the samples of the next
_FLICKERING = (1, 2, 4)  # levels: none, one or two bits flicker
_HELD_RUN = 5  # samples in a row of one value
_COARSE = 0.2  # share of samples equal to the one before, above which the levels are coarse
_ONE_LEVEL = 1.5
_BY_CHANCE = 1e-3  # expected number of equally long runs in the whole signal
_JUMP = 12.0  # second difference over its scale among neighbours; a sine stays below 1.5, noise below 6
_ROUNDED = 2.0  # levels: rounding by half a level changes a second difference by so many at most
_BLOW, _RINGING = 20.0, 6.0  # kurtosis: 1.5 of a sine, 3 of noise, hundreds of a hammer's blow, tens of its ringing
_AS_SHARP = 0.5  # of a jump: least second difference a period later, where a periodic signal restarts
_GIVE_OR_TAKE = 2  # samples, since a period need not be a whole number of them
_CLEAR = 3.0  # standard deviations from 0
_BOTH = 0.5  # least correlation of both channels around a blow; a spike in one reaches 4/√128 = 0.35 by chance
_LOCAL = 64  # samples that make a neighbourhood


@dataclass(frozen=True)
class Defect:
    """A run of `samples` from `first_sample` of a `channel` that cannot be trusted."""

    kind: DefectKind
    channel: str
    samples: int
    first_sample: int


def left_out_of(recording: str, every: Sequence[Defect]) -> list[Finding]:
    """The findings on the defects of a recording, one for each kind of each channel: the first, and how many more."""
    alike: dict[tuple[str, DefectKind], list[Defect]] = {}
    for defect in every:
        alike.setdefault((defect.channel, defect.kind), []).append(defect)
    return [
        Finding(Reason.DEFECTS_LEFT_OUT, recording, first.channel, {**asdict(first), "more": len(others)})
        for first, *others in alike.values()
    ]


def mean_of(force: Floats) -> float | None:
    """The mean of a force where it is a preload; None where it lies within three standard deviations of 0, as after an
    AC coupling."""
    mean, scatter = float(np.mean(force)), float(np.std(force))
    return mean if abs(mean) > _CLEAR * scatter else None


def defects_of_pair(force: Floats, charge: Floats) -> list[Defect]:
    """Every defect of force and charge: those of each by itself that are not physical, and limits that show beside the
    other channel alone: all samples of a limited charge, but of blows, which may be whole one by one, and otherwise the
    clipped samples of either."""
    if not len(force):
        return []
    every = _unphysical(force, charge)
    clear = all(defect.kind != DefectKind.OVERLOAD for defect in every)
    if clear and _kurtosis(force) <= _BLOW and _is_limited(force, charge):
        return [*every, Defect(DefectKind.LIMITED, "charge_pc", len(charge), 0)]
    for channel, signal, other in (("force_n", force, charge), ("charge_pc", charge, force)):
        known = [defect for defect in every if defect.channel == channel]
        if all(defect.kind != DefectKind.OVERLOAD for defect in known):
            clipped = _clipped_in_noise(np.where(damaged(known, len(signal)), np.median(signal), signal), other)
            every += [Defect(DefectKind.OVERLOAD, channel, count, first) for first, count in _runs(clipped)]
    return every


def _unphysical(force: Floats, charge: Floats) -> list[Defect]:
    """The defects of either by itself.

    Jumps are no defects where the force is a blow that the charge follows, nor where a periodic force, such as a sweep,
    restarts: these recur in each period. In noise that hides the blows of one channel those of the other are no defects
    where both correlate.
    """
    every = [*defects("force_n", force), *defects("charge_pc", charge)]
    if _kurtosis(force) > _BLOW and _kurtosis(charge) > _RINGING:
        return [defect for defect in every if defect.kind != DefectKind.JUMP]
    if all(defect.kind != DefectKind.JUMP for defect in every):
        return every
    period = period_of(force)
    recurs, struck = {}, {}
    for name, signal in (("force_n", force), ("charge_pc", charge)):
        recurs[name], struck[name] = _recurs(signal, period), _kurtosis(signal) > _BLOW

    def is_physical(jump: Defect) -> bool:
        if recurs[jump.channel][jump.first_sample]:
            return True
        around = slice(max(jump.first_sample - _LOCAL, 0), jump.first_sample + jump.samples + _LOCAL)
        return struck[jump.channel] and abs(_correlation(force[around], charge[around])) > _BOTH

    return [defect for defect in every if defect.kind != DefectKind.JUMP or not is_physical(defect)]


def _correlation(force: Floats, charge: Floats) -> float:
    """Their correlation coefficient; 0 where either is constant."""
    force, charge = force - force.mean(), charge - charge.mean()
    power = float((force @ force) * (charge @ charge))
    return float(force @ charge) / power**0.5 if power > 0 else 0.0


def _recurs(signal: Floats, period: int) -> Mask:
    """Where a similarly large second difference occurs a period before or after; nowhere without a period."""
    curvature = np.pad(np.abs(np.diff(signal, n=2)), 1)
    if not period:
        return np.zeros(len(signal), dtype=bool)
    around = maximum_filter1d(curvature, 2 * _GIVE_OR_TAKE + 1)
    before, after = np.zeros((2, len(signal)))
    before[period:], after[:-period] = around[:-period], around[period:]
    return np.asarray(np.maximum(before, after) > _AS_SHARP * curvature)


def _kurtosis(signal: Floats) -> float:
    square = (signal - signal.mean()) ** 2
    power = float(np.mean(square))
    return float(np.mean(square**2)) / power**2 if power > 0 else 0.0


def defects(channel: str, signal: Floats) -> list[Defect]:
    """Every defect of a signal, in order of its kind.

    Dropped samples are seen as a held value, or as a jump where the signal is sampled finely enough to be smooth. Fewer
    than three samples show none.
    """
    if len(signal) < 3:
        return []
    if signal.min() == signal.max():
        return [Defect(DefectKind.ONE_VALUE, channel, len(signal), 0)]
    rest = _rest(signal)
    clipped = _overload(signal, rest)
    held = _held(signal) & ~clipped & ~rest
    jump = _jumps(signal) & ~clipped & ~held
    kinds = ((DefectKind.OVERLOAD, clipped), (DefectKind.HELD_SAMPLES, held), (DefectKind.JUMP, jump))
    return [Defect(kind, channel, count, first) for kind, mask in kinds for first, count in _runs(mask)]


def damaged(every: list[Defect], samples: int) -> Mask:
    """Which of the samples any of the defects touches."""
    mask = np.zeros(samples, dtype=bool)
    for defect in every:
        mask[defect.first_sample : defect.first_sample + defect.samples] = True
    return mask


def _rest(signal: Floats) -> Mask:
    """Where a signal of blows is at its one exact value between them, which a force window sets."""
    return np.asarray(signal == np.median(signal)) if _kurtosis(signal) > _BLOW else np.zeros(len(signal), dtype=bool)


def _overload(signal: Floats, rest: Mask) -> Mask:
    """Runs of samples, not at `rest`, at either end of the range, where they accumulate on one level, or on a few of a
    converter whose last bits flicker."""
    mask = np.zeros(len(signal), dtype=bool)
    levels, counts = np.unique(signal[~rest], return_counts=True)
    for several, ordered in product(_FLICKERING, (slice(None), slice(None, None, -1))):
        level, count = levels[ordered], counts[ordered]
        ends, next_ones = count[:several].sum(), count[several : 2 * several].sum()
        if len(levels) > 2 * several and ends > _CLIPPED_RATIO * next_ones:
            for first, samples in _runs(np.isin(signal, level[:several]) & ~rest):
                if samples >= _CLIPPED_RUN:
                    mask[first : first + samples] = True
    return mask


_FEWEST_PILED_UP = 16  # samples, whose counting error is a quarter of them
_WIDTHS = np.geomspace(1e-4, 0.2, 45)  # of the range: bands that hold noise of 0.002 to 4 % of it
_TURNING = 1 / (np.sqrt(2.0) - 1)  # within d of its top a turning signal spends √d, and (√2 − 1) √d in the next d
_WEAKEST = 1e-4  # of the strongest line's power: from its second side lobe on Hann's window leaks -41 dB (Harris 1978)
_PASSES = 10  # with half of the samples clipped the expected ones are settled


def _piled_up(level: Floats, sign: float) -> Mask:
    """The samples in the band at the upper (`sign` 1) or lower (-1) end of the range that holds most of them relative
    to the next band as wide; none where a signal that turns there has as many, or where half of all lie there, as at
    the rest of a signal of blows."""
    below = (sign * level).max() - sign * level
    widths = _WIDTHS * below.max()
    ordered = np.sort(below)
    within = np.searchsorted(ordered, widths, side="right")
    beside = np.searchsorted(ordered, 2 * widths, side="right") - within
    counts = (within >= _FEWEST_PILED_UP) & (2 * within < len(level))
    ratio = np.where(counts, within / (beside + 1), 0.0)
    best = int(np.argmax(ratio))
    return np.asarray((below <= widths[best]) & (ratio[best] > _TURNING))


def _clipped_in_noise(signal: Floats, other: Floats) -> Mask:
    """The samples at either end of the range of a signal clipped before noise was added, as before a converter.

    There more of them accumulate within a band than of any signal that turns there, and the linear response to the
    other channel goes on beyond all that was recorded. A square wave, a drive whose peaks are limited and a sine that
    is sampled at few of its phases accumulate too, but the other channel follows them.

    The response is that of the samples away from the ends, where those at the ends count as missing: until it goes on,
    each pass puts in their place what the response of the pass before makes them (expectation and maximisation:
    Dempster, Laird and Rubin, J. R. Stat. Soc. B 39, 1977). Its usual error is that of the samples away from the ends,
    by their power. A periodic signal has one pass: nothing else determines a sample that each of its periods lacks.
    """
    mask = np.zeros(len(signal), dtype=bool)
    level = signal - np.median(signal)
    piled = {sign: _piled_up(level, sign) for sign in (1.0, -1.0)}
    ends = piled[1.0] | piled[-1.0]
    away, filled = ~ends, level.copy()
    if not ends.any() or away.sum() < _FEWEST_PILED_UP:
        return mask
    for _ in range(1 if period_of(signal) or period_of(other) else _PASSES):
        cause = other - other.mean()
        response = _LinearResponses(cause, max(len(cause) // _PARTS, 2)).of(filled - filled.mean())
        expected = _scaled(response, level, away)
        usual = _rms((expected - level)[away] * level[away]) / max(_rms(level[away]), _TINY)
        for sign, end in piled.items():
            top, reached = sign * level[end], sign * expected[end]
            if end.any() and np.median(reached) > top.max() and np.median(reached - top) > _CLEAR * usual:
                mask |= end
        if mask.any():
            break
        filled[ends] = expected[ends]
    return mask


def _scaled(response: Floats, level: Floats, away: Mask) -> Floats:
    """The response with the slope and offset of its regression on the level of the samples `away` from the ends."""
    mean, mean_level = response[away].mean(), level[away].mean()
    centred = response - mean
    slope = (centred[away] @ level[away]) / max(float(centred[away] @ centred[away]), _TINY)
    return np.asarray(mean_level + slope * centred)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


class _LinearResponses:
    """Linear responses to a cause (samples,), by spectra averaged over blocks as long as an impulse response.

    `period` makes blocks of two periods, whose even lines are exact, and a response as long as one; otherwise a block
    has `size` samples.
    """

    def __init__(self, cause: Floats, size: int, period: int = 0) -> None:
        self.cause, self.size = cause, period or size
        if period:
            self._blocks = Blocks(np.hanning(2 * period + 1)[:-1], period, slice(0, period + 1, 2), without_drift)
        else:
            self._blocks = Blocks(np.hanning(size), max(size // 2, 1), slice(None), without_line)
        self._spectra = self._blocks.spectra(cause)
        self.power = np.mean(np.abs(self._spectra) ** 2, axis=0)

    def _transfer(self, spectra: Complexes) -> Complexes:
        cross = np.mean(np.conj(self._spectra) * spectra, axis=0)
        return np.asarray(cross / np.maximum(self.power + _WEAKEST * self.power.max(), _TINY))

    def of(self, effect: Floats) -> Floats:
        """The part of the effect that follows (samples,)."""
        return self._through(self._transfer(self._blocks.spectra(effect)))

    def missed_by_noise(self, effect: Floats) -> Floats:
        """What the response lacks (samples,) if all that does not follow is by noise of the cause: u times the response
        at each line, u = (1 − γ²)/γ², by which H1 is too small; 0 at lines that do not follow."""
        spectra = self._blocks.spectra(effect)
        transfer = self._transfer(spectra)
        rest = np.mean(np.abs(spectra - transfer * self._spectra) ** 2, axis=0)
        response = np.abs(transfer) ** 2 * self.power
        follows = rest < (len(spectra) - 1) * response  # γ² above the 1/n that n blocks of noise have
        return self._through(transfer * np.where(follows, rest / np.maximum(response, _TINY), 0.0))

    def _through(self, transfer: Complexes) -> Floats:
        from scipy.signal import fftconvolve  # takes 0.3 s to load, which few need

        impulse = np.fft.fftshift(np.fft.irfft(transfer, self.size))
        return np.asarray(fftconvolve(self.cause, impulse)[self.size // 2 : self.size // 2 + len(self.cause)])


_FALLS_BEHIND = 0.02  # up to 2 % d33 is taken as it is
# Times (rms/preload)² is what a charge of F^p loses under a Gaussian force: (p - 1)(p - 2)/6, the cubic term over the
# linear one in the Taylor series at the preload, times ⟨x⁴⟩ = 3; of 1 < p < 2 most at p = 3/2
_BENT_BY_CONTACT = 1 / 8
_LIMITED_BY_CHANCE = 1e-6
_PIECES = 32  # of a record, whose scatter tells the uncertainty: longer than noise stays alike, and enough of them
_DETERMINED = 0.5  # least share of the cube that a periodic force's lines leave: those of few tones leave 0.8


@dataclass(frozen=True)
class _Cubic:
    """How much more an effect follows its cause at small amplitudes than on average (`loss`, relative), the `chance`
    of a cubic coefficient as low by noise, and how much of the cube is `left` by the linear response."""

    loss: float
    chance: float
    left: float

    def falls_behind(self, allowed: float) -> bool:
        """Whether the effect follows less at large amplitudes, by more than an `allowed` loss."""
        return self.loss > allowed and self.chance < _LIMITED_BY_CHANCE

    @property
    def runs_ahead(self) -> bool:
        """Whether it follows more."""
        return self.loss < 0 and 1 - self.chance < _LIMITED_BY_CHANCE


def _is_limited(force: Floats, charge: Floats) -> bool:
    """Whether the charge follows the force less at large amplitudes, as behind a limiter with whatever noise.

    The charge less its linear response to the force is regressed on the cube of that response, less the cube's own
    linear response, beside the same of its square (Bendat, Nonlinear System Techniques and Applications, 1998): for a
    linear chain the coefficient is 0 by any noise of the charge. Unless the force consists of a few tones a limited
    charge has the force run ahead of it, too; noise of the force, or a ringing longer than a block, has not. Where the
    lines of a periodic force leave little of the cube, that must be beyond chance as well. What a contact itself may
    lose is allowed; a force that changes its sign does not tell the preload.
    """
    if len(force) < _PIECES * _FEWEST_PILED_UP:
        return False
    allowed = _FALLS_BEHIND
    if force.min() * force.max() > 0:
        allowed = max(allowed, _BENT_BY_CONTACT * float(np.var(force) / np.mean(force) ** 2))
    period = period_of(force)
    cubic = _cubic(force, charge, period)
    if period and cubic.left >= _DETERMINED:
        return cubic.falls_behind(allowed)
    if period:
        cubic = _cubic(force, charge, 0)
    if not cubic.falls_behind(allowed):
        return False
    other = _cubic(charge, force, 0)
    return other.runs_ahead if period else other.loss < 0


def _cubic(cause: Floats, effect: Floats, period: int) -> _Cubic:
    """The part of an effect that follows the cube of its linear response x of unit power, c₃x³: a loss of −c₃⟨x⁴⟩.

    Noise n of the cause, normal and independent of the signal, makes x too small by y at most (`missed_by_noise`). As
    ⟨g(x) n⟩ = ⟨g'(x)⟩⟨n²⟩ (Stein 1981), the rest then has the product ⟨(x³ − 3x) y⟩ with the cube, over ⟨h²⟩ for h,
    what the linear response leaves of the cube, its coefficient: what that adds to the loss is taken off.
    """
    cause, effect = cause - cause.mean(), effect - effect.mean()
    responses = _LinearResponses(cause, len(cause) // _PARTS, period)
    middle = slice(responses.size // 2, len(cause) - responses.size // 2)  # where all of the impulse response is in
    response = responses.of(effect)
    rms = _rms(response[middle])
    if not rms > 0:
        return _Cubic(0.0, 0.5, 0.0)
    x, rest = response / rms, (effect - response)[middle] / rms
    square = x**2  # other powers take NumPy ten times as long as products
    powers = np.array([(power - responses.of(power - power.mean()))[middle] for power in (square, square * x)])
    powers -= powers.mean(axis=1, keepdims=True)
    square = square[middle]
    samples = len(square) // _PIECES * _PIECES
    pieces = powers[:, :samples].reshape(2, _PIECES, -1)
    products = np.einsum("ipt,jpt->pij", pieces, pieces)
    along = np.einsum("ipt,pt->pi", pieces, (rest - rest.mean())[:samples].reshape(_PIECES, -1))
    inverse = np.linalg.pinv(products.sum(axis=0))
    coefficients = inverse @ along.sum(axis=0)
    scatter = along - products @ coefficients
    variance = (inverse @ (scatter.T @ scatter) @ inverse)[1, 1] * _PIECES / (_PIECES - 1)
    share = products[:, 1, 1] / max(float(products[:, 1, 1].sum()), _TINY)
    fourth, cube = float(np.mean(square**2)), float(np.mean(powers[1] ** 2))
    freedom = max(1 / max(float(share @ share), _TINY) - 1, 1.0)
    chance = stdtr(freedom, coefficients[1] / max(float(np.sqrt(variance)), _TINY))
    missed = responses.missed_by_noise(effect)[middle] / rms
    by_noise = max(float(np.mean((3 - square) * x[middle] * missed)), 0.0) * fourth / max(cube, _TINY)
    left = cube / max(float(np.mean(square**2 * square)) - fourth**2, _TINY)
    return _Cubic(float(-coefficients[1] * fourth - by_noise), float(chance), left)


def _held(signal: Floats) -> Mask:
    """Runs of one value that end in a step of more than one level (a slow signal turns on one level); with coarse
    levels, where neighbours are equal by chance, those that end in a leap."""
    step = np.abs(np.diff(signal))
    same = np.concatenate([[False], step == 0])
    mask = np.zeros(len(signal), dtype=bool)
    usual, width = float(same.mean()), 2 * _LOCAL + 1
    around = uniform_filter1d(same.astype(float), width)
    level, leap = float(step[step > 0].min(initial=np.inf)), 2 * np.quantile(step, 0.999)
    levels = np.maximum(np.pad(_around(_curvature(signal), _last_digit), 1, mode="edge"), level)
    for first, count in _runs(same):
        level = levels[first]
        after = step[first + count - 1] if first + count < len(signal) else 2 * level
        alike = max(usual, around[first + count // 2] - count / width)
        by_chance = usual > _COARSE or len(signal) * alike**count > _BY_CHANCE
        if count >= _HELD_RUN - 1 and after > (leap if by_chance else _ONE_LEVEL * level):
            mask[first - 1 : first + count] = True
    return mask


def _jumps(signal: Floats) -> Mask:
    mask = np.zeros(len(signal), dtype=bool)
    curvature = _curvature(signal)
    usual, levels = _around(curvature, _usual_size), _around(curvature, _last_digit)
    mask[1:-1] = (curvature > _JUMP * usual + _ROUNDED * levels) & (usual > 0)
    return mask


def _curvature(signal: Floats) -> Floats:
    """The magnitude of the second differences, without those of the binary representation of decimal numbers."""
    curvature = np.abs(np.diff(signal, n=2))
    return np.where(curvature > _ROUNDING * np.abs(signal).max(), curvature, 0.0)


def _around(curvature: Floats, summed: Callable[[Floats], Floats]) -> Floats:
    """The largest of what `summed` gives for the part that each sample lies in and the parts on both sides.

    Parts of two lengths, so that each length is processed at once: a long series has some ten thousand parts.
    """
    length, longer = divmod(len(curvature), max(1, len(curvature) // _LOCAL))
    parts = np.split(curvature, [longer * (length + 1)])
    sizes = (length + 1, length)
    of_parts = [summed(part.reshape(-1, size)) for part, size in zip(parts, sizes, strict=True)]
    usual = np.concatenate(of_parts)
    around = np.max([np.roll(usual, shift) for shift in (-1, 0, 1)], axis=0)
    return np.asarray(np.repeat(around, np.repeat(sizes, [len(part) for part in of_parts])))


def _usual_size(parts: Floats) -> Floats:
    return np.asarray(1.4826 * np.median(parts, axis=1))


def _last_digit(parts: Floats) -> Floats:
    """The least second difference, other than 0, of parts (parts, samples): of rounded numbers their last digit, which
    may change along a series as numbers of some significant digits pass 1; of others next to nothing."""
    least = np.where(parts > 0, parts, np.inf).min(axis=1, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)


def _runs(mask: Mask) -> list[tuple[int, int]]:
    """First index and length of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(last - first)) for first, last in zip(edges[::2], edges[1::2], strict=True)]


_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Blocks:
    """Blocks as long as their `taper` that start every `step` samples, detrended by `steadied`; `lines` of their
    spectra are kept."""

    taper: Floats
    step: int
    lines: slice
    steadied: Callable[[Floats], Floats]

    def of(self, signal: NDArray[np.generic]) -> NDArray[Any]:
        """(blocks, samples)."""
        return np.lib.stride_tricks.sliding_window_view(signal, len(self.taper))[:: self.step]

    def middles(self, samples: int) -> Floats:
        """The sample in the middle of each block (blocks,)."""
        size = len(self.taper)
        return np.asarray(np.arange(0, samples - size + 1, self.step) + size / 2, dtype=np.float64)

    def spectra(self, signal: Floats) -> Complexes:
        """(blocks, lines)."""
        return np.fft.rfft(self.steadied(self.of(signal)) * self.taper)[:, self.lines]


@dataclass(frozen=True)
class Frf:
    """Lines of a measured FRF: `frequency` [Hz], `values` [C/N], and γ² and the number of averages where known.

    `averages` counts independent blocks (overlapping ones count for less than one each); the coherence of a line
    averaged over one block is NaN. `defects` are those of the time series. `force_power` [N²] and `charge_power` [C²]
    are mean squared amplitudes; `passes` is the number of blocks in which the force has its power at a line,
    (Σ p)²/Σ p²; None for tones. `independent`: whether the noise of neighbouring lines is. `used`: the lines to use
    (`line_choice`), None if undetermined. `bias`: the removed bias of the `estimator` by noise, and `bias_unsure` its
    remaining uncertainty, both relative and about the same for all lines (`line_choice`).
    """

    frequency: Floats
    values: Complexes
    coherence: Floats | None = None
    averages: Floats | None = None
    defects: tuple[Defect, ...] = ()
    force_power: Floats | None = None
    charge_power: Floats | None = None
    independent: bool = True
    passes: Floats | None = None
    estimator: Estimator = "H1"
    used: Mask | None = None
    bias: float = 0.0
    bias_unsure: float = 0.0
    gain_change: GainChange | None = None

    @property
    def coherence_or_nan(self) -> Floats:
        """γ² of each line, NaN where it is not known."""
        return np.full(len(self.values), np.nan) if self.coherence is None else self.coherence

    def at(self, lines: Indices) -> "Frf":
        """The FRF at some of the lines."""
        columns = ("frequency", "values", "coherence", "averages", "force_power", "charge_power", "passes", "used")
        present = {name: column for name in columns if (column := getattr(self, name)) is not None}
        return replace(self, **{name: column[lines] for name, column in present.items()})

    @property
    def used_or_all(self) -> Mask:
        """The lines to use; all where undetermined."""
        return np.ones(len(self.values), dtype=bool) if self.used is None else self.used

    @property
    def relative_uncertainty(self) -> Floats | None:
        """Standard uncertainty of log|FRF|, and of the phase in radians; None where n is not known."""
        if self.coherence is None or self.averages is None:
            return None
        return np.sqrt((1 - self.coherence) / (2 * self.averages * np.maximum(self.coherence, 1e-12)))


def none_undamaged(every: Sequence[Defect]) -> InvalidInput:
    """The error where defects leave no block of a recording, by the first."""
    first, count = every[0], len(every)
    words = Finding(Reason.DEFECT, arguments=vars(first)).statement
    return unusable(first.channel, f"{count} defect{'s' * (count > 1)}", f"no undamaged block: {words}")


def averaged(force: Floats, charge: Floats, sample_rate: float, blocks: Blocks, estimator: Estimator) -> Frf:
    """The average over the undamaged blocks of force [N] and charge [C], sampled at `sample_rate` [Hz]."""
    defects = defects_of_pair(force, charge)
    undamaged = ~blocks.of(damaged(defects, len(force))).any(axis=1)
    count = int(undamaged.sum())
    if not count:
        raise none_undamaged(defects)
    force_spectra, charge_spectra = (blocks.spectra(signal)[undamaged] for signal in (force, charge))
    frequency: Floats = sample_rate * np.fft.rfftfreq(len(blocks.taper))[blocks.lines].astype(np.float64)
    averages = _independent_blocks(count, blocks.taper, blocks.step)
    kappa = noise_ratio([(force_spectra, charge_spectra)])
    values, coherence = ratio(force_spectra, charge_spectra, estimator, kappa)
    scale = 2 / blocks.taper.sum()
    force_power, charge_power = (np.abs(scale * spectra) ** 2 for spectra in (force_spectra, charge_spectra))
    return Frf(
        frequency,
        values,
        coherence if count > 1 else np.full_like(coherence, np.nan),
        np.full(len(frequency), averages),
        tuple(defects),
        force_power.mean(axis=0),
        charge_power.mean(axis=0),
        passes=force_power.sum(axis=0) ** 2 / np.maximum((force_power**2).sum(axis=0), _TINY),
        estimator=estimator,
        gain_change=gain_change(force_spectra, charge_spectra, blocks.middles(len(force))[undamaged] / sample_rate),
    )


def without_line(blocks: Floats) -> Floats:
    """The blocks (blocks, samples) less the least-squares line of each."""
    time = np.arange(blocks.shape[1]) - (blocks.shape[1] - 1) / 2
    level = blocks.mean(axis=1, keepdims=True)
    slope = (blocks @ time / (time @ time))[:, None]
    return blocks - level - slope * time


def _independent_blocks(count: int, taper: Floats, step: int) -> float:
    """The number of independent blocks equivalent to `count` overlapping ones (Welch 1967)."""
    power = taper @ taper
    excess = 0.0
    for lag in range(1, min(count, -(-len(taper) // step))):
        shared = float(taper[lag * step :] @ taper[: len(taper) - lag * step] / power)
        excess += 2 * (1 - lag / count) * shared**2
    return count / (1 + excess)


AROUND = 11  # lines whose median γ² is the expected one of the middle line


@dataclass(frozen=True)
class Stack:
    """Recordings on one grid of lines: `rows` are their indices; frequency (lines,), values (rows, lines), γ² or NaN,
    and the `used` lines of each recording, all where undetermined."""

    rows: Indices
    frequency: Floats
    values: Complexes
    coherence: Floats
    used: Mask

    def at(self, lines: Mask) -> "Stack":
        """The stack at some of the lines (lines,)."""
        columns = (self.values[:, lines], self.coherence[:, lines], self.used[:, lines])
        return Stack(self.rows, self.frequency[lines], *columns)

    def of(self, chosen: Mask) -> "Stack":
        """The stack of some of its recordings (rows,)."""
        columns = (self.values[chosen], self.coherence[chosen], self.used[chosen])
        return Stack(self.rows[chosen], self.frequency, *columns)

    @cached_property
    def weights(self) -> Floats:
        """γ²/(1 − γ²) of the used lines (rows, lines), the inverse variance of a line up to a factor, with the expected
        γ²; limited where γ² is near 1."""
        weights = np.zeros(self.coherence.shape)
        for row, (coherence, used) in enumerate(zip(self.coherence, self.used, strict=True)):
            weights[row, used] = information(expected_coherence(coherence[used]))
        return weights


def information(coherence: Floats) -> Floats:
    """γ²/(1 − γ²) of lines (lines,), 1 where γ² is not known."""
    weight = coherence / np.maximum(1 - coherence, 1e-3)
    return np.where(np.isfinite(coherence), np.maximum(weight, 1e-9), 1.0)


def expected_coherence(coherence: Floats) -> Floats:
    """γ² of each line (lines,) by those around it: weights by a line's own γ² would favour estimates too large."""
    if not np.isfinite(coherence).all() or len(coherence) < AROUND:
        return coherence
    return np.asarray(median_filter(coherence, AROUND, mode="nearest"))


def stacked(frfs: Sequence[Frf]) -> list[Stack]:
    """The recordings, stacked where they share the same lines."""
    members: dict[bytes, list[int]] = {}
    for row, frf in enumerate(frfs):
        members.setdefault(frf.frequency.tobytes(), []).append(row)
    stacks = []
    for rows in members.values():
        members_of_grid = [frfs[row] for row in rows]
        values = np.array([frf.values for frf in members_of_grid])
        coherence = np.array([frf.coherence_or_nan for frf in members_of_grid])
        used = np.array([frf.used_or_all for frf in members_of_grid])
        stacks.append(Stack(np.array(rows), frfs[rows[0]].frequency, values, coherence, used))
    return stacks
