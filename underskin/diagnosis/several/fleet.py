"""Skins of one make: their moduli, d33 and the strengths of their mechanisms as populations, and which skin departs.

Each skin speaks by its latest campaign that can be used. The set of mechanisms that all have in common is found over
all skins (common_set.py), and what each says of a quantity is pooled (population.py), so that a skin of which little
was recorded leans on its sisters.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import curvature_of_prior, own_places
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.numbers import SDS_OF_95, place_of, rounded
from underskin.diagnosis.reporting.report import SCHEMA, DiagnosisResult, report
from underskin.diagnosis.reporting.sentences import of_clauses
from underskin.diagnosis.selection.answers import UNTHOUGHT
from underskin.diagnosis.several.campaigns import refuse_copies
from underskin.diagnosis.several.common_set import CommonSet, common_set
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.dates import in_order
from underskin.diagnosis.several.population import STATED, without_departing
from underskin.errors import InvalidInput
from underskin.findings.formatting import in_percent
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

_LEAST_SKINS = 3
_MOST_TOLD = 3  # departures in the statement
_MODULUS_ERROR = "modulus_error"
_INFORMS = 0.5  # of a prior's precision: what recordings must say at least to count


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

    Raises InvalidInput for fewer than three skins, for one without campaigns, and for recordings in two campaigns.
    """
    if len(skins) < _LEAST_SKINS:
        raise InvalidInput("skins", len(skins), f"must be {_LEAST_SKINS} at least, to be a population")
    refuse_copies([campaign for own in skins.values() for campaign in own])
    results: dict[str, DiagnosisResult] = {}
    for number, (skin, campaigns) in enumerate(skins.items()):
        with_frf = [one for one in campaigns if any(isinstance(entry, FrfRecording) for entry in one.recordings)]
        if not with_frf:
            raise InvalidInput("skins", skin, "must have a campaign with recordings of kind frf")
        results[skin] = _latest(with_frf, table, without)
        progress((number + 1) / (len(skins) + 1))
    usable = {skin: result for skin, result in results.items() if result.search is not None}
    lacking = [skin for skin in skins if skin not in usable]
    candidates = {
        skin: Candidate(result.problem, result.search)
        for skin, result in usable.items()
        if result.problem is not None and result.search is not None
    }
    if not candidates:
        return {**report(next(iter(results.values()))), "campaign": name, "campaigns": _names(skins)}
    found = common_set(list(candidates.values()), min(one.search.supported for one in candidates.values()))
    fits = {
        skin: fit
        for (skin, candidate), names in zip(candidates.items(), found.sets, strict=True)
        if (fit := candidate.explained(frozenset(names))) is not None
    }
    populations = [
        entry for entry in (_of_d33(fits), _of_modulus(candidates, fits), *_of_strengths(fits)) if entry is not None
    ]
    undescribed = {skin: one.undescribed for skin, one in candidates.items()}
    return _document(name, skins, usable, found, undescribed, lacking, populations)


def _names(skins: Mapping[str, Sequence[Campaign]]) -> list[str]:
    return [campaign.name for own in skins.values() for campaign in own]


def _latest(campaigns: Sequence[Campaign], table: SigmaTable, without: Collection[str]) -> DiagnosisResult:
    """The diagnosis of the latest campaign that says anything, else of the first."""
    for campaign in in_order(campaigns)[::-1]:
        result = diagnose(campaign, table, without=without)
        if result.search is not None:
            break
    return result


def _of_d33(fits: Mapping[str, Explanation]) -> dict[str, Any] | None:
    each = {skin: _of_place(fit, place_of(fit, "d33")) for skin, fit in fits.items()}
    return _population("d33", "pC/N", [_Said(skin, *found) for skin, found in each.items() if found is not None])


def _of_modulus(candidates: Mapping[str, Candidate], fits: Mapping[str, Explanation]) -> dict[str, Any] | None:
    """E where the modulus is free beside each skin's set."""
    said = []
    for skin, fit in fits.items():
        problem = candidates[skin].problem
        declared = problem.lines.campaign.skin.youngs_modulus_mpa
        free = None if declared is None else _with_modulus(problem, fit)
        if declared is None or free is None or _MODULUS_ERROR in candidates[skin].search.unsupported:
            continue
        place = own_places(free.names, free.best.hypothesis.lines)[_MODULUS_ERROR].start
        found = _of_place(free, place)
        if found is not None:
            said.append(_Said(skin, found[0] + float(np.log(declared)), found[1]))
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


def _of_strengths(fits: Mapping[str, Explanation]) -> list[dict[str, Any] | None]:
    """Of the positive parameters of mechanisms that at least three skins have."""
    said: dict[tuple[str, str, str], list[_Said]] = {}
    for skin, fit in fits.items():
        for mechanism, places in own_places(fit.names, fit.best.hypothesis.lines).items():
            for place in range(places.start, places.stop):
                entry = fit.model.parameters[place]
                if entry.scale != "log" or entry.moves_covariance or mechanism == _MODULUS_ERROR:
                    continue
                found = _of_place(fit, place)
                if found is not None:
                    key = (mechanism, entry.name, entry.unit)
                    said.setdefault(key, []).append(_Said(skin, *found))
    return [_population(f"{mechanism}.{name}", unit, own) for (mechanism, name, unit), own in said.items()]


