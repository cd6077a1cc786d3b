"""The documents (`report/1`) on several campaigns of one skin, and on skins of one make, and their words.

On campaigns: the sensors that one leaves out as dead or weak (those that failed between two campaigns first), the
changes of d33 from campaign to campaign, the mechanisms with their dates. On skins: the populations of E, thickness,
d33 and the strengths of mechanisms, and the skins that depart from them. No d33 of several campaigns, or of skins of
one make, is to be quoted; the clauses here say why, and what may be quoted in its place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import (
    EXPLAINED,
    MOST_NAMED,
    NAMED,
    NONE_OF_THESE,
    NOTHING_MISSING,
    in_words,
    quantity_in_words,
)
from underskin.diagnosis.reporting.headline import WORDS, within_words
from underskin.diagnosis.reporting.numbers import at_bound_in_words, rounded
from underskin.diagnosis.reporting.quantities import StatedD33
from underskin.diagnosis.reporting.report import ALTERNATIVES, EMPTY, LEAST_PROBABILITY, Reported
from underskin.diagnosis.reporting.statement import slip_clauses
from underskin.diagnosis.several.histories import AGEING, Names, Period, SetHistory
from underskin.diagnosis.several.population import D33, REGULAR, STATED, Populations
from underskin.diagnosis.several.sensors import (
    ArrayOverDates,
    CampaignDates,
    Change,
    Failure,
    Sensor,
    SensorsUnderSet,
    exchanges,
    over_sets,
)
from underskin.findings.codes import FindingCode, Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import few, in_percent, listed, of_clauses
from underskin.inversion.array_history import FEWEST_DATES, TWO_DATES, array_change_in_words
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.units import Floats

_LEAST_LISTED = 0.1  # probability of a listed quantity in which a skin may depart


@dataclass(frozen=True, eq=False)
class SkinOverDates:
    """What the campaigns of a skin say together: lists are by campaign with a result, `reports` those of all campaigns
    alone. `changes` and `array` are those of d33, with what could have caused them."""

    dates: CampaignDates
    reports: Mapping[str, Reported]
    provenance: Mapping[str, Any]
    p_unlisted: Sequence[float]
    p_described: float  # by known physics, all campaigns
    histories: Sequence[SetHistory]
    periods: Sequence[Period]
    sensors: Sequence[Mapping[str, Sensor]]  # by the leading history
    over_sets: Sequence[Sequence[SensorsUnderSet]]
    failures: Mapping[Failure, Sequence[str]]
    changes: Sequence[Change]
    array: ArrayOverDates | None


@dataclass(frozen=True, eq=False)
class PooledQuantity:
    """One quantity of `skins`: its row in their `populations`, which are relative to declared values with these
    logarithms (skins,), and the name of the departure in it."""

    parameter: str
    unit: str
    skins: Sequence[str]
    populations: Populations
    row: int
    departure: str
    declared: Floats

    @property
    def expected(self) -> Floats:
        """The batch's mean at each skin's declared values (skins,)."""
        return np.exp(self.populations.mean[self.row] + self.declared)


@dataclass(frozen=True, eq=False)
class Fleet:
    """What skins of one make say together: `reports` those of the usable skins alone, `lacking` the others; the set of
    mechanisms of each with its probability; and the pooled quantities, d33 first.

    `p_declared`: the probability of each error of the values declared for all skins; `orders`: clauses on skins with
    several campaigns whose order is not known in time.
    """

    reports: Mapping[str, Reported]
    provenance: Mapping[str, Any]
    lacking: Sequence[str]
    orders: Mapping[str, str]
    p_unlisted: Mapping[str, float]
    p_described: float  # by known physics, all skins
    sets: Mapping[str, tuple[Names, float]]
    p_sets: float
    p_declared: Mapping[str, float]
    errors: Mapping[str, tuple[str, float]]  # of skins that depart in a declared value
    quantities: Sequence[PooledQuantity]


_UNQUOTED = {"quotable": False, "why_not": "each campaign has its own d33: quote from its own diagnosis"}


def together_document(name: str, skin: SkinOverDates) -> dict[str, Any]:
    """The report on campaigns of one skin, which are called `name` together."""
    leader, names = skin.histories[0], skin.dates.names
    unexplained = [name for name, share in zip(names, skin.p_unlisted, strict=True) if share > STATED]
    probability = leader.probability * skin.p_described
    bounds = [words for period in skin.periods for words in _at_bounds(period)]
    verdict = _verdict(unexplained, 0.0 if bounds else probability, bool(leader.mechanisms or skin.changes))
    probability = 1 - skin.p_described if unexplained else probability
    last = skin.reports[names[-1]].d33
    mechanisms = [*(_acting(period, skin.dates) for period in skin.periods), *_changed_levels(skin)]
    acting = [mechanism for mechanism in mechanisms if mechanism["name"] in leader.mechanisms]
    exchanged = [
        Finding(
            Reason.LEVELS_EXCHANGED,
            "",
            "sensor",
            {"since": skin.dates.called(ring[0].since), "labels": [str(change.sensor) for change in ring]},
        )
        for ring in exchanges(skin.changes)
    ]
    sensors = {**_failure_clauses(skin), **_exchange_clauses(skin)}
    decisive = [*sensors.values(), *_contradiction_clauses(skin.reports), *_slip_clauses(skin.reports)]
    stated = _sets_in_words(verdict, unexplained, acting, names, in_percent(probability))
    brief = _sets_in_brief(verdict, leader.mechanisms, in_percent(probability))
    first = [*decisive, f"apart from that, {stated}"] if decisive else [stated]
    first += [*bounds, *(_rivals_in_words(skin) if verdict == "ambiguous" else [])]
    closing = [skin.dates.order_clause(), _d33_of_last(names[-1], last)]
    return {
        **_of_parts("campaign", skin.reports, skin.provenance, exchanged),
        "campaign": name,
        "campaigns": list(skin.reports),
        "verdict": verdict,
        "probability": round(probability, 3),
        "headline": _headline(skin, [*sensors, *_contradictions_in_brief(skin.reports)], stated, brief),
        "statement": of_clauses(first, _change_clauses(skin), closing, names=names),
        "mechanisms": mechanisms,
        "presence": [
            *_presence(skin),
            *(_share(sorted(change.causes), change.probability) for change in skin.changes if change.causes),
        ],
        "alternatives": _alternatives(skin)[:ALTERNATIVES],
        "not_identifiable": _not_identifiable({names[-1]: last}),
        "d33": {**(last.document or {}), **_UNQUOTED, "per_sensor": _per_sensor(skin), **_per_campaign(skin)},
    }


def fleet_document(name: str, campaigns: Sequence[str], fleet: Fleet) -> dict[str, Any]:
    """The report on a fleet with this name, of `campaigns` with these names."""
    quantities = [_population(quantity) for quantity in fleet.quantities]
    mechanisms = _mechanisms_of_fleet(fleet)
    departs = any(quantity["departures"] for quantity in quantities)
    unexplained = [skin for skin, share in fleet.p_unlisted.items() if share > STATED]
    wrongly = max(fleet.p_declared.values(), default=0.0)
    p_declared = wrongly if wrongly > STATED else 1 - sum(fleet.p_declared.values())
    p_sets = fleet.p_sets * p_declared * fleet.p_described
    p_departures, least_certain = _probability_of_departures(fleet)
    # By the least certain skin: by all together, fleets of many skins would all be ambiguous
    verdict = _verdict(unexplained, min(p_sets, least_certain), bool(mechanisms) or departs)
    probability = 1 - fleet.p_described if unexplained else p_sets * p_departures
    d33 = quantities[0]
    asides = [*_contradiction_clauses(fleet.reports), *_asides(fleet), _d33_of_skins(d33, mechanisms, fleet.reports)]
    first, departures = _fleet_in_words(mechanisms, unexplained, probability), _departure_clauses(fleet, quantities)
    names = [*fleet.reports, *fleet.lacking, *campaigns]
    return {
        **_of_parts("skin", fleet.reports, fleet.provenance),
        "campaign": name,
        "campaigns": list(campaigns),
        "verdict": verdict,
        "probability": round(probability, 3),
        "headline": within_words([*departures, first]),
        "statement": of_clauses([first], departures, asides, names=names),
        "mechanisms": mechanisms,
        "presence": [_share([mechanism["name"]], mechanism["probability"]) for mechanism in mechanisms],
        "not_identifiable": _not_identifiable({skin: report.d33 for skin, report in fleet.reports.items()}),
        "population": quantities,
        "d33": {"name": D33, "unit": d33["unit"], "value": d33["mean"], **_UNQUOTED, "per_skin": d33["skins"]},
    }


def _of_parts(
    part: str, reports: Mapping[str, Reported], provenance: Mapping[str, Any], findings: Sequence[Finding] = ()
) -> dict[str, Any]:
    """What the reports on campaigns, or skins, say by themselves, in the order of a joint one, which fills in the rest.

    `by_kind` and `contradictions` are there where a report has several kinds of recordings.
    """
    own = [(name, report.document) for name, report in reports.items()]
    by_kind = [row for _, document in own for row in document.get("by_kind", ())]
    of_kinds = {"by_kind": by_kind, "contradictions": _prefixed(reports, "contradictions")} if by_kind else {}
    each = [{part: name, **{key: document[key] for key in ("verdict", "probability")}} for name, document in own]
    nowhere: dict[str, Any] = {
        "axes": [],
        "region": {},
        "effect_percent": None,
        "statement": f"See each {part}'s own diagnosis.",
    }
    return {
        **{name: EMPTY[name] for name in EMPTY if name not in ("idealised", "remainder")},
        "campaigns": [],
        "location": nowhere,
        "findings": [*(finding.in_report() for finding in findings), *_prefixed(reports, "findings")],
        **of_kinds,
        "next_experiment": None,
        "provenance": {**provenance, "each": each},
    }


def _prefixed(reports: Mapping[str, Reported], key: str) -> list[dict[str, Any]]:
    """The rows of all reports, each statement with the name of its campaign or skin."""
    return [
        {**row, "statement": f"{name}: {row['statement']}"}
        for name, report in reports.items()
        for row in report.document.get(key, ())
    ]


def _contradiction_clauses(reports: Mapping[str, Reported]) -> list[str]:
    return [f"in {contradiction['statement']}" for contradiction in _prefixed(reports, "contradictions")]


def _slip_clauses(reports: Mapping[str, Reported]) -> list[str]:
    """What was undone or left out in single campaigns, but for the sensors of `_failure_clauses`."""
    of_sensors = (FindingCode.NO_RESPONSE, FindingCode.WEAK)
    return [
        f"in {name}: {words}"
        for name, report in reports.items()
        for words in slip_clauses(report.document["findings"], of_sensors)
    ]


def _contradictions_in_brief(reports: Mapping[str, Reported]) -> list[str]:
    of_campaigns = [name for name, report in reports.items() if report.document.get("contradictions")]
    return [f"recordings of {name} contradict one another" for name in of_campaigns]


def _headline(skin: SkinOverDates, decisive: Sequence[str], stated: str, brief: str) -> str:
    """What is decisive, the answer, `brief` where it does not fit as it is `stated`, and changes of d33."""
    changes = _changes_in_brief(skin)
    answer = next(
        (
            answer
            for others in ([*decisive, *changes[:1]], decisive)
            for answer in (stated, brief)
            if len(" ".join([*others, answer]).split()) <= WORDS
        ),
        brief,
    )
    return within_words([*decisive, answer, *changes], answer)


def _verdict(unexplained: Sequence[str], probability: float, anything: bool) -> str:
    if unexplained:
        return "unexplained"
    if probability < EXPLAINED:
        return "ambiguous"
    return "explained" if anything else "no_mismatch"


def _share(mechanisms: Sequence[str], probability: float) -> dict[str, Any]:
    return {"mechanisms": list(mechanisms), "probability": round(probability, 3)}


def _mechanism(
    name: str, probability: float, parameters: Sequence[Mapping[str, Any]], scope: Mapping[str, Any]
) -> dict[str, Any]:
    row = {"name": name, "probability": round(probability, 3), "parameters": list(parameters)}
    return {**row, "explains_percent": None, "scope": dict(scope)}


def _rounded(digits: int = 4, /, **values: float) -> dict[str, float | None]:
    return {name: rounded(float(value), digits) for name, value in values.items()}


def _not_identifiable(by_name: Mapping[str, StatedD33]) -> list[dict[str, str]]:
    """Mechanisms that would not show in a campaign, or a skin's, and prevent quoting its d33."""
    return [
        {**row, "reason": f"{name} alone: {row['reason']}"}
        for name, stated in by_name.items()
        for row in stated.not_identifiable([])
        if row["mechanism"] in {shift.mechanism for shift in stated.deciding}
    ]


