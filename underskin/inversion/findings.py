"""Findings on a campaign's FRF recordings and their d33, which are used all the same."""

from collections.abc import Sequence
from dataclasses import asdict, replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.mixed_model import Estimate
from underskin.prediction import plausibility
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.channel_noise import noise_findings
from underskin.recordings.frf.estimation import Frf
from underskin.recordings.frf.flat_zone import FlatZone
from underskin.recordings.frf.roll_off import RollOff
from underskin.recordings.frf.signal_checks import mean_of
from underskin.units import Floats, to_lab, unusual

_CONTRADICTS = 3.0  # times


def findings_of(
    recorded: Sequence[FrfRecording], measured: Sequence[Frf], level: Floats, array: Estimate | None
) -> tuple[Finding, ...]:
    """Of time series: defects, noise that biases them, and a mean force that contradicts the preload; of the level
    [C/N] and of the array's d33 errors of units and sign."""
    defects = [
        Finding(Reason.DEFECT, item.id, defect.channel, asdict(defect))
        for item, frf in zip(recorded, measured, strict=True)
        for defect in frf.defects
    ]
    typical = to_lab("frf_pc_per_n", np.nanmedian(np.abs(level)))
    unit_errors = [replace(finding, reason=Reason.UNUSUAL_MEDIAN_FRF) for finding in unusual("frf_pc_per_n", typical)]
    implausible = [] if array is None else plausibility.of_array(float(to_lab("d33_pc_per_n", array.value)))
    return (*defects, *noise_findings(measured), *_preloads(recorded), *unit_errors, *implausible)


def of_roll_off(behind: RollOff | None, zone: FlatZone) -> list[Finding]:
    """That the band of d33 lies behind a filter."""
    if behind is None:
        return []
    arguments = {**asdict(behind), "percent": 100 * behind.share, "low_hz": zone.low_hz, "high_hz": zone.high_hz}
    arguments.pop("share")
    return [Finding(Reason.BEHIND_FILTER, "", "d33_pc_per_n", arguments)]


def _preloads(recorded: Sequence[FrfRecording]) -> list[Finding]:
    """The recordings whose force has a mean that contradicts the preload."""
    findings = []
    for recording in recorded:
        mean = None if recording.force_n is None else mean_of(recording.force_n)
        if mean is not None and not 1 / _CONTRADICTS <= abs(mean) / recording.preload_n <= _CONTRADICTS:
            arguments = {"mean_n": mean, "preload_n": recording.preload_n}
            findings.append(Finding(Reason.FORCE_CONTRADICTS_PRELOAD, recording.id, "force_n", arguments))
    return findings
