"""The page's section on slips of a lab."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share
from rig.identifiable import THRESHOLD

Result = Mapping[str, Any]


def slips(result: Result) -> str:
    """How many of each slip are named, and what is named where there is none."""
    judged = result["judged"]
    of_each: dict[str, list[Result]] = {}
    for entry in judged:
        for slip, committed in entry["slips"].items():
            of_each.setdefault(slip, []).append(committed)
    rows = [[slip, *_row(committed)] for slip, committed in of_each.items()]
    single = sum(bool(entry["hidden"]) for entry in judged)
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
Without a slip, one was named in {percent(share([bool(entry["false"]) for entry in judged]))}.

{_false(judged)}
Identifiable slips that were not named:

{_missed(judged)}"""


def _row(committed: Sequence[Result]) -> list[str]:
    return [
        percent(share([one["named"] for one in committed if one["chi2"] > THRESHOLD])),
        percent(share([one["named"] for one in committed if one["over_rivals"] > THRESHOLD])),
    ]


def _false(judged: Sequence[Result]) -> str:
    rows = [[entry["name"], _hidden(entry), ", ".join(entry["false"])] for entry in judged if entry["false"]]
    return table(["campaign", "hidden", "named without a slip"], rows) if rows else ""


def _missed(judged: Sequence[Result]) -> str:
    rows = [
        [entry["name"], _hidden(entry), slip, f"{one['chi2']:.0f}", f"{one['over_rivals']:.0f}",
         ", ".join(one["as"]) or "nothing"]
        for entry in judged for slip, one in entry["slips"].items()
        if one["over_rivals"] > THRESHOLD and not one["named"]
    ]  # fmt: skip
    header = ["campaign", "hidden", "slip", "χ²", "χ² left by other causes", "named"]
    return table(header, rows) if rows else "None.\n"


def _hidden(entry: Result) -> str:
    return " + ".join(entry["hidden"]) or "nothing"
