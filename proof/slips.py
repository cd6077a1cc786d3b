"""Slips of a lab in campaigns of the rig: how many are named by the screening, and what it names where there are none.

`python -m proof.slips --seed N --count K` makes K campaigns that hide nothing and K that hide one effect, commits each
slip in each of them, and prints a table of those where it is visible (χ² beyond 20).
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from proof import seeds
from proof.markdown import table
from proof.slip_kinds import SLIPS, Case
from rig.draw import drawn, record
from rig.recorded import RecordedLines, campaign
from rig.true_response import TrueResponse
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.screening.levels import levels
from underskin.findings.codes import Reason
from underskin.recordings.campaign import Campaign, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats

VISIBLE = 20.0
_PLACES = 24  # draws of places
_HIDDEN = ("none", "single")
_SLIPS = {reason for _, reasons in SLIPS.values() for reason in reasons}


@dataclass
class Tally:
    """Per what campaigns hide and slip: how many are visible and named; and false namings where there is no slip."""

    visible: Counter[tuple[str, str]] = field(default_factory=Counter)
    named: Counter[tuple[str, str]] = field(default_factory=Counter)
    missed: list[str] = field(default_factory=list)
    false: list[str] = field(default_factory=list)
    clean: int = 0


def judged(seed: int, count: int) -> Tally:
    """What the screening names in `count` campaigns of each kind."""
    tally, sigma = Tally(), load_table()
    for hidden in _HIDDEN:
        for number in range(count):
            description = drawn(seed, number, hidden)
            recorded = record(description)
            made, _ = from_dict(campaign(recorded))
            _judge(tally, f"{hidden} {number} {' '.join(description['effects'])}", _case(made, recorded, sigma), sigma)
    return tally


def _judge(tally: Tally, name: str, case: Case, sigma: SigmaTable) -> None:
    tally.clean += 1
    false = _named(case.campaign, sigma) & _SLIPS
    tally.false += [f"{name}: {reason}" for reason in sorted(false)]
    for place, (slip, (make, reasons)) in enumerate(SLIPS.items()):
        made = make(case, np.random.default_rng([tally.clean, place]))
        if made is None or made.chi2 < VISIBLE:
            continue
        key = (name.partition(" ")[0], slip)
        tally.visible[key] += 1
        found = _named(made.campaign, sigma)
        if found & set(reasons):
            tally.named[key] += 1
        else:
            tally.missed.append(f"{slip}: {name}, χ² {made.chi2:.0f}, named {', '.join(sorted(found & _SLIPS)) or '-'}")


def _named(made: Campaign, sigma: SigmaTable) -> set[Reason]:
    return {finding.reason for finding in inspect(made, sigma).findings}


def _case(made: Campaign, recorded: RecordedLines, sigma: SigmaTable) -> Case:
    """With the scatter of each recording's level: gain, position and lines."""
    own = levels(made, frf_recordings(made), sigma)
    relative = recorded.line_variance / np.maximum(np.abs(recorded.exact) ** 2, 1e-300)
    scatter = np.full(len(recorded.exact), np.inf)
    lines = 1 / (1 / relative).sum(axis=1)
    noise = recorded.response.experiment.noise
    scatter[own.number] = np.sqrt(noise.gain**2 + _of_place(recorded.response) + lines)[own.number]
    return Case(made, recorded, scatter)


def _of_place(response: TrueResponse) -> Floats:
    """The variance of ln level from the scatter of places (recordings,)."""
    size = response.experiment.noise.position_mm
    if size == 0:
        return np.zeros(len(response.level))
    random = np.random.default_rng([response.experiment.seed, 37])
    drawn = [response.elsewhere(size * random.normal(size=response.missed_mm.shape)).level for _ in range(_PLACES)]
    return np.asarray(np.var(np.log(np.maximum(np.abs(drawn), 1e-300)), axis=0, ddof=1))


def shown(tally: Tally) -> str:
    """The tally as a table, and what is named where there is no slip."""
    rows = [
        [slip, hidden, str(count), str(tally.named[hidden, slip]), f"{100 * tally.named[hidden, slip] / count:.0f} %"]
        for (hidden, slip), count in sorted(tally.visible.items(), key=lambda item: (item[0][1], item[0][0]))
    ]
    false = "".join(f"\n- {entry}" for entry in tally.false)
    head = table(["slip", "campaigns hide", "visible", "named", "share"], rows)
    return f"{head}\n\nFalse namings in {tally.clean} campaigns without a slip: {len(tally.false)}{false}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = seeds.parser("slips", __doc__)
    parser.add_argument("--missed", action="store_true", help="list the visible slips that are not named")
    given = parser.parse_args(arguments)
    tally = judged(given.seed, given.count)
    print(shown(tally))
    if given.missed:
        print("\n".join(["", *tally.missed]))


if __name__ == "__main__":
    main()
