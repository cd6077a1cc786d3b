"""Curves that nothing can be fitted to, or that no law of a sphere describes: findings, left out of a diagnosis."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import curve_lines
from underskin.errors import InvalidInput, too_few, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind
from underskin.recordings.block_modulus import of_compression
from underskin.recordings.campaign import Campaign, CurveRecording, IndentationRecording, SkinDescription
from underskin.recordings.curve_preparation import reject_exchanged_columns
from underskin.recordings.modulus import estimate, require_depth, tip_of
from underskin.units import Floats, to_si


def without_unusable(
    curves: Sequence[CurveRecording], campaign: Campaign, kind: Kind
) -> tuple[list[CurveRecording], list[Finding]]:
    """The curves of one kind that have enough samples, load, and are within a sphere's law.

    Each of the others is a finding, and so are curves under a tip that looks like a cone.
    """
    lines = curve_lines(replace(campaign, recordings=tuple(curves)), kind)
    thinned = {curve.id: curve for curve in lines.campaign.curves}
    findings, usable = [], []
    for curve in curves:
        lacking, doubt = _lacking(curve, thinned.get(curve.id), campaign.skin), None
        if lacking is None and isinstance(curve, IndentationRecording):
            lacking, doubt = _of_other_tip(curve, campaign.skin)
        if lacking is None:
            usable.append(curve)
        else:
            findings.append(Finding(Reason.CURVE_NOT_USABLE, curve.id, lacking.field, {"refusal": lacking}))
        if doubt is not None:
            findings.append(Finding(Reason.TIP_SHAPE, curve.id, doubt.field, {"refusal": doubt}))
    return usable, findings


def _lacking(curve: CurveRecording, thinned: CurveRecording | None, skin: SkinDescription) -> InvalidInput | None:
    """Why nothing can be concluded from a curve, whose columns look exchanged, or from its thinned samples."""
    try:
        reject_exchanged_columns(curve)
        if thinned is None:
            return too_few("force_n", "too few finite samples", "must have at least 5")
        if not np.ptp(thinned.displacement_mm):
            return unusable("displacement_mm", float(thinned.displacement_mm[0]), "must change")
        if isinstance(thinned, IndentationRecording):
            of_sphere = estimate(*_columns(thinned), skin.poisson_ratio, _thickness(skin))
            modulus = of_sphere.modulus
            if modulus > 0:
                require_depth(of_sphere)
        else:
            modulus = of_compression(thinned).modulus
    except InvalidInput as refusal:
        return refusal
    return None if modulus > 0 else unusable("force_n", "does not rise as it is pressed", "must rise")


def _of_other_tip(
    recording: IndentationRecording, skin: SkinDescription
) -> tuple[InvalidInput | None, InvalidInput | None]:
    """The refusal of a curve (every sample) that a tip other than a sphere explains to its noise, and the doubt where
    the tip may be another."""
    try:
        tip = tip_of(*_columns(recording), skin.poisson_ratio, _thickness(skin))
    except InvalidInput:  # loading or unloading has too few samples, unlike the thinned curve
        return None, None
    if tip is None or not tip.is_plain:
        return None, None
    return (tip.refusal, None) if tip.is_blunt else (None, tip.refusal)


def _columns(recording: IndentationRecording) -> tuple[Floats, Floats, float]:
    """Displacement [m], force [N] and radius [m]."""
    radius = float(to_si("indenter_radius_mm", recording.indenter_radius_mm))
    return to_si("displacement_mm", recording.displacement_mm), to_si("force_n", recording.force_n), radius


def _thickness(skin: SkinDescription) -> float | None:
    return None if skin.thickness_mm is None else float(to_si("thickness_mm", skin.thickness_mm))