def _scope(dates: CampaignDates, campaigns: Sequence[int], begins: bool) -> dict[str, Any]:
    since = dates.since(campaigns[0]) if begins else None
    return {"campaigns": [dates.names[index] for index in campaigns], **({"since": since} if since else {})}


def _acting(period: Period, dates: CampaignDates) -> dict[str, Any]:
    parameters = []
    for parameter, mean, sd in zip(period.parameters, period.mean, period.deviation, strict=True):
        low, high = parameter.bounds
        ends = {"value": mean, "low": max(mean - SDS_OF_95 * sd, low), "high": min(mean + SDS_OF_95 * sd, high)}
        value = _rounded(**{name: parameter.from_fit(float(end)) for name, end in ends.items()})
        side = parameter.ends_search(float(mean))
        bound = {} if side is None else {"at_bound": side}
        parameters.append({"name": parameter.name, "unit": parameter.unit, **value, **bound})
    return _mechanism(period.mechanism, period.probability, parameters, _scope(dates, period.campaigns, period.begins))


def _changed_levels(skin: SkinOverDates) -> list[dict[str, Any]]:
    """Changes of d33 between campaigns as mechanisms: the most probable cause, or ageing where one sensor's d33 fell.

    Each has a statement, since a change of level alone does not show its cause.
    """
    rows = []
    for change in skin.changes:
        could = change.causes if change.sensor is None else (AGEING,) if change.value < 0 else ()
        if could and change.exchanged_with is None:
            parameter = {"name": "change_of_d33", "unit": "%", **_rounded(3, **change.percent)}
            scope = _scope(skin.dates, range(change.since, len(skin.dates.names)), begins=True)
            scope |= {} if change.sensor is None else {"sensors": [change.sensor]}
            statement = of_clauses([_change_in_words(change, skin.dates)])
            rows.append({**_mechanism(could[0], change.probability, [parameter], scope), "statement": statement})
    return rows


