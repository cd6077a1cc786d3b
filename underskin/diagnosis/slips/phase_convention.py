"""Imported FRFs in the other sign convention, e^(−iωt): conjugated, in some recordings or in all.

In the convention e^(+iωt) the phase of every causal, stable element between force and charge is tied to its magnitude:
a high pass, −ln(1 + f_c/(if)), leads where it attenuates; a low pass, −ln(1 + if/f_c), and a relaxation,
−n ln(if) + ln(1 + s/(1 + if/f_s)), lag where they fall; the resonance of a tip, −ln(1 − r² + 2iζr), lags above it; a
delay of the charge, −iωt0 with t0 ≥ 0, only lags. Elements in series add up with weights that are not negative, which
a conjugated FRF contradicts. Strengths have the catalogue's priors, so that no relaxation far below the band, of an
unphysical size, can stand for a conjugated high pass.

Some recordings: phase i is q_i = ±1 times one smooth phase φ. With the best signs the evidence must exceed that of
equal signs by the cost of choosing k of n recordings, and the sizes of the phases must be of two signs rather than a
channel's own phase in each recording. All recordings: the listed mechanisms explain the conjugate, and neither they
nor a vibrating part explain the phase as it is. Where a lag of the force channel explains it as well, both readings are
stated and nothing is changed.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import comb, log
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import log_ndtr
from scipy.stats import norm

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.spectra import Frf
from underskin.units import Complexes, Floats, Indices, Mask

_BANDS = 24  # of equal width in the logarithm of frequency
_LEAST_LINES = 6
_MAINS_HZ, _NEAR_MAINS_HZ = (50.0, 60.0, 150.0, 180.0), 20.0  # mains pick-up has its own phase
_STEP, _FAINT = 2.0, 0.3  # rad, and of the usual level: near a zero the phase may step either way
_UNSURE = 6.0  # times a line's noise
_WIDEST = 0.3  # rad, noise of a line above which the phase cannot be unwrapped
_SECOND = 0.6745 * np.sqrt(6.0)  # median magnitude of second differences over the noise of a line
_ENOUGH = 12  # second differences in a band, or in it and its two neighbours on either side


@dataclass(frozen=True)
class LogFrfBands:
    """ln FRF in bands of frequency (recordings, bands), without its real mean and the polarity; NaN where there is no
    line or the lines are too noisy. `deviation` is the noise of the real and of the imaginary part."""

    frequency: Floats  # (bands,)
    value: Complexes
    deviation: Floats
    followed: Mask  # below the first band where unwrapping is ambiguous: at a zero of the response or sharp resonance

    @property
    def telling(self) -> Mask:
        """Whether a recording has a value in any band (recordings,)."""
        return np.asarray(np.isfinite(self.value).any(axis=1))


def log_frf_bands(recordings: Sequence[FrfRecording]) -> LogFrfBands:
    """The bands of ln FRF of recordings."""
    measured = [lines_of(recording) for recording in recordings]
    lowest = min(float(frf.frequency.min()) for frf in measured)
    highest = max(float(frf.frequency.max()) for frf in measured)
    edges = np.geomspace(lowest * (1 - 1e-9), highest * (1 + 1e-9), _BANDS + 1)
    value = np.full((len(recordings), _BANDS), np.nan + 0j)
    followed = np.zeros(value.shape, dtype=bool)
    share, noises = np.full((len(recordings), _BANDS), np.nan), np.full(len(recordings), np.nan)
    rough: list[tuple[Indices, Floats]] = []
    for index, frf in enumerate(measured):
        frequency, lines = _usable(frf)
        if len(lines) < _LEAST_LINES:
            continue
        logarithm = _logarithm(lines)
        second = np.abs(np.diff([logarithm.real, logarithm.imag], 2)) / _SECOND
        noise = float(np.median(second))
        if not 0 < noise < _WIDEST:
            continue
        band = np.clip(np.searchsorted(edges, frequency) - 1, 0, _BANDS - 1)
        rough += [(part, second / noise) for part in (band[:-2], band[1:-1], band[2:])]
        followed[index] = np.arange(_BANDS) < _lost(logarithm, band, noise)
        count = np.bincount(band, minlength=_BANDS)
        with np.errstate(invalid="ignore", divide="ignore"):
            real, imaginary = (
                np.bincount(band, weights=part, minlength=_BANDS) / count for part in (logarithm.real, logarithm.imag)
            )
            share[index] = 1 / np.sqrt(count)
        value[index] = real - np.nanmean(real) + 1j * imaginary
        noises[index] = noise
    if rough:
        noises = np.maximum(noises, np.nanmedian(noises))
    return LogFrfBands(np.sqrt(edges[1:] * edges[:-1]), value, noises[:, None] * share * _unevenness(rough), followed)


def _usable(measured: Frf) -> tuple[Floats, Complexes]:
    """Frequency and value of the lines that are finite, not 0 and not near mains frequencies."""
    near_mains = np.min(np.abs(np.subtract.outer(measured.frequency, _MAINS_HZ)), axis=1) < _NEAR_MAINS_HZ
    usable = ~near_mains & np.isfinite(measured.values) & (np.abs(measured.values) > 0)
    return measured.frequency[usable], measured.values[usable]


def _lost(logarithm: Complexes, band: Indices, noise: float) -> int:
    """The first band where unwrapping is ambiguous: the phase steps near a zero of the response, or by half a turn
    within the noise of a line."""
    near_zero = np.minimum(logarithm.real[1:], logarithm.real[:-1]) < np.median(logarithm.real) + np.log(_FAINT)
    step = np.abs(np.diff(logarithm.imag))
    steps = np.flatnonzero((near_zero & (step > _STEP)) | (step > np.pi - _UNSURE * noise))
    return int(band[steps[0]]) if len(steps) else _BANDS


def _unevenness(rough: Sequence[tuple[Indices, Floats]]) -> Floats:
    """Noise of each band relative to all (bands,), from second differences `rough` of both parts (2, lines) of all
    recordings, using the smoother part, since a resonance adds curvature to the other."""
    profile = np.ones(_BANDS)
    if not rough:
        return profile
    band = np.concatenate([part for part, _ in rough])
    second = np.concatenate([part for _, part in rough], axis=1)
    for number in range(_BANDS):
        chosen = np.abs(band - number) <= (0 if (band == number).sum() >= _ENOUGH else 2)
        if chosen.sum() >= _ENOUGH:
            profile[number] = np.median(second[:, chosen], axis=1).min()
    return np.asarray(np.clip(profile, 0.3, 10.0))


def _logarithm(lines: Complexes) -> Complexes:
    """ln of the lines, the phase unwrapped from the lowest ones, where it is near 0 but for the polarity."""
    phase = np.unwrap(np.angle(lines))
    start = np.pi * np.round(np.median(phase[: max(3, len(phase) // 8)]) / np.pi)
    return np.asarray(np.log(np.abs(lines)) + 1j * (phase - start))


_CHANNEL_DEVIATION, _IDEALISED = (
    1.5e-3,
    0.08,
)  # of ln H: difference between channels, and relative departure of a real FRF from the laws
_TOLERANCE, _FARTHEST = 1e-3, 30.0  # of a fit, and the bound of its logarithms
_COST = 5.0  # of χ², for each law


@dataclass(frozen=True)
class _Law:
    """ln H(f; fit, spread), starting points of `fit`, and centre and deviation of the prior of each parameter.

    `spread` holds the contacts' natural frequencies over the median one.
    """

    value: Callable[[Floats, Floats, Floats], Complexes]
    starts: Callable[[Floats], tuple[tuple[float, ...], ...]]  # of the bands' frequencies
    centre: tuple[float, ...]
    deviation: tuple[float, ...]


def _exp(logarithm: float) -> float:
    return float(np.exp(np.clip(logarithm, -_FARTHEST, _FARTHEST)))


def _high_pass(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -np.log(1 + _exp(fit[0]) / (1j * frequency))


def _low_pass(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -np.log(1 + 1j * frequency / _exp(fit[0]))


def _relaxation(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    step = np.abs(fit[1]) / (1 + 1j * frequency / _exp(fit[2]))
    return -np.abs(fit[0]) * np.log(1j * frequency) + np.log(1 + step)


def _delay(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -2e-6j * np.pi * frequency * np.abs(fit[0])


def _lead(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -_delay(frequency, fit, _)


def _resonance(frequency: Floats, fit: Floats, spread: Floats) -> Complexes:
    ratio = frequency[:, None] / (_exp(fit[0]) * spread)
    return -np.log(1 - ratio**2 + 2j * _exp(fit[1]) * ratio).mean(axis=1)


def _loose_part(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    turn = 1j * frequency / _exp(fit[0])
    return np.log(1 + (fit[2] * turn**2 + fit[3] * turn) / (turn**2 + 2 * _exp(fit[1]) * turn + 1))


_DELAY = _Law(_delay, lambda f: ((1e4 / f[-1],),), (0.0,), (300.0,))
_LEAD = replace(_DELAY, value=_lead)
# As in the mechanisms' files: corner 0.5 Hz, upper corner 300 Hz, n 0.08, s 0.4 at 20 Hz, 300 µs, ζ 0.05.
# The resonance of a tip depends on contact and mass: 1 kHz within a factor of 10.
_LAWS: Mapping[str, _Law] = {
    "amplifier_high_pass": _Law(
        _high_pass, lambda f: ((np.log(f[0] / 20),), (np.log(f[0]),)), (-0.7,), (1.5,)
    ),
    "amplifier_low_pass": _Law(
        _low_pass, lambda f: ((np.log(f[-1]),), (np.log(3 * f[-1]),)), (5.7,), (1.5,)
    ),
    "sensor_relaxation": _Law(
        _relaxation,
        lambda f: ((0.01, 1e-3, np.log(20.0)), (1e-4, 0.05, np.log(20.0)), (1e-4, 0.05, np.log(f[-1]))),
        (0.0, 0.0, 3.0),
        (0.08, 0.4, 1.5),
    ),
    "timing_delay": _DELAY,
    "contact_resonance": _Law(
        _resonance,
        lambda f: tuple((np.log(times * f[-1]), -3.0) for times in (0.5, 1.3, 4.0)),
        (np.log(1000.0), -3.0),
        (2.3, 1.0),
    ),
}  # fmt: skip
# A part that vibrates within the band, such as a cable or a loose screw, or a notch: 1 + (A r² + B r)/(r² + 2ζr + 1),
# r = if/f1. It is unlisted, so that it may be of either sign.
_UNLISTED = _Law(
    _loose_part,
    lambda f: tuple((np.log(f[0]) + share * np.log(f[-1] / f[0]), -1.0, size, 0.0)
                    for share, size in product((0.4, 0.6, 0.8, 0.95), (-0.1, 0.1))),
    (5.0, -1.0, 0.0, 0.0),
    (1.5, 1.0, 0.3, 0.3),
)  # fmt: skip


@dataclass(frozen=True)
class LogFrf:
    """ln FRF over frequency (bands,), real part and phase each with its deviation, and the natural frequencies (any
    number,) of the contacts over the median one."""

    frequency: Floats
    value: Complexes
    deviation: Complexes  # of the real part and of the phase
    spread: Floats

    @property
    def conjugated(self) -> "LogFrf":
        """The same in the other sign convention."""
        return LogFrf(self.frequency, self.value.conj(), self.deviation, self.spread)


class Lead(NamedTuple):
    """χ² of the best fit with a lag of the force channel, as `misfit`, and that lag [µs]."""

    misfit: float
    lag_us: float


def misfit(log_frf: LogFrf) -> float:
    """χ² of the best fit of at most two mechanisms, including the costs of their priors and number."""
    single = {name: _nearest(log_frf, (law,))[0] for name, law in _LAWS.items()}
    first = min(single, key=lambda name: single[name])
    pairs = [_nearest(log_frf, (_LAWS[first], law))[0] for name, law in _LAWS.items() if name != first]
    return min(_nearest(log_frf, ())[0], single[first], *pairs)


def leading(log_frf: LogFrf) -> Lead:
    """The best fit of a lag of the force channel, alone or with one mechanism."""
    combinations = [(), *((law,) for law in _LAWS.values() if law is not _DELAY)]
    chi2, fit = min((_nearest(log_frf, (_LEAD, *laws)) for laws in combinations), key=lambda nearest: nearest[0])
    return Lead(chi2, abs(float(fit[0])))


def unlisted_misfit(log_frf: LogFrf) -> float:
    """χ² of the best fit of a vibrating part or a notch, with the same costs."""
    return _nearest(log_frf, (_UNLISTED,))[0]


def _nearest(log_frf: LogFrf, laws: tuple[_Law, ...]) -> tuple[float, Floats]:
    """χ² of the best fit including its costs, and the parameters of the laws."""
    ends = np.cumsum([0, *(len(law.centre) for law in laws)])
    centre = np.concatenate([[], *(law.centre for law in laws)])
    deviation = np.concatenate([[], *(law.deviation for law in laws)])
    size = _IDEALISED * np.abs(log_frf.value)
    weight = [
        1 / np.hypot(np.hypot(part, _CHANNEL_DEVIATION), size)
        for part in (log_frf.deviation.real, log_frf.deviation.imag)
    ]
    level = weight[0] ** 2 / (weight[0] ** 2).sum()

    def residual(fit: Floats) -> Floats:
        difference = log_frf.value - sum(
            law.value(log_frf.frequency, fit[first:last], log_frf.spread)
            for law, first, last in zip(laws, ends, ends[1:], strict=False)
        )
        parts = [
            (difference.real - level @ difference.real) * weight[0],
            difference.imag * weight[1],
            (fit - centre) / deviation,
        ]
        return np.concatenate(parts)

    if not laws:
        return float((residual(np.zeros(0)) ** 2).sum()), np.zeros(0)
    starts = [np.concatenate(start) for start in product(*(law.starts(log_frf.frequency) for law in laws))]
    fitted = (least_squares(residual, start, method="lm", ftol=_TOLERANCE, xtol=_TOLERANCE) for start in starts)
    best = min(fitted, key=lambda solution: float(solution.cost))
    return float(2 * best.cost) + _COST * len(laws), best.x


_LEAST = 3  # recordings with a phase, so that some can contradict the others
_LARGEST = 0.7  # rad: limit that reduces the weight of sharp resonances, whose frequency differs between recordings
_RELAXATIONS, _COEFFICIENT = 4, 0.1  # terms of a smooth phase, and the prior standard deviation of each [rad]
_PLAIN_SIGNS = 9.0  # of ln likelihood: about one campaign in a hundred has conjugated recordings
_OVER_CHANNELS = 6.0  # of ln likelihood: phases of channels are ten times as frequent
_CHANNEL = tuple(np.array([0.0, 0.5, 1, 2, 4, 8, 16]) * 1e-3)  # rad, a channel's own phase
_USUAL_CHANNEL = 3e-3
_VARIED = (0.0, 0.2, 0.5, 1.0)  # of the mean phase: variation between contacts
_STRAY, _STRAY_SIZE = 0.05, 3.0  # share of recordings of any phase, and its size over the mean phase
_PLAIN = 14.0  # χ² by which the listed mechanisms must explain one orientation better
_RARER = 10.0  # χ² by which an unlisted part must explain it better, since it is rarer
_STILL = 1.5e-3  # rad
_QUANTILES = np.linspace(0.0625, 0.9375, 8)  # of the contacts' natural frequencies, ∝ (force · radius)^(1/6)


def in_common_convention(
    recordings: Sequence[FrfRecording], imported: Collection[str]
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with conjugated ones corrected, and the finding; among those `imported` as FRFs (ids) only, since
    FRFs computed here are in the convention."""
    foreign, findings = _conjugation_undone([recording for recording in recordings if recording.id in imported])
    right = {recording.id: recording for recording in foreign}
    return [right.get(recording.id, recording) for recording in recordings], findings


