"""Laws that nobody listed, from a rig of their own (`rig/unlisted`), and campaigns of it that hide nothing.

How many are recognised as not in the catalogue, of how many it is told where they enter and what they follow (right,
or an equivalent that the rig itself cannot tell from it), and how far the errors on recordings held out lie above the
noise. `python -m proof.unlisted --seed N --count K` prints this for another seed; with `--quiet` nothing is hidden, and
what is stated is a false alarm.
"""

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from proof import seeds
from proof.cases import FileCase
from proof.judge import unnamed_over_noise
from proof.stored import FAILED, Work, reports, sources
from proof.text_unlisted import alarms, hidden
from rig.identifiable import THRESHOLD
from rig.unlisted.campaign import write

SEED, COUNT, QUIET = 44211, 120, 500


def judge_unlisted(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Campaigns that hide one law."""
    return _judge(work, SEED, min(work.count or COUNT, COUNT), progress, quiet=False)


def judge_quiet_unlisted(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Campaigns that hide nothing."""
    return _judge(work, SEED + 1, min(work.count or QUIET, QUIET), progress, quiet=True)


def _judge(work: Work, seed: int, count: int, progress: Callable[[int, int], None], *, quiet: bool) -> dict[str, Any]:
    folder = work.folder / f"unlisted-{seed}-{count}-{sources('rig')}"
    truth_file = folder / "truth.json"
    truths = json.loads(truth_file.read_text()) if truth_file.exists() else write(seed, count, folder, quiet)
    cases = [FileCase(folder / f"{name}.json") for name in truths]
    answers = reports(work, cases, progress)
    return {
        "seed": seed,
        "judged": [judged(case.name, truths[case.name], report) for case, report in zip(cases, answers, strict=True)],
    }


def judged(name: str, truth: Mapping[str, Any], report: Mapping[str, Any]) -> dict[str, Any]:
    """One campaign: its truth, and what its report says."""
    law, stated_law = truth.get("law"), report.get("unnamed")
    placed = shaped = False
    if law is not None and stated_law is not None:
        placed = stated_law["acts_on"] in {law["acts_on"], *truth["acts_on_also"]}
        placed = placed and stated_law["axis"] in {law["axis"], *truth["axis_also"]}
        shaped = placed and stated_law["form"] in {law["form"], *truth["form_also"]}
    nothing = sum(
        alternative["probability"]
        for alternative in report["alternatives"]
        if alternative["mechanisms"] == ["nothing_missing"]
    )
    nothing = report["probability"] if report["verdict"] in ("no_mismatch", "insufficient_data") else nothing
    if report["verdict"] == FAILED:  # which counts as wrong
        nothing = float(law is not None)
    return {
        "name": name,
        "law": None if law is None else f"{law['acts_on']} over {law['axis']}, {law['form']}",
        "identifiable": bool(truth.get("identifiable", False)),
        "visible": truth.get("chi2_gain_over_base", 0.0) > THRESHOLD,
        "verdict": report["verdict"],
        "missing": 1 - nothing,
        "recognised": report["verdict"] == "unexplained",
        "placed": placed,
        "shaped": shaped,
        "over_noise": unnamed_over_noise(report),
        "statement": report["statement"][:150],
        "probability": report["probability"],
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = seeds.parser("unlisted", __doc__)
    parser.add_argument("--quiet", action="store_true", help="hide nothing")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        work = Work(Path(folder))
        result = _judge(work, options.seed, options.count, lambda *_: None, quiet=options.quiet)
    print((alarms if options.quiet else hidden)(result))


if __name__ == "__main__":
    main()
