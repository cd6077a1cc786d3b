"""docs/validation.md, written from what `make bench` or one of its parts measured last (docs/bench-results.json)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench.figures import Figure

_DOCS = Path(__file__).parent.parent / "docs"
PAGE, RESULTS = _DOCS / "validation.md", _DOCS / "bench-results.json"

_INTRODUCTION = """# Accuracy and speed, measured

Written by `make bench`, or by the command named at each section, which says where it was measured. Ratios were taken
in turns within one run, medians over the rounds; single times depend on the machine, and other work on it disturbs even
ratios: `idle_percent` is how idle it was before the start. A target is what the project holds itself to; **no** marks
one that was not met.
"""

SOAK = "soak"  # measured by `make soak`
AGAINST = "against"  # measured by `python -m bench diagnosis --against REV`

SECTIONS = {
    "accuracy": "Accuracy of the shipped table",
    "batch": "Batches over HTTP",
    "requests": "Single requests",
    "start": "Start and memory",
    "newton": "Finite elements against FElupe",
    "orderings": "What was tried for the solver",
    "store": "Campaigns kept, listed and inverted",
    "pages": "Pages",
    "mechanisms": "Predictions of composed mechanisms",
    "diagnosis": "A whole diagnosis",
    AGAINST: "A whole diagnosis beside an earlier revision",
    "fleet": "Ten skins as a fleet",
    "waits": "What a reader waits for",
    "bodies": "Bodies of 62 MB",
    "readers": "Long files",
    "curves": "Curves of spheres",
    "nested": "Evidences against nested sampling",
    SOAK: "Kills, power cuts, load and damaged inputs",
}

EXPLANATIONS = {
    "accuracy": """Errors are relative. The fresh solves share nothing with the table but the code of the elements; an
independent finite-element code is compared in `tests/surrogate/test_felupe.py`.""",
    "batch": """One request of 100,000 rows, the server on one core; in turns with it a FastAPI route that reads and
writes JSON by orjson and calls SciPy's `NdBSpline` on the same table (`bench/peers/plain_sigma.py`).""",
    "requests": """8 connections, the server on one core and the load on the other, against the `umbridge` package's own
server and Tesseract Core's runtime, each serving the same spline.""",
    "bodies": """One body of JSON after another, answered or refused, the server and what it starts on one core; every
10 ms `/health` is asked. Memory is what the server and its processes take beyond what the server had before. Processor
time is what the server itself spent within one of these requests: it does not depend on other work of the machine.""",
    "start": "From starting the process to the first answer of `/ready`; resident memory after load.",
    "newton": "One Newton step at equal unknowns, on one core.",
    "orderings": "Factors of one step's matrix, on one core.",
    "store": "Over HTTP, server and client on one machine; 1,000,000 recordings with UNDERSKIN_SOAK=1, else 50,000.",
    "pages": """With 1,000 campaigns of 25 skins kept, and one of 656 recordings of 400 lines. Times of the
server, over HTTP on one machine, the median of nine after the first; weight as sent, without plotly's script. The
main thread is Chromium's, from the start of the page on, with plotly's script in its cache, the median of nine.""",
    "diagnosis": "Campaigns of the virtual rig; each diagnosis in a fresh process with one BLAS thread.",
    AGAINST: """Processor time on one core, in turns, medians over the rounds and the campaigns: those of the folder
that `UNDERSKIN_CAMPAIGNS` names, and those of `bench diagnosis`. Laws that nobody listed may take half as long
again.""",
    "fleet": "Skins of the virtual rig with nothing missing, in one process with one BLAS thread, files not counted.",
    "waits": """The server and its workers have one core, and Chromium runs beside them; a worker is ready before each
click. The files are campaigns of 64 recordings × 60 lines, whose reports are the same to the byte for one process and
two.""",
    "readers": """Processor time of the reading process and of the one that asked it. Memory includes the
interpreter's, and that of the numbers.""",
    "curves": """Ratios are of the root mean squares that plain least squares leave of one curve alone, the modulus, the
contact point and the force's zero free: the diagnosis' own fit, by which it states `fit.before.rmse_percent`, beside
SciPy's `least_squares` from several starts, with Hertz' and Johnson, Kendall and Roberts' laws written out in
`bench/curve_peers.py`, and beside nanite's `hertz_paraboloidal` under lmfit. Real curves are those of the folder that
`UNDERSKIN_RECORDINGS` names, spheres that stick those of `UNDERSKIN_CAMPAIGNS`. Times are of the processor, of a whole
diagnosis in a fresh process with one BLAS thread, the median of three.""",
    "nested": """Nothing and three single mechanisms on campaigns of 24 recordings × 20 lines of the virtual rig: the
diagnosis' fits from many starts and Laplace's method, against dynesty with its own defaults. Both call the same code
for a likelihood, with the same priors and noise. Differences are of all hypotheses within 10 nats of the winner.""",
    SOAK: """By `make soak`, as far as it has come: the tests at full counts, each on the commit that is named, since
all of them take hours. A part that failed has no figure. In a power cut the disk forgets what was not synced, or keeps
some sectors of it (`tests/support/power/`). Damaged files are read by one process that goes on from file to file;
those read *apart* each by the process of its own in which the service and commands read files. One test alone is
`UNDERSKIN_SOAK=1 .venv/bin/python -m pytest FILE`, and the command above then writes what it measured: load is
`tests/service/test_load.py`, uploads `tests/service/ingest/test_concurrent_uploads.py`, diagnoses
`tests/service/jobs/test_many_diagnoses.py`, kills `tests/service/store/test_store_durability.py`, power cuts
`tests/service/store/test_power_loss.py`, migrations `tests/service/store/test_migration_killed.py` and
`test_old_stores.py`, routes `tests/service/routes/test_openapi.py`, damaged files
`tests/recordings/fuzz/test_fuzz_readers.py`. Inputs are made by Schemathesis from the OpenAPI document, for each route,
and added up by the first part of its path; a route that takes nothing has ten.""",
    "mechanisms": """One prediction of all lines with its derivatives with respect to all parameters and to the
contacts' positions, under three mechanisms; processor time on one core.""",
}


