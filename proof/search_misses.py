"""Misses of the search: hidden sets that it never fitted, or fitted worse than can be done, and that would have led.

Campaigns of the virtual rig with wide tails hide one effect or two. The set of what is hidden is fitted again, from a
grid and from the rig's own parameters (`proof/true_starts.py`). It is a miss where its evidence times prior is then
more than a factor e above that of the best set that the search found.

`python -m proof.search_misses --seed N --count K` prints each miss, and the share, for another seed.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from proof import seeds
from proof.cases import DrawnCase
from proof.names import distinct_names
from proof.stored import Work, diagnosing, digest_of, of_each, sources, stored
from proof.text_wide import is_miss
from proof.true_starts import with_true_values
from rig.wide_tails import WIDE
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.search import frf_problem, search
from underskin.diagnosis.slips.inspection import inspect
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import from_dict
from underskin.surrogate.sigma_table import load_table

SEED, COUNT = 69229, 480
_HIDES = ("single", "pair")

Result = dict[str, Any]


def judge_search(work: Work, progress: Callable[[int, int], None]) -> Result:
    """What the search found of each campaign, and what the hidden set is worth."""
    return _judge(work, SEED, min(work.count or COUNT, COUNT), progress)


def _judge(work: Work, seed: int, count: int, progress: Callable[[int, int], None]) -> Result:
    cases = [DrawnCase(seed, number, _HIDES[number % len(_HIDES)], WIDE) for number in range(count)]
    version = f"{diagnosing()} {sources('rig', 'proof/search_misses.py', 'proof/true_starts.py')}"
    return {"seed": seed, "judged": of_each(work, cases, partial(_judged, work, version), progress)}


def _judged(work: Work, version: str, case: DrawnCase) -> Result:
    return stored(work.folder / "search", digest_of([case.name, version]), partial(compared, case))


def compared(case: DrawnCase) -> Result:
    """The best set that was found beside the hidden one: `lost` is by how many nats that is better, negative where it
    is not; None where nothing can be concluded from the campaign, or it does not support what is hidden."""
    description = case.description
    effects = description["effects"]
    hidden = distinct_names(effects)
    head: Result = {"name": case.name, "truth": list(hidden)}
    problem_and_search = searched(case.document())
    if problem_and_search is None:
        return {**head, "lost": None}
    problem, selection = problem_and_search
    try:
        truth = refitted(problem, hidden, effects)
    except Unsupported:
        return {**head, "lost": None}
    showing = [explanation for explanation in selection.explanations if selection.is_supported(explanation)]
    best = max(showing, key=selection.log_weight)
    fit_of_truth = next(
        (explanation for explanation in selection.explanations if set(explanation.names) == set(hidden)), None
    )
    return {
        **head,
        "found": sorted(best.names),
        "lost": selection.log_weight(truth) - selection.log_weight(best),
        "lost_own": None if fit_of_truth is None else truth.log_evidence - fit_of_truth.log_evidence,
    }


def searched(document: Result) -> tuple[FittingProblem, Search] | None:
    """The FRFs of a campaign and the search over sets of mechanisms, as `underskin.diagnosis.pipeline` has them; None
    where nothing can be concluded from them."""
    campaign, _ = from_dict(document)
    table, mechanisms = load_table(), ActiveCatalogue()
    inspected = inspect(campaign, table)
    if inspected.lacking:
        return None
    problem, fitted = frf_problem(inspected.campaign, inspected.uneven, table, mechanisms)
    return problem, search(problem, fitted)


def refitted(problem: FittingProblem, names: Sequence[str], effects: dict[str, Any]) -> Explanation:
    """The set's best explanation: from a grid over all its parameters, from each member alone, and from true values.

    Raises Unsupported.
    """
    ordered = tuple(name for name in problem.lines.mechanisms.named if name in names)
    first = problem.explain(Request(ordered))
    assert first is not None  # without alternatives, no fit is pruned
    requests = [Request(ordered, with_true_values(first, effects), never_pruned=True)]
    if len(ordered) > 1:
        single_fits = problem.explain_all([Request((name,)) for name in ordered])
        requests += [Request(ordered, parent) for parent in single_fits if parent is not None]
    again = [problem.explain(request) for request in requests]
    fits = [first, *(explanation for explanation in again if explanation is not None)]
    return max(fits, key=lambda explanation: explanation.log_evidence)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = seeds.parser("search_misses", __doc__)
    parser.add_argument("--first", type=int, default=0, help="number of the first campaign")
    options = parser.parse_args(arguments)
    judged = []
    for number in range(options.first, options.first + options.count):
        miss = compared(DrawnCase(options.seed, number, _HIDES[number % len(_HIDES)], WIDE))
        if miss["lost"] is None:
            continue
        judged.append(miss)
        if is_miss(miss):
            lost_in_words = (
                "never fitted" if miss["lost_own"] is None else f"its own fit {miss['lost_own']:.1f} nats worse"
            )
            hidden, answer = (" + ".join(miss[key]) or "nothing" for key in ("truth", "found"))
            print(
                f"{miss['name']}: {hidden}; found {answer}, {miss['lost']:.1f} nats lost ({lost_in_words})", flush=True
            )
    print(f"misses by search: {sum(map(is_miss, judged))} of {len(judged)}")


if __name__ == "__main__":
    main()
