"""Campaigns of a rig unknown to this project, in the folder of UNDERSKIN_CAMPAIGNS.

`open` comes with its truth and is judged here. For `sealed` only reports are written, for others to judge; nothing here
or in the diagnosis is fitted to them.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from proof.cases import FileCase
from proof.judge import Judged, judge
from proof.names import distinct_names
from proof.stored import Work, reports
from underskin.cli.diagnose import write_report


def judge_open(work: Work, campaigns: Path, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Every open campaign with its truth."""
    truths = json.loads((campaigns / "open-truth.json").read_text(encoding="utf-8"))
    cases = _cases(campaigns / "open", work)
    judged = [
        judge(case.name, report, {**(truth := truths[case.name]), "effects": distinct_names(truth["effects"])})
        for case, report in zip(cases, reports(work, cases, progress), strict=True)
    ]
    return {"judged": [asdict(judgement) for judgement in judged]}


def report_sealed(work: Work, campaigns: Path, folder: Path, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Write the report of each sealed campaign into the folder, under the campaign's file name."""
    cases = _cases(campaigns / "sealed", work)
    results = reports(work, cases, progress)
    folder.mkdir(parents=True, exist_ok=True)
    for case, report in zip(cases, results, strict=True):
        write_report(report, folder / f"{case.name}.json")
    return {"verdicts": [report["verdict"] for report in results]}


def _cases(folder: Path, work: Work) -> Sequence[FileCase]:
    return [FileCase(path) for path in sorted(folder.glob("*.json"))[: work.count]]


def judged_of(result: Mapping[str, Any]) -> list[Judged]:
    """The judged reports of a stored result."""
    return [
        Judged(**{**fields, "truth": tuple(fields["truth"]), "answer": tuple(fields["answer"]),
                  "held_out": fields["held_out"] and tuple(fields["held_out"])})
        for fields in result["judged"]
    ]  # fmt: skip
