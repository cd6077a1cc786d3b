"""Reversed polarity: of all recordings, of whole sensors, of single recordings, or at random.

The sign of a recording is that of its level over the base model's, where that is well defined. Where the reversed
levels equal the others in magnitude, up to half of all recordings may be reversed; otherwise a single one at most.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.levels import times
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_ALIKE, _MOSTLY = 2.0, 0.8  # levels of one rig and layer differ by less, but for a few far from any sensor
_LISTED = 6  # single findings at most, so that a report stays readable


def without_reversed(
    recordings: Sequence[FrfRecording], ratio: Floats
) -> tuple[list[FrfRecording], Mask, list[Finding]]:
    """The recordings with their true signs, of which the sign is known, and the findings.

    `ratio` (recordings,) is that to the base model (`comparison`), NaN where a recording has no clear sign.
    """
    sign = np.where(np.isfinite(ratio), np.sign(ratio), 0.0)
    reverse = np.ones(len(recordings))
    findings = []
    if (sign < 0).sum() > (sign > 0).sum():
        findings.append(Finding(Reason.ALL_REVERSED, "", "frf_re_pc_per_n"))
        reverse[:] = -1.0
    known = np.ones(len(recordings), dtype=bool)
    sensors = _reversed_sensors(recordings, reverse * sign)
    others = ~np.isin([recording.sensor for recording in recordings], sensors)
    for name in sensors if (others & (reverse * sign < 0)).sum() <= _LISTED else ():
        findings.append(Finding(Reason.SENSOR_REVERSED, "", "frf_re_pc_per_n", {"sensor": name}))
        reverse[[recording.sensor == name for recording in recordings]] *= -1.0
    negative = reverse * sign < 0
    if negative.any() and _are_plain(np.abs(ratio), negative, reverse * sign > 0):
        reverse[negative] *= -1.0
        ids = [recordings[index].id for index in np.flatnonzero(negative).tolist()]
        if len(ids) <= _LISTED:
            findings += [Finding(Reason.RECORDING_REVERSED, name, "frf_re_pc_per_n") for name in ids]
        else:
            arguments = {"reversed_recordings": ids, "recordings": len(recordings)}
            findings.append(Finding(Reason.RECORDINGS_REVERSED, "", "frf_re_pc_per_n", arguments))
            known = sign != 0
    right = [
        times(recording, -1.0) if factor < 0 else recording
        for recording, factor in zip(recordings, reverse, strict=True)
    ]
    return right, known, findings


def _reversed_sensors(recordings: Sequence[FrfRecording], sign: Floats) -> list[str]:
    """The sensors of which several recordings are reversed, and more than are not."""
    signs: dict[str, list[float]] = {}
    for recording, given in zip(recordings, sign.tolist(), strict=True):
        signs.setdefault(recording.sensor, []).append(given)
    return [name for name, given in signs.items() if given.count(-1.0) > max(1, given.count(1.0))]


def _are_plain(size: Floats, negative: Mask, positive: Mask) -> bool:
    """Whether a single recording is reversed, or the reversed levels equal those of the others."""
    if positive.sum() < 2 or negative.sum() == 1:
        return bool(positive.sum() > 1)
    ratio = size[negative] / np.median(size[positive])
    return bool(((ratio < _ALIKE) & (ratio > 1 / _ALIKE)).mean() >= _MOSTLY)
