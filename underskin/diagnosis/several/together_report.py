"""The report on several campaigns of one skin.

What recordings of each kind tell of several campaigns or skins, and where kinds contradict each other. Why no d33 of
several campaigns, or of skins of one make, is to be quoted, and what may be quoted in its place.

Sensors that a campaign's own diagnosis leaves out, as dead or weak: what is left out of one campaign is left out of
what is said of all, and a sensor that died between two of them comes first.

Clauses on how d33 changed from campaign to campaign. The report of campaigns of one skin that were diagnosed together.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words
from underskin.diagnosis.reporting.law_statement import of_clauses
from underskin.diagnosis.reporting.numbers import SDS_OF_95, rounded
from underskin.diagnosis.reporting.report import SCHEMA, DiagnosisResult, Reported
from underskin.diagnosis.reporting.statements import StatedD33, listed
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
from underskin.findings.formatting import in_percent
from underskin.inversion.array_course import FEWEST_DATES
from underskin.inversion.array_history import TWO_DATES, array_change_in_words
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable


def of_kinds(reports: Iterable[tuple[str, Reported]]) -> dict[str, Any]:
    """`by_kind` and `contradictions`, these led by the name of the campaign or skin that the report is of; empty where
    none has several kinds."""
    told = [(name, own.document) for name, own in reports if "by_kind" in own.document]
    if not told:
        return {}
    contradictions = [
        {**entry, "statement": f"{name}: {entry['statement']}"}
        for name, document in told
        for entry in document["contradictions"]
    ]
    return {
        "by_kind": [entry for _, document in told for entry in document["by_kind"]],
        "contradictions": contradictions,
    }


_MOST_NAMED = 3  # skins in a clause


def of_campaigns(last: str, own: StatedD33) -> str:
    """A clause on the d33 of a joint report: it is that of the `last` campaign by its recordings alone."""
    if own.document is None:
        return f"no d33 is to be quoted: in {last}, the last campaign, no answer explains the recordings"
    alone = f"d33 here is by the recordings of {last} alone, and not to be quoted for all campaigns"
    if own.document["quotable"]:
        return f"{alone}: {own.quoted()}"
    return f"{alone}, nor for {last} itself: {own.interval()}"


def of_skins(mean: float, unit: str, each: Mapping[str, StatedD33], lacking: Mapping[str, Sequence[str]]) -> str:
    """A clause on the d33 of a fleet, the mean of its skins.

    `each`: what the skins' recordings say alone; `lacking`: of some skins the mechanisms that the fleet finds in them
    and their own diagnosis does not.
    """
    may: list[str] = []
    by_reason: dict[str, list[str]] = {}
    for skin, own in each.items():
        other_specimens = [f"its own diagnosis lacks {in_words(lacking[skin])}"] if lacking.get(skin) else []
        reason = " and ".join(own.reasons or other_specimens)
        (by_reason.setdefault(reason, []) if reason else may).append(skin)
    others = [f"not of {_few(skins)} ({reason})" for reason, skins in by_reason.items()]
    told = ", ".join([f"of {_few(may) if may else 'none'}", *others])
    return (
        f"d33 is not to be quoted, because {mean:.3g} {unit} is the mean of the skins and no skin's own; "
        f"by its own recordings alone it may be quoted {told}"
    )


def not_identifiable(each: Mapping[str, StatedD33]) -> list[dict[str, str]]:
    """What would not show in a campaign, or in a skin's, and keeps its d33 from being quoted."""
    return [
        {**entry, "reason": f"{name} alone: {entry['reason']}"}
        for name, own in each.items()
        for entry in own.not_identifiable([])
        if entry["mechanism"] in {one.mechanism for one in own.deciding}
    ]


def _few(skins: Sequence[str]) -> str:
    further = len(skins) - _MOST_NAMED
    return listed([*skins[:_MOST_NAMED], *([f"{further} more"] if further > 0 else [])])


class Fault(StrEnum):
    """Why a sensor is left out, as a sentence says it of one or of several."""

    DEAD = "dead: no charge above noise"
    WEAK = "nearly dead: a small share of the others' charge"
    OTHER = "without a usable recording: see the findings"


Faults = Mapping[str, Fault | None]  # by recorded sensor, None of one that is used


