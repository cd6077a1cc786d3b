"""Numbers of a report: parameters with 95 % intervals, parameters at bounds, and summaries over all answers.

- A parameter at a bound of its search is no result: a set of mechanisms that holds one explains nothing, and its d33 is
  not to be quoted. A bound beyond which there is nothing, or at which a mechanism has no effect, does not count
  (`Parameter.ends_search`).
- Over all surviving answers: the probability of each mechanism, answers with the same predictions, and laws without a
  free parameter that declared facts imply (such as the layer's) but the base model idealises.
- Sensors whose d33 lies far from the others'.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import chdtri

from underskin.diagnosis.data.names import CERTAIN, EXPLAINED, MOST_NAMED, NAMED
from underskin.diagnosis.inference.evidence import levels_covariance, profile_end
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.inference.residuals import Residuals, row_prediction, with_hidden_mechanism
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import declared_laws
from underskin.diagnosis.slips.levels import LEAST_LEVELS
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.inversion.mixed_model import LEVEL, ROBUST, SDS_OF_95, mixture_quantile
from underskin.mechanisms.base import Parameter
from underskin.mechanisms.unlisted.laws import UnlistedLaw, in_plain_words
from underskin.units import Floats

ENDS = ("value", "low", "high")
QUANTILES_OF_95 = (0.5, 0.025, 0.975)  # for these


def rounded(value: float, digits: int = 4) -> float | None:
    """The value to significant digits; None if it is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def with_ends(value: float, low: float, high: float) -> dict[str, float | None]:
    """`value`, `low` and `high` to significant digits."""
    return {key: rounded(float(end)) for key, end in zip(ENDS, (value, low, high), strict=True)}


def scaled(parameter: Mapping[str, Any], factor: float) -> dict[str, float | None]:
    """The ends of a parameter times a factor."""
    return with_ends(*(factor * parameter[key] for key in ENDS))


def in_sentence(parameter: Mapping[str, Any]) -> str:
    """A parameter's value and interval in a sentence: "2.04 MPa (95 %: 1.9 to 2.2)"."""
    value, low, high = (f"{parameter[key]:.3g}" for key in ENDS)
    return f"{value} {parameter['unit']} (95 %: {low} to {high})"


_ORDER = 10.0  # ratio of the ends of an interval


def is_known(parameter: Mapping[str, Any]) -> bool:
    """Whether the 95 % interval of a positive quantity, if it has one, leaves it less than an order of magnitude."""
    low, high = parameter.get("low"), parameter.get("high")
    return low is None or high is None or bool(high < _ORDER * low)


def of_logarithms(shares: Floats, means: Floats, deviations: Floats) -> dict[str, float | None]:
    """The median and the 95 % interval of a quantity whose logarithm is a mixture of normal distributions (parts,)."""
    return with_ends(*(float(np.exp(mixture_quantile(shares, means, deviations, level))) for level in QUANTILES_OF_95))


def with_hidden(
    modulus: Mapping[str, Any], hidden: Sequence[tuple[float, float]], tolerance: float = 0.0
) -> dict[str, Any]:
    """A modulus with its 95 % interval, whose logarithm may be too large by the `hidden` values with their
    probabilities, and differs from that sought with the standard deviation `tolerance`."""
    if len(hidden) == 1 and tolerance == 0:
        return dict(modulus)
    deviation = np.log(modulus["high"] / modulus["low"]) / (2 * SDS_OF_95)
    excess, shares = np.array(hidden).T
    deviations = np.full(len(excess), np.hypot(deviation, tolerance))
    return {**modulus, **of_logarithms(shares, np.log(modulus["value"]) - excess, deviations)}


