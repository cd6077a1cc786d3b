"""Findings on the stated explanation itself: what in its fit should not be taken at face value."""

import numpy as np

from underskin.diagnosis.data.names import SIMPLEST, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, at_recording, own_places
from underskin.diagnosis.localisation.residual_shape import NOISY
from underskin.formatting import in_digits
from underskin.recordings.finding import Finding


def doubts(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """Parameters at their bounds, recordings beyond the tables, noise that is larger than the lines' own."""
    return [*_at_bounds(explanation), *_beyond_tables(problem, explanation), *_noisy(problem, explanation)]


def _at_bounds(explanation: Explanation) -> list[Finding]:
    found = []
    for name, place in own_places(explanation.names, explanation.best.fitter.hypothesis.lines).items():
        for index in range(place.start, place.stop):
            entry = explanation.model.parameters[index]
            if min(abs(explanation.point.fit[index] - bound) for bound in entry.bounds) < 1e-9:
                limits = f"{entry.low:g} to {entry.high:g} {entry.unit.strip('-')}".rstrip()
                text = f"{name}: {entry.name} lies at an end of what is held possible ({limits})"
                found.append(Finding("parameter_at_bound", "", entry.name, text))
    return found


def _beyond_tables(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    at = explanation.best.at
    outside = np.unique(at_recording(problem, at)[~at.prediction.inside])
    named = in_words(explanation.names) or SIMPLEST[problem.kind]
    text = f"with the values found for {named} its contact lies beyond the tables: its prediction is the table's edge"
    entries = problem.lines.campaign.recordings
    return [Finding("out_of_domain", entries[number].id, "preload_n", text) for number in outside.tolist()]


def _noisy(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    level = explanation.best.at.marginal.levels.level
    if problem.lines.curves or level < NOISY:
        return []
    text = (
        f"the lines scatter {in_digits(level, 2)} times more about the stated answer than about their own neighbours: "
        "part of the misfit along frequency may have been taken for noise"
    )
    return [Finding("line_noise_level", "", "frf_re_pc_per_n", text)]
