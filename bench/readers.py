"""Reading 100 MB of time series as CSV, in the process of its own in which such files are read."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from bench.figures import Figure
from underskin.units import Floats

_BYTES, _CHUNK, _MOST_S, _MOST_MB = 100_000_000, 100_000, 10.0, 500.0
# Asked by a small process of its own: one that is started counts at first the memory of the one that starts it.
_READ = """
import json, os, resource, sys
from pathlib import Path
from underskin.recordings.reading import read_contents
before, file = os.times(), Path(sys.argv[1])
read_contents(file, file.name)
seconds = sum(os.times()[:4]) - sum(before[:4])
print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e3]))
"""
_ABOVE = """schema,campaign/1
name,long
skin.id,palm-3
skin.thickness_mm,2.5
skin.youngs_modulus_mpa,16
skin.poisson_ratio,0.5
skin.sensor_radius_mm,1.5
sensor,s01,0,0

id,sensor,indenter_radius_mm,preload_n,dynamic_force_n,sample_rate_hz,force_n,charge_pc
"""


def measure() -> list[Figure]:
    """Processor time of both processes, and the most memory that any of the readings took in the one of its own."""
    shapes = {
        "a table of time, force and charge": ("Time [s],Force [N],Charge [pC]\n", _table),
        "a table of whole numbers below 100": ("Force [N],Charge [pC]\n", _counts),
        "a template with series of 250,000 samples": (_ABOVE, _template),
    }
    figures, most = [], 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name, (above, rows) in shapes.items():
            file = Path(folder) / "long.csv"
            _write(file, above, rows)
            seconds, megabytes = json.loads(subprocess.check_output([sys.executable, "-c", _READ, file]))
            figures.append(Figure(f"100 MB of CSV, {name}", seconds, "s", _MOST_S, "lower"))
            most = max(most, megabytes)
    return [*figures, Figure("Memory of the process that reads them, at most", most, "MB", _MOST_MB, "lower")]


def _write(file: Path, above: str, rows: Callable[[Floats, int], Iterator[str]]) -> None:
    random = np.random.default_rng(1)
    first = 0
    with file.open("w") as stream:
        stream.write(above)
        while stream.tell() < _BYTES:
            stream.writelines(rows(random.normal(size=(_CHUNK, 2)), first))
            first += _CHUNK


def _table(values: Floats, first: int) -> Iterator[str]:
    for row, (force, charge) in enumerate(values.tolist(), start=first):
        yield f"{row * 1e-4:.6f},{force:.6f},{charge:.6f}\n"


def _counts(values: Floats, _first: int) -> Iterator[str]:
    for force, charge in (30 * values).clip(-99, 99).astype(int).tolist():
        yield f"{force},{charge}\n"


def _template(values: Floats, first: int) -> Iterator[str]:
    for row, (force, charge) in enumerate(values.tolist(), start=first):
        once = f"r{row},s01,4,1.0,0.09,2000" if row % 250_000 == 0 else ",,,,,"
        yield f"{once},{force:.6f},{charge:.6f}\n"
