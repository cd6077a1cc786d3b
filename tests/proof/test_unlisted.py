"""Judging laws that nobody listed: what counts as right, and whole campaigns of the rig that hides them."""

from pathlib import Path
from typing import Any

import pytest

from proof.left_out import compared
from proof.stored import Work
from proof.text_unlisted import alarms, hidden, left_out
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


def test_equivalent_rig_cannot_tell_apart_right() -> None:
    """An equivalent that the rig cannot tell apart is right."""
    assert entry(law("modulus", "order", "linear"))["shaped"]
    assert entry(law("force", "recorded_at", "linear"))["shaped"]
    assert entry(law("force", "order", "power"))["placed"]
    assert not entry(law("force", "order", "power"))["shaped"]
    assert not entry(law("gain", "order", "linear"))["placed"]
    assert not entry(law("modulus", "preload_n", "linear"))["placed"]
    assert not entry(None)["placed"]


def test_probability_anything_missing_nothing() -> None:
    """The probability that anything is missing is all but that of nothing."""
    assert entry(None)["missing"] == pytest.approx(0.96)
    assert entry(None, verdict="no_mismatch")["missing"] == pytest.approx(0.1)


def test_a_diagnosis_that_failed_counts_as_wrong() -> None:
    failed = {"verdict": "failed", "probability": 0.0, "statement": "", "alternatives": [], "fit": None}
    hides = {"identifiable": True, "law": {"acts_on": "gain", "axis": "order", "form": "step"}}
    assert judged("0001", {**hides, "law": None}, failed)["missing"] == 1.0
    assert judged("0001", hides, failed)["missing"] == 0.0
    assert "stated in\n1 of 1" in alarms({"seed": 1, "judged": [judged("0001", {"law": None}, failed)]})


def test_shares_counts_intervals_misses_listed() -> None:
    """Shares have their counts and intervals and misses are listed."""
    entries = [
        entry(law("modulus", "order", "linear")),
        entry(law("gain", "order", "step", after=8.0)),
        entry(None, verdict="explained"),
        entry(None, verdict="explained", identifiable=False),  # a listed mechanism does the same
    ]
    quiet = {"seed": 2, "judged": [entry(None, verdict="no_mismatch"), entry(None, verdict="ambiguous")]}
    text = hidden({"seed": 1, "judged": entries}, quiet)
    assert "4 hide a law that gains more than 20 in χ² over the\nbase model, and 3 one that gains as much" in text
    assert "| recognised as not in the catalogue | 2 of 3: 67 % [" in text
    assert "] | 2 of 4: 50 % [" in text
    assert "| where it enters and what it follows | 1 of 3: 33 % [" in text
    assert "median | 2.55 [" in text
    assert "| at most 1.5 times the noise, of those modelled | 1 of 2" in text
    assert text.count("| 0001 |") == 2
    assert "| 0.9 | 3 of 3: 100 % [44–100] | 1 of 2" in text
    assert "stated in\n1 of 2" in alarms(quiet)
    assert "with more than 80 % in 1." in alarms(quiet)


def test_law_stands_mechanism_axis_enters() -> None:
    """A law stands for a mechanism on its axis where it enters or predicts as well."""
    fit = {"noise_floor_percent": 2.0, "before": {"heldout_rmse_percent": 9.0}, "after": {"heldout_rmse_percent": 2.2}}
    named = {"verdict": "explained", "fit": fit}

    def of(acts_on: str, axis: str, after: float) -> dict[str, Any]:
        stated = law(acts_on, axis, "linear", after)
        unnamed = {"verdict": "unexplained", "mechanisms": [], "fit": fit, "unnamed": stated}
        return {"name": "0001", "hidden": "preload_dependent_d33", **compared("preload_dependent_d33", named, unnamed)}

    entries = [of("gain", "preload_n", 9.0), of("modulus", "preload_n", 2.3), of("modulus", "preload_n", 9.0),
               of("gain", "frequency_hz", 2.2)]  # fmt: skip
    other = {"verdict": "explained", "mechanisms": [{"name": "ageing"}], "fit": fit, "unnamed": None}
    entries.append({"name": "0002", "hidden": "spread", **compared("sensor_spread", named, other)})
    text = left_out({"drawn": 5, "judged": entries})
    assert "Found: 2 of 5: 40 %" in text
    assert "predicts as well:\n3 of 5: 60 %" in text
    assert "| preload_dependent_d33 | 4 | 2 | gain over frequency_hz; gain over preload_n;" in text
    assert "| spread | 1 | 0 | none | ageing (1) |" in text


@pytest.mark.soak
def test_campaigns_rig_read_diagnosed(tmp_path: Path) -> None:
    """Campaigns of the rig are read and diagnosed."""
    names = ["0001", "0002"]
    result = judge_unlisted(Work(tmp_path, count=len(names)), lambda *_: None)
    assert [one["name"] for one in result["judged"]] == names
    assert all(one["statement"] for one in result["judged"])
    assert hidden(result)
