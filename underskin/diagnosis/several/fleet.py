"""Fleets: skins of one batch that are diagnosed together, and the report on them.

Each skin is represented by its latest usable campaign of FRFs, with the curves of its campaigns without FRFs.
`common_set` finds the set of mechanisms common to all skins; given it, each skin has it, or one that differs by a
mechanism or two, each of which is supported by that skin's own recordings. Errors of E and of the thickness are no
mechanisms here: they make a skin depart (population.py). E, thickness, d33 and the strengths of mechanisms are pooled
as populations, so that a skin with few recordings is informed by the others.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED, NOTHING_MISSING, in_words, quantity_in_words
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import parameter_slices, quadratic_of_prior
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.numbers import rounded
from underskin.diagnosis.reporting.report import SCHEMA, report, reported
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE
from underskin.diagnosis.selection.priors import SHOWS, log_prior
from underskin.diagnosis.several import together_report
from underskin.diagnosis.several.campaigns import by_frfs, curves_once, refuse_copies, with_curves
from underskin.diagnosis.several.course import Candidate, Names, benches, log_change
from underskin.diagnosis.several.population import (
    D33,
    D33_PRIOR,
    ERRORS,
    FAR,
    QUANTITIES,
    REGULAR,
    STATED,
    Batch,
    FleetSkin,
    Populations,
    Spread,
    State,
    populations,
)
from underskin.diagnosis.several.sensors import CampaignDates, date_of, in_order
from underskin.diagnosis.several.together_report import of_kinds
from underskin.errors import InvalidInput
from underskin.findings.formatting import in_percent, of_clauses
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_PRUNE_NATS = 40.0  # nats behind the best set of a skin, at most
_P_DIFFERS = 0.03  # probability that a skin differs from the others by one mechanism


@dataclass(frozen=True)
class CommonSet:
    """The most probable common set and set of each skin, with the probabilities of the latter; `probability` is that of
    all of them together. `from_other_specimens`: of each skin the log probabilities of the sets by the recordings of
    the others only. `log_evidence`: of all recordings, over all sets."""

    common: Names
    sets: tuple[Names, ...]
    probabilities: tuple[float, ...]
    probability: float
    from_other_specimens: tuple[Mapping[frozenset[str], float], ...]
    log_evidence: float


def candidate_sets(candidates: Sequence[Candidate]) -> list[frozenset[str]]:
    """The sets that are relevant for any skin, without errors of E and of the thickness."""
    names_of_skins = (names.difference(ERRORS) for candidate in candidates for names in candidate.required_sets)
    return list(dict.fromkeys((frozenset[str](), *names_of_skins)))


def with_smaller(sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
    """The sets, and those with one mechanism less, which decide whether each mechanism is supported."""
    return list(dict.fromkeys((*sets, *(names - {name} for names in sets for name in sorted(names)))))


def common_set(skins: Sequence[FleetSkin], sets: Sequence[frozenset[str]], supported: int) -> CommonSet:
    """Of skins fitted under these sets and the smaller ones; `supported` is the number of mechanisms."""
    evidence = np.array([[skin.log_evidence(names, len(skins)) for names in sets] for skin in skins])
    log_evidence = np.maximum(evidence - evidence.max(axis=1, keepdims=True), -_PRUNE_NATS)
    changes = np.array([[log_change(len(common ^ names), supported, _P_DIFFERS) for names in sets] for common in sets])
    shown = np.array([[_is_supported(skin, names, len(skins)) for names in sets] for skin in skins])
    allowed = shown[:, None] | np.eye(len(sets), dtype=bool)  # (skins, common sets, sets)
    change = np.where(allowed, changes[None], -np.inf)
    weights = change + log_evidence[:, None]
    of_skins = np.logaddexp.reduce(weights, axis=2)  # (skins, common sets)
    prior = np.array([log_prior(len(common), supported) for common in sets])
    of_all = of_skins.sum(axis=0)
    least = SHOWS + np.array(
        [
            max(
                (of_all[sets.index(names - {mechanism})] for mechanism in names if names - {mechanism} in sets),
                default=-np.inf,
            )
            for names in sets
        ]
    )
    log_common = np.where(
        of_all > least, prior + of_all, -np.inf
    )  # a mechanism supported by no skin is left to the smaller set
    share = np.exp(log_common - np.logaddexp.reduce(log_common))
    best = int(share.argmax())
    # Posterior of each skin's set, averaged over all common sets
    posterior = np.einsum("c,ncm->nm", share, np.exp(weights - of_skins[..., None]))
    chosen = weights[:, best].argmax(axis=1)
    order = skins[0].candidate.problem.lines.mechanisms.named

    def named(names: frozenset[str]) -> Names:
        return tuple(name for name in order if name in names)

    probabilities = tuple(float(posterior[number, index]) for number, index in enumerate(chosen))
    at_best = weights[np.arange(len(chosen)), best, chosen] - of_skins[:, best]
    probability = float(share[best] * np.exp(at_best.sum()))
    named_sets = tuple(named(skin.candidate.supported(sets[index])) for skin, index in zip(skins, chosen, strict=True))
    of_other_specimens = np.logaddexp.reduce((log_common - of_skins)[..., None] + change, axis=1)
    of_other_specimens -= np.logaddexp.reduce(of_other_specimens, axis=1, keepdims=True)
    from_other_specimens = tuple(dict(zip(sets, row.tolist(), strict=True)) for row in of_other_specimens)
    total = float(np.logaddexp.reduce(log_common) + evidence.max(axis=1).sum())
    return CommonSet(named(sets[best]), named_sets, probabilities, probability, from_other_specimens, total)


def _is_supported(skin: FleetSkin, names: frozenset[str], skins: int) -> bool:
    """Whether each mechanism of a set is supported by a skin's own recordings."""
    log_evidence = skin.log_evidence(names, skins)
    return all(log_evidence > skin.log_evidence(names - {name}, skins) + SHOWS for name in names)


