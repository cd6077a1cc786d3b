"""Reversed polarity: of all recordings, of whole sensors, of single recordings, or at random.

The sign of a recording is that of its level over the base model's, where that is well defined; nothing but a slip
reverses it (`ASTRAY`). Where the reversed levels equal the others in magnitude, up to half of all recordings may be
reversed; otherwise a single one at most.
"""

from collections.abc import Iterator
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.table import ASTRAY, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.units import Floats, Mask

_ALIKE, _MOSTLY = 2.0, 0.8  # levels of one rig and layer differ by less, but for a few far from any sensor
_LISTED = 6  # single findings at most, so that a report stays readable
_FIELD = "frf_re_pc_per_n"


def reversed_signs(screened: Screened) -> Iterator[Alternative]:
    """The recordings whose sign is reversed."""
    recordings, ratio = screened.recordings, screened.comparison.ratio
    sign = np.where(np.isfinite(ratio), np.sign(ratio), 0.0)
    findings, factor, known = list[Finding](), np.ones(len(recordings)), np.ones(len(recordings), dtype=bool)
    if (sign < 0).sum() > (sign > 0).sum():
        findings.append(Finding(Reason.ALL_REVERSED, "", _FIELD))
        factor[:] = -1.0
    labels = np.array([recording.sensor for recording in recordings])
    sensors = _reversed_sensors(labels, factor * sign)
    if (~np.isin(labels, sensors) & (factor * sign < 0)).sum() <= _LISTED:
        findings += [Finding(Reason.SENSOR_REVERSED, "", _FIELD, {"sensor": name}) for name in sensors]
        factor[np.isin(labels, sensors)] *= -1.0
    negative = factor * sign < 0
    if _are_plain(np.abs(ratio), negative, factor * sign > 0):
        factor[negative] *= -1.0
        ids = [recordings[index].id for index in np.flatnonzero(negative).tolist()]
        if len(ids) <= _LISTED:
            findings += [Finding(Reason.RECORDING_REVERSED, name, _FIELD) for name in ids]
        else:
            arguments = {"reversed_recordings": ids, "recordings": len(recordings)}
            findings.append(Finding(Reason.RECORDINGS_REVERSED, "", _FIELD, arguments))
            known = sign != 0
    reverses = int((sign[factor < 0] < 0).sum()) - int((sign[factor < 0] > 0).sum())
    if findings:
        undone = screened.scaled(np.where(known, factor, np.nan), *findings)
        yield Alternative(-log(len(recordings)), -reverses * log(ASTRAY), undo=undone)


def _reversed_sensors(labels: np.ndarray, sign: Floats) -> list[str]:
    """The sensors of which several recordings are reversed, and more than are not."""
    counts = {
        name: [(sign[labels == name] == of).sum() for of in (-1.0, 1.0)] for name in dict.fromkeys(labels.tolist())
    }
    return [name for name, (negative, positive) in counts.items() if negative > max(1, positive)]


def _are_plain(size: Floats, negative: Mask, positive: Mask) -> bool:
    """Whether a single recording is reversed, or the reversed levels equal those of the others."""
    if positive.sum() < 2 or negative.sum() < 2:
        return bool(negative.any() and positive.sum() > 1)
    ratio = size[negative] / np.median(size[positive])
    return bool(((ratio < _ALIKE) & (ratio > 1 / _ALIKE)).mean() >= _MOSTLY)
