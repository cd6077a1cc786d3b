"""Judging laws that nobody listed: what counts as right, and whole campaigns of the rig that hides them."""

from typing import Any

import pytest

from proof.unlisted import Judged, alarms, judged, lines


def entry(law: dict[str, Any] | None, *, floor: float = 2.0, verdict: str = "unexplained") -> Judged:
    truth = {
        "identifiable": True,
        "law": {"acts_on": "modulus", "axis": "order", "form": "linear"},
        "acts_on_also": ["force"],
        "axis_also": ["recorded_at"],
        "form_also": [],
    }
    report = {
        "verdict": verdict,
        "probability": 0.9,
        "statement": "Something.",
        "unnamed": law,
        "fit": {"noise_floor_percent": floor},
    }
    return Judged("0001", truth, report)


def law(acts_on: str, axis: str, form: str, after: float = 2.2) -> dict[str, Any]:
    return {"acts_on": acts_on, "axis": axis, "form": form, "heldout_rmse_percent": {"before": 9.0, "after": after}}


def test_an_equivalent_that_the_rig_cannot_tell_apart_is_right() -> None:
    assert entry(law("modulus", "order", "linear")).shaped
    assert entry(law("force", "recorded_at", "linear")).shaped
    assert entry(law("force", "order", "power")).placed
    assert not entry(law("force", "order", "power")).shaped
    assert not entry(law("gain", "order", "linear")).placed
    assert not entry(law("modulus", "preload_n", "linear")).placed
    assert not entry(None).placed


def test_shares_have_their_counts_and_intervals_and_misses_are_listed() -> None:
    entries = [
        entry(law("modulus", "order", "linear")),
        entry(law("gain", "order", "step", after=8.0)),
        entry(None, verdict="explained"),
    ]
    recognised, placed, shaped, held_out, near, *misses = lines(entries)
    assert recognised.startswith("recognised as not in the catalogue: 2 of 3: 67 % [")
    assert placed.startswith("where and axis: 1 of 3: 33 % [")
    assert shaped.startswith("where, axis and form: 1 of 3")
    assert held_out.endswith("median 2.55")
    assert near.startswith("at most 1.5 times the floor: 1 of 2")
    assert len(misses) == 2
    assert alarms([entry(None, verdict="no_mismatch"), entry(None, verdict="ambiguous")])[0].startswith(
        "false alarms: 1 of 2"
    )


@pytest.mark.slow
def test_campaigns_of_the_rig_are_read_and_diagnosed() -> None:
    entries = judged(3, 2, quiet=False)
    assert [one.name for one in entries] == ["0001", "0002"]
    assert all(one.report["schema"] == "report/1" for one in entries)
    assert len(lines(entries)) >= 5
