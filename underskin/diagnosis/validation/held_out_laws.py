"""What groups held out say of the answers, and of laws that nobody listed, which predict within their range only."""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unnamed_search import law_of, nearest_law
from underskin.diagnosis.validation import cross_validation
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unnamed.laws import LagLaw, RecordingLaw
from underskin.units import Mask

_LAWS_HELD_OUT = 4  # of laws, and of sets of mechanisms, among which the choice is repeated


def held_out(
    problem: FittingProblem, result: Search, ranked: Sequence[Explanation], nothing: Explanation
) -> list[cross_validation.HeldOut]:
    """What groups held out say; of a law that nobody listed, which predicts within its range only, thirds along it."""
    law = result.law
    if result.answers[0].explanation is not None or law is None:
        return cross_validation.hold_out(
            problem, ranked, nothing, result.log_prior, cross_validation.groups(problem.lines)
        )
    laws = sorted((entry for entry in result.laws if result.shows(entry)), key=result.log_weight, reverse=True)
    both = sorted([*laws[:_LAWS_HELD_OUT], *ranked[:_LAWS_HELD_OUT]], key=result.log_weight, reverse=True)
    return cross_validation.hold_out(problem, both, nothing, result.log_prior, _along(problem, law))


def _along(problem: FittingProblem, law: Explanation) -> dict[str, Mask]:
    """The rows of thirds along the axis of a law that nobody listed."""
    if problem.lines.curves:
        return cross_validation.stretches(problem.lines)
    leading = law_of(problem, law)
    ids = [entry.id for entry in problem.lines.campaign.recordings]
    column = leading.axis.of(ids) if isinstance(leading, RecordingLaw | LagLaw) else np.arange(len(ids), dtype=float)
    return cross_validation.thirds(problem.lines, column)


def of_nearest_law(problem: FittingProblem, result: Search, nothing: Explanation) -> list[Finding]:
    """What the nearest law that nobody listed is worth, where none is stated."""
    nearest = nearest_law(problem, result)
    if nearest is None:
        return []
    found = nearest.explanation
    law = None if found is None else law_of(problem, found)
    if found is None or law is None:
        return [Finding(Reason.NO_SIMPLE_LAW, "", "", {"tried": nearest.tried})]

    def the_law(entry: Explanation) -> float:
        return 0.0 if entry.names == found.names else -np.inf

    groups = cross_validation.hold_out(problem, [found], nothing, the_law, _along(problem, found))
    before, after = cross_validation.total(groups)
    if not (np.isfinite(before.rmse_percent) and np.isfinite(after.rmse_percent)):
        return []
    arguments = {
        "tried": nearest.tried,
        "law": law.spoken.words,
        "part": "samples" if problem.lines.curves else "recordings",
        "after_percent": after.rmse_percent,
        "before_percent": before.rmse_percent,
    }
    return [Finding(Reason.NO_SIMPLE_LAW, "", "", arguments)]
