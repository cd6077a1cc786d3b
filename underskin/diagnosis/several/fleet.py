"""Fleets: skins of one batch that are diagnosed together.

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

from underskin.diagnosis.inference.explanation import PRUNE_NATS
from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.report import report, reported
from underskin.diagnosis.selection.priors import SHOWS, log_prior
from underskin.diagnosis.several.campaigns import by_frfs, curves_once, refuse_copies, with_curves
from underskin.diagnosis.several.histories import CampaignFits, Names, SharedParameters, log_change, p_described
from underskin.diagnosis.several.joint_report import Fleet, PooledQuantity, fleet_document
from underskin.diagnosis.several.population import (
    DEPARTURES,
    ERRORS,
    FAR_SDS,
    LOG_D33_PC_PER_N,
    QUANTITIES,
    REGULAR,
    Batch,
    FleetSkin,
    Populations,
    Spread,
    State,
    benches,
    populations,
)
from underskin.diagnosis.several.sensors import CampaignDates
from underskin.diagnosis.several.sessions import by_session
from underskin.errors import InvalidInput
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

_LEAST_SKINS = 3  # of a population
_P_DIFFERS = 0.03  # probability that a skin differs from the others by one mechanism
# Of the logarithm of a strength: its spread from skin to skin; sd of its mean, and of a skin that departs in it
_STRENGTH, _STRENGTH_SD, _DEPARTURE_SD = Spread(0.1, 2.0), 10.0, 1.0


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
    all_campaigns = [campaign for campaigns in skins.values() for campaign in campaigns]
    refuse_copies(all_campaigns)
    results: dict[str, DiagnosisResult] = {}
    seen: set[bytes] = set()
    orders: dict[str, str] = {}
    for number, (skin, campaigns) in enumerate(skins.items()):
        with_frf, of_curves = by_frfs(curves_once(campaigns, seen))
        if not with_frf:
            raise InvalidInput("skins", skin, "must have a campaign with recordings of kind frf")
        sessions = by_session(with_frf)
        results[skin] = _latest([with_curves(campaign, of_curves) for campaign in sessions], table, without)
        if len(sessions) > 1:
            orders[skin] = CampaignDates.of(sessions).order_clause()
        progress((number + 1) / (len(skins) + 1))
    names = [campaign.name for campaign in all_campaigns]
    usable = {skin: result for skin, result in results.items() if result.search or result.few}
    lacking = [skin for skin in results if skin not in usable]
    if len(usable) < _LEAST_SKINS:
        return {**report(results[lacking[0]]), "campaign": name, "campaigns": names}
    return fleet_document(name, names, _fleet(usable, lacking, orders))


def _latest(campaigns: Sequence[Campaign], table: SigmaTable, without: Collection[str]) -> DiagnosisResult:
    """The diagnosis of the last campaign with a result of its own, else of the last with one together with others."""
    results: list[DiagnosisResult] = []
    for campaign in campaigns[::-1]:
        results.append(diagnose(campaign, table, without=without))
        if results[-1].search is not None:
            return results[-1]
    return next((result for result in results if result.few is not None), results[0])


@dataclass(frozen=True)
class CommonSet:
    """The most probable set of each skin, given the most probable common set, with their probabilities; `probability`
    is that of all of them together.

    `from_other_specimens`: of each skin the log probabilities of the sets by the recordings of the others only.
    `log_evidence`: of all recordings, over all sets.
    """

    sets: tuple[Names, ...]
    probabilities: tuple[float, ...]
    probability: float
    from_other_specimens: tuple[Mapping[frozenset[str], float], ...]
    log_evidence: float


def common_set(skins: Sequence[FleetSkin], sets: Sequence[frozenset[str]], supported: int) -> CommonSet:
    """Of skins fitted under these sets and the smaller ones; `supported` is the number of mechanisms."""
    evidence = np.array([[skin.log_evidence(names, len(skins)) for names in sets] for skin in skins])
    log_evidence = np.maximum(evidence - evidence.max(axis=1, keepdims=True), -PRUNE_NATS)
    changes = np.array([[log_change(len(common ^ names), supported, _P_DIFFERS) for names in sets] for common in sets])
    shown = np.array([[_is_supported(skin, names, len(skins)) for names in sets] for skin in skins])
    allowed = shown[:, None] | np.eye(len(sets), dtype=bool)  # (skins, common sets, sets)
    change = np.where(allowed, changes[None], -np.inf)
    weights = change + log_evidence[:, None]
    of_skins = np.logaddexp.reduce(weights, axis=2)  # (skins, common sets)
    of_all = of_skins.sum(axis=0)
    by_set = dict(zip(sets, of_all.tolist(), strict=True))
    smaller = [max((by_set.get(names - {name}, -np.inf) for name in names), default=-np.inf) for names in sets]
    # A mechanism supported by no skin is left to the smaller set
    prior = np.array([log_prior(len(common), supported) for common in sets])
    log_common = np.where(of_all > SHOWS + np.array(smaller), prior + of_all, -np.inf)
    share = np.exp(log_common - np.logaddexp.reduce(log_common))
    best = int(share.argmax())
    # Posterior of each skin's set, averaged over all common sets
    posterior = np.einsum("c,ncm->nm", share, np.exp(weights - of_skins[..., None]))
    chosen, rows = weights[:, best].argmax(axis=1), np.arange(len(skins))
    probability = share[best] * np.exp((weights[rows, best, chosen] - of_skins[:, best]).sum())
    by_others = np.logaddexp.reduce((log_common - of_skins)[..., None] + change, axis=1)
    by_others -= np.logaddexp.reduce(by_others, axis=1, keepdims=True)
    order = skins[0].candidate.problem.lines.mechanisms.named
    chosen_sets = [skin.candidate.supported(sets[index]) for skin, index in zip(skins, chosen, strict=True)]
    return CommonSet(
        tuple(tuple(name for name in order if name in names) for names in chosen_sets),
        tuple(posterior[rows, chosen].tolist()),
        float(probability),
        tuple(dict(zip(sets, row, strict=True)) for row in by_others.tolist()),
        float(np.logaddexp.reduce(log_common) + evidence.max(axis=1).sum()),
    )


def _is_supported(skin: FleetSkin, names: frozenset[str], skins: int) -> bool:
    """Whether each mechanism of a set is supported by a skin's own recordings."""
    log_evidence = skin.log_evidence(names, skins)
    return all(log_evidence > skin.log_evidence(names - {name}, skins) + SHOWS for name in names)


