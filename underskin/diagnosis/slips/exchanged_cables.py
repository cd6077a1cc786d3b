"""Cables of two sensors exchanged from some recording on, detected by gain where each contact is on its own sensor.

After the exchange, sensors of different gain answer at each other's level: one steps up by as much as the other steps
down. Of all pairs and first recordings that with the largest gain of ln evidence by such a double step u,
½ (uᵀ C⁻¹ y)²/(uᵀ C⁻¹ u), is compared fully, with exchanged sensors, at the cost of ln of the number tried. The rival is
a step of any size in one of the two sensors.
"""

from collections.abc import Iterator
from itertools import combinations
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, SEARCHED, SELDOM, SPREADS, Alternative, Levels
from underskin.diagnosis.slips.table import Screened, of_levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.units import Indices


@of_levels
def exchanged_cables(screened: Screened, levels: Levels) -> Iterator[Alternative]:
    """The likeliest exchange, and the rivals."""
    precision = levels.precision(*SEARCHED[0], SPREADS[-1])
    tried = list[tuple[float, list[int], Indices]]()
    for pair in map(list, combinations(np.unique(levels.sensor).tolist(), 2)):
        both = np.flatnonzero(np.isin(levels.sensor, pair))
        both = both[np.argsort(levels.order[both])]
        late = np.arange(len(both)) >= np.arange(1, len(both))[:, None]
        step = late * np.where(levels.sensor[both] == pair[0], 1.0, -1.0)
        along = step @ (precision[both] @ levels.value)
        size = np.einsum("ki,ij,kj->k", step, precision[np.ix_(both, both)], step)
        tried += [(float(gain), pair, both[k + 1 :]) for k, gain in enumerate(0.5 * along**2 / size)]
    if not tried:
        return
    _, pair, since = max(tried, key=lambda exchange: exchange[0])
    sensor = levels.sensor.copy()
    sensor[since] = sum(pair) - sensor[since]
    late = levels.index[since[np.argsort(levels.order[since])]].tolist()
    first, second = (screened.campaign.skin.sensors[index].id for index in pair)
    arguments = {"first": first, "second": second, "since": screened.recordings[late[0]].id, "recordings": len(late)}
    finding = Finding(Reason.CABLES_EXCHANGED, "", "sensor", arguments)
    right = {index: second if screened.recordings[index].sensor == first else first for index in late}
    undone = screened.relabelled(right, finding, moved=True)
    yield Alternative(-SELDOM - log(len(tried)), sensor=sensor, undo=undone)
    for of_sensor in pair:
        step = (np.isin(np.arange(len(sensor)), since) & (levels.sensor == of_sensor)).astype(float)
        yield Alternative(-log(len(sensor)), column=CHANGE * step)
