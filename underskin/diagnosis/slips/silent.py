"""Recordings without a response above their own noise: a sensor that is dead or not connected.

A recording is left out where the others let expect a response well above its noise (`comparison`), and it shows none,
or its charge is incoherent with the force and a small share of what is expected: strong low-frequency noise, hum, or
magnitudes without a phase exceed in the mean what neighbouring lines differ by. A response S that is missing from noise
of variance v costs no slip S²/2v of ln evidence.

Two sensors that stop responding together while others respond either have exchanged cables, so that each was recorded
while the other was pressed, or a connector or amplifier that they share has failed. As neither gives a response, the
recordings cannot tell which.
"""

from collections.abc import Iterator, Sequence
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.table import GAIN, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Mask

_SMALL = 0.1  # of the expected level, or of the largest expected one: near a zero crossing a response may vanish
_INCOHERENT = 0.5  # γ² below which a line's noise is larger than its response
_FEWEST = 2  # silent recordings of each of two sensors
_FIELD = "frf_re_pc_per_n"


def silent(screened: Screened) -> Iterator[Alternative]:
    """Two sensors that fell silent together; and all recordings that show no response where one is expected."""
    recordings, comparison = screened.recordings, screened.comparison
    with np.errstate(divide="ignore", invalid="ignore"):
        missing_nats = np.where(comparison.expected > 0, comparison.expected**2 / comparison.variance / 2, 0.0)
    since = _silent_since(recordings, comparison.unresponsive)
    if since:
        first, second = sorted({recordings[index].sensor for index in since})
        arguments = {"first": first, "second": second, "since": recordings[since[0]].id, "recordings": len(since)}
        finding = Finding(Reason.SILENT_TOGETHER, "", "sensor", arguments)
        off = np.isin(np.arange(len(recordings)), since)
        yield Alternative(-log(len(recordings)), float(missing_nats[off].sum()), undo=screened.without(off, finding))
    off, findings = _missing(screened, missing_nats > GAIN + log(len(recordings)))
    if findings:
        choices = len(findings) * log(len(recordings))
        yield Alternative(-choices, float(missing_nats[off].sum()), undo=screened.without(off, *findings))


def _missing(screened: Screened, expected: Mask) -> tuple[Mask, list[Finding]]:
    """Which recordings show no response where one is `expected`.

    Each is a finding, or its sensor is one where it shows no response in most of its recordings and only a weak one,
    within noise, in the others.
    """
    recordings, comparison = screened.recordings, screened.comparison
    weak = comparison.level < _SMALL * comparison.expected
    missing: Mask = (comparison.unresponsive | (_incoherent(recordings) & weak)) & expected
    findings = []
    sensors = np.array([recording.sensor for recording in recordings])
    for name in dict.fromkeys(sensors[missing].tolist()):
        of_sensor = sensors == name
        count = int(of_sensor.sum())
        if count > 1 and 2 * missing[of_sensor].sum() > count and (missing | weak)[of_sensor].all():
            missing |= of_sensor
            findings.append(Finding(Reason.SILENT_SENSOR, "", _FIELD, {"recordings": count, "sensor": name}))
            continue
        missing &= ~of_sensor | (comparison.expected > _SMALL * comparison.expected.max())
        single = np.flatnonzero(missing & of_sensor).tolist()
        findings += [Finding(Reason.SILENT_RECORDING, recordings[index].id, _FIELD) for index in single]
    return missing, findings


def _incoherent(recordings: Sequence[FrfRecording]) -> Mask:
    """Whether the noise of most of a recording's lines exceeds their response; False where the coherence is unknown."""
    coherences = [lines_of(recording).coherence for recording in recordings]
    return np.array(
        [coherence is not None and float(np.nanmedian(coherence)) < _INCOHERENT for coherence in coherences]
    )


def _silent_since(recordings: Sequence[FrfRecording], unresponsive: Mask) -> list[int]:
    """The recordings, in time, of two sensors since both stopped responding while others respond; empty where these
    are not exactly two."""
    order = np.argsort(recording_order(recordings), kind="stable").tolist()
    falling = set[str]()
    for name in {recording.sensor for recording in recordings}:
        answers = [bool(~unresponsive[index]) for index in order if recordings[index].sensor == name]
        if answers[0] and not any(answers[-_FEWEST:]) and answers == sorted(answers, reverse=True):
            falling.add(name)
    if len(falling) != 2:
        return []
    of_pair = [index for index in order if recordings[index].sensor in falling]
    since = of_pair[int((~unresponsive[of_pair]).sum()) :]
    others = [index for index in order[order.index(since[0]) :] if index not in of_pair]
    return since if unresponsive[since].all() and others and not unresponsive[others].any() else []
