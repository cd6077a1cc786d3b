"""How many laws that no catalogue lists would look like an explanation of curves, at the strength that is seen.

Such a law acts as listed ones do: it multiplies the force, shifts the travel or adds a force, by a simple form of the
force, the depth, the time or the way back. Each is given the strength that the explanation's own mechanisms show, χ²
beyond what the nuisances take up, under the noise that was found. It is imitated if the explanation would be named for
it: its parameters leave too little to be named, and without any one of its mechanisms more than that is left (all to
first order in the parameters). The prior of unlisted physics times the share of such laws that are imitated is the
weight of those beside the set's own prior, and never more than that: laws that are more probable are fitted themselves
(selection/unnamed_search.py).

Where nothing is missing as far as one can see, an unlisted law of a usual strength may still be there and not show,
since the nuisances take it up: the prior of unlisted physics times the share of such laws stands beside that of
nothing.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.names import NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.taken_up import beside, force_and_slopes, information, precision_of
from underskin.diagnosis.selection.priors import PRIORS, guesses, least_evidence, log_prior
from underskin.diagnosis.validation.power import least_chi2
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.recordings.conditions import CurveConditions
from underskin.units import Floats, Indices

_FORMS: Mapping[str, Callable[[Floats], Floats]] = {  # of a variable from 0 to 1
    "root": np.sqrt,
    "linear": lambda x: x,
    "square": np.square,
    "exponential approach": lambda x: 1 - np.exp(-5 * x),
    "threshold": lambda x: np.maximum(x - 0.5, 0.0),
    "step": lambda x: (x > 0.5).astype(float),
}
_USUAL = 0.05  # of the force, as a root mean square: what a law changes that is taken for missing physics
_TAKEN_UP = 1e-6  # of a law's own χ²: what is left beside the nuisances is rounding


@dataclass(frozen=True)
class Imitation:
    """How many of so many unlisted laws an explanation imitates, and how probable these are beside it."""

    laws: int
    imitated: int
    odds: float  # at most 1


def imitation(explanation: Explanation, null: Explanation, supported: int) -> Imitation | None:
    """Of an explanation of curves by one or more of so many supported mechanisms; None where these change nothing.

    Parameters
    ----------
    explanation, null
        The set of mechanisms, and the null hypothesis, at their most probable parameters.
    supported
        How many mechanisms the campaign supports, among which the prior is shared.
    """
    hypothesis, fit = explanation.best.hypothesis, explanation.point.fit
    force, slopes, unlisted = _beside(explanation)
    null_model = null.best.hypothesis.model
    assert isinstance(null_model, CurveModel)
    change = force - null_model.forces(null.point.fit[None])[0]
    whole = information(explanation, np.concatenate([slopes, unlisted, change[None]]))
    every = np.arange(len(fit))
    precision = precision_of(hypothesis)
    shown = _left(whole, every[hypothesis.own_parameters :], precision)
    laws = shown[:-1] > _TAKEN_UP * np.diag(whole)[len(fit) : -1]
    if not (laws.any() and shown[-1] > 0):
        return None
    strength = shown[-1] / shown[:-1][laws]
    least = least_chi2(supported, least_evidence(explanation))
    imitated = strength * _left(whole, every, precision)[:-1][laws] < least
    for own in own_places(explanation.names, hypothesis.lines).values():
        imitated &= strength * _left(whole, np.delete(every, own), precision)[:-1][laws] > least
    odds = _odds(int(imitated.sum()), int(laws.sum()), guesses(explanation), supported)
    return Imitation(int(laws.sum()), int(imitated.sum()), min(odds, 1.0))


def unseen(null: Explanation, supported: int) -> Imitation:
    """How many unlisted laws of a usual strength would not show beside the null hypothesis of curves."""
    hypothesis = null.best.hypothesis
    force, slopes, unlisted = _beside(null)
    size = np.sqrt((unlisted**2).mean(axis=1))
    laws = unlisted[size > 0] * (_USUAL * np.sqrt((force**2).mean()) / size[size > 0])[:, None]
    left = _left(information(null, np.concatenate([slopes, laws])), np.arange(len(slopes)), precision_of(hypothesis))
    hidden = int((left < least_chi2(supported, least_evidence(null))).sum())
    return Imitation(len(laws), hidden, _odds(hidden, len(laws), 0, supported))


def _odds(counted: int, laws: int, size: int, supported: int) -> float:
    """Of an unlisted law beside a set of so many mechanisms; the share is of all such laws, by Jeffreys' prior: these
    are but a sample."""
    share = (counted + 0.5) / (laws + 1)
    return float(PRIORS[NONE_OF_THESE] * share / np.exp(log_prior(size, supported)))


def _beside(explanation: Explanation) -> tuple[Floats, Floats, Floats]:
    """The force (samples,), its derivatives by the parameters (parameters, samples), and what each unlisted law changes
    in it (laws, samples)."""
    force, slopes, stiffness = force_and_slopes(explanation)
    model, fit = explanation.best.hypothesis.model, explanation.point.fit
    assert isinstance(model, CurveModel)
    campaign = explanation.best.hypothesis.lines.campaign
    recordings = [one for one in campaign.recordings if isinstance(one, CurveConditions)]
    return force, slopes, _unlisted(recordings, fit[model.contact_points], force, stiffness)


def _unlisted(
    recordings: Sequence[CurveConditions], contact_points: Floats, force: Floats, stiffness: Floats
) -> Floats:
    """What each unlisted law changes in the force (laws, samples), up to its strength.

    `contact_points` (recordings,) [mm]; `force` and `stiffness`, its derivative by the travel, (samples,).
    """
    travel = [np.asarray(one.displacement_mm) for one in recordings]
    depth = np.concatenate([np.maximum(one - at, 0.0) for one, at in zip(travel, contact_points, strict=True)])
    time = np.concatenate([times_of(one) - times_of(one)[0] for one in recordings])
    back = np.concatenate([np.arange(len(one)) > int(np.argmax(one)) for one in travel]).astype(float)
    followed = {"force": np.maximum(force, 0.0), "depth": depth, "time": time}
    shapes = {
        name: [form(variable / variable.max()) for form in _FORMS.values()]
        for name, variable in followed.items()
        if variable.max() > 0
    }
    factors = [back, *itertools.chain(*shapes.values())]
    laws = [factor * shape for factor in (force, stiffness) for shape in factors]
    return np.array([*laws, *shapes.get("time", [])])  # a force of its own follows time


def _left(whole: Floats, places: Indices, precision: Floats) -> Floats:
    """χ² that the parameters at `places`, with their priors' precision, leave of each change behind them (changes,)."""
    return np.diag(beside(whole, places, precision))
