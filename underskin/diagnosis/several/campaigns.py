"""Campaigns of one skin diagnosed together: what acts in all of them, and what is there from a campaign on.

Curves of campaigns without FRFs are of the same material: they count once, with the first campaign of FRFs that
says something. Each of those is diagnosed as it would be alone, which gives its noise, its findings and the sets of
mechanisms that it asks for; then one set a campaign is chosen for all together (course.py). What a sensor's d33 did
between them is told with the mechanisms taken into account (sensors.py).
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.report import DiagnosisResult, reported
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
        Two at least, one of them with FRFs; those are put in the order of their first recordings' times where all have
        one.
    table
        σ.
    name
        What the report calls them.
    without
        Mechanisms to leave out of the catalogue.
    progress
        Told the share that is done.

    Returns
    -------
    dict
        Plain JSON values.

    Raises
    ------
    InvalidInput
        Fewer than two campaigns, none with FRFs, skins that are declared otherwise, or FRFs that are in two campaigns.
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
    """Of campaigns with FRFs in their order, and what curves of others tell; of one alone its own."""
    ordered, results = list[Campaign](), list[DiagnosisResult]()
    for number, campaign in enumerate(with_frf):
        counted = any(result.search is not None for result in results)
        ordered.append(campaign if counted else with_curves(campaign, of_curves))
        results.append(diagnose(ordered[-1], table, without=without))
        progress((number + 1) / (len(with_frf) + 1))
    alone = [_standing_alone(result) for result in results]
    results = _with_changed_sensors(ordered, results, alone, table, without)
    reports = [reported(result) for result in results]
    usable = [number for number, result in enumerate(results) if result.search is not None]
    if len(usable) < 2:
        lacking = (own.document for number, own in enumerate(reports) if number not in usable)
        return next(lacking, reports[0].document)
    dated = CampaignDates([ordered[number].name for number in usable], [date_of(ordered[number]) for number in usable])
    return together_report(name, ordered, results, reports, usable, dated, alone, table)


def _with_changed_sensors(
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    alone: Sequence[frozenset[str]],
    table: SigmaTable,
    without: Collection[str],
) -> list[DiagnosisResult]:
    """Diagnosed again where single sensors had changed since the campaign before: that is no physics of the skin."""
    apart = [_apart(campaign, result, table) for campaign, result in zip(campaigns, results, strict=True)]
    single = d33_changes(apart, alone, [0.0] * len(apart), np.arange(len(apart), dtype=float))
    again = []
    for number, (campaign, result) in enumerate(zip(campaigns, results, strict=True)):
        as_before = corrected(campaign, single, number)
        again.append(result if as_before is campaign else diagnose(as_before, table, without=without))
    return again


def _standing_alone(result: DiagnosisResult) -> frozenset[str]:
    reasons = (Reason.SENSOR_WEAKER, Reason.SENSOR_STRONGER)
    return frozenset(str(finding.arguments["sensor"]) for finding in result.findings if finding.reason in reasons)


def _apart(campaign: Campaign, result: DiagnosisResult, table: SigmaTable) -> SensorsOfCampaign | None:
    """The sensors under the answer of the campaign alone, or without any mechanism."""
    leader = None if result.search is None else result.search.answers[0].explanation
    strengths: Values = {} if leader is None else {name: _of_one(leader, name) for name in leader.names}
    return sensors_of(campaign, strengths, table, used_recordings(result))


def _of_one(explanation: Explanation, name: str) -> dict[str, float]:
    shared = Shared.of(explanation, [name], skin=False)
    return values(shared.parameters, shared.mean)


def by_frfs(campaigns: Sequence[Campaign]) -> tuple[list[Campaign], list[Campaign]]:
    """Those with FRFs, and those of curves alone."""
    parts: tuple[list[Campaign], list[Campaign]] = ([], [])
    for campaign in campaigns:
        parts[not any(isinstance(one, FrfRecording) for one in campaign.recordings)].append(campaign)
    return parts


def with_curves(campaign: Campaign, of_curves: Sequence[Campaign]) -> Campaign:
    """The campaign with the curves of others of its skin, each called by its own campaign's name."""
    curves = [replace(entry, id=f"{other.name}: {entry.id}") for other in of_curves for entry in other.recordings]
    return replace(campaign, recordings=(*campaign.recordings, *curves)) if curves else campaign


def curves_once(campaigns: Sequence[Campaign], seen: set[bytes]) -> list[Campaign]:
    """The campaigns without curves that an earlier one, or one `seen` before, has number for number: a block that was
    joined to the FRFs of two dates is one measurement."""
    found = []
    for campaign in campaigns:
        curves = {one.id: _curve(one) for one in campaign.recordings if not isinstance(one, FrfRecording)}
        kept = tuple(one for one in campaign.recordings if curves.get(one.id) not in seen)
        found.append(replace(campaign, recordings=kept) if len(kept) < len(campaign.recordings) else campaign)
        seen |= set(curves.values())
    return found


def _curve(recording: CurveRecording) -> bytes:
    return recording.displacement_mm.tobytes() + recording.force_n.tobytes()


def refuse_copies(campaigns: Sequence[Campaign]) -> None:
    """Raise InvalidInput where an FRF is in two campaigns, number for number: it would count twice."""
    owners: dict[bytes, str] = {}
    for campaign in campaigns:
        for place, recording in enumerate(campaign.recordings):
            if not isinstance(recording, FrfRecording):
                continue
            owner = owners.setdefault(_measured(recording), campaign.name)
            if owner != campaign.name:
                allowed = f"must not hold the same numbers as a recording of {owner}: it would count twice"
                raise InvalidInput(f"{campaign.name}: recordings[{place}]", recording.sensor, allowed)


def _measured(recording: FrfRecording) -> bytes:
    series = (recording.frf_re_pc_per_n, recording.frf_im_pc_per_n, recording.force_n, recording.charge_pc)
    return b"".join(b"-" if one is None else one.tobytes() for one in series)


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
    for number, campaign in enumerate(campaigns):
        for field in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio"):
            here, there = getattr(first, field), getattr(campaign.skin, field)
            if there is None and number >= len(with_frf):
                continue  # which curves do not need
            if here != there and not (here and there and math.isclose(here, there, rel_tol=1e-9)):
                allowed = f"must be {here:g}, as {campaigns[0].name} has it: they are to be of one skin"
                raise InvalidInput(f"{campaign.name}: skin.{field}", there, allowed)
