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

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import product
from math import comb, log

import numpy as np
from scipy.optimize import nnls

from underskin.diagnosis.slips.comparison import LEAST_LINES, LEAST_RECORDINGS
from underskin.diagnosis.slips.levels import times
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.spectra import Frf
from underskin.units import Complexes, Floats, Indices, Mask

_BANDS = 24  # of equal width in the logarithm of frequency: a fraction of the width of any element
_MAINS_HZ, _NEAR_MAINS_HZ = (50.0, 60.0, 150.0, 180.0), 20.0  # mains pick-up has its own phase
_UNSURE = 6.0  # times a line's noise, which no step of noise exceeds
_WIDEST = 0.3  # rad, noise of a line above which the phase cannot be unwrapped
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
        if len(lines) < LEAST_LINES:
            continue
        logarithm = _logarithm(lines)
        second = np.abs(np.diff([logarithm.real, logarithm.imag], 2))
        noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0))
        if not 0 < noise < _WIDEST:
            continue
        band = np.clip(np.searchsorted(edges, frequency) - 1, 0, _BANDS - 1)
        rough += [(part, second / np.median(second)) for part in (band[:-2], band[1:-1], band[2:])]
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
    """The first band where unwrapping is ambiguous: the phase steps by half a turn within the noise of a line, as
    at a zero of the response or a sharp resonance."""
    steps = np.flatnonzero(np.abs(np.diff(logarithm.imag)) > np.pi - _UNSURE * noise)
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


_CHANNEL_DEVIATION = 1.5e-3  # of ln H: difference between channels
_IDEALISED = 0.08  # relative departure of a real FRF from the elements
_COST = 2.5  # of ½ χ², for each element
_SHAPES = 8  # corners of each kind of element, and three times as many resonances
_ZETAS = (0.02, 0.05, 0.14)  # of resonances, as in mechanisms/laws/contact_resonance.py
_TILT = 1e-2  # of the row that adds the costs to the squares; small enough that they stay linear


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


@dataclass(frozen=True)
class Elements:
    """ln H of elements with weights that are not negative (bands, elements), and the cost in ½ χ² of weight 1."""

    value: Complexes
    cost: Floats


def _together(parts: Sequence[Elements]) -> Elements:
    return Elements(np.hstack([part.value for part in parts]), np.concatenate([part.cost for part in parts]))


def _delay(frequency: Floats, sign: float) -> Elements:
    """A delay of 300 µs of the charge, or with sign −1 of the force, as typical of `timing_delay`."""
    return Elements(np.asarray(-6e-4j * sign * np.pi * frequency[:, None], dtype=np.complex128), np.ones(1))


def _causal(log_frf: LogFrf) -> list[Elements]:
    """The listed elements at typical strengths, with the priors of the mechanisms' files: high pass at 0.5 Hz, low pass
    at 300 Hz, relaxations of exponent 0.08 and of a step 0.4 at 20 Hz, resonance of a tip at 1 kHz with ζ = 0.05."""
    frequency = log_frf.frequency
    turn = 1j * frequency[:, None]

    def corners(usual: float, deviation: float, number: int) -> tuple[Floats, Floats]:
        score = np.linspace(-2.5, 2.5, number)
        return usual * np.exp(deviation * score), _COST + score**2 / 2

    high, high_cost = corners(0.5, 1.5, _SHAPES)
    low, low_cost = corners(300.0, 1.5, _SHAPES)
    step, step_cost = corners(20.0, 1.5, _SHAPES)
    natural, natural_cost = corners(1000.0, 2.3, 6 * _SHAPES)
    ratio = frequency[:, None, None] / (natural[:, None] * log_frf.spread)
    resonances = [-np.log(1 - ratio**2 + 2j * zeta * ratio).mean(axis=2) for zeta in _ZETAS]
    return [
        _delay(frequency, 1.0),
        Elements(-np.log(1 + high / turn), high_cost),
        Elements(-np.log(1 + turn / low), low_cost),
        Elements(-0.08 * np.log(turn), np.array([_COST])),
        Elements(np.log(1 + 0.4 / (1 + turn / step)), step_cost),
        Elements(np.hstack(resonances), np.concatenate([natural_cost + log(zeta / 0.05) ** 2 / 2 for zeta in _ZETAS])),
    ]


def _unlisted_chi2(log_frf: LogFrf) -> float:
    """χ² of the best part that vibrates within the band, such as a cable or a loose screw, or a notch:
    (A r² + B r)/(r² + 2ζr + 1), r = if/f1, of either sign and typically 0.3."""
    frequency = log_frf.frequency
    chi2 = []
    for natural, zeta in product(np.geomspace(frequency[0], frequency[-1], 3 * _SHAPES), (0.2, 0.4, 0.8)):
        turn = 1j * frequency / natural
        share = 0.3 / (turn**2 + 2 * zeta * turn + 1)
        parts = np.column_stack([share * turn**2, -share * turn**2, share * turn, -share * turn])
        chi2.append(_fit(log_frf, Elements(parts, np.ones(4)))[0])
    return 2 * _COST + min(chi2)


def _lead(log_frf: LogFrf, kinds: Sequence[Elements]) -> tuple[float, float]:
    """χ² of the best lag of the force channel, alone or beside one kind of elements, and its size [µs]
    in the simplest good fit."""
    lead = _delay(log_frf.frequency, -1.0)
    fits = [_fit(log_frf, _together([lead, *kind])) for kind in ((), *((kind,) for kind in kinds))]
    best = min(fits, key=lambda fit: fit[0])
    plain = fits[0] if fits[0][0] < best[0] + 2 * _PLAIN else best
    return best[0], 300.0 * float(plain[1][0])


