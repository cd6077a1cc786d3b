"""The report on several campaigns of one skin that were diagnosed together.

It lists the sensors that a campaign leaves out as dead or weak (those that failed between two campaigns first), the
changes of d33 from campaign to campaign, the mechanisms with their dates, and what each kind of recording contributes.
No d33 of several campaigns, or of skins of one make, is to be quoted; the clauses here say why, and what may be quoted
in its place.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words
from underskin.diagnosis.reporting.d33 import StatedD33
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.numbers import SDS_OF_95, rounded
from underskin.diagnosis.reporting.report import SCHEMA, Reported
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE
from underskin.diagnosis.several.course import (
    Candidate,
    SetHistories,
    SetHistory,
    Shared,
    combined,
    same_strength,
    set_histories,
    values,
)
from underskin.diagnosis.several.sensors import (
    AGEING,
    ArrayOverDates,
    CampaignDates,
    Change,
    SensorsOfCampaign,
    array_over_dates,
    causes,
    changed_once,
    d33_changes,
    mark_exchanges,
    per_sensor,
    sensors_of,
    unsure_of_changes,
)
from underskin.diagnosis.several.sensors import findings as exchanges
from underskin.findings.codes import FindingCode
from underskin.findings.formatting import in_percent, listed, of_clauses
from underskin.inversion.array_course import FEWEST_DATES
from underskin.inversion.array_history import TWO_DATES, array_change_in_words
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable


def of_kinds(reports: Iterable[tuple[str, Reported]]) -> dict[str, Any]:
    """`by_kind` and `contradictions` of all reports, each contradiction with the name of its campaign or skin; empty
    where no report has several kinds of recordings."""
    with_kinds = [(name, reported.document) for name, reported in reports if "by_kind" in reported.document]
    if not with_kinds:
        return {}
    contradictions = [
        {**contradiction, "statement": f"{name}: {contradiction['statement']}"}
        for name, document in with_kinds
        for contradiction in document["contradictions"]
    ]
    return {
        "by_kind": [row for _, document in with_kinds for row in document["by_kind"]],
        "contradictions": contradictions,
    }


_MOST_NAMED = 3  # skins in a clause


def of_campaigns(last: str, stated: StatedD33) -> str:
    """A clause on the d33 of a joint report, which is that of the `last` campaign by its recordings alone."""
    if stated.document is None:
        return f"no d33 is to be quoted: in {last}, the last campaign, no answer explains the recordings"
    clause = f"d33 here is by the recordings of {last} alone, and not to be quoted for all campaigns"
    if stated.document["quotable"]:
        return f"{clause}: {stated.quoted()}"
    return f"{clause}, nor for {last} itself: {stated.interval()}"


def of_skins(mean: float, unit: str, by_skin: Mapping[str, StatedD33], lacking: Mapping[str, Sequence[str]]) -> str:
    """A clause on the d33 of a fleet, the mean of its skins.

    `by_skin`: d33 by each skin's recordings alone; `lacking`: of some skins the mechanisms that the fleet shows in them
    and their own diagnosis does not.
    """
    may: list[str] = []
    by_reason: dict[str, list[str]] = {}
    for skin, stated in by_skin.items():
        other_specimens = [f"its own diagnosis lacks {in_words(lacking[skin])}"] if lacking.get(skin) else []
        reason = " and ".join(stated.reasons or other_specimens)
        (by_reason.setdefault(reason, []) if reason else may).append(skin)
    others = [f"not of {_few(skins)} ({reason})" for reason, skins in by_reason.items()]
    quotable = ", ".join([f"of {_few(may) if may else 'none'}", *others])
    return (
        f"d33 is not to be quoted, because {mean:.3g} {unit} is the mean of the skins and no skin's own; "
        f"by its own recordings alone it may be quoted {quotable}"
    )


def not_identifiable(by_name: Mapping[str, StatedD33]) -> list[dict[str, str]]:
    """Mechanisms that would not show in a campaign, or a skin's, and prevent quoting its d33."""
    return [
        {**row, "reason": f"{name} alone: {row['reason']}"}
        for name, stated in by_name.items()
        for row in stated.not_identifiable([])
        if row["mechanism"] in {shift.mechanism for shift in stated.deciding}
    ]