@dataclass(frozen=True)
class _Attempt:
    """The skins fitted about the declared values, or with an `error` of these in all skins."""

    error: str
    skins: Sequence[FleetSkin]
    common: CommonSet
    log_weight: float


def _fleet(results: Mapping[str, DiagnosisResult], lacking: Sequence[str], orders: Mapping[str, str]) -> Fleet:
    """Of the usable skins."""
    fits = {skin: CampaignFits.of(result) for skin, result in results.items()}
    usable = list(fits.values())
    bench_priors = benches(usable)
    names_of_skins = (names.difference(ERRORS) for candidate in usable for names in candidate.required_sets)
    sets = list(dict.fromkeys((frozenset[str](), *names_of_skins)))
    # Those with one mechanism less decide whether each mechanism is supported
    with_smaller = list(dict.fromkeys((*sets, *(names - {name} for names in sets for name in sorted(names)))))
    supported = min(candidate.search.supported for candidate in usable)
    odds = log_prior(1, supported) - log_prior(0, supported)

    def attempt(error: str, centre: tuple[float, float], log_prior_weight: float) -> _Attempt:
        skins = [FleetSkin(*pair, with_smaller, centre) for pair in zip(usable, bench_priors, strict=True)]
        common = common_set(skins, sets, supported)
        return _Attempt(error, skins, common, common.log_evidence + log_prior_weight)

    attempts = [attempt("", (0.0, 0.0), 0.0)]
    for row, error in enumerate(ERRORS):
        off, deviation = _off(attempts[0].skins, row, error)
        if abs(off) > FAR_SDS * max(deviation, QUANTITIES[row].declared):
            centre, far = (off, 0.0) if row == 0 else (0.0, off), QUANTITIES[row].far
            attempts.append(attempt(error, centre, odds + float(np.log(deviation / far) - 0.5 * (off / far) ** 2)))
    weights = np.array([tried.log_weight for tried in attempts])
    shares = np.exp(weights - np.logaddexp.reduce(weights))
    best = attempts[int(np.argmax(shares))]
    pooled, errors = _pooled(best, odds)
    if best.error:
        _, errors = _pooled(attempts[0], odds)
    p_declared = {error: float(shares[0]) * share for error, share in errors.items() if error}
    for tried, share in zip(attempts[1:], shares[1:].tolist(), strict=True):
        p_declared[tried.error] = p_declared.get(tried.error, 0.0) + share
    declared = np.array([skin.declared for skin in best.skins])
    quantities = [
        PooledQuantity(quantity.name, quantity.unit, list(fits), pooled, row, quantity.departure, declared[:, row])
        for row, quantity in enumerate(QUANTITIES)
    ]
    stated = zip(fits, pooled.departures, pooled.stated, strict=True)
    return Fleet(
        reports={skin: reported(result) for skin, result in results.items()},
        provenance=next(iter(results.values())).provenance,
        lacking=lacking,
        orders=orders,
        p_unlisted={skin: candidate.p_unlisted for skin, candidate in fits.items()},
        p_described=p_described(usable),
        sets=dict(zip(fits, zip(best.common.sets, best.common.probabilities, strict=True), strict=True)),
        p_sets=best.common.probability,
        p_declared=p_declared,
        errors={skin: (error, shares[error]) for skin, shares, error in stated if error in ERRORS},
        quantities=[quantities[-1], *quantities[:-1], *strengths(fits, best.common.sets)],
    )


