"""Curves that contradict the others, or what rubber can be: copies, reversed forces, units off by 1000.

What is compared is the apparent modulus at the largest displacement u from the first sample: of a cylinder
(F/A)/(u/height), of a sphere 3 (1 − ν²) F/(4 √R u^1.5). It need not be right, only of the right magnitude.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.inspected import Inspected
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.finding import Finding
from underskin.units import Floats

_SOFTEST_MPA, _HARDEST_MPA = 0.003, 300.0
_IMPOSSIBLE_MPA = 1e-6, 1e6  # from foam's to diamond's
_DEEPEST = 0.85  # of a cylinder's height: there the true stress is tens of moduli
_FAR = 100.0  # times the declared modulus, or the other curves'
_REVERSED = -0.5  # correlation of force and displacement

Curve = IndentationRecording | CompressionRecording


def without_slips(campaign: Campaign, kind: Kind) -> Inspected:
    """Reversed forces put right; copies and slips of single curves left out; slips of all named."""
    found: list[Finding] = []
    curves = [
        _upright(entry, found)
        for entry in campaign.recordings
        if isinstance(entry, IndentationRecording | CompressionRecording) and entry.kind == kind
    ]
    curves = _within_reach(_once(curves, found), found)
    curves = _with_others(curves, campaign.skin, found)
    left = replace(campaign, recordings=tuple(curves))
    shared = _shared(campaign, curves)
    found += shared
    if shared and (not campaign.units_checked or not _possible(campaign, curves)):
        return Inspected(
            replace(left, recordings=()),
            found,
            "force, displacement and modulus cannot all be right as declared (see findings); if they are meant, say "
            "units_checked",
        )
    return Inspected(left, found, "" if curves else "no curve can be used (see findings)")


def is_reversed(entry: Curve) -> bool:
    """Whether the force falls as it is pressed."""
    finite = np.isfinite(entry.displacement_mm) & np.isfinite(entry.force_n)
    place, force = entry.displacement_mm[finite], entry.force_n[finite]
    if len(place) < 2 or not np.ptp(place) or not np.ptp(force):
        return False
    return float(np.corrcoef(place, force)[0, 1]) <= _REVERSED


def _upright(entry: Curve, found: list[Finding]) -> Curve:
    if not is_reversed(entry):
        return entry
    text = "its force falls as it is pressed, where compression counts positive: reversed"
    found.append(Finding("sign_flipped", entry.id, "force_n", text))
    return replace(entry, force_n=-entry.force_n)


def _once(curves: Sequence[Curve], found: list[Finding]) -> list[Curve]:
    kept: dict[tuple[bytes, bytes], Curve] = {}
    for entry in curves:
        first = kept.setdefault((entry.displacement_mm.tobytes(), entry.force_n.tobytes()), entry)
        if first is not entry:
            text = f"the same numbers as recording {first.id!r}: left out"
            found.append(Finding("duplicated_recording", entry.id, "force_n", text))
    return list(kept.values())


def _within_reach(curves: Sequence[Curve], found: list[Finding]) -> list[Curve]:
    """Those not pressed through nearly the whole sample, or ten times as deep as the sphere is wide."""
    kept = []
    for entry in curves:
        place = entry.displacement_mm[np.isfinite(entry.displacement_mm)]
        most, what = (  # a sphere may come a long way through the air
            (20 * entry.indenter_radius_mm, "ten times the sphere's width")
            if isinstance(entry, IndentationRecording)
            else (_DEEPEST * entry.sample_height_mm, f"{_DEEPEST:g} of its sample's height")
        )
        if place.max() - place[0] > most:
            text = f"pressed {place.max() - place[0]:.3g} mm, more than {what} ({most:.3g} mm): given in µm? Left out"
            found.append(Finding("units_off_by_1000", entry.id, "displacement_mm", text))
        else:
            kept.append(entry)
    return kept


def _with_others(curves: Sequence[Curve], skin: SkinDescription, found: list[Finding]) -> list[Curve]:
    """Those whose apparent modulus is of the others' magnitude; of two, the one that is of the declared one's."""
    modulus = np.array([_apparent_mpa(entry, skin.poisson_ratio) for entry in curves])
    if len(curves) < 2 or not np.isfinite(modulus).any():
        return list(curves)
    usual = float(np.nanmedian(modulus))
    if len(curves) == 2:
        if not np.nanmax(modulus) > _FAR * np.nanmin(modulus):
            return list(curves)
        near = [own for own in modulus if skin.youngs_modulus_mpa and 1 / _FAR < own / skin.youngs_modulus_mpa < _FAR]
        if len(near) != 1:
            return list(curves)
        usual = float(near[0])
    reach = np.array([float(np.nanmax(np.abs(entry.displacement_mm))) for entry in curves])
    kept = []
    for entry, own, farthest in zip(curves, modulus, reach, strict=True):
        if not np.isfinite(own) or usual / _FAR < own < usual * _FAR:
            kept.append(entry)
            continue
        moved = farthest / float(np.median(reach))
        field = "force_n" if 1 / _FAR < moved < _FAR else "displacement_mm"
        text = (
            f"its apparent modulus of {own:.3g} MPa is {own / usual:.2g} times the others': a slip of units? Left out"
        )
        found.append(Finding("units_off_by_1000", entry.id, field, text))
    return kept


def _shared(campaign: Campaign, curves: Sequence[Curve]) -> list[Finding]:
    """All curves far from the declared modulus, or from what rubber can be; two far from each other."""
    modulus = np.array([_apparent_mpa(entry, campaign.skin.poisson_ratio) for entry in curves])
    if not np.isfinite(modulus).any():
        return []
    usual, declared = float(np.nanmedian(modulus)), campaign.skin.youngs_modulus_mpa
    low, high = (_SOFTEST_MPA, _HARDEST_MPA) if declared is None else (declared / _FAR, declared * _FAR)
    if len(curves) == 2 and modulus.max() > _FAR * modulus.min():
        text = (
            f"the two curves' apparent moduli of {modulus[0]:.2g} and {modulus[1]:.2g} MPa contradict each other: is "
            "force or displacement of one of them off by 1000?"
        )
        return [Finding("units_off_by_1000", "", "force_n", text)]
    if low <= usual <= high:
        return []
    against = "rubber has 0.003 to 300 MPa" if declared is None else f"{declared:g} MPa is declared"
    guess = "N for mN, or mm for m" if usual > high else "mN for N, or m for mm"
    text = (
        f"force and displacement would need a modulus of about {usual:.2g} MPa, where {against}: off by 1000 ({guess})?"
    )
    return [Finding("units_off_by_1000", "", "force_n", text)]


def _possible(campaign: Campaign, curves: Sequence[Curve]) -> bool:
    """Whether all apparent moduli are of a solid's magnitude."""
    modulus = np.array([_apparent_mpa(entry, campaign.skin.poisson_ratio) for entry in curves])
    known = modulus[np.isfinite(modulus)]
    return bool(((known > _IMPOSSIBLE_MPA[0]) & (known < _IMPOSSIBLE_MPA[1])).all())


def _apparent_mpa(entry: Curve, poisson_ratio: float) -> float:
    """NaN where the curve does not press."""
    finite = np.isfinite(entry.displacement_mm) & np.isfinite(entry.force_n)
    place: Floats = entry.displacement_mm[finite]
    force: Floats = entry.force_n[finite]
    if len(place) < 2:
        return float("nan")
    at = int(np.argmax(np.abs(force)))
    load, moved = abs(force[at] - force[0]), abs(place[at] - place[0])
    if not load or not moved:
        return float("nan")
    if isinstance(entry, CompressionRecording):
        return float(load / (np.pi / 4 * entry.sample_diameter_mm**2) / (moved / entry.sample_height_mm))
    return float(0.75 * (1 - poisson_ratio**2) * load / (np.sqrt(entry.indenter_radius_mm) * moved**1.5))
