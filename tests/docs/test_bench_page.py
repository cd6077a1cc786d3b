"""Every part of the benchmarks has its place on docs/validation.md, so that no measurement is lost."""

from bench.__main__ import PARTS
from bench.page import AGAINST, EXPLANATIONS, SECTIONS


def test_every_part_title_explanation() -> None:
    """Every part has a title and an explanation."""
    assert {*PARTS, AGAINST} == set(SECTIONS) == set(EXPLANATIONS)
