"""Raw indentation curves of this project's virtual rig: singles, pairs and uncatalogued physics; and quiet ones.

The rig shares no code with the diagnosis, and its strengths and scatter are its own (docs/rig.md). Both lists are fixed
by the seed; a shorter list is the beginning of the longer one.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

from proof.cases import DrawnCurves
from proof.judge import judge
from proof.stored import Work, digest_of, of_each, reports, sources, stored
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.truth import truth_of_curves

SEED = 81227
MIXTURE, QUIET = 300, 200
_HIDDEN = ("single", "pair", "unknown", "single")  # in turn: half of them single


def mixture(count: int | None = None) -> list[DrawnCurves]:
    """The first campaigns that hide one effect, two, or physics in no catalogue; default: all."""
    return [
        DrawnCurves(SEED, number, _HIDDEN[number % len(_HIDDEN)]) for number in range(min(count or MIXTURE, MIXTURE))
    ]


def quiet(count: int | None = None) -> list[DrawnCurves]:
    """The first campaigns that hide nothing; none is one of the mixture's."""
    return [DrawnCurves(SEED + 1, number, "none") for number in range(min(count or QUIET, QUIET))]


def judge_curves(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """The mixture's campaigns with their truth."""
    return _judge(work, mixture(work.count), progress)


def judge_quiet_curves(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """The quiet campaigns with their truth."""
    return _judge(work, quiet(work.count), progress)


def _judge(work: Work, cases: list[DrawnCurves], progress: Callable[[int, int], None]) -> dict[str, Any]:
    truths = of_each(work, cases, partial(truth, work, sources("rig")), progress)
    answers = reports(work, cases, progress)
    judged = [
        judge(case.name, report, case_truth) for case, report, case_truth in zip(cases, answers, truths, strict=True)
    ]
    return {
        "judged": [asdict(judgement) for judgement in judged],
        "truths": truths,
        "stated": [_stated(report) for report in answers],
    }


def _stated(report: Mapping[str, Any]) -> dict[str, Any]:
    """The modulus and the work of adhesion with their intervals, as far as a report has them: none if it failed."""
    parameters = [parameter for mechanism in report["mechanisms"] for parameter in mechanism.get("parameters", ())]
    work = [parameter for parameter in parameters if parameter["name"] == "work_of_adhesion"]
    modulus = report["fit"]["after"].get("youngs_modulus") if report["fit"] else None
    return {"youngs_modulus": modulus, "work_of_adhesion": work[0] if work else None}


def truth(work: Work, version: str, case: DrawnCurves) -> dict[str, Any]:
    """What the rig knows of drawn curves."""
    key = digest_of([case.name, version])
    return stored(
        work.folder / "truths",
        key,
        lambda: truth_of_curves(*drawn_curves(case.seed, case.number, INDENTATION, case.what)),
    )