def _few(skins: Sequence[str]) -> str:
    further = len(skins) - _MOST_NAMED
    return listed([*skins[:_MOST_NAMED], *([f"{further} more"] if further > 0 else [])])


class Fault(StrEnum):
    """Why a sensor is left out, in words that fit one or several sensors."""

    DEAD = "dead: no charge above noise"
    WEAK = "nearly dead: a small share of the others' charge"
    OTHER = "without a usable recording: see the findings"


Faults = Mapping[str, Fault | None]  # by recorded sensor; None if it is used


@dataclass(frozen=True)
class _Run:
    """Consecutive campaigns that record a sensor and leave it out: the first of them, and the last before and the first
    after them that use it."""

    fault: Fault
    first: int
    before: int | None
    after: int | None


def used_recordings(result: DiagnosisResult) -> frozenset[str]:
    """Ids of the recordings that a diagnosis used."""
    return (
        frozenset()
        if result.problem is None
        else frozenset(recording.id for recording in result.problem.lines.campaign.recordings)
    )


def faults_of(campaign: Campaign, result: DiagnosisResult) -> Faults:
    """Each sensor with FRFs, and why none of these was used, or None."""
    used = used_recordings(result)
    owner = {recording.id: recording.sensor for recording in campaign.recordings if isinstance(recording, FrfRecording)}
    usable = {sensor for name, sensor in owner.items() if name in used}
    codes: dict[str, set[FindingCode]] = {}
    for finding in result.findings:
        sensor = finding.arguments.get("sensor", owner.get(finding.recording))
        codes.setdefault(str(sensor), set()).add(finding.code)
    return {
        sensor: None if sensor in usable else _fault(codes.get(sensor, set()))
        for sensor in dict.fromkeys(owner.values())
    }


def _fault(codes: set[FindingCode]) -> Fault:
    if FindingCode.NO_RESPONSE in codes:
        return Fault.DEAD
    return Fault.WEAK if FindingCode.WEAK in codes else Fault.OTHER


def exclusions_in_words(
    by_campaign: Sequence[Faults], sensors: Sequence[SensorsOfCampaign | None], dated: CampaignDates
) -> list[str]:
    """Clauses on the sensors left out, one for each fault and its dates, those that failed between two campaigns
    first."""
    runs: dict[_Run, list[str]] = {}
    for sensor in dict.fromkeys(sensor for faults in by_campaign for sensor in faults):
        for run in _runs_of_dates([faults.get(sensor, _NOT_RECORDED) for faults in by_campaign]):
            runs.setdefault(run, []).append(sensor)
    ordered = sorted(runs.items(), key=lambda item: (item[0].before is None, item[0].first))
    return [_clause(run, group, sensors, dated) for run, group in ordered]


_NOT_RECORDED = "not recorded"


def _runs_of_dates(states: Sequence[Fault | str | None]) -> list[_Run]:
    runs: list[_Run] = []
    before: int | None = None
    current: _Run | None = None
    for index, state in enumerate(states):
        if state == _NOT_RECORDED:
            continue
        if isinstance(state, Fault):
            current = current or _Run(state, index, before, None)
            continue
        if current is not None:
            runs.append(_Run(current.fault, current.first, current.before, index))
            current = None
        before = index
    return runs if current is None else [*runs, current]


def _clause(run: _Run, names: Sequence[str], sensors: Sequence[SensorsOfCampaign | None], dated: CampaignDates) -> str:
    """A clause such as "sensor s06 is dead since 2026-09-21: no charge above noise, after 17.1 pC/N on 2026-05-12"."""
    is_single = len(names) == 1
    who = f"sensor {names[0]}" if is_single else f"sensors {listed(names)}"
    state, _, why = run.fault.partition(": ")
    start = dated.called(run.first)
    if run.after is not None:
        again = f"answer{'s' if is_single else ''} again on {dated.called(run.after)}"
        were = "was" if is_single else "were"
        return f"{who} {were} {state} on {start} ({why}) and {again}; left out of what is compared there"
    when = "in all campaigns" if run.before is None else f"since {start}"
    earlier = (
        "" if run.before is None else f", after {_earlier(names, sensors[run.before])} on {dated.called(run.before)}"
    )
    return f"{who} {'is' if is_single else 'are'} {state} {when}: {why}{earlier}; left out of all that follows"


