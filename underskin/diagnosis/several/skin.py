"""What the recordings of one skin say of its E, thickness and d33, as it is of its make or departs from it.

Fits under each set of mechanisms with all three free: E and thickness about the make's, as skins of one make differ;
and either of them anywhere, since what is declared is wrong for this skin. Laplace's approximation of each, with the
priors taken out, is a normal likelihood of the logarithms; those of E and thickness are over the declared ones, so that
skins that are declared to differ are still of one make.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import curvature_of_prior, own_places
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.several.bench import Bench
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.likelihoods import log_integral, mixed, of_posterior, posterior
from underskin.diagnosis.several.population import REGULAR, State, log_odds_of_departure
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.registry import CATALOGUE
from underskin.units import Floats

MODULUS, THICKNESS, D33 = "modulus_error", "thickness_error", "d33"
ERRORS = (MODULUS, THICKNESS)
QUANTITIES = {MODULUS: "youngs_modulus", THICKNESS: "thickness", D33: "d33"}  # by what a skin departs in
_ABOUT_MAKE = (0.1, 0.01)  # deviations of ln E and ln h about the make's within which a regular skin is fitted
_FAR_IN_D33 = 0.4  # an amplifier's other range
FAR = (*(curvature_of_prior(CATALOGUE[name].parameters_stated[0])[0] ** -0.5 for name in ERRORS), _FAR_IN_D33)
# Deviations of ln E, ln h and ln d33 of one that departs, those of errors as the mechanisms have their scales
D33_PRIOR = (float(np.log(15.0)), 1.5)
_BEYOND = 2.0  # deviations about the make, beyond which a fit says no more than that the skin departs

Likelihoods = dict[tuple[frozenset[str], str], Knowledge]  # by set and departure


class FleetSkin:
    """One skin beside its sisters, fitted under sets of mechanisms, the first of them none."""

    def __init__(
        self,
        candidate: Candidate,
        sets: Sequence[frozenset[str]],
        bench: Bench,
        centre: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Fit all sets; `bench` says what scatters, `centre` is ln of the make's E and thickness over the declared
        ones."""
        self.candidate = candidate
        self._centre = centre
        skin = candidate.problem.lines.campaign.skin
        assert skin.youngs_modulus_mpa is not None  # FRFs have no model without them
        assert skin.thickness_mm is not None
        self.declared: Floats = np.log([skin.youngs_modulus_mpa, skin.thickness_mm, 1.0])  # (quantities,)
        tried = set(candidate.problem.lines.mechanisms.named) - set(candidate.search.unsupported)
        self.errors = tuple(name for name in ERRORS if name in tried)
        self.departures = (*self.errors, D33)
        self._fitted = self._fits(tuple(dict.fromkeys(candidate.supported(names) for names in sets)), bench)

    def log_evidence(self, names: frozenset[str], skins: int) -> float:
        """Of a set, whether the skin departs or not, as one of so many."""
        own = self.candidate.supported(names)
        odds = log_odds_of_departure(skins) - float(np.log(len(self.departures)))
        weights = [
            self._log_integral(self._fitted[own, departs], departs) + odds * (departs != REGULAR)
            for departs in (REGULAR, *self.departures)
            if (own, departs) in self._fitted
        ]
        return float(np.logaddexp.reduce(weights)) if weights else -np.inf

    def departing(self, error: str) -> tuple[float, float] | None:
        """If what is declared is off, and no mechanism acts: mean and variance of the logarithm by which it is."""
        likelihood = self._fitted.get((frozenset(), error))
        if likelihood is None:
            return None
        row = ERRORS.index(error)
        mean, covariance = posterior(likelihood, *self._prior(error))
        return float(mean[row]), float(covariance[row, row])

    def states(self, log_shares: Mapping[frozenset[str], float]) -> list[State]:
        """What it says under sets of mechanisms of these prior probabilities, the regular state first."""
        found = []
        for departs in (REGULAR, *self.departures):
            each = [
                (share, self._fitted[own, departs])
                for names, share in log_shares.items()
                if np.isfinite(share) and ((own := self.candidate.supported(names)), departs) in self._fitted
            ]
            if each:
                found.append(State(departs, mixed(each, *self._prior(departs)), self._further(departs)))
        return found

    def _further(self, departs: str) -> Floats:
        return np.array([far**2 * (departs == name) for name, far in zip(QUANTITIES, FAR, strict=True)])

    def _prior(self, departs: str) -> tuple[Floats, Floats]:
        """Centre and precision of the quantities before any recording."""
        centre = np.array([*self._centre, D33_PRIOR[0]])
        return centre, 1 / (np.array([*_ABOUT_MAKE, D33_PRIOR[1]]) ** 2 + self._further(departs))

    def _log_integral(self, likelihood: Knowledge, departs: str) -> float:
        return log_integral(likelihood, *self._prior(departs)).item()

    def _fits(self, sets: Sequence[frozenset[str]], bench: Bench) -> Likelihoods:
        """Of those that can be fitted."""
        found: Likelihoods = {}
        lines, table = self.candidate.problem.lines, self.candidate.problem.table
        for departs in (REGULAR, *self.errors):
            held = tuple(name for name in self.errors if name != departs)

            def beside(model: Model, lines: Lines, held: Sequence[str] = held) -> Knowledge:
                return self._about_make(model, lines, held)

            problem = FittingProblem(lines, table, beside, bench.gain)
            for names, fit in zip(sets, _explained(problem, [{*names, *self.errors} for names in sets]), strict=True):
                if fit is not None:
                    each = [(_log_share(fit, one, bench), self._said(fit, one, held)) for _, one in fit.each]
                    found[names, departs] = mixed(each, *self._prior(departs))
        for names in sets:
            self._where_far(found, names)
            if (names, REGULAR) in found:
                found[names, D33] = found[names, REGULAR]
        return found

    def _where_far(self, found: Likelihoods, names: frozenset[str]) -> None:
        """Far from the make the regular fit, which is held there, is no approximation: a departing one takes its place.

        Its quadratic would have the likelihood grow without end towards where the recordings pull.
        """
        others = [name for name in self.errors if (names, name) in found]
        if (names, REGULAR) not in found or not others:
            return
        centre, precision = self._prior(REGULAR)
        mean, _ = posterior(found[names, REGULAR], centre, precision)
        if (np.abs(mean - centre) * np.sqrt(precision))[: len(ERRORS)].max() > _BEYOND:
            nearest = max(others, key=lambda name: self._log_integral(found[names, name], name))
            found[names, REGULAR] = found[names, nearest]

    def _about_make(self, model: Model, lines: Lines, held: Sequence[str]) -> Knowledge:
        """That E and thickness are about the make's, as far as held, beside what recordings of other kinds say."""
        other = self.candidate.problem.beside
        places = own_places(model.names, lines)
        rows = [ERRORS.index(name) for name in held]
        matrix = np.eye(len(model.parameters))[[places[name].start for name in held]]
        centre, precision = np.array(self._centre)[rows], np.diag(np.array(_ABOUT_MAKE)[rows] ** -2.0)
        about = Knowledge.of(matrix, np.zeros(len(rows)), centre, precision, 0.0)
        known = None if other is None else other(model, lines)
        return about if known is None else known + about

    def _said(self, fit: Explanation, best: Evidence, held: Sequence[str]) -> Knowledge:
        """The likelihood by one of its fits: the posterior over the priors, those of errors and the usual ones."""
        places = own_places(fit.names, best.hypothesis.lines)
        entries = [entry.name for entry in fit.model.parameters]
        matrix = np.zeros((len(QUANTITIES), len(entries)))
        centre, variance, log_evidence = np.zeros(len(QUANTITIES)), np.zeros(len(QUANTITIES)), best.log_evidence
        for row, (error, quantity) in enumerate(QUANTITIES.items()):
            of_error = [places[error].start] if error in self.errors else []
            for place in (entries.index(quantity), *of_error):
                matrix[row, place] = 1.0
                precision, middle = curvature_of_prior(fit.model.parameters[place])
                if place in of_error and error in held:
                    about, also = self._centre[row], _ABOUT_MAKE[row] ** -2
                    both = 1 / precision + 1 / also
                    log_evidence += 0.5 * (np.log(both * also) + (about - middle) ** 2 / both)
                    precision, middle = precision + also, (precision * middle + also * about) / (precision + also)
                centre[row] += middle
                variance[row] += 1 / precision
        by_fit = matrix[:, best.hypothesis.mean_places]
        mean = matrix @ best.point.fit
        return of_posterior(log_evidence, mean, by_fit @ best.covariance @ by_fit.T, centre, 1 / variance)


def _log_share(fit: Explanation, one: Evidence, bench: Bench) -> float:
    """ln of the prior of a fit with or without positioning scatter, where there are both."""
    if len(fit.each) == 1:
        return 0.0
    return float(np.log(bench.placed if one.hypothesis.placed else 1 - bench.placed))


def _explained(problem: FittingProblem, sets: Sequence[set[str]]) -> list[Explanation | None]:
    """Of each set, None where it is hopeless beside the others; the first is not compared with them."""
    catalogue = problem.lines.mechanisms.named
    requests = [Request(tuple(name for name in catalogue if name in names)) for names in sets]
    return [*problem.explain(requests[:1]), *problem.explain(requests[1:])]
