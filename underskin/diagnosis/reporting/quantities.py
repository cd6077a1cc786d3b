"""d33 and Young's modulus of a report, over all answers: whether d33 is to be quoted, and what would change it unseen.

Both are averaged over the level at which the factor of an unlisted law is 1 (`numbers.law_levels`): a resonance may
leave the low frequencies as they are, or the high ones, and d33 differs by what the law does in between. E is
integrated over the scatter of gains, the idealisation of laws, and what an apparent modulus may hide as well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import MOST_QUOTED, in_words
from underskin.diagnosis.inference.evidence import marginalise_curve_noise, marginalise_sensor_spread
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.inference.residuals import declared_d33, with_hidden_mechanism
from underskin.diagnosis.reporting.numbers import (
    HIDES,
    law_levels,
    of_logarithms,
    over_answers,
    scaled,
)
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import MODULUS_ERROR, hidden_factors, may_hide
from underskin.diagnosis.selection.priors import SHOWS, UNSEEN_ODDS, even_laws
from underskin.diagnosis.validation.signatures import Confounding, HiddenShift, Likeness
from underskin.findings.formatting import in_digits, listed

_FACTORS = ("gain", "frequency_response")
SEVERAL_ANSWERS = "several answers remain"
BY_NUISANCES = ("d33", "noise")  # confounders of mechanisms that d33, E, h or the noise hide


def d33_over_answers(search: Search, problem: FittingProblem, unsure: float) -> dict[str, Any] | None:
    """The median and the 95 % interval of d33 over all answers, weighted with their probabilities and allowing for
    mechanisms that would not show; None where answers without d33 are more probable than all others.

    `none_of_these` counts with all supported unlisted laws, which may predict the same and differ in d33. The
    tolerances of the skin's declared values widen the interval, but not `relative`, which is for comparing sensors,
    dates and spheres. `unsure` is a further relative standard uncertainty.
    """
    parts = over_answers(search, partial(_d33_under, search, problem))
    if not parts:
        return None
    mixture = NormalMixture.joined([part for _, part in parts])
    declared = np.repeat([declared_d33(problem, fit) for fit, _ in parts], [len(part.share) for _, part in parts])
    shares = mixture.share / mixture.share.sum()
    relative = np.hypot(mixture.deviation, unsure)
    relative_ends = of_logarithms(shares, mixture.mean, relative)
    first, _ = parts[0]
    return {
        "name": "d33",
        "unit": first.model.parameters[first.index("d33")].unit,
        **of_logarithms(shares, mixture.mean, np.hypot(relative, declared)),
        "relative": {key: relative_ends[key] for key in ("low", "high")},
    }


def _d33_under(search: Search, problem: FittingProblem, explanation: Explanation, probability: float) -> NormalMixture:
    """ln d33 under an answer, at each reference level of its laws, and with one more mechanism that does not show; the
    shares sum to 1."""
    index = explanation.index("d33")
    best = explanation.best
    parts = marginalise_sensor_spread(best.fitter, best.at, index)
    if parts is None:
        deviation = np.sqrt(explanation.best.covariance_of([index])[0])
        parts = [NormalMixture(np.ones(1), explanation.point.fit[index : index + 1], deviation)]
    parts = list(parts)
    if probability > HIDES:
        odds = UNSEEN_ODDS / max(search.supported - len(explanation.names), 1)
        answers = [set(answer.explanation.names) for answer in search.answers if answer.explanation is not None]
        for name in problem.lines.mechanisms.named:
            if name in explanation.names or {name, *explanation.names} in answers:
                continue
            hidden = with_hidden_mechanism(problem, explanation, name, "d33")
            if hidden is None:
                continue
            # A law that is no guess has even odds; of others no answer holds more than what does not show
            unseen = (
                1.0
                if name in even_laws((name, *explanation.names), problem.lines)
                else odds * min(1.0, float(np.exp(SHOWS) / hidden.share.sum()))
            )
            parts.append(hidden.times(unseen))
    mixture = NormalMixture.joined(parts)
    mixture = mixture.times(1 / float(mixture.share.sum()))
    return mixture.averaged_over(law_levels(problem, explanation, _FACTORS))


@dataclass(frozen=True)
class StatedD33:
    """The report's d33 and whether it is to be quoted.

    `number` is None where there is no d33, as of curves. `hidden`: mechanisms that would not show here and move d33
    beyond its interval; those that are wrong declared numbers prevent quoting it. `why_not`: further reasons against
    quoting it, in words. `skin_pc_per_n`: the skin's declared d33, None where it declares none.
    """

    number: Mapping[str, Any] | None
    hidden: Sequence[HiddenShift] = ()
    why_not: Sequence[str] = ()
    skin_pc_per_n: float | None = None

    @property
    def deciding(self) -> list[HiddenShift]:
        """Hidden mechanisms that prevent quoting d33, the largest first: wrong declared numbers and what would change
        d33 as much; none where no declared number does."""
        least = min((abs(shift.log_factor) for shift in self.hidden if shift.declared), default=np.inf)
        return [shift for shift in self._largest_first if abs(shift.log_factor) >= least]

    @property
    def _largest_first(self) -> list[HiddenShift]:
        return sorted(self.hidden, key=lambda shift: -abs(shift.log_factor))

    @property
    def document(self) -> dict[str, Any] | None:
        """The report's `d33`, with the reasons where it is not to be quoted."""
        if self.number is None:
            return None
        reasons = self.reasons
        why_not = {"why_not": " and ".join(reasons)} if reasons else {}
        return {**self.number, "quotable": not reasons, **why_not}

    def clause(self) -> str:
        """A clause on the value to quote, or on why none is quoted; empty where there is no d33."""
        if self.document is None:
            return ""
        if self.document["quotable"]:
            return f"d33 to quote: {self.quoted()}"
        return f"d33 is not to be quoted: {self.interval()}"

    def quoted(self) -> str:
        """The value with its interval, also without the tolerances of declared values, and the hidden mechanisms that
        would change it most beyond that."""
        assert self.number is not None
        value, low, high = (f"{self.number[key]:.3g}" for key in ("value", "low", "high"))
        least, most = (f"{self.number['relative'][key]:.3g}" for key in ("low", "high"))
        named = " or ".join(
            f"{in_words([shift.mechanism])} ({_percent(shift)})" for shift in self._largest_first[:MOST_QUOTED]
        )
        hides = f", provided that there is no {named}" if named else ""
        return (
            f"{value} {self.number['unit']} (95 %: {low} to {high} with what declared values may be off, {least} to "
            f"{most} to compare sensors or dates){self._over_declared()}{hides}"
        )

    def _over_declared(self) -> str:
        """The ratio to the skin's declared d33, where the interval excludes it: a peak-to-peak force or charge taken
        for an amplitude halves or doubles every FRF, which nothing else in the recordings reveals."""
        assert self.number is not None
        declared = self.skin_pc_per_n
        if declared is None or self.number["low"] <= declared <= self.number["high"]:
            return ""
        return f", {self.number['value'] / declared:.2g} times the declared {declared:g} {self.number['unit']}"

    def interval(self) -> str:
        """The interval of d33, and why it is not to be quoted."""
        assert self.number is not None
        low, high = (f"{self.number[key]:.3g}" for key in ("low", "high"))
        lies = f"it lies from {low} to {high} {self.number['unit']}{self._over_declared()}"
        deciding = [f"{in_words([shift.mechanism])} by {_percent(shift)}" for shift in self.deciding[:MOST_QUOTED]]
        if deciding:
            return f"{lies}, but what would not show here would change it, {listed(deciding)}"
        over = " over the answers that remain" if SEVERAL_ANSWERS in self.why_not else ""
        others = " and ".join(words for words in self.why_not if words != SEVERAL_ANSWERS)
        return f"{lies}{over}" + (f", {'and' if over else 'but'} {others}" if others else "")

    @property
    def reasons(self) -> list[str]:
        """Reasons against quoting d33; empty where it is to be quoted."""
        if self.number is None:
            return list(self.why_not) or ["no answer explains its recordings"]
        hidden = in_words([shift.mechanism for shift in self.deciding[:MOST_QUOTED]])
        return [*self.why_not, *([f"{hidden} would change it without showing"] if hidden else [])]

    def not_identifiable(self, confounded: Sequence[Confounding]) -> list[dict[str, str]]:
        """The report's entries, with the change of d33 by each beyond its interval."""
        hidden = {shift.mechanism: shift for shift in self.hidden}
        by_nuisances = {entry.mechanism for entry in confounded if entry.confounded_with in BY_NUISANCES}
        further = [Confounding(name, "d33", Likeness.TAKEN_UP) for name in hidden if name not in by_nuisances]
        entries = []
        for entry in (*confounded, *further):
            reason = _CONFOUNDED[entry.why].format(mechanism=entry.mechanism, other=entry.confounded_with)
            shift = hidden.get(entry.mechanism)
            if shift is not None and entry.confounded_with in BY_NUISANCES:
                way = "large" if shift.log_factor > 0 else "small"
                reason += f"; d33 would then be {_percent(shift)} too {way}"
            row = {"mechanism": entry.mechanism, "confounded_with": entry.confounded_with, "reason": reason}
            entries.append(row)
        return entries