def _earlier(names: Sequence[str], before: SensorsOfCampaign | None) -> str:
    """d33 of the sensors before."""
    had = (
        [] if before is None else [f"{before.d33[before.ids.index(name)]:.3g}" for name in names if name in before.ids]
    )
    return f"{listed(had)} pC/N" if had else "a response"


_MOST_CHANGES, _MOST_CAUSES = 3, 3  # changes in a statement, and mechanisms named as causes of one
_OF_THE_CHAIN = ("an amplifier's gain", "the temperature")


def in_statement(changed: Sequence[Change], over: ArrayOverDates | None, dated: CampaignDates) -> list[str]:
    """Clauses on changes of d33: of the array, first if it changed, and of sensors, of which more than a few are
    counted."""
    dates = 0 if over is None else len(over.numbers)
    steps = [change for change in changed if change.sensor is None and change.is_step and dates > 2]
    of_array = [change_in_words(change, dated) for change in steps]
    if over is not None and not steps:
        of_array = _array_in_words(over, changed, dated)
    of_sensors = [change for change in changed_once(changed) if change.sensor is not None]
    clauses = [change_in_words(change, dated) for change in of_sensors[:_MOST_CHANGES]]
    more = len(of_sensors) - _MOST_CHANGES
    clauses += [f"d33 of each sensor has {more} further changes"] if more > 0 else []
    changed_at_all = steps or (over is not None and over.is_significant)
    return [*of_array, *clauses] if changed_at_all else [*clauses, *of_array]


def change_in_words(change: Change, dated: CampaignDates) -> str:
    """A clause on the change of d33 of one sensor or of the array; of the array with its possible causes, which a
    change of level cannot separate."""
    if change.exchanged_with is not None:
        both = f"sensors {change.sensor} and {change.exchanged_with}"
        return f"{both} look exchanged since {dated.called(change.since)}: each has the d33 that the other had"
    whose = "of the array" if change.sensor is None else f"of sensor {change.sensor}, beyond the others,"
    way = "fell" if change.value < 0 else "rose"
    before, after = (dated.called(index) for index in (change.before, change.until))
    half = SDS_OF_95 * change.uncertainty
    low, high = sorted(abs(100 * (change.value + end * half)) for end in (-1, 1))
    size = f"{abs(100 * change.value):.3g} % ({low:.3g} to {high:.3g})"
    level = f", {_causes(change)}" if change.sensor is None else ""
    return f"d33 {whose} {way} by {size} between {before} and {after}{level}"


def _array_in_words(over: ArrayOverDates, changed: Sequence[Change], dated: CampaignDates) -> list[str]:
    """Clauses on the array's d33 from the first to the last campaign."""
    first, last = over.numbers[0], over.numbers[-1]
    between = f"between {dated.called(first)} and {dated.called(last)}"
    clause = array_change_in_words(
        over.change.value, over.low, over.high, over.d33.tolist(), between, dated.days(first, last)
    )
    if not over.is_significant:
        return [clause]
    stated = next((change for change in changed if change.sensor is None), over.change)
    return [f"{clause}, {_causes(stated)}", *([TWO_DATES] if len(over.numbers) < FEWEST_DATES else [])]


def _causes(change: Change) -> str:
    few = [in_words([name]) for name in change.causes[:_MOST_CAUSES]]
    more = ["another mechanism"] if len(change.causes) > _MOST_CAUSES else []
    causes = " or ".join([*few, *more, *_OF_THE_CHAIN])
    return f"a change of level that {causes} would make: these recordings do not tell which"


_ALTERNATIVES = 6
_DESCRIBED = 0.5  # probability of an unlisted cause up to which a campaign's d33 is reported