def _off(skins: Sequence[FleetSkin], row: int, error: str) -> tuple[float, float]:
    """The mean deviation of ln of a quantity from the declared values, if it is the same in all skins, and its standard
    deviation.
    """
    departures = [departure for skin in skins if error in skin.errors and (departure := skin.departing(error))]
    if len(departures) < len(skins):
        return 0.0, 0.0
    means, variances = np.array(departures).T
    precision = 1 / (variances + QUANTITIES[row].spread.usual ** 2)
    return float(precision @ means / precision.sum()), float(precision.sum() ** -0.5)


def _pooled(attempt: _Attempt, odds: float) -> tuple[Populations, dict[str, float]]:
    """The populations by one attempt, and the probability of each error (or none) of the values declared for all
    skins, with their prior `odds`."""
    pairs = zip(attempt.skins, attempt.common.from_other_specimens, strict=True)
    states = [skin.states(log_shares) for skin, log_shares in pairs]
    usual, centre = np.array([quantity.declared for quantity in QUANTITIES]), np.array([0.0, 0.0, LOG_D33_PC_PER_N])
    batches = {"": Batch(0.0, centre, usual**-2)}
    for row, error in enumerate(ERRORS):
        if all(error in skin.errors for skin in attempt.skins):
            far = np.where(np.array(DEPARTURES) == error, QUANTITIES[row].far, usual)
            batches[error] = Batch(odds, centre, far**-2)
    if attempt.error:
        batches = {attempt.error: batches[attempt.error]}
    pooled = populations(states, list(batches.values()), [quantity.spread for quantity in QUANTITIES])
    return pooled, dict(zip(batches, pooled.batches.tolist(), strict=True))


def strengths(candidates: Mapping[str, CampaignFits], sets: Sequence[Names]) -> list[PooledQuantity]:
    """The positive parameters of mechanisms that at least three skins have, as populations of these skins."""
    states: dict[tuple[str, str], dict[str, list[State]]] = {}
    for (skin, candidate), names in zip(candidates.items(), sets, strict=True):
        fit = candidate.fit(names)
        for mechanism, span in fit.spans.items():
            for index in range(span.start, span.stop):
                parameter = fit.model.parameters[index]
                if parameter.scale != "log" or index not in fit.best.hypothesis.mean_indices:
                    continue
                likelihood = SharedParameters.at(fit, [index]).likelihood
                if likelihood.precision.any():
                    regular = State(REGULAR, likelihood, np.zeros(1))
                    departing = State("strength", likelihood, np.array([_DEPARTURE_SD**2]))
                    name = f"{mechanism}.{parameter.name}", parameter.unit
                    states.setdefault(name, {})[skin] = [regular, departing]
    batch = Batch(0.0, np.zeros(1), np.array([_STRENGTH_SD**-2]))
    return [
        PooledQuantity(
            name,
            unit,
            list(of_skins),
            populations(list(of_skins.values()), [batch], [_STRENGTH]),
            0,
            "strength",
            np.zeros(len(of_skins)),
        )
        for (name, unit), of_skins in states.items()
        if len(of_skins) >= _LEAST_SKINS
    ]
