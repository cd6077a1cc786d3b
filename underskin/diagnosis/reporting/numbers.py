"""Numbers of a report: rounding, parameters with 95 % intervals, parameters at bounds, d33 over all answers.

- A parameter at a bound of its search is no result: a set of mechanisms that holds one explains nothing, and its d33 is
  not to be quoted. A bound beyond which there is nothing, or at which a mechanism has no effect, does not count
  (`Parameter.ends_search`).
- The level at which the factor of an unlisted law is 1 is a convention of its form. A resonance may leave the low
  frequencies as they are, or the high ones: both fit equally well, and d33 differs by what the law does in between. d33
  is therefore averaged over the law's factor at all rows (`law_levels`).
- Summaries over all surviving answers: the probability of each mechanism, d33, answers with the same predictions, and
  laws without a free parameter that declared facts imply (such as the layer's) but the base model idealises.
- Sensors whose d33 lies far from the others'.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.evidence import (
    levels_covariance,
    marginalise_sensor_spread,
    profile_end,
)
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.inference.residuals import declared_d33, residuals, row_prediction, with_hidden_mechanism
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import SHOWS, UNSEEN_ODDS, declared_laws
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_digits
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.unlisted.laws import UnlistedLaw, in_plain_words
from underskin.units import Floats, Indices

SDS_OF_95 = float(ndtri(0.975))  # half the width of a 95 % interval in standard deviations


def rounded(value: float, digits: int = 4) -> float | None:
    """The value to significant digits; None if it is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def mixture_quantile(level: float, shares: Floats, means: Floats, deviations: Floats) -> float:
    """A quantile of a mixture of normal distributions (parts,), whose `shares` sum to 1."""

    def beyond(at: float) -> float:
        return float(shares @ ndtr((at - means) / deviations) - level)

    far = 8 * deviations.max()
    return float(brentq(beyond, means.min() - far, means.max() + far))


def with_hidden(
    modulus: Mapping[str, Any], hidden: Sequence[tuple[float, float]], tolerance: float = 0.0
) -> dict[str, Any]:
    """A modulus with its 95 % interval, whose logarithm may be too large by the `hidden` values with their
    probabilities, and differs from that sought with the standard deviation `tolerance`."""
    if len(hidden) == 1 and tolerance == 0:
        return dict(modulus)
    deviation = np.log(modulus["high"] / modulus["low"]) / (2 * SDS_OF_95)
    excess, shares = np.array(hidden).T
    means, deviations = np.log(modulus["value"]) - excess, np.full(len(excess), np.hypot(deviation, tolerance))
    levels = {"value": 0.5, "low": 0.025, "high": 0.975}
    ends = {key: np.exp(mixture_quantile(level, shares, means, deviations)) for key, level in levels.items()}
    return {**modulus, **{key: rounded(float(at)) for key, at in ends.items()}}


def parameter_index(explanation: Explanation, name: str) -> int:
    """The index of a parameter in the explanation's model."""
    return [parameter.name for parameter in explanation.model.parameters].index(name)


