"""Findings on values that no skin, no rig and no clock has: stated times, places of sensors, declared values, and d33.

They are the same on import and in a diagnosis. The clock only decides whether a recording lies further in the future
than time zones differ; no statement holds today's date, so a campaign keeps its findings on later days.

A declared value of the skin, or one common to all recordings, that none has looks like a wrong unit, which nothing else
in the campaign would reveal: every contact law would be fitted with a wrong force or modulus. Nothing is concluded
until it is corrected, or confirmed by `units_checked`. d33 by the base model does not depend on `UNUSED_FOR_D33`, and
is stated all the same; so is an implausible d33, since a wrong gain or unit changes every value alike, and the fit
cannot detect it.
"""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
from scipy.spatial import KDTree

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.sentences import ImplausibleD33
from underskin.physics import hertz
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.recordings import curve_course
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor
from underskin.recordings.curve_preparation import prepared
from underskin.units import LAB, Floats, Mask, to_si, unit_guess, unusual

_EARLIEST = datetime(1990, 1, 1, tzinfo=UTC)  # clocks that were never set begin in 1904, 1970 or 1980
_ZONES = timedelta(days=1)  # a time without a zone is taken as UTC
_IN_METRES = 1000.0
_LARGEST_IN_METRES_MM = 0.1


def implausible(campaign: Campaign) -> list[Finding]:
    """Impossible times, overlapping sensors, and the corrections of curves."""
    return [*_times(campaign), *overlapping_sensors(campaign), *prepared(campaign).findings]


def at_reading(campaign: Campaign) -> list[Finding]:
    """`implausible`, with slips of units of curves and of the dynamic force of all FRFs."""
    curves = prepared(campaign)
    slips = [*curve_course.implausible(curves.campaign), *loose_sphere(campaign.of(FrfRecording))]
    return [*_times(campaign), *overlapping_sensors(campaign), *curves.findings, *slips]


