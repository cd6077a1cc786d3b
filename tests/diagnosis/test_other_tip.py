"""How much the few curves count whose tip looks like a cone."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

import pytest

from underskin.diagnosis.pipeline import _beside_other_tip
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding


@dataclass(frozen=True)
class Parts:
    """What the step reads of a diagnosis, its problem and its search."""

    findings: tuple[Finding, ...] = ()
    recordings: int = 1
    names: tuple[str, ...] = ("contact_creep",)
    imitating: Mapping[tuple[str, ...], float] = field(default_factory=dict)

    @property
    def lines(self) -> "Parts":
        return self

    @property
    def explanation(self) -> "Parts":
        return self

    @property
    def answers(self) -> list["Parts"]:
        return [self]


@pytest.mark.parametrize(
    ("flagged", "curves", "known", "odds"), [(1, 40, 0.0, 0.025), (1, 1, 0.0, 1.0), (1, 40, 0.3, 0.3), (0, 4, 0.3, 0.3)]
)
def test_a_tip_counts_by_the_share_of_its_curves(flagged: int, curves: int, known: float, odds: float) -> None:
    """One curve among forty does not halve the probability of the leading set; larger odds known before stay."""
    findings = tuple(Finding(Reason.TIP_SHAPE, f"c{number}", "force_n", {}) for number in range(flagged))
    parts: Any = Parts(findings, curves, imitating={("contact_creep",): known})
    result = cast(Any, _beside_other_tip(parts, parts, parts))
    assert result.imitating == {("contact_creep",): odds}
