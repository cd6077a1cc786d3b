"""docs/proof.md as text: every number in it is computed from the parts that were worked out."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from proof import own_rig
from proof.concealed import judged_of
from proof.judge import QUIET, Judged
from proof.markdown import table
from proof.phrases import median_of, misses, percent, right
from proof.statistics import Share, calibration, share
from proof.text_curves import curves, quiet_curves
from proof.text_joint import joint
from proof.text_real import paper_array, recordings
from proof.text_slips import slips
from proof.text_solved import solved_contact
from proof.text_summary import summary
from proof.text_unlisted import alarms, hidden, left_out
from proof.text_wide import coverage, search_misses, sensitivity
from proof.text_wrong_modulus import wrong_modulus
from rig.identifiable import THRESHOLD

Result = Mapping[str, Any]

_HEAD = """\
# Proof: the diagnosis judged on what it cannot know

Everything on this page, figures and numbers, is written by `make proof` (`underskin prove`, `proof/`). The full run
takes several hours on two cores; it keeps what it has worked out and goes on from there. What each part found is in
`proof/results/`. Shares have Wilson's 95 % interval in brackets. The diagnosis is called as `underskin diagnose` calls
it: it gets the campaign and nothing else.

An answer is *right* if the set of mechanisms that leads is exactly the set that was hidden: for nothing by the
verdict `no_mismatch`, for physics outside the catalogue by the verdict `unexplained`. A leading set counts under
`ambiguous` too. Something hidden is *visible* if the truth gains more than 20 in χ² over the base model, a pair if
each of its members does so beside the other. On our own rig it is *identifiable* if, besides, the truth gains more than
20 in χ² over every other answer as well, all by the rig's own equations and at their best: a moving edge and a finite
amplitude at one amplitude are twins, and nobody could name the one or the other. No report enters either definition.
"""


def document(parts: Mapping[str, Result]) -> str:
    """The page of all parts that were worked out."""
    sections = {
        "solved_contact": solved_contact,
        "open": _concealed,
        "sealed": _sealed,
        "mixture": lambda result: _mixture(result, parts.get("ceiling")),
        "quiet": _quiet,
        "curves": curves,
        "quiet_curves": quiet_curves,
        "unlisted": lambda result: hidden(result, parts.get("quiet_unlisted")),
        "quiet_unlisted": alarms,
        "left_out": left_out,
        "joint": joint,
        "coverage": coverage,
        "search": search_misses,
        "sensitivity": sensitivity,
        "wrong_modulus": wrong_modulus,
        "slips": slips,
        "recordings": recordings,
        "paper": paper_array,
    }
    short = summary(parts)
    written = ([short] if short else []) + [section(parts[name]) for name, section in sections.items() if name in parts]
    state = table(
        ["part", "sources of the diagnosis"], [[name, f"`{part['sources']}`"] for name, part in parts.items()]
    )
    tail = "## What was run\n\nA digest of the library's sources stands for each part.\n\n"
    return "\n".join([_HEAD, *written, tail + state])


def _concealed(result: Result) -> str:
    judged = judged_of(result)
    visible = [judgement for judgement in judged if judgement.visible]
    return f"""\
## Campaigns of a rig that this project has never seen

Of {len(judged)} open campaigns {len(visible)} are identifiable. Right among these: {right(visible)}; among all:
{right(judged)}.

{misses(judged)}"""


def _sealed(result: Result) -> str:
    counts = Counter[str](result["verdicts"])
    counts_in_words = ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))
    return f"""\
Of the sealed campaigns, whose truth is not known here, {len(result["verdicts"])} reports lie in `proof/sealed/`, for
others to judge. Their verdicts: {counts_in_words}. Nothing was fitted to them.
"""


def _mixture(result: Result, ceiling: Result | None) -> str:
    judged = judged_of(result)
    visible = [judgement for judgement in judged if judgement.visible]
    parts = {
        kind: [judgement for judgement in visible if judgement.kind == kind]
        for kind in ("none", "single", "pair", "unknown")
    }
    parts["all"] = visible
    drawn = Counter(judgement.kind for judgement in judged) + Counter(all=len(judged))
    rows = [[kind, str(drawn[kind]), right(entries), _ideal(entries, ceiling), right(_identifiable(entries, ceiling))]
            for kind, entries in parts.items()]  # fmt: skip
    return f"""\
## Campaigns of our own rig

{len(judged)} of {own_rig.MIXTURE} campaigns (seed {own_rig.SEED}), drawn evenly from subtle to strong; the rig
shares no code with the diagnosis, and its laws are not the catalogue's.

