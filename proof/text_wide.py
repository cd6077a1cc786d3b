"""The page's sections on campaigns with wide tails: coverage of d33, and misses by the search."""

from collections.abc import Mapping, Sequence
from typing import Any

from proof.markdown import table
from proof.phrases import percent
from proof.statistics import share

Result = Mapping[str, Any]


def by_subset(judged: Sequence[Result]) -> str:
    """How often the interval of d33 holds the true value: in all, by verdict, where quotable, by number of sensors."""
    stated = [entry for entry in judged if entry["held"] is not None]
    subsets = {"all": stated}
    for verdict in ("explained", "ambiguous", "unexplained", "no_mismatch"):
        subsets[f"`{verdict}`"] = [entry for entry in stated if entry["verdict"] == verdict]
    subsets["quotable"] = [entry for entry in stated if entry["quotable"]]
    subsets["one sensor"] = [entry for entry in stated if entry["sensors"] == 1]
    subsets["two sensors"] = [entry for entry in stated if entry["sensors"] == 2]
    subsets["more sensors"] = [entry for entry in stated if entry["sensors"] > 2]
    rows = [[name, percent(share([entry["held"] for entry in own]))] for name, own in subsets.items()]
    return table(["campaigns", "d33 held by its 95 % interval"], rows)
