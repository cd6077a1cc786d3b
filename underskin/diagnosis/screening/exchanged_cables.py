"""Two sensors' cables exchanged from some recording on, told by their gains where every contact is on its own sensor.

Sensors of different gains answer with each other's level since: before and after, four groups of levels, of which
crosswise ones agree. All pairs and recordings are tried, and the plainest is held against the model of levels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import log

import numpy as np

from underskin.diagnosis.screening.levels import Levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Indices

_LEAST = 6  # recordings of both sensors
_WORTH = 15.0  # of χ², before it is held against the model of levels
_GAIN = 6.0  # of ln evidence beyond ln of how many were tried


@dataclass(frozen=True)
class Exchange:
    """Numbers of two sensors, the levels since, and by how much ln evidence gains on its cost."""

    sensors: tuple[int, int]
    since: Indices
    gain: float


def exchanged_cables(levels: Levels) -> Exchange | None:
    """The plainest exchange, None where none is plain."""
    numbers, counts = np.unique(levels.sensor, return_counts=True)
    pairs = list(combinations(numbers[counts > 1].tolist(), 2))
    if not pairs:
        return None
    base = levels.fit(levels.value)
    flat = levels.without_smooth(base)
    variance = float(np.median(base.residual(levels.value) ** 2)) / 0.455
    tried = [(*_crosswise(flat, levels, pair), pair) for pair in pairs]
    drop, since, pair = max(tried, key=lambda entry: entry[0])
    if drop < _WORTH * variance:
        return None
    first, second = pair
    sensor = levels.sensor.copy()
    sensor[since] = np.where(levels.sensor[since] == first, second, first)
    cost = log(len(pairs) * len(levels.value))
    gain = levels.fit(levels.value, sensor=sensor).evidence - base.evidence - cost
    return Exchange(pair, since, gain) if gain > _GAIN else None


def with_right_sensors(
    entries: Sequence[FrfRecording], levels: Levels, found: Exchange, places: Mapping[str, tuple[float, float]]
) -> tuple[list[FrfRecording], Finding]:
    """The recordings with the sensors that they are of, and the finding on it; contacts move with the sensors, whose
    `places` [mm] are given."""
    since = levels.number[found.since]
    names = dict(zip(levels.sensor.tolist(), (entries[number].sensor for number in levels.number), strict=True))
    first, second = (names[number] for number in found.sensors)
    order = dict(zip(levels.number.tolist(), levels.order.tolist(), strict=True))
    start = min(since.tolist(), key=lambda number: order[number])
    arguments = {"first": first, "second": second, "since": entries[start].id, "recordings": len(since)}
    right = list(entries)
    for number in since.tolist():
        entry = entries[number]
        there = second if entry.sensor == first else first
        right[number] = replace(entry, sensor=there, position_mm=_moved(entry, places[entry.sensor], places[there]))
    return right, Finding(Reason.CABLES_EXCHANGED, "", "sensor", {**arguments, "put_right": True})


def _moved(entry: FrfRecording, here: tuple[float, float], there: tuple[float, float]) -> tuple[float, float] | None:
    """Where the contact lies beside the other sensor."""
    if entry.position_mm is None:
        return None
    x, y = (at + new - old for at, new, old in zip(entry.position_mm, there, here, strict=True))
    return x, y


def _crosswise(flat: Floats, levels: Levels, pair: tuple[int, int]) -> tuple[float, Indices]:
    """By how much Σ(level − mean)² falls where two sensors are taken for each other since the best recording, and the
    levels since."""
    own = np.flatnonzero(np.isin(levels.sensor, pair))
    own = own[np.argsort(levels.order[own])]
    if len(own) < _LEAST:
        return 0.0, own[:0]
    first = levels.sensor[own] == pair[0]
    straight = _square(flat[own][first]) + _square(flat[own][~first])
    best, since = 0.0, own[:0]
    for k in range(1, len(own)):
        late = np.arange(len(own)) >= k
        if len({*first[late]}) < 2 or len({*first[~late]}) < 2:
            continue
        drop = straight - _square(flat[own][first ^ late]) - _square(flat[own][~(first ^ late)])
        if drop > best:
            best, since = drop, own[late]
    return best, since


def _square(values: Floats) -> float:
    return float(((values - values.mean()) ** 2).sum()) if len(values) else 0.0
