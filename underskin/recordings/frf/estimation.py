"""The FRF, charge over force, from time series: for stepped sine, periodic and broadband forces.

Convention e^(+iωt): a charge that lags the force has a negative phase. Spectra are averaged over n blocks, and the FRF
is H1, H2 or Hv of them (`estimators` has the equations), with the coherence γ² and (Bendat and Piersol, Random Data,
chapter 9)
    var log|H| = var phase = (1 − γ²)/(2 n γ²)    var γ² = 2 γ² (1 − γ²)²/n.
"""

from dataclasses import replace

import numpy as np

from underskin.errors import InvalidInput, not_finite, out_of_range, too_few, unequal_lengths, unusable
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.delay import advanced, lag_between
from underskin.recordings.frf.estimators import Estimator, noise_ratio, ratio
from underskin.recordings.frf.periodic import period_of, without_drift
from underskin.recordings.frf.signal_checks import damaged, defects_of_pair
from underskin.recordings.frf.spectral_average import Blocks, Frf, averaged, without_line
from underskin.recordings.frf.stepped_sine import find_steps, settled, step_amplitudes
from underskin.units import Complexes, Floats, Mask, to_si

__all__ = ["Frf", "broadband", "estimate", "lines_of", "periodic", "stepped_sine"]

_BLOCKS = 15  # of a broadband record, half overlapping, where no resolution is asked for: 8 / its length


def lines_of(recording: FrfRecording) -> Frf:
    """The FRF of a recording: its own lines, or the estimate from its time series by its estimator, H1 without one."""
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
    """The FRF of a broadband force: Welch's average over blocks.

    The straight line through each block (preload, DC and drift) is removed. The lines at 0 Hz and at half the sample
    rate, which carry no phase, are left out, as are the blocks that a defect touches. Where γ² rises by it, a lag of
    one signal behind the other is taken off first and put back into the phase: beside a block it would lower H1.

    Parameters
    ----------
    force, charge : (samples,) arrays
        Time series [N], [C], of one length.
    sample_rate : float
        [Hz].
    block_samples : int, optional
        Length of a block, 8 to the length of the series; without it 1/8 of that.
    overlap : float
        Share of a block that the next one has in common with it, 0 or greater and less than 1.
    window : str
        Taper of a block, a name of `scipy.signal.get_window`.
    estimator : "H1", "H2" or "Hv"
        Which noise it is unbiased by: see `estimators`.

    Returns
    -------
    Frf
        At the multiples of sample_rate/block_samples.

    Raises
    ------
    InvalidInput
        No undamaged block is left, or the series do not make a block.

    Source
    ------
    Welch 1967; Bendat and Piersol, Random Data, chapters 5 and 9.
    """
    _check(force, charge, sample_rate)
    size = block_samples or max(8, 2 * len(force) // (_BLOCKS + 1))
    if not 8 <= size <= len(force):
        raise out_of_range("block_samples", size, f"must be 8 to {len(force)}, the length of the signals")
    if not 0 <= overlap < 1:
        raise out_of_range("overlap", overlap, "must be 0 or greater and less than 1")
    step = max(1, round(size * (1 - overlap)))
    taper = _taper(window, size)
    blocks = Blocks(taper, step, slice(1, (size + 1) // 2), without_line)
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
    """Both without a lag of the charge by so many samples."""
    return (force[: len(force) - lag], charge[lag:]) if lag >= 0 else (force[-lag:], charge[:lag])


def _as_recorded(aligned: Frf, lag: int, sample_rate: float) -> Frf:
    """The FRF of signals that were aligned with their lag in its phase, and their defects where they were recorded."""
    cut = {"charge_pc": max(lag, 0), "force_n": max(-lag, 0)}
    defects = tuple(replace(one, first_sample=one.first_sample + cut[one.channel]) for one in aligned.defects)
    return replace(aligned, values=advanced(aligned.values, aligned.frequency, -lag / sample_rate), defects=defects)


def periodic(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF of a periodic force: the average over all pairs of consecutive periods.

    With Hann's window over two periods T the lines at the multiples of 1/T are free of leakage.

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
        At the multiples of 1/T below half the sample rate.

    Raises
    ------
    InvalidInput
        The force has no period, or no two undamaged periods in a row are left.

    Source
    ------
    Pintelon and Schoukens, System Identification, 2012, chapter 2.
    """
    _check(force, charge, sample_rate)
    period = period_of(force)
    if not period:
        raise unusable("force_n", f"{len(force)} samples", "must repeat itself at least four times")
    taper = _taper("hann", 2 * period)
    blocks = Blocks(taper, period, slice(2, period, 2), without_drift)
    return averaged(force, charge, sample_rate, blocks, estimator)


def stepped_sine(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF of a stepped-sine force: synchronous demodulation of each tone that the force dwells on.

    Least squares on sine, cosine, DC and drift; a few whole cycles are one block of the average.

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
        One line for each tone, in order of frequency.

    Raises
    ------
    InvalidInput
        The force dwells on no tone, or no cycle is undamaged.
    """
    _check(force, charge, sample_rate)
    steps = find_steps(force, sample_rate)
    defects = [
        defect
        for defect in defects_of_pair(force, charge)
        if any(settled(step, sample_rate) <= defect.first_sample < step.last - 1 for step in steps)
    ]  # between the steps a jump is the step itself
    bad = damaged(defects, len(force))
    lines: dict[float, list[tuple[Complexes, Complexes]]] = {}
    for step in steps:
        pair = step_amplitudes(force, charge, sample_rate, step, bad)
        if len(pair[0]):
            lines.setdefault(_same_line(step.frequency, lines), []).append(pair)
    if not lines:
        raise unusable("force_n", f"{len(defects)} defects", "must dwell on a tone for some undamaged cycles")
    frequency = np.array(sorted(lines))
    values, coherence, averages = np.empty(len(lines), complex), np.empty(len(lines)), np.empty(len(lines))
    spectra = [tuple(np.concatenate(part)[:, None] for part in zip(*lines[line], strict=True)) for line in frequency]
    kappa = noise_ratio((tone, answer) for tone, answer in spectra)
    for index, (tone, answer) in enumerate(spectra):
        value, gamma2 = ratio(tone, answer, estimator, kappa)
        values[index], averages[index] = value[0], len(tone)
        coherence[index] = gamma2[0] if len(tone) > 1 else np.nan
    return Frf(frequency, values, coherence, averages, tuple(defects))


def _same_line(frequency: float, lines: dict[float, list[tuple[Complexes, Complexes]]]) -> float:
    """The line already seen that this frequency repeats, or itself."""
    return next((line for line in lines if abs(line - frequency) < 1e-3 * frequency), frequency)


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