def _presence(skin: SkinOverDates) -> list[dict[str, Any]]:
    """The posterior that each mechanism acts in at least one campaign."""
    once: dict[str, float] = {}
    for history in skin.histories:
        for name in history.mechanisms:
            once[name] = once.get(name, 0.0) + history.probability
    ranked = sorted(once.items(), key=lambda item: -item[1])
    return [_share([name], skin.p_described * share) for name, share in ranked if share > LEAST_PROBABILITY]


def _per_sensor(skin: SkinOverDates) -> list[dict[str, Any]]:
    return [
        {"sensor": sensor, **_of_campaign(skin, number, {sensor: d33}, d33)}
        for number, sensors in enumerate(skin.sensors)
        for sensor, d33 in sensors.items()
    ]


def _per_campaign(skin: SkinOverDates) -> dict[str, Any]:
    """d33 of the array over the sensors common to the campaigns."""
    if skin.array is None:
        return {}
    rows = []
    for number, d33, sd in zip(skin.array.numbers, skin.array.d33, skin.array.uncertainty, strict=True):
        array = np.array([d33, sd, d33 - SDS_OF_95 * sd, d33 + SDS_OF_95 * sd])
        rows.append(_of_campaign(skin, number, skin.sensors[number], array))
    return {"per_campaign": rows}


