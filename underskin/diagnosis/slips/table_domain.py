"""Which contacts lie within the tables as declared, and the wrong unit that would explain that none does.

Where the declared modulus is too small, contacts are computed wider and more loaded than they were. Contacts that a
plausible modulus brings within the tables are kept until the fit has found E; until then they are predicted by
continuation of the tables (mechanisms/models/sigma_curves.py).
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.laws.modulus_error import LARGEST_FACTOR
from underskin.mechanisms.models.composed import compose
from underskin.physics import hertz
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Mask, to_si

_ENOUGH = 0.5  # of the contacts within the tables: then a wrong unit, or modulus, is worth naming
_UNITS = {  # given instead of the field's own: 1000 times smaller, and larger
    "preload_n": ("mN", "kN"),
    "indenter_radius_mm": ("µm", "m"),
    "skin.youngs_modulus_mpa": ("kPa", "GPa"),
    "skin.thickness_mm": ("µm", "m"),
}


def within_tables(
    campaign: Campaign, recordings: list[FrfRecording], table: SigmaTable, keep_ids: Collection[str] | None
) -> tuple[list[FrfRecording], frozenset[str], list[Finding]]:
    """The recordings whose contacts lie within the tables, the ids of those that do not as declared and are used all
    the same, and the findings on the rest.

    `keep_ids` are the recordings whose contacts are known to lie within the tables; None: those that a plausible
    modulus brings there. Where none lies within as declared, that modulus must bring most of them there.
    """
    subset = replace(campaign, recordings=tuple(recordings))
    inside = _inside(subset, table)
    stiffest = _times(subset, "skin.youngs_modulus_mpa", LARGEST_FACTOR)  # where contacts are narrowest
    if_stiffer = np.zeros_like(inside) if inside.all() else ~inside & _inside(stiffest, table)
    if not inside.any() and if_stiffer.mean() <= _ENOUGH:
        if_stiffer[:] = False
    beyond = if_stiffer & [keep_ids is None or recording.id in keep_ids for recording in recordings]
    usable = inside | beyond
    skin = campaign.skin
    assert skin.thickness_mm is not None
    assert skin.youngs_modulus_mpa is not None
    force = np.array([recording.preload_n for recording in recordings])
    sphere = to_si("indenter_radius_mm", [recording.indenter_radius_mm for recording in recordings])
    modulus = float(to_si("youngs_modulus_mpa", skin.youngs_modulus_mpa))
    radius_mm = 1e3 * hertz.contact_radius(force, sphere, modulus, skin.poisson_ratio)
    if not usable.any():
        ratios = radius_mm / skin.thickness_mm
        arguments = {"smallest": float(ratios.min()), "largest": float(ratios.max())}
        none_inside = Finding(Reason.NO_CONTACT_WITHIN_TABLES, "", "skin.thickness_mm", arguments)
        return [], frozenset(), [none_inside, *_possible_unit_errors(subset, table)]
    findings = []
    for index in np.flatnonzero(~usable).tolist():
        reason = Reason.OUT_OF_TABLES_UNLESS_STIFFER if if_stiffer[index] else Reason.OUT_OF_TABLES_DECLARED
        stiffer = {"declared_mpa": skin.youngs_modulus_mpa, "factor": LARGEST_FACTOR}
        declared = {"radius_mm": float(radius_mm[index]), "thickness_mm": skin.thickness_mm}
        findings.append(Finding(reason, recordings[index].id, "preload_n", stiffer if if_stiffer[index] else declared))
    far = frozenset(recordings[index].id for index in np.flatnonzero(beyond).tolist())
    return [recordings[index] for index in np.flatnonzero(usable).tolist()], far, findings


def _inside(campaign: Campaign, table: SigmaTable) -> Mask:
    """Which contacts lie within the tables (recordings,)."""
    model = compose((), campaign, table, "frf")
    return np.asarray(model.valid[np.searchsorted(model.recording, np.arange(len(campaign.recordings)))])


def _possible_unit_errors(campaign: Campaign, table: SigmaTable) -> list[Finding]:
    """Findings on single fields that, taken 1000 times smaller or larger, bring most contacts within the tables."""
    findings = []
    for field, units in _UNITS.items():
        for factor, unit in zip((1e-3, 1e3), units, strict=True):
            if _inside(_times(campaign, field, factor), table).mean() > _ENOUGH:
                findings.append(Finding(Reason.WITHIN_TABLES, "", field, {"larger": factor > 1, "given_in": unit}))
    return findings


def _times(campaign: Campaign, field: str, factor: float) -> Campaign:
    """The campaign with a field of its skin, or of all its recordings, times a factor."""
    if field.startswith("skin."):
        name = field.removeprefix("skin.")
        return replace(campaign, skin=replace(campaign.skin, **{name: factor * getattr(campaign.skin, name)}))
    changed = (replace(recording, **{field: factor * getattr(recording, field)}) for recording in campaign.recordings)
    return replace(campaign, recordings=tuple(changed))
