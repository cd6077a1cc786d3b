"""Campaigns of one skin diagnosed together: which mechanisms act in all of them, and which from some date on.

Each campaign with FRFs is first diagnosed alone, which gives its noise, findings and candidate sets of mechanisms; then
one set per campaign is chosen for all together (course.py). Curves of campaigns without FRFs are of the same material
and count once, with the first campaign of FRFs that has a result. Changes of the sensors' d33 between campaigns are
corrected for the mechanisms (sensors.py).
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.report import reported
from underskin.diagnosis.several.course import Shared, values
from underskin.diagnosis.several.sensors import (
    CampaignDates,
    SensorsOfCampaign,
    Values,
    corrected,
    d33_changes,
    date_of,
    in_order,
    sensors_of,
)
from underskin.diagnosis.several.together_report import together_report, used_recordings
from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.recordings.campaign import Campaign, CurveRecording, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable


def diagnose_together(
    campaigns: Sequence[Campaign],
    table: SigmaTable,
    name: str,
    without: Collection[str] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, Any]:
    """The report (`report/1`) of campaigns of one skin, named `name`.

    Parameters
    ----------
    campaigns
        Two at least, one of them with FRFs; those with FRFs are sorted by the time of their first recordings where all
        have one.
    table
        σ.
    name
        Their name in the report.
    without
        Mechanisms to leave out of the catalogue.
    progress
        Called with the share that is done.

    Returns
    -------
    dict
        Plain JSON values.

    Raises
    ------
    InvalidInput
        Fewer than two campaigns, none with FRFs, skins that are declared differently, or FRFs that are in two
        campaigns.
    """
    with_frf, of_curves = by_frfs(curves_once(campaigns, set()))
    _check(with_frf, of_curves)
    refuse_copies(with_frf)
    ordered = in_order(with_frf)
    document = _report(ordered, of_curves, table, name, without, progress)
    return {**document, "campaign": name, "campaigns": [campaign.name for campaign in (*ordered, *of_curves)]}


def _report(
    with_frf: Sequence[Campaign],
    of_curves: Sequence[Campaign],
    table: SigmaTable,
    name: str,
    without: Collection[str],
    progress: Callable[[float], None],
) -> dict[str, Any]:
    """The report on campaigns with FRFs in their order, with the curves of others; of a single usable one its own."""
    ordered, results = list[Campaign](), list[DiagnosisResult]()
    for index, campaign in enumerate(with_frf):
        counted = any(result.search is not None for result in results)
        ordered.append(campaign if counted else with_curves(campaign, of_curves))
        results.append(diagnose(ordered[-1], table, without=without))
        progress((index + 1) / (len(with_frf) + 1))
    outliers = [_outlying_sensors(result) for result in results]
    results = _with_changed_sensors(ordered, results, outliers, table, without)
    reports = [reported(result) for result in results]
    usable = [index for index, result in enumerate(results) if result.search is not None]
    if len(usable) < 2:
        lacking = (report.document for index, report in enumerate(reports) if index not in usable)
        return next(lacking, reports[0].document)
    dated = CampaignDates([ordered[index].name for index in usable], [date_of(ordered[index]) for index in usable])
    return together_report(name, ordered, results, reports, usable, dated, outliers, table)


def _with_changed_sensors(
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    outliers: Sequence[frozenset[str]],
    table: SigmaTable,
    without: Collection[str],
) -> list[DiagnosisResult]:
    """The results, diagnosed again where single sensors changed since the previous campaign, which is no physics of the
    skin."""
    sensors = [_sensors(campaign, result, table) for campaign, result in zip(campaigns, results, strict=True)]
    single = d33_changes(sensors, outliers, [0.0] * len(sensors), np.arange(len(sensors), dtype=float))
    again = []
    for index, (campaign, result) in enumerate(zip(campaigns, results, strict=True)):
        as_before = corrected(campaign, single, index)
        again.append(result if as_before is campaign else diagnose(as_before, table, without=without))
    return again


def _outlying_sensors(result: DiagnosisResult) -> frozenset[str]:
    reasons = (Reason.SENSOR_WEAKER, Reason.SENSOR_STRONGER)
    return frozenset(str(finding.arguments["sensor"]) for finding in result.findings if finding.reason in reasons)


def _sensors(campaign: Campaign, result: DiagnosisResult, table: SigmaTable) -> SensorsOfCampaign | None:
    """The sensors of a campaign under its own answer, or without any mechanism."""
    leader = None if result.search is None else result.search.answers[0].explanation
    strengths: Values = {} if leader is None else {name: _strengths_of(leader, name) for name in leader.names}
    return sensors_of(campaign, strengths, table, used_recordings(result))


def _strengths_of(explanation: Explanation, name: str) -> dict[str, float]:
    shared = Shared.of(explanation, [name], skin=False)
    return values(shared.parameters, shared.mean)


def by_frfs(campaigns: Sequence[Campaign]) -> tuple[list[Campaign], list[Campaign]]:
    """The campaigns with FRFs, and those with curves only."""
    parts: tuple[list[Campaign], list[Campaign]] = ([], [])
    for campaign in campaigns:
        parts[not any(isinstance(recording, FrfRecording) for recording in campaign.recordings)].append(campaign)
    return parts


def with_curves(campaign: Campaign, of_curves: Sequence[Campaign]) -> Campaign:
    """The campaign with the curves of other campaigns of its skin, whose names precede the curves' ids."""
    curves = [replace(curve, id=f"{other.name}: {curve.id}") for other in of_curves for curve in other.recordings]
    return replace(campaign, recordings=(*campaign.recordings, *curves)) if curves else campaign


