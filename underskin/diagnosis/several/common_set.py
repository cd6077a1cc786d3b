"""Which mechanisms act in skins of one make: a set that all have in common, from which single skins may differ.

Every set that any skin asks for may be the common one; given it, each skin has it, or one that differs by a mechanism
or two, each of which shows in that skin's own recordings. A skin of which little was recorded so leans on its sisters.
Errors of E and of the thickness are no mechanisms here: they make a skin depart (population.py).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.selection.priors import SHOWS, log_prior
from underskin.diagnosis.several.course import Candidate, Names, log_change
from underskin.diagnosis.several.skin import ERRORS, FleetSkin

_HOPELESS = 40.0  # nats
_DIFFERS = 0.03  # probability that a skin differs from its sisters by one mechanism


@dataclass(frozen=True)
class CommonSet:
    """The most probable common set and set of each skin, with the probability of each of these; `probability` is that
    of all of them together. `from_sisters`: of each skin the logarithms of the sets' probabilities by what its sisters
    say alone. `log_evidence`: of all recordings, over all sets."""

    common: Names
    sets: tuple[Names, ...]
    each: tuple[float, ...]
    probability: float
    from_sisters: tuple[Mapping[frozenset[str], float], ...]
    log_evidence: float


def sets_of(candidates: Sequence[Candidate]) -> list[frozenset[str]]:
    """The sets that any skin asks for, beside errors of E and of the thickness."""
    asked = (names.difference(ERRORS) for candidate in candidates for names in candidate.asked_for)
    return list(dict.fromkeys((frozenset[str](), *asked)))


def with_smaller(sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
    """The sets, and those with one mechanism less, which say whether each of theirs shows."""
    return list(dict.fromkeys((*sets, *(names - {name} for names in sets for name in sorted(names)))))


def common_set(skins: Sequence[FleetSkin], sets: Sequence[frozenset[str]], supported: int) -> CommonSet:
    """Of skins that were fitted under these sets and the smaller ones; `supported` mechanisms."""
    evidence = np.array([[skin.log_evidence(names, len(skins)) for names in sets] for skin in skins])
    log_evidence = np.maximum(evidence - evidence.max(axis=1, keepdims=True), -_HOPELESS)
    changes = np.array([[log_change(len(one ^ two), supported, _DIFFERS) for two in sets] for one in sets])
    shown = np.array([[_shows(skin, names, len(skins)) for names in sets] for skin in skins])
    own = shown[:, None] | np.eye(len(sets), dtype=bool)  # (skins, common sets, sets)
    change = np.where(own, changes[None], -np.inf)
    weights = change + log_evidence[:, None]
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
    chosen = weights[:, best].argmax(axis=1)
    order = skins[0].candidate.problem.lines.mechanisms.named

    def named(names: frozenset[str]) -> Names:
        return tuple(name for name in order if name in names)

    each = tuple(float(posterior[number, place]) for number, place in enumerate(chosen))
    at_best = weights[np.arange(len(chosen)), best, chosen] - of_skins[:, best]
    probability = float(share[best] * np.exp(at_best.sum()))
    of_each = tuple(named(one.candidate.supported(sets[place])) for one, place in zip(skins, chosen, strict=True))
    of_sisters = np.logaddexp.reduce((log_common - of_skins)[..., None] + change, axis=1)
    of_sisters -= np.logaddexp.reduce(of_sisters, axis=1, keepdims=True)
    from_sisters = tuple(dict(zip(sets, row.tolist(), strict=True)) for row in of_sisters)
    total = float(np.logaddexp.reduce(log_common) + evidence.max(axis=1).sum())
    return CommonSet(named(sets[best]), of_each, each, probability, from_sisters, total)


def _shows(skin: FleetSkin, names: frozenset[str], skins: int) -> bool:
    """Whether each mechanism of a set brings evidence in a skin's own recordings."""
    whole = skin.log_evidence(names, skins)
    return all(whole > skin.log_evidence(names - {name}, skins) + SHOWS for name in names)
