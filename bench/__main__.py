"""Run the benchmarks: python -m bench [PART ...]. What was measured is written to docs/validation.md."""

import argparse
import os
import platform
import subprocess
import time
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path

from bench import (
    accuracy,
    batch,
    bodies,
    curves,
    diagnosis,
    fleet,
    mechanisms,
    nested,
    newton_step,
    orderings,
    pages,
    readers,
    single_requests,
    soak,
    start,
    store,
    waits,
)
from bench import against as against_revision
from bench.page import AGAINST, SOAK, keep, keep_soak, markdown, write

PARTS = {
    "requests": single_requests.measure,
    "batch": batch.measure,
    "bodies": bodies.measure,
    "start": start.measure,
    "newton": newton_step.measure,
    "orderings": orderings.measure,
    "accuracy": accuracy.measure,
    "mechanisms": mechanisms.measure,
    "diagnosis": diagnosis.measure,
    "fleet": fleet.measure,
    "curves": curves.measure,
    "nested": nested.measure,
    "store": store.measure,
    "pages": pages.measure,
    "waits": waits.measure,
    "readers": readers.measure,
    SOAK: soak.measure,
}
_PACKAGES = ("numpy", "scipy", "uvicorn", "fastapi", "umbridge", "felupe", "scikit-fem", "dynesty")


def main(names: list[str], against: str | None) -> None:
    """Measure the parts named, or all, and write the page with what is new in it; a diagnosis `against` a revision."""
    parts = PARTS if against is None else {AGAINST: partial(against_revision.measure, against)}
    all_parts = [name for name in parts if name != SOAK]  # that is measured by make soak
    for name in names if names and against is None else all_parts:
        measured = {"commit": commit(), "date": datetime.now(UTC).date().isoformat(), "machine": machine()}
        print(f"{name}: {measured}", flush=True)
        figures = parts[name]()
        print(markdown(figures), flush=True)
        if figures and name == SOAK:
            keep_soak(measured, figures)
        elif figures:
            keep(name, measured, figures)
    write()


def commit() -> str:
    """That of the code as it is, "-dirty" where it differs from it."""
    command = ["git", "describe", "--always", "--dirty"]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent).stdout.strip()


def machine() -> dict[str, str | int]:
    """The machine and the package versions of a measurement."""
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
    """Idle share of all cores over three seconds; other work disturbs even ratios."""
    idle, total = _processor_times()
    time.sleep(3)
    later_idle, later_total = _processor_times()
    return round(100 * (later_idle - idle) / (later_total - total))


def _processor_times() -> tuple[int, int]:
    """Idle and all ticks since boot."""
    times = [int(ticks) for ticks in Path("/proc/stat").read_text().split()[1:9]]
    return times[3] + times[4], sum(times)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument(
        "parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all but soak, if none is given"
    )
    parser.add_argument(
        "--against", metavar="REV", help="with diagnosis: processor time beside that of another revision"
    )
    options = parser.parse_args()
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    if options.against is not None and options.parts != ["diagnosis"]:
        parser.error("--against goes with diagnosis alone")
    main(options.parts, options.against)