def together_report(
    name: str,
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    reports: Sequence[Reported],
    usable: Sequence[int],
    dated: CampaignDates,
    outliers: Sequence[frozenset[str]],
    table: SigmaTable,
) -> dict[str, Any]:
    """The joint report of the campaigns in their order, with the result and the report of each alone.

    `usable` are the indices of the campaigns with a result, `dated` these with their dates; `outliers` the sensors that
    stand apart within each campaign.
    """
    candidates = [
        Candidate(result.problem, result.search)
        for result in (results[number] for number in usable)
        if result.problem is not None and result.search is not None
    ]
    names = dated.names
    posterior = set_histories(candidates, min(candidate.search.supported for candidate in candidates))
    unlisted_probability = [candidate.unlisted_probability for candidate in candidates]
    described = (1 - P_NOT_IN_MODEL_SPACE) * float(np.prod([1 - share for share in unlisted_probability]))
    leader = posterior.best[0]
    strengths = _strengths(candidates, leader)
    sensors = [
        sensors_of(campaigns[number], strengths[index], table, used_recordings(results[number]))
        if unlisted_probability[index] <= _DESCRIBED
        else None  # no known mechanism explains its levels
        for index, number in enumerate(usable)
    ]
    unsure = unsure_of_changes(candidates, leader)
    single = d33_changes(sensors, [outliers[number] for number in usable], unsure, dated.times)
    changed = [_with_causes(change, candidates, leader) for change in mark_exchanges(single, sensors)]
    over = array_over_dates(sensors, unsure, dated.times)
    if over is not None:
        over = replace(over, change=_with_causes(over.change, candidates, leader))
    mechanisms = [*_mechanisms(candidates, posterior, leader, dated), *_aged(changed, dated)]
    verdict = _verdict(leader, described, unlisted_probability, changed)
    faults = [faults_of(campaigns[number], results[number]) for number in usable]
    probability = 1 - described if verdict == "unexplained" else leader.probability * described
    last_name, last = names[-1], reports[usable[-1]].d33
    findings = [
        {**finding, "statement": f"{campaign.name}: {finding['statement']}"}
        for campaign, report in zip(campaigns, reports, strict=True)
        for finding in report.document["findings"]
    ]
    findings = [*(finding.in_report() for finding in exchanges(changed, dated)), *findings]
    by_kind = of_kinds(zip((campaign.name for campaign in campaigns), reports, strict=True))
    contradictory = [f"in {contradiction['statement']}" for contradiction in by_kind.get("contradictions", ())]
    of_d33 = of_campaigns(last_name, last)
    return {
        "schema": SCHEMA,
        "campaign": name,
        "campaigns": [campaign.name for campaign in campaigns],
        "verdict": verdict,
        "probability": round(probability, 3),
        "statement": _statement(
            verdict,
            probability,
            leader,
            unlisted_probability,
            mechanisms,
            dated,
            [*exclusions_in_words(faults, sensors, dated), *contradictory],
            in_statement(changed, over, dated),
            of_d33,
        ),
        "location": {
            "axes": [],
            "region": {},
            "effect_percent": None,
            "statement": "See each campaign's own diagnosis.",
        },
        "mechanisms": mechanisms,
        "presence": [*_presence(posterior, described), *_groups(changed)],
        "unnamed": None,
        "alternatives": [
            _alternative(sequence, described, names) for sequence in posterior.best[1 : _ALTERNATIVES + 1]
        ],
        "not_identifiable": not_identifiable({last_name: last}),
        "findings": findings,
        **by_kind,
        "fit": None,
        "power": [],
        "d33": {
            **(last.document or {}),
            "quotable": False,
            "per_sensor": per_sensor(sensors),
            **_of_array(over, names),
        },
        "next_experiment": None,
        "provenance": {
            **results[usable[-1]].provenance,
            "each": [
                {key: report.document[key] for key in ("campaign", "verdict", "probability")} for report in reports
            ],
        },
    }


def _with_causes(change: Change, candidates: Sequence[Candidate], leader: SetHistory) -> Change:
    """The change with the mechanisms that could cause it, if it is of the array."""
    if change.sensor is not None:
        return change
    return replace(change, causes=causes(candidates[change.since], leader.sets[change.since], change))


def _of_array(over: ArrayOverDates | None, names: Sequence[str]) -> dict[str, Any]:
    """`d33.per_campaign`: d33 of the array over the sensors common to the campaigns."""
    if over is None:
        return {}
    ends = over.d33[:, None] + SDS_OF_95 * np.outer(over.uncertainty, [0.0, -1.0, 1.0])
    columns = ("value", "low", "high")
    return {
        "per_campaign": [
            {"campaign": names[index], "unit": "pC/N"}
            | {name: rounded(float(at)) for name, at in zip(columns, row, strict=True)}
            for index, row in zip(over.numbers, ends, strict=True)
        ]
    }


