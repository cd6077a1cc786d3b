"""Places that contradict the sensors they belong to: given in m, or in µm, beside sensors in mm.

A place p is taken for a slip where f·p, with f = 1000 or 1/1000, lies far nearer to its own sensor than p does. At a
sensor in the origin a slip cannot be seen, and does little.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.finding import Finding
from underskin.units import Floats

_SLIPS = (
    # factor, least distance from the sensor [mm], how it is said, what the places were given in, or the sensors
    (1e3, 1.0, "a thousandfold", "m", "µm"),
    (1e-3, 200.0, "divided by 1000", "µm", "m"),
)
_NEARER = 5.0
_HUDDLED_MM = (1e-4, 0.01)  # no stage and no lab means such distances from a sensor
_ALONE = 0.25  # of the recordings at most; more are no accident of single ones

Mask = NDArray[np.bool_]


def misplaced(campaign: Campaign, entries: Sequence[FrfRecording], found: list[Finding]) -> tuple[Mask, list[Finding]]:
    """Which single recordings' places are 1000 × off, each named in `found`; and what is said where many are."""
    own, place = _sensors_and_places(campaign, entries)
    alone, shared = np.zeros(len(entries), dtype=bool), []
    for factor, least, words, unit, sensors_unit in _SLIPS:
        given, meant = (np.hypot(*(scale * place - own).T) for scale in (1.0, factor))
        off = (given > least) & (_NEARER * meant < given)
        if off.sum() > _ALONE * len(entries):
            text = f"places lie at their own sensors only {words}: were they given in {unit}, or the sensors in "
            shared.append(Finding("units_off_by_1000", "", "position_mm", f"{text}{sensors_unit}?"))
            continue
        for number in np.flatnonzero(off).tolist():
            text = f"its place lies at its own sensor only {words}: was it given in {unit}? Left out"
            found.append(Finding("units_off_by_1000", entries[number].id, "position_mm", text))
        alone |= off
    return alone, shared


def huddled(campaign: Campaign, entries: Sequence[FrfRecording]) -> list[Finding]:
    """Places that differ from their sensors' by some µm at most: an offset series in m."""
    own, place = _sensors_and_places(campaign, entries)
    farthest = float(np.hypot(*(place - own).T).max())
    if not _HUDDLED_MM[0] < farthest < _HUDDLED_MM[1]:
        return []
    text = f"no place lies farther from its sensor than {farthest:.2g} mm: were they given in m?"
    return [Finding("units_off_by_1000", "", "position_mm", text)]


def _sensors_and_places(campaign: Campaign, entries: Sequence[FrfRecording]) -> tuple[Floats, Floats]:
    """Of each recording [mm], (recordings, 2) each."""
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    own: Floats = np.array([known[entry.sensor] for entry in entries]).reshape(-1, 2)
    place: Floats = np.array([entry.position_mm or known[entry.sensor] for entry in entries]).reshape(-1, 2)
    return own, place
