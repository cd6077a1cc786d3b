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
    each = [(name, case) for name in VARIANTS for case in cases]
    judged = of_each(work, each, partial(_judged, work, f"{diagnosing()} {sources('rig')}"), progress)
    under = {name: judged[place * count : (place + 1) * count] for place, name in enumerate(VARIANTS)}
    return {"seed": seed, "count": count, "judged": under}


def _judged(work: Work, version: str, given: tuple[str, DrawnCase]) -> dict[str, Any]:
    """Whether the answer is right, a false alarm, and whether d33 is held."""
    name, case = given
    key = digest_of([case.name, name, version])
    report = stored(work.folder / "priors", key, partial(_report, name, case))
    known = truth(work, sources("rig"), case)
    entry = judge(case.name, report, known)
    return {
        "name": case.name,
        "hidden": list(entry.truth),
        "visible": entry.visible,
        "right": entry.right,
        "alarm": entry.verdict not in QUIET,
        "held": held(case, report)["held"],
    }


def _report(name: str, case: DrawnCase) -> dict[str, Any]:
    with other_priors(VARIANTS[name]):
        return diagnosed(case.document())


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    given = seeds.parser("sensitivity", __doc__).parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        print(by_priors(_judge(Work(Path(folder)), given.seed, given.count, lambda *_: None)["judged"]))


if __name__ == "__main__":
    main()
