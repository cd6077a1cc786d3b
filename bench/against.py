"""A whole diagnosis by this tree and by another revision, in turns on one core: processor time of both."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median

from bench.diagnosed import document
from bench.diagnosis import CASES, PRELOADS_N, ROOT, SINGLE_THREAD, command_seconds
from bench.figures import Figure

ROUNDS = 3
_COMMANDS = 8  # campaigns of which the whole command is timed
_FASTER = 5.0
_WITH_LAWS = 1.5  # allowed ratio of time, because unlisted laws are tried too, which no earlier revision did
NAMED_ALONE = """
from underskin.diagnosis import pipeline
pipeline.with_laws = lambda *_: ()
"""
OF_ANY_REVISION = """
import json, sys, time
from pathlib import Path
try:
    from underskin import diagnose as diagnosis_report
    from underskin import load_table
except ImportError:  # of before the diagnosis had a public name
    try:
        from underskin.diagnosis.pipeline import diagnosis_report
        from underskin.surrogate.sigma_table import load_table
    except ImportError:  # of before the library had wings
        from underskin.diagnosis.diagnose import diagnosis_report
        from underskin.surrogate import load_table
from underskin.recordings.campaign import parse

table = load_table()
"""
_TIMES = """
for file in sys.argv[1:]:
    with open(file) as text:
        campaign = parse(json.load(text))
    start = time.process_time()
    diagnosis_report(campaign, table)
    print(time.process_time() - start, flush=True)
"""


def measure(revision: str) -> list[Figure]:
    """Medians over the open campaigns, where there are any, and over those of `bench diagnosis`, and their ratios."""
    folder = os.environ.get("UNDERSKIN_CAMPAIGNS")
    sets = {"open campaigns": sorted((Path(folder) / "open").glob("*.json")) if folder else []}
    figures = []
    with tempfile.TemporaryDirectory() as temporary, worktree(ROOT, revision, Path(temporary) / "tree") as base_tree:
        sets["campaigns of 100 recordings × 60 lines"] = _written(Path(temporary))
        for name, files in sets.items():
            if not files:
                continue
            rounds = [
                (
                    *(_seconds(ROOT, files), _seconds(ROOT, files, NAMED_ALONE), _seconds(base_tree, files)),
                    *([command_seconds(file, tree) for file in files[:_COMMANDS]] for tree in (ROOT, base_tree)),
                )
                for _ in range(ROUNDS)
            ]
            ours, named, theirs, waited, waited_theirs = (
                median(map(median, zip(*times, strict=True))) for times in zip(*rounds, strict=True)
            )
            figures += [
                Figure(f"{len(files)} {name}, median", ours, "s"),
                Figure("the same by named mechanisms alone", named, "s"),
                Figure(f"the same by {revision}, which has no others", theirs, "s"),
                Figure(
                    f"{len(files)} {name}: {revision}, by named mechanisms alone", theirs / named, "× ours", _FASTER
                ),
                Figure(f"{len(files)} {name}: {revision}", theirs / ours, "× ours", round(_FASTER / _WITH_LAWS, 2)),
                Figure(
                    f"as a command, from the start to the report, {min(len(files), _COMMANDS)} of them", waited, "s"
                ),
                Figure(f"the same by {revision}", waited_theirs / waited, "× ours"),
            ]
    return figures


@contextmanager
def worktree(root: Path, revision: str, folder: Path) -> Iterator[Path]:
    """Another revision's files, with what git does not hold of its library, for as long as it is used."""
    subprocess.run(["git", "-C", root, "worktree", "add", "--quiet", "--detach", folder, revision], check=True)
    try:
        if (folder / "scripts" / "client_documents.py").exists():
            subprocess.run([sys.executable, "-m", "scripts.client_documents"], cwd=folder, check=True)
        yield folder
    finally:
        subprocess.run(["git", "-C", root, "worktree", "remove", "--force", folder], check=True)


def _written(folder: Path) -> list[Path]:
    """The campaigns of `bench diagnosis` as files."""
    files = []
    for number, (effects, position_mm) in enumerate(CASES.values()):
        hidden = document(effects, columns=5, preloads_n=PRELOADS_N, lines=60, position_mm=position_mm)
        files.append(folder / f"{number}.json")
        files[-1].write_text(json.dumps(hidden))
    return files


def _seconds(tree: Path, files: Sequence[Path], before: str = "") -> list[float]:
    """Processor time of each campaign's diagnosis, all in one process, `before` which this is run."""
    run = subprocess.run(
        [sys.executable, "-c", before + OF_ANY_REVISION + _TIMES, *map(str, files)],
        cwd=tree,
        env={**os.environ, **SINGLE_THREAD, "PYTHONPATH": str(tree), "UNDERSKIN_TABLES": str(tree / "tables")},
        check=True,
        capture_output=True,
        text=True,
    )
    return [float(line) for line in run.stdout.split()]