def _of_campaign(skin: SkinOverDates, number: int, level: Mapping[str, Sensor], d33: Sensor) -> dict[str, Any]:
    """A d33 where the sensors are `level`, over all sets of mechanisms; and its interval by the leading history, which
    compares it with others: the shares of sets differ by campaign."""
    stated = over_sets(skin.over_sets[number], level, d33)
    relative = _rounded(low=d33[2], high=d33[3])
    return {"campaign": skin.dates.names[number], "unit": "pC/N", **stated, "relative": relative}


def _sets_in_words(
    verdict: str,
    unexplained: Sequence[str],
    mechanisms: Sequence[Mapping[str, Any]],
    names: Sequence[str],
    percent: str,
) -> str:
    if verdict == "unexplained":
        return f"something is missing in {', '.join(unexplained)} that no known mechanism describes ({percent})"
    if verdict == "no_mismatch":
        return f"all {len(names)} campaigns and the paper's model agree within the noise ({percent})"
    if not mechanisms:
        return f"within each campaign nothing is missing ({percent})"
    lead = "best explained so" if verdict == "ambiguous" else "the paper's model lacks"
    return f"{lead}: {', '.join(_acting_in_words(mechanism, names) for mechanism in mechanisms)} ({percent})"


def _sets_in_brief(verdict: str, mechanisms: Sequence[str], percent: str) -> str:
    """The answer without campaigns and dates; mechanisms that would take more than half a headline are counted."""
    if verdict == "unexplained":
        return f"something is missing that no known mechanism describes ({percent})"
    if not mechanisms:
        return f"nothing {'may be' if verdict == 'ambiguous' else 'is'} missing ({percent})"
    names = in_words(mechanisms)
    what = names if len(names.split()) <= WORDS // 2 else f"{len(mechanisms)} mechanisms"
    return f"{'perhaps ' if verdict == 'ambiguous' else ''}{what} ({percent})"


