"""The course of each recording's phase over frequency, and the nearest one that a causal, stable sensor can have.

In the convention e^(+iωt) every element between force and charge has a logarithm ln H(iω) whose phase is tied to its
magnitude: a high pass ln(iωτ/(1+iωτ)) leads where it attenuates, a relaxation −ln(iω) or 1/(1+iω/ω_s) lags where it
falls, a resonance −ln(1−(ω/ω0)²+2iζω/ω0) lags above it, and a delay −iω only lags. Elements in a row add up with
weights that are not negative, which a conjugated FRF contradicts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import Frf, lines_of
from underskin.units import Complexes, Floats, Indices, Mask

_BANDS = 24  # of equal width in the logarithm of frequency
_LEAST_LINES = 6
_MAINS_HZ, _BESIDE_MAINS_HZ = (50.0, 60.0, 150.0, 180.0), 20.0  # pick-up has a phase of its own
_STEP, _FAINT = 2.0, 0.3  # rad, and of the usual level: beside a zero the phase may turn either way
_UNSURE = 6.0  # of a line's noise
_WIDEST = 0.3  # rad, of a line's noise: beyond it a phase cannot be followed from line to line
_SECOND = 0.6745 * np.sqrt(6.0)  # median of the size of second differences over the noise of a line
_ENOUGH = 12  # second differences in a band, or in it and the two beside it on either side


@dataclass(frozen=True)
class PhaseCourses:
    """ln FRF without its real mean, in bands of frequency (recordings, bands), NaN where there is no line or the lines
    are too noisy; the polarity is taken off. `deviation` is the noise of each part."""

    frequency: Floats  # (bands,)
    value: Complexes
    deviation: Floats
    followed: Mask  # below where the way round of the phase is lost: at a zero of the response or a sharp resonance

    @property
    def telling(self) -> Mask:
        """Whether a recording has a course at all (recordings,)."""
        return np.asarray(np.isfinite(self.value).any(axis=1))


def phase_courses(entries: Sequence[FrfRecording]) -> PhaseCourses:
    """Those of recordings."""
    measured = [lines_of(entry) for entry in entries]
    lowest = min(float(own.frequency.min()) for own in measured)
    highest = max(float(own.frequency.max()) for own in measured)
    edges = np.geomspace(lowest * (1 - 1e-9), highest * (1 + 1e-9), _BANDS + 1)
    value = np.full((len(entries), _BANDS), np.nan + 0j)
    followed = np.zeros(value.shape, dtype=bool)
    share, noises = np.full((len(entries), _BANDS), np.nan), np.full(len(entries), np.nan)
    rough: list[tuple[Indices, Floats]] = []
    for number, own in enumerate(measured):
        frequency, lines = _usable(own)
        if len(lines) < _LEAST_LINES:
            continue
        logarithm = _logarithm(lines)
        second = np.abs(np.diff([logarithm.real, logarithm.imag], 2)) / _SECOND
        noise = float(np.median(second))
        if not 0 < noise < _WIDEST:
            continue
        band = np.clip(np.searchsorted(edges, frequency) - 1, 0, _BANDS - 1)
        rough += [(part, second / noise) for part in (band[:-2], band[1:-1], band[2:])]
        followed[number] = np.arange(_BANDS) < _lost(logarithm, band, noise)
        count = np.bincount(band, minlength=_BANDS)
        with np.errstate(invalid="ignore", divide="ignore"):
            real, imaginary = (
                np.bincount(band, weights=part, minlength=_BANDS) / count for part in (logarithm.real, logarithm.imag)
            )
            share[number] = 1 / np.sqrt(count)
        value[number] = real - np.nanmean(real) + 1j * imaginary
        noises[number] = noise
    if rough:
        noises = np.maximum(noises, np.nanmedian(noises))
    return PhaseCourses(np.sqrt(edges[1:] * edges[:-1]), value, noises[:, None] * share * _unevenness(rough), followed)


def _usable(measured: Frf) -> tuple[Floats, Complexes]:
    """Frequency and value of the lines that are not 0 and not beside mains, by frequency."""
    beside = np.min(np.abs(np.subtract.outer(measured.frequency, _MAINS_HZ)), axis=1) < _BESIDE_MAINS_HZ
    kept = ~beside & np.isfinite(measured.values) & (np.abs(measured.values) > 0)
    return measured.frequency[kept], measured.values[kept]


def _lost(logarithm: Complexes, band: Indices, noise: float) -> int:
    """The band from which on the way round of the phase is not known: where it steps beside a zero of the response, or
    by half a turn but for the noise of a line."""
    near_zero = np.minimum(logarithm.real[1:], logarithm.real[:-1]) < np.median(logarithm.real) + np.log(_FAINT)
    step = np.abs(np.diff(logarithm.imag))
    steps = np.flatnonzero((near_zero & (step > _STEP)) | (step > np.pi - _UNSURE * noise))
    return int(band[steps[0]]) if len(steps) else _BANDS


def _unevenness(rough: Sequence[tuple[Indices, Floats]]) -> Floats:
    """How noisy each band is beside the whole (bands,), from second differences `rough` of both parts (2, lines) of all
    recordings: those of the smoother part, since a resonance bends the other."""
    profile = np.ones(_BANDS)
    if not rough:
        return profile
    band = np.concatenate([own for own, _ in rough])
    second = np.concatenate([own for _, own in rough], axis=1)
    for number in range(_BANDS):
        chosen = np.abs(band - number) <= (0 if (band == number).sum() >= _ENOUGH else 2)
        if chosen.sum() >= _ENOUGH:
            profile[number] = np.median(second[:, chosen], axis=1).min()
    return np.asarray(np.clip(profile, 0.3, 10.0))


def _logarithm(lines: Complexes) -> Complexes:
    """ln of the lines, the phase followed from the lowest ones, where it is nearest to 0 but for the polarity."""
    phase = np.unwrap(np.angle(lines))
    start = np.pi * np.round(np.median(phase[: max(3, len(phase) // 8)]) / np.pi)
    return np.asarray(np.log(np.abs(lines)) + 1j * (phase - start))
