"""docs/paper.md and its figures are what `make paper` writes, and the prototype's array comes back from the service."""

import re
from pathlib import Path

import numpy as np
import pytest

from docs.paper import figures
from docs.paper.__main__ import main
from docs.paper.prototype import INDENTERS_MM, PRELOADS_N, press
from docs.paper.service_run import D33_PC_PER_N, ArrayRun, run_array
from docs.paper.stuck_cylinder import section as cylinder_section
from docs.paper.summary import section as summary_section
from docs.paper.text import array_section, claims_section, load_section
from tests.support.repository import ROOT
from underskin.surrogate.sigma_table import SigmaTable, load_table

DOCS = ROOT / "docs"
FIGURES = figures.NUMBERS
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_SVG_IDENTIFIER = re.compile(r"\b[mpch][0-9a-f]{8,}\b")  # hashes of coordinates


@pytest.fixture(scope="module")
def table() -> SigmaTable:
    return load_table()


@pytest.fixture(scope="module")
def run() -> ArrayRun:
    return run_array()


def assert_same_but_for_rounding(made: str, committed: str) -> None:
    """The same words, and numbers that differ in their last digits at most."""
    assert _NUMBER.sub("#", made) == _NUMBER.sub("#", committed)
    made_numbers, committed_numbers = (np.array(_NUMBER.findall(text), dtype=float) for text in (made, committed))
    np.testing.assert_allclose(made_numbers, committed_numbers, rtol=1e-4, atol=2e-4)


def committed_section(start: str) -> str:
    """The section of the committed page that begins like `start`, up to the next heading."""
    heading = start.splitlines()[0]
    page = (DOCS / "paper.md").read_text(encoding="utf-8")
    return heading + page.split(heading)[1].split("\n## ")[0].rstrip("\n")


@pytest.mark.soak
@pytest.mark.server
def test_the_array_comes_back_from_the_service(run: ArrayRun) -> None:
    assert run.status == ["ok"]
    np.testing.assert_allclose(run.d33_from_service, D33_PC_PER_N, rtol=1e-12)
    assert run.largest_spread == 0.0


@pytest.mark.soak
@pytest.mark.server
def test_the_service_agrees_with_fresh_solves(run: ArrayRun) -> None:
    np.testing.assert_allclose(run.d33_from_fresh_solve, D33_PC_PER_N, rtol=2e-5)
    np.testing.assert_allclose(run.frf_from_service, run.frf_from_fresh_solve, rtol=2e-5)


@pytest.mark.soak
@pytest.mark.server
def test_the_page_says_what_the_service_answered(run: ArrayRun) -> None:
    made = array_section(run).rstrip("\n")
    assert_same_but_for_rounding(made, committed_section(made))


@pytest.mark.soak
def test_the_page_says_what_is_computed(table: SigmaTable) -> None:
    presses = [press(table, radius, PRELOADS_N) for radius in INDENTERS_MM]
    for section in (summary_section(table), claims_section(table), load_section(presses), cylinder_section(table)):
        assert_same_but_for_rounding(section.rstrip("\n"), committed_section(section))
    assert table.sha256 in (DOCS / "paper.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def drawn(table: SigmaTable, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The figures, drawn once."""
    return figures.draw(table, tmp_path_factory.mktemp("drawn"))


@pytest.mark.soak
def test_the_figures_are_those_that_are_drawn(drawn: list[Path]) -> None:
    assert [path.name for path in drawn] == [f"paper-fig{number}.svg" for number in FIGURES]
    for path in drawn:
        made, committed = (
            _SVG_IDENTIFIER.sub("id", file.read_text(encoding="utf-8")) for file in (path, DOCS / "figures" / path.name)
        )
        assert_same_but_for_rounding(made, committed)


@pytest.mark.soak
def test_drawing_twice_gives_the_same_bytes(drawn: list[Path], table: SigmaTable, tmp_path: Path) -> None:
    again = figures.draw(table, tmp_path)
    assert [path.name for path in again] == [path.name for path in drawn]
    for path, other in zip(drawn, again, strict=True):
        assert path != other
        assert path.read_bytes() == other.read_bytes()


@pytest.mark.soak
def test_the_whole_page_is_what_make_paper_writes(tmp_path: Path) -> None:
    """Every block is solved again."""
    main(tmp_path)
    made, committed = ((folder / "paper.md").read_text(encoding="utf-8") for folder in (tmp_path, DOCS))
    assert_same_but_for_rounding(made, committed)