def _fit(log_frf: LogFrf, elements: Elements) -> tuple[float, Floats]:
    """The least χ² including the costs, and the weights: of ½ |(y − A w)/d|² + cost · w over w ≥ 0."""
    size = _IDEALISED * np.abs(log_frf.value)
    weight = [
        1 / np.hypot(np.hypot(part, _CHANNEL_DEVIATION), size)
        for part in (log_frf.deviation.real, log_frf.deviation.imag)
    ]
    level = weight[0] ** 2 / (weight[0] ** 2).sum()
    columns = np.column_stack([log_frf.value, elements.value])
    real = (columns.real - level @ columns.real) * weight[0][:, None]
    rows = np.vstack([real, columns.imag * weight[1][:, None]])
    matrix, target = rows[:, 1:], rows[:, 0]
    weights, _ = nnls(np.vstack([matrix, _TILT * elements.cost]), np.append(target, -1 / _TILT))
    chi2 = float(((target - matrix @ weights) ** 2).sum() + 2 * elements.cost @ weights)
    return chi2, weights


_LARGEST = 0.7  # rad: limit that reduces the weight of sharp resonances, whose frequency differs between recordings
_RELAXATIONS, _COEFFICIENT = 4, 0.1  # terms of a smooth phase, and the prior standard deviation of each [rad]
_OVER_CHANNELS = 4.5  # of ln likelihood: phases of channels are ten times as frequent
_VARIED = (0.0, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4)  # of the mean phase: variation between recordings
_PLAIN = 14.0  # of χ²: about one campaign in a hundred has conjugated recordings


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
        times(recording, 1.0, -1.0) if wrong else recording for recording, wrong in zip(recordings, turned, strict=True)
    ], findings


def _aligned(bands: LogFrfBands) -> Floats:
    """The sign ±1 of each recording's phase (recordings,): all 1 where none contradicts the others, 0 without a
    phase."""
    telling = bands.telling
    same = telling.astype(float)
    if telling.sum() < LEAST_RECORDINGS:
        return same
    phase, weight = _phases(bands)
    smooth = _SmoothPhase(bands.frequency, weight)
    signs = _leading_signs(phase, weight) * same
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    choices = log(comb(int(telling.sum()), fewer)) + log(telling.sum())
    gain = smooth.evidence(phase, signs) - max(smooth.evidence(phase, same), 0.0)
    if fewer == 0 or gain < choices + _PLAIN / 2:
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

    def evidence(self, phase: Floats, signs: Floats) -> float:
        """ln evidence, relative to no phase."""
        pull = self.shapes.T @ (signs @ (self.weight * phase))
        explained = float(pull @ np.linalg.solve(self.information, pull))
        return 0.5 * (explained - float(np.linalg.slogdet(self.information)[1]))


def _of_two_signs(phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln likelihood of phases ±1 times the mean, relative to one phase plus a channel's own in each recording; in both
    they vary between recordings."""
    mean_phase = _mean(phase, weight, signs)
    information = (weight * mean_phase**2).sum(axis=1)
    informative = (signs != 0) & (information > 0)
    amplitude = _projection(phase, weight, mean_phase)[informative] / information[informative]
    variance = 1 / information[informative]
    share = float((signs[informative] < 0).mean())
    two_signs, one_sign = [], []
    for varied in _VARIED:
        spread = np.sqrt(variance + varied**2)
        parts = (
            np.log(1 - share) + _log_density(amplitude, 1.0, spread),
            np.log(share) + _log_density(amplitude, -1.0, spread),
        )
        two_signs.append(float(np.logaddexp(*parts).sum()))
        mean = float(np.average(amplitude, weights=spread**-2))
        one_sign.append(float(_log_density(amplitude, mean, spread).sum()))
    return max(two_signs) - max(one_sign)


def _log_density(value: Floats, mean: float, deviation: Floats) -> Floats:
    """Of a normal distribution, but for the constant."""
    return np.asarray(-0.5 * ((value - mean) / deviation) ** 2 - np.log(deviation))


def _orientation(recordings: Sequence[FrfRecording], bands: LogFrfBands, signs: Floats) -> tuple[int, float | None]:
    """1 where the listed mechanisms explain the aligned phase and not its conjugate; −1 where they explain the
    conjugate, and neither an unlisted part nor a lag of the force channel explains the phase itself; 0 where both are
    possible. Second, that lag [µs] where it is the alternative."""
    log_frf = _mean_log_frf(recordings, bands, signs)
    phase = log_frf.value.imag / np.hypot(log_frf.deviation.imag, _CHANNEL_DEVIATION)
    if phase @ phase < len(phase) + _PLAIN:
        return 0, None
    kinds = _causal(log_frf)
    given, turned = (_fit(either, _together(kinds))[0] for either in (log_frf, log_frf.conjugated))
    if min(given, turned) > 4 * len(log_frf.frequency):  # twice the number of values: neither is explained
        return 0, None
    if turned - given > _PLAIN:
        return 1, None
    if given - turned <= _PLAIN or turned - _unlisted_chi2(log_frf) > _PLAIN:
        return 0, None
    leading, lag_us = _lead(log_frf, kinds[1:])
    if turned - leading > _PLAIN:
        return 1, None
    return (-1, None) if leading - turned > _PLAIN else (0, lag_us)


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
    spread = np.quantile(natural / np.median(natural), np.linspace(0.0625, 0.9375, 8))
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
