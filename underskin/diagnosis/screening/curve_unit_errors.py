"""Curves that contradict the others, or what rubber can be: copies, units off by 1000.

What is compared is the apparent modulus (recordings/curve_course.py).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from underskin.diagnosis.data.dataset import Inspected
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.lacking import Lack, Lacking
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    CurveRecording,
    IndentationRecording,
    SkinDescription,
)
from underskin.recordings.curve_course import FAR, apparent_mpa, contradictions

_IMPOSSIBLE_MPA = 1e-6, 1e6  # from foam's to diamond's
_DEEPEST = 0.85  # of a cylinder's height: there the true stress is tens of moduli


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
    shared = contradictions(campaign.skin, curves)
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
    modulus = np.array([apparent_mpa(entry, skin.poisson_ratio) for entry in curves])
    if len(curves) < 2 or not np.isfinite(modulus).any():
        return list(curves), []
    usual = float(np.nanmedian(modulus))
    if len(curves) == 2:
        if not np.nanmax(modulus) > FAR * np.nanmin(modulus):
            return list(curves), []
        near = [own for own in modulus if skin.youngs_modulus_mpa and 1 / FAR < own / skin.youngs_modulus_mpa < FAR]
        if len(near) != 1:
            return list(curves), []
        usual = float(near[0])
    deepest = np.array([float(np.nanmax(np.abs(entry.displacement_mm))) for entry in curves])
    usable, findings = [], []
    for entry, own, depth in zip(curves, modulus, deepest, strict=True):
        if not np.isfinite(own) or usual / FAR < own < usual * FAR:
            usable.append(entry)
            continue
        moved = depth / float(np.median(deepest))
        field = "force_n" if 1 / FAR < moved < FAR else "displacement_mm"
        arguments = {"modulus_mpa": float(own), "ratio": float(own / usual)}
        findings.append(Finding(Reason.MODULUS_BESIDE_OTHERS, entry.id, field, arguments))
    return usable, findings


def _possible(campaign: Campaign, curves: Sequence[CurveRecording]) -> bool:
    """Whether all apparent moduli are of a solid's magnitude."""
    modulus = np.array([apparent_mpa(entry, campaign.skin.poisson_ratio) for entry in curves])
    known = modulus[np.isfinite(modulus)]
    return bool(((known > _IMPOSSIBLE_MPA[0]) & (known < _IMPOSSIBLE_MPA[1])).all())