def parameter_with_interval(explanation: Explanation, index: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval within its bounds: ±1.96 standard deviations.

    Where the interval would include the value at which a mechanism has no effect, but the profile of the posterior
    falls off before it, the profile gives the end. Of a parameter that is fitted as a multiple of another one it is
    the interval of the product, cut off at the bounds of the multiple. `at_bound`, `low` or `high`, is present where
    the value lies at or beyond that end of its search.
    """
    best = explanation.best
    parameter = explanation.model.parameters[index]
    if parameter.moves_covariance:
        row = [other.name for other in best.hypothesis.covariance].index(parameter.name)
        variance = float(levels_covariance(best.fitter.covariance_equations(best.at)[1][0])[row, row])
    else:
        variance = float(explanation.best.covariance_of([index])[0, 0])
    half_width = SDS_OF_95 * np.sqrt(max(variance, 0.0))
    low, high = parameter.bounds
    middle = float(explanation.point.fit[index])
    ends = [max(middle - half_width, low), min(middle + half_width, high)]
    limit = None if parameter.moves_covariance else parameter.fit_limit
    if limit is not None and ends[0] <= limit <= ends[1] and limit != middle:
        side = 0 if limit < middle else 1
        end = profile_end(best, index, limit)
        ends[side] = ends[side] if end is None else end
    values = [parameter.from_fit(at) for at in (middle, *ends)]
    if parameter.relative_to is not None:
        unit, both = multiple_of(explanation, parameter), [index, explanation.index(parameter.relative_to)]
        deviation = np.sqrt(max(float(explanation.best.covariance_of(both).sum()), 0.0))
        value, factor = float(np.exp(explanation.point.fit[both].sum())), float(np.exp(SDS_OF_95 * deviation))
        least, most = min(parameter.low * unit, value), parameter.high * unit
        values = [value, max(value / factor, least), min(value * factor, most)]
    at_bound = parameter.ends_search(middle)
    return {
        "name": parameter.name,
        "unit": parameter.unit,
        **with_ends(*values),
        **({} if at_bound is None else {"at_bound": at_bound}),
    }


def parameters_of(explanation: Explanation, name: str) -> list[dict[str, Any]]:
    """The parameters of one of its mechanisms with their intervals."""
    span = explanation.spans[name]
    return [parameter_with_interval(explanation, index) for index in range(span.start, span.stop)]


def multiple_of(explanation: Explanation, parameter: Parameter) -> float:
    """The unit of a parameter's bounds and prior: 1, or the value of the parameter that it is relative to."""
    if parameter.relative_to is None:
        return 1.0
    other = explanation.index(parameter.relative_to)
    return explanation.model.parameters[other].from_fit(float(explanation.point.fit[other]))


def without_effect(explanation: Explanation) -> list[str]:
    """The mechanisms whose strengths may all be zero: the 95 % interval of each holds the value without effect, and so
    does the 95 % region of several together, which may each be replaced by another.

    A strength is a parameter with such a value (`limit`); on a logarithmic scale none reaches 0 or ∞.
    """
    idle = []
    for name, span in explanation.spans.items():
        limits = [parameter.limit for parameter in explanation.model.parameters[span]]
        strengths = [
            (stated, limit)
            for stated, limit in zip(parameters_of(explanation, name), limits, strict=True)
            if limit is not None
        ]
        zero = strengths and all(stated["low"] <= limit <= stated["high"] for stated, limit in strengths)
        if zero and not _act_together(explanation, span):
            idle.append(name)
    return idle


def _act_together(explanation: Explanation, span: slice) -> bool:
    """Whether the 95 % region of several strengths together excludes their values without effect: δᵀC⁻¹δ > χ²."""
    means, parameters = explanation.best.hypothesis.mean_indices, explanation.model.parameters
    strengths = {index: parameters[index].fit_limit for index in range(span.start, span.stop) if index in means}
    limits = {index: limit for index, limit in strengths.items() if limit is not None}
    if len(limits) < 2:
        return False
    off = explanation.point.fit[list(limits)] - np.array(list(limits.values()))
    precision = np.linalg.pinv(explanation.best.covariance_of(list(limits)), hermitian=True)
    return bool(off @ precision @ off > chdtri(len(limits), 1 - LEVEL))


_MEASURED = ("d33", "youngs_modulus")  # free parameters that belong to no mechanism


def at_bounds(explanation: Explanation) -> dict[str, Finding]:
    """Parameters at bounds, those of an explanation's mechanisms, d33, and an undeclared modulus: why each is no result
    ("timing delay: delay at or beyond 5000 µs, where its search ends"), and the finding on it."""
    mechanisms = explanation.best.hypothesis.lines.mechanisms
    owner = {
        index: in_plain_words(mechanisms[name])
        for name, span in explanation.spans.items()
        for index in range(span.start, span.stop)
    }
    bounds = {}
    for index, (parameter, fit) in enumerate(zip(explanation.model.parameters, explanation.point.fit, strict=True)):
        side = parameter.ends_search(float(fit))
        if side is None or (index not in owner and (parameter.name not in _MEASURED or parameter.unit == "-")):
            continue
        mechanism, name, unit = owner.get(index, "base model"), parameter.name.removeprefix("law_"), parameter.unit
        scale = multiple_of(explanation, parameter)
        low, high = scale * parameter.low, scale * parameter.high
        words = at_bound_in_words(mechanism, parameter, side, scale)
        arguments = {"mechanism": mechanism, "parameter": name, "low": low, "high": high, "unit": unit}
        bounds[words] = Finding(Reason.PARAMETER_AT_BOUND, "", name, arguments)
    return bounds


def at_bound_in_words(mechanism: str, parameter: Parameter, side: str, scale: float = 1.0) -> str:
    """That a parameter is no result: "timing delay: delay at or beyond 5000 µs, where its search ends"."""
    end = in_digits(scale * (parameter.low if side == "low" else parameter.high), 3)
    value = f"{end} {parameter.unit.strip('-')}".rstrip()
    name = parameter.name.removeprefix("law_")
    return f"{mechanism}: {name} at or beyond {value}, where its search ends".replace("_", " ")


COUNTS = 0.003  # probability below which an answer is left out of averages
LEAST_DESCRIBED = 0.5  # probability of all answers with a fit, below which none has a number
HIDES = 0.03  # probability of an answer below which mechanisms hidden under it are neglected
_TWINS = 2.0  # nats: largest difference between sets with either of two indistinguishable mechanisms
_ALIKE = 0.5  # of the noise: answers that differ by less have the same predictions


def law_shares(search: Search) -> list[tuple[Explanation, float]]:
    """The sets with an unlisted law that show, and the share of each in the probability of all of them."""
    weights = np.array([weight for _, weight in search.weighed_laws])
    shares = np.exp(weights - np.logaddexp.reduce(weights)) if len(weights) else weights
    return [(law, share) for (law, _), share in zip(search.weighed_laws, shares.tolist(), strict=True)]


def explanations_of(search: Search) -> list[tuple[float, Explanation]]:
    """The explanations behind all answers with their probabilities, above `COUNTS`; of `none_of_these` all laws that
    show."""
    probabilities: dict[int, float] = {}  # by identity: mechanisms of other kinds' curves alone change nothing here
    explanations: dict[int, Explanation] = {}
    for answer in search.answers:
        parts = law_shares(search) if answer.explanation is None else [(answer.explanation, 1.0)]
        for explanation, share in parts:
            key = id(explanation)
            explanations[key] = explanation
            probabilities[key] = answer.probability * share + probabilities.get(key, 0.0)
    return [(probability, explanations[key]) for key, probability in probabilities.items() if probability > COUNTS]


def over_answers(
    search: Search, under: Callable[[Explanation, float], NormalMixture]
) -> list[tuple[Explanation, NormalMixture]]:
    """A quantity `under` each explanation and its probability, times that probability; none where answers without a fit
    are more probable than all others."""
    weighted = explanations_of(search)
    if sum(probability for probability, _ in weighted) < LEAST_DESCRIBED:
        return []
    return [(fit, under(fit, probability).times(probability)) for probability, fit in weighted]


_LEVELS = 9  # quantiles over the rows


def law_levels(problem: FittingProblem, explanation: Explanation, factors: Collection[str]) -> Floats:
    """Logarithms of equally probable factors (levels,), over all rows, on what is measured, from the reference level of
    unlisted laws that act on one of the `factors`; only 0 where there is no such law.

    The level at which the factor of an unlisted law is 1 is a convention of its form.
    """
    mechanisms, names = problem.lines.mechanisms, explanation.names
    laws = [
        name
        for name in names
        if isinstance(law := mechanisms[name], UnlistedLaw) and law.description.acts_on in factors
    ]
    if not laws:
        return np.zeros(1)
    other_names = tuple(name for name in names if name not in laws)
    with_law, without = (
        problem.hypothesis(mechanism_names, has_position_scatter=False, all_lines=True)
        for mechanism_names in (names, other_names)
    )
    fit = np.zeros(len(without.model.parameters))
    for name, span in parameter_slices(other_names, without.lines).items():
        fit[span] = explanation.coordinates(name)
    fit[without.mechanism_parameter_count :] = explanation.point.fit[with_law.mechanism_parameter_count :]
    here, there = (
        np.abs(hypothesis.model.predict(at).value)
        for hypothesis, at in ((with_law, explanation.point.fit), (without, fit))
    )
    nonzero = (there > 0) & (here > 0)
    shares = (np.arange(_LEVELS) + 0.5) / _LEVELS
    return np.quantile(np.log(here[nonzero] / there[nonzero]), shares)


def presence(search: Search, present: Mapping[str, float]) -> list[dict[str, Any]]:
    """Groups of mechanisms that these recordings cannot tell apart, and the posterior that one of each group acts.

    Two mechanisms are in a group where some answer is as good with one in place of the other. `present` is the
    posterior of each mechanism, used for groups of one.
    """
    groups = []
    for group in _groups(search):
        together = sum(answer.probability for answer in search.answers if set(group) & set(answer.names))
        groups.append((present.get(group[0], 0.0) if len(group) == 1 else together, group))
    groups.sort(key=lambda ranked: (-ranked[0], ranked[1]))
    return [
        {"mechanisms": group, "probability": round(probability, 3)}
        for rank, (probability, group) in enumerate(groups)
        if rank < MOST_NAMED or probability >= NAMED
    ]


def present(search: Search) -> dict[str, float]:
    """The posterior of each mechanism, including answers where it acts together with an unlisted law."""
    named = search.explanations[0].best.hypothesis.lines.mechanisms.named
    probabilities: dict[str, float] = {}
    for answer in search.answers:
        parts = [(answer.names, 1.0)]
        if answer.explanation is None:
            parts = [(tuple(filter(named.__contains__, law.names)), share) for law, share in law_shares(search)]
        for names, share in parts:
            for name in names:
                probabilities[name] = probabilities.get(name, 0.0) + answer.probability * share
    return probabilities


def _groups(search: Search) -> list[list[str]]:
    evidence = {
        frozenset(answer.explanation.names): answer.explanation.log_evidence
        for answer in search.answers
        if answer.explanation is not None and answer.probability > COUNTS
    }
    groups = [{name} for name in sorted({name for mechanisms in evidence for name in mechanisms})]
    for first, log_evidence in evidence.items():
        for second, other in evidence.items():
            if len(first - second) != 1 or len(second - first) != 1 or abs(log_evidence - other) >= _TWINS:
                continue
            twins = [group for group in groups if group & (first ^ second)]
            if len(twins) == 2:
                twins[0].update(twins[1])
                groups.remove(twins[1])
    return [sorted(group) for group in groups]


def alike(search: Search, problem: FittingProblem, floor_percent: float) -> dict[str, Any] | None:
    """The rivals of the leading answer whose predictions differ from its own by less than half the noise, and their
    total probability; None where that is too small, or there are no such rivals."""
    leader = search.answers[0]
    if leader.explanation is None or not leader.explanation.names or leader.probability >= EXPLAINED:
        return None
    predicted = row_prediction(problem, leader.explanation)
    size = float((np.abs(predicted) ** 2).sum())
    total, rivals, furthest = leader.probability, [], 0.0
    for answer in search.answers[1:]:
        if answer.explanation is None or answer.probability < COUNTS or not answer.explanation.names:
            continue
        off = np.abs(row_prediction(problem, answer.explanation) - predicted) ** 2
        percent = 100 * float(np.sqrt(off.sum() / size))
        if percent < _ALIKE * floor_percent:
            total += answer.probability
            furthest = max(furthest, percent)
            rivals.append(list(answer.names))
    if total < CERTAIN or not rivals:
        return None
    return {"probability": round(total, 3), "rivals": rivals, "differ_percent": rounded(furthest, 2)}


def alike_clause(document: Mapping[str, Any]) -> str:
    """A clause saying that any of several answers may serve as a model."""
    return (
        f"all that hold {100 * document['probability']:.1f} % predict these recordings alike, to "
        f"{document['differ_percent']:g} %: as a model any of them serves within what was measured"
    )


def idealised(search: Search, problem: FittingProblem, shown: Explanation, measured: str) -> list[dict[str, Any]]:
    """Laws without a free parameter that the base model idealises: their posteriors over all answers, and their effect
    on the response of `shown`, root mean square in percent of it.

    The prior odds of a law are even under every answer; in an answer that does not name it, its share is by the
    evidence.
    """
    named = problem.lines.mechanisms.named
    stated = {frozenset(answer.names) for answer in search.answers}
    return [
        {
            "name": name,
            "probability": round(sum(_joint(answer, problem, name, stated, measured) for answer in search.answers), 3),
            "effect_percent": rounded(_effect_percent(problem, shown, name), 2),
        }
        for name in named
        if name in declared_laws(problem.lines) and name not in search.unsupported
    ]


def _joint(
    answer: Answer, problem: FittingProblem, name: str, stated: Collection[frozenset[str]], measured: str
) -> float:
    """The joint posterior of an answer and the law; 0 where the answer with the law is itself in `stated`.

    `measured` is any parameter of the model.
    """
    if answer.explanation is None or name in answer.names:
        return answer.probability * (0.5 if answer.explanation is None else 1.0)
    with_law = frozenset({name, *answer.explanation.names, *answer.alone})
    if answer.probability < HIDES or with_law in stated:
        return 0.0
    normals = with_hidden_mechanism(problem, answer.explanation, name, measured)
    odds = 0.0 if normals is None else float(normals.share.sum())
    return answer.probability * odds / (1 + odds)


def _effect_percent(problem: FittingProblem, shown: Explanation, name: str) -> float:
    """Effect of a law on the response [%]; the models with and without it have the same parameters."""
    without = tuple(other for other in shown.names if other != name)
    order = [other for other in problem.lines.mechanisms if other in {*without, name}]
    models = [problem.hypothesis(names, has_position_scatter=False).model for names in (without, tuple(order))]
    before, after = (model.predict(shown.point.fit).value for model in models)
    change, size = (float(np.linalg.norm(of)) for of in (after - before, before))
    return 100 * change / max(size, 1e-300)


_SPREAD = "sensor_spread"
_LEAST = 0.1  # of d33: sensors of one skin differ by some percent
_OUTLIER_SDS = 3.0  # standard deviations, both of the sensors (from the median absolute deviation) and of its own d33


def outlying_sensors(problem: FittingProblem, shown: Explanation) -> str:
    """A clause on the sensors whose d33 lies far from the others'; empty where none does, or without sensor spread."""
    if _SPREAD not in shown.names:
        return ""
    levels = shown.best.levels
    of_recordings = Residuals.of(problem, shown, levels.gain, levels.position)
    indices, sensor = np.unique(problem.lines.sensor, return_inverse=True)
    if len(indices) < LEAST_LEVELS:
        return ""
    weight = of_recordings.gain_deviation**-2
    total = np.bincount(sensor, weight)
    value = 1 + np.bincount(sensor, weight * of_recordings.gain) / total
    median = float(np.median(value))
    off, deviation = value / median - 1, total**-0.5 / median
    spread = ROBUST * float(np.median(np.abs(off)))
    far = np.abs(off) > np.maximum(_LEAST, _OUTLIER_SDS * np.maximum(spread, deviation))
    rows = np.flatnonzero(far)[np.argsort(-np.abs(off[far]), kind="stable")][:MOST_NAMED].tolist()
    names = [problem.lines.campaign.skin.sensors[index].id for index in indices.tolist()]
    return ", ".join(_clause(names[row], off[row], deviation[row]) for row in rows)


def _clause(sensor: str, off: float, deviation: float) -> str:
    low, high = sorted(100 * abs(off + end * SDS_OF_95 * deviation) for end in (-1, 1))
    side = "below" if off < 0 else "above"
    return f"d33 of sensor {sensor} is {100 * abs(off):.0f} % {side} the others' ({low:.0f} to {high:.0f})"
