"""The parts of the proof: each is made separately and stored as one document, from which the page is written."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from proof import (
    concealed,
    coverage,
    joint,
    left_out,
    own_curves,
    own_rig,
    paper_array,
    real,
    search_misses,
    sensitivity,
    slips,
    solved_contact,
    unlisted,
    wrong_modulus,
)
from proof.cases import DrawnCase, MadeCase
from proof.stored import Work, of_diagnosis, of_each, reports, sources, stored
from underskin.errors import InvalidInput

OnProgress = Callable[[int, int], None]
Part = Callable[[Work, OnProgress], dict[str, Any]]
_JUDGE = "proof/judge.py"
SEALED = Path(__file__).parent / "sealed"


def data_folder(setting: str) -> Path:
    """The folder that an environment variable names; raises InvalidInput where it does not."""
    if setting not in os.environ:
        raise InvalidInput(setting, None, "must name the folder that these data lie in")
    return Path(os.environ[setting])


def _open(work: Work, progress: OnProgress) -> dict[str, Any]:
    return concealed.judge_open(work, data_folder("UNDERSKIN_CAMPAIGNS"), progress)


def _sealed(work: Work, progress: OnProgress) -> dict[str, Any]:
    return concealed.report_sealed(work, data_folder("UNDERSKIN_CAMPAIGNS"), SEALED, progress)


def _recordings(work: Work, progress: OnProgress) -> dict[str, Any]:
    entries = list(real.recorded())[: work.count]
    folder = data_folder("UNDERSKIN_RECORDINGS")
    reported = reports(work, [MadeCase(recorded.name, recorded.make(folder)) for recorded in entries], progress)
    return {
        "campaigns": [
            {"name": recorded.name, "stated": recorded.stated, "report": report}
            for recorded, report in zip(entries, reported, strict=True)
        ]
    }


def _paper(work: Work, progress: OnProgress) -> dict[str, Any]:
    cases = [MadeCase(name, document) for name, document in paper_array.worlds().items()]
    return {
        "campaigns": [
            {"name": case.name, "report": report}
            for case, report in zip(cases, reports(work, cases, progress), strict=True)
        ]
    }


def _ceiling(work: Work, progress: OnProgress) -> dict[str, Any]:
    cases = [DrawnCase(own_rig.SEED, number) for number in range(work.count or own_rig.MIXTURE)]
    version = sources("rig", "proof/ideal*.py")
    answers = of_each(work, cases, _Ideal(work.folder / "ceiling", version), progress)
    return {"answers": {case.name: answer for case, answer in zip(cases, answers, strict=True)}}


class _Ideal:
    """The ideal diagnoser on one case, with stored results; can be sent to other processes."""

    def __init__(self, folder: Path, version: str) -> None:
        self.folder, self.version = folder, version

    def __call__(self, case: DrawnCase) -> dict[str, Any]:
        from proof.ideal import diagnosed

        return stored(self.folder, f"{case.name}-{self.version}", lambda: diagnosed(case))


# The shortest first; the ceiling belongs to the mixture.
PARTS: dict[str, Part] = {
    "open": _open,
    "sealed": _sealed,
    "recordings": _recordings,
    "paper": _paper,
    "mixture": own_rig.judge_mixture,
    "ceiling": _ceiling,
    "quiet": own_rig.judge_quiet,
    "curves": own_curves.judge_curves,
    "quiet_curves": own_curves.judge_quiet_curves,
    "unlisted": unlisted.judge_unlisted,
    "quiet_unlisted": unlisted.judge_quiet_unlisted,
    "left_out": left_out.judge_left_out,
    "joint": joint.judge_joint,
    "search": search_misses.judge_search,
    "coverage": coverage.judge_coverage,
    "sensitivity": sensitivity.judge_sensitivity,
    "wrong_modulus": wrong_modulus.judge_wrong_modulus,
    "slips": slips.judge_slips,
    "solved_contact": solved_contact.judge_solved,
}


def work_out(name: str, work: Work, folder: Path, progress: OnProgress) -> None:
    """Make one part and store it in the folder of results."""
    result = {"sources": of_diagnosis(), "judged_by": sources(_JUDGE), **PARTS[name](work, progress)}
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = folder / f".{name}.json.part"
    unfinished.write_text(json.dumps(result, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    unfinished.replace(folder / f"{name}.json")


def stored_parts(folder: Path) -> dict[str, dict[str, Any]]:
    """Every stored part that was judged by the present sources of the judge."""
    paths = {name: folder / f"{name}.json" for name in PARTS}
    parts = {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.exists()}
    return {name: part for name, part in parts.items() if part["judged_by"] == sources(_JUDGE)}
