"""Numbers of a report, with their intervals.

Numbers as a report states them: rounded to stated digits, parameters with their 95 % intervals.

Parameters of an explanation that lie at a bound of their search: at that value or beyond, and so no result.

A set of mechanisms that holds one explains nothing, and its d33 is not to be quoted. A bound beyond which there is
nothing, or at which a mechanism does nothing, is none (`Parameter.ends_search`).

The level that a law which nobody listed refers to: where its factor is 1 is a convention of its form.

A resonance beside the response may leave the low frequencies as they are, or the high ones: both fit alike, and d33
differs by what the law does between them. So d33 may be that of any line, or any recording.

What all surviving answers say together: which mechanisms are there, d33, and whether they predict alike. What the base
model idealises although declared facts say it: laws without a free parameter, such as the layer's. Which sensors stand
apart in d33 where sensors differ: a clause that names them, since a spread names none.
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
    """To significant digits; None for what is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def mixture_quantile(level: float, shares: Floats, means: Floats, deviations: Floats) -> float:
    """Of a mixture of normal distributions, whose `shares` sum to 1, (parts,)."""

    def beyond(at: float) -> float:
        return float(shares @ ndtr((at - means) / deviations) - level)

    far = 8 * deviations.max()
    return float(brentq(beyond, means.min() - far, means.max() + far))


def with_hidden(
    modulus: Mapping[str, Any], hidden: Sequence[tuple[float, float]], tolerance: float = 0.0
) -> dict[str, Any]:
    """A modulus with its 95 % interval, of which the logarithm may be too large by `hidden` values with probabilities,
    and differs by a standard deviation of `tolerance` from the one sought."""
    if len(hidden) == 1 and tolerance == 0:
        return dict(modulus)
    deviation = np.log(modulus["high"] / modulus["low"]) / (2 * SDS_OF_95)
    excess, shares = np.array(hidden).T
    means, deviations = np.log(modulus["value"]) - excess, np.full(len(excess), np.hypot(deviation, tolerance))
    levels = {"value": 0.5, "low": 0.025, "high": 0.975}
    ends = {key: np.exp(mixture_quantile(level, shares, means, deviations)) for key, level in levels.items()}
    return {**modulus, **{key: rounded(float(at)) for key, at in ends.items()}}


def place_of(explanation: Explanation, name: str) -> int:
    """Where in its model's parameters one is."""
    return [entry.name for entry in explanation.model.parameters].index(name)


