"""Which mechanisms act in each of several campaigns of one skin: a course through the sets, one set a campaign.

The evidence of a course is the product of the evidences of its sets, times how well the parameters that neighbours
share agree, times the prior of the changes. Sets change seldom, by one mechanism rather than by two. All courses over
the sets that any campaign asks for are summed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.selection.answers import UNTHOUGHT, Search
from underskin.diagnosis.selection.priors import log_prior
from underskin.diagnosis.several.posteriors import Shared, log_agreement
from underskin.units import Floats

CHANGES = 0.15  # probability that a set changes from one campaign to the next by one mechanism
_BEHIND, _MOST_SETS = 12.0, 12  # nats behind a campaign's best, and how many of its sets
_HOPELESS = 30.0  # nats behind which a set in a campaign is on no course
_SAME_STRENGTH = 0.9  # probability that a mechanism that stays has the strength that it had
_MOST_COURSES = 400  # kept from campaign to campaign

Names = tuple[str, ...]


@dataclass(frozen=True)
class Candidate:
    """One campaign: its fits, and the sets of mechanisms that it supports."""

    problem: FittingProblem
    search: Search

    @cached_property
    def known(self) -> dict[frozenset[str], Explanation]:
        """The sets that were fitted."""
        return {frozenset(entry.names): entry for entry in self.search.explanations}

    @property
    def asked_for(self) -> list[frozenset[str]]:
        """The sets that may matter."""
        showing = sorted(
            (entry for entry in self.search.explanations if self.search.shows(entry)), key=self.search.log_weight
        )[::-1]
        least = self.search.log_weight(showing[0]) - _BEHIND
        return [frozenset(entry.names) for entry in showing[:_MOST_SETS] if self.search.log_weight(entry) > least]

    @property
    def undescribed(self) -> float:
        """The probability that what is missing in this campaign has no name, beyond what stays for what nobody thought
        of, which is the same in all campaigns."""
        share = sum(answer.probability for answer in self.search.answers if answer.explanation is None)
        return max(share - UNTHOUGHT, 0.0) / (1 - UNTHOUGHT)

    def supported(self, names: frozenset[str]) -> frozenset[str]:
        """Those of the mechanisms that this campaign can show."""
        return frozenset(name for name in names if name not in self.search.unsupported)

    def explained(self, names: frozenset[str]) -> Explanation | None:
        """A set, as far as this campaign supports its mechanisms."""
        own = self.supported(names)
        if own not in self.known:
            catalogue = self.problem.lines.mechanisms.named
            (found,) = self.problem.explain([Request(tuple(name for name in catalogue if name in own))])
            if found is None:
                return None
            self.known[own] = found
        return self.known[own]


@dataclass(frozen=True)
class Course:
    """A set for each campaign, and its posterior probability."""

    sets: tuple[Names, ...]
    probability: float


@dataclass(frozen=True)
class Courses:
    """The most probable courses, and the posterior that each mechanism acts in each campaign."""

    best: tuple[Course, ...]
    present: Mapping[str, Floats]  # (campaigns,)


def courses(candidates: Sequence[Candidate], supported: int) -> Courses:
    """Of campaigns in the order of their dates; `supported` mechanisms."""
    sets = list(dict.fromkeys(one for candidate in candidates for one in (frozenset[str](), *candidate.asked_for)))
    log_evidence = np.full((len(candidates), len(sets)), -np.inf)
    for number, candidate in enumerate(candidates):
        for place, names in enumerate(sets):
            found = candidate.explained(names)
            if found is not None:
                log_evidence[number, place] = found.log_evidence
    best = np.maximum.reduce(log_evidence, axis=1)[:, None]
    log_evidence = np.where(log_evidence > best - _HOPELESS, log_evidence - best, -np.inf)
    order = candidates[0].problem.lines.mechanisms.named
    begun = [log_prior(len(one), supported) for one in sets]
    paths: list[tuple[float, tuple[int, ...]]] = [
        (float(log_evidence[0, place] + begun[place]), (place,)) for place in range(len(sets))
    ]
    for number in range(1, len(candidates)):
        longer = [
            (
                weight + _step(candidates, number, sets, path[-1], place, supported) + log_evidence[number, place],
                (*path, place),
            )
            for weight, path in paths
            for place in range(len(sets))
            if np.isfinite(weight) and np.isfinite(log_evidence[number, place])
        ]
        paths = sorted(longer, reverse=True)[:_MOST_COURSES]
    weights = np.array([weight for weight, _ in paths])
    shares = np.exp(weights - np.logaddexp.reduce(weights))

    def named(path: tuple[int, ...]) -> tuple[Names, ...]:
        own = [one.supported(sets[place]) for one, place in zip(candidates, path, strict=True)]
        return tuple(tuple(name for name in order if name in names) for names in own)

    found_courses = tuple(
        Course(named(path), float(share))
        for (_, path), share in sorted(zip(paths, shares, strict=True), key=lambda entry: -entry[1])
    )
    present: dict[str, Floats] = {}
    for course in found_courses:
        for number, own in enumerate(course.sets):
            for name in own:
                present.setdefault(name, np.zeros(len(candidates)))[number] += course.probability
    return Courses(found_courses, present)


def _step(
    candidates: Sequence[Candidate], number: int, sets: Sequence[frozenset[str]], here: int, there: int, supported: int
) -> float:
    """ln of the prior of the change, and of how well what stays agrees."""
    of_change = log_change(len(sets[here] ^ sets[there]), supported)
    before, after = candidates[number - 1].explained(sets[here]), candidates[number].explained(sets[there])
    if before is None or after is None:
        return -np.inf
    common = [name for name in before.names if name in after.names]
    agreement = log_agreement(Shared.of(before, common), Shared.of(after, common))
    return of_change + float(np.logaddexp(np.log(_SAME_STRENGTH) + agreement, np.log(1 - _SAME_STRENGTH)))


def log_change(mechanisms: int, supported: int, share: float = CHANGES) -> float:
    """ln of the prior probability that a set differs from another by so many mechanisms; one with this `share`."""
    return mechanisms * float(np.log(share / max(supported, 1))) if mechanisms else float(np.log(1 - share))


def same_strength(one: Shared, two: Shared) -> bool:
    """Whether it is more probable that a mechanism kept its strength than that it has another."""
    return bool(np.log(_SAME_STRENGTH) + log_agreement(one, two) > np.log(1 - _SAME_STRENGTH))
