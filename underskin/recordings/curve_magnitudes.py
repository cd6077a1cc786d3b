"""Curves whose force, displacement and size would need a modulus that no elastomer has: slips of units.

What is judged is the apparent modulus: of a cylinder (F/A)/(u/height) at the largest force, u from the first sample;
of a sphere 3 (1 − ν²) F/(4 √R u^1.5) at the deepest sample, u from the end of the air. It need not be right, only of
the right magnitude.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, CompressionRecording, CurveRecording, IndentationRecording
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.curve_course import course
from underskin.units import Floats

FAR = 100.0  # times the declared modulus, or the other curves'
_RUBBER_MPA = 0.003, 300.0
_ELASTOMER_MPA = 0.02, 300.0  # from gels to the hardest polyurethanes
_AS_NEAR = 1.0  # decades: another slip that brings the modulus about as near to that of elastomers
# Of a slip in words: the decades by which the force, and by which the displacement, is put right
_SLIPS = {
    "N for mN": (-3, 0),
    "N for µN": (-6, 0),
    "N for kN": (3, 0),
    "mm for m": (0, 3),
    "mm for µm": (0, -3),
    "mm for nm": (0, -6),
}
_LAW = {"indentation": 1.5, "compression": 1.0}  # powers of the displacement that a force goes with


def implausible(campaign: Campaign) -> list[Finding]:
    """Of each kind of curve that all of them, or two of them, need a modulus that they cannot have; none where
    `units_checked` confirms the units."""
    if campaign.units_checked:
        return []
    kinds: dict[str, list[CurveRecording]] = {}
    for entry in campaign.recordings:
        if isinstance(entry, IndentationRecording | CompressionRecording):
            kinds.setdefault(entry.kind, []).append(entry)
    return [finding for curves in kinds.values() for finding in contradictions(campaign.skin, curves)]


def contradictions(skin: SkinDescription, curves: Sequence[CurveRecording]) -> list[Finding]:
    """All curves of one kind far from the declared modulus, or from what rubber can be; two far from each other."""
    modulus = np.array([apparent_mpa(entry, skin.poisson_ratio) for entry in curves])
    if not np.isfinite(modulus).any():
        return []
    usual, declared = float(np.nanmedian(modulus)), skin.youngs_modulus_mpa
    low, high = _RUBBER_MPA if declared is None else (declared / FAR, declared * FAR)
    if len(curves) == 2 and modulus.max() > FAR * modulus.min():
        first, second = modulus.tolist()
        return [Finding(Reason.TWO_MODULI, "", "force_n", {"first_mpa": first, "second_mpa": second})]
    if low <= usual <= high:
        return []
    needed: dict[str, Any] = {"modulus_mpa": usual, "slips": _slips(usual, declared, _LAW[curves[0].kind])}
    if declared is not None:
        return [Finding(Reason.MODULUS_BESIDE_DECLARED, "", "force_n", {**needed, "declared_mpa": declared})]
    return [Finding(Reason.MODULUS_BESIDE_RUBBER, "", "force_n", {**needed, "low_mpa": low, "high_mpa": high})]


def _slips(modulus_mpa: float, declared_mpa: float | None, power: float) -> tuple[str, ...]:
    """The slips of units that bring a modulus nearest to what is declared, or usual for elastomers."""
    low, high = _ELASTOMER_MPA if declared_mpa is None else (declared_mpa / FAR, declared_mpa * FAR)
    middle = float(np.log10(low * high)) / 2
    decades = {words: np.log10(modulus_mpa) + force - power * travel for words, (force, travel) in _SLIPS.items()}
    off = {
        words: abs(meant - middle) for words, meant in decades.items() if abs(meant - middle) <= np.log10(high) - middle
    }
    return tuple(words for words in sorted(off, key=off.__getitem__) if off[words] <= min(off.values()) + _AS_NEAR)


def apparent_mpa(entry: CurveRecording, poisson_ratio: float) -> float:
    """NaN where the curve does not press."""
    finite = np.isfinite(entry.displacement_mm) & np.isfinite(entry.force_n)
    place: Floats = entry.displacement_mm[finite]
    force: Floats = entry.force_n[finite]
    if len(place) < 2:
        return float("nan")
    if isinstance(entry, IndentationRecording):
        load, moved = _pressed(place, force)
        return float(0.75 * (1 - poisson_ratio**2) * load / (np.sqrt(entry.indenter_radius_mm) * moved**1.5))
    at = int(np.argmax(np.abs(force)))
    load, moved = abs(force[at] - force[0]), abs(place[at] - place[0])
    if not load or not moved:
        return float("nan")
    return float(load / (np.pi / 4 * entry.sample_diameter_mm**2) / (moved / entry.sample_height_mm))


def _pressed(place: Floats, force: Floats) -> tuple[float, float]:
    """The force of a sphere where it is deepest, and the way there from contact; NaN where it is not pressed there: a
    sphere may come a long way through the air, and what sticks pulls harder than it was pressed."""
    seen = course(place, force)
    before = seen.air[seen.air < seen.turn]
    begin = float(place[before[-1]]) if len(before) else float(place[0])
    load, moved = float(force[seen.turn]) - seen.zero, float(place[seen.turn]) - begin
    return (load, moved) if load > 0 and moved > 0 else (float("nan"), 1.0)
