"""Skins of one make: their E, thickness, d33 and the strengths of their mechanisms as populations, and which departs.

Each skin speaks by its latest campaign of FRFs that can be used, with the curves of its campaigns without FRFs. The set
of mechanisms that all have in common is found over all skins (common_set.py), and what each says of its E, thickness
and d33 (skin.py) is pooled (population.py), so that a skin of which little was recorded leans on its sisters.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.pipeline import diagnose
from underskin.diagnosis.reporting.report import DiagnosisResult, report
from underskin.diagnosis.selection.priors import log_prior
from underskin.diagnosis.several.bench import benches
from underskin.diagnosis.several.campaigns import by_frfs, curves_once, refuse_copies, with_curves
from underskin.diagnosis.several.common_set import CommonSet, common_set, sets_of, with_smaller
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.dates import Dated, date_of, in_order
from underskin.diagnosis.several.fleet_report import Fleet, fleet_report
from underskin.diagnosis.several.population import Make, Populations, Spread, populations
from underskin.diagnosis.several.skin import D33_PRIOR, ERRORS, FAR, FleetSkin
from underskin.diagnosis.several.strengths import of_strengths
from underskin.errors import InvalidInput
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

_LEAST_SKINS = 3
_DECLARED = (0.02, 0.01)  # deviations of ln of the make's E and thickness about the declared ones
# Pieces of one cure and of one poled film differ by some percent; a mould's thickness is held
_FAR_OFF = 2.0  # deviations by which skins must be off together for an error of what is declared of all to be looked at
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
    refuse_copies([campaign for own in skins.values() for campaign in own])
    results: dict[str, DiagnosisResult] = {}
    seen: set[bytes] = set()
    orders: dict[str, str] = {}
    for number, (skin, campaigns) in enumerate(skins.items()):
        with_frf, of_curves = by_frfs(curves_once(campaigns, seen))
        if not with_frf:
            raise InvalidInput("skins", skin, "must have a campaign with recordings of kind frf")
        results[skin] = _latest([with_curves(one, of_curves) for one in with_frf], table, without)
        if len(with_frf) > 1:
            orders[skin] = Dated([one.name for one in with_frf], [date_of(one) for one in with_frf]).order_clause()
        progress((number + 1) / (len(skins) + 1))
    campaigns_named = [campaign.name for own in skins.values() for campaign in own]
    candidates = {
        skin: Candidate(result.problem, search)
        for skin, result in results.items()
        if result.problem is not None and (search := result.search or result.few) is not None
    }
    if len(candidates) < _LEAST_SKINS:
        lacking = next(skin for skin in skins if skin not in candidates)
        return {**report(results[lacking]), "campaign": name, "campaigns": campaigns_named}
    return fleet_report(name, campaigns_named, results, _found(candidates), orders)


def _latest(campaigns: Sequence[Campaign], table: SigmaTable, without: Collection[str]) -> DiagnosisResult:
    """The diagnosis of the latest campaign that says something alone, else of the latest that does beside others."""
    found: list[DiagnosisResult] = []
    for campaign in in_order(campaigns)[::-1]:
        found.append(diagnose(campaign, table, without=without))
        if found[-1].search is not None:
            return found[-1]
    return next((result for result in found if result.few is not None), found[0])


@dataclass(frozen=True)
class _Attempt:
    """The skins looked at about what is declared, or with an `error` of that in all of them."""

    error: str
    skins: Sequence[FleetSkin]
    common: CommonSet
    log_weight: float


def _found(candidates: Mapping[str, Candidate]) -> Fleet:
    """Of the usable skins."""
    each = list(candidates.values())
    sets, on = sets_of(each), benches(each)
    supported = min(one.search.supported for one in each)
    odds = log_prior(1, supported) - log_prior(0, supported)

    def attempt(error: str, centre: tuple[float, float], log_prior_weight: float) -> _Attempt:
        skins = [FleetSkin(one, with_smaller(sets), bench, centre) for one, bench in zip(each, on, strict=True)]
        common = common_set(skins, sets, supported)
        return _Attempt(error, skins, common, common.log_evidence + log_prior_weight)

    attempts = [attempt("", (0.0, 0.0), 0.0)]
    for row, error in enumerate(ERRORS):
        off, deviation = _off(attempts[0].skins, row, error)
        if abs(off) > _FAR_OFF * max(deviation, _DECLARED[row]):
            centre = (off, 0.0) if row == 0 else (0.0, off)
            occam = np.log(deviation / FAR[row]) - 0.5 * (off / FAR[row]) ** 2
            attempts.append(attempt(error, centre, odds + float(occam)))
    weights = np.array([one.log_weight for one in attempts])
    shares = np.exp(weights - np.logaddexp.reduce(weights))
    best = attempts[int(np.argmax(shares))]
    pooled, makes = _pooled(best, odds)
    if best.error:
        _, makes = _pooled(attempts[0], odds)
    wrongly = declared_wrongly(dict(zip((one.error for one in attempts), shares.tolist(), strict=True)), makes)
    declared = np.array([skin.declared for skin in best.skins])
    return Fleet(candidates, best.common, pooled, declared, wrongly, of_strengths(candidates, best.common))


def _pooled(attempt: _Attempt, odds: float) -> tuple[Populations, dict[str, float]]:
    """The populations by one attempt, and by its skins the probability that what is declared of all is right or has an
    error."""
    states = [skin.states(own) for skin, own in zip(attempt.skins, attempt.common.from_sisters, strict=True)]
    makes, errors = _makes(attempt.skins, odds)
    if attempt.error:
        makes, errors = [makes[errors.index(attempt.error)]], [attempt.error]
    pooled = populations(states, makes, SPREADS)
    return pooled, dict(zip(errors, pooled.makes.tolist(), strict=True))


def declared_wrongly(attempts: Mapping[str, float], makes: Mapping[str, float]) -> dict[str, float]:
    """The probability of each error of what is declared of all skins: `attempts` those of each attempt, by error, and
    `makes` those of each error by the attempt that has none."""
    errors = [error for error in dict.fromkeys((*makes, *attempts)) if error]
    return {error: attempts[""] * makes.get(error, 0.0) + attempts.get(error, 0.0) for error in errors}


def _off(skins: Sequence[FleetSkin], row: int, error: str) -> tuple[float, float]:
    """By how much ln of a quantity is off what is declared, if it is the same in all skins, and its deviation."""
    each = [skin.departing(error) for skin in skins if error in skin.errors]
    means, variances = (np.array([one[part] for one in each if one is not None]) for part in (0, 1))
    if len(means) < len(skins):
        return 0.0, 0.0
    precision = 1 / (variances + SPREADS[row].usual ** 2)
    return float(precision @ means / precision.sum()), float(precision.sum() ** -0.5)


def _makes(skins: Sequence[FleetSkin], odds: float) -> tuple[list[Make], list[str]]:
    """The priors of the make's quantities, and by each the error of what is declared of all skins, with its odds."""
    usual, centre = np.array([*_DECLARED, D33_PRIOR[1]]), np.array([0.0, 0.0, D33_PRIOR[0]])
    makes, errors = [Make(0.0, centre, usual**-2)], [""]
    for row, error in enumerate(ERRORS):
        if all(error in skin.errors for skin in skins):
            loose = usual.copy()
            loose[row] = FAR[row]
            makes.append(Make(odds, centre, loose**-2))
            errors.append(error)
    return makes, errors
