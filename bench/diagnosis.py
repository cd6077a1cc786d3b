"""A whole diagnosis of a campaign of 100 recordings × 60 lines: processor time on one core, and memory."""

import json
import os
import subprocess
import sys
from statistics import median

from bench.diagnosed import Effects
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
_ONE = """
import json, resource, sys, time
from bench.diagnosed import recorded
from bench.diagnosis import PRELOADS_N
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.surrogate.sigma_table import load_table

effects, position_mm = json.loads(sys.argv[1])
hidden = recorded(effects, columns=5, preloads_n=PRELOADS_N, lines=60, position_mm=position_mm)
assert len(hidden.recordings) == 100
start = time.process_time()
verdict = diagnosis_report(hidden, load_table())["verdict"]
print(time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3, verdict)
"""


def measure() -> list[Figure]:
    """Seconds of processor time and peak memory of a process that diagnoses once, for each campaign."""
    figures, memory = [], []
    for name, (effects, position_mm) in CASES.items():
        times = []
        for _ in range(ROUNDS):
            seconds, peak = _diagnosed(effects, position_mm)
            times.append(seconds)
            memory.append(peak)
        figures.append(Figure(f"100 recordings × 60 lines, {name}", median(times), "s", 5.0, "lower"))
    return [*figures, Figure("Peak memory of the process", max(memory), "MB", 500.0, "lower")]


def _diagnosed(effects: Effects, position_mm: float) -> tuple[float, float]:
    run = subprocess.run(
        [sys.executable, "-c", _ONE, json.dumps([effects, position_mm])],
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        check=True,
        capture_output=True,
        text=True,
    )
    seconds, peak, _ = run.stdout.split()
    return float(seconds), float(peak)
