"""Curves that contradict the others, or what rubber can be: copies, units off by 1000.

What is compared is the apparent modulus: of a cylinder (F/A)/(u/height) at the largest force, u from the first sample;
of a sphere 3 (1 − ν²) F/(4 √R u^1.5) at the deepest sample, u from the end of the air. It need not be right, only of
the right magnitude.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from underskin.diagnosis.data.inspected import Inspected
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CompressionRecording, CurveRecording, IndentationRecording
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.curve_course import course
from underskin.units import Floats

_RUBBER_MPA = 0.003, 300.0
_IMPOSSIBLE_MPA = 1e-6, 1e6  # from foam's to diamond's
_DEEPEST = 0.85  # of a cylinder's height: there the true stress is tens of moduli
_FAR = 100.0  # times the declared modulus, or the other curves'


def without_inconsistent(campaign: Campaign, kind: Kind) -> Inspected:
    """The curves of one kind that agree with each other; findings for the others.

    Copies and single curves of other magnitudes are left out. Where all curves contradict what is declared nothing is
    lacking only if `units_checked` confirms it.
    """
    recorded = [
        entry
        for entry in campaign.recordings
        if isinstance(entry, IndentationRecording | CompressionRecording) and entry.kind == kind
    ]
    curves, findings = list(recorded), []
    for step in (_once, _within_range, partial(_like_others, skin=campaign.skin)):
        curves, step_findings = step(curves)
        findings += step_findings
    left = replace(campaign, recordings=tuple(curves))
    shared = _shared(campaign, curves)
    if campaign.units_checked and _possible(campaign, curves):
        shared = []  # whoever checked the units need not be asked
    findings += shared
    if shared:
        return Inspected(replace(left, recordings=()), findings, Lacking(Lack.CURVES_CONTRADICT))
    return Inspected(left, findings, None if curves else Lacking(Lack.NO_CURVE))


def _once(curves: Sequence[CurveRecording]) -> tuple[list[CurveRecording], list[Finding]]:
    """The curves without copies of earlier ones."""
    originals: dict[tuple[bytes, bytes], CurveRecording] = {}
    findings = []
    for entry in curves:
        first = originals.setdefault((entry.displacement_mm.tobytes(), entry.force_n.tobytes()), entry)
        if first is not entry:
            findings.append(Finding(Reason.DUPLICATED_RECORDING, entry.id, "force_n", {"original": first.id}))
    return list(originals.values()), findings


def _within_range(curves: Sequence[CurveRecording]) -> tuple[list[CurveRecording], list[Finding]]:
    """Those not pressed through nearly the whole sample, or ten times as deep as the sphere is wide."""
    usable, findings = [], []
    for entry in curves:
        place = entry.displacement_mm[np.isfinite(entry.displacement_mm)]
        moved = float(place.max() - place[0])
        if isinstance(entry, IndentationRecording):  # a sphere may come a long way through the air
            most = 20 * entry.indenter_radius_mm
            too_deep = Finding(
                Reason.SPHERE_TOO_DEEP, entry.id, "displacement_mm", {"moved_mm": moved, "most_mm": most}
            )
        else:
            most = _DEEPEST * entry.sample_height_mm
            arguments = {"moved_mm": moved, "most_mm": most, "share": _DEEPEST}
            too_deep = Finding(Reason.CURVE_TOO_DEEP, entry.id, "displacement_mm", arguments)
        if moved > most:
            findings.append(too_deep)
        else:
            usable.append(entry)
    return usable, findings


def _like_others(curves: Sequence[CurveRecording], skin: SkinDescription) -> tuple[list[CurveRecording], list[Finding]]:
    """Those whose apparent modulus is of the others' magnitude; of two, the one that is of the declared one's."""
    modulus = np.array([_apparent_mpa(entry, skin.poisson_ratio) for entry in curves])
    if len(curves) < 2 or not np.isfinite(modulus).any():
        return list(curves), []
    usual = float(np.nanmedian(modulus))
    if len(curves) == 2:
        if not np.nanmax(modulus) > _FAR * np.nanmin(modulus):
            return list(curves), []
        near = [own for own in modulus if skin.youngs_modulus_mpa and 1 / _FAR < own / skin.youngs_modulus_mpa < _FAR]
        if len(near) != 1:
            return list(curves), []
        usual = float(near[0])
    deepest = np.array([float(np.nanmax(np.abs(entry.displacement_mm))) for entry in curves])
    usable, findings = [], []
    for entry, own, depth in zip(curves, modulus, deepest, strict=True):
        if not np.isfinite(own) or usual / _FAR < own < usual * _FAR:
            usable.append(entry)
            continue
        moved = depth / float(np.median(deepest))
        field = "force_n" if 1 / _FAR < moved < _FAR else "displacement_mm"
        arguments = {"modulus_mpa": float(own), "ratio": float(own / usual)}
        findings.append(Finding(Reason.MODULUS_BESIDE_OTHERS, entry.id, field, arguments))
    return usable, findings


def _shared(campaign: Campaign, curves: Sequence[CurveRecording]) -> list[Finding]:
    """All curves far from the declared modulus, or from what rubber can be; two far from each other."""
    modulus = np.array([_apparent_mpa(entry, campaign.skin.poisson_ratio) for entry in curves])
    if not np.isfinite(modulus).any():
        return []
    usual, declared = float(np.nanmedian(modulus)), campaign.skin.youngs_modulus_mpa
    low, high = _RUBBER_MPA if declared is None else (declared / _FAR, declared * _FAR)
    if len(curves) == 2 and modulus.max() > _FAR * modulus.min():
        first, second = modulus.tolist()
        return [Finding(Reason.TWO_MODULI, "", "force_n", {"first_mpa": first, "second_mpa": second})]
    if low <= usual <= high:
        return []
    needed: dict[str, float] = {"modulus_mpa": usual, "too_large": usual > high}
    if declared is not None:
        return [Finding(Reason.MODULUS_BESIDE_DECLARED, "", "force_n", {**needed, "declared_mpa": declared})]
    return [Finding(Reason.MODULUS_BESIDE_RUBBER, "", "force_n", {**needed, "low_mpa": low, "high_mpa": high})]


def _possible(campaign: Campaign, curves: Sequence[CurveRecording]) -> bool:
    """Whether all apparent moduli are of a solid's magnitude."""
    modulus = np.array([_apparent_mpa(entry, campaign.skin.poisson_ratio) for entry in curves])
    known = modulus[np.isfinite(modulus)]
    return bool(((known > _IMPOSSIBLE_MPA[0]) & (known < _IMPOSSIBLE_MPA[1])).all())


def _apparent_mpa(entry: CurveRecording, poisson_ratio: float) -> float:
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
