"""Single recordings against the base model before any fit: no response, units off by 1000, reversed sign.

Only the level over the base model's prediction is compared (the apparent d33), after removing the chain's delay.
Recordings without a response, or where little is predicted (near a zero crossing), have none.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.slips.levels import aligned_lines
from underskin.diagnosis.slips.no_response import dead, no_response
from underskin.diagnosis.slips.reversed_signs import signs_of
from underskin.diagnosis.slips.table_domain import within_tables
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.models.composed import Model, compose
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats

_UNIT_FACTORS = (1e3, 1e-3)
_FACTOR_WIDTH = np.log(12.0)
_LIKELY_D33 = (0.3, 1000.0)  # pC/N; polymers have 5 to 40, ceramics up to some hundred
_LEAST_RESPONSE = 0.2  # of the campaign's largest prediction: below it, near a zero crossing, a sign is not informative
_UPPER = 0.75  # quantile of the lines: a resonance is narrower
_LOWEST = 5  # one line in five counts as low, and of evenly spaced ones only the lowest third in log frequency
_D33 = 15.0  # pC/N: the prediction is made with the centre of the prior

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Consistent:
    """The usable recordings, reversed ones corrected, the findings, and what is `lacking` where none is usable.

    `beyond` are the ids of those whose contacts lie beyond the tables as declared.
    """

    recordings: list[FrfRecording]
    findings: list[Finding]
    lacking: Lacking | None = None
    beyond: frozenset[str] = frozenset()


def against_model(
    campaign: Campaign, recordings: list[FrfRecording], table: SigmaTable, keep_ids: Collection[str] | None
) -> Consistent:
    """The recordings compared with the base model; `keep_ids` as for `within_tables`."""
    aligned = aligned_lines(recordings)
    unresponsive, variance = no_response(aligned)
    if unresponsive.all():
        finding = Finding(Reason.SILENT_CAMPAIGN, "", "frf_re_pc_per_n", {"recordings": len(recordings)})
        return Consistent([], [finding], Lacking(Lack.NO_RESPONSE))
    model = compose((), replace(campaign, recordings=tuple(recordings)), table, "frf")
    inside, beyond, findings = within_tables(campaign, recordings, model, table, keep_ids)
    inside |= beyond
    ratio, largest, expected = _apparent(aligned, model, inside & ~unresponsive)
    lost, dead_findings = dead(recordings, aligned, unresponsive & inside, variance, np.where(inside, expected, 0.0))
    findings += dead_findings
    usable = inside & ~lost
    turned = np.where(_has_one_sign(recordings, aligned), ratio, np.nan)
    contradiction = _contradiction(ratio, turned) if len(recordings) == 2 else None
    if contradiction is not None:
        return Consistent([], [*findings, contradiction], Lacking(Lack.TWO_RECORDINGS_CONTRADICT))
    ratio, turned, largest = (np.where(usable, column, np.nan) for column in (ratio, turned, largest))
    off, off_findings = _off_by_1000(recordings, ratio)
    usable &= ~off
    polarity = signs_of(recordings, turned, usable)
    findings += [*off_findings, *_of_all(largest, campaign.skin.d33_pc_per_n), *polarity.findings]
    usable &= polarity.signs != 0
    recordings = [
        _reversed(recording) if sign < 0 else recording
        for recording, sign in zip(recordings, polarity.signs, strict=True)
    ]
    far = frozenset(recording.id for recording, chosen in zip(recordings, usable & beyond, strict=True) if chosen)
    return Consistent(
        [recording for recording, chosen in zip(recordings, usable, strict=True) if chosen], findings, beyond=far
    )


def _apparent(aligned: Sequence[Complexes], model: Model, usable: Mask) -> tuple[Floats, Floats, Floats]:
    """Each recording's level over the base model's, NaN where not informative; the same for the upper quartile of its
    lines, which no filter suppresses; and the expected level [C/N]."""
    predicted = model.predict(np.array([parameter.start for parameter in model.parameters])).value
    shape = predicted[np.searchsorted(model.recording, np.arange(len(aligned)))].real
    level = np.array([float(np.nanmedian(values.real)) for values in aligned])
    upper = np.array([float(np.nanquantile(np.abs(values), _UPPER)) for values in aligned])
    telling = usable & (np.abs(shape) > _LEAST_RESPONSE * np.abs(shape[usable]).max(initial=0.0))
    ratio, largest = (
        np.where(telling, column / np.where(shape == 0, 1.0, divisor), np.nan)
        for column, divisor in ((level, shape), (upper, np.abs(shape)))
    )
    usual = float(np.nanmedian(np.abs(ratio))) if telling.any() else 0.0
    return ratio, largest, np.abs(shape) * usual


def _off_by_1000(recordings: list[FrfRecording], ratio: Floats) -> tuple[Mask, list[Finding]]:
    """Which recordings' levels are about 1000 × off all others, and the findings on them."""
    off = np.zeros(len(recordings), dtype=bool)
    findings: list[Finding] = []
    if not np.isfinite(ratio).any():
        return off, findings
    usual = float(np.nanmedian(np.abs(ratio)))
    slip = np.log(np.abs(ratio) / usual) if usual > 0 else np.full(len(ratio), np.nan)
    for index in np.flatnonzero(np.isfinite(slip)):
        for factor in _UNIT_FACTORS:
            if abs(slip[index] - np.log(factor)) < _FACTOR_WIDTH:
                arguments = {"too_large": factor > 1}
                findings.append(
                    Finding(Reason.RESPONSE_BESIDE_OTHERS, recordings[index].id, "frf_re_pc_per_n", arguments)
                )
                off[index] = True
    return off, findings


