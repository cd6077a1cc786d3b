"""The axes that an unlisted law may follow from recording to recording, and the forms of a law over one of them.

Axes are fields, times, positions, order and `conditions`. An axis holds one number per recording, by the recording's
id: laws are bound to it, so that a subset of a campaign has the same order, the same previous preload, and the same
range.

A form is features, each times an amplitude, and shape parameters. At amplitude 0 every law is the base model. A feature
is 1 where the form's full change over the measured range is reached, so that an amplitude is that change. Edges of
steps and periods are tried one by one, each as a shape of its own, since a fit does not move from one to the next.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated, exp, where
from underskin.mechanisms.base import Normal, Parameter, Uniform, Values
from underskin.mechanisms.unlisted.vocabulary import AXES, Form
from underskin.recordings.campaign import Conditions, FrfConditions, frf_of
from underskin.recordings.readers.text import time_zone
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
    times = local_times(recordings)
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
    times = local_times(recordings)
    seconds = None if times is None else [time.timestamp() for time in times]
    cycles = [float(recording.load_cycles) for recording in recordings if recording.load_cycles is not None]
    for column in (seconds, cycles):
        if column is not None and len(set(column)) == len(recordings):
            return np.argsort(np.argsort(np.array(column))).astype(float)
    return np.arange(len(recordings), dtype=float)


def local_times(recordings: Sequence[FrfConditions]) -> list[datetime] | None:
    """When they were recorded, in the lab's zone; None where one has no time."""
    if any(recording.recorded_at is None for recording in recordings):
        return None
    zone = time_zone()
    times = [datetime.fromisoformat(str(recording.recorded_at)) for recording in recordings]
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


Feature = Differentiated | Floats
EVERYWHERE = "everywhere"  # the variant of a linear law that does not change along its axis
Features = Callable[[Floats, Values], Sequence[Feature]]

_LEAST_LEVELS = {"power": 3, "exponential": 5, "saturating": 4, "threshold": 4, "periodic": 6, "peak": 6, "free": 4}
_MOST_WORDS = 64  # of an axis that has a law of each
_MOST_EDGES, _MOST_PERIODS = 24, 48
_SHORTEST_PERIOD = 3.0  # levels
_LANDMARKS, _LENGTH = 6, 0.3  # of a free process, over the range
_LATE, _SHARP = "how soon it sets in, over the measured range", "anywhere within the measured range"


@dataclass(frozen=True, eq=False)
class Shape:
    """One form over an axis. `variant` distinguishes shapes of a form; `share` is the shape's share of the form's
    prior."""

    form: Form
    features: Features
    count: int = 1  # of features
    variant: str = ""
    share: float = 1.0
    shape_parameters: tuple[Parameter, ...] = ()  # not amplitudes
    grid: tuple[tuple[float, ...], ...] = ((),)  # their values that a screening tries
    logarithmic: bool = False  # the feature is that of the logarithm: a power

    @cached_property
    def points(self) -> Floats:
        """The grid (points, parameters)."""
        return np.array(self.grid, dtype=float).reshape(len(self.grid), -1)


def shapes(axis: Axis) -> list[Shape]:
    """All shapes that an axis with this many levels can show."""
    if axis.words:
        return _of_words(axis)
    count = len(axis.levels)
    result: list[Shape] = [*_linear(axis), *_step(axis)]
    if axis.positive and count >= _LEAST_LEVELS["power"]:
        result.append(_power(axis))
    for form, builder in (
        ("exponential", _exponential),
        ("saturating", _saturating),
        ("threshold", _threshold),
        ("periodic", _periodic),
        ("peak", _peak),
        ("free", _free),
    ):
        if count >= _LEAST_LEVELS[form]:
            result += builder(axis)
    return result


def reference(axis: Axis, variant: str) -> float:
    """The value at which a linear law does nothing: the least value, or the middle."""
    return (axis.low + axis.high) / 2 if variant == "middle" else axis.low


