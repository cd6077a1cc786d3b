"""The page's sections on campaigns with wide tails: coverage of d33, misses by the search, and other priors."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share
from rig.draw import UNKNOWN

Result = Mapping[str, Any]

LOST = 1.0  # nats of evidence times prior by which a hidden set must exceed the best set found to be a miss
_VERDICTS = ("explained", "ambiguous", "unexplained", "no_mismatch", "insufficient_data")


def coverage(result: Result) -> str:
    """How often the interval of d33 holds the true value."""
    judged = result["judged"]
    stated = [judgement for judgement in judged if judgement["held"] is not None]
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
    """All campaigns except those that hide physics outside the catalogue which none of their recordings can
    distinguish from another d33."""
    return [judgement for judgement in entries if judgement["shows"] or not set(judgement["hidden"]) & set(UNKNOWN)]


def by_subset(judged: Sequence[Result]) -> str:
    """The share held: in all, by what is hidden and by verdict, where quotable, by number of sensors."""
    stated = [judgement for judgement in judged if judgement["held"] is not None]
    outside = [judgement for judgement in stated if set(judgement["hidden"]) & set(UNKNOWN)]
    subsets = {"all": stated, "nothing or effects of the catalogue hidden": [e for e in stated if e not in outside]}
    subsets["physics outside the catalogue hidden"] = outside
    subsets["the same, where it shows"] = [judgement for judgement in outside if judgement["shows"]]
    subsets["the same, where it does not"] = [judgement for judgement in outside if not judgement["shows"]]
    subsets["all but these"] = that_show(stated)
    for verdict in _VERDICTS:
        subsets[f"`{verdict}`"] = [judgement for judgement in stated if judgement["verdict"] == verdict]
    agreeing = [judgement for judgement in stated if judgement["verdict"] == "no_mismatch"]
    subsets["`no_mismatch`, nothing hidden"] = [judgement for judgement in agreeing if not judgement["hidden"]]
    subsets["`no_mismatch`, effects of the catalogue hidden"] = [
        judgement for judgement in agreeing if judgement["hidden"] and judgement not in outside
    ]
    subsets["`no_mismatch`, physics outside the catalogue hidden"] = [e for e in agreeing if e in outside]
    subsets["quotable"] = [judgement for judgement in stated if judgement["quotable"]]
    subsets["one sensor"] = [judgement for judgement in stated if judgement["sensors"] == 1]
    subsets["two sensors"] = two = [judgement for judgement in stated if judgement["sensors"] == 2]
    subsets["two sensors, nothing or effects of the catalogue hidden"] = [e for e in two if e not in outside]
    subsets["two sensors, all but what does not show outside the catalogue"] = that_show(two)
    subsets["more sensors"] = [judgement for judgement in stated if judgement["sensors"] > 2]
    rows = [
        [name, percent(share([judgement["held"] for judgement in subset]))]
        for name, subset in subsets.items()
        if subset
    ]
    return table(["campaigns", "d33 held by its 95 % interval"], rows)


def search_misses(result: Result) -> str:
    """How often the search overlooked the hidden set."""
    judged = [judgement for judgement in result["judged"] if judgement["lost"] is not None]
    missed = [judgement for judgement in judged if is_miss(judgement)]
    rows = [
        [judgement["name"], *(" + ".join(judgement[key]) or "nothing" for key in ("truth", "found")),
         f"{judgement['lost']:.1f}",
         "not fitted" if judgement["lost_own"] is None else f"{judgement['lost_own']:.1f}"]
        for judgement in missed
    ]  # fmt: skip
    header = ["campaign", "hidden", "found", "nats lost", "nats that the hidden set's own fit was worse"]
    return f"""\
## Misses by the search

{len(result["judged"])} campaigns with wide tails that hide one effect or two in turns (`proof/search_misses.py`, seed
{result["seed"]}). The set of what is hidden is fitted again, from a grid over all its parameters, from each member
alone and from the rig's own values. The search misses it where its evidence times prior is then more than {LOST:g} nat
above that of the best set that was found. Of those that support what is hidden, that is so in
{percent(share([is_miss(judgement) for judgement in judged]))}.

{table(header, rows) if rows else ""}"""


def is_miss(judgement: Result) -> bool:
    """Whether the hidden set would have led."""
    return judgement["lost"] is not None and bool(judgement["lost"] > LOST)


def sensitivity(result: Result) -> str:
    """The results for the same campaigns under other priors."""
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
        visible = [judgement["right"] for judgement in entries if judgement["visible"] and judgement["hidden"]]
        alarms = [judgement["alarm"] for judgement in entries if not judgement["hidden"]]
        coverage_of_d33 = [judgement["held"] for judgement in entries if judgement["held"] is not None]
        rows.append([name, *(percent(share(values)) for values in (visible, alarms, coverage_of_d33))])
    return table(["priors", "right", "false alarms", "d33 held by its 95 % interval"], rows)