def parameter(explanation: Explanation, place: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval, within its bounds: 1.96 standard deviations either way.

    Where these reach the value at which a mechanism does nothing, and the profile of the posterior falls off before it,
    the interval ends where the profile does. `at_bound` is the end of its search that it lies at or beyond, `low` or
    `high`, where it does.
    """
    best, point = explanation.best, explanation.point
    entry = explanation.model.parameters[place]
    if entry.moves_covariance:
        own = [parameter.name for parameter in best.hypothesis.covariance].index(entry.name)
        variance = float(levels_covariance(best.fitter.covariance_equations(best.at)[1][0])[own, own])
    else:
        index = best.hypothesis.mean_indices.index(place)
        variance = float(explanation.best.covariance[index, index])
    half_width = SDS_OF_95 * np.sqrt(max(variance, 0.0))
    low, high = entry.bounds
    middle = float(point.fit[place])
    ends = [max(middle - half_width, low), min(middle + half_width, high)]
    limit = None if entry.moves_covariance else entry.fit_limit
    if limit is not None and ends[0] <= limit <= ends[1] and limit != middle:
        side = 0 if limit < middle else 1
        end = profile_end(best, place, limit)
        ends[side] = ends[side] if end is None else end
    values = [entry.from_fit(at) for at in (middle, *ends)]
    if entry.relative_to is not None:
        values = _absolute(explanation, place, values)
    stated = zip(("value", "low", "high"), values, strict=True)
    at_bound = entry.ends_search(middle)
    return {
        "name": entry.name,
        "unit": entry.unit,
        **{key: rounded(float(value)) for key, value in stated},
        **({} if at_bound is None else {"at_bound": at_bound}),
    }


def multiple_of(explanation: Explanation, entry: Parameter) -> float:
    """The value that a parameter's bounds and prior are multiples of: 1, or that of the one it is relative to."""
    if entry.relative_to is None:
        return 1.0
    other = place_of(explanation, entry.relative_to)
    return explanation.model.parameters[other].from_fit(float(explanation.point.fit[other]))


def without_effect(explanation: Explanation) -> list[str]:
    """Its mechanisms of which the 95 % interval of every strength holds the value at which the mechanism does nothing.

    A strength is a parameter with such a value (`limit`); on a logarithmic scale none reaches 0 or ∞.
    """
    idle = []
    for name, place in parameter_slices(explanation.names, explanation.best.hypothesis.lines).items():
        own = range(place.start, place.stop)
        strengths = [index for index in own if explanation.model.parameters[index].limit is not None]
        if strengths and all(_holds_limit(explanation, index) for index in strengths):
            idle.append(name)
    return idle


def _holds_limit(explanation: Explanation, place: int) -> bool:
    stated, limit = parameter(explanation, place), explanation.model.parameters[place].limit
    return limit is not None and bool(stated["low"] <= limit <= stated["high"])


def _absolute(explanation: Explanation, place: int, multiples: list[float]) -> list[float]:
    """A parameter that is fitted as a multiple of another, as their product; both on logarithmic scales.

    The interval is that of the product, cut off where the multiple has its bounds.
    """
    best, entry = explanation.best, explanation.model.parameters[place]
    assert entry.relative_to is not None
    other = place_of(explanation, entry.relative_to)
    places = [best.hypothesis.mean_indices.index(one) for one in (place, other)]
    deviation = float(np.sqrt(max(best.covariance[np.ix_(places, places)].sum(), 0.0)))
    unit = float(np.exp(explanation.point.fit[other]))
    factor = np.exp(SDS_OF_95 * deviation)
    value = multiples[0] * unit
    return [value, max(value / factor, min(entry.low * unit, value)), min(value * factor, entry.high * unit)]


_MEASURED = ("d33", "youngs_modulus")  # that belong to no mechanism, where they are free


@dataclass(frozen=True)
class AtBound:
    """A parameter at an end of its search, `low` to `high` in `unit`; `mechanism` in plain words, or the base model."""

    mechanism: str
    parameter: str
    low: float
    high: float
    unit: str
    end: float

    @property
    def words(self) -> str:
        """As the reason why something is no result: "timing delay: delay at or beyond 5000 µs"."""
        value = f"{in_digits(self.end, 3)} {self.unit.strip('-')}".rstrip()
        called = self.parameter.replace("_", " ")
        return f"{self.mechanism.replace('_', ' ')}: {called} at or beyond {value}, where its search ends"

    @property
    def finding(self) -> Finding:
        """The same among the findings."""
        arguments = {"mechanism": self.mechanism, "parameter": self.parameter}
        bounds = {"low": self.low, "high": self.high, "unit": self.unit}
        return Finding(Reason.PARAMETER_AT_BOUND, "", self.parameter, {**arguments, **bounds})


def at_bounds(explanation: Explanation) -> Sequence[AtBound]:
    """Those of an explanation's mechanisms, and of d33 and a modulus that nobody declared."""
    places = parameter_slices(explanation.names, explanation.best.hypothesis.lines)
    known = explanation.best.hypothesis.lines.mechanisms
    owner = {index: known[name] for name, place in places.items() for index in range(place.start, place.stop)}
    found = []
    for index, (entry, fit) in enumerate(zip(explanation.model.parameters, explanation.point.fit, strict=True)):
        if index not in owner and (entry.name not in _MEASURED or entry.unit == "-"):
            continue
        side = entry.ends_search(float(fit))
        if side is not None:
            called = in_plain_words(owner[index]) if index in owner else "base model"
            found.append(_at_bound(explanation, entry, called, side))
    return found


def _at_bound(explanation: Explanation, entry: Parameter, mechanism: str, side: str) -> AtBound:
    scale = multiple_of(explanation, entry)
    low, high = scale * entry.low, scale * entry.high
    end = low if side == "low" else high
    return AtBound(mechanism, entry.name.removeprefix("law_"), low, high, entry.unit, end)


_LEVELS = 9  # evenly over the rows
_FACTORS = ("gain", "frequency_response")


def law_levels(problem: FittingProblem, explanation: Explanation) -> Floats:
    """Logarithms of the factors (levels,) by which d33 may be another, equally probable; 0 alone where no law is a
    factor."""
    known, names = problem.lines.mechanisms, explanation.names
    laws = [
        law for name in names if isinstance(law := known[name], UnlistedLaw) and law.description.acts_on in _FACTORS
    ]
    if not laws:
        return np.zeros(1)
    left = tuple(name for name in names if all(name != law.name for law in laws))
    with_law, without = (problem.hypothesis(each, has_position_scatter=False, whole=True) for each in (names, left))
    fit = np.zeros(len(without.model.parameters))
    for name, place in parameter_slices(left, without.lines).items():
        fit[place] = explanation.own(name)
    fit[without.mechanism_parameter_count :] = explanation.point.fit[with_law.mechanism_parameter_count :]
    here, there = (
        np.abs(hypothesis.frf_model.predict(at, slopes=False, place=False).value)
        for hypothesis, at in ((with_law, explanation.point.fit), (without, fit))
    )
    some = (there > 0) & (here > 0)
    shares = (np.arange(_LEVELS) + 0.5) / _LEVELS
    return np.quantile(np.log(here[some] / there[some]), shares)


_COUNTS = 0.003  # of the probability, below which an answer is left out of averages
_WORTH_MORE = 0.03  # of the probability, below which what may be there besides an answer is left out
_TWINS = 2.0  # nats by which sets with the one in place of the other differ at most
_NAMED, _LEAST_NAMED = 0.02, 3  # probability of a group that is listed, and how many are at least
_ALIKE = 0.5  # of the noise: answers that differ by less predict alike
_ENOUGH_ALIKE = 0.95


def presence(search: Search, present: Mapping[str, float]) -> list[dict[str, Any]]:
    """Groups of mechanisms that these recordings cannot tell apart, and the posterior that one of each is there.

    Two are in a group where some answer stands as well with the one in place of the other. `present` is the posterior
    of each mechanism, from which that of one alone in its group is taken.
    """
    found = []
    for group in _groups(search):
        together = sum(answer.probability for answer in search.answers if set(group) & set(answer.names))
        found.append((present.get(group[0], 0.0) if len(group) == 1 else together, group))
    found.sort(key=lambda entry: (-entry[0], entry[1]))
    return [
        {"mechanisms": group, "probability": round(probability, 3)}
        for place, (probability, group) in enumerate(found)
        if place < _LEAST_NAMED or probability >= _NAMED
    ]


def present(search: Search, problem: FittingProblem) -> dict[str, float]:
    """The posterior that each mechanism is there, also beside an unlisted law."""
    found: dict[str, float] = {}
    for answer in search.answers:
        if answer.explanation is not None:
            for name in answer.names:
                found[name] = found.get(name, 0.0) + answer.probability
            continue
        laws = [(entry, search.log_weight(entry)) for entry in search.laws if search.is_supported(entry)]
        total = np.logaddexp.reduce([weight for _, weight in laws]) if laws else 0.0
        for entry, weight in laws:
            for name in entry.names:
                if name in problem.lines.mechanisms.named:
                    share = answer.probability * float(np.exp(weight - total))
                    found[name] = found.get(name, 0.0) + share
    return found


def _groups(search: Search) -> list[list[str]]:
    standing = [
        answer.explanation
        for answer in search.answers
        if answer.explanation is not None and answer.probability > _COUNTS
    ]
    evidence = {frozenset(entry.names): entry.log_evidence for entry in standing}
    names = sorted({name for own in evidence for name in own})
    groups = [{name} for name in names]
    for one, two in _twins(evidence):
        first, second = (next(group for group in groups if name in group) for name in (one, two))
        if first is not second:
            first |= second
            groups.remove(second)
    return [sorted(group) for group in groups]


def _twins(evidence: Mapping[frozenset[str], float]) -> list[tuple[str, str]]:
    pairs = []
    for one, log_evidence in evidence.items():
        for two, other in evidence.items():
            apart = one ^ two
            if len(one) == len(two) and len(apart) == 2 and abs(log_evidence - other) < _TWINS:
                (mine,), (others,) = one - two, two - one
                pairs.append((mine, others))
    return pairs


def d33(search: Search, problem: FittingProblem, unsure: float = 0.0) -> dict[str, Any] | None:
    """The median and the 95 % interval of d33 over all answers that have one, each with its probability and with what
    may be there besides without showing; None where what no answer explains is more probable than all of them.

    What the declared values of the skin may be off by widens the interval, and not `relative`, which is for comparing
    sensors, dates and spheres. `unsure` is a further relative standard uncertainty.
    """
    by_explanation: dict[int, tuple[float, Explanation]] = {}  # curves' own mechanisms do not change d33
    for probability, entry in (pair for answer in search.answers for pair in _stand_on(search, answer)):
        by_explanation[id(entry)] = (probability + by_explanation.get(id(entry), (0.0, entry))[0], entry)
    each = [pair for pair in by_explanation.values() if pair[0] > _COUNTS]
    total = sum(probability for probability, _ in each)
    if total < 0.5:
        return None
    parts = [_d33_under(search, problem, entry, probability).times(probability) for probability, entry in each]
    mixture = NormalMixture.joined(parts)
    declared = np.concatenate(
        [np.full(len(part.share), declared_d33(problem, entry)) for part, (_, entry) in zip(parts, each, strict=True)]
    )
    shares = mixture.share / mixture.share.sum()

    def ends(deviation: Floats) -> dict[str, float | None]:
        levels = {"value": 0.5, "low": 0.025, "high": 0.975}
        at = {key: mixture_quantile(level, shares, mixture.mean, deviation) for key, level in levels.items()}
        return {key: rounded(float(np.exp(place))) for key, place in at.items()}

    relative = np.hypot(mixture.deviation, unsure)
    unit = each[0][1].model.parameters[place_of(each[0][1], "d33")].unit
    alone = ends(relative)
    return {
        "name": "d33",
        "unit": unit,
        **ends(np.hypot(relative, declared)),
        "relative": {key: alone[key] for key in ("low", "high")},
    }


def _d33_under(search: Search, problem: FittingProblem, explanation: Explanation, probability: float) -> NormalMixture:
    """ln d33 under an answer, at each level that a law of it may refer to, and with one more mechanism that does not
    show; the shares sum to 1."""
    place = place_of(explanation, "d33")
    best = explanation.best
    spread = marginalise_sensor_spread(best.fitter, best.at, place)
    if spread is None:
        index = best.hypothesis.mean_indices.index(place)
        deviation = np.sqrt(best.covariance[index, index])
        spread = [NormalMixture(np.ones(1), explanation.point.fit[place : place + 1], np.array([deviation]))]
    several = list(spread)
    if probability > _WORTH_MORE:
        known = {frozenset(one.explanation.names) for one in search.answers if one.explanation is not None}
        others = [name for name in problem.lines.mechanisms.named if {name, *explanation.names} not in known]
        odds = UNSEEN_ODDS / max(search.supported - len(explanation.names), 1)
        for name in others:
            found = None if name in explanation.names else with_hidden_mechanism(problem, explanation, name, "d33")
            if found is not None:  # what declared facts say is as probable as its absence, and counts as it fits
                several.append(found if name in declared_laws(problem.lines) else found.times(odds * _as_unseen(found)))
    mixture = NormalMixture.joined(several)
    mixture = mixture.times(1 / float(mixture.share.sum()))
    levels = law_levels(problem, explanation)
    return NormalMixture.joined([mixture.moved(level).times(1 / len(levels)) for level in levels.tolist()])


def _as_unseen(found: NormalMixture) -> float:
    """The factor that takes from a mechanism's shares what it would show by: no set of the answers holds it."""
    return min(1.0, float(np.exp(SHOWS) / found.share.sum()))


def _stand_on(search: Search, answer: Answer) -> list[tuple[float, Explanation]]:
    """The explanations of an answer, each with its probability: of `none_of_these` all laws that nobody listed which
    show, as they may have the same course and differ by what is d33."""
    if answer.explanation is not None:
        return [(answer.probability, answer.explanation)]
    laws = [entry for entry in search.laws if search.is_supported(entry)]
    weights = np.array([search.log_weight(entry) for entry in laws])
    shares = np.exp(weights - np.logaddexp.reduce(weights)) if laws else weights
    return [(answer.probability * float(share), entry) for share, entry in zip(shares, laws, strict=True)]


def alike(search: Search, problem: FittingProblem, floor_percent: float) -> dict[str, Any] | None:
    """The rivals of the leading answer that predict these recordings as it does, by less than half the noise, and the
    probability of all of them; None where that is too little to stand for one answer, or one stands alone."""
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


def alike_clause(found: Mapping[str, Any]) -> str:
    """That one of several answers may serve as a model."""
    return (
        f"all that hold {100 * found['probability']:.1f} % predict these recordings alike, to "
        f"{found['differ_percent']:g} %: as a model any of them serves within what was measured"
    )


_ASKED = 0.03  # of the probability, below which an answer is asked no more than whether it holds the law


def idealised(search: Search, problem: FittingProblem, shown: Explanation) -> list[dict[str, Any]]:
    """Of each such law the posterior that it is there, over all answers, and what it does to the response that is
    `shown`, root mean square in percent of it.

    It has even odds beside its absence under every answer; where it shows too little to be named in one, its share of
    that is by the evidence.
    """
    named = problem.lines.mechanisms.named
    stated = {frozenset(answer.names) for answer in search.answers}
    return [
        {
            "name": name,
            "probability": round(sum(_probability(one, problem, name, stated) for one in search.answers), 3),
            "effect_percent": rounded(_effect_percent(problem, shown, name), 2),
        }
        for name in named
        if name in declared_laws(problem.lines) and name not in search.unsupported
    ]


def _probability(answer: Answer, problem: FittingProblem, name: str, stated: Collection[frozenset[str]]) -> float:
    """The posterior of an answer and the law together; 0 of one beside which the answer with the law is `stated`."""
    if answer.explanation is None or name in answer.names:
        return answer.probability * (0.5 if answer.explanation is None else 1.0)
    with_law = frozenset({name, *answer.explanation.names, *answer.alone})
    if answer.probability < _ASKED or with_law in stated:
        return 0.0
    measured = "youngs_modulus" if problem.lines.curves else "d33"
    found = with_hidden_mechanism(problem, answer.explanation, name, measured)
    odds = 0.0 if found is None else float(found.share.sum())
    return answer.probability * odds / (1 + odds)


def _effect_percent(problem: FittingProblem, shown: Explanation, name: str) -> float:
    """Since the law has no parameter, the models with and without it have the same."""
    without = tuple(one for one in shown.names if one != name)
    order = [one for one in problem.lines.mechanisms if one in {*without, name}]
    models = [problem.hypothesis(names, has_position_scatter=False).model for names in (without, tuple(order))]
    before, after = (model.predict(shown.point.fit).value for model in models)
    change, size = (float(np.linalg.norm(of)) for of in (after - before, before))
    return 100 * change / max(size, 1e-300)


_SPREAD = "sensor_spread"
_LEAST_SENSORS = 4
_LEAST = 0.1  # of d33: sensors of one skin differ by some percent
_APART = 3.0  # standard deviations: of the sensors, by the median absolute deviation, and of its own
_ROBUST = 1.4826  # standard deviations of a normal distribution in its median absolute deviation
_MOST = 3  # that are named


def sensors_apart(problem: FittingProblem, shown: Explanation) -> str:
    """The sensors whose d33 lies far from the others', by how much; empty where none does, or sensors are alike."""
    if _SPREAD not in shown.names or problem.kind != "frf":
        return ""
    numbers, off, deviation = _besides(problem, shown)
    if len(off) < _LEAST_SENSORS:
        return ""
    spread = _ROBUST * float(np.median(np.abs(off)))
    far = np.abs(off) > np.maximum(_LEAST, _APART * np.maximum(spread, deviation))
    rows = np.flatnonzero(far)[np.argsort(-np.abs(off[far]), kind="stable")].tolist()
    names = [problem.lines.campaign.skin.sensors[number].id for number in numbers.tolist()]
    return ", ".join(_clause(names[row], off[row], deviation[row]) for row in rows[:_MOST])


def _besides(problem: FittingProblem, shown: Explanation) -> tuple[Indices, Floats, Floats]:
    """The numbers of the sensors, d33 of each over the sensors' median, less 1, and its standard deviation."""
    levels = shown.best.levels
    found = residuals(problem, shown, levels.gain, levels.position)
    numbers, sensor = np.unique(problem.lines.sensor, return_inverse=True)
    weight = found.gain_deviation**-2
    total = np.bincount(sensor, weight)
    value = 1 + np.bincount(sensor, weight * found.gain) / total
    median = float(np.median(value))
    return numbers, value / median - 1, np.asarray(total**-0.5 / median, dtype=float)


def _clause(sensor: str, off: float, deviation: float) -> str:
    low, high = sorted(100 * abs(off + end * SDS_OF_95 * deviation) for end in (-1, 1))
    side = "below" if off < 0 else "above"
    return f"d33 of sensor {sensor} is {100 * abs(off):.0f} % {side} the others' ({low:.0f} to {high:.0f})"