def _linear(axis: Axis) -> list[Shape]:
    variants = ("low", "middle")

    def of(variant: str) -> Shape:
        zero = reference(axis, variant)
        return Shape("linear", lambda x, _: [(x - zero) / axis.span], variant=variant, share=0.5)

    return [of(variant) for variant in variants]


def constant(share: float) -> Shape:
    """A constant change over the axis."""
    return Shape("linear", lambda x, _: [np.ones_like(x)], variant=EVERYWHERE, share=share)


def _power(axis: Axis) -> Shape:
    middle = float(np.sqrt(axis.low * axis.high))
    return Shape("power", lambda x, _: [np.log(x / middle)], logarithmic=True)


def _exponential(axis: Axis) -> list[Shape]:
    """(e^(u/ξ) − 1)/(e^(1/ξ) − 1), u from 0 to 1 over the range; and the same from the other end."""
    length = _length("law_growth_length", axis, 0.08, 0.8, 0.3, _LATE)

    def growing(x: Floats, values: Values) -> list[Feature]:
        rate = axis.span / values["law_growth_length"]
        return [(exp(((x - axis.low) / axis.span) * rate) - 1.0) / (exp(rate) - 1.0)]

    return [Shape("exponential", growing, shape_parameters=(length,), grid=_over(axis, (0.15, 0.4)))]


def _saturating(axis: Axis) -> list[Shape]:
    """(1 − e^(−u/τ))/(1 − e^(−1/τ)), u from 0 to 1 over the range."""
    length = _length("law_approach", axis, 0.02, 1.2, 0.25, _LATE)

    def approaching(x: Floats, values: Values) -> list[Feature]:
        rate = axis.span / values["law_approach"]
        return [(1.0 - exp(((axis.low - x) / axis.span) * rate)) / (1.0 - exp(-rate))]

    return [Shape("saturating", approaching, shape_parameters=(length,), grid=_over(axis, (0.06, 0.2, 0.6)))]


def _threshold(axis: Axis) -> list[Shape]:
    """0 up to an onset, then straight to 1 at the end of the range; or straight down to an onset, then 0."""
    onset = Parameter(
        "law_onset",
        axis.unit,
        axis.low + 0.02 * axis.span,
        axis.high - 0.05 * axis.span,
        Uniform(),
        "linear",
        limit=None,
        reason=_SHARP,
    )
    grid = tuple((axis.low + share * axis.span,) for share in (0.15, 0.3, 0.5, 0.7, 0.85))

    def above(x: Floats, values: Values) -> list[Feature]:
        relative = (x - values["law_onset"]) / (axis.high - values["law_onset"])
        return [where(relative.value > 0, relative, 0.0)]

    def below(x: Floats, values: Values) -> list[Feature]:
        relative = (values["law_onset"] - x) / (values["law_onset"] - axis.low)
        return [where(relative.value > 0, relative, 0.0)]

    laws = (("above", above), ("below", below))
    return [
        Shape("threshold", law, variant=name, share=0.5, shape_parameters=(onset,), grid=grid) for name, law in laws
    ]


def _step(axis: Axis) -> list[Shape]:
    """0 up to an edge, 1 beyond; edges lie between neighbouring levels."""
    levels = axis.levels
    if len(levels) < 3:
        return []
    edges = (levels[1:] + levels[:-1]) / 2
    if len(edges) > _MOST_EDGES:
        edges = edges[np.unique(np.linspace(0, len(edges) - 1, _MOST_EDGES).round().astype(int))]

    def of(edge: float) -> Shape:
        return Shape("step", lambda x, _: [(x > edge).astype(float)], variant=f"{edge!r}", share=1 / len(edges))

    return [of(edge) for edge in edges.tolist()]


