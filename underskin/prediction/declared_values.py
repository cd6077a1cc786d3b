"""Declared values of the skin, and values common to all recordings, of a magnitude that no skin and no rig has.

Such a value looks like a wrong unit, which nothing else in the campaign would reveal: every contact law would be fitted
with a wrong force or modulus. It is a finding, and nothing is concluded until it is corrected, or confirmed by
`units_checked`. d33 by the base model does not depend on `UNUSED_FOR_D33`, and is stated all the same.
"""

from collections.abc import Sequence

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.physics import hertz
from underskin.physics.skin import INCOMPRESSIBLE
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.plausibility import moment, pitch_mm
from underskin.units import Floats, to_si, unit_guess, unusual

UNUSED_FOR_D33 = ("frequency_hz", "coherence")
_PRELOADS_N = (0.01, 150.0)  # of stages: least for the highest preload of a campaign, most for the lowest
_FREQUENCIES_HZ = (0.5, 2e4)  # of shakers and charge amplifiers: range of the highest line of a campaign
_LEAST_SWEEP_HZ = 2.0  # of the highest of several lines: below it shakers end and charge amplifiers roll off
_LEAST_PAUSE_S = 5.0  # no sweep takes less
_SLOW_HZ = (0.02, 5.0)  # implausible: a sweep that starts below the first and ends below the second frequency
_ELASTOMERS_MPA = (0.02, 100.0)  # from gels to the hardest (Ashby, Materials Selection in Mechanical Design, fig. 4.3)
_PERCENT = 0.01  # largest coherence of a campaign that looks like a share read as per cent
_SLIP = 1000.0  # between neighbouring units
_WIDEST_PITCH_MM = 300.0  # skins of robots have 2 to 50
_GEOMETRY = ("thickness_mm", "sensor_radius_mm", "width_mm", "length_mm")


def unlikely(campaign: Campaign, recordings: Sequence[FrfRecording], lines: Sequence[Floats]) -> list[Finding]:
    """Findings on magnitudes of the skin, or common to all recordings, that look like a wrong unit; `lines`: the
    frequencies of each recording [Hz]."""
    return [*_of_skin(campaign, recordings), *_of_recordings(recordings), *_of_frequencies(recordings, lines)]


def _of_skin(campaign: Campaign, recordings: Sequence[FrfRecording]) -> list[Finding]:
    skin = campaign.skin
    assert skin.youngs_modulus_mpa is not None
    findings = []
    low, high = _ELASTOMERS_MPA
    modulus = skin.youngs_modulus_mpa
    if modulus > high or (modulus < low and _sink(modulus, recordings)):
        arguments = {
            "modulus_mpa": modulus,
            "low_mpa": low,
            "high_mpa": high,
            "guess": unit_guess("youngs_modulus_mpa", modulus, _ELASTOMERS_MPA),
        }
        findings.append(Finding(Reason.MODULUS_OF_NO_ELASTOMER, "", "skin.youngs_modulus_mpa", arguments))
    for name in _GEOMETRY:
        findings += _unusual(f"skin.{name}", unusual(name, getattr(skin, name) or 1.0))
    pitch = pitch_mm(campaign)
    if pitch is not None and pitch > _WIDEST_PITCH_MM:
        findings.append(Finding(Reason.WIDE_PITCH, "", "skin.sensors", {"pitch_mm": pitch}))
    return findings


def _sink(modulus_mpa: float, recordings: Sequence[FrfRecording]) -> bool:
    """Whether a sphere would sink into a skin this soft, a contact wider than the sphere by Hertz; a gel that bears
    its spheres is no slip."""
    preload = np.array([recording.preload_n for recording in recordings])
    radius = to_si("indenter_radius_mm", [recording.indenter_radius_mm for recording in recordings])
    return bool((hertz.contact_radius(preload, radius, 1e6 * modulus_mpa, INCOMPRESSIBLE) > radius).any())


def _of_recordings(recordings: Sequence[FrfRecording]) -> list[Finding]:
    preload = np.array([recording.preload_n for recording in recordings])
    findings = []
    if preload.max() < _PRELOADS_N[0]:
        findings.append(Finding(Reason.PRELOADS_SMALL, "", "preload_n", {"highest_n": float(preload.max())}))
    if preload.min() > _PRELOADS_N[1]:
        findings.append(Finding(Reason.PRELOADS_LARGE, "", "preload_n", {"lowest_n": float(preload.min())}))
    sphere = float(np.median([recording.indenter_radius_mm for recording in recordings]))
    findings += _unusual("indenter_radius_mm", unusual("indenter_radius_mm", sphere))
    coherence = [recording.coherence for recording in recordings if recording.coherence is not None]
    largest = max((float(of_lines.max()) for of_lines in coherence), default=1.0)
    if 0 < largest <= _PERCENT:
        findings.append(Finding(Reason.COHERENCE_SMALL, "", "coherence", {"largest": largest}))
    return findings


def _unusual(field: str, findings: Sequence[Finding]) -> list[Finding]:
    """Unusual magnitudes as wrong units of a declared field, which nothing else in the campaign checks."""
    return [Finding(Reason.DECLARED_UNUSUAL, "", field, finding.arguments) for finding in findings]


def _of_frequencies(recordings: Sequence[FrfRecording], lines: Sequence[Floats]) -> list[Finding]:
    lowest, highest = (
        min(float(frequency.min()) for frequency in lines),
        max(float(frequency.max()) for frequency in lines),
    )
    slow = (lowest < _SLOW_HZ[0] and highest < _SLOW_HZ[1]) or lowest < highest < _LEAST_SWEEP_HZ
    for wrong, too_large, unit in (
        (highest > _FREQUENCIES_HZ[1], True, "mHz"),
        (slow or highest < _FREQUENCIES_HZ[0], False, "kHz"),
    ):
        if wrong:
            arguments = {"lowest_hz": lowest, "highest_hz": highest, "too_large": too_large, "given_in": unit}
            return [Finding(Reason.FREQUENCIES, "", "frequency_hz", arguments)]
    pause = _pause_s(recordings)
    if pause is not None and pause * lowest < 1 and _SLIP * highest <= _FREQUENCIES_HZ[1]:
        arguments = {"lowest_hz": lowest, "pause_s": pause}
        return [Finding(Reason.PERIODS_TOO_LONG, "", "frequency_hz", arguments)]
    return []


def _pause_s(recordings: Sequence[FrfRecording]) -> float | None:
    """The median time from one recording of a sensor to its next [s]; stamps within seconds count as one recording."""
    times = [recording.recorded_at for recording in recordings if recording.recorded_at is not None]
    if len(times) < len(recordings):
        return None
    seconds = np.array([moment(time).timestamp() for time in times])
    sensors = np.array([recording.sensor for recording in recordings])
    steps = np.concatenate([np.diff(np.sort(seconds[sensors == name])) for name in np.unique(sensors)])
    pauses = steps[steps >= _LEAST_PAUSE_S]
    return float(np.median(pauses)) if len(pauses) else None
