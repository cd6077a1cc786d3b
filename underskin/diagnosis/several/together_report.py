"""The report of campaigns of one skin that were diagnosed together."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words
from underskin.diagnosis.reporting.numbers import SDS_OF_95, rounded
from underskin.diagnosis.reporting.report import SCHEMA, DiagnosisResult, Reported
from underskin.diagnosis.reporting.sentences import of_clauses
from underskin.diagnosis.selection.answers import UNTHOUGHT
from underskin.diagnosis.several import change_words, left_out, quoted
from underskin.diagnosis.several.course import Candidate, Course, Courses, courses, same_strength
from underskin.diagnosis.several.dates import Dated
from underskin.diagnosis.several.exchanged import findings as exchanges
from underskin.diagnosis.several.exchanged import with_exchanges
from underskin.diagnosis.several.kinds import of_kinds
from underskin.diagnosis.several.level import AGEING, causes, unsure_of_changes
from underskin.diagnosis.several.posteriors import Shared, combined, values
from underskin.diagnosis.several.sensors import (
    ArrayOverDates,
    Change,
    array_over_dates,
    changes,
    per_sensor,
    sensors_of,
)
from underskin.findings.formatting import in_percent
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

_ALTERNATIVES = 6
_DESCRIBED = 0.5  # probability of something undescribed up to which a campaign's d33 is told


def together_report(
    name: str,
    campaigns: Sequence[Campaign],
    results: Sequence[DiagnosisResult],
    reports: Sequence[Reported],
    usable: Sequence[int],
    dated: Dated,
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
    found = courses(candidates, min(candidate.search.supported for candidate in candidates))
    undescribed = [candidate.undescribed for candidate in candidates]
    described = (1 - UNTHOUGHT) * float(np.prod([1 - share for share in undescribed]))
    leader = found.best[0]
    strengths = _strengths(candidates, leader)
    sensors = [
        sensors_of(campaigns[number], strengths[place], table, left_out.used_recordings(results[number]))
        if undescribed[place] <= _DESCRIBED
        else None  # whose levels no mechanism here explains
        for place, number in enumerate(usable)
    ]
    unsure = unsure_of_changes(candidates, leader)
    single = changes(sensors, [alone[number] for number in usable], unsure, dated.times)
    changed = [_with_causes(change, candidates, leader) for change in with_exchanges(single, sensors)]
    over = array_over_dates(sensors, unsure, dated.times)
    if over is not None:
        over = replace(over, change=_with_causes(over.change, candidates, leader))
    mechanisms = [*_mechanisms(candidates, found, leader, dated), *_aged(changed, dated)]
    verdict = _verdict(leader, described, undescribed, changed)
    faults = [left_out.faults(campaigns[number], results[number]) for number in usable]
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
    of_d33 = quoted.of_campaigns(last_name, last)
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
            [*left_out.in_words(faults, sensors, dated), *contradictory],
            change_words.in_statement(changed, over, dated),
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
        "not_identifiable": quoted.not_identifiable({last_name: last}),
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


def _with_causes(change: Change, candidates: Sequence[Candidate], leader: Course) -> Change:
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


def _strengths(candidates: Sequence[Candidate], leader: Course) -> list[dict[str, dict[str, float]]]:
    """Of each campaign the parameters of its mechanisms, from all campaigns in which they have that strength."""
    found: list[dict[str, dict[str, float]]] = [{} for _ in candidates]
    for mechanism in dict.fromkeys(name for own in leader.sets for name in own):
        for run in _runs(candidates, leader, mechanism):
            each = list(run.values())
            pooled = values(each[0].parameters, combined(each)[0]) if len(each[0].mean) else {}
            for number in run:
                found[number][mechanism] = pooled
    return found


def _runs(candidates: Sequence[Candidate], leader: Course, mechanism: str) -> list[dict[int, Shared]]:
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


def _verdict(leader: Course, described: float, undescribed: Sequence[float], changed: Sequence[Change]) -> str:
    if max(undescribed) > 0.5:
        return "unexplained"
    if leader.probability * described < EXPLAINED:
        return "ambiguous"
    return "explained" if any(leader.sets) or changed else "no_mismatch"


def _mechanisms(candidates: Sequence[Candidate], found: Courses, leader: Course, dated: Dated) -> list[dict[str, Any]]:
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


def _scope(where: Sequence[int], able: Sequence[int], dated: Dated) -> dict[str, Any]:
    """In which campaigns; `since` where it is there from one date on in all that can show it, and not before."""
    from_on = list(where) == [number for number in able if number >= where[0]] and where[0] > min(able)
    since = dated.since(where[0]) if from_on else None
    return {"campaigns": [dated.names[number] for number in where], **({"since": since} if since else {})}


def _aged(changed: Sequence[Change], dated: Dated) -> list[dict[str, Any]]:
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
                "statement": of_clauses([change_words.change_in_words(change, dated)]),
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


def _presence(found: Courses, described: float) -> list[dict[str, Any]]:
    """The posterior that each mechanism acts in at least one campaign."""
    once: dict[str, float] = {}
    for course in found.best:
        for name in {name for own in course.sets for name in own}:
            once[name] = once.get(name, 0.0) + course.probability
    ranked = sorted(once.items(), key=lambda entry: -entry[1])
    return [
        {"mechanisms": [name], "probability": round(described * share, 3)} for name, share in ranked if share > 0.005
    ]


def _alternative(course: Course, described: float, names: Sequence[str]) -> dict[str, Any]:
    sets = list(dict.fromkeys(name for own in course.sets for name in own)) or [NOTHING_MISSING]
    each = "; ".join(
        f"{name}: {in_words(own or (NOTHING_MISSING,))}" for name, own in zip(names, course.sets, strict=True)
    )
    return {"mechanisms": sets, "probability": round(described * course.probability, 3), "why_not": each}


def _statement(
    verdict: str,
    probability: float,
    leader: Course,
    undescribed: Sequence[float],
    mechanisms: Sequence[dict[str, Any]],
    dated: Dated,
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
