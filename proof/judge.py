"""Judges a report against the truth.

An answer is the set of effects that are missing: mechanisms by name under `explained` and `ambiguous`, `unknown` under
`unexplained`, nothing under `no_mismatch` and `insufficient_data`. It is right if it is exactly the truth's set.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

UNKNOWN = "unknown"
NOTHING = "nothing"
QUIET = ("no_mismatch", "insufficient_data")


@dataclass(frozen=True)
class Judged:
    """One report with its truth."""

    name: str
    truth: tuple[str, ...]  # sorted; empty where nothing is missing
    answer: tuple[str, ...]
    left_open: bool  # not right, but `ambiguous` with the truth among the rivals
    verdict: str
    probability: float
    visible: bool  # whether all that is missing shows in the recordings at all
    one_visible: bool  # whether any of it does
    size: float  # √(χ² that the truth gains over the base model): the effect in units of noise
    held_out: tuple[float, float] | None  # after-fit rmse on held-out groups and noise floor [%]

    @property
    def right(self) -> bool:
        """Whether the answer is exactly the truth."""
        return self.truth == self.answer

    @property
    def kind(self) -> str:
        """What was hidden: none, single, pair or unknown."""
        if UNKNOWN in self.truth:
            return "unknown"
        return ("none", "single", "pair")[len(self.truth)]


def judge(name: str, report: Mapping[str, Any], truth: Mapping[str, Any]) -> Judged:
    """The report of one campaign judged by its truth (`truth/1`, or an entry of open-truth.json)."""
    visible = bool(truth["identifiable"])
    truth_set = tuple(sorted(truth["effects"]))
    rivals = [tuple(sorted(entry["mechanisms"])) for entry in report["alternatives"]]
    fit = report["fit"]
    left = fit["after"]["heldout_rmse_percent"] if fit else None
    return Judged(
        name=name,
        truth=truth_set,
        answer=answer(report),
        left_open=report["verdict"] == "ambiguous" and truth_set in rivals and truth_set != answer(report),
        verdict=report["verdict"],
        probability=float(report["probability"]),
        visible=bool(truth.get("every_effect_identifiable", visible)) and visible,
        one_visible=visible,
        size=max(float(truth["chi2_gain_of_truth"]), 0.0) ** 0.5,
        held_out=None if left is None else (float(left), float(fit["noise_floor_percent"])),
    )


def answer(report: Mapping[str, Any]) -> tuple[str, ...]:
    """The set that a report names."""
    if report["verdict"] == "unexplained":
        return (UNKNOWN,)
    return tuple(sorted(entry["name"] for entry in report["mechanisms"]))


def shown(names: tuple[str, ...]) -> str:
    """A set in words."""
    return " + ".join(names) or NOTHING


def unnamed_over_noise(report: Mapping[str, Any]) -> float | None:
    """The held-out error with the unlisted law, over that of noise alone."""
    law, fit = report.get("unnamed"), report["fit"]
    if law is None or not fit or not fit["noise_floor_percent"]:
        return None
    return float(law["heldout_rmse_percent"]["after"] / fit["noise_floor_percent"])
