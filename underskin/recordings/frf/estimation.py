"""The FRF, charge over force, from time series: H1, H2 and Hv with their coherence, for stepped sine, periodic and
broadband forces.

Convention e^(+iωt): a charge that lags the force has a negative phase. With S the spectra averaged over n blocks
(Bendat and Piersol, Random Data, chapters 5 and 9)
    H1 = S_fq/S_ff    H2 = S_qq/S_qf    γ² = |S_fq|²/(S_ff S_qq)
    Hv = (d + √(d² + 4 κ |S_fq|²))/(2 S_qf), d = S_qq − κ S_ff
    var log|H| = var phase = (1 − γ²)/(2 n γ²)    var γ² = 2 γ² (1 − γ²)²/n.
H1 is unbiased by noise in the charge, H2 by noise in the force, and Hv (total least squares) by noise in both whose
power has the ratio κ; κ is taken to be the ratio of the signals' own powers, so that Hv does not depend on units.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import get_window

from underskin.errors import ErrorCode, InvalidInput
from underskin.findings import english
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.periodic import period_of, without_drift
from underskin.recordings.frf.signal_checks import Defect, damaged, defects_of_pair
from underskin.recordings.frf.stepped_sine import find_steps, settled, step_amplitudes
from underskin.units import Complexes, Floats, to_si

Estimator = Literal["H1", "H2", "Hv"]
_TINY = float(np.finfo(float).tiny)
_BLOCKS = (
    15  # of a broadband record whose resolution is not asked for: half overlapping, a resolution of 8 / its length
)


@dataclass(frozen=True)
class Frf:
    """Lines of a measured FRF: `frequency` [Hz], `values` [C/N], and γ² and the number of averages where known.

    `averages` counts independent blocks (overlapping ones count for less than one each); NaN coherence where a line
    was averaged over one block. `defects` are those of the time series. `force_power` [N²] and
    `charge_power` [C²] are mean squared amplitudes, and `passes` is in how many blocks the force has its power at a
    line, (Σ p)²/Σ p²; None of tones. `independent`: whether neighbouring lines' noise is.
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

    @property
    def relative_uncertainty(self) -> Floats | None:
        """Standard uncertainty of log|FRF|, and of the phase in radians; None where n is not known."""
        if self.coherence is None or self.averages is None:
            return None
        return np.sqrt((1 - self.coherence) / (2 * self.averages * np.maximum(self.coherence, 1e-12)))

    @property
    def coherence_variance(self) -> Floats | None:
        """Variance of γ²; None where n is not known."""
        if self.coherence is None or self.averages is None:
            return None
        return 2 * self.coherence * (1 - self.coherence) ** 2 / self.averages


def lines_of(recording: FrfRecording) -> Frf:
    """The FRF of a recording: its own lines, or the estimate from its time series."""
    if recording.sample_rate_hz is not None:
        assert recording.force_n is not None
        assert recording.charge_pc is not None
        force, charge = to_si("force_n", recording.force_n), to_si("charge_pc", recording.charge_pc)
        return estimate(force, charge, recording.sample_rate_hz)
    assert recording.frequency_hz is not None
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    values = to_si("frf_pc_per_n", recording.frf_re_pc_per_n) + 1j * to_si("frf_pc_per_n", recording.frf_im_pc_per_n)
    return Frf(recording.frequency_hz, values, recording.coherence)