def _acting_in_words(mechanism: Mapping[str, Any], names: Sequence[str]) -> str:
    scope, words = mechanism["scope"], in_words([mechanism["name"]])
    if "since" in scope:
        return f"{words} since {scope['since']}"
    if len(scope["campaigns"]) == len(names):
        return f"{words} in {'both' if len(names) == 2 else f'all {len(names)}'} campaigns of FRFs"
    return f"{words} in {' and '.join(scope['campaigns'])} alone"


def _alternatives(skin: SkinOverDates) -> list[dict[str, Any]]:
    """All answers but the leading history, the most probable first."""
    unlisted = _share([NONE_OF_THESE], 1 - skin.p_described)
    unlisted |= {"why_not": "what the campaigns leave to something unlisted, in one of them or more"}
    histories = [
        _share(history.mechanisms or [NOTHING_MISSING], skin.p_described * history.probability)
        | {"why_not": _history_in_words(history, skin.dates.names)}
        for history in skin.histories[1:]
    ]
    return sorted([unlisted, *histories], key=lambda answer: -answer["probability"])


def _rivals_in_words(skin: SkinOverDates) -> list[str]:
    """Clauses on the rivals of an ambiguous answer, with the sum of those that are not named, and on what the answers
    have in common."""
    others = _alternatives(skin)
    named = [answer for answer in others[:MOST_NAMED] if answer["probability"] > NAMED]
    words = [f"{in_words(answer['mechanisms'])} ({in_percent(answer['probability'])})" for answer in named]
    rest = sum(answer["probability"] for answer in others) - sum(answer["probability"] for answer in named)
    words += [f"others, {in_percent(rest)} together"] if rest > NAMED else []
    clauses = [f"these rivals remain: {', or '.join(words)}"] if words else []
    shares = {
        name: sum(history.probability for history in skin.histories if name in history.mechanisms)
        for name in skin.histories[0].mechanisms
    }
    common = [f"{in_words([name])} ({in_percent(share)})" for name, share in shares.items() if share > STATED]
    return [*clauses, f"of the answers by known mechanisms taken together, {listed(common)}"] if common else clauses


def _at_bounds(period: Period) -> list[str]:
    """Such as "compressible layer: poisson ratio at or beyond 0.3, where its search ends"."""
    fits = zip(period.parameters, period.mean.tolist(), strict=True)
    sides = [(parameter, parameter.ends_search(fit)) for parameter, fit in fits]
    return [at_bound_in_words(period.mechanism, parameter, side) for parameter, side in sides if side is not None]


