"""Curves that nothing can be fitted to are named, and left out of a diagnosis; so are those that no law of a sphere can
describe.
"""

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
    """The campaign without the curves of one kind that have too few samples, do not load, or are beyond a sphere's law;
    and a finding on each, and on those under a tip that looks like a cone."""
    thinned = {entry.id: entry for entry in curve_lines(campaign, kind).campaign.recordings}
    findings, usable = [], []
    for entry in campaign.recordings:
        lacking, doubt = None, None
        if entry.kind == kind:
            lacking = _exchanged(entry) or _lacking(thinned.get(entry.id), campaign.skin)
        if lacking is None and isinstance(entry, IndentationRecording) and entry.kind == kind:
            lacking, doubt = _of_other_tip(entry, campaign.skin)
        if lacking is None:
            usable.append(entry)
        else:
            findings.append(Finding(Reason.CURVE_NOT_USABLE, entry.id, lacking.field, {"refusal": lacking}))
        if doubt is not None:
            findings.append(Finding(Reason.TIP_SHAPE, entry.id, doubt.field, {"refusal": doubt}))
    return replace(campaign, recordings=tuple(usable)), findings


def _exchanged(entry: object) -> InvalidInput | None:
    """The refusal of a curve whose columns look exchanged, which its raw samples tell."""
    try:
        if isinstance(entry, IndentationRecording | CompressionRecording):
            reject_exchanged_columns(entry)
    except InvalidInput as refusal:
        return refusal
    return None


def _lacking(entry: object, skin: SkinDescription) -> InvalidInput | None:
    """Why nothing can be concluded from a curve, thinned."""
    if isinstance(entry, IndentationRecording | CompressionRecording) and not np.ptp(entry.displacement_mm):
        return unusable("displacement_mm", float(entry.displacement_mm[0]), "must change")
    try:
        if isinstance(entry, IndentationRecording):
            found = estimate(*_columns(entry), skin.poisson_ratio, _thickness(skin))
            modulus = found.modulus
            if modulus > 0:
                require_depth(found)
        elif isinstance(entry, CompressionRecording):
            modulus = of_compression(entry).modulus
        else:
            return too_few("force_n", "too few finite samples", "must have at least 5")
    except InvalidInput as refusal:
        return refusal
    return None if modulus > 0 else unusable("force_n", "does not rise as it is pressed", "must rise")


def _of_other_tip(
    entry: IndentationRecording, skin: SkinDescription
) -> tuple[InvalidInput | None, InvalidInput | None]:
    """Why nothing can be concluded from a curve, with every sample, that another tip than a sphere explains to its
    noise; and why the tip may be another."""
    try:
        tip = tip_of(*_columns(entry), skin.poisson_ratio, _thickness(skin))
    except InvalidInput:  # of a way of too few samples, which its means do not have
        return None, None
    if tip is None or not tip.is_plain:
        return None, None
    return (tip.refusal, None) if tip.is_blunt else (None, tip.refusal)


def _columns(entry: IndentationRecording) -> tuple[Floats, Floats, float]:
    """Displacement [m], force [N] and radius [m]."""
    radius = float(to_si("indenter_radius_mm", entry.indenter_radius_mm))
    return to_si("displacement_mm", entry.displacement_mm), to_si("force_n", entry.force_n), radius


def _thickness(skin: SkinDescription) -> float | None:
    return None if skin.thickness_mm is None else float(to_si("thickness_mm", skin.thickness_mm))
