"""Force and charge of a system whose FRF is known."""

import numpy as np
from scipy.signal import lfilter, lfilter_zi

from underskin.recordings.frf.spectra import Frf
from underskin.units import Complexes, Floats

RATE = 2000.0
POLE = 0.9  # of the known system: charge[k] = POLE · charge[k − 1] + (1 − POLE) · GAIN · force[k], which lags
GAIN = 5e-12


def known_frf(frequency: Floats) -> Complexes:
    return (1 - POLE) * GAIN / (1 - POLE * np.exp(-2j * np.pi * frequency / RATE))


def answer_to(force: Floats) -> Floats:
    taps, poles = [(1 - POLE) * GAIN], [1, -POLE]
    return lfilter(taps, poles, force, zi=lfilter_zi(taps, poles) * force[0])[0]


def shaken(seed: int, samples: int = 60_000, preload: float = 2.0) -> tuple[Floats, Floats]:
    random = np.random.default_rng(seed)
    force = preload + 0.05 * random.standard_normal(samples)
    return force, answer_to(force)


def dwelling(frequencies: list[float], cycles: int = 40, preload: float = 2.0) -> Floats:
    tones = [0.09 * np.sin(2 * np.pi * f * np.arange(round(max(cycles / f, 0.5) * RATE)) / RATE) for f in frequencies]
    return preload + np.concatenate(tones)


def rms_error(frf: Frf) -> float:
    true = known_frf(frf.frequency)
    return float(np.sqrt(np.mean(np.abs(frf.values / true - 1) ** 2)))


def swept(samples: int) -> Floats:
    time = np.arange(samples) / RATE
    return 0.09 * np.cos(2 * np.pi * (1.0 + 0.5 * (300.0 - 1.0) / time[-1] * time) * time)
