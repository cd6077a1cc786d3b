"""Slips of units in what a campaign declares of its recordings: a force in kN, a place in m, a frequency in kHz.

A value that is alone is left out with its recording. Where all recordings share the slip, nothing else in the campaign
says so, and every law of contact would be tried on a wrong force: then nothing is concluded, until it is corrected or
`units_checked` says that it is meant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf_estimation import lines_of
from underskin.units import Floats

_SLIP, _WITHIN = 1000.0, 3.0  # a value is back among the others, within this factor, once the slip is undone
_ALONE = 0.25  # of the recordings at most
_LEAST_PRELOAD_N = 0.01
_FREQUENCIES_HZ = (0.5, 2e4)  # the highest line of a campaign
_FAINT = 5e-4  # dynamic force over preload
_SMALL_PLACES_MM, _LEAST_SPREAD_MM = 0.2, 1.0


@dataclass(frozen=True)
class _Field:
    """A field whose values can be held against each other, and the units that its slips come from."""

    name: str
    of: Callable[[FrfRecording], float]
    too_large: str
    too_small: str


_FIELDS = (
    _Field("preload_n", lambda entry: entry.preload_n, "mN", "kN"),
    _Field("dynamic_force_n", lambda entry: entry.dynamic_force_n, "mN", "kN"),
    _Field("indenter_radius_mm", lambda entry: entry.indenter_radius_mm, "µm", "m"),
    _Field("frequency_hz", lambda entry: float(np.median(lines_of(entry).frequency)), "mHz", "kHz"),
)


def lone_slips(entries: Sequence[FrfRecording], found: list[Finding]) -> NDArray[np.bool_]:
    """Which recordings have a value about 1000 × off all others; each is named."""
    off = np.zeros(len(entries), dtype=bool)
    if not entries:
        return off
    for field in _FIELDS:
        values = np.array([field.of(entry) for entry in entries])
        usual = float(np.median(values))
        for factor, unit, word in ((_SLIP, field.too_large, "large"), (1 / _SLIP, field.too_small, "small")):
            far = values / usual > _SLIP / 30 if factor > 1 else values / usual < 30 / _SLIP
            if not far.any() or far.sum() > _ALONE * len(entries):
                continue
            others = values[~far]
            meant = values / factor
            back = far & (meant > others.min() / _WITHIN) & (meant < others.max() * _WITHIN)
            for number in np.flatnonzero(back & ~off).tolist():
                text = f"{values[number]:g} looks 1000 × too {word} beside the others: was it given in {unit}? Left out"
                found.append(Finding("units_off_by_1000", entries[number].id, field.name, text))
            off |= back
    return off


def shared_slips(campaign: Campaign, entries: Sequence[FrfRecording]) -> list[Finding]:
    """What all recordings have in common that looks like a slip of units."""
    found = []
    preload = np.array([entry.preload_n for entry in entries])
    dynamic = np.array([entry.dynamic_force_n for entry in entries])
    if not campaign.units_checked:
        if preload.max() < _LEAST_PRELOAD_N:
            text = f"no preload is above {preload.max():g} N: they look 1000 × too small; were they given in kN?"
            found.append(Finding("units_off_by_1000", "", "preload_n", text))
        highest = max(float(np.max(lines_of(entry).frequency)) for entry in entries)
        for wrong, word, unit in (
            (highest > _FREQUENCIES_HZ[1], "large", "mHz"),
            (highest < _FREQUENCIES_HZ[0], "small", "kHz"),
        ):
            if wrong:
                text = f"the highest frequency is {highest:g} Hz: it looks 1000 × too {word}; was it given in {unit}?"
                found.append(Finding("units_off_by_1000", "", "frequency_hz", text))
        found += _places(campaign, entries)
    if not found and (dynamic >= preload).all():
        text = "the dynamic force reaches the preload in all recordings, so the sphere would leave the skin; in mN?"
        found.append(Finding("units_off_by_1000", "", "dynamic_force_n", text))
    return found


def faint_oscillation(entries: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that is hardly there, as one in kN would be; only the laws of large amplitudes use it."""
    ratio = max(entry.dynamic_force_n / entry.preload_n for entry in entries)
    if ratio > _FAINT:
        return []
    text = f"it is at most {ratio:.1g} of the preload: it looks 1000 × too small; was it given in kN?"
    return [Finding("units_off_by_1000", "", "dynamic_force_n", text)]


def _places(campaign: Campaign, entries: Sequence[FrfRecording]) -> list[Finding]:
    """Places in m beside sensors in mm: all contacts lie at the origin, and a thousandfold at their own sensors."""
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    placed = [entry for entry in entries if entry.position_mm is not None]
    if not placed:
        return []
    own: Floats = np.array([known[entry.sensor] for entry in placed])
    place: Floats = np.array([entry.position_mm for entry in placed])
    if np.abs(place).max() > _SMALL_PLACES_MM or np.ptp(own, axis=0).max() < _LEAST_SPREAD_MM:
        return []
    given, meant = (np.hypot(*(scale * place - own).T) for scale in (1.0, _SLIP))
    if np.median(meant) > 0.5 * np.median(given[given > 0] if (given > 0).any() else given):
        return []
    text = "all places lie at the origin, and a thousandfold at their own sensors: were they given in m?"
    return [Finding("units_off_by_1000", "", "position_mm", text)]
