"""Hypotheses with and without positioning scatter: which are evaluated together, and how one begins at another."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.evidence import Evidence
from underskin.diagnosis.inference.hypothesis import Hypothesis
from underskin.diagnosis.inference.objective import POSITION
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.inference.points import Points, alone, stacked
from underskin.diagnosis.noise.noise_priors import POSITION_PRIOR


def with_scatter(hypotheses: Sequence[Hypothesis], points: Mapping[int, Points]) -> dict[int, Points]:
    """For hypotheses with positioning scatter, from the points of those without it."""
    starts: dict[int, Points] = {}
    for members in groups(points, hypotheses):
        fitter = Fitter([hypotheses[number] for number in members])
        begun = fitter.with_scatter(stacked([points[number] for number in members]))
        starts |= {number: alone(begun, owner, fitter.counts[owner]) for owner, number in enumerate(members)}
    return starts


def hardly_scatters(evidence: Evidence) -> bool:
    """Whether positioning scatter, which a parent needed, is less than usual here: what was added may explain it."""
    return float(evidence.point.covariance[POSITION]) < POSITION_PRIOR.middle


def without_scatter(points: Points) -> Points:
    """The points of a hypothesis with positioning scatter, less that."""
    return replace(points, covariance=np.delete(points.covariance, POSITION, axis=1))


def groups(
    numbers: Iterable[int], hypotheses: Sequence[Hypothesis] | Mapping[int, Hypothesis]
) -> Collection[list[int]]:
    """Which of these hypotheses can be evaluated together."""
    groups: dict[object, list[int]] = {}
    for number in numbers:
        groups.setdefault(hypotheses[number].group(number), []).append(number)
    return groups.values()
