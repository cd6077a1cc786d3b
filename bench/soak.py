"""The soak test: what `make soak` has done already, and its measurements; an interrupted run is continued.

Under `build/soak/`, in a folder for each state of the code: `passed`, one test per line, which is not run again; and
`figures.jsonl`, which `python -m bench soak` writes into docs/validation.md, together with those of earlier commits.
"""

import functools
import hashlib
import json
import os
from dataclasses import asdict, replace
from pathlib import Path

from bench.figures import Figure

ROOT = Path(__file__).parent.parent
SOAK = os.environ.get("UNDERSKIN_SOAK") == "1"
FOLDER = ROOT / "build" / "soak"
_CODE = ("underskin", "service", "rig", "proof", "tablegen", "tables", "bench", "tests")
_FIGURES = "figures.jsonl"
_KINDS = {".py", ".c", ".html", ".js", ".css", ".h5"}


def measure() -> list[Figure]:
    """What the soak of the code as it is has measured so far."""
    results_file = folder_of_the_code() / _FIGURES
    if not results_file.exists():
        return []
    by_test: dict[tuple[str, str], Figure] = {}  # of a test that was run again the last
    for line in map(json.loads, results_file.read_text().splitlines()):
        figure = Figure(**line["figure"])
        by_test[line["test"], figure.name] = figure
    figures: dict[str, Figure] = {}
    for figure in by_test.values():
        earlier = figures.get(figure.name, figure)
        if earlier is not figure:
            both = earlier.value, figure.value
            figure = replace(figure, value=sum(both) if figure.better == "higher" else max(both))
        figures[figure.name] = figure
    return sorted(figures.values(), key=lambda figure: figure.name)


def passed(test: str) -> bool:
    """Whether a test, by its id, has passed on the code as it is."""
    passed_file = folder_of_the_code() / "passed"
    return passed_file.exists() and test in passed_file.read_text().splitlines()


def keep_passed(test: str) -> None:
    """Record that it has passed."""
    _append("passed", test)


def record(figure: Figure) -> None:
    """Record a figure of a soak for the current test; runs at reduced counts record none.

    Figures of one name are of parts of one test: those to be `higher` are summed, of the others the largest counts.
    """
    if SOAK:
        test = os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")[0]
        _append(_FIGURES, json.dumps({"test": test, "figure": asdict(figure)}))


def _append(file: str, line: str) -> None:
    folder = folder_of_the_code()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / file).open("a") as stream:
        stream.write(f"{line}\n")


@functools.cache
def folder_of_the_code() -> Path:
    """Of the code as it is."""
    digest = hashlib.sha256()
    for package in _CODE:
        for file in sorted((ROOT / package).rglob("*")):
            if file.suffix in _KINDS:
                digest.update(f"{file.relative_to(ROOT)}\n".encode())
                digest.update(file.read_bytes())
    return FOLDER / digest.hexdigest()[:16]
