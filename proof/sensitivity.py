"""How much the answers depend on the priors: the same campaigns diagnosed under others, twice and half as wide.

Campaigns of the virtual rig with wide tails; two in five hide nothing.
`python -m proof.sensitivity --seed N --count K` prints the table for another seed.
"""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from proof import seeds
from proof.cases import DrawnCase
from proof.coverage import held
from proof.judge import QUIET, judge
from proof.other_priors import Priors, other_priors
from proof.own_rig import truth
from proof.stored import Work, diagnosed, diagnosing, digest_of, of_each, sources, stored
from proof.text_wide import by_priors
from rig.wide_tails import WIDE

SEED, COUNT = 64858, 100
_HIDES = ("none", "single", "none", "pair", "single")
VARIANTS: Mapping[str, Priors] = {
    "as they are": Priors(),
    "scatter: half as wide": Priors(scatter=0.5),
    "scatter: twice as wide": Priors(scatter=2.0),
    "strengths: half as wide": Priors(strengths=0.5),
    "strengths: twice as wide": Priors(strengths=2.0),
    "nothing missing: 0.45": Priors(nothing=0.45),
    "nothing missing: 0.75": Priors(nothing=0.75),
}


def judge_sensitivity(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Each campaign under each of the priors."""
    return _judge(work, SEED, min(work.count or COUNT, COUNT), progress)


def _judge(work: Work, seed: int, count: int, progress: Callable[[int, int], None]) -> dict[str, Any]:
    cases = [DrawnCase(seed, number, _HIDES[number % len(_HIDES)], WIDE) for number in range(count)]
    pairs = [(name, case) for name in VARIANTS for case in cases]
    judged = of_each(work, pairs, partial(_judged, work, f"{diagnosing()} {sources('rig')}"), progress)
    under = {name: judged[index * count : (index + 1) * count] for index, name in enumerate(VARIANTS)}
    return {"seed": seed, "count": count, "judged": under}


def _judged(work: Work, version: str, variant_and_case: tuple[str, DrawnCase]) -> dict[str, Any]:
    """Whether the answer is right, a false alarm, and whether d33 is held."""
    name, case = variant_and_case
    key = digest_of([case.name, name, version])
    report = stored(work.folder / "priors", key, partial(_report, name, case))
    case_truth = truth(work, sources("rig"), case)
    judgement = judge(case.name, report, case_truth)
    return {
        "name": case.name,
        "hidden": list(judgement.truth),
        "visible": judgement.visible,
        "right": judgement.right,
        "alarm": judgement.verdict not in QUIET,
        "held": held(case, report)["held"],
    }


def _report(name: str, case: DrawnCase) -> dict[str, Any]:
    with other_priors(VARIANTS[name]):
        return diagnosed(case.document())


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    options = seeds.parser("sensitivity", __doc__).parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        print(by_priors(_judge(Work(Path(folder)), options.seed, options.count, lambda *_: None)["judged"]))


if __name__ == "__main__":
    main()