def _conjugation_undone(recordings: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    if not recordings:
        return [], []
    bands = log_frf_bands(recordings)
    if not bands.telling.any():
        return list(recordings), []
    signs = _aligned(bands)
    orientation, lag_us = _orientation(recordings, bands, signs)
    findings = list[Finding]()
    if orientation == 0:  # undecided: the majority of recordings decides
        orientation = 1 if (signs < 0).sum() <= (signs > 0).sum() else -1
        if lag_us is not None and orientation == 1:
            findings.append(Finding(Reason.ALL_CONJUGATED, "", "frf_im_pc_per_n", {"lag_us": lag_us}))
    turned = orientation * signs < 0
    if not turned.any():
        return list(recordings), findings
    ids = [recording.id for recording, wrong in zip(recordings, turned, strict=True) if wrong]
    if turned[bands.telling].all():
        turned = np.ones(len(recordings), dtype=bool)
        findings.append(Finding(Reason.ALL_CONJUGATED, "", "frf_im_pc_per_n", {"lag_us": None}))
    else:
        arguments = {"conjugated": ids, "recordings": len(recordings)}
        about = ids[0] if len(ids) == 1 else ""
        findings.append(Finding(Reason.RECORDINGS_CONJUGATED, about, "frf_im_pc_per_n", arguments))
    return [
        _conjugated(recording) if wrong else recording for recording, wrong in zip(recordings, turned, strict=True)
    ], findings


def _aligned(bands: LogFrfBands) -> Floats:
    """The sign ±1 of each recording's phase (recordings,): all 1 where none contradicts the others, 0 without a
    phase."""
    telling = bands.telling
    same = telling.astype(float)
    if telling.sum() < _LEAST:
        return same
    phase, weight = _phases(bands)
    smooth = _SmoothPhase(bands.frequency, weight)
    signs = _leading_signs(phase, weight) * same
    for _ in range(10):
        better = np.where(_projection(phase, weight, smooth.of(phase, signs)) < 0, -1.0, 1.0) * same
        if (better == signs).all():
            break
        signs = better
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    choices = log(comb(int(telling.sum()), fewer)) + log(telling.sum())
    gain = smooth.evidence(phase, signs) - max(smooth.evidence(phase, same), 0.0)
    if fewer == 0 or gain < choices + _PLAIN_SIGNS:
        return same
    return signs if _of_two_signs(phase, weight, signs) > _OVER_CHANNELS else same


class _SmoothPhase:
    """A smooth phase over frequency, times the sign of each recording: a sum of the phases of delay, loss, relaxation
    and high pass with normal coefficients."""

    def __init__(self, frequency: Floats, weight: Floats) -> None:
        ratio = frequency[:, None] / np.geomspace(frequency[0], frequency[-1], _RELAXATIONS)
        shapes = [frequency[:, None] / frequency[-1], np.ones((len(frequency), 1)), frequency[0] / frequency[:, None]]
        self.shapes = _COEFFICIENT * np.concatenate([*shapes, ratio / (1 + ratio**2)], axis=1)
        self.weight = weight
        self.information = self.shapes.T @ (weight.sum(axis=0)[:, None] * self.shapes) + np.eye(self.shapes.shape[1])

    def of(self, phase: Floats, signs: Floats) -> Floats:
        """The phase (bands,) from phases (recordings, bands) and signs (recordings,)."""
        return np.asarray(self.shapes @ np.linalg.solve(self.information, self._pull(phase, signs)))

    def evidence(self, phase: Floats, signs: Floats) -> float:
        """ln evidence, relative to no phase."""
        pull = self._pull(phase, signs)
        explained = float(pull @ np.linalg.solve(self.information, pull))
        return 0.5 * (explained - float(np.linalg.slogdet(self.information)[1]))

    def _pull(self, phase: Floats, signs: Floats) -> Floats:
        return np.asarray(self.shapes.T @ (signs @ (self.weight * phase)))


def _of_two_signs(phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln likelihood of phases ±1 times the mean, relative to one phase plus a channel's own in each recording; in both
    a few recordings are stray."""
    mean_phase = _mean(phase, weight, signs)
    information = (weight * mean_phase**2).sum(axis=1)
    informative = (signs != 0) & (information > 0)
    amplitude, variance = (
        _projection(phase, weight, mean_phase)[informative] / information[informative],
        1 / information[informative],
    )
    size = np.sqrt((weight * mean_phase**2).sum() / weight.sum())
    share = min((signs[informative] < 0).mean(), (signs[informative] > 0).mean())
    usual = 1.0 if (signs < 0).sum() < (signs > 0).sum() else -1.0
    stray = np.log(_STRAY) + norm.logpdf(amplitude, 0.0, _STRAY_SIZE)
    two_signs, one_sign = [], []
    for channel, varied in product(_CHANNEL, _VARIED):
        spread = np.sqrt(variance + (channel / size) ** 2)
        same, opposite = (_log_density(sign * usual * amplitude, spread, varied) for sign in (1, -1))
        mean = float(np.average(amplitude, weights=spread**-2))
        shifted = norm.logpdf(amplitude, mean, np.hypot(spread, varied)) if varied < 1 else same
        either = np.logaddexp(np.log1p(-share) + same, np.log(share) + opposite)
        prior = -0.5 * (channel / _USUAL_CHANNEL) ** 2
        two_signs.append(prior + float(np.logaddexp(either + np.log1p(-_STRAY), stray).sum()))
        one_sign.append(prior + float(np.logaddexp(shifted + np.log1p(-_STRAY), stray).sum()))
    return max(two_signs) - max(one_sign)


def _log_density(amplitude: Floats, spread: Floats, varied: float) -> Floats:
    """Log density of amplitudes near 1 that vary by `varied` between contacts, or exponentially if that is 1, with
    noise `spread`."""
    if varied < 1:
        return np.asarray(norm.logpdf(amplitude, 1.0, np.hypot(spread, varied)))
    size = float(np.abs(amplitude).mean())
    ratio = spread / size
    return np.asarray(ratio**2 / 2 - amplitude / size - np.log(size) + log_ndtr(amplitude / spread - ratio))


def _orientation(recordings: Sequence[FrfRecording], bands: LogFrfBands, signs: Floats) -> tuple[int, float | None]:
    """1 where the listed mechanisms explain the aligned phase and not its conjugate; −1 where they explain the
    conjugate, and neither an unlisted part nor a lag of the force channel explains the phase itself; 0 where both are
    possible. Second, that lag [µs] where it is the alternative."""
    log_frf = _mean_log_frf(recordings, bands, signs)
    phase = log_frf.value.imag / np.hypot(log_frf.deviation.imag, _STILL)
    if phase @ phase < len(phase) + _PLAIN:
        return 0, None
    given, turned = misfit(log_frf), misfit(log_frf.conjugated)
    if turned - given > _PLAIN:
        return 1, None
    if given - turned <= _PLAIN or turned - unlisted_misfit(log_frf) >= _RARER:
        return 0, None
    lead = leading(log_frf)
    if turned - lead.misfit > _PLAIN:
        return 1, None
    return (-1, None) if lead.misfit - turned > _PLAIN else (0, lead.lag_us)


def _mean_log_frf(recordings: Sequence[FrfRecording], bands: LogFrfBands, signs: Floats) -> LogFrf:
    """The mean of the aligned ln FRFs; its deviation is from the recordings' noise, or their scatter if larger."""
    aligned = np.where(signs[:, None] < 0, bands.value.conj(), bands.value)
    usable = np.isfinite(aligned) & np.isfinite(bands.deviation) & bands.followed
    weight = np.where(usable, bands.deviation, np.inf) ** -2.0
    aligned = np.where(usable, aligned, 0.0)
    total = weight.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        noise = total**-0.5
        mean = (weight * aligned).sum(axis=0) / total
        parts = [np.sqrt((weight * part**2).sum(axis=0) / total / usable.sum(axis=0)) for part in (
            (aligned - mean).real, (aligned - mean).imag)]  # fmt: skip
    real, imaginary = (np.maximum(noise, part) for part in parts)
    used = total > 0
    natural = np.array([(recording.preload_n * recording.indenter_radius_mm) ** (1 / 6) for recording in recordings])
    spread = np.quantile(natural / np.median(natural), _QUANTILES)
    return LogFrf(bands.frequency[used], mean[used], (real + 1j * imaginary)[used], spread)


def _phases(bands: LogFrfBands) -> tuple[Floats, Floats]:
    """Phase [rad] and weight [rad⁻²] (recordings, bands), 0 where there is none."""
    usable = np.isfinite(bands.value) & np.isfinite(bands.deviation) & bands.followed
    phase = np.clip(np.where(usable, bands.value, 0).imag, -_LARGEST, _LARGEST)
    return phase, np.where(usable, bands.deviation, np.inf) ** -2.0


def _leading_signs(phase: Floats, weight: Floats) -> Floats:
    vectors, _, _ = np.linalg.svd(phase * np.sqrt(weight), full_matrices=False)
    return np.where(vectors[:, 0] * np.sign(vectors[:, 0].sum() or 1.0) < 0, -1.0, 1.0)


def _mean(phase: Floats, weight: Floats, signs: Floats) -> Floats:
    total = (weight * np.abs(signs)[:, None]).sum(axis=0)
    return np.asarray((signs[:, None] * weight * phase).sum(axis=0) / np.where(total > 0, total, 1.0))


def _projection(phase: Floats, weight: Floats, mean_phase: Floats) -> Floats:
    return np.asarray((weight * phase * mean_phase).sum(axis=1))


def _conjugated(recording: FrfRecording) -> FrfRecording:
    assert recording.frf_im_pc_per_n is not None
    return replace(recording, frf_im_pc_per_n=-recording.frf_im_pc_per_n)