def keep(part: str, measured: Mapping[str, object], figures: Sequence[Figure]) -> None:
    """Store the results of one part in the place of its previous ones; `measured`: commit, date and machine."""
    _store(part, measured, [asdict(figure) for figure in figures])


def keep_soak(measured: Mapping[str, object], figures: Sequence[Figure]) -> None:
    """Store those of a soak of a commit beside what it has not measured yet: a soak takes hours, so that its parts may
    be of several commits, each of which is named. Counts that have not reached their target replace nothing."""
    stored = {stored_figure["name"]: stored_figure for stored_figure in _results().get(SOAK, {}).get("figures", [])}
    for figure in figures:
        unfinished = figure.better == "higher" and figure.met is False
        if not (unfinished and figure.name in stored):
            stored[figure.name] = {**asdict(figure), "commit": measured["commit"]}
    _store(SOAK, measured, [stored[name] for name in sorted(stored)])


def _store(part: str, measured: Mapping[str, object], figures: Sequence[Mapping[str, object]]) -> None:
    results = _results()
    results[part] = {**measured, "figures": [dict(figure) for figure in figures]}
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False, sort_keys=True) + "\n")


def write() -> None:
    """Write the page from all stored results."""
    text = _INTRODUCTION
    results = _results()
    for part, title in SECTIONS.items():
        if part in results:
            commits = {
                figure["name"]: figure.pop("commit") for figure in results[part]["figures"] if "commit" in figure
            }
            figures = [Figure(**figure) for figure in results[part]["figures"]]
            made = results[part]
            machine = ", ".join(f"{name} {value}" for name, value in made["machine"].items())
            command = "diagnosis --against 127b47b" if part == AGAINST else part
            text += f"\n## {title}\n\n`python -m bench {command}`. {EXPLANATIONS[part]}\n\n"
            of_commit = "" if commits else f" on commit {made['commit']}"
            text += f"{markdown(figures, commits)}\n\nMeasured{of_commit}, {made['date']}, on: {machine}.\n"
    PAGE.write_text(text)


def _results() -> dict[str, Any]:
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {}


def markdown(figures: Sequence[Figure], commits: Mapping[str, str] | None = None) -> str:
    """The figures as a table, with the commits that they are of, by name, where any are."""
    lines = ["| what | measured | target | met |", "|---|---|---|---|"]
    if commits:
        lines = ["| what | measured | target | met | of commit |", "|---|---|---|---|---|"]
    for f in figures:
        target = "" if f.target is None else f"{'≥' if f.better == 'higher' else '≤'} {f.target:,.10g}"
        met = {None: "", True: "yes", False: "**no**"}[f.met]
        commit = f" {commits.get(f.name, '')} |" if commits else ""
        lines.append(f"| {f.name} | {_rounded(f.value)} {f.unit} | {target} | {met} |{commit}")
    return "\n".join(lines)


def _rounded(value: float) -> str:
    """Three significant digits, thousands separated."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