def _has_one_sign(recordings: list[FrfRecording], aligned: Sequence[Complexes]) -> Mask:
    """Whether a recording's lowest lines have the sign of all its lines: above a resonance the charge is in antiphase,
    which is no reversed polarity."""
    sides = []
    for recording, values in zip(recordings, aligned, strict=True):
        real, frequency = values.real, lines_of(recording).frequency
        low = int((frequency <= np.cbrt(frequency[0] ** 2 * frequency[-1])).sum())
        lowest = real[: max(1, min(1 + (len(real) - 1) // _LOWEST, low))]
        sides.append(float(np.nanmedian(lowest)) * float(np.nanmedian(real)) > 0)
    return np.array(sides)


def _contradiction(ratio: Floats, turned: Floats) -> Finding | None:
    """The finding on two recordings whose levels are a factor of about 1000 apart, or of opposite signs; which of them
    is wrong cannot be told."""
    low, high = sorted(np.abs(ratio).tolist())
    if not low > 0:
        return None
    if np.prod(turned) < 0:
        return Finding(Reason.TWO_SIGNS, "", "frf_re_pc_per_n")
    if abs(np.log(high / low) - np.log(1e3)) < _FACTOR_WIDTH:
        return Finding(Reason.TWO_RESPONSES, "", "frf_re_pc_per_n", {"ratio": high / low})
    return None


def _of_all(ratio: Floats, declared: float | None) -> list[Finding]:
    """The finding on a d33 that no sensor has, or that is off the declared one by a factor of 1000."""
    d33 = float(np.nanmedian(np.abs(ratio))) * _D33 if np.isfinite(ratio).any() else 0.0
    if d33 <= 0:
        return []
    low, high = _LIKELY_D33
    if declared:
        low, high = (abs(declared) * factor / np.exp(_FACTOR_WIDTH) ** side for factor, side in ((1e-3, -1), (1e3, 1)))
    if low <= d33 <= high:
        return []
    arguments = {"d33_pc_per_n": d33, "declared_pc_per_n": declared, "too_large": bool(d33 > high)}
    return [Finding(Reason.D33_NEEDED, "", "frf_re_pc_per_n", arguments)]


def _reversed(recording: FrfRecording) -> FrfRecording:
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    return replace(recording, frf_re_pc_per_n=-recording.frf_re_pc_per_n, frf_im_pc_per_n=-recording.frf_im_pc_per_n)
