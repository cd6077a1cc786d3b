"""The report of skins of one make that were diagnosed as a fleet."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words, quantity_in_words
from underskin.diagnosis.reporting.numbers import rounded
from underskin.diagnosis.reporting.report import SCHEMA, DiagnosisResult, reported
from underskin.diagnosis.reporting.sentences import of_clauses
from underskin.diagnosis.selection.answers import UNTHOUGHT
from underskin.diagnosis.several import quoted
from underskin.diagnosis.several.common_set import CommonSet
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.kinds import of_kinds
from underskin.diagnosis.several.population import REGULAR, STATED, Populations
from underskin.diagnosis.several.skin import D33, ERRORS, QUANTITIES
from underskin.diagnosis.several.strengths import DEPARTS, Strength
from underskin.findings.formatting import in_percent
from underskin.units import Floats

_MOST_TOLD = 3  # skins that depart in the statement
_WORTH_SAYING = 0.1  # probability from which on a quantity is listed in which such a skin may depart
_UNITS = {"youngs_modulus": "MPa", "thickness": "mm", "d33": "pC/N"}


@dataclass(frozen=True)
class Fleet:
    """What was found: the usable skins, the sets of their mechanisms, their E and thickness over the declared ones and
    d33, the logarithms of the declared ones (skins, quantities), the probabilities that one of these is declared
    wrongly for all skins, and the strengths of mechanisms."""

    candidates: Mapping[str, Candidate]
    common: CommonSet
    pooled: Populations
    declared: Floats
    declared_wrongly: Mapping[str, float]
    strengths: Sequence[Strength]


def fleet_report(
    name: str,
    campaigns: Sequence[str],
    results: Mapping[str, DiagnosisResult],
    fleet: Fleet,
    orders: Mapping[str, str],
) -> dict[str, Any]:
    """Of a fleet of this name, its campaigns' names, the result of each skin alone, and of skins with several campaigns
    what is said where their order is not one of time."""
    usable = {skin: results[skin] for skin in fleet.candidates}
    lacking = [skin for skin in results if skin not in usable]
    reports = {skin: reported(result) for skin, result in usable.items()}
    own_d33 = {skin: own.d33 for skin, own in reports.items()}
    populations = [*_populations(fleet), *(_of_strength(strength) for strength in fleet.strengths)]
    mechanisms = _mechanisms(fleet)
    departs = any(entry["departures"] for entry in populations)
    undescribed = {skin: one.undescribed for skin, one in fleet.candidates.items()}
    unexplained = [skin for skin, share in undescribed.items() if share > STATED]
    described = (1 - UNTHOUGHT) * float(np.prod([1 - share for share in undescribed.values()]))
    wrongly = max(fleet.declared_wrongly.values(), default=0.0)
    declared = wrongly if wrongly > STATED else 1 - sum(fleet.declared_wrongly.values())
    of_sets = fleet.common.probability * declared * described
    agreed, settled = _departures_stated(fleet)
    probability = 1 - described if unexplained else of_sets * agreed
    d33 = next(entry for entry in populations if entry["parameter"] == D33)
    stated = {skin: {one["name"] for one in own.document["mechanisms"]} for skin, own in reports.items()}
    of_d33 = quoted.of_skins(d33["mean"], d33["unit"], own_d33, _lacking(mechanisms, stated))
    by_kind = of_kinds(reports.items())
    contradictory = [f"in {entry['statement']}" for entry in by_kind.get("contradictions", ())]
    return {
        "schema": SCHEMA,
        "campaign": name,
        "campaigns": list(campaigns),
        "verdict": _verdict(min(of_sets, settled), bool(mechanisms) or departs, unexplained),
        "probability": round(probability, 3),
        "statement": _statement(
            probability,
            mechanisms,
            unexplained,
            [*contradictory, *_asides(lacking, orders), of_d33],
            populations,
            _expected(fleet),
            [*results, *campaigns],
        ),
        "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "See each skin's own diagnosis."},
        "mechanisms": mechanisms,
        "presence": [{"mechanisms": [entry["name"]], "probability": entry["probability"]} for entry in mechanisms],
        "unnamed": None,
        "alternatives": [],
        "not_identifiable": quoted.not_identifiable(own_d33),
        "findings": [
            {**finding, "statement": f"{skin}: {finding['statement']}"}
            for skin, own in reports.items()
            for finding in own.document["findings"]
        ],
        **by_kind,
        "fit": None,
        "power": [],
        "population": populations,
        "d33": {"name": D33, "unit": d33["unit"], "value": d33["mean"], "quotable": False, "per_skin": d33["skins"]},
        "next_experiment": None,
        "provenance": {
            **next(iter(usable.values())).provenance,
            "each": [
                {"skin": skin, **{key: own.document[key] for key in ("verdict", "probability")}}
                for skin, own in reports.items()
            ],
        },
    }


def _populations(fleet: Fleet) -> list[dict[str, Any]]:
    """Of d33, E and the thickness."""
    pooled, skins = fleet.pooled, tuple(fleet.candidates)
    rows = {quantity: (row, departure) for row, (departure, quantity) in enumerate(QUANTITIES.items())}
    return [
        _population(quantity, _UNITS[quantity], skins, pooled, *rows[quantity], fleet.declared[:, rows[quantity][0]])
        for quantity in (D33, *(quantity for quantity in rows if quantity != D33))
    ]


def _expected(fleet: Fleet) -> dict[tuple[str, str], float]:
    """What the others would have if they were declared as one skin is, by parameter and skin, where they differ."""
    each = np.exp(fleet.pooled.mean + fleet.declared)
    return {
        (quantity, skin): float(each[number, row])
        for row, quantity in enumerate(QUANTITIES.values())
        for number, skin in enumerate(fleet.candidates)
        if np.ptp(fleet.declared[:, row]) > 0
    }


def _departures_stated(fleet: Fleet) -> tuple[float, float]:
    """The probability of what is stated of all skins' departures, and the least of that of one skin: were the first to
    decide the verdict, fleets of many skins would all be ambiguous."""
    departing = [one.population for one in fleet.strengths if any(one.population.stated)]
    agreed, settled = 1.0, 1.0
    for pooled in (fleet.pooled, *departing):
        agreed *= pooled.together.get(pooled.stated, 0.0)
        each = [own[departs] for own, departs in zip(pooled.departs, pooled.stated, strict=True)]
        settled = min(settled, *each)
    return agreed, settled


def _of_strength(strength: Strength) -> dict[str, Any]:
    return _population(
        strength.parameter,
        strength.unit,
        strength.skins,
        strength.population,
        0,
        DEPARTS,
        np.zeros(len(strength.skins)),
    )


def _population(
    parameter: str, unit: str, skins: Sequence[str], pooled: Populations, row: int, departure: str, declared: Floats
) -> dict[str, Any]:
    """Of one quantity, pooled over one that is declared, of which these are the logarithms (skins,)."""
    mean, spread = float(np.exp(pooled.mean[row] + declared.mean())), float(pooled.spread[row])
    value, low, high = np.exp(pooled.of_skins[:, :, row] + declared)
    return {
        "parameter": parameter,
        "unit": unit,
        "mean": rounded(mean),
        "sd": rounded(mean * float(np.hypot(spread, declared.std())), 3),
        "departures": [
            {"skin": skin, "value": rounded(float(value[number])), "probability": round(share, 3)}
            for number, (skin, own) in enumerate(zip(skins, pooled.departs, strict=True))
            if own[REGULAR] < 1 - STATED and (share := own.get(departure, 0.0)) > _WORTH_SAYING
        ],
        "skins": [
            {
                "skin": skin,
                "value": rounded(float(value[number])),
                "low": rounded(float(low[number])),
                "high": rounded(float(high[number])),
            }
            for number, skin in enumerate(skins)
        ],
    }


def _mechanisms(fleet: Fleet) -> list[dict[str, Any]]:
    """With the skins that have each; a declared E or thickness that is wrong for all, or for one that departs in it."""
    present: dict[str, dict[str, float]] = {
        error: dict.fromkeys(fleet.candidates, share)
        for error, share in fleet.declared_wrongly.items()
        if share > STATED
    }
    for skin, names, share in zip(fleet.candidates, fleet.common.sets, fleet.common.each, strict=True):
        for mechanism in names:
            present.setdefault(mechanism, {})[skin] = share
    for skin, own, departs in zip(fleet.candidates, fleet.pooled.departs, fleet.pooled.stated, strict=True):
        if departs in ERRORS:
            present.setdefault(departs, {})[skin] = own[departs]
    return [
        {
            "name": mechanism,
            "probability": round(float(np.mean(list(each.values()))), 3),
            "parameters": [],
            "explains_percent": None,
            "scope": {"skins": list(each)},
        }
        for mechanism, each in present.items()
    ]


def _lacking(mechanisms: Sequence[Mapping[str, Any]], stated: Mapping[str, set[str]]) -> dict[str, list[str]]:
    """Of each skin the mechanisms that it has by the fleet's report and not by its own."""
    return {
        skin: [one["name"] for one in mechanisms if skin in one["scope"]["skins"] and one["name"] not in own]
        for skin, own in stated.items()
    }


