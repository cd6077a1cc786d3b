"""Time series whose force contradicts what is declared: wrong units, or exchanged channels.

The mean force is the preload, unless AC coupling removed it. Its oscillation is about the dynamic force: the peak for
sines and blows, √2 times the standard deviation for sines and noise; drift, as of a relaxing preload, is not
oscillation. The logarithms of both ratios are 0 ± 1, and off by ln 1000 together where the force, one of them where the
preload or the dynamic force, is in a neighbouring unit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.table import GAIN, Screened
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


def wrong_forces(screened: Screened) -> Iterator[Alternative]:
    """Single recordings whose force contradicts what is declared."""
    contradictions = contradicting_forces(screened.recordings)
    if contradictions and not are_many(contradictions, screened.recordings):
        ids = {finding.recording for _, finding in contradictions}
        off = np.array([recording.id in ids for recording in screened.recordings])
        findings = [replace(one, arguments={**one.arguments, "left_out": True}) for _, one in contradictions]
        yield Alternative(0.0, min(nats for nats, _ in contradictions), undo=screened.without(off, *findings))


def are_many(contradictions: Sequence[object], recordings: Sequence[FrfRecording]) -> bool:
    """Whether so many recordings are contradicted that it is no slip of single ones."""
    return len(contradictions) > max(1.0, MOST_SHARE * len(recordings))


def together(contradictions: Sequence[tuple[float, Finding]], recordings: int) -> list[Finding]:
    """One finding where all recordings have the same, otherwise one for each."""
    findings = [finding for _, finding in contradictions]
    kinds = {(finding.reason, finding.field, finding.arguments.get("given_in")) for finding in findings}
    if len(findings) == recordings > 1 and len(kinds) == 1:
        first = findings[0]
        return [replace(first, recording="", arguments={**first.arguments, "example": first.recording})]
    return findings


def contradicting_forces(recordings: Sequence[FrfRecording]) -> list[tuple[float, Finding]]:
    """Of each recording whose force contradicts its declared values the gain of ln evidence, and the finding."""
    return [contradiction for recording in recordings if (contradiction := _contradiction(recording)) is not None]


def _contradiction(recording: FrfRecording) -> tuple[float, Finding] | None:
    if recording.force_n is None or recording.charge_pc is None:
        return None
    if (exchanged := exchanged_channels(recording)) is not None:
        return np.inf, exchanged
    preload, dynamic_force_n = mean_of(recording.force_n), recording.dynamic_force_n
    guess = None if preload is None else force_unit(preload, recording.preload_n)
    if guess is not None and guess.meant[0][1] in _NO_PREFIX:
        values = {"mean_n": preload, "preload_n": recording.preload_n, "guess": guess}
        return np.inf, Finding(Reason.FORCE_CONTRADICTS_PRELOAD, recording.id, "force_n", values)
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
    gain = best - max(nats(0.0, 0.0), -0.5 * log(SLIP) ** 2)
    if not gain > GAIN:
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
    return gain, Finding(reason, recording.id, reason.value.partition("series_")[2] + "_n", arguments)
