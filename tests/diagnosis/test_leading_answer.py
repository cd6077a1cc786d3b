"""The leading answer is of the most probable kind: nothing, known mechanisms together, or something unlisted."""

from types import SimpleNamespace
from typing import Any

import pytest

from underskin.diagnosis.reporting.statement import answer_clauses
from underskin.diagnosis.selection.answers import Answer, leading_first

pytestmark = pytest.mark.slow


def answers(unlisted: float, nothing: float, *sets: float) -> list[Answer]:
    """Sorted by probability; each set is one mechanism of the catalogue."""
    names = ("ageing", "adhesion", "timing_delay", "crosstalk")
    found: list[tuple[Any, float]] = [(None, unlisted), (SimpleNamespace(names=()), nothing)]
    found += [(SimpleNamespace(names=(name,)), share) for name, share in zip(names, sets, strict=False)]
    return [Answer(one, share) for one, share in sorted(found, key=lambda entry: -entry[1])]


@pytest.mark.parametrize(
    ("shares", "leader"),
    [
        ((0.34, 0.05, 0.21, 0.2, 0.2), "ageing"),  # known ones hold 61 %, though none holds a third
        ((0.45, 0.15, 0.2, 0.2), "none_of_these"),
        ((0.02, 0.5, 0.28, 0.2), "nothing_missing"),
        ((0.02, 0.4, 0.3, 0.28), "ageing"),
    ],
)
def test_the_most_probable_kind_leads(shares: tuple[float, ...], leader: str) -> None:
    ranked = leading_first(answers(*shares))
    assert ranked[0].names == (leader,)
    others = [answer.probability for answer in ranked[1:]]
    assert others == sorted(others, reverse=True)
    assert len(ranked) == len(shares)


def test_leads_together_said_sum() -> None:
    """What leads together is said with its sum."""
    ranked = leading_first(answers(0.34, 0.05, 0.21, 0.2, 0.2))
    statement, *_ = answer_clauses(ranked, "ambiguous", "the paper's model")
    assert statement.startswith("known mechanisms explain this (61 % together), best ageing (21 %), but these rivals")
    assert "something unlisted (34 %)" in statement
