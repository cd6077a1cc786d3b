"""Skins of one make: their moduli, d33 and the strengths of their mechanisms as populations, and which skin departs.

Each skin is diagnosed from its own campaigns, together where there are several; what each says of a quantity is pooled
(population.py), so that a skin of which little was recorded leans on its sisters.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.numbers import parameter, place_of, rounded
from underskin.diagnosis.reporting.report import SCHEMA, DiagnosisResult, report
from underskin.diagnosis.several.campaigns import in_order
from underskin.diagnosis.several.population import population
from underskin.errors import InvalidInput
from underskin.findings.formatting import in_percent
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

_LEAST_SKINS = 3
_QUANTILE = float(ndtri(0.975))
_STATED = 0.5  # probability of a departure that is listed
_MODULUS_ERROR = "modulus_error"


@dataclass(frozen=True)
class _Said:
    """What one skin says of one quantity: the logarithm, and its standard deviation."""

    skin: str
    log_value: float
    deviation: float


def diagnose_fleet(
    skins: Mapping[str, Sequence[Campaign]],
    table: SigmaTable,
    name: str,
    without: Collection[str] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, Any]:
    """The report (`report/1`) of a fleet, named `name`; `skins` by their ids, each with its campaigns.

    Raises InvalidInput for fewer than three skins, and for one without campaigns.
    """
    if len(skins) < _LEAST_SKINS:
        raise InvalidInput("skins", len(skins), f"must be {_LEAST_SKINS} at least, to be a population")
    results: dict[str, list[DiagnosisResult]] = {}
    for number, (skin, campaigns) in enumerate(skins.items()):
        if not campaigns:
            raise InvalidInput("skins", skin, "must have a campaign")
        results[skin] = [diagnose(campaign, table, without=without) for campaign in in_order(campaigns)]
        progress((number + 1) / (len(skins) + 1))
    usable = {skin: last for skin, own in results.items() if (last := _last(own)) is not None}
    reports = {skin: report(result) for skin, result in usable.items()}
    lacking = [skin for skin in skins if skin not in usable]
    populations = [
        entry for entry in (_of_d33(results), _of_modulus(usable), *_of_strengths(usable)) if entry is not None
    ]
    return _document(name, skins, reports, lacking, populations, next(iter(results.values()))[-1])


def _last(results: Sequence[DiagnosisResult]) -> DiagnosisResult | None:
    """The latest that says anything."""
    return next((result for result in results[::-1] if result.search is not None), None)


def _of_d33(results: Mapping[str, Sequence[DiagnosisResult]]) -> dict[str, Any] | None:
    said = []
    for skin, own in results.items():
        each = [_leading(result) for result in own if result.search is not None]
        values = [_logarithm(explanation, "d33") for explanation in each if explanation is not None]
        if values:
            weight = np.array([1 / deviation**2 for _, deviation in values])
            mean = float(weight @ np.array([value for value, _ in values]) / weight.sum())
            said.append(_Said(skin, mean, float(weight.sum() ** -0.5)))
    return _population("d33", "pC/N", said)


def _of_modulus(usable: Mapping[str, DiagnosisResult]) -> dict[str, Any] | None:
    """E where the modulus is free beside the leading answer."""
    said = []
    for skin, result in usable.items():
        explanation = _leading(result)
        problem = result.problem
        if explanation is None or problem is None or result.search is None:
            continue
        declared = problem.lines.campaign.skin.youngs_modulus_mpa
        if declared is None or _MODULUS_ERROR in result.search.unsupported:
            continue
        free = _with_modulus(problem, explanation)
        if free is None:
            continue
        place = own_places(free.names, free.best.hypothesis.lines)[_MODULUS_ERROR].start
        value, deviation = _of_place(free, place)
        said.append(_Said(skin, value + float(np.log(declared)), deviation))
    return _population("youngs_modulus", "MPa", said)


def _with_modulus(problem: FittingProblem, explanation: Explanation) -> Explanation | None:
    if _MODULUS_ERROR in explanation.names:
        return explanation
    names = {*explanation.names, _MODULUS_ERROR}
    catalogue = problem.lines.mechanisms.named
    if any(name not in catalogue for name in names):
        return None
    (found,) = problem.explain([Request(tuple(name for name in catalogue if name in names))])
    return found


def _of_strengths(usable: Mapping[str, DiagnosisResult]) -> list[dict[str, Any] | None]:
    """Of the positive parameters of mechanisms that at least three skins have."""
    said: dict[tuple[str, str, str], list[_Said]] = {}
    for skin, result in usable.items():
        explanation = _leading(result)
        if explanation is None:
            continue
        for mechanism, places in own_places(explanation.names, explanation.best.hypothesis.lines).items():
            for place in range(places.start, places.stop):
                entry = explanation.model.parameters[place]
                if entry.scale == "log" and not entry.moves_covariance and mechanism != _MODULUS_ERROR:
                    key = (mechanism, entry.name, entry.unit)
                    said.setdefault(key, []).append(_Said(skin, *_of_place(explanation, place)))
    return [
        _population(f"{mechanism}.{name}", unit, own)
        for (mechanism, name, unit), own in said.items()
        if len(own) >= _LEAST_SKINS
    ]


def _leading(result: DiagnosisResult) -> Explanation | None:
    return None if result.search is None else result.search.answers[0].explanation


def _logarithm(explanation: Explanation, name: str) -> tuple[float, float]:
    return _of_place(explanation, place_of(explanation, name))


def _of_place(explanation: Explanation, place: int) -> tuple[float, float]:
    """Mean and standard deviation of a parameter on a logarithmic scale."""
    stated = parameter(explanation, place)
    return float(np.log(stated["value"])), float(np.log(stated["high"] / stated["low"])) / (2 * _QUANTILE)


def _population(name: str, unit: str, said: Sequence[_Said]) -> dict[str, Any] | None:
    if len(said) < _LEAST_SKINS:
        return None
    found = population(np.array([one.log_value for one in said]), np.array([max(one.deviation, 1e-4) for one in said]))
    mean = float(np.exp(found.mean))
    return {
        "parameter": name,
        "unit": unit,
        "mean": rounded(mean),
        "sd": rounded(mean * found.spread, 3),
        "departures": [
            {"skin": one.skin, "value": rounded(float(np.exp(one.log_value))), "probability": round(float(share), 3)}
            for one, share in zip(said, found.departs, strict=True)
            if share > _STATED
        ],
        "skins": [
            {
                "skin": one.skin,
                "value": rounded(float(np.exp(value))),
                "low": rounded(float(np.exp(value - _QUANTILE * deviation))),
                "high": rounded(float(np.exp(value + _QUANTILE * deviation))),
            }
            for one, value, deviation in zip(said, found.value, found.deviation, strict=True)
        ],
    }


def _document(
    name: str,
    skins: Mapping[str, Sequence[Campaign]],
    reports: Mapping[str, Mapping[str, Any]],
    lacking: Sequence[str],
    populations: Sequence[Mapping[str, Any]],
    first: DiagnosisResult,
) -> dict[str, Any]:
    by_mechanism: dict[str, list[str]] = {}
    for skin, own in reports.items():
        for entry in own["mechanisms"]:
            by_mechanism.setdefault(entry["name"], []).append(skin)
    departures = [(entry, one) for entry in populations for one in entry["departures"]]
    unexplained = [skin for skin, own in reports.items() if own["verdict"] == "unexplained"]
    probability = float(np.prod([own["probability"] for own in reports.values()])) if reports else 1.0
    verdict = _verdict(probability, bool(by_mechanism or departures), unexplained, bool(reports))
    mechanisms: list[dict[str, Any]] = [
        {
            "name": mechanism,
            "probability": round(float(np.mean([_present(reports[skin], mechanism) for skin in where])), 3),
            "parameters": [],
            "explains_percent": None,
            "scope": {"skins": where},
        }
        for mechanism, where in by_mechanism.items()
    ]
    d33 = next((entry for entry in populations if entry["parameter"] == "d33"), None)
    return {
        "schema": SCHEMA,
        "campaign": name,
        "campaigns": [campaign.name for own in skins.values() for campaign in own],
        "verdict": verdict,
        "probability": round(probability, 3),
        "statement": _statement(verdict, probability, by_mechanism, departures, unexplained, lacking, populations),
        "location": {"axes": [], "region": {}, "effect_percent": None, "statement": "See each skin's own diagnosis."},
        "mechanisms": mechanisms,
        "presence": [{"mechanisms": [entry["name"]], "probability": entry["probability"]} for entry in mechanisms],
        "unnamed": None,
        "alternatives": [],
        "not_identifiable": [],
        "findings": [
            {**finding, "statement": f"{skin}: {finding['statement']}"}
            for skin, own in reports.items()
            for finding in own["findings"]
        ],
        "fit": None,
        "power": [],
        "population": list(populations),
        "d33": None
        if d33 is None
        else {"name": "d33", "unit": "pC/N", "value": d33["mean"], "quotable": False, "per_skin": d33["skins"]},
        "next_experiment": None,
        "provenance": {
            **first.provenance,
            "each": [
                {"skin": skin, "verdict": own["verdict"], "probability": own["probability"]}
                for skin, own in reports.items()
            ],
        },
    }


def _present(own: Mapping[str, Any], mechanism: str) -> float:
    return float(next(entry["probability"] for entry in own["mechanisms"] if entry["name"] == mechanism))


def _verdict(probability: float, anything: bool, unexplained: Sequence[str], usable: bool) -> str:
    if not usable:
        return "insufficient_data"
    if unexplained:
        return "unexplained"
    if probability < EXPLAINED:
        return "ambiguous"
    return "explained" if anything else "no_mismatch"


def _statement(
    verdict: str,
    probability: float,
    by_mechanism: Mapping[str, Sequence[str]],
    departures: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]],
    unexplained: Sequence[str],
    lacking: Sequence[str],
    populations: Sequence[Mapping[str, Any]],
) -> str:
    if verdict == "insufficient_data":
        return "The recordings cannot tell anything: none of these skins has recordings that can be used."
    each = [f"{in_words([name])} in {', '.join(where)}" for name, where in by_mechanism.items()]
    missing = "; ".join(each) or in_words((NOTHING_MISSING,))
    parts = [f"By skin: {missing} ({in_percent(probability)} that all of it is right)."]
    if unexplained:
        parts[0] = (
            f"Something is missing in {', '.join(unexplained)} that no known mechanism describes; else: {missing}."
        )
    parts += [
        f"{one['skin']} departs in {entry['parameter'].replace('_', ' ')}: {one['value']:g} {entry['unit']}, where the "
        f"others have {entry['mean']:g} ± {entry['sd']:g} ({in_percent(one['probability'])})."
        for entry, one in departures
    ]
    if not departures and populations:
        parts.append("No skin departs from the others.")
    if lacking:
        parts.append(f"Nothing could be told of {', '.join(lacking)}.")
    return " ".join(parts)
