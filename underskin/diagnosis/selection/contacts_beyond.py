"""Contacts that lie beyond the tables by the declared values: which of them the answers bring within.

Until E is known, a contact that is computed too wide, or too hard pressed, by a modulus that was declared too small
counts in every hypothesis, each of which predicts it, the null hypothesis by continuation of the tables. Contacts that
lie within the tables by answers that stand are kept; something undescribed counts by what is beneath it. The others are
left out, and the rest is diagnosed again: no answer is found by a continuation alone.
"""

import numpy as np

from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.selection.answers import Search

_STANDS = 0.2  # probability of all answers together by which a contact lies within


def within_as_found(problem: FittingProblem, result: Search) -> frozenset[str]:
    """The ids of the recordings whose contacts lie within the tables by answers that stand."""
    entries = problem.lines.campaign.recordings
    within = np.zeros(len(entries))
    for answer in result.answers:
        best = result.shown_or_nothing(answer).best
        outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
        within[np.isin(np.arange(len(entries)), outside, invert=True)] += answer.probability
    return frozenset(entries[number].id for number in np.flatnonzero(within > _STANDS).tolist())
