"""An interrupted soak goes on where it was, and its figures are those of the code as it is."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from bench import page, soak
from bench.figures import Figure
from tests.support.repository import ROOT


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the soak keeps what it has done, in place of `build/soak`."""
    monkeypatch.setattr(soak, "folder_of_the_code", lambda: tmp_path / "code")
    monkeypatch.setattr(soak, "SOAK", True)
    return tmp_path / "code"


@pytest.mark.usefixtures("folder")
def test_figures_parts_added_up_worst_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of parts are added up and the worst counts."""
    assert soak.measure() == []
    for part, kills, slowest in ((0, 20, 120.0), (1, 20, 90.0), (1, 20, 110.0)):  # part 1 was run twice
        monkeypatch.setenv("PYTEST_CURRENT_TEST", f"tests/test_x.py::test_y[{part}] (call)")
        soak.record(Figure("kills", kills, "", 250))
        soak.record(Figure("slowest", slowest, "ms", 300, "lower"))
    found = {figure.name: (figure.value, figure.met) for figure in soak.measure()}
    assert found == {"kills": (40, False), "slowest": (120.0, True)}


@pytest.mark.usefixtures("folder")
def test_what_has_passed_is_kept() -> None:
    assert not soak.passed("tests/test_x.py::test_y[0]")
    soak.keep_passed("tests/test_x.py::test_y[0]")
    assert soak.passed("tests/test_x.py::test_y[0]")
    assert not soak.passed("tests/test_x.py::test_y")


def test_nothing_is_kept_at_reduced_counts(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "SOAK", False)
    soak.record(Figure("kills", 3, "", 250))
    assert not folder.exists()


def test_parts_soak_commits_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of a soak are of the commits that finished them."""
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr(page, "PAGE", tmp_path / "validation.md")
    kills, slowest = Figure("kills", 250, "", 250), Figure("slowest", 120.0, "ms", 300, "lower")
    first, later = ({"commit": name, "date": "2026-01-01", "machine": {"cores": 2}} for name in ("a1", "b2"))
    page.keep_soak(first, [kills, slowest])
    page.keep_soak(later, [replace(kills, value=20), replace(slowest, value=400.0)])
    page.write()
    rows = [line for line in page.PAGE.read_text().splitlines() if line.startswith(("| kills", "| slowest"))]
    assert rows == ["| kills | 250  | ≥ 250 | yes | a1 |", "| slowest | 400 ms | ≤ 300 | **no** | b2 |"]


@pytest.mark.slow
def test_soak_run_again_skips_passed() -> None:
    """A soak that is run again skips what has passed."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs", "tests/test_digits.py"]
    for _ in range(2):
        environment = os.environ | {"UNDERSKIN_SOAK": "1"}
        environment.pop("PYTEST_XDIST_WORKER", None)
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert "passed on this code already" in done.stdout
    assert " passed" not in done.stdout.splitlines()[-1]
