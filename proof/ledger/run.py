"""Run the ledger: diagnose its campaigns, compare with the kept answers, keep the new ones where that is asked for."""

import json
import math
import os
import sys
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from proof.ledger.answer import answer
from proof.ledger.campaigns import NEEDS, PARTS, Item
from proof.ledger.differences import Compared, Line, text
from proof.progress import progress_bars
from proof.stored import FAILED, Work, diagnosing, digest_of, of_each, sources, stored
from underskin.compiled import load_all

KEPT = Path(__file__).parent / "kept"
_SECONDS = KEPT / "seconds.json"
_SOURCES = ("rig", "proof/slip*.py")


def run(parts: Sequence[str], *, keep: bool, work_dir: Path, workers: int) -> int:
    """Run the parts, print the differences, and with `keep` write the new answers; the exit status."""
    work = Work(work_dir, workers)
    seconds: dict[str, float] = json.loads(_SECONDS.read_text()) if _SECONDS.exists() else {}
    compared = []
    with progress_bars() as bar:
        for part in parts:
            missing = NEEDS.get(part)
            if missing is not None and missing not in os.environ:
                print(f"{part}: left out, since {missing} does not name the folder of its data", file=sys.stderr)
                continue
            before = _kept(part)
            items = PARTS[part]()
            version = f"{diagnosing()} {sources(*_SOURCES)}"
            lines = of_each(work, items, partial(_line, work, version, before), bar(part))
            spent = sum(line.pop("seconds") for line in lines)
            compared.append(
                Compared(
                    part,
                    [(before[line["name"]], line) for line in lines if line["name"] in before],
                    (seconds.get(part, math.nan), spent),
                )
            )
            if keep:
                _keep(part, lines)
                seconds[part] = round(spent, 1)
    if keep:
        _SECONDS.write_text(json.dumps(seconds, indent=1) + "\n")
    print(text(compared))
    return int(not keep and any(part.is_worse for part in compared))


def _kept(part: str) -> dict[str, Line]:
    path = KEPT / f"{part}.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {line["name"]: line for line in map(json.loads, lines)}


def _keep(part: str, lines: Sequence[Line]) -> None:
    """One line a campaign, so that a commit shows which answers changed."""
    KEPT.mkdir(exist_ok=True)
    rows = "".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines)
    (KEPT / f"{part}.jsonl").write_text(rows, encoding="utf-8")


def _line(work: Work, version: str, kept: Mapping[str, Line], item: Item) -> dict[str, Any]:
    """What the ledger keeps of one campaign, with the seconds of processor time that its diagnosis took."""
    documents = item.documents()
    digest = digest_of(documents)
    before = kept.get(item.name)
    if before is not None and before["documents"] == digest:
        truth = before["truth"]
    else:
        truth = stored(work.folder / "truths", digest_of([item.name, digest, sources(*_SOURCES)]), item.truth)
    key = digest_of([type(item).__name__, item.name, digest, version])
    made = stored(work.folder / "reports", key, partial(_timed, item, documents))
    report = made["report"]
    grade = "wrong" if report.get("verdict") == FAILED else item.grade(report, truth)
    line = {"name": item.name, "documents": digest, "truth": truth, "answer": answer(report), "grade": grade}
    return {**line, "seconds": made["seconds"]}


def _timed(item: Item, documents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    load_all()  # compiled functions, which are no part of a diagnosis
    begun = time.process_time()
    report = dict(item.diagnosed(documents))
    return {"report": report, "seconds": round(time.process_time() - begun, 3)}
