"""Campaigns of this project's virtual rig, which shares no code with the diagnosis: a mixture, and quiet ones.

The mixture hides nothing, one effect, two, or physics in no catalogue, from subtle to strong; the quiet ones hide
nothing. Both are fixed by the seed.
"""

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any

from proof.cases import DrawnCase
from proof.judge import judge
from proof.stored import Work, digest_of, of_each, reports, sources, stored
from rig.draw import record
from rig.truth import truth_of_lines

SEED = 82689
MIXTURE, QUIET = 300, 500


def judge_mixture(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """The mixture's campaigns beside their truth."""
    return _judge(work, [DrawnCase(SEED, number) for number in range(work.count or MIXTURE)], progress)


def judge_quiet(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Campaigns without hidden effects; all else is drawn anew, so none is one of the mixture's."""
    return _judge(work, [DrawnCase(SEED + 1, number, "none") for number in range(work.count or QUIET)], progress)


def _judge(work: Work, cases: list[DrawnCase], progress: Callable[[int, int], None]) -> dict[str, Any]:
    truths = of_each(work, cases, partial(truth, work, sources("rig")), progress)
    results = reports(work, cases, progress)
    return {
        "judged": [
            asdict(judge(case.name, report, case_truth))
            for case, report, case_truth in zip(cases, results, truths, strict=True)
        ]
    }


def truth(work: Work, version: str, case: DrawnCase) -> dict[str, Any]:
    """What the rig knows of a drawn campaign."""
    described = case.description
    return stored(work.folder / "truths", digest_of([described, version]), lambda: truth_of_lines(record(described)))
