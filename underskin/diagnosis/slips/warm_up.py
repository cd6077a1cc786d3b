"""A drift within the first recordings, y_j + A e^(−j/τ) in the order of time j, towards the level of all later ones.

Neighbouring τ hardly differ, and count as one choice. Rivals are a single first recording that is off, and a slower
drift. Where load cycles are noted, ageing explains a fall.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, LEAST_CHANGE, SELDOM, Alternative, Levels, Undone
from underskin.diagnosis.slips.table import Screened, of_levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.forms import recording_order

_TIMES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)  # τ, in recordings: half an hour or less
_LONGEST = 0.3  # largest τ, of the number of recordings
_SLOWER = (2.0, 4.0, 8.0)  # times the longest τ: a drift over the whole campaign, as by a law
_MOST_SHARE = 0.4  # of the recordings left out at most
_OVER = 0.01  # of the level: largest remaining drift in recordings that are used


@of_levels
def warm_ups(screened: Screened, levels: Levels) -> Iterator[Alternative]:
    """Drifts of each τ, and the rivals."""
    times = [time for time in _TIMES if time <= _LONGEST * len(levels.value)]
    for time in times:
        undo = partial(_without_first, screened=screened, time=time, may_age=levels.may_age)
        yield Alternative(0.0, column=CHANGE * np.exp(-levels.order / time), undo=undo)
    for longer in _SLOWER if times else ():
        yield Alternative(0.0, column=CHANGE * np.exp(-levels.order / (longer * times[-1])))
    yield Alternative(-SELDOM, column=CHANGE * (levels.order == 0).astype(float))


def _without_first(size: float, *, screened: Screened, time: float, may_age: bool) -> Undone | None:
    """The recordings after the warm-up."""
    amplitude = CHANGE * size
    if abs(amplitude) < LEAST_CHANGE or (may_age and amplitude > 0):
        return None
    last = min(time * np.log(max(abs(amplitude) / _OVER, 1.0)), _MOST_SHARE * len(screened.recordings))
    early = recording_order(screened.recordings) <= last
    arguments = {"percent": 100 * float(np.exp(-amplitude) - 1), "recordings": int(early.sum())}
    return screened.without(early, Finding(Reason.WARM_UP, "", "recorded_at", arguments))
