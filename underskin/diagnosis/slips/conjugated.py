"""Imported FRFs in the other sign convention, e^(−iωt): conjugated, in some recordings or in all.

In the convention e^(+iωt) the phase of every causal, stable element between force and charge is tied to its magnitude:
a high pass leads where it attenuates; a low pass and a relaxation lag where they fall; the resonance of a tip lags
above it; a delay of the charge only lags. A conjugated FRF contradicts that. The elements are the laws of the catalogue
that turn the phase (`log_frf`), with its priors, so that no relaxation far below the band, of an unphysical size, can
stand for a conjugated high pass.

Some recordings: phase i is q_i = ±1 times one smooth phase φ. With the best signs the evidence must exceed that of
equal signs by the cost of choosing k of n recordings, and the sizes of the phases must be of two signs rather than a
channel's own phase in each recording. All recordings: the listed mechanisms explain the conjugate, and neither they
nor a vibrating part explain the phase as it is. Where a lag of the force channel explains it as well, both readings are
stated and nothing is changed.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import comb, log

import numpy as np

from underskin.diagnosis.slips.comparison import LEAST_RECORDINGS, times
from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.log_frf import (
    CHANNEL_DEVIATION,
    Elements,
    LogFrf,
    LogFrfBands,
    listed_elements,
    log_frf_bands,
    mean_log_frf,
    scale,
    unlisted_chi2,
)
from underskin.diagnosis.slips.table import GAIN, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.registry import CATALOGUE
from underskin.units import Floats

_LOG_PRIOR = -log(45)  # about one campaign in fifty has conjugated recordings
_PLAIN = 2 * (GAIN - _LOG_PRIOR)  # of χ², by which a reading must then exceed another
_FIELD = "frf_im_pc_per_n"


def conjugated(screened: Screened) -> Iterator[Alternative]:
    """The conjugated ones of the imported FRFs."""
    recordings = [recording for recording in screened.recordings if recording.id in screened.imported]
    campaign = replace(screened.campaign, recordings=tuple(recordings))
    bands = log_frf_bands(campaign) if recordings else None
    if bands is None or not bands.telling.any():
        return
    signs, nats, choices = _aligned(bands)
    orientation, chi2, lag_us = _orientation(
        mean_log_frf(bands, signs), partial(listed_elements, campaign, screened.table)
    )
    findings = list[Finding]()
    if orientation == 0:  # undecided: the majority of recordings decides
        orientation = 1 if (signs < 0).sum() <= (signs > 0).sum() else -1
        if lag_us is not None and orientation == 1:
            findings.append(Finding(Reason.ALL_CONJUGATED, "", _FIELD, {"lag_us": lag_us}))
    turned = orientation * signs < 0
    ids = [recording.id for recording, wrong in zip(recordings, turned, strict=True) if wrong]
    if ids and turned[bands.telling].all():
        ids = [recording.id for recording in recordings]
        findings.append(Finding(Reason.ALL_CONJUGATED, "", _FIELD, {"lag_us": None}))
    elif ids:
        arguments = {"conjugated": ids, "recordings": len(recordings)}
        findings.append(Finding(Reason.RECORDINGS_CONJUGATED, ids[0] if len(ids) == 1 else "", _FIELD, arguments))
    right = screened.recordings
    if ids:
        right = [times(recording, 1.0, -1.0 if recording.id in ids else 1.0) for recording in right]
    if findings:
        yield Alternative(_LOG_PRIOR - choices, nats + chi2 / 2, undo=(right, findings))


_LARGEST = 0.7  # rad: limit that reduces the weight of sharp resonances, whose frequency differs between recordings
_RELAXATIONS, _COEFFICIENT = 4, 0.1  # terms of a smooth phase, and the prior standard deviation of each [rad]
_VARIED = (0.0, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4)  # of the mean phase: variation between recordings


def _aligned(bands: LogFrfBands) -> tuple[Floats, float, float]:
    """The sign ±1 of each recording's phase (recordings,), 0 without a phase: all 1 where none contradicts the others;
    the gain of ln evidence by it, and ln of the number of choices."""
    same = bands.telling.astype(float)
    if bands.telling.sum() < LEAST_RECORDINGS:
        return same, 0.0, 0.0
    phase, weight = np.clip(bands.value.imag, -_LARGEST, _LARGEST), bands.weight
    vectors, _, _ = np.linalg.svd(phase * np.sqrt(weight), full_matrices=False)
    signs = np.where(vectors[:, 0] * np.sign(vectors[:, 0].sum() or 1.0) < 0, -1.0, 1.0) * same
    odds = log(max((signs > 0).sum(), 1) / max((signs < 0).sum(), 1))  # of a recording by the others
    pull = (weight * phase * _mean_phase(phase, weight, signs)).sum(axis=1)
    signs = np.where(2 * pull < -odds, -1.0, 1.0) * same
    fewer = int(min((signs < 0).sum(), (signs > 0).sum()))
    choices = log(comb(int(same.sum()), fewer)) + log(same.sum())
    gain = _of_smooth(bands.frequency, phase, weight, signs)
    gain -= max(_of_smooth(bands.frequency, phase, weight, same), 0.0)
    if fewer == 0 or gain < choices + _PLAIN / 2 or _of_two_signs(phase, weight, signs) <= -_LOG_PRIOR:
        return same, 0.0, 0.0
    return signs, gain, choices


def _of_smooth(frequency: Floats, phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln evidence, relative to no phase, of one smooth phase over frequency, times the sign of each recording: a sum of
    the phases of delay, loss, relaxation and high pass with normal coefficients."""
    ratio = frequency[:, None] / np.geomspace(frequency[0], frequency[-1], _RELAXATIONS)
    shapes = [frequency[:, None] / frequency[-1], np.ones((len(frequency), 1)), frequency[0] / frequency[:, None]]
    columns = _COEFFICIENT * np.concatenate([*shapes, ratio / (1 + ratio**2)], axis=1)
    information = columns.T @ (weight.sum(axis=0)[:, None] * columns) + np.eye(columns.shape[1])
    pull = columns.T @ (signs @ (weight * phase))
    return 0.5 * (float(pull @ np.linalg.solve(information, pull)) - float(np.linalg.slogdet(information)[1]))