_LEAST_SKINS_OF_STRENGTH = 3
_INFORMS = 0.5  # of a prior's precision: the least of informative recordings
_WIDEST = 10.0  # deviation of the logarithm of an unknown strength
_SPREAD = Spread(0.1, 2.0)  # deviation of its logarithm from skin to skin
_DEPARTURE_SD = 1.0  # the same of a skin that departs in it
DEPARTS = "strength"


@dataclass(frozen=True)
class Strength:
    """One parameter of a mechanism, with its unit, as a population of the skins that have the mechanism."""

    parameter: str
    unit: str
    skins: tuple[str, ...]
    population: Populations


def of_strengths(candidates: Mapping[str, Candidate], common: CommonSet) -> list[Strength]:
    """Of the positive parameters of mechanisms that at least three skins have."""
    states_by_parameter: dict[tuple[str, str], dict[str, list[State]]] = {}
    for (skin, candidate), names in zip(candidates.items(), common.sets, strict=True):
        fit = candidate.explained(frozenset(names))
        if fit is None:
            continue
        for mechanism, span in parameter_slices(fit.names, fit.best.hypothesis.lines).items():
            for index in range(span.start, span.stop):
                parameter = fit.model.parameters[index]
                likelihood = _likelihood(fit, index)
                if parameter.scale == "log" and likelihood is not None:
                    states = [
                        State(REGULAR, likelihood, np.zeros(1)),
                        State(DEPARTS, likelihood, np.array([_DEPARTURE_SD**2])),
                    ]
                    states_by_parameter.setdefault((f"{mechanism}.{parameter.name}", parameter.unit), {})[skin] = states
    batch = Batch(0.0, np.zeros(1), np.array([_WIDEST**-2]))
    return [
        Strength(name, unit, tuple(of_skins), populations(list(of_skins.values()), [batch], [_SPREAD]))
        for (name, unit), of_skins in states_by_parameter.items()
        if len(of_skins) >= _LEAST_SKINS_OF_STRENGTH
    ]