def parameter_with_interval(explanation: Explanation, index: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval within its bounds: ±1.96 standard deviations.

    Where the interval would include the value at which a mechanism has no effect, but the profile of the posterior
    falls off before it, the profile gives the end. `at_bound`, `low` or `high`, is present where the value lies at or
    beyond that end of its search.
    """
    best, point = explanation.best, explanation.point
    parameter = explanation.model.parameters[index]
    if parameter.moves_covariance:
        row = [other.name for other in best.hypothesis.covariance].index(parameter.name)
        variance = float(levels_covariance(best.fitter.covariance_equations(best.at)[1][0])[row, row])
    else:
        row = best.hypothesis.mean_indices.index(index)
        variance = float(explanation.best.covariance[row, row])
    half_width = SDS_OF_95 * np.sqrt(max(variance, 0.0))
    low, high = parameter.bounds
    middle = float(point.fit[index])
    ends = [max(middle - half_width, low), min(middle + half_width, high)]
    limit = None if parameter.moves_covariance else parameter.fit_limit
    if limit is not None and ends[0] <= limit <= ends[1] and limit != middle:
        side = 0 if limit < middle else 1
        end = profile_end(best, index, limit)
        ends[side] = ends[side] if end is None else end
    values = [parameter.from_fit(at) for at in (middle, *ends)]
    if parameter.relative_to is not None:
        values = _absolute(explanation, index, values)
    stated = zip(("value", "low", "high"), values, strict=True)
    at_bound = parameter.ends_search(middle)
    return {
        "name": parameter.name,
        "unit": parameter.unit,
        **{key: rounded(float(value)) for key, value in stated},
        **({} if at_bound is None else {"at_bound": at_bound}),
    }


def multiple_of(explanation: Explanation, parameter: Parameter) -> float:
    """The unit of a parameter's bounds and prior: 1, or the value of the parameter that it is relative to."""
    if parameter.relative_to is None:
        return 1.0
    other = parameter_index(explanation, parameter.relative_to)
    return explanation.model.parameters[other].from_fit(float(explanation.point.fit[other]))


def without_effect(explanation: Explanation) -> list[str]:
    """The mechanisms whose every strength may be zero: its 95 % interval holds the value without effect.

    A strength is a parameter with such a value (`limit`); on a logarithmic scale none reaches 0 or ∞.
    """
    idle = []
    for name, span in parameter_slices(explanation.names, explanation.best.hypothesis.lines).items():
        indices = range(span.start, span.stop)
        strengths = [index for index in indices if explanation.model.parameters[index].limit is not None]
        if strengths and all(_holds_limit(explanation, index) for index in strengths):
            idle.append(name)
    return idle


def _holds_limit(explanation: Explanation, index: int) -> bool:
    stated, limit = parameter_with_interval(explanation, index), explanation.model.parameters[index].limit
    return limit is not None and bool(stated["low"] <= limit <= stated["high"])


def _absolute(explanation: Explanation, index: int, multiples: list[float]) -> list[float]:
    """The value of a parameter that is fitted as a multiple of another one, both on logarithmic scales.

    The interval is that of the product, cut off at the bounds of the multiple.
    """
    best, parameter = explanation.best, explanation.model.parameters[index]
    assert parameter.relative_to is not None
    other = parameter_index(explanation, parameter.relative_to)
    rows = [best.hypothesis.mean_indices.index(i) for i in (index, other)]
    deviation = float(np.sqrt(max(best.covariance[np.ix_(rows, rows)].sum(), 0.0)))
    unit = float(np.exp(explanation.point.fit[other]))
    factor = np.exp(SDS_OF_95 * deviation)
    value = multiples[0] * unit
    return [value, max(value / factor, min(parameter.low * unit, value)), min(value * factor, parameter.high * unit)]


_MEASURED = ("d33", "youngs_modulus")  # free parameters that belong to no mechanism


@dataclass(frozen=True)
class AtBound:
    """A parameter at the `end` of its search, `low` to `high` in `unit`; `mechanism` in words, or the base model."""

    mechanism: str
    parameter: str
    low: float
    high: float
    unit: str
    end: float

    @property
    def words(self) -> str:
        """The reason why a value is no result: "timing delay: delay at or beyond 5000 µs"."""
        value = f"{in_digits(self.end, 3)} {self.unit.strip('-')}".rstrip()
        parameter_words = self.parameter.replace("_", " ")
        return f"{self.mechanism.replace('_', ' ')}: {parameter_words} at or beyond {value}, where its search ends"

    @property
    def finding(self) -> Finding:
        """The same as a finding."""
        arguments = {"mechanism": self.mechanism, "parameter": self.parameter}
        bounds = {"low": self.low, "high": self.high, "unit": self.unit}
        return Finding(Reason.PARAMETER_AT_BOUND, "", self.parameter, {**arguments, **bounds})


def at_bounds(explanation: Explanation) -> Sequence[AtBound]:
    """Parameters at bounds: those of an explanation's mechanisms, d33, and an undeclared modulus."""
    spans = parameter_slices(explanation.names, explanation.best.hypothesis.lines)
    mechanisms = explanation.best.hypothesis.lines.mechanisms
    owner = {index: mechanisms[name] for name, span in spans.items() for index in range(span.start, span.stop)}
    bounds = []
    for index, (parameter, fit) in enumerate(zip(explanation.model.parameters, explanation.point.fit, strict=True)):
        if index not in owner and (parameter.name not in _MEASURED or parameter.unit == "-"):
            continue
        side = parameter.ends_search(float(fit))
        if side is not None:
            mechanism_words = in_plain_words(owner[index]) if index in owner else "base model"
            bounds.append(_at_bound(explanation, parameter, mechanism_words, side))
    return bounds


def _at_bound(explanation: Explanation, parameter: Parameter, mechanism: str, side: str) -> AtBound:
    scale = multiple_of(explanation, parameter)
    low, high = scale * parameter.low, scale * parameter.high
    end = low if side == "low" else high
    return AtBound(mechanism, parameter.name.removeprefix("law_"), low, high, parameter.unit, end)


_LEVELS = 9  # quantiles over the rows
_FACTORS = ("gain", "frequency_response")


def law_levels(problem: FittingProblem, explanation: Explanation) -> Floats:
    """Logarithms of equally probable factors on d33 (levels,) from the reference level of unlisted laws; only 0 where
    no law is a factor."""
    mechanisms, names = problem.lines.mechanisms, explanation.names
    laws = [
        law
        for name in names
        if isinstance(law := mechanisms[name], UnlistedLaw) and law.description.acts_on in _FACTORS
    ]
    if not laws:
        return np.zeros(1)
    other_names = tuple(name for name in names if all(name != law.name for law in laws))
    with_law, without = (
        problem.hypothesis(mechanism_names, has_position_scatter=False, all_lines=True)
        for mechanism_names in (names, other_names)
    )
    fit = np.zeros(len(without.model.parameters))
    for name, span in parameter_slices(other_names, without.lines).items():
        fit[span] = explanation.coordinates(name)
    fit[without.mechanism_parameter_count :] = explanation.point.fit[with_law.mechanism_parameter_count :]
    here, there = (
        np.abs(hypothesis.frf_model.predict(at, slopes=False, place=False).value)
        for hypothesis, at in ((with_law, explanation.point.fit), (without, fit))
    )
    nonzero = (there > 0) & (here > 0)
    shares = (np.arange(_LEVELS) + 0.5) / _LEVELS
    return np.quantile(np.log(here[nonzero] / there[nonzero]), shares)


_COUNTS = 0.003  # probability below which an answer is left out of averages
_WORTH_MORE = 0.03  # probability of an answer below which mechanisms hidden under it are neglected
_TWINS = 2.0  # nats: largest difference between sets with either of two indistinguishable mechanisms
_NAMED, _LEAST_NAMED = 0.02, 3  # probability from which a group is listed, and the least number listed
_ALIKE = 0.5  # of the noise: answers that differ by less have the same predictions
_ENOUGH_ALIKE = 0.95


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
        if rank < _LEAST_NAMED or probability >= _NAMED
    ]


