"""Which contacts lie within the tables as declared, and the wrong unit that would explain that none does.

Where the declared modulus is too small, contacts are computed wider and more loaded than they were. Contacts that a
plausible modulus brings within the tables are kept until the fit has found E; until then they are predicted by
continuation of the tables (mechanisms/models/sigma_curves.py).
"""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.laws.modulus_error import LARGEST_FACTOR
from underskin.mechanisms.models.composed import Model, compose
from underskin.physics import hertz
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import to_si

_ENOUGH = 0.5  # of the contacts within the tables: then a wrong unit, or modulus, is worth naming

Mask = NDArray[np.bool_]
Undo = Callable[[Campaign, float], Campaign]


def within_tables(
    campaign: Campaign,
    recordings: list[FrfRecording],
    model: Model,
    table: SigmaTable,
    keep_ids: Collection[str] | None,
) -> tuple[Mask, Mask, list[Finding]]:
    """Which contacts lie within the tables as declared, which others are used, and the findings on the rest.

    `keep_ids` are the recordings whose contacts are known to lie within the tables; None: those that a plausible
    modulus brings there. Where none lies within as declared, that modulus must bring most of them there.
    """
    inside = _inside(model, len(recordings))
    subset = replace(campaign, recordings=tuple(recordings))
    beyond = np.zeros_like(inside) if inside.all() else ~inside & _inside_where_stiffest(subset, table)
    if not inside.any() and beyond.mean() <= _ENOUGH:
        beyond[:] = False
    if_stiffer = beyond.copy()
    if keep_ids is not None:
        beyond &= [recording.id in keep_ids for recording in recordings]
    skin = campaign.skin
    assert skin.thickness_mm is not None
    assert skin.youngs_modulus_mpa is not None
    force = np.array([recording.preload_n for recording in recordings])
    sphere = to_si("indenter_radius_mm", [recording.indenter_radius_mm for recording in recordings])
    modulus = float(to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa))
    radius_mm = 1e3 * hertz.contact_radius(force, sphere, modulus, skin.poisson_ratio)
    if not (inside | beyond).any():
        ratios = radius_mm / skin.thickness_mm
        arguments = {"smallest": float(ratios.min()), "largest": float(ratios.max())}
        none_inside = Finding(Reason.NO_CONTACT_WITHIN_TABLES, "", "skin.thickness_mm", arguments)
        return inside, beyond, [none_inside, *_possible_unit_errors(subset, table)]
    stiffer = {"declared_mpa": skin.youngs_modulus_mpa, "factor": LARGEST_FACTOR}
    exclusions = [
        Finding(Reason.OUT_OF_TABLES_UNLESS_STIFFER, recordings[index].id, "preload_n", stiffer)
        if if_stiffer[index]
        else Finding(
            Reason.OUT_OF_TABLES_DECLARED,
            recordings[index].id,
            "preload_n",
            {"radius_mm": float(radius_mm[index]), "thickness_mm": skin.thickness_mm},
        )
        for index in np.flatnonzero(~(inside | beyond))
    ]
    return inside, beyond, exclusions


def _inside(model: Model, recordings: int) -> Mask:
    inside: Mask = model.valid[np.searchsorted(model.recording, np.arange(recordings))]
    return inside


def _inside_where_stiffest(campaign: Campaign, table: SigmaTable) -> Mask:
    """Which contacts lie within the tables at the largest plausible modulus, where contacts are narrowest."""
    stiffest = _skin_times("youngs_modulus_mpa")(campaign, LARGEST_FACTOR)
    return _inside(compose((), stiffest, table, "frf"), len(campaign.recordings))


def _possible_unit_errors(campaign: Campaign, table: SigmaTable) -> list[Finding]:
    """Findings on single fields that, taken 1000 times smaller or larger, bring most contacts within the tables."""
    findings = []
    for field, times, units in (
        ("preload_n", _recordings_times("preload_n"), ("mN", "kN")),
        ("indenter_radius_mm", _recordings_times("indenter_radius_mm"), ("µm", "m")),
        ("skin.youngs_modulus_mpa", _skin_times("youngs_modulus_mpa"), ("kPa", "GPa")),
        ("skin.thickness_mm", _skin_times("thickness_mm"), ("µm", "m")),
    ):
        for factor, unit in zip((1e-3, 1e3), units, strict=True):
            inside = _inside(compose((), times(campaign, factor), table, "frf"), len(campaign.recordings))
            if inside.mean() > _ENOUGH:
                findings.append(Finding(Reason.WITHIN_TABLES, "", field, {"larger": factor > 1, "given_in": unit}))
    return findings


def _recordings_times(name: str) -> Undo:
    def times(campaign: Campaign, factor: float) -> Campaign:
        changed = (replace(recording, **{name: factor * getattr(recording, name)}) for recording in campaign.recordings)
        return replace(campaign, recordings=tuple(changed))

    return times


def _skin_times(name: str) -> Undo:
    def times(campaign: Campaign, factor: float) -> Campaign:
        return replace(campaign, skin=replace(campaign.skin, **{name: factor * getattr(campaign.skin, name)}))

    return times