{table(["hidden", "drawn", "right, of the visible", "ideal diagnoser, of these", "right, of the identifiable"], rows)}
{_CEILING if ceiling else ""}
What was named where the answer is not right, of the visible. *Left open* is the verdict `ambiguous` with the truth
among the rivals: for near-twins (a moving edge and a finite amplitude at one amplitude) there is no better answer.

{_confused(visible)}
![What was hidden against what was named](figures/proof-confusion.svg)

{_probabilities(judged, visible, _identifiable(visible, ceiling))}
![Calibration, and accuracy against the effect's size](figures/proof-calibration.svg)

{_held_out(visible)}
### Every miss

{misses(judged, {judgement.name for judgement in _identifiable(visible, ceiling)})}"""


_CEILING = """\
The ideal diagnoser owns the rig's equations (those outside the catalogue included), its noise levels, the ranges
and shares that it draws from, and knows E and h exactly. It takes the most probable of nothing, every single effect
and, where two are hidden, every pair that shares one with them, by Laplace evidence; the true set is maximised from
its true values, so it never overlooks it. Its likelihood treats the scatter of position to second order.
"""


def _ideal(judged: Sequence[Judged], ceiling: Result | None) -> str:
    answers = ceiling["answers"] if ceiling else {}
    right = [
        tuple(answers[judgement.name]["answer"]) == judgement.truth for judgement in judged if judgement.name in answers
    ]
    return percent(share(right)) if right else "not run"


def _identifiable(judged: Sequence[Judged], ceiling: Result | None) -> list[Judged]:
    """Those of the visible that an ideal diagnoser could name; of those it was run on."""
    answers = ceiling["answers"] if ceiling else {}
    gains = {name: answer["chi2_over_rivals"] for name, answer in answers.items()}
    return [
        judgement
        for judgement in judged
        if judgement.name in gains and (not judgement.truth or gains[judgement.name] > THRESHOLD)
    ]


def _confused(judged: Sequence[Judged]) -> str:
    header = ["hidden", "count", "right", "left open", "part of it", "other mechanisms", "unexplained", "nothing"]
    rows = []
    for kind in ("none", "single", "pair", "unknown"):
        entries = [judgement for judgement in judged if judgement.kind == kind]
        counts = Counter(_outcome(judgement) for judgement in entries)
        rows.append([kind, str(len(entries)), *(str(counts[name]) for name in header[2:])])
    return table(header, rows)


def _outcome(judgement: Judged) -> str:
    if judgement.right:
        return "right"
    if judgement.left_open:
        return "left open"
    if judgement.verdict in QUIET:
        return "nothing"
    if judgement.verdict == "unexplained":
        return "unexplained"
    return "part of it" if set(judgement.truth) & set(judgement.answer) else "other mechanisms"


def _probabilities(judged: Sequence[Judged], visible: Sequence[Judged], identifiable: Sequence[Judged]) -> str:
    rows = []
    for name, entries in (("identifiable", identifiable), ("visible", visible), ("all", judged)):
        if not entries:
            continue
        result = calibration(
            [judgement.probability for judgement in entries], [judgement.right for judgement in entries]
        )
        low, high = result.chance_range
        inside = "inside" if result.error <= high else "outside"
        rows.append([name, str(len(entries)), f"{result.error:.3f}", f"{low:.3f}–{high:.3f}", inside])
    header = ["campaigns", "count", "expected calibration error", "95 % range of a perfectly calibrated tool", "is"]
    return f"""\
Stated probability of the answer against how often it was right, in ten equal bins. Some error is there by chance:
the range is that of 4000 simulated tools that state the same probabilities and are right exactly so often.

{table(header, rows)}"""


def _held_out(judged: Sequence[Judged]) -> str:
    ratios = [judgement.held_out[0] / judgement.held_out[1] for judgement in judged if judgement.held_out]
    if not ratios:
        return ""
    return (
        f"Error on held-out groups after the fit, over the noise floor: median {median_of(ratios)} over "
        f"{len(ratios)} campaigns (bootstrap).\n"
    )


def _quiet(result: Result) -> str:
    judged = judged_of(result)
    alarms = [judgement for judgement in judged if judgement.verdict not in QUIET]
    return f"""\
### False alarms

{len(judged)} of {own_rig.QUIET} campaigns with nothing missing (seed {own_rig.SEED + 1}): a verdict other than
`no_mismatch` or `insufficient_data` in {percent(Share(len(alarms), len(judged)))}.

{misses(alarms) if alarms else ""}"""
