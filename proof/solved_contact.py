"""FRF campaigns made by solving the contact (`rig.solved`): what is named in them, and whether quoted d33 holds.

Declared sizes are off by their tolerances, so the absolute interval of d33 is judged.
An answer is
- `right`: the law that is in the data, beside laws of the plain world; these alone, or no mismatch where even they do
  not show, in the plain world and where the effect does not show;
- `equivalent`: nearest names of the effect instead of its own;
- `partly`: the law that is in the data, with another that is not;
- `honest`: nothing is asserted, or an unnamed law is;
- `wrong`: anything else.
An effect that does not show and moves d33 by more than the tolerances is a row of its own: no absolute interval can
know of it. Its relative one, which compares sensors and dates of one skin, must hold what the world without the effect
makes of these recordings, off by a factor that is common to them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from proof.cases import MadeCase
from proof.names import distinct_names
from proof.stored import Work, digest_of, of_each, reports, sources, stored
from rig.solved.campaign import document, drawn
from rig.solved.worlds import PLAIN
from rig.solved_truth import VISIBLE, truth_of_solved

SEED, COUNT = 47183, 150
_PLAIN_LAWS = {"layered_contact", "moving_contact_edge"}
_MOVES = 0.02  # of d33: the tolerance of declared lengths, beyond which an unseen effect is judged by itself
_UNDECIDED = ("ambiguous", "unexplained", "insufficient_data")
RIGHT, EQUIVALENT, PARTLY, HONEST, WRONG = "right", "equivalent", "partly", "honest", "wrong"
MOVED = "of these, d33 moved"
CLASSES = (RIGHT, EQUIVALENT, PARTLY, HONEST, WRONG)

Report = Mapping[str, Any]
Truth = Mapping[str, Any]
Judgement = Mapping[str, Any]


def judge_solved(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Each campaign's truth, the report's answer, and how they compare."""
    numbers = list(range(min(work.count or COUNT, COUNT)))
    made = of_each(work, numbers, partial(_made, work.folder / "solved", sources("rig")), progress)
    answers = reports(work, [MadeCase(solved["campaign"]["name"], solved["campaign"]) for solved in made], progress)
    judged = [
        {"name": solved["campaign"]["name"], **compared(solved["truth"], report)}
        for solved, report in zip(made, answers, strict=True)
    ]
    return {"seed": SEED, "judged": judged}


def _made(folder: Path, version: str, number: int) -> dict[str, Any]:
    return stored(folder, digest_of(["solved contact", SEED, number, version]), partial(_solved, number))


def _solved(number: int) -> dict[str, Any]:
    campaign = drawn(SEED, number)
    return {"campaign": document(campaign), "truth": truth_of_solved(campaign)}


def compared(truth: Truth, report: Report) -> dict[str, Any]:
    """A report beside the truth."""
    d33 = report.get("d33") or {}
    stated = d33.get("value") is not None and d33.get("low") is not None and d33.get("high") is not None
    true, relative = truth["d33_pc_per_n"], d33.get("relative")
    apparent = true * (1 + truth[f"d33_error_of_{'base' if report['verdict'] == 'no_mismatch' else 'plain_world'}"])
    return {
        "effect": truth["effect"],
        "visible": _visible(truth),
        "verdict": report["verdict"],
        "probability": report["probability"],
        "names": list(_names(report)),
        "class": graded(truth, report),
        "quoted": stated and bool(d33["quotable"]),
        "inside": stated and d33["low"] <= true <= d33["high"],
        "relative_inside": relative is not None and relative["low"] <= apparent <= relative["high"],
        "off": d33["value"] / true - 1 if stated else None,
        "half_width": (d33["high"] - d33["low"]) / (2 * d33["value"]) if stated else None,
        "plain_world_off": truth["d33_error_of_plain_world"],
        "chi2_gain_of_truth": truth["chi2_gain_of_truth"],
        "chi2_gain_over_plain_world": truth["chi2_gain_over_plain_world"],
    }


def graded(truth: Truth, report: Report) -> str:
    """One of `CLASSES`."""
    if report["verdict"] in _UNDECIDED or report.get("unnamed"):
        return HONEST
    if report["verdict"] == "no_mismatch":
        return RIGHT if truth["chi2_gain_of_truth"] < VISIBLE else WRONG
    further, visible = set(_names(report)) - _PLAIN_LAWS, _visible(truth)
    if not further:
        return WRONG if visible else RIGHT
    if not visible:
        return WRONG
    if truth["exact_name"] in further:
        return RIGHT if len(further) == 1 else PARTLY
    return EQUIVALENT if further <= set(truth["nearest_names"]) else WRONG


def _visible(truth: Truth) -> bool:
    return truth["effect"] != PLAIN and truth["chi2_gain_over_plain_world"] >= VISIBLE


def ideally_quoted(judgement: Judgement) -> bool:
    """Whether a diagnoser that owns the rig's worlds and noise can quote d33: in the plain world, and where the effect
    shows. An effect that does not show leaves d33 open."""
    return judgement["effect"] == PLAIN or bool(judgement["visible"])


def _names(report: Report) -> tuple[str, ...]:
    if report["verdict"] not in ("explained", "ambiguous"):
        return ()
    return distinct_names(mechanism["name"] for mechanism in report["mechanisms"])


def rows(judged: Sequence[Judgement]) -> dict[str, list[Judgement]]:
    """The campaigns by effect, by whether the effect shows, and all."""
    subsets = {
        effect: [judgement for judgement in judged if judgement["effect"] == effect]
        for effect in sorted(_effects(judged))
    }
    subsets["effect shows"] = [judgement for judgement in judged if judgement["visible"]]
    unseen = [judgement for judgement in judged if not judgement["visible"] and judgement["effect"] != PLAIN]
    subsets["effect does not show"] = unseen
    subsets[MOVED] = [judgement for judgement in unseen if abs(judgement["plain_world_off"]) > _MOVES]
    subsets["all but these"] = [judgement for judgement in judged if judgement not in subsets[MOVED]]
    subsets["all"] = list(judged)
    return subsets


def _effects(judged: Sequence[Judgement]) -> set[str]:
    return {judgement["effect"] for judgement in judged}
