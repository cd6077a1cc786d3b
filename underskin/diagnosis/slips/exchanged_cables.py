"""Cables of two sensors exchanged from some recording on, detected by gain where each contact is on its own sensor.

After the exchange, sensors of different gain answer at each other's level. In the model of levels (`levels`) the
columns a, b of X, which mark the recordings of either sensor, become a', b'. With U = (a, b, a', b'),
D = t² diag(−1, −1, 1, 1), M = Uᵀ C⁻¹ U and v = Uᵀ C⁻¹ y, the evidence gains −½ ln |1 + D M| + ½ vᵀ (1 + D M)⁻¹ D v at
given s, t and p. All pairs and starting recordings are tried this way, and the best few are fitted fully. An exchange
costs ln of the number tried, and must also exceed a step of any size in one of the two sensors.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import log

import numpy as np

from underskin.diagnosis.slips.levels import LevelFit, Levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Indices

_SPREADS = (0.06, 0.25)  # t of sensors whose exchange would show
_FITTED = 3  # exchanges that are fitted fully
_STEP = 0.4  # prior standard deviation of a sensor's step
_GAIN = log(100)  # of ln evidence beyond ln of the number tried
_OVER_STEP = log(4)  # of ln evidence beyond a step of one sensor


@dataclass(frozen=True)
class Exchange:
    """Two sensors, the levels since the exchange, and the gain of ln evidence after its cost."""

    sensors: tuple[int, int]
    since: Indices
    gain: float


def exchanged_cables(levels: Levels) -> Exchange | None:
    """The exchange of largest gain, None where none is significant."""
    sensors = np.unique(levels.sensor).tolist()
    base = levels.fit(levels.value)
    tried = sorted(
        (exchange for spread in _SPREADS for exchange in _tried(levels, base, spread)),
        key=lambda exchange: -exchange.gain,
    )
    cost = log(max(len(tried) / len(_SPREADS), 1))
    fitted = [
        replace(exchange, gain=_fit(levels, exchange).evidence - base.evidence - cost) for exchange in tried[:_FITTED]
    ]
    best = max(fitted, key=lambda exchange: exchange.gain, default=None)
    if best is None or best.gain < _GAIN:
        return None
    cost_of_step = log(max(len(levels.value) - len(sensors), 1))
    steps = [levels.fit(levels.value, column).evidence - base.evidence for column in _steps(levels, best)]
    return best if best.gain > max(steps) - cost_of_step + _OVER_STEP else None


def with_right_sensors(
    recordings: Sequence[FrfRecording], levels: Levels, exchange: Exchange, positions: Mapping[str, tuple[float, float]]
) -> tuple[list[FrfRecording], Finding]:
    """The recordings with their true sensors, and the finding; contacts move with the sensors, whose `positions` are in
    mm."""
    since = levels.index[exchange.since]
    names = dict(zip(levels.sensor.tolist(), (recordings[index].sensor for index in levels.index), strict=True))
    first, second = (names[sensor] for sensor in exchange.sensors)
    order = dict(zip(levels.index.tolist(), levels.order.tolist(), strict=True))
    start = min(since.tolist(), key=lambda index: order[index])
    arguments = {"first": first, "second": second, "since": recordings[start].id, "recordings": len(since)}
    right = list(recordings)
    for index in since.tolist():
        recording = recordings[index]
        there = second if recording.sensor == first else first
        right[index] = replace(
            recording, sensor=there, position_mm=_moved(recording, positions[recording.sensor], positions[there])
        )
    return right, Finding(Reason.CABLES_EXCHANGED, "", "sensor", arguments)


def _moved(
    recording: FrfRecording, here: tuple[float, float], there: tuple[float, float]
) -> tuple[float, float] | None:
    """The position of the contact relative to the other sensor; None if it was not given."""
    if recording.position_mm is None:
        return None
    x, y = (at + new - old for at, new, old in zip(recording.position_mm, there, here, strict=True))
    return x, y


def _tried(levels: Levels, base: LevelFit, spread: float) -> Iterator[Exchange]:
    """Every pair of sensors and first recording, with the gain at the base fit's s and p."""
    same_sensor = np.equal.outer(levels.sensor, levels.sensor)
    precision = np.linalg.inv(np.linalg.inv(base.precision) + (spread**2 - base.spread**2) * same_sensor)
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
        yield from (Exchange(pair, both[k + 1 :], float(gain[k])) for k in range(len(gain)))


def _fit(levels: Levels, exchange: Exchange) -> LevelFit:
    first, second = exchange.sensors
    sensor = levels.sensor.copy()
    sensor[exchange.since] = np.where(levels.sensor[exchange.since] == first, second, first)
    return levels.fit(levels.value, sensor=sensor)


def _steps(levels: Levels, exchange: Exchange) -> list[Floats]:
    """A step of either sensor since the exchange (recordings, 1)."""
    late = np.isin(np.arange(len(levels.value)), exchange.since)
    return [_STEP * (late & (levels.sensor == sensor)).astype(float)[:, None] for sensor in exchange.sensors]
