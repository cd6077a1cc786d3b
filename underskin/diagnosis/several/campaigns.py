"""Campaigns of one skin diagnosed together: which mechanisms act in all of them, and which from some date on.

Each campaign with FRFs is first diagnosed alone, which gives its noise, findings and candidate sets of mechanisms;
then one set per campaign is chosen for all together (histories.py). Curves of campaigns without FRFs are of the same
material and count once, with the first campaign of FRFs that has a result. Changes of the sensors' d33 between
campaigns are corrected for the mechanisms (sensors.py).
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.report import Reported, reported
from underskin.diagnosis.several.histories import (
    CampaignFits,
    SharedParameters,
    causes,
    d33_uncertainties,
    p_described,
    parameter_values,
    periods,
    set_histories,
    sets_of_campaign,
)
from underskin.diagnosis.several.joint_report import SkinOverDates, together_document
from underskin.diagnosis.several.population import STATED
from underskin.diagnosis.several.sensors import (
    CampaignDates,
    Change,
    Sensor,
    SensorsOverDates,
    SensorsUnderSet,
    failures,
    faults_of,
    in_order,
    sensors_of,
    used_recordings,
    without_steps,
)
from underskin.diagnosis.several.sessions import by_session
from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.recordings.campaign import Campaign, FrfRecording
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
        Two at least; those with FRFs are sorted by the time of their first recordings where all have one, and parts of
        one campaign, such as a file for each sensor or each press, are put together (sessions.py). One campaign, and
        curves alone, are diagnosed as by themselves.
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
        Fewer than two campaigns, skins that are declared differently, or FRFs that are in two campaigns.
    """
    with_frf, of_curves = by_frfs(curves_once(campaigns, set()))
    _check(with_frf, of_curves)
    refuse_copies(with_frf)
    sessions = by_session(with_frf)
    _check_names([*sessions, *of_curves])
    if len(sessions) > 1:
        document = _document(name, sessions, of_curves, table, without, progress)
    else:
        first = sessions[0] if sessions else replace(of_curves[0], recordings=())
        of_one = with_curves(replace(first, name=name), of_curves)
        document = reported(diagnose(of_one, table, progress, without=without)).document
    names = [campaign.name for campaign in (*(sessions if len(sessions) > 1 else in_order(with_frf)), *of_curves)]
    return {**document, "campaign": name, "campaigns": list(dict.fromkeys(names))}


def _document(
    name: str,
    with_frf: Sequence[Campaign],
    of_curves: Sequence[Campaign],
    table: SigmaTable,
    without: Collection[str],
    progress: Callable[[float], None],
) -> dict[str, Any]:
    """The report on campaigns with FRFs in their order, with the curves of others; of a single usable one its own."""
    campaigns, results = list[Campaign](), list[DiagnosisResult]()
    for index, campaign in enumerate(with_frf):
        counted = any(result.search is not None for result in results)
        campaigns.append(campaign if counted else with_curves(campaign, of_curves))
        results.append(diagnose(campaigns[-1], table, without=without))
        progress((index + 1) / (len(with_frf) + 1))
    suspected = [_outlying_sensors(result) for result in results]
    # Single sensors that changed since the previous campaign are no physics of the skin
    answers = [None if result.search is None else result.search.answers[0].explanation for result in results]
    alone = [_sensors_under(*campaign, table) for campaign in zip(campaigns, results, answers, strict=True)]
    steps = SensorsOverDates(alone, np.arange(len(alone), dtype=float), [0.0] * len(alone), suspected).steps
    for index, campaign in enumerate(campaigns):
        as_before = without_steps(campaign, steps, index)
        if as_before is not campaign:
            results[index] = diagnose(as_before, table, without=without)
    reports = {campaign.name: reported(result) for campaign, result in zip(campaigns, results, strict=True)}
    usable = [index for index, result in enumerate(results) if result.search is not None]
    if len(usable) < 2:
        documents = [report.document for report in reports.values()]
        return next((document for index, document in enumerate(documents) if index not in usable), documents[0])
    campaigns, results = [campaigns[index] for index in usable], [results[index] for index in usable]
    skin = _skin_over_dates(campaigns, results, [suspected[index] for index in usable], reports, table)
    return together_document(name, skin)


