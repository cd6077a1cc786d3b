"""Recordings without a response above their own noise: a sensor that is dead or not connected.

A recording is left out where the others let expect a response well above its noise (`comparison`), and it shows none,
or its charge is incoherent with the force and a small share of what is expected: strong low-frequency noise, hum, or
magnitudes without a phase exceed in the mean what neighbouring lines differ by.

Two sensors that stop responding together while others respond either have exchanged cables, so that each was recorded
while the other was pressed, or a connector or amplifier that they share has failed. As neither gives a response, the
recordings cannot tell which.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.comparison import Comparison, aligned_lines, no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Mask

_EXPECTED = 16.0  # squared expected response over noise variance above which a recording without one is left out
_SMALL = 0.1  # of the expected level, or of the largest expected one: near a zero crossing a response may vanish
_INCOHERENT = 0.5  # γ² below which a line's noise is larger than its response
_FEWEST = 2  # silent recordings of each of two sensors


def dead(recordings: Sequence[FrfRecording], comparison: Comparison) -> tuple[Mask, list[Finding]]:
    """Which recordings show no response where the others let expect one well above their noise.

    Each is a finding, or its sensor is one where it shows no response in most of its recordings and only a weak one,
    within noise, in the others.
    """
    expected, weak = comparison.expected, comparison.level < _SMALL * comparison.expected
    silent = comparison.unresponsive | (_incoherent(recordings) & weak)
    missing: Mask = silent & (expected**2 > _EXPECTED * comparison.variance)
    findings = []
    sensors = np.array([recording.sensor for recording in recordings])
    for name in dict.fromkeys(sensors[missing].tolist()):
        of_sensor = sensors == name
        count = int(of_sensor.sum())
        if count > 1 and 2 * missing[of_sensor].sum() > count and (missing | weak)[of_sensor].all():
            missing |= of_sensor
            arguments = {"recordings": count, "sensor": name}
            findings.append(Finding(Reason.SILENT_SENSOR, "", "frf_re_pc_per_n", arguments))
            continue
        missing &= ~of_sensor | (expected > _SMALL * expected.max())
        findings += [
            Finding(Reason.SILENT_RECORDING, recordings[index].id, "frf_re_pc_per_n")
            for index in np.flatnonzero(missing & of_sensor).tolist()
        ]
    return missing, findings


def _incoherent(recordings: Sequence[FrfRecording]) -> Mask:
    """Whether the noise of most of a recording's lines exceeds their response; False where the coherence is unknown."""
    coherences = [lines_of(recording).coherence for recording in recordings]
    return np.array(
        [coherence is not None and float(np.nanmedian(coherence)) < _INCOHERENT for coherence in coherences]
    )


def without_silent_pair(recordings: Sequence[FrfRecording]) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings without those of two sensors since they show no response, and the finding."""
    since = _silent_since(recordings)
    if not since:
        return list(recordings), []
    first, second = sorted({recordings[index].sensor for index in since})
    arguments = {"first": first, "second": second, "since": recordings[since[0]].id, "recordings": len(since)}
    remaining = [recording for index, recording in enumerate(recordings) if index not in since]
    return remaining, [Finding(Reason.SILENT_TOGETHER, "", "sensor", arguments)]


def _silent_since(recordings: Sequence[FrfRecording]) -> list[int]:
    """The recordings, in time, of two sensors since both stopped responding while others respond; empty where these
    are not exactly two."""
    silent, _ = no_response(aligned_lines(recordings))
    order = np.argsort(recording_order(recordings), kind="stable").tolist()
    falling = set[str]()
    for name in {recording.sensor for recording in recordings}:
        answers = [bool(~silent[index]) for index in order if recordings[index].sensor == name]
        if answers[0] and not any(answers[-_FEWEST:]) and answers == sorted(answers, reverse=True):
            falling.add(name)
    if len(falling) != 2:
        return []
    of_pair = [index for index in order if recordings[index].sensor in falling]
    since = of_pair[int((~silent[of_pair]).sum()) :]
    others = [index for index in order[order.index(since[0]) :] if index not in of_pair]
    return since if silent[since].all() and others and not silent[others].any() else []