def _periodic(axis: Axis) -> list[Shape]:
    """Sine and cosine of one period; a day for the time of day."""
    if axis.name == "time_of_day":
        periods, half_width = [24.0], 1e-3
    else:
        most = len(axis.levels) / _SHORTEST_PERIOD
        turns = np.arange(0.75, max(most, 0.75) + 1e-9, max(0.5, (most - 0.75) / _MOST_PERIODS))  # resolved: 0.5
        periods, half_width = (axis.span / turns).tolist(), 0.0

    def of(index: int, period: float) -> Shape:
        turn = axis.span / period
        ends = (period * (1 - half_width), period * (1 + half_width))
        if not half_width:
            ends = (axis.span / (turn + 0.3), axis.span / max(turn - 0.3, 0.3))
        length = Parameter(
            "law_period", axis.unit, *ends, Normal(float(np.log(period)), 1.0), "log", limit=None, reason=_SHARP
        )

        def turning(x: Floats, values: Values) -> list[Feature]:
            angle = (2 * np.pi * (x - axis.low)) / values["law_period"]
            return [_sin(angle), _cos(angle)]

        return Shape(
            "periodic",
            turning,
            count=2,
            variant=str(index),
            share=1 / len(periods),
            shape_parameters=(length,),
            grid=((float(np.log(period)),),),
        )

    return [of(index, period) for index, period in enumerate(periods)]


def _peak(axis: Axis) -> list[Shape]:
    """1/(1 + ((x − x1)/w)²)."""
    centre = Parameter("law_centre", axis.unit, axis.low, axis.high, Uniform(), "linear", limit=None, reason=_SHARP)
    width = _length("law_width", axis, 0.03, 0.35, 0.12, "from a few levels to a third of the measured range")
    grid = tuple(
        (axis.low + share * axis.span, float(np.log(wide * axis.span)))
        for wide in (0.08, 0.2)
        for share in np.linspace(0.05, 0.95, 10 if wide < 0.1 else 6).tolist()
    )

    def peaking(x: Floats, values: Values) -> list[Feature]:
        away = (x - values["law_centre"]) / values["law_width"]
        return [1.0 / (1.0 + away * away)]

    return [Shape("peak", peaking, shape_parameters=(centre, width), grid=grid)]


def _free(axis: Axis) -> list[Shape]:
    """A Matérn-3/2 process, by landmarks along the range."""
    count = min(_LANDMARKS, len(axis.levels))
    landmarks = np.linspace(0.0, 1.0, count)

    def matern(a: Floats, b: Floats) -> Floats:
        scaled = np.sqrt(3.0) * np.abs(a[:, None] - b[None]) / _LENGTH
        return np.asarray((1 + scaled) * np.exp(-scaled))

    root = np.linalg.cholesky(matern(landmarks, landmarks) + 1e-8 * np.eye(count))

    def free(x: Floats, _: Values) -> list[Feature]:
        u = np.clip((x - axis.low) / axis.span, 0.0, 1.0)
        return list(np.linalg.solve(root, matern(landmarks, u)))

    return [Shape("free", free, count=count)]


def _of_words(axis: Axis) -> list[Shape]:
    """A step for each word, and a free value per word; nothing for axes with as many words as serial numbers, whose
    laws would grow with the square of the recordings."""
    if len(axis.words) > _MOST_WORDS:
        return []

    def of(word: int) -> Shape:
        return Shape(
            "step",
            lambda x, _: [(x == word).astype(float)],
            variant=axis.words[word],
            share=1 / len(axis.words),
        )

    words = range(len(axis.words))
    laws = [of(word) for word in (words if len(axis.words) > 2 else words[1:])]
    if len(axis.words) > 2:
        laws.append(Shape("free", lambda x, _: [(x == word).astype(float) for word in words], count=len(axis.words)))
    return laws


def _length(name: str, axis: Axis, low: float, high: float, middle: float, reason: str) -> Parameter:
    """A length along an axis, with these fractions of its range as bounds and median."""
    ends = low * axis.span, high * axis.span
    prior = Normal(float(np.log(middle * axis.span)), 0.9)
    return Parameter(name, axis.unit, *ends, prior, "log", limit=None, reason=reason)


def _over(axis: Axis, shares: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    return tuple((float(np.log(share * axis.span)),) for share in shares)


def _sin(x: Differentiated) -> Differentiated:
    return Differentiated(np.sin(x.value), np.cos(x.value) * x.slopes)


def _cos(x: Differentiated) -> Differentiated:
    return Differentiated(np.cos(x.value), -np.sin(x.value) * x.slopes)