@dataclass(frozen=True)
class _Run:
    """Campaigns in a row that record a sensor and leave it out: the first, the last one before and the first one after
    that use it."""

    fault: Fault
    first: int
    before: int | None
    after: int | None


def used_recordings(result: DiagnosisResult) -> frozenset[str]:
    """The recordings that a diagnosis used (ids)."""
    return (
        frozenset() if result.problem is None else frozenset(one.id for one in result.problem.lines.campaign.recordings)
    )


def faults_of(campaign: Campaign, result: DiagnosisResult) -> Faults:
    """Each sensor that was recorded with FRFs, and why none of these was used."""
    used = used_recordings(result)
    owner = {entry.id: entry.sensor for entry in campaign.recordings if isinstance(entry, FrfRecording)}
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


def left_out_in_words(
    each: Sequence[Faults], sensors: Sequence[SensorsOfCampaign | None], dated: CampaignDates
) -> list[str]:
    """A clause on all sensors that share a fault and its dates, those that came between two campaigns first."""
    runs: dict[_Run, list[str]] = {}
    for sensor in dict.fromkeys(sensor for one in each for sensor in one):
        for run in _runs_of_dates([one.get(sensor, _NOT_RECORDED) for one in each]):
            runs.setdefault(run, []).append(sensor)
    ordered = sorted(runs.items(), key=lambda entry: (entry[0].before is None, entry[0].first))
    return [_clause(run, own, sensors, dated) for run, own in ordered]


_NOT_RECORDED = "not recorded"


def _runs_of_dates(states: Sequence[Fault | str | None]) -> list[_Run]:
    found: list[_Run] = []
    before: int | None = None
    current: _Run | None = None
    for number, state in enumerate(states):
        if state == _NOT_RECORDED:
            continue
        if isinstance(state, Fault):
            current = current or _Run(state, number, before, None)
            continue
        if current is not None:
            found.append(_Run(current.fault, current.first, current.before, number))
            current = None
        before = number
    return found if current is None else [*found, current]


def _clause(run: _Run, own: Sequence[str], sensors: Sequence[SensorsOfCampaign | None], dated: CampaignDates) -> str:
    """ "sensor s06 is dead since 2026-09-21: no charge above noise, after 17.1 pC/N on 2026-05-12"."""
    one = len(own) == 1
    who = f"sensor {own[0]}" if one else f"sensors {listed(own)}"
    state, _, why = run.fault.partition(": ")
    begun = dated.called(run.first)
    if run.after is not None:
        again = f"answer{'s' if one else ''} again on {dated.called(run.after)}"
        were = "was" if one else "were"
        return f"{who} {were} {state} on {begun} ({why}) and {again}; left out of what is compared there"
    when = "in all campaigns" if run.before is None else f"since {begun}"
    earlier = (
        "" if run.before is None else f", after {_earlier(own, sensors[run.before])} on {dated.called(run.before)}"
    )
    return f"{who} {'is' if one else 'are'} {state} {when}: {why}{earlier}; left out of all that follows"


def _earlier(own: Sequence[str], before: SensorsOfCampaign | None) -> str:
    """d33 that the sensors had."""
    had = [] if before is None else [f"{before.d33[before.ids.index(one)]:.3g}" for one in own if one in before.ids]
    return f"{listed(had)} pC/N" if had else "a response"


_MOST_TOLD, _MOST_CAUSES = 3, 3  # changes in a statement, and mechanisms that would make one
_OF_THE_CHAIN = ("an amplifier's gain", "the temperature")


def in_statement(changed: Sequence[Change], over: ArrayOverDates | None, dated: CampaignDates) -> list[str]:
    """What a statement says of d33: of the array first where it changed, and of sensors beside it, of more than a few
    how many."""
    dates = 0 if over is None else len(over.numbers)
    steps = [change for change in changed if change.sensor is None and change.is_step and dates > 2]
    of_array = [change_in_words(change, dated) for change in steps]
    if over is not None and not steps:
        of_array = _array_in_words(over, changed, dated)
    own = [change for change in changed_once(changed) if change.sensor is not None]
    said = [change_in_words(change, dated) for change in own[:_MOST_TOLD]]
    more = len(own) - _MOST_TOLD
    said += [f"d33 of each sensor has {more} further changes"] if more > 0 else []
    changed_at_all = steps or (over is not None and over.is_significant)
    return [*of_array, *said] if changed_at_all else [*said, *of_array]


