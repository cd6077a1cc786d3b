"""The FRF from spectra averaged over blocks of two signals."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underskin.errors import unusable
from underskin.findings import sentences
from underskin.recordings.frf.estimators import Estimator, noise_ratio, ratio
from underskin.recordings.frf.signal_checks import Defect, damaged, defects_of_pair
from underskin.units import Complexes, Floats, Indices, Mask

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Blocks:
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


@dataclass(frozen=True)
class Frf:
    """Lines of a measured FRF: `frequency` [Hz], `values` [C/N], and γ² and the number of averages where known.

    `averages` counts independent blocks (overlapping ones count for less than one each); NaN coherence where a line
    was averaged over one block. `defects` are those of the time series. `force_power` [N²] and
    `charge_power` [C²] are mean squared amplitudes, and `passes` is in how many blocks the force has its power at a
    line, (Σ p)²/Σ p²; None of tones. `independent`: whether neighbouring lines' noise is. `used`: the lines that say
    something (`line_choice`), None where nobody looked. `bias` is what noise made of the `estimator` and was taken
    off, and `bias_unsure` what that leaves open, relative and about the same for all lines (`channel_noise`).
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

    @property
    def coherence_or_nan(self) -> Floats:
        """γ² of each line, NaN where it is not known."""
        return np.full(len(self.values), np.nan) if self.coherence is None else self.coherence

    def at(self, lines: Indices) -> "Frf":
        """The same at some of the lines."""
        columns = ("frequency", "values", "coherence", "averages", "force_power", "charge_power", "passes", "used")
        known = {name: column for name in columns if (column := getattr(self, name)) is not None}
        return replace(self, **{name: column[lines] for name, column in known.items()})

    @property
    def used_or_all(self) -> Mask:
        """The lines that say something; all where nobody looked."""
        return np.ones(len(self.values), dtype=bool) if self.used is None else self.used

    @property
    def relative_uncertainty(self) -> Floats | None:
        """Standard uncertainty of log|FRF|, and of the phase in radians; None where n is not known."""
        if self.coherence is None or self.averages is None:
            return None
        return np.sqrt((1 - self.coherence) / (2 * self.averages * np.maximum(self.coherence, 1e-12)))


def averaged(force: Floats, charge: Floats, sample_rate: float, blocks: Blocks, estimator: Estimator) -> Frf:
    """The average over the undamaged blocks of force [N] and charge [C], sampled at `sample_rate` [Hz]."""
    defects = defects_of_pair(force, charge)
    whole = ~blocks.of(damaged(defects, len(force))).any(axis=1)
    count = int(whole.sum())
    if not count:
        first = defects[0]
        words = sentences.defect(first.kind, first.channel, first.samples, first.first_sample)
        raise unusable(first.channel, f"{len(defects)} defects", f"no undamaged block: {words}")
    force_spectra, charge_spectra = (blocks.spectra(signal)[whole] for signal in (force, charge))
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
    )


def without_line(blocks: Floats) -> Floats:
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
