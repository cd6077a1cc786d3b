"""Every part of the benchmarks has its place on docs/validation.md, so that no measurement is lost."""

from bench.__main__ import PARTS
from bench.page import AGAINST, EXPLANATIONS, SECTIONS


def test_every_part_has_a_title_and_an_explanation() -> None:
    assert {*PARTS, AGAINST} == set(SECTIONS) == set(EXPLANATIONS)
