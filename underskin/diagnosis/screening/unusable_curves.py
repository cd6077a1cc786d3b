"""Curves that nothing can be fitted to are named, and left out of a diagnosis."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.screening.curve_unit_errors import is_reversed
from underskin.errors import InvalidInput, too_few, unusable
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.base import Kind
from underskin.recordings import elastomer
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording


def without_unusable(campaign: Campaign, kind: Kind) -> tuple[Campaign, list[Finding]]:
    """The campaign without the curves of one kind that have too few samples or do not load, and a finding on each."""
    thinned = {entry.id: entry for entry in curve_lines(campaign, kind).campaign.recordings}
    findings, usable = [], []
    for entry in campaign.recordings:
        lacking = None
        if entry.kind == kind:
            lacking = _exchanged(entry) or _lacking(thinned.get(entry.id), campaign.skin.poisson_ratio)
        if lacking is None:
            usable.append(entry)
        else:
            findings.append(Finding(Reason.CURVE_NOT_USABLE, entry.id, lacking.field, {"refusal": lacking}))
    return replace(campaign, recordings=tuple(usable)), findings


def _exchanged(entry: object) -> InvalidInput | None:
    """The refusal of a curve whose columns look exchanged, which its raw samples tell."""
    try:
        if isinstance(entry, IndentationRecording | CompressionRecording):
            elastomer.require_own_columns(entry)
    except InvalidInput as refusal:
        return refusal
    return None


def _lacking(entry: object, poisson_ratio: float) -> InvalidInput | None:
    if isinstance(entry, IndentationRecording | CompressionRecording) and not np.ptp(entry.displacement_mm):
        return unusable("displacement_mm", float(entry.displacement_mm[0]), "must change")
    try:
        if isinstance(entry, IndentationRecording):
            modulus = elastomer.of_indentation(entry, poisson_ratio).modulus
        elif isinstance(entry, CompressionRecording):
            modulus = elastomer.of_compression(entry).modulus
        else:
            return too_few("force_n", "too few finite samples", "must have at least 5")
    except InvalidInput as refusal:
        return refusal
    if modulus > 0 or is_reversed(entry):
        return None
    return unusable("force_n", "does not rise as it is pressed", "must rise")
