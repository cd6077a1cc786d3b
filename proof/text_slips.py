"""The page's section on slips of a lab."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share
from rig.identifiable import THRESHOLD

Result = Mapping[str, Any]


def slips(result: Result) -> str:
    """How many of each slip are named, and what is named without a slip."""
    judged = result["judged"]
    by_slip: dict[str, list[Result]] = {}
    for judgement in judged:
        for slip, committed in judgement["slips"].items():
            by_slip.setdefault(slip, []).append(committed)
    rows = [[slip, *_row(committed)] for slip, committed in by_slip.items()]
    single = sum(bool(judgement["hidden"]) for judgement in judged)
    return f"""\
## Slips of a lab

{len(judged)} campaigns of the virtual rig, of which {single} hide one effect and the others nothing
(`underskin prove slips`, `proof/slips.py`, seed {result["seed"]}), as they are and with each slip in them. A slip is
*visible* if it adds more than {THRESHOLD:.0f} in χ² to levels or phases over the rig's own scatter, and *identifiable*
if, by the rig's equations, the best single other cause leaves more than {THRESHOLD:.0f} of it: an effect on the levels
at a strength that the rig draws, or a delay of either sign, alone or beside an effect that turns the phase, for
conjugated FRFs (all of them conjugated, a delay is one of the other sign, which no recording can tell). A third of the
recordings conjugated must differ from one course of phase without knowledge of which they are. *Named* is a finding
with the slip's own code; the screening alone is called.

{table(["slip", "named, of the visible", "named, of the identifiable"], rows)}
Without a slip, one was named in {percent(share([bool(judgement["false"]) for judgement in judged]))}.

{_false(judged)}
Identifiable slips that were not named:

{_missed(judged)}"""


def _row(committed: Sequence[Result]) -> list[str]:
    return [
        percent(share([slip["named"] for slip in committed if slip["chi2"] > THRESHOLD])),
        percent(share([slip["named"] for slip in committed if slip["over_rivals"] > THRESHOLD])),
    ]


def _false(judged: Sequence[Result]) -> str:
    rows = [
        [judgement["name"], _hidden(judgement), ", ".join(judgement["false"])]
        for judgement in judged
        if judgement["false"]
    ]
    return table(["campaign", "hidden", "named without a slip"], rows) if rows else ""


def _missed(judged: Sequence[Result]) -> str:
    rows = [
        [judgement["name"], _hidden(judgement), slip, f"{of_slip['chi2']:.0f}", f"{of_slip['over_rivals']:.0f}",
         ", ".join(of_slip["as"]) or "nothing"]
        for judgement in judged for slip, of_slip in judgement["slips"].items()
        if of_slip["over_rivals"] > THRESHOLD and not of_slip["named"]
    ]  # fmt: skip
    header = ["campaign", "hidden", "slip", "χ²", "χ² left by other causes", "named"]
    return table(header, rows) if rows else "None.\n"


def _hidden(judgement: Result) -> str:
    return " + ".join(judgement["hidden"]) or "nothing"