_CONFOUNDED: Mapping[Likeness, str] = {
    Likeness.NOISE: "at a typical strength it stays within the noise here",
    Likeness.TAKEN_UP: "at a typical strength it looks here like another d33, E or h within their tolerances",
    Likeness.IMITATED: "what {mechanism} typically does to these recordings, {other} can do as well",
    Likeness.IMITATES: "what {other} typically does to these recordings, {mechanism} can do as well",
    Likeness.FITS_AS_WELL: "{other} explains these recordings about as well as {mechanism}",
}


def _percent(hidden: HiddenShift) -> str:
    return f"{in_digits(abs(hidden.percent), 2)} %"


_MOST = 0.5  # of the variance of log E: the part that another parameter explains
_LAW_FACTORS = ("gain", "modulus")  # what an unlisted law acts on as a factor on the force


def modulus_under(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    """The report's E of curves under one explanation."""
    return _entry(problem, explanation, _log_modulus(problem, explanation))


def modulus_over_answers(search: Search, problem: FittingProblem, shown: Explanation) -> dict[str, Any] | None:
    """The report's E of curves over all answers; `shown`, the fit behind the leading one, tells whether E is at a bound
    of its search. None where answers without a fit are more probable than all others: nothing describes the curves."""
    parts = over_answers(search, lambda explanation, _: _log_modulus(problem, explanation))
    return _entry(problem, shown, NormalMixture.joined([part for _, part in parts])) if parts else None


def _log_modulus(problem: FittingProblem, explanation: Explanation) -> NormalMixture:
    """The logarithm of E [MPa]; the shares sum to 1."""
    spans, index = explanation.spans, explanation.index("youngs_modulus")
    factor = (spans[MODULUS_ERROR].start,) if MODULUS_ERROR in spans else ()
    mixture = marginalise_curve_noise(explanation.best, (index, *factor))
    mixture = mixture.averaged_over(law_levels(problem, explanation, _LAW_FACTORS))
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
    stated = of_logarithms(mixture.share / mixture.share.sum(), mixture.mean, mixture.deviation)
    bound = {} if at_bound is None else {"at_bound": at_bound}
    return {"name": "youngs_modulus", "unit": "MPa", **scaled(stated, declared), **bound}
