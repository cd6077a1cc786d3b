"""What the page of the proof says of raw curves: shares, false alarms, errors of values, coverage of intervals."""

from dataclasses import asdict
from typing import Any

from proof.judge import Judged
from proof.text import document

ADHESION: dict[str, Any] = {
    "effects": ["adhesion"], "youngs_modulus_mpa": 2.0, "parameters": {"adhesion": {"work_j_per_m2": 0.05}},
}  # fmt: skip


def judged(name: str, truth: tuple[str, ...], answer: tuple[str, ...], probability: float = 0.98) -> dict[str, Any]:
    verdict = "explained" if answer else "no_mismatch"
    return asdict(Judged(name, truth, answer, False, verdict, probability, True, True, 30.0, (1.0, 1.0)))


def value(middle: float, half: float) -> dict[str, float]:
    return {"value": middle, "low": middle - half, "high": middle + half}


def page(part: str, entries: list[dict[str, Any]], truths: list[Any], stated: list[Any]) -> str:
    result = {"judged": entries, "truths": truths, "stated": stated, "sources": "abc"}
    return " ".join(document({part: result}).split())


def test_shares_errors_intervals_curves_stand() -> None:
    """Shares errors and intervals of curves stand on the page."""
    entries = [
        judged("a", ("adhesion",), ("adhesion",)),
        judged("b", ("adhesion",), ("adhesion",)),
        judged("c", ("adhesion",), ("adhesion",)),
        judged("d", ("adhesion",), ("contact_creep",)),
        judged("e", ("contact_creep", "layered_contact"), ("contact_creep", "layered_contact"), 0.7),
    ]
    pair = {"effects": ["contact_creep", "layered_contact"], "youngs_modulus_mpa": 1.0, "parameters": {}}
    works = [value(0.05, 0.001), value(0.06, 0.001), value(0.0505, 0.001), None, None]
    moduli = [value(2.02, 0.1), value(2.1, 0.05), value(2.0, 0.1), value(3.0, 0.1), value(1.5, 0.1)]
    stated = [{"youngs_modulus": e, "work_of_adhesion": w} for e, w in zip(moduli, works, strict=True)]
    said = page("curves", entries, [ADHESION] * 4 + [pair], stated)
    assert "5 of 300 campaigns of raw indentation curves" in said
    assert "| single | 4 | 3 of 4: 75 % [30–95] | 3 of 4: 75 % [30–95] |" in said
    assert "| pair | 1 | 1 of 1: 100 %" in said
    assert "| unknown | 0 | none there |" in said
    # 0.98⁴ and 4 · 0.98³ · 0.02 are the chances of four and of three
    assert "| identifiable | 0.980 | 3 of 4: 75 % [30–95] | 0.078 |" in said
    # Errors of 1, 5 and 0 %, then of 0, 20 and 1 %; 2.1 ± 0.05 does not hold 2.0, nor 0.06 ± 0.001 0.05.
    assert "| modulus, adhesion named | 3 | 1.00 [" in said
    assert "| work of adhesion | 3 | 1.00 [" in said
    assert said.count("| 2 of 3: 67 %") == 2
    assert "| modulus, all right answers | 4 |" in said
    assert "| d | adhesion | contact_creep | explained |" in said


def test_false_alarms_quiet_curves_counted() -> None:
    """False alarms on quiet curves are counted and listed."""
    entries = [judged("q0", (), ()), judged("q1", (), ("adhesion",)), judged("q2", (), ())]
    said = page("quiet_curves", entries, [{}] * 3, [{}] * 3)
    assert "3 of 200 campaigns of raw curves with nothing missing" in said
    assert "`insufficient_data` in 1 of 3: 33 %" in said
    assert "| q1 | nothing | adhesion | explained |" in said
    assert "| q0 |" not in said