def estimate(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The FRF by the method that the force asks for: stepped sine where it dwells on tones, periodic where it begins
    anew, else broadband."""
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
    """Welch's average over blocks, the straight line through each removed (preload, DC and drift).

    The line at 0 Hz and the one at half the sample rate, which carry no phase, are left out, as are the blocks that a
    defect touches. Raises InvalidInput where no undamaged block is left, or the signals do not make a block.
    """
    _check(force, charge, sample_rate)
    size = block_samples or max(8, 2 * len(force) // (_BLOCKS + 1))
    if not 8 <= size <= len(force):
        raise InvalidInput(
            "block_samples", size, f"must be 8 to {len(force)}, the length of the signals", code=ErrorCode.OUT_OF_RANGE
        )
    if not 0 <= overlap < 1:
        raise InvalidInput("overlap", overlap, "must be 0 or greater and less than 1", code=ErrorCode.OUT_OF_RANGE)
    step = max(1, round(size * (1 - overlap)))
    taper = np.asarray(get_window(window, size), dtype=np.float64)
    averaged = _averaged(force, charge, _Blocks(taper, step, slice(1, (size + 1) // 2), _without_line), estimator)
    return replace(averaged, frequency=averaged.frequency * sample_rate, independent=False)


def periodic(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """The multiples of 1/T of a force of period T, exactly (see `periodic`): the average over all two periods in a row.

    Raises InvalidInput where the force has no period, or no undamaged two of them are left.
    """
    _check(force, charge, sample_rate)
    period = period_of(force)
    if not period:
        raise InvalidInput(
            "force_n", f"{len(force)} samples", "must repeat itself at least four times", code=ErrorCode.UNUSABLE_SIGNAL
        )
    taper = np.asarray(get_window("hann", 2 * period), dtype=np.float64)
    averaged = _averaged(force, charge, _Blocks(taper, period, slice(2, period, 2), without_drift), estimator)
    return replace(averaged, frequency=averaged.frequency * sample_rate)


def stepped_sine(force: Floats, charge: Floats, sample_rate: float, *, estimator: Estimator = "H1") -> Frf:
    """Synchronous demodulation of each tone that the force dwells on: least squares on sine, cosine, DC and drift.

    A few whole cycles are one block of the average. Raises InvalidInput where the force dwells on no tone, or no cycle
    is undamaged.
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
        raise InvalidInput(
            "force_n",
            f"{len(defects)} defects",
            "must dwell on a tone for some undamaged cycles",
            code=ErrorCode.UNUSABLE_SIGNAL,
        )
    frequency = np.array(sorted(lines))
    values, coherence, averages = np.empty(len(lines), complex), np.empty(len(lines)), np.empty(len(lines))
    for index, line in enumerate(frequency):
        blocks = [np.concatenate(part)[:, None] for part in zip(*lines[line], strict=True)]
        value, gamma2 = _ratio(blocks[0], blocks[1], estimator)
        values[index], averages[index] = value[0], len(blocks[0])
        coherence[index] = gamma2[0] if len(blocks[0]) > 1 else np.nan
    return Frf(frequency, values, coherence, averages, tuple(defects))


@dataclass(frozen=True)
class _Blocks:
    """Blocks as long as their `taper` that start every `step` samples, less what `steadied` takes off them, and the
    `lines` of their spectra that are kept."""

    taper: Floats
    step: int
    lines: slice
    steadied: Callable[[Floats], Floats]

    def of(self, signal: NDArray[np.generic]) -> NDArray[Any]:
        """(blocks, samples)."""
        return np.lib.stride_tricks.sliding_window_view(signal, len(self.taper))[:: self.step]

    def spectra(self, signal: Floats) -> Complexes:
        """(blocks, lines)."""
        return np.fft.rfft(self.steadied(self.of(signal)) * self.taper)[:, self.lines]


def _averaged(force: Floats, charge: Floats, blocks: _Blocks, estimator: Estimator) -> Frf:
    """The average over the undamaged blocks, its frequencies in cycles per sample."""
    defects = defects_of_pair(force, charge)
    whole = ~blocks.of(damaged(defects, len(force))).any(axis=1)
    count = int(whole.sum())
    if not count:
        first = defects[0]
        words = english.defect(first.kind, first.channel, first.samples, first.first_sample)
        raise InvalidInput(
            first.channel, f"{len(defects)} defects", f"no undamaged block: {words}", code=ErrorCode.UNUSABLE_SIGNAL
        )
    force_spectra, charge_spectra = (blocks.spectra(signal)[whole] for signal in (force, charge))
    frequency: Floats = np.fft.rfftfreq(len(blocks.taper))[blocks.lines].astype(np.float64)
    averages = _independent_blocks(count, blocks.taper, blocks.step)
    values, coherence = _ratio(force_spectra, charge_spectra, estimator)
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
    )