def curves_once(campaigns: Sequence[Campaign], seen: set[bytes]) -> list[Campaign]:
    """The campaigns without curves that are identical to one of an earlier campaign or to one `seen` before: a block
    that was added to the FRFs of two dates is one measurement."""
    distinct = []
    for campaign in campaigns:
        curves = {
            recording.id: _curve(recording)
            for recording in campaign.recordings
            if not isinstance(recording, FrfRecording)
        }
        remaining = tuple(recording for recording in campaign.recordings if curves.get(recording.id) not in seen)
        distinct.append(
            replace(campaign, recordings=remaining) if len(remaining) < len(campaign.recordings) else campaign
        )
        seen |= set(curves.values())
    return distinct


def _curve(recording: CurveRecording) -> bytes:
    return recording.displacement_mm.tobytes() + recording.force_n.tobytes()


def refuse_copies(campaigns: Sequence[Campaign]) -> None:
    """Raise InvalidInput where two campaigns hold the identical FRF, which would count twice."""
    owners: dict[bytes, str] = {}
    for campaign in campaigns:
        for index, recording in enumerate(campaign.recordings):
            if not isinstance(recording, FrfRecording):
                continue
            owner = owners.setdefault(_measured(recording), campaign.name)
            if owner != campaign.name:
                allowed = f"must not hold the same numbers as a recording of {owner}: it would count twice"
                raise InvalidInput(f"{campaign.name}: recordings[{index}]", recording.sensor, allowed)


def _measured(recording: FrfRecording) -> bytes:
    series = (recording.frf_re_pc_per_n, recording.frf_im_pc_per_n, recording.force_n, recording.charge_pc)
    return b"".join(b"-" if column is None else column.tobytes() for column in series)


def _check(with_frf: Sequence[Campaign], of_curves: Sequence[Campaign]) -> None:
    campaigns = [*with_frf, *of_curves]
    if not with_frf or len(campaigns) < 2:
        allowed = "must be two at least, one of them with recordings of kind frf"
        raise InvalidInput("campaigns", len(campaigns), allowed)
    names = [campaign.name for campaign in campaigns]
    for campaign in campaigns:
        if names.count(campaign.name) > 1:
            raise InvalidInput("campaigns", campaign.name, "must each have a name of its own")
    first = campaigns[0].skin
    for index, campaign in enumerate(campaigns):
        for field in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio"):
            here, there = getattr(first, field), getattr(campaign.skin, field)
            if there is None and index >= len(with_frf):
                continue  # which curves do not need
            if here != there and not (here and there and math.isclose(here, there, rel_tol=1e-9)):
                allowed = f"must be {here:g}, as {campaigns[0].name} has it: they are to be of one skin"
                raise InvalidInput(f"{campaign.name}: skin.{field}", there, allowed)
