"""Whether the d33 that a report states, averaged over the answers left, holds the true one in its 95 % interval.

Campaigns of the virtual rig with wide tails (`rig/wide_tails.py`) and the rig's usual mixture of what is hidden.
`python -m proof.coverage --seed N --count K` prints the table for another seed.
"""

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from proof import seeds
from proof.cases import DrawnCase
from proof.own_rig import truth
from proof.stored import Work, of_each, reports, sources
from proof.text_wide import by_subset
from rig.wide_tails import WIDE

SEED, COUNT = 30615, 480
_SDS_OF_95 = 1.96


def judge_coverage(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """The statement on d33 of each campaign's report."""
    return _judge(work, SEED, min(work.count or COUNT, COUNT), progress)


def _judge(work: Work, seed: int, count: int, progress: Callable[[int, int], None]) -> dict[str, Any]:
    cases = [DrawnCase(seed, number, tails=WIDE) for number in range(count)]
    truths = of_each(work, cases, partial(truth, work, sources("rig")), progress)
    answers = reports(work, cases, progress)
    return {
        "seed": seed,
        "judged": [
            held(case, report) | {"shows": bool(case_truth["identifiable"])}
            for case, case_truth, report in zip(cases, truths, answers, strict=True)
        ],
    }


def held(case: DrawnCase, report: Mapping[str, Any]) -> dict[str, Any]:
    """Whether the interval contains the true d33; `off`: deviation of the value in its standard deviations. None
    without a stated d33."""
    description = case.description
    stated, skin = report.get("d33"), description["skin"]
    true, array = skin["d33_pc_per_n"], skin["array"]
    off = None
    if stated is not None:
        sd = math.log(stated["high"] / stated["low"]) / (2 * _SDS_OF_95)
        off = math.log(stated["value"] / true) / sd
    return {
        "name": case.name,
        "hidden": sorted(description["effects"]),
        "verdict": report["verdict"],
        "named": [mechanism["name"] for mechanism in report["mechanisms"]],
        "sensors": array["columns"] * array["rows"],
        "quotable": bool(stated and stated["quotable"]),
        "held": None if stated is None else bool(stated["low"] <= true <= stated["high"]),
        "off": off,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    arguments_given = seeds.parser("coverage", __doc__).parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        result = _judge(Work(Path(folder)), arguments_given.seed, arguments_given.count, lambda *_: None)
    print(by_subset(result["judged"]))
    for judgement in result["judged"]:
        if judgement["held"] is False:
            hidden, named = (" + ".join(judgement[key]) or "nothing" for key in ("hidden", "named"))
            off = f"{judgement['off']:+.1f} deviations"
            print(
                f"{judgement['name']}: {hidden}; {judgement['verdict']}, {named}; "
                f"{judgement['sensors']} sensors, off by {off}"
            )


if __name__ == "__main__":
    main()
