"""Curves that nothing can be fitted to, or that no law of a sphere describes: findings, left out of a diagnosis."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import curve_lines
from underskin.errors import InvalidInput, too_few, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording, SkinDescription
from underskin.recordings.curve_preparation import reject_exchanged_columns
from underskin.recordings.modulus import estimate, of_compression, require_depth, tip_of
from underskin.units import Floats, to_si


def without_unusable(campaign: Campaign, kind: Kind) -> tuple[Campaign, list[Finding]]:
    """The campaign without the curves of one kind that have too few samples, do not load, or are beyond a sphere's law.

    Each of these is a finding, and so are curves under a tip that looks like a cone.
    """
    thinned = {recording.id: recording for recording in curve_lines(campaign, kind).campaign.recordings}
    findings, usable = [], []
    for recording in campaign.recordings:
        lacking, doubt = None, None
        if recording.kind == kind:
            lacking = _exchanged(recording) or _lacking(thinned.get(recording.id), campaign.skin)
        if lacking is None and isinstance(recording, IndentationRecording) and recording.kind == kind:
            lacking, doubt = _of_other_tip(recording, campaign.skin)
        if lacking is None:
            usable.append(recording)
        else:
            findings.append(Finding(Reason.CURVE_NOT_USABLE, recording.id, lacking.field, {"refusal": lacking}))
        if doubt is not None:
            findings.append(Finding(Reason.TIP_SHAPE, recording.id, doubt.field, {"refusal": doubt}))
    return replace(campaign, recordings=tuple(usable)), findings


def _exchanged(recording: object) -> InvalidInput | None:
    """The refusal of a curve whose columns look exchanged, from its raw samples."""
    try:
        if isinstance(recording, IndentationRecording | CompressionRecording):
            reject_exchanged_columns(recording)
    except InvalidInput as refusal:
        return refusal
    return None


def _lacking(recording: object, skin: SkinDescription) -> InvalidInput | None:
    """Why nothing can be concluded from a thinned curve; None if it is usable."""
    if isinstance(recording, IndentationRecording | CompressionRecording) and not np.ptp(recording.displacement_mm):
        return unusable("displacement_mm", float(recording.displacement_mm[0]), "must change")
    try:
        if isinstance(recording, IndentationRecording):
            modulus_estimate = estimate(*_columns(recording), skin.poisson_ratio, _thickness(skin))
            modulus = modulus_estimate.modulus
            if modulus > 0:
                require_depth(modulus_estimate)
        elif isinstance(recording, CompressionRecording):
            modulus = of_compression(recording).modulus
        else:
            return too_few("force_n", "too few finite samples", "must have at least 5")
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