def _verdict(probability: float, anything: bool, unexplained: Sequence[str]) -> str:
    """By the probability of what is stated of the least certain skin."""
    if unexplained:
        return "unexplained"
    if probability < EXPLAINED:
        return "ambiguous"
    return "explained" if anything else "no_mismatch"


def _asides(lacking: Sequence[str], orders: Mapping[str, str]) -> list[str]:
    unknown = [f"nothing could be told of {', '.join(lacking)}"] if lacking else []
    return unknown + [
        f"of {skin}, the last that can be used speaks: {clause}" for skin, clause in orders.items() if clause
    ]


def _statement(
    probability: float,
    mechanisms: Sequence[Mapping[str, Any]],
    unexplained: Sequence[str],
    asides: Sequence[str],
    populations: Sequence[Mapping[str, Any]],
    expected: Mapping[tuple[str, str], float],
    names: Sequence[str],
) -> str:
    each = [f"{in_words([entry['name']])} in {', '.join(entry['scope']['skins'])}" for entry in mechanisms]
    missing = "; ".join(each) or in_words((NOTHING_MISSING,))
    verdict = f"By skin: {missing} ({in_percent(probability)} probability)"
    if unexplained:
        verdict = f"Something is missing in {', '.join(unexplained)} that no known mechanism describes; else: {missing}"
    departures: dict[str, list[str]] = {}
    for entry in populations:
        for one in entry["departures"]:
            middle = expected.get((entry["parameter"], one["skin"]))
            others = f"{entry['mean']:g} ± {entry['sd']:g}" if middle is None else f"{middle:.4g} for the same declared"
            departures.setdefault(one["skin"], []).append(
                f"in {quantity_in_words(entry['parameter'])}: {one['value']:g}{_unit(entry['unit'])}, where the others "
                f"have {others} ({in_percent(one['probability'])})"
            )
    told = [f"one departs, {skin}, {', or '.join(ways)}" for skin, ways in departures.items()][:_MOST_TOLD]
    told += [f"{len(departures) - _MOST_TOLD} more depart, see the populations"] if len(departures) > _MOST_TOLD else []
    return of_clauses([verdict], told or ["none is seen to depart from the others"], asides, names=names)


def _unit(label: str) -> str:
    return "" if label == "-" else f" {label}"
