"""Curves that contradict the others, or any rubber: copies, units off by 1000, excessive depth.

The quantity compared is the apparent modulus (recordings/curve_course.py).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Inspected
from underskin.diagnosis.slips.unusable_curves import without_unusable
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CurveRecording, IndentationRecording
from underskin.recordings.curve_course import FAR, apparent_mpa, contradictions

_IMPOSSIBLE_MPA = 1e-6, 1e6  # below foam's and above diamond's
_DEEPEST = 0.85  # of a cylinder's height, where the true stress is tens of moduli


def without_inconsistent(campaign: Campaign, kind: Kind) -> Inspected:
    """The usable curves of one kind that agree with each other, and findings on the others.

    Copies and single curves of another magnitude are left out. Where all curves contradict what is declared, none is
    used unless `units_checked` confirms it.
    """
    curves = [curve for curve in campaign.curves if curve.kind == kind]
    curves, findings = without_unusable(curves, campaign, kind)
    for step in (_without_copies, _within_range, _like_others):
        curves, step_findings = step(curves, campaign)
        findings += step_findings
    remaining = replace(campaign, recordings=tuple(curves))
    shared = contradictions(campaign.skin, curves)
    if campaign.units_checked and _possible(campaign, curves):
        shared = []  # the units have been confirmed
    findings += shared
    if shared:
        return Inspected(replace(remaining, recordings=()), findings, Lacking(Lack.CURVES_CONTRADICT))
    return Inspected(remaining, findings, None if curves else Lacking(Lack.NO_CURVE))


def _without_copies(curves: Sequence[CurveRecording], _: Campaign) -> tuple[list[CurveRecording], list[Finding]]:
    """The curves without copies of earlier ones."""
    originals: dict[tuple[bytes, bytes], CurveRecording] = {}
    findings = []
    for curve in curves:
        first = originals.setdefault((curve.displacement_mm.tobytes(), curve.force_n.tobytes()), curve)
        if first is not curve:
            findings.append(Finding(Reason.DUPLICATED_RECORDING, curve.id, "force_n", {"original": first.id}))
    return list(originals.values()), findings


def _within_range(curves: Sequence[CurveRecording], _: Campaign) -> tuple[list[CurveRecording], list[Finding]]:
    """The curves without those pressed through nearly the whole sample, or ten sphere diameters deep."""
    usable, findings = [], []
    for curve in curves:
        displacement_mm = curve.displacement_mm[np.isfinite(curve.displacement_mm)]
        moved = float(displacement_mm.max() - displacement_mm[0])
        if isinstance(curve, IndentationRecording):  # a sphere may come a long way through the air
            reason, most = Reason.SPHERE_TOO_DEEP, 20 * curve.indenter_radius_mm
        else:
            reason, most = Reason.CURVE_TOO_DEEP, _DEEPEST * curve.sample_height_mm
        if moved > most:
            arguments = {"moved_mm": moved, "most_mm": most, "share": _DEEPEST}
            findings.append(Finding(reason, curve.id, "displacement_mm", arguments))
        else:
            usable.append(curve)
    return usable, findings


def _like_others(curves: Sequence[CurveRecording], campaign: Campaign) -> tuple[list[CurveRecording], list[Finding]]:
    """The curves whose apparent modulus is of the others' magnitude; of two, the one nearer to the declared modulus."""
    skin = campaign.skin
    modulus = np.array([apparent_mpa(curve, skin.poisson_ratio) for curve in curves])
    if len(curves) < 2 or not np.isfinite(modulus).any():
        return list(curves), []
    usual = float(np.nanmedian(modulus))
    if len(curves) == 2:
        if not np.nanmax(modulus) > FAR * np.nanmin(modulus):
            return list(curves), []
        near = [
            value for value in modulus if skin.youngs_modulus_mpa and 1 / FAR < value / skin.youngs_modulus_mpa < FAR
        ]
        if len(near) != 1:
            return list(curves), []
        usual = float(near[0])
    deepest = np.array([float(np.nanmax(np.abs(curve.displacement_mm))) for curve in curves])
    usable, findings = [], []
    for curve, value, depth in zip(curves, modulus, deepest, strict=True):
        if not np.isfinite(value) or usual / FAR < value < usual * FAR:
            usable.append(curve)
            continue
        moved = depth / float(np.median(deepest))
        field = "force_n" if 1 / FAR < moved < FAR else "displacement_mm"
        arguments = {"modulus_mpa": float(value), "ratio": float(value / usual)}
        findings.append(Finding(Reason.MODULUS_BESIDE_OTHERS, curve.id, field, arguments))
    return usable, findings


def _possible(campaign: Campaign, curves: Sequence[CurveRecording]) -> bool:
    """Whether all apparent moduli are of the magnitude of a solid's."""
    modulus = np.array([apparent_mpa(curve, campaign.skin.poisson_ratio) for curve in curves])
    finite = modulus[np.isfinite(modulus)]
    return bool(((finite > _IMPOSSIBLE_MPA[0]) & (finite < _IMPOSSIBLE_MPA[1])).all())
