"""Phrases shared by several sections of the page: shares with intervals, medians, and lists of misses."""

from collections.abc import Collection, Sequence

import numpy as np

from proof.judge import Judged, shown
from proof.markdown import table
from proof.statistics import Share, bootstrap, share
from underskin.units import Floats


def percent(share: Share) -> str:
    """A share with its interval."""
    if not share.count:
        return "none there"
    low, high = share.interval
    return f"{share.right} of {share.count}: {100 * share.value:.0f} % [{100 * low:.0f}–{100 * high:.0f}]"


def right(judged: Sequence[Judged]) -> str:
    """The share of right answers."""
    return percent(share([judgement.right for judgement in judged]))


def median_of(values: Sequence[float]) -> str:
    """A median with its bootstrap interval."""

    def median(sample: Floats) -> Floats:
        return np.median(sample, axis=-1)

    value, low, high = bootstrap(values, median)
    return f"{value:.2f} [{low:.2f}–{high:.2f}]"


def misses(judged: Sequence[Judged], identifiable: Collection[str] = ()) -> str:
    """A table of the answers that are not right."""
    rows = [
        [judgement.name, shown(judgement.truth), shown(judgement.answer), judgement.verdict,
         f"{judgement.probability:.2f}",
         "identifiable" if judgement.name in identifiable else "visible" if judgement.visible else "no",
         f"{judgement.size:.1f}"]
        for judgement in judged if not judgement.right
    ]  # fmt: skip
    if not rows:
        return "No misses.\n"
    header = ["campaign", "hidden", "named", "verdict", "probability", "to be seen", "size, units of noise"]
    return table(header, rows)