def _strengths(candidates: Sequence[Candidate], leader: SetHistory) -> list[dict[str, dict[str, float]]]:
    """The parameters of each campaign's mechanisms, pooled over all campaigns with the same strength."""
    strengths: list[dict[str, dict[str, float]]] = [{} for _ in candidates]
    for mechanism in dict.fromkeys(name for names in leader.sets for name in names):
        for run in _runs(candidates, leader, mechanism):
            shared = list(run.values())
            pooled = values(shared[0].parameters, combined(shared)[0]) if len(shared[0].mean) else {}
            for index in run:
                strengths[index][mechanism] = pooled
    return strengths


def _runs(candidates: Sequence[Candidate], leader: SetHistory, mechanism: str) -> list[dict[int, Shared]]:
    """The campaigns in which a mechanism acts, by index, grouped by equal strength."""
    runs: list[dict[int, Shared]] = []
    for index, (candidate, names) in enumerate(zip(candidates, leader.sets, strict=True)):
        fit = candidate.explained(frozenset(names)) if mechanism in names else None
        if fit is None:
            continue
        shared = Shared.of(fit, [mechanism], skin=False)
        if runs and same_strength(next(reversed(runs[-1].values())), shared):
            runs[-1][index] = shared
        else:
            runs.append({index: shared})
    return runs


def _verdict(
    leader: SetHistory, described: float, unlisted_probability: Sequence[float], changed: Sequence[Change]
) -> str:
    if max(unlisted_probability) > 0.5:
        return "unexplained"
    if leader.probability * described < EXPLAINED:
        return "ambiguous"
    return "explained" if any(leader.sets) or changed else "no_mismatch"


def _mechanisms(
    candidates: Sequence[Candidate], posterior: SetHistories, leader: SetHistory, dated: CampaignDates
) -> list[dict[str, Any]]:
    rows = []
    for mechanism in dict.fromkeys(name for names in leader.sets for name in names):
        for run in _runs(candidates, leader, mechanism):
            where, shared = list(run), list(run.values())
            mean, deviation = combined(shared) if len(shared[0].mean) else (shared[0].mean, shared[0].mean)
            parameters = []
            for parameter, middle, sd in zip(shared[0].parameters, mean, deviation, strict=True):
                low, high = parameter.bounds
                ends = (middle, max(middle - SDS_OF_95 * sd, low), min(middle + SDS_OF_95 * sd, high))
                value = dict(
                    zip(("value", "low", "high"), (rounded(parameter.from_fit(float(at))) for at in ends), strict=True)
                )
                parameters.append({"name": parameter.name, "unit": parameter.unit, **value})
            rows.append(
                {
                    "name": mechanism,
                    "probability": round(float(np.min(posterior.present[mechanism][where])), 3),
                    "parameters": parameters,
                    "explains_percent": None,
                    "scope": _scope(where, _shown_in(candidates, mechanism), dated),
                }
            )
    return rows


def _shown_in(candidates: Sequence[Candidate], mechanism: str) -> list[int]:
    """Indices of the campaigns that could show a mechanism."""
    return [index for index, candidate in enumerate(candidates) if mechanism not in candidate.search.unsupported]


def _scope(where: Sequence[int], able: Sequence[int], dated: CampaignDates) -> dict[str, Any]:
    """The campaigns in which a mechanism acts; `since` if it acts in all that can show it from one date on, and in none
    before."""
    from_on = list(where) == [index for index in able if index >= where[0]] and where[0] > min(able)
    since = dated.since(where[0]) if from_on else None
    return {"campaigns": [dated.names[index] for index in where], **({"since": since} if since else {})}