def _of_two_signs(phase: Floats, weight: Floats, signs: Floats) -> float:
    """ln likelihood of phases ±1 times the mean, relative to one phase plus a channel's own in each recording; in both
    they vary between recordings."""
    mean_phase = _mean_phase(phase, weight, signs)
    information = (weight * mean_phase**2).sum(axis=1)
    informative = (signs != 0) & (information > 0)
    amplitude = (weight * phase * mean_phase).sum(axis=1)[informative] / information[informative]
    share = float((signs[informative] < 0).mean())
    two_signs, one_sign = [], []
    for varied in _VARIED:
        spread = np.sqrt(1 / information[informative] + varied**2)
        parts = (log(size) + _log_density(amplitude, sign, spread) for size, sign in ((1 - share, 1.0), (share, -1.0)))
        two_signs.append(float(np.logaddexp(*parts).sum()))
        mean = float(np.average(amplitude, weights=spread**-2))
        one_sign.append(float(_log_density(amplitude, mean, spread).sum()))
    return max(two_signs) - max(one_sign)


def _log_density(value: Floats, mean: float, deviation: Floats) -> Floats:
    """Of a normal distribution, but for the constant."""
    return np.asarray(-0.5 * ((value - mean) / deviation) ** 2 - np.log(deviation))


def _mean_phase(phase: Floats, weight: Floats, signs: Floats) -> Floats:
    total = (weight * np.abs(signs)[:, None]).sum(axis=0)
    return np.asarray((signs[:, None] * weight * phase).sum(axis=0) / np.where(total > 0, total, 1.0))


_DELAY = "timing_delay"


def _orientation(log_frf: LogFrf, listed: Callable[[Floats], dict[str, Elements]]) -> tuple[int, float, float | None]:
    """1 where the listed mechanisms explain the aligned phase and not its conjugate; −1 where they explain the
    conjugate, and neither an unlisted part nor a lag of the force channel explains the phase itself; 0 where both are
    possible. Second, by how much χ² the conjugate is better; third, that lag [µs] where it is the alternative."""
    phase = log_frf.value.imag / np.hypot(log_frf.deviation.imag, CHANNEL_DEVIATION)
    if phase @ phase < len(phase) + _PLAIN:
        return 0, 0.0, None
    kinds = listed(log_frf.frequency)
    if _DELAY not in kinds:
        return 0, 0.0, None
    given, turned = (log_frf.fit(*kinds.values(), turned=turned)[0] for turned in (False, True))
    if min(given, turned) > 4 * len(log_frf.frequency):  # twice the number of values: neither is explained
        return 0, 0.0, None
    if turned - given > _PLAIN:
        return 1, 0.0, None
    if given - turned <= _PLAIN or turned - unlisted_chi2(log_frf) > _PLAIN:
        return 0, 0.0, None
    delay, cost = kinds.pop(_DELAY)
    plain, *fits = [log_frf.fit((-delay, cost), *kind) for kind in ((), *((kind,) for kind in kinds.values()))]
    best = min(plain, *fits, key=lambda fit: fit[0])
    if turned - best[0] > _PLAIN:
        return 1, 0.0, None
    if best[0] - turned > _PLAIN:
        return -1, min(given, best[0]) - turned, None
    simplest = plain if plain[0] < best[0] + 2 * _PLAIN else best
    return 0, given - turned, scale(CATALOGUE[_DELAY].parameters_stated[0]) * float(simplest[1][0])