def change_in_words(change: Change, dated: CampaignDates) -> str:
    """A clause on d33 of one sensor or of the array; of the array, that a change of level tells nothing of its
    cause."""
    if change.exchanged_with is not None:
        both = f"sensors {change.sensor} and {change.exchanged_with}"
        return f"{both} look exchanged since {dated.called(change.since)}: each has the d33 that the other had"
    whose = "of the array" if change.sensor is None else f"of sensor {change.sensor}, beyond the others,"
    way = "fell" if change.value < 0 else "rose"
    before, after = (dated.called(number) for number in (change.before, change.until))
    half = SDS_OF_95 * change.uncertainty
    low, high = sorted(abs(100 * (change.value + end * half)) for end in (-1, 1))
    size = f"{abs(100 * change.value):.3g} % ({low:.3g} to {high:.3g})"
    level = f", {_causes(change)}" if change.sensor is None else ""
    return f"d33 {whose} {way} by {size} between {before} and {after}{level}"


def _array_in_words(over: ArrayOverDates, changed: Sequence[Change], dated: CampaignDates) -> list[str]:
    """From the first to the last campaign."""
    first, last = over.numbers[0], over.numbers[-1]
    between = f"between {dated.called(first)} and {dated.called(last)}"
    said = array_change_in_words(
        over.change.value, over.low, over.high, over.d33.tolist(), between, dated.days(first, last)
    )
    if not over.is_significant:
        return [said]
    stated = next((change for change in changed if change.sensor is None), over.change)
    return [f"{said}, {_causes(stated)}", *([TWO_DATES] if len(over.numbers) < FEWEST_DATES else [])]


def _causes(change: Change) -> str:
    few = [in_words([name]) for name in change.causes[:_MOST_CAUSES]]
    more = ["another mechanism"] if len(change.causes) > _MOST_CAUSES else []
    causes = " or ".join([*few, *more, *_OF_THE_CHAIN])
    return f"a change of level that {causes} would make: these recordings do not tell which"


_ALTERNATIVES = 6
_DESCRIBED = 0.5  # probability of something undescribed up to which a campaign's d33 is told


def together_report(
    name: str,
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    reports: Sequence[Reported],
    usable: Sequence[int],
    dated: CampaignDates,
    alone: Sequence[frozenset[str]],
    table: SigmaTable,
) -> dict[str, Any]:
    """Of the campaigns in their order, with the result and the report of each alone; `usable` are the numbers of those
    that tell anything, `dated` these with their dates; `alone` the sensors that each says stand alone."""
    candidates = [
        Candidate(result.problem, result.search)
        for result in (results[number] for number in usable)
        if result.problem is not None and result.search is not None
    ]
    names = dated.names
    found = set_histories(candidates, min(candidate.search.supported for candidate in candidates))
    undescribed = [candidate.unlisted_probability for candidate in candidates]
    described = (1 - P_NOT_IN_MODEL_SPACE) * float(np.prod([1 - share for share in undescribed]))
    leader = found.best[0]
    strengths = _strengths(candidates, leader)
    sensors = [
        sensors_of(campaigns[number], strengths[place], table, used_recordings(results[number]))
        if undescribed[place] <= _DESCRIBED
        else None  # whose levels no mechanism here explains
        for place, number in enumerate(usable)
    ]
    unsure = unsure_of_changes(candidates, leader)
    single = d33_changes(sensors, [alone[number] for number in usable], unsure, dated.times)
    changed = [_with_causes(change, candidates, leader) for change in mark_exchanges(single, sensors)]
    over = array_over_dates(sensors, unsure, dated.times)
    if over is not None:
        over = replace(over, change=_with_causes(over.change, candidates, leader))
    mechanisms = [*_mechanisms(candidates, found, leader, dated), *_aged(changed, dated)]
    verdict = _verdict(leader, described, undescribed, changed)
    faults = [faults_of(campaigns[number], results[number]) for number in usable]
    probability = 1 - described if verdict == "unexplained" else leader.probability * described
    last_name, last = names[-1], reports[usable[-1]].d33
    findings = [
        {**finding, "statement": f"{campaign.name}: {finding['statement']}"}
        for campaign, own in zip(campaigns, reports, strict=True)
        for finding in own.document["findings"]
    ]
    findings = [*(finding.in_report() for finding in exchanges(changed, dated)), *findings]
    by_kind = of_kinds(zip((campaign.name for campaign in campaigns), reports, strict=True))
    contradictory = [f"in {entry['statement']}" for entry in by_kind.get("contradictions", ())]
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
            undescribed,
            mechanisms,
            dated,
            [*left_out_in_words(faults, sensors, dated), *contradictory],
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
        "presence": [*_presence(found, described), *_groups(changed)],
        "unnamed": None,
        "alternatives": [_alternative(course, described, names) for course in found.best[1 : _ALTERNATIVES + 1]],
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
            "each": [{key: own.document[key] for key in ("campaign", "verdict", "probability")} for own in reports],
        },
    }