def present(search: Search, problem: FittingProblem) -> dict[str, float]:
    """The posterior of each mechanism, including answers where it acts together with an unlisted law."""
    probabilities: dict[str, float] = {}
    for answer in search.answers:
        if answer.explanation is not None:
            for name in answer.names:
                probabilities[name] = probabilities.get(name, 0.0) + answer.probability
            continue
        total = np.logaddexp.reduce([weight for _, weight in search.weighed_laws]) if search.weighed_laws else 0.0
        for explanation, weight in search.weighed_laws:
            for name in explanation.names:
                if name in problem.lines.mechanisms.named:
                    share = answer.probability * float(np.exp(weight - total))
                    probabilities[name] = probabilities.get(name, 0.0) + share
    return probabilities


def _groups(search: Search) -> list[list[str]]:
    standing = [
        answer.explanation
        for answer in search.answers
        if answer.explanation is not None and answer.probability > _COUNTS
    ]
    evidence = {frozenset(explanation.names): explanation.log_evidence for explanation in standing}
    names = sorted({name for mechanisms in evidence for name in mechanisms})
    groups = [{name} for name in names]
    for twin, other_twin in _twins(evidence):
        first, second = (next(group for group in groups if name in group) for name in (twin, other_twin))
        if first is not second:
            first |= second
            groups.remove(second)
    return [sorted(group) for group in groups]


def _twins(evidence: Mapping[frozenset[str], float]) -> list[tuple[str, str]]:
    pairs = []
    for first, log_evidence in evidence.items():
        for second, other in evidence.items():
            difference = first ^ second
            if len(first) == len(second) and len(difference) == 2 and abs(log_evidence - other) < _TWINS:
                (mine,), (others,) = first - second, second - first
                pairs.append((mine, others))
    return pairs


