"""Slips of a lab in campaigns of the rig: how many are named by the screening, and what it names where there are none.

Campaigns that hide nothing or one effect, each judged as it is and with each slip in it. Slips that seldom show are
committed in all of them, the others in the first ones. `python -m proof.slips --seed N --count K` prints this for
another seed.
"""

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from proof import seeds
from proof.slip_kinds import SLIPS, Case
from proof.stored import Work, diagnosing, digest_of, of_each, sources, stored
from proof.text_slips import slips
from rig.draw import drawn, record
from rig.recorded import RecordedLines, campaign
from rig.true_response import TrueResponse
from underskin.diagnosis.slips.inspection import inspect
from underskin.diagnosis.slips.levels import levels
from underskin.findings.codes import Reason
from underskin.recordings.campaign import Campaign, frf_recordings, from_dict
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats

SEED, COUNT = 71091, 500
_FIRST = 90  # campaigns in which every slip is committed
_SELDOM = ("labels exchanged", "cables exchanged", "all conjugated", "a third conjugated", "warm-up, falling")
_SINGLE = (7, 12)  # of so many campaigns hide one effect: only some effects turn a phase that can be conjugated
_PLACES = 24  # draws of places
_SLIPS = {reason for _, reasons in SLIPS.values() for reason in reasons}


def judge_slips(work: Work, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """For each campaign what is named without a slip, and with each."""
    numbers = list(range(min(work.count or COUNT, COUNT)))
    return {"seed": SEED, "judged": _judge(work, SEED, numbers, progress)}


def _judge(work: Work, seed: int, numbers: Sequence[int], progress: Callable[[int, int], None]) -> list[dict[str, Any]]:
    version = f"{diagnosing()} {sources('rig', 'proof/slip*.py')}"
    return of_each(work, numbers, partial(_judged, work, seed, version), progress)


def _judged(work: Work, seed: int, version: str, number: int) -> dict[str, Any]:
    key = digest_of(["slips", seed, number, version])
    return stored(work.folder / "slips", key, partial(judged_campaign, seed, number))


def _description(seed: int, number: int) -> dict[str, Any]:
    single, of = _SINGLE
    return drawn(seed, number, "single" if number % of < single else "none")


def document(seed: int, number: int) -> dict[str, Any]:
    """The campaign (`campaign/1`) without a slip."""
    return campaign(record(_description(seed, number)))


def judged_campaign(seed: int, number: int) -> dict[str, Any]:
    """One campaign: what is named in it without a slip, and with each visible or committed slip."""
    sigma = load_table()
    description = _description(seed, number)
    recorded = record(description)
    made, _ = from_dict(campaign(recorded))
    case = _case(made, recorded, sigma)
    committed = {}
    for index, (slip, (make, reasons)) in enumerate(SLIPS.items()):
        if number >= _FIRST and slip not in _SELDOM:
            continue
        done = make(case, np.random.default_rng([number, index]))
        if done is None:
            continue
        named = _named(done.campaign, sigma)
        committed[slip] = {
            "chi2": done.chi2,
            "over_rivals": done.chi2 if done.over_rivals is None else done.over_rivals,
            "named": bool(named & set(reasons)),
            "as": sorted(named & _SLIPS),
        }
    return {
        "name": f"{seed}-{number:04d}",
        "hidden": list(description["effects"]),
        "false": sorted(_named(made, sigma) & _SLIPS),
        "slips": committed,
    }


def _named(made: Campaign, sigma: SigmaTable) -> set[Reason]:
    return {finding.reason for finding in inspect(made, sigma).findings}


def _case(made: Campaign, recorded: RecordedLines, sigma: SigmaTable) -> Case:
    """With the scatter of each recording's level: gain, position and lines."""
    own_levels = levels(made, frf_recordings(made), sigma)
    relative = recorded.line_variance / np.maximum(np.abs(recorded.exact) ** 2, 1e-300)
    scatter = np.full(len(recorded.exact), np.inf)
    lines = 1 / (1 / relative).sum(axis=1)
    noise = recorded.response.experiment.noise
    scatter[own_levels.index] = np.sqrt(noise.gain**2 + _of_positions(recorded.response) + lines)[own_levels.index]
    return Case(made, recorded, scatter)


def _of_positions(response: TrueResponse) -> Floats:
    """The variance of ln level from the scatter of places (recordings,)."""
    size = response.experiment.noise.position_mm
    if size == 0:
        return np.zeros(len(response.level))
    random = np.random.default_rng([response.experiment.seed, 37])
    drawn = [response.elsewhere(size * random.normal(size=response.missed_mm.shape)).level for _ in range(_PLACES)]
    return np.asarray(np.var(np.log(np.maximum(np.abs(drawn), 1e-300)), axis=0, ddof=1))


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    options = seeds.parser("slips", __doc__).parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        judged = _judge(Work(Path(folder)), options.seed, range(options.count), lambda *_: None)
    print(slips({"seed": options.seed, "judged": judged}))


if __name__ == "__main__":
    main()
