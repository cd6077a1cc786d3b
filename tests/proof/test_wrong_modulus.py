"""The part of the proof on a wrong modulus: what counts as named, found and kept, and what the page says of it."""

from typing import Any

import pytest

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


def test_an_error_that_is_named_is_measured_by_its_interval_and_its_value() -> None:
    found = compared(report((2.2, 2.4, 2.6)), TRUTH)
    assert found["named"]
    assert found["held"]
    assert found["off"] == pytest.approx(0.0408, abs=1e-4)
    assert found["d33_off"] == pytest.approx(0.0953, abs=1e-4)  # the geometric mean of 8 and 12.5 is 10
    assert not compared(report((2.6, 2.7, 2.8)), TRUTH)["held"]


def test_what_cannot_be_told_apart_counts_as_grouped_where_it_is_sure() -> None:
    twins = ("modulus_error", "moving_contact_edge")
    assert compared(report(None, twins), TRUTH)["grouped"]
    assert not compared(report(None, twins, 0.7), TRUTH)["grouped"]
    assert not compared(report(None, twins[1:]), TRUTH)["grouped"]
    assert not compared(report(None, twins), TRUTH)["named"]
