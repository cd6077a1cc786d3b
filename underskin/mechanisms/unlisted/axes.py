"""The axes that an unlisted law may follow from recording to recording: fields, times, positions, order, `conditions`.

An axis holds one number per recording, by the recording's id: laws are bound to it, so that a subset of a campaign
has the same order, the same previous preload, and the same range.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

import numpy as np

from underskin.mechanisms.unlisted.vocabulary import AXES
from underskin.recordings.campaign import Conditions, FrfConditions, frf_of
from underskin.recordings.readers.calendar_times import time_zone
from underskin.units import Floats

_SAME = 1e-9  # of the range, within which values are one level


@dataclass(frozen=True, eq=False)
class Axis:
    """One number per recording. `relative`: divided by that of the recording itself (previous preload over its own).

    `words`: the words that the numbers 0, 1, … stand for.
    """

    name: str
    values: Mapping[str, float]  # by the recording's id
    words: tuple[str, ...] = ()
    relative: bool = False
    range: tuple[float, float] | None = None  # where laws are bound to that of another campaign
    origin: datetime | None = None  # from which times count

    @property
    def unit(self) -> str:
        """The unit of its values, one of UNITS of mechanisms."""
        return "-" if self.relative or self.name not in AXES else AXES[self.name][2]

    @cached_property
    def levels(self) -> Floats:
        """The distinct values, ascending."""
        values = np.unique(list(self.values.values()))
        step = _SAME * max(float(np.ptp(values)), 1e-300)
        return np.asarray(values[np.append(True, np.diff(values) > step)])

    @property
    def low(self) -> float:
        """The least value."""
        return float(self.levels[0]) if self.range is None else self.range[0]

    @property
    def high(self) -> float:
        """The largest value."""
        return float(self.levels[-1]) if self.range is None else self.range[1]

    @property
    def span(self) -> float:
        """The range."""
        return self.high - self.low

    @property
    def positive(self) -> bool:
        """Whether a power law of it makes sense: positive, over a factor of 1.5 at least."""
        return not self.words and self.low > 0 and self.high > 1.5 * self.low

    def of(self, ids: Sequence[str]) -> Floats:
        """The values for these recordings (recordings,)."""
        return np.array([self.values[name] for name in ids])


def axes_of(conditions: Conditions) -> list[Axis]:
    """The axes on which the FRF recordings differ; a field that one of them lacks is none.

    A column of `conditions` is an axis where at least two thirds of the recordings have it.
    """
    axes = [axis for axis in every_axis(conditions) if len(axis.levels) > 1]
    days = {int(value // 24) for axis in axes if axis.name == "recorded_at" for value in axis.values.values()}
    return axes if len(days) > 1 else [axis for axis in axes if axis.name != "time_of_day"]  # which then is the time


def every_axis(conditions: Conditions, origin: datetime | None = None) -> list[Axis]:
    """All axes of the FRF recordings, constant ones too; times count from `origin`, else from the first midnight."""
    recordings = frf_of(conditions)
    columns: dict[str, list[float | None]] = {
        name: [getattr(recording, name) for recording in recordings]
        for name in ("preload_n", "indenter_radius_mm", "dynamic_force_n", "load_cycles", "dwell_s")
    }
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in conditions.skin.sensors}
    position = np.array([recording.position_mm or positions[recording.sensor] for recording in recordings])
    columns |= {"x_mm": position[:, 0].tolist(), "y_mm": position[:, 1].tolist()}
    times = _times(recordings)
    if times is not None:
        origin = origin or min(times).replace(hour=0, minute=0, second=0, microsecond=0)
        columns["recorded_at"] = [(time - origin).total_seconds() / 3600 for time in times]
        columns["time_of_day"] = [(time.hour * 3600 + time.minute * 60 + time.second) / 3600 for time in times]
    rank = recording_order(recordings)
    columns["order"] = rank.tolist()
    ids = [recording.id for recording in recordings]
    axes = [
        Axis(name, dict(zip(ids, present, strict=True)), origin=origin if name == "recorded_at" else None)
        for name, column in columns.items()
        if len(present := [value for value in column if value is not None]) == len(ids)
    ]
    axes += _previous(recordings, rank)
    axes.append(_worded("sensor", ids, [recording.sensor for recording in recordings]))
    axes += _further(recordings)
    return axes


def recording_order(recordings: Sequence[FrfConditions]) -> Floats:
    """The rank of each recording, from 0 (recordings,): by time, else by load cycles, else as listed."""
    times = _times(recordings)
    seconds = None if times is None else [time.timestamp() for time in times]
    cycles = [float(recording.load_cycles) for recording in recordings if recording.load_cycles is not None]
    for column in (seconds, cycles):
        if column is not None and len(set(column)) == len(recordings):
            return np.argsort(np.argsort(np.array(column))).astype(float)
    return np.arange(len(recordings), dtype=float)


def _times(recordings: Sequence[FrfConditions]) -> list[datetime] | None:
    """Local times; None where one is missing."""
    if any(recording.recorded_at is None for recording in recordings):
        return None
    zone = time_zone()
    times = [datetime.fromisoformat(str(recording.recorded_at).replace("Z", "+00:00")) for recording in recordings]
    return [time.astimezone(zone) if time.tzinfo else time.replace(tzinfo=zone) for time in times]


def _previous(recordings: Sequence[FrfConditions], rank: Floats) -> list[Axis]:
    """The preload of the previous recording, and over the recording's own; for the first recording its own."""
    order = np.argsort(rank)
    preload = np.array([recording.preload_n for recording in recordings])
    before = preload.copy()
    before[order[1:]] = preload[order[:-1]]
    ids = [recording.id for recording in recordings]
    return [
        Axis("previous_preload_n", dict(zip(ids, before.tolist(), strict=True))),
        Axis("previous_preload_n", dict(zip(ids, (before / preload).tolist(), strict=True)), relative=True),
    ]


def _worded(name: str, ids: Sequence[str], words: Sequence[str]) -> Axis:
    distinct = sorted(set(words))
    number = {word: float(index) for index, word in enumerate(distinct)}
    return Axis(name, {key: number[word] for key, word in zip(ids, words, strict=True)}, tuple(distinct))


def _further(recordings: Sequence[FrfConditions]) -> list[Axis]:
    """The columns of `conditions`, numbers or words; a missing value is replaced by the median or the commonest
    word."""
    axes = []
    for name in sorted({name for recording in recordings for name in recording.conditions or {}}):
        stated = {recording.id: (recording.conditions or {}).get(name) for recording in recordings}
        present = {key: value for key, value in stated.items() if value is not None}
        if 3 * len(present) < 2 * len(recordings):
            continue
        if any(isinstance(value, str) for value in present.values()):
            words = [str(value) for value in present.values()]
            counts = Counter(words)
            usual = max(sorted(counts), key=counts.__getitem__)
            axes.append(_worded(name, list(stated), [str(present.get(key, usual)) for key in stated]))
        else:
            middle = float(np.median([float(value) for value in present.values()]))
            axes.append(Axis(name, {key: float(present.get(key, middle)) for key in stated}))
    return axes
