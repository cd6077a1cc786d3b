"""Numbers beyond any instrument and any skin, whatever their unit: their products and powers overflow.

The bounds lie far beyond any slip of units: from a picometre to a kilometre, from a millionth of a pascal to the
pressure in neutron stars. `units_checked` does not confirm such numbers. A recording that holds one is left out; where
the skin has one, nothing can be concluded.
"""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np

from underskin.diagnosis.data.inspected import Inspected
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.recordings.campaign import Campaign, FrfRecording, Recording
from underskin.recordings.conditions import SkinDescription

_LENGTH, _FORCE, _TIME = (1e-9, 1e6), (1e-8, 1e8), (1e-12, 1e12)
_PLACE = (0.0, 1e6)  # of what differences and rotations leave where 0 is meant, too
_CHARGE = (1e-9, 1e9)
_BOUNDS = {
    "thickness_mm": _LENGTH,
    "sensor_radius_mm": _LENGTH,
    "youngs_modulus_mpa": (1e-12, 1e12),
    "sensors": _PLACE,
    "indenter_radius_mm": _LENGTH,
    "sample_height_mm": _LENGTH,
    "sample_diameter_mm": _LENGTH,
    "position_mm": _PLACE,
    "displacement_mm": _LENGTH,
    "preload_n": _FORCE,
    "dynamic_force_n": _FORCE,
    "force_n": (1e-13, 1e8),  # the peak of a soft cantilever's curve may be tens of piconewtons
    "frf_re_pc_per_n": _CHARGE,
    "frf_im_pc_per_n": _CHARGE,
    "charge_pc": _CHARGE,
    "dwell_s": _TIME,
    "time_s": _TIME,
    "sample_rate_hz": (1e-6, 1e9),
}
_WIDEST_SENSOR = 100.0  # radii over the thickness; tables end far below


def without_extremes(campaign: Campaign) -> Inspected:
    """The campaign without recordings that hold such numbers, each a finding; `lacking` where its skin does."""
    of_skin = _of_skin(campaign.skin, any(isinstance(entry, FrfRecording) for entry in campaign.recordings))
    if of_skin:
        arguments = {"fields": [entry.field for entry in of_skin], "confirmable": False}
        return Inspected(replace(campaign, recordings=()), of_skin, Lacking(Lack.IMPOSSIBLE_DECLARATION, arguments))
    findings, usable = [], []
    for entry in campaign.recordings:
        wrong = [
            Finding(Reason.IMPOSSIBLE_RECORDING, entry.id, name, arguments) for name, arguments in _out_of_bounds(entry)
        ]
        findings += wrong
        usable += [] if wrong else [entry]
    lacking = None if usable else Lacking(Lack.NO_RECORDING)
    return Inspected(replace(campaign, recordings=tuple(usable)), findings, lacking)


def _of_skin(skin: SkinDescription, has_frf: bool) -> list[Finding]:
    """Of the skin's fields; the sensors' size is of use to FRFs alone."""
    findings = [
        Finding(Reason.IMPOSSIBLE_SKIN, "", f"skin.{name}", arguments) for name, arguments in _out_of_bounds(skin)
    ]
    thickness, radius = skin.thickness_mm, skin.sensor_radius_mm
    if has_frf and thickness and radius and radius > _WIDEST_SENSOR * thickness:
        arguments = {"radius_mm": radius, "thicknesses": _WIDEST_SENSOR}
        findings.append(Finding(Reason.IMPOSSIBLE_SENSOR_RADIUS, "", "skin.sensor_radius_mm", arguments))
    return findings


def _out_of_bounds(model: SkinDescription | Recording) -> Iterator[tuple[str, dict[str, float]]]:
    """Each field whose largest magnitude is neither 0 nor within its bounds, with that magnitude and the bounds."""
    for name in (entry.name for entry in fields(model) if entry.name in _BOUNDS):
        value = getattr(model, name)
        if name == "sensors":
            value = [(sensor.x_mm, sensor.y_mm) for sensor in value]
        if value is None or np.size(value) == 0:
            continue
        low, high = _BOUNDS[name]
        size = np.abs(np.asarray(value, dtype=float))
        largest = float(np.nanmax(size)) if np.isfinite(size).any() else 0.0
        if largest and not low <= largest <= high:
            yield name, {"largest": largest, "low": low, "high": high}
