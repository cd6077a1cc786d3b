"""Young's modulus of curves in a report: its median and 95 % interval, integrated over what the curves leave open.

Over the scatter of gains and the idealisation of laws; over all answers with their probabilities, `none_of_these` with
all unlisted laws that show; over the level at which the factor of such a law is 1; and over mechanisms that an apparent
modulus may hide.
"""

from typing import Any

from underskin.diagnosis.inference.evidence import marginalise_curve_noise
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.reporting import numbers
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import MODULUS_ERROR, hidden_factors, may_hide

_MOST = 0.5  # of the variance of log E: the part that another parameter explains
_LAW_FACTORS = ("gain", "modulus")  # what an unlisted law acts on as a factor on the force


def modulus_under(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    """The report's E of curves under one explanation."""
    return _entry(problem, explanation, _log_modulus(problem, explanation))


def modulus_over_answers(search: Search, problem: FittingProblem, shown: Explanation) -> dict[str, Any] | None:
    """The report's E of curves over all answers; `shown`, the fit behind the leading one, tells whether E is at a bound
    of its search. None where answers without a fit are more probable than all others: nothing describes the curves."""
    parts = numbers.over_answers(search, lambda explanation, _: _log_modulus(problem, explanation))
    return _entry(problem, shown, NormalMixture.joined([part for _, part in parts])) if parts else None


def _log_modulus(problem: FittingProblem, explanation: Explanation) -> NormalMixture:
    """The logarithm of E [MPa]; the shares sum to 1."""
    spans, index = explanation.spans, explanation.index("youngs_modulus")
    factor = [spans[MODULUS_ERROR].start] if MODULUS_ERROR in spans else []
    mixture = marginalise_curve_noise(explanation.best, [index, *factor])
    mixture = mixture.averaged_over(numbers.law_levels(problem, explanation, _LAW_FACTORS))
    hiding = may_hide(problem.lines.campaign, problem.lines.mechanisms.named)
    hidden = hidden_factors(hiding, explanation.names)
    return NormalMixture.joined([mixture.moved(-excess).times(share) for excess, share in hidden])


def _search_ended(explanation: Explanation, index: int) -> str | None:
    """The end of a search that E shares: its own, or that of a parameter which most of its uncertainty follows, as the
    modulus before a relaxation that is faster than the recording."""
    parameters, fit = explanation.model.parameters, explanation.point.fit
    means = explanation.best.hypothesis.mean_indices
    for span in [slice(index, index + 1), *explanation.spans.values()]:
        for other in range(span.start, span.stop):
            side = parameters[other].ends_search(float(fit[other]))
            if side is None or other not in means:
                continue
            variance = explanation.best.covariance_of([index, other])
            if variance[0, 1] ** 2 > _MOST * variance[0, 0] * variance[1, 1]:
                return side if variance[0, 1] > 0 else {"low": "high", "high": "low"}[side]
    return None


def _entry(problem: FittingProblem, explanation: Explanation, mixture: NormalMixture) -> dict[str, Any]:
    index = explanation.index("youngs_modulus")
    at_bound = _search_ended(explanation, index)
    declared = problem.lines.campaign.skin.youngs_modulus_mpa or 1.0  # the parameter is a factor on it
    stated = numbers.of_logarithms(mixture.share / mixture.share.sum(), mixture.mean, mixture.deviation)
    bound = {} if at_bound is None else {"at_bound": at_bound}
    return {"name": "youngs_modulus", "unit": "MPa", **numbers.scaled(stated, declared), **bound}
