"""Which mechanisms act in skins of one make: a set that all have in common, from which single skins may differ.

Every set that any skin asks for may be the common one; given it, each skin has it, or one that differs by a mechanism
or two, each of which shows in that skin's own recordings. A skin of which little was recorded so leans on its sisters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.selection.priors import SHOWS, least_evidence, log_prior
from underskin.diagnosis.several.course import Candidate, Names, log_change

_HOPELESS = 40.0  # nats
_DIFFERS = 0.03  # probability that a skin differs from its sisters by one mechanism


@dataclass(frozen=True)
class CommonSet:
    """The most probable common set and set of each skin, with the probability of each of these; `probability` is that
    of all of them together."""

    common: Names
    sets: tuple[Names, ...]
    each: tuple[float, ...]
    probability: float


def common_set(candidates: Sequence[Candidate], supported: int) -> CommonSet:
    """Of skins; `supported` mechanisms."""
    sets = list(dict.fromkeys(one for candidate in candidates for one in (frozenset[str](), *candidate.asked_for)))
    log_evidence = np.full((len(candidates), len(sets)), -np.inf)
    for number, candidate in enumerate(candidates):
        for place, names in enumerate(sets):
            found = candidate.explained(names)
            log_evidence[number, place] = -np.inf if found is None else found.log_evidence
    log_evidence = np.maximum(log_evidence - log_evidence.max(axis=1, keepdims=True), -_HOPELESS)
    changes = np.array([[log_change(len(one ^ two), supported, _DIFFERS) for two in sets] for one in sets])
    shown = np.array([[_shows(candidate, names) for names in sets] for candidate in candidates])
    own = shown[:, None] | np.eye(len(sets), dtype=bool)  # (skins, common sets, sets)
    weights = np.where(own, changes[None] + log_evidence[:, None], -np.inf)
    of_skins = np.logaddexp.reduce(weights, axis=2)  # (skins, common sets)
    prior = np.array([log_prior(len(one), supported) for one in sets])
    together = of_skins.sum(axis=0)
    least = SHOWS + np.array(
        [
            max((together[sets.index(one - {name})] for name in one if one - {name} in sets), default=-np.inf)
            for one in sets
        ]
    )
    log_common = np.where(together > least, prior + together, -np.inf)  # what shows in no skin the smaller set says
    share = np.exp(log_common - np.logaddexp.reduce(log_common))
    best = int(share.argmax())
    # Of each skin the posterior of its set, all common sets averaged
    posterior = np.einsum("c,ncm->nm", share, np.exp(weights - of_skins[..., None]))
    chosen = posterior.argmax(axis=1)
    order = candidates[0].problem.lines.mechanisms.named

    def named(place: int, names: frozenset[str] | None = None) -> Names:
        return tuple(name for name in order if name in (sets[place] if names is None else names))

    each = tuple(float(posterior[number, place]) for number, place in enumerate(chosen))
    at_best = weights[np.arange(len(chosen)), best, chosen] - of_skins[:, best]
    probability = float(share[best] * np.exp(at_best.sum()))
    of_each = tuple(
        named(int(place), one.supported(sets[place])) for one, place in zip(candidates, chosen, strict=True)
    )
    return CommonSet(named(best), of_each, each, probability)


def _shows(candidate: Candidate, names: frozenset[str]) -> bool:
    """Whether each mechanism of a set brings evidence in a skin's own recordings."""
    whole = candidate.explained(names)
    smaller = [candidate.explained(names - {name}) for name in names]
    return whole is not None and all(
        less is not None and whole.log_evidence > less.log_evidence + least_evidence(whole) for less in smaller
    )
