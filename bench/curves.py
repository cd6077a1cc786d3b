"""Curves of spheres: residuals of plain least squares compared with other fits, and the processor time of a
diagnosis."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from bench.curve_fits import accuracy, real_campaigns
from bench.figures import Figure
from rig.description import parse as experiment
from rig.elastomer import campaign_of_curves, record_curves

ROUNDS = 3
_SINGLE_CURVE, _TWELVE_CURVES, _REAL = 3.0, 10.0, 5.0  # s
_SCRIPT = """
import json, sys, time
from underskin import diagnose, load_table
from underskin.recordings.campaign import parse

with open(sys.argv[1]) as text:
    campaign = parse(json.load(text))
table = load_table()
start = time.process_time()
diagnose(campaign, table)
print(time.process_time() - start)
"""


def measure() -> list[Figure]:
    """Ratios of what fits leave, then seconds of processor time of a process that diagnoses once."""
    samples = "of 3,000 samples with air, snap-in, hold and pull-off"
    figures = [
        *accuracy(),
        Figure(f"One curve {samples}", _seconds(drawn([0.017], [4e-4], 1)), "s", _SINGLE_CURVE, "lower"),
        Figure(
            f"Twelve curves {samples}", _seconds(drawn([0.017, 0.012], [4e-4, 1e-4], 3)), "s", _TWELVE_CURVES, "lower"
        ),
    ]
    real = [_seconds(document) for document in real_campaigns().values()]
    if real:
        figures.append(Figure(f"{len(real)} campaigns of real curves, the slowest", max(real), "s", _REAL, "lower"))
    return figures


def drawn(indenters_mm: Sequence[float], speeds_mm_per_s: Sequence[float], repeats: int) -> dict[str, Any]:
    """A campaign (`campaign/1`) of small spheres that stick to a silicone, under a cantilever of known stiffness."""
    description = {
        "schema": "experiment/1",
        "name": "curves",
        "seed": 11,
        "kind": "indentation",
        "skin": {"thickness_mm": 0.6, "youngs_modulus_mpa": 1.8, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0},
        "curves": {
            "indenters_mm": list(indenters_mm),
            "speeds_mm_per_s": list(speeds_mm_per_s),
            "repeats": repeats,
            "samples": 3000,
            "largest_displacement_mm": 1.6e-3,
            "hold_s": 20.0,
            "retract": True,
            "approach_mm": 3e-4,
            "retreat_mm": 4e-4,
            "stage_stiffness_n_per_mm": 0.03,
            "stage_declared": True,
            "times": True,
            "modulus_declared": False,
            "units_checked": True,
            "contact_point_mm": 4.7e-3,
            "force_zero_n": 2.6e-7,
            "gain": 0.004,
            "cell_gain": 0.01,
            "force_noise_n": 2.2e-8,
        },
        "effects": {"adhesion": {"work_j_per_m2": 0.04, "work_of_separation_j_per_m2": 0.075}},
    }
    pressed = experiment(description)
    return campaign_of_curves(pressed, record_curves(pressed))


def _seconds(document: dict[str, Any]) -> float:
    """Processor time of a diagnosis, each in a fresh process with one BLAS thread; the median of the rounds."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "campaign.json"
        file.write_text(json.dumps(document))
        return median(_once(file) for _ in range(ROUNDS))


def _once(file: Path) -> float:
    run = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(file)],
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        check=True,
        capture_output=True,
        text=True,
    )
    return float(run.stdout)