def _likelihood(fit: Explanation, index: int) -> Gaussian | None:
    """The likelihood of one fit coordinate by the recordings only, without the prior; None where they hardly inform, or
    the coordinate changes the covariance only."""
    hypothesis = fit.best.hypothesis
    if index not in hypothesis.mean_indices:
        return None
    row = hypothesis.mean_indices.index(index)
    after = 1 / float(fit.best.covariance[row, row])
    prior, centre = quadratic_of_prior(fit.model.parameters[index], float(fit.point.fit[index]))
    precision = after - prior
    if precision < _INFORMS * prior:
        return None
    return Gaussian(np.array([[precision]]), np.array([after * fit.point.fit[index] - prior * centre]), 0.0)


_MOST_LISTED = 3  # departing skins in the statement
_LEAST_LISTED = 0.1  # least probability of a listed quantity in which such a skin may depart
_UNITS = {"youngs_modulus": "MPa", "thickness": "mm", "d33": "pC/N"}


@dataclass(frozen=True)
class Fleet:
    """The usable skins, the sets of their mechanisms, their E and thickness over the declared ones and d33 (`pooled`),
    the logarithms of the declared values (skins, quantities), the probabilities that one of these is wrong for all
    skins, and the strengths of mechanisms."""

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
    """Of a fleet with this name, its campaigns' names and the result of each skin alone; `orders` are clauses on skins
    with several campaigns whose order is not known in time."""
    usable = {skin: results[skin] for skin in fleet.candidates}
    lacking = [skin for skin in results if skin not in usable]
    reports = {skin: reported(result) for skin, result in usable.items()}
    d33_of_skins = {skin: skin_report.d33 for skin, skin_report in reports.items()}
    populations = [*_populations(fleet), *(_of_strength(strength) for strength in fleet.strengths)]
    mechanisms = _mechanisms(fleet)
    departs = any(population["departures"] for population in populations)
    unlisted = {skin: candidate.unlisted_probability for skin, candidate in fleet.candidates.items()}
    unexplained = [skin for skin, share in unlisted.items() if share > STATED]
    described = (1 - P_NOT_IN_MODEL_SPACE) * float(np.prod([1 - share for share in unlisted.values()]))
    wrongly = max(fleet.declared_wrongly.values(), default=0.0)
    declared = wrongly if wrongly > STATED else 1 - sum(fleet.declared_wrongly.values())
    of_sets = fleet.common.probability * declared * described
    joint_probability, least_certain = _probability_of_departures(fleet)
    probability = 1 - described if unexplained else of_sets * joint_probability
    d33 = next(population for population in populations if population["parameter"] == D33)
    stated_mechanisms = {
        skin: {mechanism["name"] for mechanism in skin_report.document["mechanisms"]}
        for skin, skin_report in reports.items()
    }
    of_d33 = together_report.of_skins(d33["mean"], d33["unit"], d33_of_skins, _lacking(mechanisms, stated_mechanisms))
    by_kind = of_kinds(reports.items())
    contradictory = [f"in {contradiction['statement']}" for contradiction in by_kind.get("contradictions", ())]
    return {
        "schema": SCHEMA,
        "campaign": name,
        "campaigns": list(campaigns),
        "verdict": _verdict(min(of_sets, least_certain), bool(mechanisms) or departs, unexplained),
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
        "presence": [
            {"mechanisms": [mechanism["name"]], "probability": mechanism["probability"]} for mechanism in mechanisms
        ],
        "unnamed": None,
        "alternatives": [],
        "not_identifiable": together_report.not_identifiable(d33_of_skins),
        "findings": [
            {**finding, "statement": f"{skin}: {finding['statement']}"}
            for skin, skin_report in reports.items()
            for finding in skin_report.document["findings"]
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
                {"skin": skin, **{key: skin_report.document[key] for key in ("verdict", "probability")}}
                for skin, skin_report in reports.items()
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
    """The batch's mean at one skin's declared values, by parameter and skin, where the declared values differ."""
    expected = np.exp(fleet.pooled.mean + fleet.declared)
    return {
        (quantity, skin): float(expected[number, row])
        for row, quantity in enumerate(QUANTITIES.values())
        for number, skin in enumerate(fleet.candidates)
        if np.ptp(fleet.declared[:, row]) > 0
    }


def _probability_of_departures(fleet: Fleet) -> tuple[float, float]:
    """The probability of the stated departures of all skins together, and the least of that of one skin. The verdict
    uses the latter: by the former, fleets of many skins would all be ambiguous."""
    departing = [strength.population for strength in fleet.strengths if any(strength.population.stated)]
    joint_probability, least_certain = 1.0, 1.0
    for pooled in (fleet.pooled, *departing):
        joint_probability *= pooled.joint.get(pooled.stated, 0.0)
        probabilities = [
            of_skin[departure] for of_skin, departure in zip(pooled.departures, pooled.stated, strict=True)
        ]
        least_certain = min(least_certain, *probabilities)
    return joint_probability, least_certain


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
    """Of one quantity, pooled relative to declared values with these logarithms (skins,)."""
    mean, spread = float(np.exp(pooled.mean[row] + declared.mean())), float(pooled.spread[row])
    value, low, high = np.exp(pooled.of_skins[:, :, row] + declared)
    return {
        "parameter": parameter,
        "unit": unit,
        "mean": rounded(mean),
        "sd": rounded(mean * float(np.hypot(spread, declared.std())), 3),
        "departures": [
            {"skin": skin, "value": rounded(float(value[number])), "probability": round(share, 3)}
            for number, (skin, departures) in enumerate(zip(skins, pooled.departures, strict=True))
            if departures[REGULAR] < 1 - STATED and (share := departures.get(departure, 0.0)) > _LEAST_LISTED
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
    """With the skins that have each; also a declared E or thickness that is wrong for all, or for a skin that departs
    in it."""
    present: dict[str, dict[str, float]] = {
        error: dict.fromkeys(fleet.candidates, share)
        for error, share in fleet.declared_wrongly.items()
        if share > STATED
    }
    for skin, names, share in zip(fleet.candidates, fleet.common.sets, fleet.common.probabilities, strict=True):
        for mechanism in names:
            present.setdefault(mechanism, {})[skin] = share
    for skin, departures, departure in zip(fleet.candidates, fleet.pooled.departures, fleet.pooled.stated, strict=True):
        if departure in ERRORS:
            present.setdefault(departure, {})[skin] = departures[departure]
    return [
        {
            "name": mechanism,
            "probability": round(float(np.mean(list(shares.values()))), 3),
            "parameters": [],
            "explains_percent": None,
            "scope": {"skins": list(shares)},
        }
        for mechanism, shares in present.items()
    ]


def _lacking(
    mechanisms: Sequence[Mapping[str, Any]], stated_mechanisms: Mapping[str, set[str]]
) -> dict[str, list[str]]:
    """Of each skin the mechanisms that it has in the fleet's report but not in its own."""
    return {
        skin: [
            mechanism["name"]
            for mechanism in mechanisms
            if skin in mechanism["scope"]["skins"] and mechanism["name"] not in names
        ]
        for skin, names in stated_mechanisms.items()
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
    listed = [
        f"{in_words([population['name']])} in {', '.join(population['scope']['skins'])}" for population in mechanisms
    ]
    missing = "; ".join(listed) or in_words((NOTHING_MISSING,))
    verdict = f"By skin: {missing} ({in_percent(probability)} probability)"
    if unexplained:
        verdict = f"Something is missing in {', '.join(unexplained)} that no known mechanism describes; else: {missing}"
    departures: dict[str, list[str]] = {}
    for population in populations:
        for departure in population["departures"]:
            expected_value = expected.get((population["parameter"], departure["skin"]))
            others = (
                f"{population['mean']:g} ± {population['sd']:g}"
                if expected_value is None
                else f"{expected_value:.4g} for the same declared"
            )
            departures.setdefault(departure["skin"], []).append(
                f"in {quantity_in_words(population['parameter'])}: {departure['value']:g}{_unit(population['unit'])}, "
                f"where the others have {others} ({in_percent(departure['probability'])})"
            )
    clauses = [f"one departs, {skin}, {', or '.join(ways)}" for skin, ways in departures.items()][:_MOST_LISTED]
    clauses += (
        [f"{len(departures) - _MOST_LISTED} more depart, see the populations"] if len(departures) > _MOST_LISTED else []
    )
    return of_clauses([verdict], clauses or ["none is seen to depart from the others"], asides, names=names)


def _unit(label: str) -> str:
    return "" if label == "-" else f" {label}"


_LEAST_SKINS = 3
_DECLARED = (0.02, 0.01)  # deviations of ln of the batch's E and thickness about the declared ones
# Pieces of one cure and of one poled film differ by some percent; a mould sets the thickness
_FAR_FROM_DECLARED = 2.0  # common deviation of the skins, in sd, above which an error of the declared values is tried
SPREADS = (Spread(0.03, 2.0), Spread(0.01, 1.0), Spread(0.03, 2.0))


def diagnose_fleet(
    skins: Mapping[str, Sequence[Campaign]],
    table: SigmaTable,
    name: str,
    without: Collection[str] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, Any]:
    """The report (`report/1`) of a fleet, named `name`; `skins` by their ids, each with its campaigns.

    Raises InvalidInput for fewer than three skins, for one without campaigns, and for FRFs in two campaigns.
    """
    if len(skins) < _LEAST_SKINS:
        raise InvalidInput("skins", len(skins), f"must be {_LEAST_SKINS} at least, to be a population")
    refuse_copies([campaign for campaigns_of_skin in skins.values() for campaign in campaigns_of_skin])
    results: dict[str, DiagnosisResult] = {}
    seen: set[bytes] = set()
    orders: dict[str, str] = {}
    for number, (skin, campaigns) in enumerate(skins.items()):
        with_frf, of_curves = by_frfs(curves_once(campaigns, seen))
        if not with_frf:
            raise InvalidInput("skins", skin, "must have a campaign with recordings of kind frf")
        results[skin] = _latest([with_curves(frf_campaign, of_curves) for frf_campaign in with_frf], table, without)
        if len(with_frf) > 1:
            orders[skin] = CampaignDates(
                [frf_campaign.name for frf_campaign in with_frf], [date_of(frf_campaign) for frf_campaign in with_frf]
            ).order_clause()
        progress((number + 1) / (len(skins) + 1))
    campaigns_named = [campaign.name for campaigns_of_skin in skins.values() for campaign in campaigns_of_skin]
    candidates = {
        skin: Candidate(result.problem, search)
        for skin, result in results.items()
        if result.problem is not None and (search := result.search or result.few) is not None
    }
    if len(candidates) < _LEAST_SKINS:
        lacking = next(skin for skin in skins if skin not in candidates)
        return {**report(results[lacking]), "campaign": name, "campaigns": campaigns_named}
    return fleet_report(name, campaigns_named, results, _fleet(candidates), orders)


def _latest(campaigns: Sequence[Campaign], table: SigmaTable, without: Collection[str]) -> DiagnosisResult:
    """The diagnosis of the latest campaign with a result of its own, else of the latest with one together with
    others."""
    results: list[DiagnosisResult] = []
    for campaign in in_order(campaigns)[::-1]:
        results.append(diagnose(campaign, table, without=without))
        if results[-1].search is not None:
            return results[-1]
    return next((result for result in results if result.few is not None), results[0])


@dataclass(frozen=True)
class _Attempt:
    """The skins fitted about the declared values, or with an `error` of these in all skins."""

    error: str
    skins: Sequence[FleetSkin]
    common: CommonSet
    log_weight: float


def _fleet(candidates: Mapping[str, Candidate]) -> Fleet:
    """Of the usable skins."""
    usable = list(candidates.values())
    sets, bench_priors = candidate_sets(usable), benches(usable)
    supported = min(candidate.search.supported for candidate in usable)
    odds = log_prior(1, supported) - log_prior(0, supported)

    def attempt(error: str, centre: tuple[float, float], log_prior_weight: float) -> _Attempt:
        skins = [
            FleetSkin(candidate, with_smaller(sets), bench, centre)
            for candidate, bench in zip(usable, bench_priors, strict=True)
        ]
        common = common_set(skins, sets, supported)
        return _Attempt(error, skins, common, common.log_evidence + log_prior_weight)

    attempts = [attempt("", (0.0, 0.0), 0.0)]
    for row, error in enumerate(ERRORS):
        off, deviation = _off(attempts[0].skins, row, error)
        if abs(off) > _FAR_FROM_DECLARED * max(deviation, _DECLARED[row]):
            centre = (off, 0.0) if row == 0 else (0.0, off)
            occam = np.log(deviation / FAR[row]) - 0.5 * (off / FAR[row]) ** 2
            attempts.append(attempt(error, centre, odds + float(occam)))
    weights = np.array([tried.log_weight for tried in attempts])
    shares = np.exp(weights - np.logaddexp.reduce(weights))
    best = attempts[int(np.argmax(shares))]
    pooled, batches = _pooled(best, odds)
    if best.error:
        _, batches = _pooled(attempts[0], odds)
    wrongly = declared_wrongly(dict(zip((tried.error for tried in attempts), shares.tolist(), strict=True)), batches)
    declared = np.array([skin.declared for skin in best.skins])
    return Fleet(candidates, best.common, pooled, declared, wrongly, of_strengths(candidates, best.common))


def _pooled(attempt: _Attempt, odds: float) -> tuple[Populations, dict[str, float]]:
    """The populations by one attempt, and the probability of each error (or none) of the values declared for all
    skins."""
    states = [
        skin.states(log_shares)
        for skin, log_shares in zip(attempt.skins, attempt.common.from_other_specimens, strict=True)
    ]
    batches, errors = _batches(attempt.skins, odds)
    if attempt.error:
        batches, errors = [batches[errors.index(attempt.error)]], [attempt.error]
    pooled = populations(states, batches, SPREADS)
    return pooled, dict(zip(errors, pooled.batches.tolist(), strict=True))


def declared_wrongly(attempts: Mapping[str, float], batches: Mapping[str, float]) -> dict[str, float]:
    """The probability of each error of the values declared for all skins: `attempts` are the probabilities of the
    attempts, by error, `batches` those of each error in the attempt without one."""
    errors = [error for error in dict.fromkeys((*batches, *attempts)) if error]
    return {error: attempts[""] * batches.get(error, 0.0) + attempts.get(error, 0.0) for error in errors}


def _off(skins: Sequence[FleetSkin], row: int, error: str) -> tuple[float, float]:
    """The mean deviation of ln of a quantity from the declared values, if it is the same in all skins, and its standard
    deviation.
    """
    departures = [skin.departing(error) for skin in skins if error in skin.errors]
    means, variances = (
        np.array([departure[part] for departure in departures if departure is not None]) for part in (0, 1)
    )
    if len(means) < len(skins):
        return 0.0, 0.0
    precision = 1 / (variances + SPREADS[row].usual ** 2)
    return float(precision @ means / precision.sum()), float(precision.sum() ** -0.5)


def _batches(skins: Sequence[FleetSkin], odds: float) -> tuple[list[Batch], list[str]]:
    """The priors of the batch's quantities, and the error of the values declared for all skins in each, with its
    odds."""
    usual, centre = np.array([*_DECLARED, D33_PRIOR[1]]), np.array([0.0, 0.0, D33_PRIOR[0]])
    batches, errors = [Batch(0.0, centre, usual**-2)], [""]
    for row, error in enumerate(ERRORS):
        if all(error in skin.errors for skin in skins):
            loose = usual.copy()
            loose[row] = FAR[row]
            batches.append(Batch(odds, centre, loose**-2))
            errors.append(error)
    return batches, errors