def _skin_over_dates(
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    suspected: Sequence[frozenset[str]],
    reports: Mapping[str, Reported],
    table: SigmaTable,
) -> SkinOverDates:
    """Of campaigns with results in their order; `suspected` are the sensors whose level stands apart in each,
    `reports` those of all campaigns, usable or not."""
    fits = [CampaignFits.of(result) for result in results]
    histories = set_histories(fits)
    leader, acting, dates = histories[0], periods(fits, histories), CampaignDates.of(campaigns)
    sensors: list[dict[str, Sensor]] = []
    for index, (campaign, result) in enumerate(zip(campaigns, results, strict=True)):
        here = [period for period in acting if index in period.campaigns]
        values = {period.mechanism: parameter_values(period.parameters, period.mean) for period in here}
        described = fits[index].p_unlisted <= STATED  # else no known mechanism explains its levels
        sensors.append(sensors_of(campaign, values, table, used_recordings(result)) if described else {})
    over_dates = SensorsOverDates(sensors, dates.times, d33_uncertainties(fits, leader), suspected)

    def with_causes(change: Change) -> Change:
        if change.sensor is not None:
            return change
        size = float(np.log1p(change.value))
        return replace(change, causes=causes(fits[change.since], leader.sets[change.since], size, change.uncertainty))

    array = over_dates.array
    over_sets = [
        _sensors_over_sets(campaign, result, sets_of_campaign(fits[index], histories, index), table)
        if sensors[index]
        else []
        for index, (campaign, result) in enumerate(zip(campaigns, results, strict=True))
    ]
    return SkinOverDates(
        dates=dates,
        reports=reports,
        provenance=results[-1].provenance,
        p_unlisted=[campaign.p_unlisted for campaign in fits],
        p_described=p_described(fits),
        histories=histories,
        periods=acting,
        sensors=sensors,
        over_sets=over_sets,
        failures=failures([faults_of(campaign, result) for campaign, result in zip(campaigns, results, strict=True)]),
        changes=[with_causes(change) for change in over_dates.changes],
        array=None if array is None else replace(array, change=with_causes(array.change)),
    )


def _outlying_sensors(result: DiagnosisResult) -> frozenset[str]:
    reasons = (Reason.SENSOR_WEAKER, Reason.SENSOR_STRONGER)
    return frozenset(str(finding.arguments["sensor"]) for finding in result.findings if finding.reason in reasons)


def _sensors_under(
    campaign: Campaign, result: DiagnosisResult, fit: Explanation | None, table: SigmaTable
) -> dict[str, Sensor]:
    """The sensors of a campaign under an answer, or without any mechanism."""
    shared = {} if fit is None else {name: SharedParameters.of(fit, [name]) for name in fit.names}
    values = {name: parameter_values(of_name.parameters, of_name.mean) for name, of_name in shared.items()}
    return sensors_of(campaign, values, table, used_recordings(result))


def _sensors_over_sets(
    campaign: Campaign, result: DiagnosisResult, sets: Sequence[tuple[float, Explanation, float]], table: SigmaTable
) -> list[SensorsUnderSet]:
    """The sensors of a campaign under each set that can be inverted."""
    under = [(share, _sensors_under(campaign, result, fit, table), deviation) for share, fit, deviation in sets]
    return [SensorsUnderSet(share, sensors, deviation) for share, sensors, deviation in under if sensors]


def by_frfs(campaigns: Sequence[Campaign]) -> tuple[list[Campaign], list[Campaign]]:
    """The campaigns with FRFs, and those with curves only."""
    parts: tuple[list[Campaign], list[Campaign]] = ([], [])
    for campaign in campaigns:
        parts[not campaign.of(FrfRecording)].append(campaign)
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
        curves = {curve.id: curve.displacement_mm.tobytes() + curve.force_n.tobytes() for curve in campaign.curves}
        remaining = tuple(recording for recording in campaign.recordings if curves.get(recording.id) not in seen)
        distinct.append(replace(campaign, recordings=remaining))
        seen |= set(curves.values())
    return distinct


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
    if len(campaigns) < 2:
        raise InvalidInput("campaigns", len(campaigns), "must be two at least, of one skin or material")
    first = campaigns[0].skin
    for index, campaign in enumerate(campaigns):
        for field in ("thickness_mm", "youngs_modulus_mpa", "sensor_radius_mm", "poisson_ratio"):
            here, there = getattr(first, field), getattr(campaign.skin, field)
            if there is None and index >= len(with_frf):
                continue  # which curves do not need
            if here != there and not (here and there and math.isclose(here, there, rel_tol=1e-9)):
                allowed = f"must be {here:g}, as {campaigns[0].name} has it: they are to be of one skin"
                raise InvalidInput(f"{campaign.name}: skin.{field}", there, allowed)


def _check_names(campaigns: Sequence[Campaign]) -> None:
    names = [campaign.name for campaign in campaigns]
    for campaign in campaigns:
        if names.count(campaign.name) > 1:
            raise InvalidInput("campaigns", campaign.name, "must each have a name of its own")
