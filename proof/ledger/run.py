"""Run the ledger: diagnose its campaigns, compare with the stored answers, and optionally store the new ones."""

import json
import math
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from proof.ledger.answer import answer
from proof.ledger.campaigns import Item
from proof.ledger.differences import Compared, Line
from proof.progress import progress_bars
from proof.stored import FAILED, Work, diagnosing, digest_of, of_each, sources, stored
from underskin.compiled import load_all

LEDGER = Path(__file__).parent / "kept"
_SECONDS = "seconds.json"
_SOURCES = ("rig", "proof/slip*.py")


def run(parts: Mapping[str, Sequence[Item]], work: Work, *, keep: bool, folder: Path = LEDGER) -> list[Compared]:
    """Diagnose the campaigns of the parts and compare with the answers in `folder`; `keep` writes the new ones."""
    recorded = folder / _SECONDS
    seconds: dict[str, float] = json.loads(recorded.read_text()) if recorded.exists() else {}
    compared = []
    with progress_bars() as bar:
        for part, items in parts.items():
            before = _stored_lines(folder / f"{part}.jsonl")
            version = f"{diagnosing()} {sources(*_SOURCES)}"
            lines = of_each(work, items, partial(_line, work, version, before), bar(part))
            spent = sum(line.pop("seconds") for line in lines)
            pairs = [(before[line["name"]], line) for line in lines if line["name"] in before]
            compared.append(Compared(part, pairs, (seconds.get(part, math.nan), spent)))
            if keep:
                seconds[part] = round(spent, 1)
                folder.mkdir(exist_ok=True)
                _keep(folder / f"{part}.jsonl", lines)
                recorded.write_text(json.dumps(seconds, indent=1) + "\n")
    return compared


def _stored_lines(path: Path) -> dict[str, Line]:
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {line["name"]: line for line in map(json.loads, lines)}


def _keep(path: Path, lines: Sequence[Line]) -> None:
    """One line per campaign, so that a commit shows which answers changed."""
    path.write_text("".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines), encoding="utf-8")


def _line(work: Work, version: str, stored_lines: Mapping[str, Line], item: Item) -> dict[str, Any]:
    """The ledger's line of one campaign, with the processor time [s] of its diagnosis."""
    documents = item.documents()
    digest = digest_of(documents)
    before = stored_lines.get(item.name)
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
    started_s = time.process_time()
    report = dict(item.diagnosed(documents))
    return {"report": report, "seconds": round(time.process_time() - started_s, 3)}
