"""Reversed polarity: of all recordings, of whole sensors, of single recordings, or at random.

The sign of a recording is that of its level over the base model's, where that is well defined. Where the reversed
levels equal the others in magnitude, up to half of all recordings may be reversed; otherwise a few at most.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_FEW = 0.2  # of the others
_ALIKE, _MOSTLY = 2.0, 0.8  # largest ratio to the others' level, and the share of reversed recordings within it
_LISTED = 6  # single findings at most


@dataclass(frozen=True)
class Signs:
    """−1 for each recording to be reversed, 0 where unknown, otherwise 1; and the findings."""

    signs: Floats
    findings: list[Finding]


def signs_of(recordings: Sequence[FrfRecording], turned: Floats, usable: Mask) -> Signs:
    """The signs of recordings from their levels over the base model's, `turned`, NaN where these have no clear sign."""
    negative = np.isfinite(turned) & (turned < 0) & usable
    positive = np.isfinite(turned) & (turned > 0) & usable
    signs = np.ones(len(recordings))
    findings = []
    if negative.sum() > positive.sum():
        findings.append(Finding(Reason.ALL_REVERSED, "", "frf_re_pc_per_n"))
        signs[:] = -1.0
        negative, positive = positive, negative
    sensors = _reversed_sensors(recordings, negative, positive)
    at_random = (negative & ~_of(recordings, sensors)).sum() > _LISTED
    for name in () if at_random else sensors:
        of_sensor = _of(recordings, (name,))
        findings.append(Finding(Reason.SENSOR_REVERSED, "", "frf_re_pc_per_n", {"sensor": name}))
        signs[of_sensor] *= -1.0
        negative, positive = np.where(of_sensor, positive, negative), np.where(of_sensor, negative, positive)
    few = negative.sum() <= max(_FEW * positive.sum(), 1) and positive.sum() > 1
    if not negative.any() or not (few or _plain(turned, negative, positive)):
        return Signs(signs, findings)
    signs[negative] *= -1.0
    ids = [recordings[index].id for index in np.flatnonzero(negative).tolist()]
    if len(ids) <= _LISTED:
        findings += [Finding(Reason.RECORDING_REVERSED, name, "frf_re_pc_per_n") for name in ids]
        return Signs(signs, findings)
    arguments = {"reversed_recordings": ids, "recordings": len(recordings)}
    findings.append(Finding(Reason.RECORDINGS_REVERSED, "", "frf_re_pc_per_n", arguments))
    return Signs(np.where(negative | positive, signs, 0.0), findings)


def _reversed_sensors(recordings: Sequence[FrfRecording], negative: Mask, positive: Mask) -> tuple[str, ...]:
    """The sensors of which several recordings are reversed and hardly any other is not."""
    names = dict.fromkeys(recording.sensor for recording in recordings)
    counts = {name: _of(recordings, (name,)) for name in names}
    return tuple(
        name
        for name, of_sensor in counts.items()
        if (negative & of_sensor).sum() > max(1.0, (positive & of_sensor).sum() / _FEW / 5)
    )


def _plain(turned: Floats, negative: Mask, positive: Mask) -> bool:
    """Whether the reversed levels equal those of the others but for the sign."""
    usual = float(np.median(turned[positive])) if positive.any() else 0.0
    size = -turned[negative] / usual if usual > 0 else np.zeros(1)
    return bool(((size < _ALIKE) & (size > 1 / _ALIKE)).mean() >= _MOSTLY)


def _of(recordings: Sequence[FrfRecording], names: Sequence[str]) -> Mask:
    return np.array([recording.sensor in names for recording in recordings])
