"""Recordings without a response above their own noise: a sensor that is dead or not connected.

The noise of a line is estimated from differences of neighbouring lines, σ² = median |z_j+1 − z_j|²/(2 ln 2), z being
the complex values without delay; a resonance between a few lines does not affect it. A recording shows no response
where its mean over n lines is within noise, n |mean|²/σ² < 9 (which noise alone exceeds once in 8000 recordings), and
so are its lines, mean |z|² < 3 σ². Nor does one whose charge is incoherent with the force and is a small share of what
the other recordings let expect: strong low-frequency noise, hum, or magnitudes without a phase exceed in the mean what
neighbouring lines differ by.
"""

from collections.abc import Sequence

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.units import Complexes, Floats, Mask

_LEAST_LINES = 4
_MEAN, _LINES = 9.0, 3.0  # over their variance
_WEAK = 0.1  # of the expected level: largest level of a sensor without response in most of its recordings
_EXPECTED = 16.0  # squared expected response over noise variance above which a recording without one is left out
_INCOHERENT = 0.5  # γ² below which a line's noise is larger than its response
_PLAIN = 0.1  # of the largest expected response: a smaller one is near a zero crossing, and may vanish


def no_response(aligned: Sequence[Complexes]) -> tuple[Mask, Floats]:
    """Which recordings show no response, and the variance of each mean [(C/N)²], 0 where there are too few lines.

    `aligned` holds the lines of each recording (lines,) [C/N] without the common delay (see `levels`).
    """
    unresponsive, variance = np.zeros(len(aligned), dtype=bool), np.zeros(len(aligned))
    for index, values in enumerate(aligned):
        lines = values[np.isfinite(values)]
        if len(lines) < _LEAST_LINES:
            continue
        noise = float(np.median(np.abs(np.diff(lines)) ** 2)) / (2 * np.log(2.0))
        variance[index] = noise / len(lines)
        small_mean = float(np.abs(lines.mean()) ** 2) < _MEAN * variance[index]
        unresponsive[index] = small_mean and float(np.mean(np.abs(lines) ** 2)) < _LINES * noise
    return unresponsive, variance


def dead(
    recordings: Sequence[FrfRecording],
    aligned: Sequence[Complexes],
    unresponsive: Mask,
    variance: Floats,
    expected: Floats,
) -> tuple[Mask, list[Finding]]:
    """Which recordings show no response where the others let expect one well above their noise.

    Each is a finding, or its sensor is one where it shows no response in most of its recordings and only a weak one,
    within noise, in the others.
    """
    level = np.array([float(np.abs(np.nanmean(values))) for values in aligned])
    silent = unresponsive | (_incoherent(recordings) & (level < _WEAK * expected))
    missing: Mask = silent & (expected**2 > _EXPECTED * variance)
    findings = []
    sensors = np.array([recording.sensor for recording in recordings])
    for name in dict.fromkeys(sensors[missing].tolist()):
        of_sensor = sensors == name
        if (
            of_sensor.sum() > 1
            and 2 * missing[of_sensor].sum() > of_sensor.sum()
            and (missing | (level < _WEAK * expected))[of_sensor].all()
        ):
            missing = missing | of_sensor
            arguments = {"recordings": int(of_sensor.sum()), "sensor": name}
            findings.append(Finding(Reason.SILENT_SENSOR, "", "frf_re_pc_per_n", arguments))
            continue
        missing &= ~of_sensor | (expected > _PLAIN * expected.max())
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
