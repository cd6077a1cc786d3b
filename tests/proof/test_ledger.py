"""The ledger compares answers with kept ones, and shows where a change moved them."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from proof.ledger.answer import OPEN, RIGHT, WRONG, graded
from proof.ledger.campaigns import DrawnFrf
from proof.ledger.differences import Compared, differences, text
from proof.ledger.run import LEDGER, run
from proof.stored import Work

LINE: dict[str, Any] = {
    "name": "a", "documents": "d", "truth": {"effects": ["adhesion"], "shows": ["adhesion"], "d33": 14.0},
    "answer": {"verdict": "explained", "names": ["adhesion"], "probability": 0.9, "d33": [14.0, 13.0, 15.0],
               "quotable": True, "parameters": {"adhesion.work_of_adhesion": [0.2, 0.18, 0.22]}},
    "grade": "right",
}  # fmt: skip


def changed(**answer: Any) -> dict[str, Any]:
    line = copy.deepcopy(LINE)
    line["answer"].update(answer)
    return line


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ({"probability": 0.86}, []),
        ({"probability": 0.80}, ["probability 0.90 → 0.80"]),
        ({"d33": [14.1, 13.0, 15.2]}, []),
        ({"d33": [14.3, 13.0, 15.0]}, ["d33 14 (13 to 15) → 14.3 (13 to 15)"]),
        ({"d33": [14.0, 13.0, 17.0]}, ["d33 14 (13 to 15) → 14 (13 to 17)"]),
        ({"verdict": "ambiguous", "names": []}, ["explained → ambiguous", "adhesion → nothing"]),
        (
            {"parameters": {"adhesion.work_of_adhesion": [0.21, 0.19, 0.23]}},
            ["adhesion.work_of_adhesion 0.2 (0.18 to 0.22) → 0.21 (0.19 to 0.23)"],
        ),
        ({"quotable": False}, ["no longer quotable"]),
    ],
)
def test_difference(answer: dict[str, Any], said: list[str]) -> None:
    """A tenth of the interval and 0.05 of probability are no difference."""
    assert list(differences(LINE, changed(**answer))) == said


def test_sign_test() -> None:
    """Eight answers lost against one won are worse than chance, three against one are not."""
    lost, won = [({**LINE, "grade": a}, {**LINE, "grade": b}) for a, b in ((RIGHT, WRONG), (OPEN, RIGHT))]
    part = Compared("frf", [lost] * 8 + [won], (1.0, 1.0))
    assert (part.better, part.worse, part.is_worse) == (1, 8, True)
    assert part.p_value == pytest.approx(20 / 512)  # (1 + 9) / 2⁹ on either side
    assert not Compared("frf", [lost] * 3 + [won], (1.0, 1.0)).is_worse
    assert "8 (significant)" in text([part])


def report(verdict: str, named: list[str], rivals: list[list[str]]) -> dict[str, Any]:
    mechanisms = [{"name": name} for name in named]
    return {"verdict": verdict, "mechanisms": mechanisms, "alternatives": [{"mechanisms": one} for one in rivals]}


@pytest.mark.parametrize(
    ("verdict", "named", "rivals", "grade"),
    [
        ("explained", ["ageing", "moving_contact_edge"], [], RIGHT),
        ("explained", ["ageing", "amplitude_nonlinearity"], [], RIGHT),  # another name of the same law
        ("explained", ["ageing"], [], RIGHT),  # the other effect does not show
        ("explained", ["ageing", "adhesion"], [], WRONG),
        ("ambiguous", ["adhesion"], [["ageing"]], OPEN),
        ("ambiguous", ["adhesion"], [["nothing_missing"]], WRONG),
        ("no_mismatch", [], [], WRONG),
        ("unexplained", [], [], WRONG),
        ("insufficient_data", [], [], OPEN),
    ],
)
def test_grade(verdict: str, named: list[str], rivals: list[list[str]], grade: str) -> None:
    """A right set holds all that shows and nothing that is not hidden."""
    assert graded(report(verdict, named, rivals), ["ageing", "moving_contact_edge"], ["ageing"]) == grade


@pytest.mark.slow
@pytest.mark.usefixtures("quick_digests")
def test_run_again_changes_nothing_and_a_moved_answer_is_shown(tmp_path: Path) -> None:
    """The kept answer of a campaign comes back; where another had been kept, the difference is printed."""
    name = "51763-000"
    kept = next(
        line for line in map(json.loads, (LEDGER / "frf.jsonl").read_text().splitlines()) if line["name"] == name
    )
    (tmp_path / "frf.jsonl").write_text(json.dumps(kept) + "\n")
    work = Work(tmp_path / "work")
    (same,) = run({"frf": [DrawnFrf(name, 0)]}, work, keep=False, folder=tmp_path)
    assert same.changed() == []
    kept["answer"]["probability"] -= 0.2
    (tmp_path / "frf.jsonl").write_text(json.dumps(kept) + "\n")
    (moved,) = run({"frf": [DrawnFrf(name, 0)]}, work, keep=True, folder=tmp_path)
    assert "frf: 1 of 1 answers changed, by what is hidden: ageing 1" in text([moved])
    assert json.loads((tmp_path / "frf.jsonl").read_text()) == {**kept, "answer": same.pairs[0][1]["answer"]}
