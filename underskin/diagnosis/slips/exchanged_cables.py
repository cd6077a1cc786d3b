"""Cables of two sensors exchanged from some recording on, detected by gain where each contact is on its own sensor.

After the exchange, sensors of different gain answer at each other's level. In the model of levels (`levels`) the
columns a, b of X, which mark the recordings of either sensor, become a', b'. With U = (a, b, a', b'),
D = t² diag(−1, −1, 1, 1), M = Uᵀ C⁻¹ U and v = Uᵀ C⁻¹ y, the evidence gains −½ ln |1 + D M| + ½ vᵀ (1 + D M)⁻¹ D v at
given s, t and p. All pairs and starting recordings are tried this way, and the best few are compared fully, at the cost
of ln of the number tried. The rival is a step of any size in one of the two sensors.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, SEARCHED, SELDOM, SPREADS, Alternative, Levels, Undone
from underskin.diagnosis.slips.table import Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Indices

Positions = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class _Exchange:
    """Two sensors, the levels since the exchange, and the gain of ln evidence."""

    sensors: tuple[int, int]
    since: Indices
    gain: float


def exchanged_cables(screened: Screened) -> Iterator[Alternative]:
    """The likeliest exchanges, and the rivals."""
    levels = screened.levels
    if levels is None:
        return
    for spread in SPREADS[1:]:  # of sensors whose exchange would show
        tried = list(_tried(levels, spread))
        if not tried:
            return
        best = max(tried, key=lambda exchange: exchange.gain)
        sensor = levels.sensor.copy()
        sensor[best.since] = sum(best.sensors) - sensor[best.since]
        undo = partial(_with_right_sensors, levels=levels, exchange=best, positions=screened.positions)
        yield Alternative(-SELDOM - log(len(tried)), sensor=sensor, undo=undo)
        late = np.isin(np.arange(len(levels.value)), best.since)
        for name in best.sensors:
            step = (late & (levels.sensor == name)).astype(float)
            yield Alternative(-log(len(levels.value)), column=CHANGE * step)


def _tried(levels: Levels, spread: float) -> Iterator[_Exchange]:
    """Every pair of sensors and first recording, with the gain at given t."""
    precision = levels.precision(*SEARCHED[0], spread)
    weighed = precision @ levels.value
    sign = spread**2 * np.array([-1.0, -1.0, 1.0, 1.0])[:, None]
    for pair in combinations(np.unique(levels.sensor).tolist(), 2):
        both = np.flatnonzero(np.isin(levels.sensor, pair))
        both = both[np.argsort(levels.order[both])]
        first = levels.sensor[both] == pair[0]
        late = np.arange(len(both)) >= np.arange(1, len(both))[:, None]
        given = np.broadcast_to(first, late.shape)
        u = np.stack([given, ~given, given ^ late, ~(given ^ late)], axis=-1).astype(float)
        inner = np.eye(4) + sign * (u.transpose(0, 2, 1) @ precision[np.ix_(both, both)] @ u)
        v = (u.transpose(0, 2, 1) @ weighed[both])[..., None]
        gain = 0.5 * ((v * np.linalg.solve(inner, sign * v)).sum(axis=(1, 2)) - np.linalg.slogdet(inner)[1])
        yield from (_Exchange(pair, both[k + 1 :], float(gain[k])) for k in range(len(gain)))


def _with_right_sensors(
    recordings: list[FrfRecording], _: float, *, levels: Levels, exchange: _Exchange, positions: Positions
) -> Undone:
    """The recordings with their true sensors; contacts move with the sensors."""
    since = levels.index[exchange.since]
    names = dict(zip(levels.sensor.tolist(), (recordings[index].sensor for index in levels.index), strict=True))
    first, second = (names[sensor] for sensor in exchange.sensors)
    start = levels.index[exchange.since[np.argmin(levels.order[exchange.since])]]
    arguments = {"first": first, "second": second, "since": recordings[start].id, "recordings": len(since)}
    right = list(recordings)
    for index in since.tolist():
        here, position_mm = recordings[index].sensor, recordings[index].position_mm
        there = second if here == first else first
        if position_mm is not None:
            x, y = (at + new - old for at, new, old in zip(position_mm, positions[there], positions[here], strict=True))
            position_mm = x, y
        right[index] = replace(recordings[index], sensor=there, position_mm=position_mm)
    return right, [Finding(Reason.CABLES_EXCHANGED, "", "sensor", arguments)]
