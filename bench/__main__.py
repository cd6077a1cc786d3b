"""Run the benchmarks: python -m bench [PART ...]. A full run is written to docs/bench-results.json."""

import json
import os
import platform
import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from bench import accuracy, batch, newton_step, orderings, single_requests, start, store
from bench.figures import Figure

PARTS = {
    "requests": single_requests.measure,
    "batch": batch.measure,
    "start": start.measure,
    "newton": newton_step.measure,
    "orderings": orderings.measure,
    "accuracy": accuracy.measure,
    "store": store.measure,
}
RESULTS = Path(__file__).parent.parent / "docs" / "bench-results.json"
_PACKAGES = ("numpy", "scipy", "uvicorn", "fastapi", "umbridge", "felupe", "scikit-fem")


def main(names: list[str]) -> None:
    """Measure the parts named, or all; only a full run is written down."""
    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, {about['idle_percent']} % idle before the start\n")
    figures = [figure for name in names or PARTS for figure in PARTS[name]()]
    print(markdown(figures))
    if not names:
        record = {"machine": about, "figures": [asdict(figure) | {"met": figure.met} for figure in figures]}
        RESULTS.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n")


def markdown(figures: list[Figure]) -> str:
    """The figures as a table."""
    lines = ["| what | measured | target | met |", "|---|---|---|---|"]
    for f in figures:
        target = "" if f.target is None else f"{'≥' if f.better == 'higher' else '≤'} {f.target:,.10g}"
        met = {None: "", True: "yes", False: "**no**"}[f.met]
        lines.append(f"| {f.name} | {_rounded(f.value)} {f.unit} | {target} | {met} |")
    return "\n".join(lines)


def machine() -> dict[str, str | int]:
    """What it was measured on."""
    processor = next(
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    )
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    return {
        "processor": processor,
        "cores": len(os.sched_getaffinity(0)),
        "idle_percent": idle_percent(),
        "python": platform.python_version(),
        "packages": packages,
    }


def idle_percent() -> int:
    """How much of all cores nobody used during three seconds: other work disturbs even ratios."""
    idle, total = _processor_times()
    time.sleep(3)
    later_idle, later_total = _processor_times()
    return round(100 * (later_idle - idle) / (later_total - total))


def _processor_times() -> tuple[int, int]:
    """Idle and all ticks since boot."""
    times = [int(ticks) for ticks in Path("/proc/stat").read_text().split()[1:9]]
    return times[3] + times[4], sum(times)


def _rounded(value: float) -> str:
    """Three significant digits, thousands separated."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


main(sys.argv[1:])
