"""Evidences by the Laplace approximation, as in a diagnosis, against nested sampling (dynesty).

Both compare the same hypotheses on the same lines, with the same priors and the same code for the likelihood, which
also calculates derivatives that nested sampling does not use. In both, the evidence is the mean with and without
positioning scatter.
"""

import time
from dataclasses import dataclass
from statistics import median

import numpy as np
from threadpoolctl import threadpool_limits

from bench.diagnosed import Effects, recorded
from bench.figures import Figure
from tests.support.nested_sampling import Posterior, Sampled, nested
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.selection.priors import log_prior
from underskin.inversion.mixed_model import NO_POSITION_SCATTER
from underskin.surrogate.sigma_table import load_table

HIDDEN: dict[str, Effects] = {
    "nothing": {},
    "preload_dependent_d33": {"preload_dependent_d33": {"beta_per_mpa": 1.0, "saturation_mpa": 0.3}},
    "ageing": {"ageing": {"rate": 0.1, "cycles": 300.0, "law": "exponential"}},
}
SINGLES = ("preload_dependent_d33", "ageing", "moving_contact_edge")
HYPOTHESES: tuple[tuple[str, ...], ...] = ((), *((name,) for name in SINGLES))
PRELOADS_N = (0.3, 0.6, 1.0, 1.6, 2.3, 3.0)  # with two sensors and two spheres, 24 recordings
ROUNDS = 3  # of ours; nested sampling takes long enough
WITHIN = 10.0  # nats behind the winner


@dataclass(frozen=True)
class Compared:
    """The hypotheses' log evidences by both methods, the sampler's standard errors, and both processor times [s]."""

    laplace: list[float]
    sampled: list[float]
    errors: list[float]
    laplace_seconds: float
    sampled_seconds: float

    @property
    def same_winner(self) -> bool:
        """Whether the same hypothesis is the most probable."""
        return _winner(self.laplace) == _winner(self.sampled)

    @property
    def rivals(self) -> list[int]:
        """The hypotheses whose evidence is near the winner's."""
        best = self.sampled[_winner(self.sampled)]
        return [index for index, value in enumerate(self.sampled) if value > best - WITHIN]


def _winner(evidences: list[float]) -> int:
    priors = [log_prior(len(names), len(SINGLES)) for names in HYPOTHESES]
    return int(np.argmax(np.add(evidences, priors)))


def measure() -> list[Figure]:
    """For each campaign the ratio of processor times and the largest difference of the rivals' evidences."""
    figures = []
    with threadpool_limits(1):
        results = {name: _compared(effects) for name, effects in HIDDEN.items()}
    for name, comparison in results.items():
        apart = max(abs(comparison.laplace[index] - comparison.sampled[index]) for index in comparison.rivals)
        error = max(comparison.errors[index] for index in comparison.rivals)
        figures += [
            Figure(f"{name} hidden: processor time, ours", comparison.laplace_seconds, "s"),
            Figure(f"{name} hidden: processor time, dynesty", comparison.sampled_seconds, "s"),
            Figure(
                f"{name} hidden: dynesty's time",
                comparison.sampled_seconds / comparison.laplace_seconds,
                "× ours",
                50.0,
            ),
            Figure(f"{name} hidden: hypotheses within {WITHIN:g} nats of the winner", len(comparison.rivals), ""),
            Figure(f"{name} hidden: their log evidences, largest difference", apart, "nats"),
            Figure(f"{name} hidden: the sampler's own standard error, largest", error, "nats"),
        ]
    same = sum(comparison.same_winner for comparison in results.values())
    return [*figures, Figure("campaigns with the same winner", same, f"of {len(results)}", float(len(results)))]


def _compared(effects: Effects) -> Compared:
    problem = FittingProblem(lines(recorded(effects, columns=2, preloads_n=PRELOADS_N, lines=20)), load_table())
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        explained = _explained(problem)
        times.append(time.process_time() - start)
    start = time.process_time()
    sampled = [_sampled(problem, explanation) for explanation in explained]
    return Compared(
        [explanation.log_evidence for explanation in explained],
        [explanation.log_evidence for explanation in sampled],
        [explanation.error for explanation in sampled],
        median(times),
        time.process_time() - start,
    )


def _explained(problem: FittingProblem) -> list[Explanation]:
    # One by one, so that none is pruned because of the others.
    results = [problem.explain(Request(names)) for names in HYPOTHESES]
    return [fit for fit in results if fit is not None]


def _sampled(problem: FittingProblem, explained: Explanation) -> Sampled:
    """Without positioning scatter and, where the diagnosis looked for it, with it."""
    plain, scattering = (
        Fitter(problem.hypothesis(explained.names, has_position_scatter)) for has_position_scatter in (False, True)
    )
    without = nested(Posterior(plain, explained.point))
    if explained.p_position_scatter == 0:
        return without
    sampled = nested(Posterior(scattering, explained.point))
    parts = np.add(np.log([NO_POSITION_SCATTER, 1 - NO_POSITION_SCATTER]), [without.log_evidence, sampled.log_evidence])
    total = float(np.logaddexp.reduce(parts))
    error = float(np.hypot(*(np.exp(parts - total) * [without.error, sampled.error])))
    return Sampled(total, error, without.likelihoods + sampled.likelihoods)
