"""FRFs (charge over force) estimated from time series, with the delay between channels, and checks of both.

Convention e^(+iωt): a charge that lags the force has a negative phase. Spectra are averaged over n blocks; the FRF is
their H1, H2 or Hv (equations in `estimators`), with the coherence γ² and (Bendat and Piersol, Random Data, chapter 9)
    var log|H| = var phase = (1 − γ²)/(2 n γ²)    var γ² = 2 γ² (1 − γ²)²/n.

Two recorders, filters and converter pipelines delay a channel by a sample to tenths of a second; then Re FRF is
multiplied by cos(ωτ) and may have any sign.

Resonance: for a mass on a spring, 1/(1 − r² + 2iζr) with r = f/f0, the inverse squared magnitude (1 − r²)² + 4ζ²r² is
quadratic in f², a linear fit of three unknowns, independent of the phase (Ewins, Modal Testing, 2nd ed., 2000, section
4.2, for the complex inverse).

Force and charge look exchanged where the charge has the declared mean and oscillation of the force, and the force has
not.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from underskin.errors import InvalidInput, not_finite, out_of_range, too_few, unequal_lengths, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import DefectKind
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimators import Estimator, noise_ratio, ratio
from underskin.recordings.frf.spectra import (
    Blocks,
    Defect,
    Frf,
    Stack,
    averaged,
    damaged,
    defects_of_pair,
    none_undamaged,
    period_of,
    without_drift,
    without_line,
)
from underskin.recordings.frf.stepped_sine import Step, find_steps, settled, step_amplitudes
from underskin.units import Complexes, Floats, Mask, to_si

_LARGEST = 0.25  # largest lag, of a record
_STANDS_OUT = 8.0  # least peak, over the rms of the correlation: noise alone reaches it once in 1e15
_AS_HIGH = 0.9  # of the highest peak: with a periodic force the nearest of several peaks is used
# Of a block: with Hann's window a lag lowers γ² by (2π²/3)(lag/block)², as noise of 1e-5 of the power does
_UNHARMED = 1e-3
# Share of the in-phase power at the best delay that is reached without a delay: above it there is none
_IN_PHASE = 0.9
_EXPLAINED = 0.5  # least in-phase share of the power at the best delay: half a turn past a resonance leaves 0.4
_STEPS = 6  # delays tried for one turn of the highest line
_MOST_DELAYS = 8192
_CHUNK = 256  # delays at a time
_CORNERS = 20  # of a pole, over the outermost line, as tried


def lag_between(force: Floats, charge: Floats, block: int) -> int:
    """The lag of the charge behind the force in samples, negative where the force is late.

    The position of the highest peak of their cross-correlation, drift and preload removed; 0 where no peak is
    significant, or where the lag is too small compared with a `block` (samples) to affect the spectra.

    Source
    ------
    Bendat and Piersol, Random Data, 4th ed., 2010, section 9.3 (bias of a coherence by a delay).
    """
    from scipy.signal import correlate, detrend  # takes 0.3 s to load, which few need

    likeness = np.abs(correlate(detrend(charge), detrend(force), method="fft"))
    lags = np.arange(len(likeness)) - (len(force) - 1)
    near = np.abs(lags) <= min(_LARGEST * len(force), len(force) - block)
    likeness, lags = likeness[near], lags[near]
    highest = float(likeness.max(initial=0.0))
    if not highest > _STANDS_OUT * float(np.sqrt(np.mean(likeness**2))):
        return 0
    peaks = lags[likeness >= _AS_HIGH * highest]
    lag = int(peaks[np.argmin(np.abs(peaks))])
    return lag if abs(lag) > _UNHARMED * block else 0


def common_delay(stacks: Sequence[Stack]) -> float:
    """The delay [s] of the charge common to all recordings, negative where the force is late.

    It maximises Σ (Re Σ w u e^(iωτ))² of the lines' phase factors u with weights w, so that most lines are in phase or
    in antiphase with the force. It is 0 where the lines are in phase without a delay (but for the sign of a recording),
    and where no delay brings most of them in phase, as above a resonance and for noise.
    """
    parts = _weighted(stack for stack in stacks if len(stack.frequency) > 1)
    if not parts:
        return 0.0
    undelayed = float(_in_phase(parts, np.zeros(1))[0])
    if undelayed >= _IN_PHASE:
        return 0.0
    best, explained = _best_delay(parts)
    return best if explained > _EXPLAINED and undelayed < _IN_PHASE * explained else 0.0


def common_phase(stacks: Sequence[Stack]) -> float:
    """The phase [rad] common to all lines of all recordings, from −π/2 to π/2: half a turn is a polarity.

    With S the sum of w u over the lines of a recording, arg(Σ S²)/2 maximises Σ (Re S e^(−iφ))², which then is
    (Σ |S|² + |Σ S²|)/2. It is 0 where it brings too few lines in phase, and where a delay, or one pole with its corner
    outside the lines, leaves less than half of the power out of phase: these turn the phase over frequency.
    """
    parts = _weighted(stacks)
    if not parts:
        return 0.0
    sums = np.concatenate([factors.sum(axis=1) for _, factors in parts])
    squares, total = complex((sums**2).sum()), _total(parts)
    left = 1 - float((np.abs(sums) ** 2).sum() + abs(squares)) / (2 * total)
    several = [part for part in parts if len(part[0].frequency) > 1]
    delayed = _best_delay(several)[1] if several else 0.0
    turning = left / 2 >= 1 - max(_best_pole(parts), delayed)
    return 0.0 if turning or left > 1 - _EXPLAINED else float(np.angle(squares)) / 2


def _best_pole(parts: Sequence["_Weighted"]) -> float:
    """The largest share in phase without the phase of one pole whose corner lies outside the lines."""
    lowest = min(float(stack.frequency.min()) for stack, _ in parts)
    highest = max(float(stack.frequency.max()) for stack, _ in parts)

    def share(high_pass_hz: float, low_pass_hz: float) -> float:
        power = 0.0
        for stack, factors in parts:
            turn = np.arctan2(high_pass_hz, stack.frequency) - np.arctan2(stack.frequency, low_pass_hz)
            power += float(((factors @ np.exp(-1j * turn)).real ** 2).sum())
        return power / _total(parts)

    ratios = np.linspace(1 / _CORNERS, 1.0, _CORNERS).tolist()
    high_passes = [share(ratio * lowest, np.inf) for ratio in ratios]
    return max(high_passes + [share(0.0, highest / ratio) for ratio in ratios])


_Weighted = tuple[Stack, Complexes]  # with the weighted phase factors w u of its lines (rows, lines)


def _weighted(stacks: Iterable[Stack]) -> list[_Weighted]:
    """The stacks with any weight."""
    parts = [(stack, stack.weights * _phase_factors(stack.values)) for stack in stacks]
    return parts if _total(parts) > 0 else []


def _total(parts: Sequence[_Weighted]) -> float:
    """The power of lines all in phase."""
    return sum(float((stack.weights.sum(axis=1) ** 2).sum()) for stack, _ in parts)


def _in_phase(parts: Sequence[_Weighted], delays: Floats) -> Floats:
    """The share of the power that is in phase or in antiphase at each delay [s] of the charge."""
    power = np.zeros(len(delays))
    for first in range(0, len(delays), _CHUNK):
        chunk = delays[first : first + _CHUNK]
        for stack, factors in parts:
            turned = factors @ np.exp(2j * np.pi * np.outer(stack.frequency, chunk))
            power[first : first + _CHUNK] += (turned.real**2).sum(axis=0)
    return power / _total(parts)


def _best_delay(parts: Sequence[_Weighted]) -> tuple[float, float]:
    """The delay [s] with the highest share in phase, and that share."""
    highest = max(float(stack.frequency.max()) for stack, _ in parts)
    spacing = max(float(np.median(np.diff(stack.frequency))) for stack, _ in parts)
    count = min(int(np.ceil(_STEPS * highest / spacing)), _MOST_DELAYS)
    step = 1 / (_STEPS * highest)
    delays: Floats = step * np.arange(-(count // 2), count // 2 + 1).astype(np.float64)
    for _ in range(3):
        power = _in_phase(parts, delays)
        peaks = delays[power >= power.max() * (1 - 1e-9)]  # few lines cannot resolve them
        best = peaks[np.argmin(np.abs(peaks))]
        delays = np.asarray(best + np.arange(-_STEPS, _STEPS + 1) * (step / _STEPS), dtype=np.float64)
        step /= _STEPS
    return float(best), float(power.max())


def without_delay(stacks: Sequence[Stack], delay: float) -> list[Stack]:
    """The FRFs corrected for a delay of the charge [s]."""
    if delay == 0.0:
        return list(stacks)
    return [replace(stack, values=advanced(stack.values, stack.frequency, delay)) for stack in stacks]


def advanced(values: Complexes, frequency: Floats, delay: float) -> Complexes:
    """An FRF (…, lines) corrected for a delay of the charge [s]."""
    return np.asarray(values * np.exp(2j * np.pi * frequency * delay))


def _phase_factors(values: Complexes) -> Complexes:
    valid = np.isfinite(values) & (values != 0)
    return np.where(valid, np.exp(1j * np.angle(np.where(valid, values, 1.0))), 0.0)


_BLOCKS = 15  # half-overlapping blocks of a broadband record by default: a resolution of 8 / its length


def lines_of(recording: FrfRecording) -> Frf:
    """The FRF of a recording: its lines, or the estimate from its time series by its estimator (default H1)."""
    if recording.sample_rate_hz is not None:
        assert recording.force_n is not None
        assert recording.charge_pc is not None
        force, charge = to_si("force_n", recording.force_n), to_si("charge_pc", recording.charge_pc)
        return estimate(force, charge, recording.sample_rate_hz, estimator=recording.estimator or "H1")
    assert recording.frequency_hz is not None
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    values = to_si("frf_pc_per_n", recording.frf_re_pc_per_n) + 1j * to_si("frf_pc_per_n", recording.frf_im_pc_per_n)
    return Frf(recording.frequency_hz, values, recording.coherence)


def estimate(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF by the method that suits the force.

    Stepped sine where the force dwells on tones, periodic where it repeats itself, else broadband.

    Parameters
    ----------
    force, charge : (samples,) arrays
        Time series [N], [C], of one length.
    sample_rate : float
        [Hz].
    estimator : "H1", "H2" or "Hv"
        Which noise it is unbiased by: see `estimators`.

    Returns
    -------
    Frf
        Frequencies [Hz], values [C/N], coherence and number of averages (lines,).

    Raises
    ------
    InvalidInput
        The series differ in length, are shorter than 8 samples or not finite, or no undamaged part is left.
    """
    _check(force, charge, sample_rate)
    if find_steps(force, sample_rate):
        return stepped_sine(force, charge, sample_rate, estimator=estimator)
    if period_of(force):
        return periodic(force, charge, sample_rate, estimator=estimator)
    return broadband(force, charge, sample_rate, estimator=estimator)


