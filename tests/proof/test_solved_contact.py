"""How answers on campaigns of the solved rig are judged."""

from typing import Any

import pytest

from proof.solved_contact import compared, graded
from proof.text_solved import solved_contact

PLAIN: dict[str, Any] = {
    "effect": "plain", "exact_name": None, "nearest_names": [], "d33_pc_per_n": 14.0, "chi2_gain_of_truth": 300.0,
    "chi2_gain_over_plain_world": 0.0, "d33_error_of_plain_world": 0.0, "d33_error_of_base": 0.1,
}  # fmt: skip
FOAM: dict[str, Any] = {
    **PLAIN, "effect": "foam", "exact_name": "compressible_layer", "nearest_names": ["interface_slip"],
    "chi2_gain_over_plain_world": 90.0,
}  # fmt: skip
UNSEEN = {**FOAM, "chi2_gain_over_plain_world": 3.0}
LAWS = ("layered_contact", "moving_contact_edge")


def report(verdict: str, *names: str, **more: Any) -> dict[str, Any]:
    d33 = {"value": 14.4, "low": 13.7, "high": 15.1, "quotable": True}
    return {
        "verdict": verdict, "probability": 0.9, "mechanisms": [{"name": name} for name in names], "d33": d33, **more,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("truth", "answer", "expected"),
    [
        (PLAIN, report("explained", *LAWS), "right"),
        (PLAIN, report("explained", "layered_contact", "amplitude_nonlinearity"), "right"),
        (PLAIN, report("no_mismatch"), "wrong"),
        ({**PLAIN, "chi2_gain_of_truth": 5.0}, report("no_mismatch"), "right"),
        (PLAIN, report("explained", *LAWS, "adhesion"), "wrong"),
        (FOAM, report("explained", *LAWS, "compressible_layer"), "right"),
        (FOAM, report("explained", "compressible_layer", "ageing"), "partly"),
        (FOAM, report("explained", "interface_slip"), "equivalent"),
        (FOAM, report("explained", *LAWS), "wrong"),
        (FOAM, report("ambiguous", "adhesion"), "honest"),
        (FOAM, report("explained", *LAWS, unnamed={"axis": "order"}), "honest"),
        (UNSEEN, report("explained", *LAWS), "right"),
        (UNSEEN, report("explained", "compressible_layer"), "wrong"),
    ],
)
def test_classes(truth: dict[str, Any], answer: dict[str, Any], expected: str) -> None:
    """A law of the plain world is never wrong; the effect must be named where it shows, and nothing else."""
    assert graded(truth, answer) == expected


def test_quoted_d33() -> None:
    """Coverage counts what is quoted, the error is relative to the true d33."""
    judged = [
        compared(PLAIN, report("explained", *LAWS)),
        compared({**FOAM, "d33_pc_per_n": 12.0}, report("ambiguous")),
    ]
    judged.append(compared(UNSEEN, report("explained", *LAWS, d33=None)))
    assert [one["inside"] for one in judged] == [True, False, False]
    assert judged[0]["off"] == pytest.approx(0.4 / 14)
    page = solved_contact({"seed": 1, "judged": judged})
    everything = next(line for line in page.splitlines() if line.startswith("| all |"))
    assert [cell.strip() for cell in everything.split("|")[2:8]] == ["3", "2", "0", "0", "1", "0"]
    assert "| 1 of 2: 50 %" in everything
    assert "Confident statements that are wrong:\n0 of 2: 0 %" in page
    assert "these are quoted here: 2 of 2: 100 %" in page


@pytest.mark.parametrize(("verdict", "holds"), [("explained", True), ("no_mismatch", False)])
def test_relative_d33(verdict: str, holds: bool) -> None:
    """Of an effect that does not show the relative interval is judged by what the answer's own world makes of it."""
    truth = {**UNSEEN, "chi2_gain_of_truth": 5.0, "d33_pc_per_n": 16.0, "d33_error_of_plain_world": -0.1}
    d33 = {"value": 14.4, "low": 13.7, "high": 15.1, "relative": {"low": 14.2, "high": 14.6}, "quotable": True}
    judged = compared(truth, report(verdict, d33=d33))
    assert (judged["inside"], judged["relative_inside"]) == (False, holds)
    page = solved_contact({"seed": 1, "judged": [judged]})
    assert f"of the recordings: {int(holds)} of 1" in page