def _history_in_words(history: SetHistory, names: Sequence[str]) -> str:
    sets = zip(names, history.sets, strict=True)
    return "; ".join(f"{name}: {in_words(mechanisms or (NOTHING_MISSING,))}" for name, mechanisms in sets)


def _failure_clauses(skin: SkinOverDates) -> dict[str, str]:
    """Such as "sensor s06 is dead since 2026-09-21: no charge above noise, after 17.1 pC/N on 2026-05-12", by what is
    before the colon."""
    clauses = {}
    for failure, sensors in skin.failures.items():
        single = len(sensors) == 1
        who, brief = (f"sensor{'' if single else 's'} {named}" for named in (listed(sensors), few(sensors, MOST_NAMED)))
        state, _, why = failure.fault.partition(": ")
        start = skin.dates.called(failure.first)
        if failure.after is not None:
            again = f"answer{'s' if single else ''} again on {skin.dates.called(failure.after)}"
            was = f"{'was' if single else 'were'} {state} on {start}"
            clauses[f"{brief} {was}"] = f"{who} {was} ({why}) and {again}; left out of what is compared there"
            continue
        when, earlier = "in all campaigns", ""
        if failure.before is not None:
            before = skin.sensors[failure.before]
            had = [f"{before[sensor][0]:.3g}" for sensor in sensors if sensor in before]
            level = f"{listed(had)} pC/N" if had else "a response"
            when, earlier = f"since {start}", f", after {level} on {skin.dates.called(failure.before)}"
        is_so = f"{'is' if single else 'are'} {state} {when}"
        clauses[f"{brief} {is_so}"] = f"{who} {is_so}: {why}{earlier}; left out of all that follows"
    return clauses


def _exchange_clauses(skin: SkinOverDates) -> dict[str, str]:
    """Such as "sensors s02 and s05 look exchanged since 2026-09-21: each has the d33 that the other had (s02 …)", by
    what is before the colon."""
    clauses = {}
    for ring in exchanges(skin.changes):
        sizes = ", ".join(
            f"{change.sensor} {change.percent['value']:+.3g} % ({change.percent['low']:+.3g} to "
            f"{change.percent['high']:+.3g})"
            for change in ring
        )
        look = f"look exchanged since {skin.dates.called(ring[0].since)}"
        names, source = [str(change.sensor) for change in ring], "the other" if len(ring) == 2 else "another"
        clauses[f"sensors {few(names, MOST_NAMED)} {look}"] = (
            f"sensors {listed(names)} {look}: each has the d33 that {source} had ({sizes})"
        )
    return clauses


def _changes_in_brief(skin: SkinOverDates) -> list[str]:
    """Whose d33 changed and by how much, the array first."""
    changes = [change for change in skin.changes if change.exchanged_with is None]
    if skin.array is not None and skin.array.is_significant and all(change.sensor is not None for change in changes):
        changes = [skin.array.change, *changes]
    return [
        f"d33 of {'the array' if change.sensor is None else f'sensor {change.sensor}'} {_fell_or_rose(change)}"
        for change in changes
    ]


def _fell_or_rose(change: Change) -> str:
    return f"{'fell' if change.value < 0 else 'rose'} by {abs(change.percent['value']):.3g} %"


def _change_clauses(skin: SkinOverDates) -> list[str]:
    """On changes of d33: of the array, first if it changed, and of sensors, of which more than a few are counted."""
    over, dates = skin.array, skin.dates
    several = over is not None and len(over.numbers) > 2
    steps = [change for change in skin.changes if change.sensor is None and change.is_step and several]
    of_array = [_change_in_words(change, dates) for change in steps]
    if over is not None and not steps:
        of_array = _array_clauses(over, skin.changes, dates, skin.histories[0].mechanisms)
    sensors = [change for change in skin.changes if change.sensor is not None and change.exchanged_with is None]
    clauses = [_change_in_words(change, dates) for change in sensors[:MOST_NAMED]]
    more = len(sensors) - MOST_NAMED
    clauses += [f"d33 of each sensor has {more} further changes"] if more > 0 else []
    changed = steps or (over is not None and over.is_significant)
    return [*of_array, *clauses] if changed else [*clauses, *of_array]


