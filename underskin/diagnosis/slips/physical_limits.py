"""Numbers beyond any instrument or skin (`recordings/campaign.py`).

A recording that holds one is left out; where the skin does, nothing can be concluded.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from underskin.diagnosis.data.dataset import Inspected
from underskin.findings.codes import Lack, Lacking, Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording, SkinDescription, excesses

_WIDEST_SENSOR = 100.0  # radii over the thickness; tables end far below


def without_extremes(campaign: Campaign) -> Inspected:
    """The campaign without recordings that hold impossible numbers, each a finding; `lacking` where its skin does."""
    of_skin = _of_skin(campaign.skin, bool(campaign.of(FrfRecording)))
    if of_skin:
        arguments = {"fields": [finding.field for finding in of_skin], "confirmable": False}
        return Inspected(replace(campaign, recordings=()), of_skin, Lacking(Lack.IMPOSSIBLE_DECLARATION, arguments))
    findings, usable = [], []
    for recording in campaign.recordings:
        wrong = [*_excess_findings(recording, Reason.IMPOSSIBLE_RECORDING, recording.id)]
        findings += wrong
        usable += [] if wrong else [recording]
    lacking = None if usable else Lacking(Lack.NO_RECORDING)
    return Inspected(replace(campaign, recordings=tuple(usable)), findings, lacking)


def _of_skin(skin: SkinDescription, has_frf: bool) -> list[Finding]:
    """Findings on the skin's fields; the sensors' size matters for FRFs only."""
    findings = [
        replace(finding, field=f"skin.{finding.field}")
        for finding in _excess_findings(skin, Reason.IMPOSSIBLE_SKIN, "")
    ]
    thickness, radius = skin.thickness_mm, skin.sensor_radius_mm
    if has_frf and thickness and radius and radius > _WIDEST_SENSOR * thickness:
        arguments = {"radius_mm": radius, "thicknesses": _WIDEST_SENSOR}
        findings.append(Finding(Reason.IMPOSSIBLE_SENSOR_RADIUS, "", "skin.sensor_radius_mm", arguments))
    return findings


def _excess_findings(model: Any, reason: Reason, recording: str) -> Iterator[Finding]:
    for excess in excesses(model):
        arguments = {"largest": excess.largest, "low": excess.low, "high": excess.high}
        yield Finding(reason, recording, excess.field, arguments)
