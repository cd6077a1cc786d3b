"""Which contacts the tables hold as they are declared, and which slip of units would explain that none of them does."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underskin.mechanisms.models.composed import Model, compose
from underskin.physics import hertz
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.finding import Finding
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import to_si

_ENOUGH = 0.5  # of the contacts within the tables: then a slip is worth naming

Mask = NDArray[np.bool_]
Undo = Callable[[Campaign, float], Campaign]


def in_reach(
    campaign: Campaign, entries: list[FrfRecording], model: Model, table: SigmaTable, found: list[Finding]
) -> Mask:
    """Which contacts the tables hold as declared; the others are named with what is wrong with them."""
    inside = _inside(model, len(entries))
    skin = campaign.skin
    assert skin.thickness_mm is not None
    assert skin.youngs_modulus_mpa is not None
    force = np.array([entry.preload_n for entry in entries])
    sphere = to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in entries])
    modulus = float(to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa))
    radius_mm = 1e3 * hertz.contact_radius(force, sphere, modulus, skin.poisson_ratio)
    if not inside.any():
        ratios = radius_mm / skin.thickness_mm
        text = (
            f"no contact lies within the tables: contact radii would be {ratios.min():.3g} to {ratios.max():.3g} of "
            "the thickness, or the places lie far from their sensors; are preload, sphere, thickness, modulus and "
            "places right?"
        )
        found.append(Finding("impossible_geometry", "", "skin.thickness_mm", text))
        found += _slips(replace(campaign, recordings=tuple(entries)), table)
        return inside
    for number in np.flatnonzero(~inside):
        entry = entries[number]
        text = (
            f"its contact (radius {radius_mm[number]:.3g} mm on a layer of {skin.thickness_mm:g} mm, at its place "
            "beside the sensor) lies beyond the tables: left out"
        )
        found.append(Finding("out_of_domain", entry.id, "preload_n", text))
    return inside


def _inside(model: Model, recordings: int) -> Mask:
    inside: Mask = model.valid[np.searchsorted(model.recording, np.arange(recordings))]
    return inside


def _slips(campaign: Campaign, table: SigmaTable) -> list[Finding]:
    """Each single field that, taken 1000 times smaller or larger, brings most contacts within the tables."""
    found = []
    for field, times, units in (
        ("preload_n", _recordings_times("preload_n"), ("mN", "kN")),
        ("indenter_radius_mm", _recordings_times("indenter_radius_mm"), ("µm", "m")),
        ("skin.youngs_modulus_mpa", _skin_times("youngs_modulus_mpa"), ("kPa", "GPa")),
        ("skin.thickness_mm", _skin_times("thickness_mm"), ("µm", "m")),
    ):
        for factor, word, unit in zip((1e-3, 1e3), ("smaller", "larger"), units, strict=True):
            inside = _inside(compose((), times(campaign, factor), table, "frf"), len(campaign.recordings))
            if inside.mean() > _ENOUGH:
                text = f"were it 1000 × {word}, contacts would lie within the tables: was it given in {unit}?"
                found.append(Finding("units_off_by_1000", "", field, text))
    return found


def _recordings_times(name: str) -> Undo:
    def times(campaign: Campaign, factor: float) -> Campaign:
        changed = (replace(entry, **{name: factor * getattr(entry, name)}) for entry in campaign.recordings)
        return replace(campaign, recordings=tuple(changed))

    return times


def _skin_times(name: str) -> Undo:
    def times(campaign: Campaign, factor: float) -> Campaign:
        return replace(campaign, skin=replace(campaign.skin, **{name: factor * getattr(campaign.skin, name)}))

    return times