def loose_sphere(recordings: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that reaches the preload in all recordings, so that the sphere would lose contact."""
    if not recordings or any(recording.dynamic_force_n < recording.preload_n for recording in recordings):
        return []
    return [Finding(Reason.DYNAMIC_FORCE_LARGE, "", "dynamic_force_n")]


def _times(campaign: Campaign) -> Iterator[Finding]:
    """The first recording in the future, and the first from before such instruments existed."""
    latest = datetime.now(UTC) + _ZONES
    stated = [
        (recording.id, recording.recorded_at) for recording in campaign.recordings if recording.recorded_at is not None
    ]
    to_come = [stamp for stamp in stated if moment(stamp[1]) > latest]
    too_old = [stamp for stamp in stated if moment(stamp[1]) < _EARLIEST]
    limit = {"year": _EARLIEST.year}
    for reason, matching, bounds in ((Reason.TIME_TO_COME, to_come, {}), (Reason.TIME_TOO_OLD, too_old, limit)):
        if matching:
            (recording_id, written), *others = matching
            yield Finding(reason, recording_id, "recorded_at", {"written": written, "more": len(others), **bounds})


def moment(written: str) -> datetime:
    """A stated time, in UTC where it has no zone."""
    moment = datetime.fromisoformat(written)
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def overlapping_sensors(campaign: Campaign) -> list[Finding]:
    """Sensors at one place, or else the nearest two where they are nearer than their radius allows."""
    positions: dict[tuple[float, float], list[str]] = {}
    for sensor in campaign.skin.sensors:
        positions.setdefault((sensor.x_mm, sensor.y_mm), []).append(sensor.id)
    shared = [(position, ids) for position, ids in positions.items() if len(ids) > 1]
    if shared:
        ((x, y), ids), *others = shared
        arguments = {"sensors": ids, "x_mm": x, "y_mm": y, "more": len(others)}
        return [Finding(Reason.SENSORS_AT_ONE_PLACE, "", "skin.sensors", arguments)]
    radius, nearest = campaign.skin.sensor_radius_mm, nearest_pair(campaign.skin.sensors)
    if radius is None or nearest is None or nearest[0] >= 2 * radius:
        return []
    pitch, *pair = nearest
    in_metres = _IN_METRES * pitch >= 2 * radius and pitch < _LARGEST_IN_METRES_MM
    arguments = {
        "sensors": [campaign.skin.sensors[index].id for index in pair],
        "radius_mm": radius,
        "pitch_mm": pitch,
        "in_metres": in_metres,
    }
    return [Finding(Reason.SENSORS_TOO_NEAR, "", "skin.sensor_radius_mm", arguments)]


def pitch_mm(campaign: Campaign) -> float | None:
    """The least distance between two sensors [mm]; None for fewer than two."""
    nearest = nearest_pair(campaign.skin.sensors)
    return None if nearest is None else nearest[0]


def nearest_pair(sensors: Sequence[Sensor]) -> tuple[float, int, int] | None:
    """The least distance between two sensors [mm], and their indices; None for fewer than two."""
    if len(sensors) < 2:
        return None
    positions: Floats = np.array([(sensor.x_mm, sensor.y_mm) for sensor in sensors])
    distances, neighbours = (np.asarray(column) for column in KDTree(positions).query(positions, k=2))
    first = int(np.argmin(distances[:, 1]))
    if not np.isfinite(distances[first, 1]):
        return None
    second = next(int(index) for index in neighbours[first] if index != first)  # of two at one place either comes first
    return float(distances[first, 1]), min(first, second), max(first, second)


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
    are_series = all(recording.force_n is not None for recording in recordings)  # whose times give the frequencies
    for wrong, too_large, unit in (
        (highest > _FREQUENCIES_HZ[1], True, "s" if are_series else "mHz"),
        (slow or highest < _FREQUENCIES_HZ[0], False, "ms" if are_series else "kHz"),
    ):
        if wrong:
            arguments = {"lowest_hz": lowest, "highest_hz": highest, "too_large": too_large, "given_in": unit}
            arguments["are_series"] = are_series
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


_LEAST_D33, _MOST_D33 = 0.05, 1000.0  # pC/N: range of all reported sensors of skins
OF_PVDF = 1.0, 100.0  # pC/N: PVDF and its copolymers have 10 to 40


def of_array(reason: Reason, d33: float, *, units_checked: bool) -> list[Finding]:
    """A finding, for this reason, on an implausible d33 of an array [pC/N]."""
    implausible = implausibility(d33, units_checked=units_checked)
    units = unit_guess("d33_pc_per_n", d33, OF_PVDF).units if implausible is ImplausibleD33.NOT_PVDF else ()
    arguments = {"d33_pc_per_n": d33, "kind": implausible, "units": units}
    return [] if implausible is None else [Finding(reason, "", "d33_pc_per_n", arguments)]


def implausibility(d33: float, *, units_checked: bool = False) -> ImplausibleD33 | None:
    """Why PVDF cannot have a d33 [pC/N]; None of one that it may have, and where the units of another are checked."""
    implausible = next((implausible for implausible, rows in _implausible_rows(np.array(d33)).items() if rows), None)
    if implausible is not None or units_checked or OF_PVDF[0] <= d33 <= OF_PVDF[1]:
        return implausible
    return ImplausibleD33.NOT_PVDF


def of_rows(frf: Floats, d33: Floats) -> list[Finding]:
    """Findings on measured FRF and the resulting d33 (rows,) [pC/N]: the first row of each kind.

    A row with a finding on its FRF has none on its d33.
    """
    likely = LAB["frf_pc_per_n"].likely
    assert likely is not None
    usual = (np.abs(frf) >= likely[0]) & (np.abs(frf) <= likely[1])
    return [*unusual("frf_pc_per_n", frf), *_first(np.where(usual, d33, np.nan))]


def _first(d33: Floats) -> Iterator[Finding]:
    for implausible, rows in _implausible_rows(d33).items():
        if rows.any():
            first = int(np.argmax(rows))
            arguments = {"d33_pc_per_n": float(d33.flat[first]), "kind": implausible, "more": int(rows.sum()) - 1}
            yield Finding(Reason.D33_OF_ROW, "", "d33_pc_per_n", arguments, index=first if d33.ndim else None)


def _implausible_rows(d33: Floats) -> dict[ImplausibleD33, Mask]:
    """Which entries [pC/N] are doubtful; none where there is no value (NaN)."""
    size = np.abs(d33)
    return {
        ImplausibleD33.TOO_LARGE: size > _MOST_D33,
        ImplausibleD33.TOO_SMALL: size < _LEAST_D33,
        ImplausibleD33.NEGATIVE: d33 < 0,
    }
