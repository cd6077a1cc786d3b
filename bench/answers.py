"""What diagnoses answer beside another revision: python -m bench.answers REV prints every campaign that differs.

The campaigns that are concealed from this project, the mixture of its own rig, and the paper's contradictory d33. Two
answers are the same if verdict and leading set are, every probability within 0.02, and every parameter of the leading
set within a tenth of its interval.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from bench.against import NAMED_ALONE, OF_ANY_REVISION, worktree
from proof.cases import DrawnCase
from proof.own_rig import MIXTURE, SEED
from proof.paper_array import worlds

_PROBABILITY, _OF_INTERVAL = 0.02, 0.1
_REPORTS = """
out = Path(sys.argv[1])
for file in map(Path, sys.argv[2:]):
    (out / file.name).write_text(json.dumps(diagnosis_report(parse(json.loads(file.read_text())), table)))
"""

Report = Mapping[str, Any]


def main(revision: str, mixture: int) -> None:
    """Diagnose all campaigns three ways and print what differs, as a table in Markdown."""
    root = Path(__file__).parents[1]
    with tempfile.TemporaryDirectory() as temporary, worktree(root, revision, Path(temporary) / "tree") as other:
        files = _written(Path(temporary) / "campaigns", mixture)
        theirs = _reports(other, "", files, Path(temporary) / "theirs")
        named = _reports(root, NAMED_ALONE, files, Path(temporary) / "named")
        whole = _reports(root, "", files, Path(temporary) / "whole")
    print(f"| campaign | {revision} | named mechanisms alone | with laws that nobody listed |\n|---|---|---|---|")
    for file in files:
        if not same(theirs[file], named[file]) or not agree(theirs[file], whole[file]):
            print(f"| {file.stem} | {said(theirs[file])} | {said(named[file])} | {said(whole[file])} |")
    for name, ours in (("named mechanisms alone", named), ("with laws", whole)):
        kept = [sum(test(theirs[file], ours[file]) for file in files) for test in (same, agree)]
        print(f"{name}: of {len(files)} the same {kept[0]}, verdict and leading set {kept[1]}")


def _written(folder: Path, mixture: int) -> list[Path]:
    folder.mkdir()
    concealed = os.environ.get("UNDERSKIN_CAMPAIGNS")
    places = [Path(concealed) / name for name in ("open", "sealed")] if concealed else []
    documents = {
        **{file.stem: json.loads(file.read_text()) for place in places for file in sorted(place.glob("*.json"))},
        **{f"mixture {number}": DrawnCase(SEED, number).document() for number in range(mixture)},
        **worlds(),
    }
    for name, document in documents.items():
        (folder / f"{name}.json").write_text(json.dumps(document))
    return [folder / f"{name}.json" for name in documents]


def _reports(tree: Path, before: str, files: Sequence[Path], out: Path) -> dict[Path, Report]:
    """The reports of a tree, on all cores."""
    out.mkdir()
    cores = os.cpu_count() or 1
    settings = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(tree)}
    environment = {**os.environ, **settings, "UNDERSKIN_TABLES": str(tree / "tables")}

    def diagnose(share: Sequence[Path]) -> None:
        command = [sys.executable, "-c", before + OF_ANY_REVISION + _REPORTS, str(out), *map(str, share)]
        subprocess.run(command, cwd=tree, env=environment, check=True)

    with ThreadPoolExecutor(cores) as pool:
        list(pool.map(diagnose, [files[place::cores] for place in range(cores)]))
    return {file: json.loads((out / file.name).read_text()) for file in files}


def leading(report: Report) -> tuple[str, ...]:
    """The leading set of mechanisms."""
    return tuple(sorted(entry["name"] for entry in report["mechanisms"]))


def agree(one: Report, other: Report) -> bool:
    """Whether verdict and leading set are the same; beside a law that nobody listed, the verdict."""
    return one["verdict"] == other["verdict"] and (bool(other.get("unnamed")) or leading(one) == leading(other))


def same(one: Report, other: Report) -> bool:
    """Whether both say the same, numbers included."""
    ours, theirs = _probabilities(one), _probabilities(other)
    near = all(abs(ours.get(key, 0.0) - theirs.get(key, 0.0)) <= _PROBABILITY for key in ours | theirs)
    return agree(one, other) and near and all(shift <= _OF_INTERVAL for shift in _shifts(one, other))


def _probabilities(report: Report) -> dict[Any, float]:
    first = leading(report) if report["verdict"] in ("explained", "ambiguous") else report["verdict"]
    others = {tuple(sorted(entry["mechanisms"])): entry["probability"] for entry in report["alternatives"]}
    return {first: report["probability"], **others}


def _shifts(one: Report, other: Report) -> Iterator[float]:
    """How far each parameter of the leading set moved, in widths of its interval."""
    before = {entry["name"]: {p["name"]: p for p in entry["parameters"]} for entry in one["mechanisms"]}
    for mechanism in other["mechanisms"]:
        for entry in mechanism["parameters"]:
            known = before.get(mechanism["name"], {}).get(entry["name"])
            if known and known["high"] > known["low"]:
                yield abs(entry["value"] - known["value"]) / (known["high"] - known["low"])


def said(report: Report) -> str:
    """Verdict, leading set or law, and probability."""
    law = report.get("unnamed")
    unnamed = f" [{law['acts_on']} over {law['axis']}]" if law else ""
    return f"{report['verdict']} {' + '.join(leading(report))}{unnamed} {report['probability']:.2f}".replace("  ", " ")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("revision")
    parser.add_argument("--mixture", type=int, default=MIXTURE, help="campaigns of our own rig")
    given = parser.parse_args()
    main(given.revision, given.mixture)