def _change_in_words(change: Change, dates: CampaignDates) -> str:
    """A clause on the change of d33 of one sensor or of the array; of the array with its possible causes, which a
    change of level cannot separate."""
    label = f", labelled {change.label}" if change.label not in (None, change.sensor) else ""
    whose = "of the array" if change.sensor is None else f"of sensor {change.sensor}{label}, beyond the others,"
    percent = change.percent
    low, high = sorted((abs(percent["low"]), abs(percent["high"])))
    size = f"{_fell_or_rose(change)} ({low:.3g} to {high:.3g})"
    causes = f", {_causes_in_words(change)}" if change.sensor is None else ""
    return f"d33 {whose} {size} between {dates.called(change.before)} and {dates.called(change.until)}{causes}"


def _array_clauses(
    over: ArrayOverDates, changes: Sequence[Change], dates: CampaignDates, mechanisms: Sequence[str]
) -> list[str]:
    """On the array's d33 from the first to the last campaign, by the answer with these mechanisms."""
    first, last = over.numbers[0], over.numbers[-1]
    between, days = f"between {dates.called(first)} and {dates.called(last)}", dates.days(first, last)
    found = (
        f"{in_words(mechanisms)} as in this answer, where a campaign's own d33 takes the skin as declared"
        if mechanisms
        else ""
    )
    clause = array_change_in_words(over.change.value, over.low, over.high, over.d33.tolist(), between, days, found)
    if not over.is_significant:
        return [clause]
    stated = next((change for change in changes if change.sensor is None), over.change)
    return [f"{clause}, {_causes_in_words(stated)}", *([TWO_DATES] if len(over.numbers) < FEWEST_DATES else [])]


def _causes_in_words(change: Change) -> str:
    few = [in_words([name]) for name in change.causes[:MOST_NAMED]]
    more = ["another mechanism"] if len(change.causes) > MOST_NAMED else []
    causes = " or ".join([*few, *more, "an amplifier's gain", "the temperature"])
    return f"a change of level that {causes} would make: these recordings do not tell which"


def _d33_of_last(last: str, stated: StatedD33) -> str:
    """A clause on the d33 of a joint report, which is that of the `last` campaign by its recordings alone."""
    if stated.document is None:
        return f"no d33 is to be quoted: in {last}, the last campaign, no answer explains the recordings"
    clause = f"d33 here is by the recordings of {last} alone, and not to be quoted for all campaigns"
    if stated.document["quotable"]:
        return f"{clause}: {stated.quoted()}"
    return f"{clause}, nor for {last} itself: {stated.interval()}"


def _d33_of_skins(
    d33: Mapping[str, Any], mechanisms: Sequence[Mapping[str, Any]], reports: Mapping[str, Reported]
) -> str:
    """A clause on the d33 of a fleet, the mean of its skins, and of which skins their own may be quoted: of those whose
    own diagnosis lacks no mechanism that the fleet shows in them."""
    by_reason: dict[str, list[str]] = {"": []}
    for skin, report in reports.items():
        stated = {mechanism["name"] for mechanism in report.document["mechanisms"]}
        here = [mechanism["name"] for mechanism in mechanisms if skin in mechanism["scope"]["skins"]]
        lacking = [name for name in here if name not in stated]
        of_fleet = [f"its own diagnosis lacks {in_words(lacking)}"] if lacking else []
        by_reason.setdefault(" and ".join(report.d33.reasons or of_fleet), []).append(skin)
    may = by_reason.pop("")
    others = [f"not of {few(skins, MOST_NAMED)} ({reason})" for reason, skins in by_reason.items()]
    quotable = ", ".join([f"of {few(may, MOST_NAMED) if may else 'none'}", *others])
    return (
        f"d33 is not to be quoted, because {d33['mean']:.3g} {d33['unit']} is the mean of the skins and no skin's own; "
        f"by its own recordings alone it may be quoted {quotable}"
    )