def _with_causes(change: Change, candidates: Sequence[Candidate], leader: SetHistory) -> Change:
    """With the mechanisms that would make it, of a change of the array."""
    if change.sensor is not None:
        return change
    return replace(change, causes=causes(candidates[change.since], leader.sets[change.since], change))


def _of_array(over: ArrayOverDates | None, names: Sequence[str]) -> dict[str, Any]:
    """`d33.per_campaign`: of the array over the sensors that the campaigns share."""
    if over is None:
        return {}
    ends = over.d33[:, None] + SDS_OF_95 * np.outer(over.uncertainty, [0.0, -1.0, 1.0])
    columns = ("value", "low", "high")
    return {
        "per_campaign": [
            {"campaign": names[number], "unit": "pC/N"}
            | {name: rounded(float(at)) for name, at in zip(columns, row, strict=True)}
            for number, row in zip(over.numbers, ends, strict=True)
        ]
    }


def _strengths(candidates: Sequence[Candidate], leader: SetHistory) -> list[dict[str, dict[str, float]]]:
    """Of each campaign the parameters of its mechanisms, from all campaigns in which they have that strength."""
    found: list[dict[str, dict[str, float]]] = [{} for _ in candidates]
    for mechanism in dict.fromkeys(name for own in leader.sets for name in own):
        for run in _runs(candidates, leader, mechanism):
            each = list(run.values())
            pooled = values(each[0].parameters, combined(each)[0]) if len(each[0].mean) else {}
            for number in run:
                found[number][mechanism] = pooled
    return found


def _runs(candidates: Sequence[Candidate], leader: SetHistory, mechanism: str) -> list[dict[int, Shared]]:
    """The campaigns in which a mechanism acts, by number, those together in which it has the same strength."""
    runs: list[dict[int, Shared]] = []
    for number, (candidate, own) in enumerate(zip(candidates, leader.sets, strict=True)):
        fit = candidate.explained(frozenset(own)) if mechanism in own else None
        if fit is None:
            continue
        shared = Shared.of(fit, [mechanism], skin=False)
        if runs and same_strength(next(reversed(runs[-1].values())), shared):
            runs[-1][number] = shared
        else:
            runs.append({number: shared})
    return runs


def _verdict(leader: SetHistory, described: float, undescribed: Sequence[float], changed: Sequence[Change]) -> str:
    if max(undescribed) > 0.5:
        return "unexplained"
    if leader.probability * described < EXPLAINED:
        return "ambiguous"
    return "explained" if any(leader.sets) or changed else "no_mismatch"


def _mechanisms(
    candidates: Sequence[Candidate], found: SetHistories, leader: SetHistory, dated: CampaignDates
) -> list[dict[str, Any]]:
    entries = []
    for mechanism in dict.fromkeys(name for own in leader.sets for name in own):
        for run in _runs(candidates, leader, mechanism):
            where, each = list(run), list(run.values())
            mean, deviation = combined(each) if len(each[0].mean) else (each[0].mean, each[0].mean)
            parameters = []
            for entry, middle, sd in zip(each[0].parameters, mean, deviation, strict=True):
                low, high = entry.bounds
                ends = (middle, max(middle - SDS_OF_95 * sd, low), min(middle + SDS_OF_95 * sd, high))
                value = dict(
                    zip(("value", "low", "high"), (rounded(entry.from_fit(float(at))) for at in ends), strict=True)
                )
                parameters.append({"name": entry.name, "unit": entry.unit, **value})
            entries.append(
                {
                    "name": mechanism,
                    "probability": round(float(np.min(found.present[mechanism][where])), 3),
                    "parameters": parameters,
                    "explains_percent": None,
                    "scope": _scope(where, _shown_in(candidates, mechanism), dated),
                }
            )
    return entries


