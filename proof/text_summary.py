"""The summary of docs/proof.md in a few lines: every number is computed from the parts."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from proof.concealed import judged_of
from proof.judge import QUIET, Judged
from proof.phrases import percent, right
from proof.statistics import calibration, share
from proof.text_joint import WITH_CURVES, distinguished
from proof.text_wide import that_show
from rig.identifiable import THRESHOLD

Result = Mapping[str, Any]


def summary(parts: Mapping[str, Result]) -> str:
    """A line for each part that was worked out; empty where none of them was."""
    lines = [f"- {line(parts[name])}\n" for name, line in _LINES.items() if name in parts]
    return "\n".join(["## In short", "", "".join(lines)]) if lines else ""


def _mixture(result: Result) -> str:
    judged = judged_of(result)
    visible = [judgement for judgement in judged if judgement.visible]
    apart = [judgement for judgement in visible if judgement.verdict in ("explained", "unexplained", "no_mismatch")]
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
    calibrated = calibration([judgement.probability for judgement in judged], [judgement.right for judgement in judged])
    agree = "agree" if calibrated.error <= calibrated.chance_range[1] else "do not agree"
    return f"{agree} with how often it is right"


def _open(result: Result) -> str:
    visible = [judgement for judgement in judged_of(result) if judgement.visible]
    return f"**On a rig that this project has never seen** it is right, of what shows, in {right(visible)}."


def _quiet(result: Result) -> str:
    false = share([judgement.verdict not in QUIET for judgement in judged_of(result)])
    return f"**False alarms.** Where nothing is missing, something is said to be in {percent(false)}."


def _curves(result: Result) -> str:
    visible = [judgement for judgement in judged_of(result) if judgement.visible]
    return f"**Indentation and compression curves**: right, of what shows, in {right(visible)}."


def _unlisted(result: Result) -> str:
    identifiable = [judgement for judgement in result["judged"] if judgement["identifiable"]]
    seen, placed = (
        percent(share([judgement[name] for judgement in identifiable])) for name in ("recognised", "placed")
    )
    return (
        f"**Physics that nobody listed** is recognised as such in {seen}; where it enters and what it follows is right "
        f"in {placed}."
    )


def _coverage(result: Result) -> str:
    stated = [judgement for judgement in result["judged"] if judgement["held"] is not None]
    held = percent(share([judgement["held"] for judgement in stated]))
    held_where_shown = percent(share([judgement["held"] for judgement in that_show(stated)]))
    quotable = percent(share([judgement["held"] for judgement in stated if judgement["quotable"]]))
    return (
        f"**A d33 that is stated** lies in its 95 % interval in {held}; without physics outside the catalogue that "
        f"does not show, in {held_where_shown}; one that may be quoted in {quotable}."
    )


def _joint(result: Result) -> str:
    with_curves = [judgement for judgement in result["judged"] if judgement["what"] in WITH_CURVES]
    frfs_only, together = (
        (
            percent(share([judgement["right"][how] for judgement in with_curves])),
            percent(share(distinguished(with_curves, how))),
        )
        for how in ("alone", "together")
    )
    return (
        f"**A block or indentations beside the FRFs**: right in {together[0]}, by the FRFs alone in {frfs_only[0]}; E, "
        f"h and stiffening are told apart in {together[1]}, by the FRFs alone in {frfs_only[1]}."
    )


def _slips(result: Result) -> str:
    committed = [of_slip for judgement in result["judged"] for of_slip in judgement["slips"].values()]
    named = percent(
        share([slip_judged["named"] for slip_judged in committed if slip_judged["over_rivals"] > THRESHOLD])
    )
    false = percent(share([bool(judgement["false"]) for judgement in result["judged"]]))
    return (
        f"**Slips of a lab** (exchanged labels, wrong units, reversed signs) that the recordings can tell from physics "
        f"are named in {named}; one is named without a slip in {false}."
    )


def _recordings(result: Result) -> str:
    reports = [judgement["report"] for judgement in result["campaigns"]]
    verdicts = Counter(report["verdict"] for report in reports)
    counts = ", ".join(f"`{name}` {count}" for name, count in sorted(verdicts.items()))
    errors = [
        (fit["before"]["heldout_rmse_percent"], fit["after"]["heldout_rmse_percent"])
        for report in reports
        if (fit := report["fit"]) is not None
    ]
    predicted = [(before, after) for before, after in errors if before is not None and after is not None]
    better = percent(share([after < before for before, after in predicted]))
    return (
        f"**Real recordings of other labs**, {len(reports)}: {counts}. What was held out is predicted better with the "
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
