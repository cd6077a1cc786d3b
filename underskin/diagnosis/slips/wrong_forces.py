"""Time series whose force contradicts what is declared: wrong units, or exchanged channels.

The mean force is the preload, unless AC coupling removed it. Its oscillation is about the dynamic force: the peak for
sines and blows, √2 times the standard deviation for sines and noise; drift, as of a relaxing preload, is not
oscillation. The logarithms of both ratios are 0 ± 1, and off by ln 1000 together where the force, one of them where the
preload or the dynamic force, is in a neighbouring unit.
"""

from dataclasses import replace
from itertools import product
from math import log

import numpy as np

from underskin.diagnosis.slips.table import GAIN
from underskin.diagnosis.slips.wrong_units import MOST_SHARE, SLIP
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import exchanged_channels, oscillation_of
from underskin.recordings.frf.spectra import mean_of
from underskin.units import force_unit

_NO_PREFIX = ("gf", "kgf", "lbf")  # units of force that are no power of 1000 off
_OFF = {  # whether the oscillation and the mean are off what is declared
    Reason.SERIES_FORCE: (1, 1),
    Reason.SERIES_DYNAMIC_FORCE: (1, 0),
    Reason.SERIES_PRELOAD: (0, 1),
}


def without_wrong_forces(
    recordings: list[FrfRecording], *, units_checked: bool
) -> tuple[list[FrfRecording], list[Finding], bool]:
    """The recordings without single ones whose force contradicts what is declared, unless the units are checked; the
    findings, and whether so many recordings are contradicted that it is no slip of single ones."""
    findings = [finding for recording in recordings if (finding := _contradiction(recording)) is not None]
    are_many = len(findings) > max(1.0, MOST_SHARE * len(recordings))
    if units_checked or are_many:
        return recordings, _together(findings, len(recordings)), are_many and not units_checked
    ids = {finding.recording for finding in findings}
    left_out = [replace(finding, arguments={**finding.arguments, "left_out": True}) for finding in findings]
    return [recording for recording in recordings if recording.id not in ids], left_out, False


def _together(findings: list[Finding], recordings: int) -> list[Finding]:
    """One finding where all recordings have the same, otherwise one for each."""
    kinds = {(finding.reason, finding.field, finding.arguments.get("given_in")) for finding in findings}
    if len(findings) == recordings > 1 and len(kinds) == 1:
        first = findings[0]
        return [replace(first, recording="", arguments={**first.arguments, "example": first.recording})]
    return findings


def _contradiction(recording: FrfRecording) -> Finding | None:
    """The finding on a force that contradicts the declared values of its recording."""
    if recording.force_n is None or recording.charge_pc is None:
        return None
    if (exchanged := exchanged_channels(recording)) is not None:
        return exchanged
    preload, dynamic_force_n = mean_of(recording.force_n), recording.dynamic_force_n
    guess = None if preload is None else force_unit(preload, recording.preload_n)
    if guess is not None and guess.meant[0][1] in _NO_PREFIX:
        values = {"mean_n": preload, "preload_n": recording.preload_n, "guess": guess}
        return Finding(Reason.FORCE_CONTRADICTS_PRELOAD, recording.id, "force_n", values)
    oscillation = np.log(np.maximum(oscillation_of(recording.force_n) / dynamic_force_n, 1e-300))
    mean = None if preload is None else log(abs(preload) / recording.preload_n)

    def nats(of_oscillation: float, of_mean: float) -> float:
        off = float(np.abs(oscillation - of_oscillation).min()), 0.0 if mean is None else abs(mean - of_mean)
        return -0.5 * (off[0] ** 2 + off[1] ** 2) if max(off) < log(SLIP) / 2 else -np.inf

    slips = [
        (nats(of_oscillation * size, of_mean * size), reason, size > 0)
        for (reason, (of_oscillation, of_mean)), size in product(_OFF.items(), (log(SLIP), -log(SLIP)))
        if mean is not None or of_oscillation == of_mean
    ]
    best, reason, is_larger = max(slips, key=lambda slip: slip[0])
    if not best - max(nats(0.0, 0.0), -0.5 * log(SLIP) ** 2) > GAIN:
        return None
    too_large = is_larger == (reason is Reason.SERIES_FORCE)  # else what is declared is too small
    arguments = {
        "dynamic_force_n": dynamic_force_n,
        "oscillation_n": dynamic_force_n * float(np.exp(min(oscillation, key=abs))),
        "preload_n": recording.preload_n,
        "mean_n": float(np.mean(recording.force_n)),
        "too_large": too_large,
        "given_in": "mN" if too_large else "kN",
    }
    return Finding(reason, recording.id, reason.value.partition("series_")[2] + "_n", arguments)
