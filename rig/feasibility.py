"""Rejects impossible experiments: overlapping sensors, loads outside the skin, spheres that lift off."""

import math
from collections.abc import Sequence
from itertools import combinations

from rig.errors import RigError
from rig.experiment import DeclaredSkin, RecordingDesign

_LEAST_D33 = 0.05  # pC/N; even an unpoled polymer has as much
_INFLUENCE = 8.0  # thicknesses; beyond, less than a millionth of the stress remains


def check_skin(skin: DeclaredSkin) -> None:
    """Raise RigError for a d33 that is too small, and for sensors that overlap."""
    size = abs(skin.d33_pc_per_n)
    if size < _LEAST_D33:
        slip = f"; {size:g} C/N would be {1e12 * size:g} pC/N" if 1e12 * size >= _LEAST_D33 else ""
        raise RigError("skin.d33_pc_per_n", skin.d33_pc_per_n, f"must be at least {_LEAST_D33:g} pC/N in size{slip}")
    for (first, *here), (second, *there) in combinations(skin.sensors, 2):
        apart = math.dist(here, there)
        if first == second:
            raise RigError("skin.sensors", first, "must be the id of one sensor alone")
        touching = 2 * skin.sensor_radius_mm
        if apart < touching * (1 - 1e-9):
            allowed = f"must be at least {touching:g} mm apart, two sensor radii, else they overlap"
            raise RigError("skin.sensors", f"{first} and {second}, {apart:g} mm apart", allowed)


def check_presses(design: RecordingDesign, skin: DeclaredSkin) -> None:
    """Raise RigError for spheres that lift off, lie outside the skin, or are out of range of the sensor."""
    lowest = min(design.preloads_n)
    for index, force in enumerate(design.dynamic_forces_n):
        if force >= lowest:
            allowed = f"must be below the lowest preload, {lowest:g} N: the sphere would lift off"
            raise RigError(f"design.dynamic_forces_n[{index}]", force, allowed)
    reach = _INFLUENCE * skin.thickness_mm - skin.sensor_radius_mm
    for index, offset in enumerate(design.offsets_mm):
        field, away = f"design.offsets_mm[{index}]", math.hypot(*offset)
        if away > max(reach, 0.0):
            allowed = f"must be 0 to {max(reach, 0):g} mm from the sensor's centre, beyond which nothing reaches it"
            raise RigError(field, list(offset), allowed)
        _check_on_skin(field, offset, skin, design.sensors)


def _check_on_skin(field: str, offset: Sequence[float], skin: DeclaredSkin, sensors: Sequence[str]) -> None:
    """Raise RigError for a load outside the skin; the array is in its middle, its length along x."""
    for axis, extent, name in ((0, skin.length_mm, "length_mm"), (1, skin.width_mm, "width_mm")):
        if extent is None:
            continue
        centres = [centre[axis] for _, *centre in skin.sensors]
        middle = (min(centres) + max(centres)) / 2
        for sensor, *centre in skin.sensors:
            at = centre[axis] + offset[axis]
            if (not sensors or sensor in sensors) and abs(at - middle) > extent / 2:
                allowed = (
                    f"puts the sphere of {sensor} at {'xy'[axis]} = {at:g} mm: must be {middle - extent / 2:g} to "
                    f"{middle + extent / 2:g} mm, on the skin (skin.{name})"
                )
                raise RigError(field, list(offset), allowed)