def _ratio(force: Complexes, charge: Complexes, estimator: Estimator) -> tuple[Complexes, Floats]:
    """H and γ² of spectra (blocks, lines)."""
    if estimator not in ("H1", "H2", "Hv"):
        raise InvalidInput("estimator", estimator, "must be H1, H2 or Hv", code=ErrorCode.NOT_ONE_OF)
    ff, qq = (np.mean(np.abs(blocks) ** 2, axis=0) for blocks in (force, charge))
    fq = np.mean(np.conj(force) * charge, axis=0)
    coherence = np.minimum(np.abs(fq) ** 2 / np.maximum(ff * qq, _TINY), 1.0)
    if estimator == "H1":
        return fq / np.maximum(ff, _TINY), coherence
    if estimator == "H2":
        return qq * fq / np.maximum(np.abs(fq) ** 2, _TINY), coherence
    kappa = qq.sum() / max(ff.sum(), _TINY)
    difference = qq - kappa * ff
    root = np.sqrt(difference**2 + 4 * kappa * np.abs(fq) ** 2)
    share = np.where(difference > 0, (difference + root) / (2 * np.maximum(np.abs(fq) ** 2, _TINY)), 0)
    return fq * np.where(difference > 0, share, 2 * kappa / np.maximum(root - difference, _TINY)), coherence


def _without_line(blocks: Floats) -> Floats:
    """The blocks (blocks, samples) less the straight line that fits each best."""
    time = np.arange(blocks.shape[1]) - (blocks.shape[1] - 1) / 2
    level = blocks.mean(axis=1, keepdims=True)
    slope = (blocks @ time / (time @ time))[:, None]
    return blocks - level - slope * time


def _independent_blocks(count: int, taper: Floats, step: int) -> float:
    """How many independent blocks carry as much as `count` overlapping ones (Welch 1967)."""
    power = taper @ taper
    excess = 0.0
    for lag in range(1, min(count, -(-len(taper) // step))):
        shared = float(taper[lag * step :] @ taper[: len(taper) - lag * step] / power)
        excess += 2 * (1 - lag / count) * shared**2
    return count / (1 + excess)


def _same_line(frequency: float, lines: dict[float, list[tuple[Complexes, Complexes]]]) -> float:
    """The line already seen that this frequency repeats, or itself."""
    near = [line for line in lines if abs(line - frequency) < 1e-3 * frequency]
    return near[0] if near else frequency


def _check(force: Floats, charge: Floats, sample_rate: float) -> None:
    if len(force) != len(charge):
        raise InvalidInput(
            "charge_pc",
            f"{len(charge)} samples",
            f"must have {len(force)}, as many as force_n",
            code=ErrorCode.UNEQUAL_LENGTHS,
        )
    if len(force) < 8:
        raise InvalidInput("force_n", f"{len(force)} samples", "must have at least 8", code=ErrorCode.TOO_FEW)
    if not (np.isfinite(sample_rate) and sample_rate > 0):
        raise InvalidInput(
            "sample_rate_hz", sample_rate, "must be finite and greater than 0", code=ErrorCode.NOT_FINITE
        )
    for name, signal in (("force_n", force), ("charge_pc", charge)):
        bad: NDArray[np.bool_] = ~np.isfinite(signal)
        if bad.any():
            raise InvalidInput(
                name, "not finite", "must be finite", index=int(np.argmax(bad)), code=ErrorCode.NOT_FINITE
            )