def broadband(
    force: Floats,
    charge: Floats,
    sample_rate: float,
    *,
    block_samples: int | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    estimator: Estimator = "H1",
) -> Frf:
    """The FRF of a broadband force: Welch's average over blocks, at the multiples of sample_rate/block_samples.

    Parameters and errors are those of `estimate`; a block has 8 samples to all of the series, without `block_samples`
    1/8 of it; the next one has the share `overlap`, less than 1, in common with it. The straight line through each
    block (preload, DC and drift) is removed, and the `window` applied, a name of `scipy.signal.get_window`. The lines
    at 0 Hz and at half the sample rate, which carry no phase, are left out, as are blocks with a defect. A lag between
    the signals, which would lower H1, is removed first and restored in the phase, where that raises γ².

    Source: Welch 1967; Bendat and Piersol, Random Data, chapters 5 and 9.
    """
    _check(force, charge, sample_rate)
    size = block_samples or max(8, 2 * len(force) // (_BLOCKS + 1))
    if not 8 <= size <= len(force):
        raise out_of_range("block_samples", size, f"must be 8 to {len(force)}, the length of the signals")
    if not 0 <= overlap < 1:
        raise out_of_range("overlap", overlap, "must be 0 or greater and less than 1")
    blocks = Blocks(_taper(window, size), max(1, round(size * (1 - overlap))), slice(1, (size + 1) // 2), without_line)
    frf = replace(averaged(force, charge, sample_rate, blocks, estimator), independent=False)
    lag = lag_between(force, charge, size)
    if not lag:
        return frf
    try:
        aligned = replace(averaged(*_aligned(force, charge, lag), sample_rate, blocks, estimator), independent=False)
    except InvalidInput:  # the lag leaves no undamaged block
        return frf
    return _as_recorded(aligned, lag, sample_rate) if _coherence(aligned) > _coherence(frf) else frf


def _coherence(frf: Frf) -> float:
    """The mean γ², by the power of the force."""
    assert frf.force_power is not None
    return float(frf.force_power @ frf.coherence_or_nan) / float(frf.force_power.sum())


def _aligned(force: Floats, charge: Floats, lag: int) -> tuple[Floats, Floats]:
    """Both signals without a lag of the charge by `lag` samples."""
    return (force[: len(force) - lag], charge[lag:]) if lag >= 0 else (force[-lag:], charge[:lag])


def _as_recorded(aligned: Frf, lag: int, sample_rate: float) -> Frf:
    """The FRF of aligned signals with the lag restored in its phase, and defects at their recorded samples."""
    cut = {"charge_pc": max(lag, 0), "force_n": max(-lag, 0)}
    defects = tuple(
        replace(defect, first_sample=defect.first_sample + cut[defect.channel]) for defect in aligned.defects
    )
    return replace(aligned, values=advanced(aligned.values, aligned.frequency, -lag / sample_rate), defects=defects)


def periodic(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF of a periodic force: the average over all pairs of consecutive periods T.

    With Hann's window over two of them the lines at the multiples of 1/T are free of leakage; those below half the
    sample rate are given. Parameters are those of `estimate`; raises InvalidInput, also where the force has no period,
    or no two undamaged periods in a row are left.

    Source: Pintelon and Schoukens, System Identification, 2012, chapter 2.
    """
    _check(force, charge, sample_rate)
    period = period_of(force)
    if not period:
        raise unusable("force_n", f"{len(force)} samples", "must repeat itself at least four times")
    blocks = Blocks(_taper("hann", 2 * period), period, slice(2, period, 2), without_drift)
    return averaged(force, charge, sample_rate, blocks, estimator)


def stepped_sine(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF of a stepped-sine force: synchronous demodulation of each tone that the force dwells on.

    Least squares on sine, cosine, DC and drift; a few whole cycles are one block of the average. There is one line for
    each tone, in order of frequency. Parameters are those of `estimate`; raises InvalidInput, also where the force
    dwells on no tone, or no cycle is undamaged.
    """
    _check(force, charge, sample_rate)
    steps = find_steps(force, sample_rate)
    defects = [
        defect
        for defect in defects_of_pair(force, charge)
        if any(
            defect.first_sample < step.last - 1 and defect.first_sample + defect.samples > settled(step, sample_rate)
            for step in steps
        )
    ]  # between the steps a jump is the step itself
    bad = damaged(defects, len(force))
    defects = _without_switches(defects, steps, sample_rate)
    lines: dict[float, list[tuple[Complexes, Complexes]]] = {}
    for step in steps:
        pair = step_amplitudes(force, charge, sample_rate, step, bad)
        if len(pair[0]):
            alike = (line for line in lines if abs(line - step.frequency) < 1e-3 * step.frequency)
            lines.setdefault(next(alike, step.frequency), []).append(pair)
    if not lines and defects:
        raise none_undamaged(defects)
    if not lines:
        by_channel = {name: [one for one in defects if one.channel == name] for name in ("force_n", "charge_pc")}
        worst, of_worst = max(by_channel.items(), key=lambda pair: sum(defect.samples for defect in pair[1]))
        kinds = "; ".join(dict.fromkeys(defect.kind.words for defect in of_worst))
        seen = f"{len(of_worst)} defects, samples that {kinds}" if of_worst else "no tone"
        raise unusable(worst, seen, "must dwell on a tone for some undamaged cycles")
    frequency = np.array(sorted(lines))
    values, coherence, averages = np.empty(len(lines), complex), np.empty(len(lines)), np.empty(len(lines))
    spectra = [tuple(np.concatenate(part)[:, None] for part in zip(*lines[line], strict=True)) for line in frequency]
    kappa = noise_ratio((tone, answer) for tone, answer in spectra)
    for index, (tone, answer) in enumerate(spectra):
        value, gamma2 = ratio(tone, answer, estimator, kappa)
        values[index], averages[index] = value[0], len(tone)
        coherence[index] = gamma2[0] if len(tone) > 1 else np.nan
    return Frf(frequency, values, coherence, averages, tuple(defects))


def _without_switches(defects: Sequence[Defect], steps: Sequence[Step], sample_rate: float) -> list[Defect]:
    """The defects without the last jump of each channel in the last cycle of a step that another follows: crossings
    tell the sample where tones change to a cycle."""
    switches: dict[tuple[str, int], Defect] = {}
    for number, step in enumerate(steps[:-1]):
        for defect in sorted(defects, key=attrgetter("first_sample")):
            if defect.kind == DefectKind.JUMP and 0 < step.last - defect.first_sample <= sample_rate / step.frequency:
                switches[defect.channel, number] = defect
    return [defect for defect in defects if defect not in switches.values()]


def _check(force: Floats, charge: Floats, sample_rate: float) -> None:
    if len(force) != len(charge):
        raise unequal_lengths("charge_pc", len(charge), len(force), "force_n", "samples")
    if len(force) < 8:
        raise too_few("force_n", f"{len(force)} samples", "must have at least 8")
    if not (np.isfinite(sample_rate) and sample_rate > 0):
        raise not_finite("sample_rate_hz", sample_rate, "must be finite and greater than 0")
    for name, signal in (("force_n", force), ("charge_pc", charge)):
        bad: Mask = ~np.isfinite(signal)
        if bad.any():
            raise not_finite(name, "not finite", index=int(np.argmax(bad)))


def _taper(window: str, size: int) -> Floats:
    from scipy.signal import get_window  # takes 0.3 s to load, which few need

    return np.asarray(get_window(window, size), dtype=np.float64)


_PEAK_STANDS_OUT = 2.0  # times the median magnitude
_FEWEST, _WIDTH = 7, 0.4  # lines around the highest, or all within that share of its frequency
_LEAST_DAMPING = 1e-3


class Resonance(NamedTuple):
    """Natural frequency [Hz] and damping ratio ζ."""

    frequency: float
    damping: float


def resonance(frf: Frf) -> Resonance | None:
    """The resonance at the highest finite line, where a peak stands out within the band; else None."""
    finite = np.isfinite(frf.values)
    if not finite.any():
        return None
    frequency, size = frf.frequency[finite], np.abs(frf.values[finite])
    peak = int(np.argmax(size))
    if not 0 < peak < len(size) - 1 or size[peak] < _PEAK_STANDS_OUT * np.median(size):
        return None
    away = np.abs(frequency - frequency[peak])
    near = away <= max(_WIDTH * frequency[peak], np.sort(away)[min(_FEWEST, len(away)) - 1])
    square = (frequency[near] / frequency[peak]) ** 2
    relative = size[near] / size[peak]
    # Σ w (1/|y|² − a − b f² − c f⁴)² with w ∝ |y|⁶, as noise of one size on all lines has it.
    columns = np.stack([np.ones_like(square), square, square**2]) * relative**3
    a, b, c = np.linalg.lstsq(columns.T, relative, rcond=None)[0]
    if not (a > 0 and c > 0):
        return None
    natural = (a / c) ** 0.25
    damping = 0.5 * np.sqrt(max(b / np.sqrt(a * c) + 2, 0.0))
    return Resonance(float(frequency[peak] * natural), float(max(damping, _LEAST_DAMPING)))


_AS_DECLARED = float(np.log(1.4))
_PARTS = 8  # parts of a record that are detrended; blocks of its analysis have that length
_TINY = 1e-300


def exchanged_channels(recording: FrfRecording) -> Finding | None:
    """A finding where the two channels of a recording look exchanged."""
    if recording.force_n is None or recording.charge_pc is None:
        return None
    if not _declared(recording.charge_pc, recording) or _declared(recording.force_n, recording):
        return None
    means = {"force_mean_n": float(np.mean(recording.force_n)), "charge_mean_pc": float(np.mean(recording.charge_pc))}
    return Finding(Reason.CHANNELS_SWAPPED, recording.id, "force_n", {**means, "preload_n": recording.preload_n})


def oscillation_of(force: Floats) -> Floats:
    """√2 times the standard deviation of a force without its drift, and its peak [N]."""
    parts = np.arange(0, len(force), max(len(force) // _PARTS, _PARTS))
    from scipy.signal import detrend  # takes 0.3 s to load, which few need

    drift_free = detrend(force, bp=parts)
    return np.array([np.sqrt(2.0) * np.std(drift_free), np.max(np.abs(drift_free))])


def _declared(signal: Floats, recording: FrfRecording) -> bool:
    """Whether a signal has the declared preload as its mean and the declared dynamic force as its oscillation."""
    ratios = np.append(oscillation_of(signal) / recording.dynamic_force_n, np.mean(signal) / recording.preload_n)
    near = np.abs(np.log(np.maximum(ratios, _TINY))) < _AS_DECLARED
    return bool(near[:-1].any() and near[-1])
