"""What a reader takes home from docs/proof.md, in a few lines: every number is computed from the parts."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from proof.concealed import judged_of
from proof.judge import QUIET, Judged
from proof.phrases import percent, right
from proof.statistics import calibration, share
from proof.text_joint import BESIDE_CURVES, told_apart
from proof.text_wide import that_show
from rig.identifiable import THRESHOLD

Result = Mapping[str, Any]


def summary(parts: Mapping[str, Result]) -> str:
    """A line for each part that was worked out; empty where none of them was."""
    lines = [f"- {line(parts[name])}\n" for name, line in _LINES.items() if name in parts]
    return "\n".join(["## In short", "", "".join(lines)]) if lines else ""


def _mixture(result: Result) -> str:
    judged = judged_of(result)
    visible = [entry for entry in judged if entry.visible]
    apart = [entry for entry in visible if entry.verdict in ("explained", "unexplained", "no_mismatch")]
    return (
        f"**What shows is named.** On our own rig the answer is exactly what was hidden, of what shows, in "
        f"{right(visible)}; where it is firm (not `ambiguous`), in {right(apart)}; stated probabilities "
        f"{_meant(visible)}. What hides in the noise stays hidden: with those campaigns it is right in "
        f"{right(judged)}, and stated probabilities {_meant(judged)}."
    )


def _meant(judged: Sequence[Judged]) -> str:
    """Whether stated probabilities are those of being right."""
    if not judged:
        return "are not known"
    told = calibration([entry.probability for entry in judged], [entry.right for entry in judged])
    agree = "agree" if told.error <= told.chance_range[1] else "do not agree"
    return f"{agree} with how often it is right"


def _open(result: Result) -> str:
    visible = [entry for entry in judged_of(result) if entry.visible]
    return f"**On a rig that this project has never seen** it is right, of what shows, in {right(visible)}."


def _quiet(result: Result) -> str:
    false = share([entry.verdict not in QUIET for entry in judged_of(result)])
    return f"**False alarms.** Where nothing is missing, something is said to be in {percent(false)}."


def _curves(result: Result) -> str:
    visible = [entry for entry in judged_of(result) if entry.visible]
    return f"**Indentation and compression curves**: right, of what shows, in {right(visible)}."


def _unlisted(result: Result) -> str:
    known = [entry for entry in result["judged"] if entry["identifiable"]]
    seen, placed = (percent(share([entry[name] for entry in known])) for name in ("recognised", "placed"))
    return (
        f"**Physics that nobody listed** is recognised as such in {seen}; where it enters and what it follows is right "
        f"in {placed}."
    )


def _coverage(result: Result) -> str:
    stated = [entry for entry in result["judged"] if entry["held"] is not None]
    held = percent(share([entry["held"] for entry in stated]))
    told = percent(share([entry["held"] for entry in that_show(stated)]))
    quotable = percent(share([entry["held"] for entry in stated if entry["quotable"]]))
    return (
        f"**A d33 that is stated** lies in its 95 % interval in {held}; without physics outside the catalogue that "
        f"does not show, in {told}; one that may be quoted in {quotable}."
    )


def _joint(result: Result) -> str:
    beside = [entry for entry in result["judged"] if entry["what"] in BESIDE_CURVES]
    alone, together = (
        (percent(share([entry["right"][how] for entry in beside])), percent(share(told_apart(beside, how))))
        for how in ("alone", "together")
    )
    return (
        f"**A block or indentations beside the FRFs**: right in {together[0]}, by the FRFs alone in {alone[0]}; E, h "
        f"and stiffening are told apart in {together[1]}, by the FRFs alone in {alone[1]}."
    )


def _slips(result: Result) -> str:
    committed = [one for entry in result["judged"] for one in entry["slips"].values()]
    named = percent(share([one["named"] for one in committed if one["over_rivals"] > THRESHOLD]))
    false = percent(share([bool(entry["false"]) for entry in result["judged"]]))
    return (
        f"**Slips of a lab** (exchanged labels, wrong units, reversed signs) that the recordings can tell from physics "
        f"are named in {named}; one is named without a slip in {false}."
    )


def _recordings(result: Result) -> str:
    reports = [entry["report"] for entry in result["campaigns"]]
    verdicts = Counter(report["verdict"] for report in reports)
    said = ", ".join(f"`{name}` {count}" for name, count in sorted(verdicts.items()))
    errors = [
        (fit["before"]["heldout_rmse_percent"], fit["after"]["heldout_rmse_percent"])
        for report in reports
        if (fit := report["fit"]) is not None
    ]
    known = [(before, after) for before, after in errors if before is not None and after is not None]
    better = percent(share([after < before for before, after in known]))
    return (
        f"**Real recordings of other labs**, {len(reports)}: {said}. What was held out is predicted better with the "
        f"answer than by the simplest model in {better}."
    )


_LINES: dict[str, Callable[[Result], str]] = {
    "mixture": _mixture,
    "open": _open,
    "quiet": _quiet,
    "curves": _curves,
    "unlisted": _unlisted,
    "joint": _joint,
    "coverage": _coverage,
    "slips": _slips,
    "recordings": _recordings,
}