def _population(quantity: PooledQuantity) -> dict[str, Any]:
    populations, row, declared = quantity.populations, quantity.row, quantity.declared
    mean, spread = float(np.exp(populations.mean[row] + declared.mean())), float(populations.spread[row])
    values = np.exp(populations.of_skins[:, :, row] + declared)
    skins = [
        {"skin": skin, **_rounded(value=value, low=low, high=high)}
        for skin, value, low, high in zip(quantity.skins, *values, strict=True)
    ]
    return {
        "parameter": quantity.parameter,
        "unit": quantity.unit,
        "mean": rounded(mean),
        "sd": rounded(mean * float(np.hypot(spread, declared.std())), 3),
        "departures": [
            {"skin": skin["skin"], "value": skin["value"], "probability": round(share, 3)}
            for skin, departures in zip(skins, populations.departures, strict=True)
            if departures[REGULAR] < 1 - STATED and (share := departures.get(quantity.departure, 0.0)) > _LEAST_LISTED
        ],
        "skins": skins,
    }


def _probability_of_departures(fleet: Fleet) -> tuple[float, float]:
    """The probability of the stated departures of all skins together, and the least of that of one skin."""
    joint, least_certain = 1.0, 1.0
    for pooled in {id(quantity.populations): quantity.populations for quantity in fleet.quantities}.values():
        if pooled is fleet.quantities[0].populations or any(pooled.stated):
            joint *= pooled.joint.get(pooled.stated, 0.0)
            of_skins = zip(pooled.departures, pooled.stated, strict=True)
            least_certain = min(least_certain, *(probabilities[departure] for probabilities, departure in of_skins))
    return joint, least_certain


def _mechanisms_of_fleet(fleet: Fleet) -> list[dict[str, Any]]:
    """With the skins that have each; also a declared E or thickness that is wrong for all, or for a skin that departs
    in it."""
    present: dict[str, dict[str, float]] = {
        error: dict.fromkeys(fleet.reports, share) for error, share in fleet.p_declared.items() if share > STATED
    }
    for skin, (names, share) in fleet.sets.items():
        for mechanism in names:
            present.setdefault(mechanism, {})[skin] = share
    for skin, (error, share) in fleet.errors.items():
        present.setdefault(error, {})[skin] = share
    return [
        _mechanism(mechanism, float(np.mean(list(shares.values()))), [], {"skins": list(shares)})
        for mechanism, shares in present.items()
    ]


def _fleet_in_words(mechanisms: Sequence[Mapping[str, Any]], unexplained: Sequence[str], probability: float) -> str:
    listed_mechanisms = [
        f"{in_words([mechanism['name']])} in {', '.join(mechanism['scope']['skins'])}" for mechanism in mechanisms
    ]
    missing = "; ".join(listed_mechanisms) or in_words((NOTHING_MISSING,))
    if unexplained:
        return f"Something is missing in {', '.join(unexplained)} that no known mechanism describes; else: {missing}"
    return f"By skin: {missing} ({in_percent(probability)} probability)"


def _departure_clauses(fleet: Fleet, rows: Sequence[Mapping[str, Any]]) -> list[str]:
    ways: dict[str, list[str]] = {}
    for quantity, row in zip(fleet.quantities, rows, strict=True):
        unit = "" if row["unit"] == "-" else f" {row['unit']}"
        for departure in row["departures"]:
            others = f"{row['mean']:g} ± {row['sd']:g}"
            if np.ptp(quantity.declared) > 0:
                others = f"{quantity.expected[quantity.skins.index(departure['skin'])]:.4g} for the same declared"
            ways.setdefault(departure["skin"], []).append(
                f"in {quantity_in_words(row['parameter'])}: {departure['value']:g}{unit}, "
                f"where the others have {others} ({in_percent(departure['probability'])})"
            )
    clauses = [f"one departs, {skin}, {', or '.join(of_skin)}" for skin, of_skin in ways.items()]
    more = len(clauses) - MOST_NAMED
    clauses = [*clauses[:MOST_NAMED], *([f"{more} more depart, see the populations"] if more > 0 else [])]
    return clauses or ["none is seen to depart from the others"]


def _asides(fleet: Fleet) -> list[str]:
    orders = [
        f"of {skin}, the last that can be used speaks: {clause}" for skin, clause in fleet.orders.items() if clause
    ]
    return [*([f"nothing could be concluded of {', '.join(fleet.lacking)}"] if fleet.lacking else []), *orders]