def d33(search: Search, problem: FittingProblem, unsure: float = 0.0) -> dict[str, Any] | None:
    """The median and the 95 % interval of d33 over all answers, weighted with their probabilities and allowing for
    mechanisms that would not show; None where answers without d33 are more probable than all others.

    The tolerances of the skin's declared values widen the interval, but not `relative`, which is for comparing sensors,
    dates and spheres. `unsure` is a further relative standard uncertainty.
    """
    by_explanation: dict[int, tuple[float, Explanation]] = {}  # curves' own mechanisms do not change d33
    for probability, explanation in (pair for answer in search.answers for pair in _stand_on(search, answer)):
        by_explanation[id(explanation)] = (
            probability + by_explanation.get(id(explanation), (0.0, explanation))[0],
            explanation,
        )
    weighted = [pair for pair in by_explanation.values() if pair[0] > _COUNTS]
    total = sum(probability for probability, _ in weighted)
    if total < 0.5:
        return None
    parts = [
        _d33_under(search, problem, explanation, probability).times(probability)
        for probability, explanation in weighted
    ]
    mixture = NormalMixture.joined(parts)
    declared = np.concatenate(
        [
            np.full(len(part.share), declared_d33(problem, explanation))
            for part, (_, explanation) in zip(parts, weighted, strict=True)
        ]
    )
    shares = mixture.share / mixture.share.sum()

    def ends(deviation: Floats) -> dict[str, float | None]:
        levels = {"value": 0.5, "low": 0.025, "high": 0.975}
        at = {key: mixture_quantile(level, shares, mixture.mean, deviation) for key, level in levels.items()}
        return {key: rounded(float(np.exp(logarithm))) for key, logarithm in at.items()}

    relative = np.hypot(mixture.deviation, unsure)
    unit = weighted[0][1].model.parameters[parameter_index(weighted[0][1], "d33")].unit
    relative_ends = ends(relative)
    return {
        "name": "d33",
        "unit": unit,
        **ends(np.hypot(relative, declared)),
        "relative": {key: relative_ends[key] for key in ("low", "high")},
    }


def _d33_under(search: Search, problem: FittingProblem, explanation: Explanation, probability: float) -> NormalMixture:
    """ln d33 under an answer, at each reference level of its laws, and with one more mechanism that does not show; the
    shares sum to 1."""
    index = parameter_index(explanation, "d33")
    best = explanation.best
    spread = marginalise_sensor_spread(best.fitter, best.at, index)
    if spread is None:
        row = best.hypothesis.mean_indices.index(index)
        deviation = np.sqrt(best.covariance[row, row])
        spread = [NormalMixture(np.ones(1), explanation.point.fit[index : index + 1], np.array([deviation]))]
    several = list(spread)
    if probability > _WORTH_MORE:
        sets_of_answers = {
            frozenset(answer.explanation.names) for answer in search.answers if answer.explanation is not None
        }
        others = [name for name in problem.lines.mechanisms.named if {name, *explanation.names} not in sets_of_answers]
        odds = UNSEEN_ODDS / max(search.supported - len(explanation.names), 1)
        for name in others:
            with_mechanism = (
                None if name in explanation.names else with_hidden_mechanism(problem, explanation, name, "d33")
            )
            if with_mechanism is not None:  # a law that declared facts imply has even odds, weighted by its fit
                several.append(
                    with_mechanism
                    if name in declared_laws(problem.lines)
                    else with_mechanism.times(odds * _as_unseen(with_mechanism))
                )
    mixture = NormalMixture.joined(several)
    mixture = mixture.times(1 / float(mixture.share.sum()))
    levels = law_levels(problem, explanation)
    return NormalMixture.joined([mixture.moved(level).times(1 / len(levels)) for level in levels.tolist()])


def _as_unseen(normals: NormalMixture) -> float:
    """The factor that limits a mechanism's shares to those of one that does not show, as no answer holds it."""
    return min(1.0, float(np.exp(SHOWS) / normals.share.sum()))


