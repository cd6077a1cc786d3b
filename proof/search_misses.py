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
from proof.names import one_name_each
from proof.stored import Work, diagnosing, digest_of, of_each, sources, stored
from proof.text_wide import is_miss
from proof.true_starts import with_true_values
from rig.wide_tails import WIDE
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request, integrated
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.search import frf_problem, search
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
    hidden = one_name_each(effects)
    head: Result = {"name": case.name, "truth": list(hidden)}
    begun = searched(case.document())
    if begun is None:
        return {**head, "lost": None}
    problem, found = begun
    try:
        truth = refitted(problem, hidden, effects)
    except Unsupported:
        return {**head, "lost": None}
    showing = [entry for entry in found.explanations if found.is_supported(entry)]
    best = max(showing, key=found.log_weight)
    own = next((entry for entry in found.explanations if set(entry.names) == set(hidden)), None)
    return {
        **head,
        "found": sorted(best.names),
        "lost": found.log_weight(truth) - found.log_weight(best),
        "lost_own": None if own is None else truth.log_evidence - own.log_evidence,
    }


def searched(document: Result) -> tuple[FittingProblem, Search] | None:
    """The FRFs of a campaign and the search over sets of mechanisms, as `underskin.diagnosis.pipeline` has them; None
    where nothing can be concluded from them."""
    campaign, _ = from_dict(document)
    table, mechanisms = load_table(), ActiveCatalogue()
    inspected = inspect(campaign, table)
    if inspected.lacking:
        return None
    problem, known = frf_problem(inspected.campaign, inspected.uneven, table, mechanisms)
    return problem, search(problem, known)


def refitted(problem: FittingProblem, names: Sequence[str], effects: dict[str, Any]) -> Explanation:
    """The set's best explanation: from a grid over all its parameters, from each member alone, and from true values.

    Raises Unsupported.
    """
    ordered = tuple(name for name in problem.lines.mechanisms.named if name in names)
    (begun,) = problem.explain([Request(ordered)])
    assert begun is not None  # alone, no fit is hopeless
    requests = [Request(ordered, larger=with_true_values(begun, effects))]
    if len(ordered) > 1:
        alone = problem.explain([Request((name,)) for name in ordered])
        requests += [Request(ordered, parent) for parent in alone if parent is not None]
    again = [problem.explain([request])[0] for request in requests]
    each = integrated([begun, *(entry for entry in again if entry is not None)])
    return max(each, key=lambda entry: entry.log_evidence)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = seeds.parser("search_misses", __doc__)
    parser.add_argument("--first", type=int, default=0, help="number of the first campaign")
    given = parser.parse_args(arguments)
    judged = []
    for number in range(given.first, given.first + given.count):
        entry = compared(DrawnCase(given.seed, number, _HIDES[number % len(_HIDES)], WIDE))
        if entry["lost"] is None:
            continue
        judged.append(entry)
        if is_miss(entry):
            own = "never fitted" if entry["lost_own"] is None else f"its own fit {entry['lost_own']:.1f} nats worse"
            hidden, found = (" + ".join(entry[key]) or "nothing" for key in ("truth", "found"))
            print(f"{entry['name']}: {hidden}; found {found}, {entry['lost']:.1f} nats lost ({own})", flush=True)
    print(f"misses by search: {sum(map(is_miss, judged))} of {len(judged)}")


if __name__ == "__main__":
    main()