def _shown_in(candidates: Sequence[Candidate], mechanism: str) -> list[int]:
    """The campaigns that could show it."""
    return [number for number, one in enumerate(candidates) if mechanism not in one.search.unsupported]


def _scope(where: Sequence[int], able: Sequence[int], dated: CampaignDates) -> dict[str, Any]:
    """In which campaigns; `since` where it is there from one date on in all that can show it, and not before."""
    from_on = list(where) == [number for number in able if number >= where[0]] and where[0] > min(able)
    since = dated.since(where[0]) if from_on else None
    return {"campaigns": [dated.names[number] for number in where], **({"since": since} if since else {})}


def _aged(changed: Sequence[Change], dated: CampaignDates) -> list[dict[str, Any]]:
    """A d33 that changed from one campaign to the next, under the most probable mechanism that would do that: of one
    sensor ageing, where it fell.

    Each has a statement, since a change of level alone does not tell its cause.
    """
    entries = []
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
        entries.append(
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
    return entries


def _groups(changed: Sequence[Change]) -> list[dict[str, Any]]:
    """The mechanisms of which one made a change of level."""
    return [
        {"mechanisms": sorted(change.causes), "probability": round(change.probability, 3)}
        for change in changed
        if change.causes
    ]


def _presence(found: SetHistories, described: float) -> list[dict[str, Any]]:
    """The posterior that each mechanism acts in at least one campaign."""
    once: dict[str, float] = {}
    for course in found.best:
        for name in {name for own in course.sets for name in own}:
            once[name] = once.get(name, 0.0) + course.probability
    ranked = sorted(once.items(), key=lambda entry: -entry[1])
    return [
        {"mechanisms": [name], "probability": round(described * share, 3)} for name, share in ranked if share > 0.005
    ]


def _alternative(course: SetHistory, described: float, names: Sequence[str]) -> dict[str, Any]:
    sets = list(dict.fromkeys(name for own in course.sets for name in own)) or [NOTHING_MISSING]
    each = "; ".join(
        f"{name}: {in_words(own or (NOTHING_MISSING,))}" for name, own in zip(names, course.sets, strict=True)
    )
    return {"mechanisms": sets, "probability": round(described * course.probability, 3), "why_not": each}


def _statement(
    verdict: str,
    probability: float,
    leader: SetHistory,
    undescribed: Sequence[float],
    mechanisms: Sequence[dict[str, Any]],
    dated: CampaignDates,
    decisive: Sequence[str],
    of_levels: Sequence[str],
    of_d33: str,
) -> str:
    """`decisive` are clauses that come before the verdict, `of_levels` those on d33 of array and sensors."""
    percent = in_percent(probability)
    names = dated.names
    parts = [
        _in_words(entry, names) for entry in mechanisms if entry["name"] in {n for own in leader.sets for n in own}
    ]
    if verdict == "unexplained":
        which = ", ".join(name for name, share in zip(names, undescribed, strict=True) if share > 0.5)
        stated = f"something is missing in {which} that no known mechanism describes ({percent})"
    elif verdict == "no_mismatch":
        agree = f"all {len(names)} campaigns and the paper's model agree within the noise"
        stated = f"{agree} ({percent})"
    elif not any(leader.sets):
        stated = f"within each campaign nothing is missing ({percent})"
    else:
        begin = "best explained so" if verdict == "ambiguous" else "the paper's model lacks"
        stated = f"{begin}: {', '.join(parts)} ({percent})"
    first = [*decisive, f"apart from that, {stated}"] if decisive else [stated]
    return of_clauses(first, of_levels, [dated.order_clause(), of_d33], names=names)


def _in_words(entry: dict[str, Any], names: Sequence[str]) -> str:
    scope = entry["scope"]
    called = in_words([entry["name"]])
    if "since" in scope:
        return f"{called} since {scope['since']}"
    if len(scope["campaigns"]) == len(names):
        return f"{called} in {'both' if len(names) == 2 else f'all {len(names)}'} campaigns of FRFs"
    return f"{called} in {' and '.join(scope['campaigns'])} alone"