def _of_place(explanation: Explanation, place: int) -> tuple[float, float] | None:
    """Mean and standard deviation of a parameter on a logarithmic scale by the recordings alone, the prior taken out;
    None where they say next to nothing."""
    hypothesis = explanation.best.hypothesis
    row = hypothesis.mean_places.index(place)
    after = 1 / float(explanation.best.covariance[row, row])
    prior, centre = curvature_of_prior(explanation.model.parameters[place])
    precision = after - prior
    if precision < _INFORMS * prior:
        return None
    mean = (after * float(explanation.point.fit[place]) - prior * centre) / precision
    return float(mean), float(precision**-0.5)


def _population(name: str, unit: str, said: Sequence[_Said]) -> dict[str, Any] | None:
    if len(said) < _LEAST_SKINS:
        return None
    values = np.array([one.log_value for one in said])
    deviations = np.array([max(one.deviation, 1e-4) for one in said])
    found = without_departing(values, deviations)
    mean = float(np.exp(found.mean))
    return {
        "parameter": name,
        "unit": unit,
        "mean": rounded(mean),
        "sd": rounded(mean * found.spread, 3),
        "departures": [
            {"skin": one.skin, "value": rounded(float(np.exp(one.log_value))), "probability": round(float(share), 3)}
            for one, share in zip(said, found.departs, strict=True)
            if share > STATED
        ],
        "skins": [
            {
                "skin": one.skin,
                "value": rounded(float(np.exp(value))),
                "low": rounded(float(np.exp(value - SDS_OF_95 * deviation))),
                "high": rounded(float(np.exp(value + SDS_OF_95 * deviation))),
            }
            for one, value, deviation in zip(said, found.value, found.deviation, strict=True)
        ],
    }


def _document(
    name: str,
    skins: Mapping[str, Sequence[Campaign]],
    usable: Mapping[str, DiagnosisResult],
    found: CommonSet,
    undescribed: Mapping[str, float],
    lacking: Sequence[str],
    populations: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    reports = {skin: report(result) for skin, result in usable.items()}
    by_mechanism: dict[str, list[str]] = {}
    present: dict[str, list[float]] = {}
    for skin, names, share in zip(usable, found.sets, found.each, strict=True):
        for mechanism in names:
            by_mechanism.setdefault(mechanism, []).append(skin)
            present.setdefault(mechanism, []).append(share)
    departures = [(entry, one) for entry in populations for one in entry["departures"]]
    unexplained = [skin for skin, share in undescribed.items() if share > 0.5]
    described = (1 - UNTHOUGHT) * float(np.prod([1 - share for share in undescribed.values()]))
    probability = 1 - described if unexplained else found.probability * described
    verdict = _verdict(probability, bool(by_mechanism or departures), unexplained)
    mechanisms: list[dict[str, Any]] = [
        {
            "name": mechanism,
            "probability": round(float(np.mean(present[mechanism])), 3),
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
        "campaigns": _names(skins),
        "verdict": verdict,
        "probability": round(probability, 3),
        "statement": _statement(probability, by_mechanism, departures, unexplained, lacking, populations),
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
            **next(iter(usable.values())).provenance,
            "each": [
                {"skin": skin, "verdict": own["verdict"], "probability": own["probability"]}
                for skin, own in reports.items()
            ],
        },
    }


def _verdict(probability: float, anything: bool, unexplained: Sequence[str]) -> str:
    if unexplained:
        return "unexplained"
    if probability < EXPLAINED:
        return "ambiguous"
    return "explained" if anything else "no_mismatch"


def _statement(
    probability: float,
    by_mechanism: Mapping[str, Sequence[str]],
    departures: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]],
    unexplained: Sequence[str],
    lacking: Sequence[str],
    populations: Sequence[Mapping[str, Any]],
) -> str:
    each = [f"{in_words([name])} in {', '.join(where)}" for name, where in by_mechanism.items()]
    missing = ", ".join(each) or in_words((NOTHING_MISSING,))
    verdict = f"by skin: {missing} ({in_percent(probability)} probability)"
    if unexplained:
        verdict = f"something is missing in {', '.join(unexplained)} that no known mechanism describes; else: {missing}"
    departing = [
        f"{entry['parameter'].replace('_', ' ')} of {one['skin']} departs: {one['value']:g} {entry['unit']}, where the "
        f"others have {entry['mean']:g} ± {entry['sd']:g} ({in_percent(one['probability'])})"
        for entry, one in departures[:_MOST_TOLD]
    ]
    if len(departures) > _MOST_TOLD:
        departing.append(f"{len(departures) - _MOST_TOLD} further departures are listed by quantity")
    if not departures and populations:
        departing = ["none is seen to depart from the others"]
    untold = f"nothing could be told of {', '.join(lacking)}" if lacking else ""
    return of_clauses([verdict], departing, [untold])
