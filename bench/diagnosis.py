"""A whole diagnosis of campaigns of the virtual rig: processor time on one core, and memory.

What a user waits for is the command: the start of the program, reading, the diagnosis, and the report as a file.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from bench.diagnosed import Effects, document
from bench.figures import Figure

_TWO: Effects = {"amplifier_high_pass": {"corner_hz": 1.0}, "preload_dependent_d33": {"beta_per_mpa": 1.5}}
CASES: dict[str, tuple[Effects, float]] = {  # what is hidden, and the scatter of position [mm]
    "nothing missing": ({}, 0.0),
    "one mechanism": ({"contact_resonance": {"tip_mass_g": 2, "damping": 0.04}}, 0.0),
    "two mechanisms": (_TWO, 0.0),
    "two mechanisms, places that scatter by 0.15 mm": (_TWO, 0.15),
}
PRELOADS_N = (0.3, 0.5, 0.7, 1, 1.3, 1.6, 2, 2.3, 2.6, 3)
ROUNDS = 3
ROOT = Path(__file__).parents[1]
SINGLE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
_COMMAND = "start, reading, diagnosis and report"
_MEMORY = 400.0  # MB
_SMALL: dict[str, Any] = {"columns": 5, "preloads_n": PRELOADS_N, "lines": 60}
_LARGE: dict[str, Any] = {"columns": 41, "preloads_n": (0.3, 0.6, 1, 1.4, 1.8, 2.2, 2.6, 3), "lines": 400}
_SCRIPT = """
import sys, time
from pathlib import Path
from underskin.compiled import load_all
from underskin.diagnosis.diagnose import diagnose
from underskin.recordings import read_file
from underskin.surrogate.sigma_table import load_table

load_all()
table = load_table()
campaign = read_file(Path(sys.argv[1]), "campaign.json").campaign
start = time.process_time()
verdict = diagnose(campaign, table).verdict
# Its own peak: that of resource.getrusage is at least what the process that started it took.
peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
print(time.process_time() - start, int(peak.split()[1]) * 1024 / 1e6, verdict)
"""


def measure() -> list[Figure]:
    """Seconds of processor time of a diagnosis and peak memory of its process, which has read the campaign's file."""
    figures, memory = [], 0.0
    for name, (effects, position_mm) in CASES.items():
        seconds, waited, peak = _diagnosed(effects, {**_SMALL, "position_mm": position_mm})
        figures.append(Figure(f"100 recordings × 60 lines, {name}", seconds, "s", 1.0, "lower"))
        figures.append(Figure(f"the same as a command: {_COMMAND}", waited, "s"))
        memory = max(memory, peak)
    figures.append(Figure("Peak memory of the process", memory, "MB", _MEMORY, "lower"))
    effects, _ = CASES["one mechanism"]
    seconds, waited, peak = _diagnosed(effects, _LARGE)
    return [
        *figures,
        Figure("656 recordings × 400 lines, one mechanism", seconds, "s", 4.0, "lower"),
        Figure(f"the same as a command: {_COMMAND}", waited, "s"),
        Figure("656 recordings × 400 lines, peak memory of the process", peak, "MB", _MEMORY, "lower"),
    ]


def _diagnosed(effects: Effects, design: dict[str, Any]) -> tuple[float, float, float]:
    """Median seconds of a diagnosis and of the whole command, and the largest peak memory [MB], over the rounds."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "campaign.json"
        file.write_text(json.dumps(document(effects, **design)))
        seconds, memory = zip(*(_once(file) for _ in range(ROUNDS)), strict=True)
        waited = [command_seconds(file) for _ in range(ROUNDS)]
    return median(seconds), median(waited), max(memory)


def _once(file: Path) -> tuple[float, float]:
    run = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(file)],
        env=os.environ | SINGLE_THREAD,
        check=True,
        capture_output=True,
        text=True,
    )
    seconds, peak, _ = run.stdout.split()
    return float(seconds), float(peak)


def command_seconds(file: Path, tree: Path = ROOT) -> float:
    """Processor time of `underskin diagnose FILE` of the tree of a revision, from its start to the report."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "underskin", "diagnose", str(file), "--output-dir", folder, "--workers", "1"]
        settings = {**SINGLE_THREAD, "PYTHONPATH": str(tree), "UNDERSKIN_TABLES": str(tree / "tables")}
        started = _of_children()
        subprocess.run(command, cwd=tree, env=os.environ | settings, check=True, capture_output=True)
        return _of_children() - started


def _of_children() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime
