"""Curves as everything that reads them takes them: compression and depth positive, from the air into the sample,
without samples at which the channel saturates and without an error that is periodic in the travel.

What is changed is a finding. A block whose force and displacement are both negative stays so: it may be pulled.
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings import curve_signs
from underskin.recordings.campaign import (
    Campaign,
    CurveRecording,
    FrfRecording,
    IndentationRecording,
    Recording,
    samples_of,
)
from underskin.recordings.curve_defects import periodic_error, saturated
from underskin.recordings.curve_signs import Orientation
from underskin.recordings.exchanged_columns import are_exchanged

_LEAST = 16  # samples, with which a defect can be told
_ONE_WAY = 2  # turning points of a curve of one way: its first and its last sample
_STICKS = 0.05  # of the range of force, below what the shallow end shows: a pull, so that this is a way out
_UNLOADED = 0.1  # of a block's first force, at most, with which it ends then
_SHALLOW = 20  # one in so many samples, the shallowest: the air, where any was recorded


@dataclass(frozen=True)
class PreparedCurves:
    """A campaign whose curves were prepared, and the findings on what was changed."""

    campaign: Campaign
    findings: tuple[Finding, ...]


def prepared(campaign: Campaign) -> PreparedCurves:
    """The campaign with its curves prepared; other recordings stay as they are."""
    findings: list[Finding] = []
    negative: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    recordings: list[Recording] = []
    for recording in campaign.recordings:
        if isinstance(recording, FrfRecording) or are_exchanged(recording):
            recordings.append(recording)
            continue
        curve, found = _without_saturation(recording)
        oriented = curve_signs.orientation(curve)
        negative.setdefault((curve.kind, oriented.negative), []).append(curve.id)
        for step in (_turned, _forwards, _without_periodic_error):
            curve, further = step(curve, oriented)
            found += further
        recordings.append(curve)
        findings += found
    counted = [curve_signs.finding(kind, fields, ids) for (kind, fields), ids in negative.items() if fields]
    return PreparedCurves(replace(campaign, recordings=tuple(recordings)), (*counted, *findings))


def _turned(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    if curve_signs.may_be_pulled(curve.kind, oriented.negative):
        return curve, []
    return curve_signs.with_turned(curve, oriented.negative), []


def _forwards(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    """Of one way, from the air to the deepest; what relaxes on a way out alone no law tells, so that its times go."""
    if not oriented.is_known or len(oriented.turns) > _ONE_WAY or not _is_backwards(curve):
        return curve, []
    finding = Finding(Reason.ROWS_REVERSED, curve.id, "displacement_mm", {"is_timed": curve.time_s is not None})
    backwards = samples_of(replace(curve, time_s=None), np.arange(len(curve.force_n))[::-1])
    return backwards, [finding]


def _is_backwards(curve: CurveRecording) -> bool:
    """Whether the rows of a curve of one way begin where it is deepest, and the force is nowhere the pull that tells a
    way out."""
    travel, force = (column[np.isfinite(column)] for column in (curve.displacement_mm, curve.force_n))
    if isinstance(curve, IndentationRecording):
        shallow = float(np.median(force[np.argsort(travel, kind="stable")[: max(1, len(force) // _SHALLOW)]]))
        if len(travel) != len(force) or force.min() < shallow - _STICKS * np.ptp(force):
            return False
        return bool(travel[0] > travel[-1])
    return bool(abs(force[-1]) < _UNLOADED * abs(force[0]))


def _without_saturation(curve: CurveRecording) -> tuple[CurveRecording, list[Finding]]:
    finite = np.flatnonzero(np.isfinite(curve.displacement_mm) & np.isfinite(curve.force_n))
    if len(finite) < _LEAST:
        return curve, []
    travel, force = curve.displacement_mm[finite], curve.force_n[finite]
    at_limit = saturated(travel, force, sphere=isinstance(curve, IndentationRecording))
    if not at_limit.any():
        return curve, []
    limits = np.unique(force[at_limit])
    arguments = {
        "percent": 100 * float(at_limit.mean()),
        "samples": int(at_limit.sum()),
        "limits_n": [float(value) for value in limits],
    }
    kept = np.setdiff1d(np.arange(len(curve.force_n)), finite[at_limit])
    return samples_of(curve, kept), [Finding(Reason.FORCE_SATURATES, curve.id, "force_n", arguments)]


def _without_periodic_error(curve: CurveRecording, oriented: Orientation) -> tuple[CurveRecording, list[Finding]]:
    if not isinstance(curve, IndentationRecording):
        return curve, []
    finite = np.flatnonzero(np.isfinite(curve.displacement_mm) & np.isfinite(curve.force_n))
    if len(finite) < _LEAST:
        return curve, []
    travel, force = curve.displacement_mm[finite], curve.force_n[finite]
    error = periodic_error(travel, force)
    if error is None:
        return curve, []
    corrected = np.array(curve.force_n, dtype=float)
    corrected[finite] = force - error.at(travel)
    left = float(np.ptp(corrected[finite]))
    if left == 0:  # no contact is left to correct
        return curve, []
    arguments = {
        "period_mm": error.period,
        "amplitude_n": error.amplitude,
        "percent": 100 * error.amplitude / left,
    }
    if curve.time_s is not None and len(oriented.turns) <= _ONE_WAY:
        lasting = abs(float(curve.time_s[finite[-1]] - curve.time_s[finite[0]]))
        arguments["frequency_hz"] = float(np.ptp(travel)) / error.period / max(lasting, 1e-300)
    return replace(curve, force_n=corrected), [Finding(Reason.PERIODIC_ERROR, curve.id, "force_n", arguments)]