def _aged(changed: Sequence[Change], dated: CampaignDates) -> list[dict[str, Any]]:
    """Changes of d33 between campaigns as mechanisms: the most probable cause, or ageing where one sensor's d33 fell.

    Each has a statement, since a change of level alone does not show its cause.
    """
    rows = []
    for change in changed:
        could = change.causes if change.sensor is None else (AGEING,) if change.value < 0 else ()
        if not could or change.exchanged_with is not None:
            continue
        half = SDS_OF_95 * change.uncertainty
        ends = {"value": 100 * change.value, "low": 100 * (change.value - half), "high": 100 * (change.value + half)}
        since = dated.since(change.since)
        scope: dict[str, Any] = {
            "campaigns": list(dated.names[change.since :]),
            **({"since": since} if since else {}),
            **({"sensors": [change.sensor]} if change.sensor is not None else {}),
        }
        rows.append(
            {
                "name": could[0],
                "probability": round(change.probability, 3),
                "parameters": [
                    {"name": "change_of_d33", "unit": "%", **{key: rounded(at, 3) for key, at in ends.items()}}
                ],
                "explains_percent": None,
                "scope": scope,
                "statement": of_clauses([change_in_words(change, dated)]),
            }
        )
    return rows


def _groups(changed: Sequence[Change]) -> list[dict[str, Any]]:
    """Groups of mechanisms of which one caused a change of level."""
    return [
        {"mechanisms": sorted(change.causes), "probability": round(change.probability, 3)}
        for change in changed
        if change.causes
    ]


def _presence(posterior: SetHistories, described: float) -> list[dict[str, Any]]:
    """The posterior that each mechanism acts in at least one campaign; `described` is that of known physics."""
    once: dict[str, float] = {}
    for sequence in posterior.best:
        for name in {name for names in sequence.sets for name in names}:
            once[name] = once.get(name, 0.0) + sequence.probability
    ranked = sorted(once.items(), key=lambda item: -item[1])
    return [
        {"mechanisms": [name], "probability": round(described * share, 3)} for name, share in ranked if share > 0.005
    ]


def _alternative(sequence: SetHistory, described: float, names: Sequence[str]) -> dict[str, Any]:
    sets = list(dict.fromkeys(name for mechanisms in sequence.sets for name in mechanisms)) or [NOTHING_MISSING]
    text = "; ".join(
        f"{name}: {in_words(mechanisms or (NOTHING_MISSING,))}"
        for name, mechanisms in zip(names, sequence.sets, strict=True)
    )
    return {"mechanisms": sets, "probability": round(described * sequence.probability, 3), "why_not": text}


def _statement(
    verdict: str,
    probability: float,
    leader: SetHistory,
    unlisted_probability: Sequence[float],
    mechanisms: Sequence[dict[str, Any]],
    dated: CampaignDates,
    decisive: Sequence[str],
    of_levels: Sequence[str],
    of_d33: str,
) -> str:
    """The statement; `decisive` are clauses that come before the verdict, `of_levels` those on d33 of array and
    sensors."""
    percent = in_percent(probability)
    names = dated.names
    parts = [
        _in_words(mechanism, names)
        for mechanism in mechanisms
        if mechanism["name"] in {n for in_campaign in leader.sets for n in in_campaign}
    ]
    if verdict == "unexplained":
        which = ", ".join(name for name, share in zip(names, unlisted_probability, strict=True) if share > 0.5)
        stated = f"something is missing in {which} that no known mechanism describes ({percent})"
    elif verdict == "no_mismatch":
        agree = f"all {len(names)} campaigns and the paper's model agree within the noise"
        stated = f"{agree} ({percent})"
    elif not any(leader.sets):
        stated = f"within each campaign nothing is missing ({percent})"
    else:
        lead = "best explained so" if verdict == "ambiguous" else "the paper's model lacks"
        stated = f"{lead}: {', '.join(parts)} ({percent})"
    first = [*decisive, f"apart from that, {stated}"] if decisive else [stated]
    return of_clauses(first, of_levels, [dated.order_clause(), of_d33], names=names)


def _in_words(mechanism: dict[str, Any], names: Sequence[str]) -> str:
    scope = mechanism["scope"]
    words = in_words([mechanism["name"]])
    if "since" in scope:
        return f"{words} since {scope['since']}"
    if len(scope["campaigns"]) == len(names):
        return f"{words} in {'both' if len(names) == 2 else f'all {len(names)}'} campaigns of FRFs"
    return f"{words} in {' and '.join(scope['campaigns'])} alone"
