"""Laws that nobody listed, from a rig of their own (`rig/unlisted`): `python -m proof.unlisted --seed N --count K`.

Prints how many are recognised as not in the catalogue, of how many it is told where they enter and what they follow
(right, or an equivalent that the rig itself cannot tell from it), and how far the errors on recordings held out lie
above the noise floor. With `--quiet` nothing is hidden, and what is stated is a false alarm.
"""

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from proof.statistics import share
from rig.unlisted.campaign import write
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import load_table

_ALARMS = ("explained", "unexplained", "ambiguous")


@dataclass(frozen=True)
class Judged:
    """One campaign: its truth, and what its report says."""

    name: str
    truth: Mapping[str, Any]
    report: Mapping[str, Any]

    @property
    def recognised(self) -> bool:
        """As something that is not in the catalogue."""
        return bool(self.report["verdict"] == "unexplained")

    @property
    def placed(self) -> bool:
        """Where it enters and what it follows are right, or equivalents."""
        law, hidden = self.report["unnamed"], self.truth["law"]
        if law is None:
            return False
        enters = {hidden["acts_on"], *self.truth["acts_on_also"]}
        follows = {hidden["axis"], *self.truth["axis_also"]}
        return law["acts_on"] in enters and law["axis"] in follows

    @property
    def shaped(self) -> bool:
        """The form is right as well, or an equivalent."""
        return self.placed and self.report["unnamed"]["form"] in {self.truth["law"]["form"], *self.truth["form_also"]}


def judged(seed: int, count: int, *, quiet: bool) -> list[Judged]:
    """So many campaigns of a seed, diagnosed from their files alone."""
    table = load_table()
    with tempfile.TemporaryDirectory() as folder:
        truths = write(seed, count, Path(folder), quiet)
        return [
            Judged(name, truth, diagnosis_report(parse(json.loads(Path(folder, f"{name}.json").read_text())), table))
            for name, truth in truths.items()
        ]


def lines(entries: Sequence[Judged]) -> list[str]:
    """What came of campaigns that hide a law: those that are identifiable by the rig's own equations."""
    known = [entry for entry in entries if entry.truth["identifiable"]]
    modelled = [entry for entry in known if entry.report["unnamed"] is not None]
    over = [entry.report["unnamed"]["heldout_rmse_percent"]["after"] / _floor(entry) for entry in modelled]
    misses = [
        f"{entry.name}: {entry.truth['law']['acts_on']} over {entry.truth['law']['axis']}, "
        f"{entry.truth['law']['form']}; stated: {entry.report['statement'][:150]}"
        for entry in known
        if not entry.placed
    ]
    return [
        f"recognised as not in the catalogue: {_share([entry.recognised for entry in known])}",
        f"where and axis: {_share([entry.placed for entry in known])}",
        f"where, axis and form: {_share([entry.shaped for entry in known])}",
        f"held out, error after over noise floor: median {median(over):.2f}" if over else "none was modelled",
        f"at most 1.5 times the floor: {_share([ratio <= 1.5 for ratio in over])}",
        *misses,
    ]


def alarms(entries: Sequence[Judged]) -> list[str]:
    """What came of campaigns that hide nothing."""
    false = [entry for entry in entries if entry.report["verdict"] in _ALARMS]
    stated = [f"{entry.name}: {entry.report['probability']:.2f} {entry.report['statement'][:150]}" for entry in false]
    return [f"false alarms: {_share([entry in false for entry in entries])}", *stated]


def _floor(entry: Judged) -> float:
    return float(entry.report["fit"]["noise_floor_percent"])


def _share(outcomes: Sequence[bool]) -> str:
    found = share(outcomes)
    if not found.count:
        return "none"
    low, high = found.interval
    return f"{found.right} of {found.count}: {100 * found.value:.0f} % [{100 * low:.0f}–{100 * high:.0f}]"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="proof.unlisted", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--quiet", action="store_true", help="hide nothing")
    given = parser.parse_args()
    entries = judged(given.seed, given.count, quiet=given.quiet)
    print("\n".join((alarms if given.quiet else lines)(entries)))


if __name__ == "__main__":
    main()
