"""Waiting times of a reader: from the click on a campaign's page to the verdict, and for the reports of many files."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from playwright.sync_api import sync_playwright

from bench import servers
from bench.diagnosed import Effects, document
from bench.figures import Figure

ROUNDS = 3
FILES = 48  # many, so that the start of a command, which no process shares, counts for little
_READY_S = 8.0  # until the server has a worker ready
_PRELOADS_N = (0.3, 0.6, 1, 1.4, 1.8, 2.2, 2.6, 3)
_HIDDEN: tuple[Effects, ...] = (
    {"contact_resonance": {"tip_mass_g": 2, "damping": 0.04}},
    {"preload_dependent_d33": {"beta_per_mpa": 1.5}},
    {"amplifier_high_pass": {"corner_hz": 1.0}},
)


def measure() -> list[Figure]:
    """Seconds from the click to the verdict, and how many times as fast two processes are as one."""
    waits = _from_click_to_verdict()
    return [
        Figure("From the click to the verdict on the page, 64 recordings", median(waits), "s", 2.0, "lower"),
        Figure(f"{FILES} files by two processes", _two_over_one(), "× one process", 1.8),
    ]


def _campaign(number: int) -> dict[str, object]:
    """64 recordings of 60 lines that hide one effect."""
    made = document(_HIDDEN[number % len(_HIDDEN)], columns=4, preloads_n=_PRELOADS_N, lines=60)
    return {**made, "name": f"bench {number}"}


def _from_click_to_verdict() -> list[float]:
    """One campaign after another on one server, which shares one core with its workers."""
    waits = []
    with servers.underskin() as server, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page()
        for number in range(ROUNDS):
            stored = server.post("/v1/campaigns", _campaign(number))["id"]
            page.goto(f"http://127.0.0.1:{server.port}/campaigns/{stored}")
            page.wait_for_load_state("networkidle")
            time.sleep(_READY_S)
            start = time.perf_counter()
            page.get_by_role("button", name="Diagnose").click()
            page.get_by_role("heading", name="Where the model and the recordings differ").wait_for(timeout=60_000)
            waits.append(time.perf_counter() - start)
        browser.close()
    return waits


def _two_over_one() -> float:
    """The ratio of the times of `underskin diagnose` on the same files, whose reports must be the same to the byte."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{number:02d}.json" for number in range(FILES)]
        for number, file in enumerate(files):
            file.write_text(json.dumps(_campaign(number)))
        folders = {workers: Path(folder) / str(workers) for workers in (1, 2)}
        rounds = [[_seconds(files, *arguments) for arguments in folders.items()] for _ in range(ROUNDS)]
        single, double = (sorted(reports.iterdir()) for reports in folders.values())
        if [file.read_bytes() for file in single] != [file.read_bytes() for file in double]:
            raise RuntimeError("reports depend on the number of processes")
    return median(single_s for single_s, _ in rounds) / median(double_s for _, double_s in rounds)


def _seconds(files: list[Path], workers: int, folder: Path) -> float:
    command = [str(Path(sys.executable).with_name("underskin")), "diagnose", *map(str, files)]
    start = time.perf_counter()
    subprocess.run([*command, "--workers", str(workers), "--output-dir", str(folder)], check=True, capture_output=True)
    return time.perf_counter() - start
