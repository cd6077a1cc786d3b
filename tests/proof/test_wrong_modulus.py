"""The part of the proof on a wrong modulus: what counts as named, found and kept, and what the page says of it."""

from typing import Any

import pytest

from proof.text_wrong_modulus import wrong_modulus
from proof.wrong_modulus import compared

TRUTH: dict[str, Any] = {
    "what": "frf",
    "factor": 2.5,
    "hidden": [
        {"effect": "modulus_error", "chi2_gain_joint": None},
        {"effect": "adhesion", "chi2_gain_joint": 30.0},
    ],
    "documents": [{"sd_ln_modulus_frf": 0.08, "d33_pc_per_n": {"s1": 8.0, "s2": 12.5}}],
    "skins": [{"sd_ln_modulus_joint": 0.08}],
    "as_declared": {"a_over_h": [0.5, 3.2, 1.0], "load_parameter": [0.01, 0.02, 0.2]},
}


def report(
    factor: tuple[float, float, float] | None, group: tuple[str, ...] = (), probability: float = 0.9
) -> dict[str, Any]:
    parameters = [] if factor is None else [dict(zip(("low", "value", "high"), factor, strict=True))]
    return {
        "verdict": "ambiguous",
        "mechanisms": [] if factor is None else [{"name": "modulus_error", "parameters": parameters}],
        "presence": [{"mechanisms": list(group), "probability": probability}],
        "findings": [
            {"code": "out_of_domain", "statement": "its contact lies beyond the tables: left out"},
            {"code": "out_of_domain", "statement": "with the values found its contact lies beyond the tables"},
        ],
        "d33": {"value": 11.0, "quotable": False},
    }


def test_error_named_measured_interval_value() -> None:
    """An error that is named is measured by its interval and its value."""
    found = compared(report((2.2, 2.4, 2.6)), TRUTH)
    assert found["named"]
    assert found["held"]
    assert found["off"] == pytest.approx(0.0408, abs=1e-4)
    assert found["d33_off"] == pytest.approx(0.0953, abs=1e-4)  # the geometric mean of 8 and 12.5 is 10
    assert not compared(report((2.6, 2.7, 2.8)), TRUTH)["held"]


def test_cannot_told_apart_counts_grouped_sure() -> None:
    """What cannot be told apart counts as grouped where it is sure."""
    twins = ("modulus_error", "moving_contact_edge")
    assert compared(report(None, twins), TRUTH)["grouped"]
    assert not compared(report(None, twins, 0.7), TRUTH)["grouped"]
    assert not compared(report(None, twins[1:]), TRUTH)["grouped"]
    assert not compared(report(None, twins), TRUTH)["named"]


def test_contacts_beyond_tables_left_out_counted() -> None:
    """Contacts beyond the tables and those left out are counted."""
    none_kept = compared(report(None), TRUTH)
    assert (none_kept["beyond"], none_kept["left_out"], none_kept["recordings"]) == (2, 2, 3)
    some = report(None)
    some["findings"].append({"code": "contacts_kept", "statement": "1 of 3 contacts lie beyond the tables: kept"})
    assert compared(some, TRUTH)["left_out"] == 1


def test_design_determines_modulus_information() -> None:
    """A design determines the modulus by its information or by curves."""
    assert not compared(report(None), TRUTH)["determined"]
    assert compared(report(None), {**TRUTH, "what": "compression"})["determined"]
    sure = [{**TRUTH["documents"][0], "sd_ln_modulus_frf": 0.04}]
    assert compared(report(None), {**TRUTH, "documents": sure})["determined"]


def test_the_page_counts_the_visible_alone() -> None:
    unseen = {**TRUTH, "hidden": [{"effect": "modulus_error", "chi2_gain_joint": 3.0}]}
    judged = [
        {"name": "named", **compared(report((2.2, 2.4, 2.6)), TRUTH)},
        {"name": "missed", **compared(report(None), TRUTH)},
        {"name": "unseen", **compared(report(None), unseen)},
    ]
    page = wrong_modulus({"seed": 5, "judged": judged})
    rows = {line.split("|")[1].strip(): line for line in page.splitlines() if line.startswith("| ")}
    assert "1 of 2" in rows["FRFs alone"]
    assert "1 of 1" in rows["all"]
    assert "none there" in rows["beside a block"]
    assert "4 contacts of 2 campaigns lie beyond the tables; 0 of them were kept" in page.replace("\n", " ")
    assert "missed" in rows
    assert "unseen" not in rows
