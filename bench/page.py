"""docs/validation.md, written by a full run of `make bench` from what it measured."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from bench.figures import Figure

PAGE = Path(__file__).parent.parent / "docs" / "validation.md"

_INTRODUCTION = """# Accuracy and speed, measured

Written by `make bench` on {machine}. Ratios were taken in turns within one run, medians over the rounds; single times
depend on the machine. A target is what the project holds itself to; **no** marks a target that is not met.
"""

_SECTIONS = {
    "accuracy": "Accuracy of the shipped table",
    "batch": "Batches over HTTP",
    "requests": "Single requests",
    "start": "Start and memory",
    "newton": "Finite elements against FElupe",
    "orderings": "What was tried for the solver",
}

_EXPLANATIONS = {
    "accuracy": """Errors are relative. The fresh solves share nothing with the table but the code of the elements; an
independent finite-element code is compared in `tests/test_felupe.py`.""",
    "batch": "One request of 100,000 rows, the server on one core.",
    "requests": """8 connections, the server on one core and the load on the other, against the `umbridge` package's own
server and Tesseract Core's runtime, each serving the same spline.""",
    "start": "From starting the process to the first answer of `/ready`; resident memory after load.",
    "newton": "One Newton step at equal unknowns, on one core.",
    "orderings": "Factors of one step's matrix, on one core.",
}


def write(machine: Mapping[str, object], figures: Mapping[str, Sequence[Figure]]) -> None:
    """Write the page for the figures of every part."""
    text = _INTRODUCTION.format(machine=", ".join(f"{name}: {value}" for name, value in machine.items()))
    for part, title in _SECTIONS.items():
        text += f"\n## {title}\n\n`python -m bench {part}`. {_EXPLANATIONS[part]}\n\n{markdown(figures[part])}\n"
    PAGE.write_text(text)


def markdown(figures: Sequence[Figure]) -> str:
    """The figures as a table."""
    lines = ["| what | measured | target | met |", "|---|---|---|---|"]
    for f in figures:
        target = "" if f.target is None else f"{'≥' if f.better == 'higher' else '≤'} {f.target:,.10g}"
        met = {None: "", True: "yes", False: "**no**"}[f.met]
        lines.append(f"| {f.name} | {_rounded(f.value)} {f.unit} | {target} | {met} |")
    return "\n".join(lines)


def _rounded(value: float) -> str:
    """Three significant digits, thousands separated."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