def _stand_on(search: Search, answer: Answer) -> list[tuple[float, Explanation]]:
    """The explanations of an answer with their probabilities.

    Those of `none_of_these` are all supported unlisted laws, which may predict the same and differ in d33.
    """
    if answer.explanation is not None:
        return [(answer.probability, answer.explanation)]
    laws = [explanation for explanation in search.laws if search.is_supported(explanation)]
    weights = np.array([search.log_weight(explanation) for explanation in laws])
    shares = np.exp(weights - np.logaddexp.reduce(weights)) if laws else weights
    return [(answer.probability * float(share), explanation) for share, explanation in zip(shares, laws, strict=True)]


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
        if answer.explanation is None or answer.probability < _COUNTS or not answer.explanation.names:
            continue
        off = np.abs(row_prediction(problem, answer.explanation) - predicted) ** 2
        percent = 100 * float(np.sqrt(off.sum() / size))
        if percent < _ALIKE * floor_percent:
            total += answer.probability
            furthest = max(furthest, percent)
            rivals.append(list(answer.names))
    if total < _ENOUGH_ALIKE or not rivals:
        return None
    return {"probability": round(total, 3), "rivals": rivals, "differ_percent": rounded(furthest, 2)}


def alike_clause(document: Mapping[str, Any]) -> str:
    """A clause saying that any of several answers may serve as a model."""
    return (
        f"all that hold {100 * document['probability']:.1f} % predict these recordings alike, to "
        f"{document['differ_percent']:g} %: as a model any of them serves within what was measured"
    )


_LEAST_ASKED = 0.03  # probability below which an answer without the law contributes none to it


def idealised(search: Search, problem: FittingProblem, shown: Explanation) -> list[dict[str, Any]]:
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
            "probability": round(sum(_probability(answer, problem, name, stated) for answer in search.answers), 3),
            "effect_percent": rounded(_effect_percent(problem, shown, name), 2),
        }
        for name in named
        if name in declared_laws(problem.lines) and name not in search.unsupported
    ]


def _probability(answer: Answer, problem: FittingProblem, name: str, stated: Collection[frozenset[str]]) -> float:
    """The joint posterior of an answer and the law; 0 where the answer with the law is itself in `stated`."""
    if answer.explanation is None or name in answer.names:
        return answer.probability * (0.5 if answer.explanation is None else 1.0)
    with_law = frozenset({name, *answer.explanation.names, *answer.alone})
    if answer.probability < _LEAST_ASKED or with_law in stated:
        return 0.0
    measured = "youngs_modulus" if problem.lines.curves else "d33"
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
_LEAST_SENSORS = 4
_LEAST = 0.1  # of d33: sensors of one skin differ by some percent
_OUTLIER_SDS = 3.0  # standard deviations, both of the sensors (from the median absolute deviation) and of its own d33
_ROBUST = 1.4826  # standard deviation of a normal distribution over its median absolute deviation
_MOST = 3  # sensors named


def outlying_sensors(problem: FittingProblem, shown: Explanation) -> str:
    """A clause on the sensors whose d33 lies far from the others'; empty where none does, or without sensor spread."""
    if _SPREAD not in shown.names or problem.kind != "frf":
        return ""
    indices, off, deviation = _sensor_deviations(problem, shown)
    if len(off) < _LEAST_SENSORS:
        return ""
    spread = _ROBUST * float(np.median(np.abs(off)))
    far = np.abs(off) > np.maximum(_LEAST, _OUTLIER_SDS * np.maximum(spread, deviation))
    rows = np.flatnonzero(far)[np.argsort(-np.abs(off[far]), kind="stable")].tolist()
    names = [problem.lines.campaign.skin.sensors[index].id for index in indices.tolist()]
    return ", ".join(_clause(names[row], off[row], deviation[row]) for row in rows[:_MOST])


def _sensor_deviations(problem: FittingProblem, shown: Explanation) -> tuple[Indices, Floats, Floats]:
    """Indices of the sensors, d33 of each over the median minus 1, and its standard deviation."""
    levels = shown.best.levels
    sensor_residuals = residuals(problem, shown, levels.gain, levels.position)
    indices, sensor = np.unique(problem.lines.sensor, return_inverse=True)
    weight = sensor_residuals.gain_deviation**-2
    total = np.bincount(sensor, weight)
    value = 1 + np.bincount(sensor, weight * sensor_residuals.gain) / total
    median = float(np.median(value))
    return indices, value / median - 1, np.asarray(total**-0.5 / median, dtype=float)


def _clause(sensor: str, off: float, deviation: float) -> str:
    low, high = sorted(100 * abs(off + end * SDS_OF_95 * deviation) for end in (-1, 1))
    side = "below" if off < 0 else "above"
    return f"d33 of sensor {sensor} is {100 * abs(off):.0f} % {side} the others' ({low:.0f} to {high:.0f})"
