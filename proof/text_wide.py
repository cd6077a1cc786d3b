"""The page's sections on campaigns with wide tails: coverage of d33, misses by the search, and other priors."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share
from rig.draw import UNKNOWN

Result = Mapping[str, Any]

LOST = 1.0  # nats of evidence times prior by which a hidden set must be better than what was found to be a miss
_VERDICTS = ("explained", "ambiguous", "unexplained", "no_mismatch", "insufficient_data")


def coverage(result: Result) -> str:
    """How often the interval of d33 holds the true value."""
    judged = result["judged"]
    stated = [entry for entry in judged if entry["held"] is not None]
    return f"""\
## The stated d33, where scatter and strengths go beyond the priors

{len(judged)} campaigns of the virtual rig with wide tails (`proof/coverage.py`, seed {result["seed"]}): scatter of
gain 0.5 to 8 %, of places 0 to 0.5 mm, effects from fainter to stronger than the diagnosis expects, three of seven
arrays of two sensors. They hide what those of our own rig hide: nothing, one effect, two, or physics outside the
catalogue. Of them {len(stated)} reports state a d33, averaged over the answers that are left; nominally 95 % of the
intervals hold the true one. Physics outside the catalogue may be a constant factor on d33 in a whole campaign (a plate
that bends alike under both sensors), which no recording can tell: it *shows* where it gains more than 20 in χ² by the
rig's equations, with d33 free.

{by_subset(judged)}"""


def that_show(entries: Sequence[Result]) -> list[Result]:
    """All but those that hide physics outside the catalogue which no recording of theirs can tell from another d33."""
    return [entry for entry in entries if entry["shows"] or not set(entry["hidden"]) & set(UNKNOWN)]


def by_subset(judged: Sequence[Result]) -> str:
    """The share held: in all, by what is hidden and by verdict, where quotable, by number of sensors."""
    stated = [entry for entry in judged if entry["held"] is not None]
    outside = [entry for entry in stated if set(entry["hidden"]) & set(UNKNOWN)]
    subsets = {"all": stated, "nothing or effects of the catalogue hidden": [e for e in stated if e not in outside]}
    subsets["physics outside the catalogue hidden"] = outside
    subsets["the same, where it shows"] = [entry for entry in outside if entry["shows"]]
    subsets["the same, where it does not"] = [entry for entry in outside if not entry["shows"]]
    subsets["all but these"] = that_show(stated)
    for verdict in _VERDICTS:
        subsets[f"`{verdict}`"] = [entry for entry in stated if entry["verdict"] == verdict]
    agreeing = [entry for entry in stated if entry["verdict"] == "no_mismatch"]
    subsets["`no_mismatch`, nothing hidden"] = [entry for entry in agreeing if not entry["hidden"]]
    subsets["`no_mismatch`, effects of the catalogue hidden"] = [
        entry for entry in agreeing if entry["hidden"] and entry not in outside
    ]
    subsets["`no_mismatch`, physics outside the catalogue hidden"] = [e for e in agreeing if e in outside]
    subsets["quotable"] = [entry for entry in stated if entry["quotable"]]
    subsets["one sensor"] = [entry for entry in stated if entry["sensors"] == 1]
    subsets["two sensors"] = two = [entry for entry in stated if entry["sensors"] == 2]
    subsets["two sensors, nothing or effects of the catalogue hidden"] = [e for e in two if e not in outside]
    subsets["two sensors, all but what does not show outside the catalogue"] = that_show(two)
    subsets["more sensors"] = [entry for entry in stated if entry["sensors"] > 2]
    rows = [[name, percent(share([entry["held"] for entry in own]))] for name, own in subsets.items() if own]
    return table(["campaigns", "d33 held by its 95 % interval"], rows)


def search_misses(result: Result) -> str:
    """How often the search overlooked the hidden set."""
    judged = [entry for entry in result["judged"] if entry["lost"] is not None]
    missed = [entry for entry in judged if is_miss(entry)]
    rows = [
        [entry["name"], *(" + ".join(entry[key]) or "nothing" for key in ("truth", "found")), f"{entry['lost']:.1f}",
         "not fitted" if entry["lost_own"] is None else f"{entry['lost_own']:.1f}"]
        for entry in missed
    ]  # fmt: skip
    header = ["campaign", "hidden", "found", "nats lost", "nats that the hidden set's own fit was worse"]
    return f"""\
## Misses by the search

{len(result["judged"])} campaigns with wide tails that hide one effect or two in turns (`proof/search_misses.py`, seed
{result["seed"]}). The set of what is hidden is fitted again, from a grid over all its parameters, from each member
alone and from the rig's own values. The search misses it where its evidence times prior is then more than {LOST:g} nat
above that of the best set that was found. Of those that support what is hidden, that is so in
{percent(share([is_miss(entry) for entry in judged]))}.

{table(header, rows) if rows else ""}"""


def is_miss(entry: Result) -> bool:
    """Whether the hidden set would have led."""
    return entry["lost"] is not None and bool(entry["lost"] > LOST)


def sensitivity(result: Result) -> str:
    """What other priors make of the same campaigns."""
    return f"""\
## Other priors

{result["count"]} campaigns with wide tails (`proof/sensitivity.py`, seed {result["seed"]}), two in five of which hide
nothing, diagnosed under priors that are not those of the diagnosis: of scatter, of the strengths that have heavy-tailed
ones (bounds and the others stay), and of nothing missing. *Right* is of the visible, a *false alarm* a
verdict other than `no_mismatch` or `insufficient_data` where nothing is hidden.

{by_priors(result["judged"])}"""


def by_priors(judged: Mapping[str, Sequence[Result]]) -> str:
    """Share right, false alarms and coverage of d33 under each of the priors."""
    rows = []
    for name, entries in judged.items():
        visible = [entry["right"] for entry in entries if entry["visible"] and entry["hidden"]]
        alarms = [entry["alarm"] for entry in entries if not entry["hidden"]]
        kept = [entry["held"] for entry in entries if entry["held"] is not None]
        rows.append([name, *(percent(share(values)) for values in (visible, alarms, kept))])
    return table(["priors", "right", "false alarms", "d33 held by its 95 % interval"], rows)
