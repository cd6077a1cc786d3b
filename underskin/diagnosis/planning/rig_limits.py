"""What the rig can do, given by the user or inferred from the campaign, and the recordings within these limits."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.data.dataset import COLLAPSED_HZ
from underskin.errors import out_of_range
from underskin.recordings.campaign import Conditions, FrfConditions, frf_of, offsets

MOST_RECORDINGS = 8
_FURTHER = 1.25  # times the highest preload used
_PRELOADS = 8
# Times the campaign's largest dynamic force and longest dwell, where limits are not given
_LOUDER, _LONGER = (3.0, 10.0), 10.0


@dataclass(frozen=True)
class RigLimits:
    """The limits of the rig, in lab units; fields that are None are inferred from the campaign.

    Raises InvalidInput for a force, a radius or a count not above zero, or a distance or a time below zero.
    """

    preload_n: tuple[float, float] | None = None
    indenter_radius_mm: Sequence[float] | None = None
    dynamic_force_n: Sequence[float] | None = None
    dwell_s: Sequence[float] | None = None
    offset_mm: Sequence[float] | None = None
    recordings: int = MOST_RECORDINGS
    minutes_per_recording: float = 5.0
    minutes_per_indenter: float = 10.0

    def __post_init__(self) -> None:
        if self.preload_n is not None and not 0 < self.preload_n[0] <= self.preload_n[1] < math.inf:
            raise out_of_range("preload_n", list(self.preload_n), "must be above 0, the lowest first")
        for name in ("indenter_radius_mm", "dynamic_force_n"):
            if any(not 0 < value < math.inf for value in getattr(self, name) or ()):
                raise out_of_range(name, list(getattr(self, name)), "must be above 0, each")
        for name in ("dwell_s", "offset_mm"):
            if any(not 0 <= value < math.inf for value in getattr(self, name) or ()):
                raise out_of_range(name, list(getattr(self, name)), "must be 0 or more, each")
        if self.recordings < 1:
            raise out_of_range("recordings", self.recordings, "must be 1 or more")

    @property
    def given(self) -> bool:
        """Whether the user gave any limit."""
        limits = (self.preload_n, self.indenter_radius_mm, self.dynamic_force_n, self.dwell_s, self.offset_mm)
        return any(limit is not None for limit in limits)


def inferred(conditions: Conditions, limits: RigLimits) -> RigLimits:
    """The limits with missing ones from the campaign: its spheres, dynamic forces, dwells and distances from the
    sensor, and its preloads up to a quarter beyond the highest."""
    recordings = frf_of(conditions)
    preloads = [recording.preload_n for recording in recordings]
    distances = np.round(1e3 * np.hypot(*offsets(conditions).T), 1)
    dwells = [recording.dwell_s for recording in recordings if recording.dwell_s is not None]
    return replace(
        limits,
        preload_n=limits.preload_n or (min(preloads), _FURTHER * max(preloads)),
        indenter_radius_mm=limits.indenter_radius_mm
        or sorted({recording.indenter_radius_mm for recording in recordings}),
        dynamic_force_n=limits.dynamic_force_n or _ends([recording.dynamic_force_n for recording in recordings]),
        dwell_s=limits.dwell_s or (_ends(dwells) if len(dwells) == len(recordings) else ()),
        offset_mm=_ends(distances.tolist()) if limits.offset_mm is None else limits.offset_mm,
    )


def wider(conditions: Conditions, limits: RigLimits) -> RigLimits:
    """Inferred limits widened to what most rigs can do: larger dynamic forces, a longer dwell, and contacts at half and
    at one thickness from the sensor."""
    thickness = conditions.skin.thickness_mm
    assert thickness is not None
    assert limits.dynamic_force_n is not None
    assert limits.dwell_s is not None
    assert limits.offset_mm is not None
    return replace(
        limits,
        dynamic_force_n=[*limits.dynamic_force_n, *(times * max(limits.dynamic_force_n) for times in _LOUDER)],
        dwell_s=[*limits.dwell_s, _LONGER * max(limits.dwell_s)] if limits.dwell_s else (),
        offset_mm=sorted({*limits.offset_mm, 0.5 * thickness, thickness}),
    )


def _ends(values: Sequence[float]) -> list[float]:
    return sorted({min(values), max(values)}) if values else []


def candidates(conditions: Conditions, limits: RigLimits) -> list[FrfConditions]:
    """A recording for every combination within the limits, at the sensor that was recorded most, after all others."""
    recordings = frf_of(conditions)
    sensors = [recording.sensor for recording in recordings]
    sensor = max(dict.fromkeys(sensors), key=sensors.count)
    position = next((declared.x_mm, declared.y_mm) for declared in conditions.skin.sensors if declared.id == sensor)
    cycles = [recording.load_cycles for recording in recordings if recording.load_cycles is not None]
    assert limits.preload_n is not None
    low, high = limits.preload_n
    between = (float(f"{force:.2g}") for force in np.geomspace(low, high, _PRELOADS))
    settings = itertools.product(
        sorted({low, *(force for force in between if low <= force <= high), high}),
        limits.indenter_radius_mm or (),
        limits.dynamic_force_n or (),
        limits.dwell_s or (None,),
        limits.offset_mm or (0.0,),
    )
    possible = [setting for setting in settings if setting[2] < setting[0]]  # dynamic force and preload
    return [
        FrfConditions(
            id=f"candidate {index}",
            sensor=sensor,
            indenter_radius_mm=sphere,
            preload_n=force,
            dynamic_force_n=amplitude,
            recorded_at=recordings[0].recorded_at,
            dwell_s=dwell,
            load_cycles=max(cycles) if len(cycles) == len(recordings) else None,
            position_mm=(position[0] + round(offset, 3), position[1]),
            frequency_hz=np.array([COLLAPSED_HZ]),
        )
        for index, (force, sphere, amplitude, dwell, offset) in enumerate(possible)
    ]
