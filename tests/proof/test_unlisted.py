"""Judging laws that nobody listed: what counts as right, and whole campaigns of the rig that hides them."""

from pathlib import Path
from typing import Any

import pytest

from proof.stored import Work
from proof.text_unlisted import hidden
from proof.unlisted import judge_unlisted, judged


def entry(
    law: dict[str, Any] | None,
    *,
    floor: float = 2.0,
    verdict: str = "unexplained",
    probability: float = 0.9,
    identifiable: bool = True,
) -> dict[str, Any]:
    truth = {
        "identifiable": identifiable,
        "chi2_gain_over_base": 30.0,
        "law": {"acts_on": "modulus", "axis": "order", "form": "linear"},
        "acts_on_also": ["force"],
        "axis_also": ["recorded_at"],
        "form_also": [],
    }
    report = {
        "verdict": verdict,
        "probability": probability,
        "statement": "Something.",
        "unnamed": law,
        "alternatives": [{"mechanisms": ["nothing_missing"], "probability": 0.04}],
        "fit": {"noise_floor_percent": floor},
    }
    return judged("0001", truth, report)


def law(acts_on: str, axis: str, form: str, after: float = 2.2) -> dict[str, Any]:
    return {"acts_on": acts_on, "axis": axis, "form": form, "heldout_rmse_percent": {"before": 9.0, "after": after}}


def test_an_equivalent_that_the_rig_cannot_tell_apart_is_right() -> None:
    assert entry(law("modulus", "order", "linear"))["shaped"]
    assert entry(law("force", "recorded_at", "linear"))["shaped"]
    assert entry(law("force", "order", "power"))["placed"]
    assert not entry(law("force", "order", "power"))["shaped"]
    assert not entry(law("gain", "order", "linear"))["placed"]
    assert not entry(law("modulus", "preload_n", "linear"))["placed"]
    assert not entry(None)["placed"]


def test_the_probability_that_anything_is_missing_is_all_but_that_of_nothing() -> None:
    assert entry(None)["missing"] == pytest.approx(0.96)
    assert entry(None, verdict="no_mismatch")["missing"] == pytest.approx(0.1)


@pytest.mark.soak
def test_campaigns_of_the_rig_are_read_and_diagnosed(tmp_path: Path) -> None:
    names = ["0001", "0002"]
    result = judge_unlisted(Work(tmp_path, count=len(names)), lambda *_: None)
    assert [one["name"] for one in result["judged"]] == names
    assert all(one["statement"] for one in result["judged"])
    assert hidden(result)
