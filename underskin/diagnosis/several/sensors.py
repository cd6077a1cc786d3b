"""The sensors of an array over several campaigns of one skin: dates, d33 of each sensor with the mechanisms of the
diagnosis, what changed since when, and which sensors failed.

Changes are those of the array and those of single sensors relative to it. Two sensors of which each has the d33 of the
other from one campaign on had their labels exchanged. ln d33 of sensor i changes between two campaigns by
    z_i = a + δ_i + e_i,   e_i ~ N(0, (f u_i)²),   δ_i = 0, or N(0, 0.2²) with the probability that a sensor changes,
a being the change of all. An exchange has no parameter but its pair, whose z are then those of the other's label: its
odds over all else, with a and the scatter f integrated over and the prior that two sensors change at once, decide. All
else is calculated with the exchange undone.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from enum import StrEnum
from functools import cached_property
from itertools import combinations
from typing import Self

import numpy as np
from scipy.special import chdtri

from underskin.diagnosis.data.names import NAMED
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.numbers import QUANTILES_OF_95, with_ends
from underskin.diagnosis.several.histories import USUAL_CHANGE, log_normal
from underskin.errors import InvalidInput
from underskin.findings.codes import FindingCode, Reason
from underskin.inversion.array_history import (
    FEWEST_DATES,
    FEWEST_SENSORS,
    GAIN_SCALE,
    PRIOR_SENSORS,
    ArrayLevels,
    array_levels,
)
from underskin.inversion.array_history import changes as changes_between_ends
from underskin.inversion.invert import invert
from underskin.inversion.mixed_model import SDS_OF_95, mixture_quantile
from underskin.mechanisms.unlisted.forms import local_times
from underskin.prediction.adopted_model import AdoptedModel
from underskin.recordings.campaign import Campaign, FrfRecording, Recording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab

_LEAST, _LEAST_OF_ARRAY = 0.03, 0.05  # relative changes that are stated: amplifiers are calibrated to some percent
_P_CHANGE, _P_SUSPECTED = 0.05, 0.5  # that d33 changes; of a sensor whose level stands apart in one of two campaigns
_P_EXCHANGE = 0.2  # odds of an exchange, where two sensors have changed at once, over two changes
_SCATTERS, _PER_SD, _BEYOND = 7, 3, 4.0  # quantiles of f; values of a per standard deviation, and beyond all z


@dataclass(frozen=True)
class CampaignDates:
    """Names of campaigns in their order, with the dates of their first recordings, None where there is no time."""

    names: Sequence[str]
    dates: Sequence[str | None]

    @classmethod
    def of(cls, campaigns: Sequence[Campaign]) -> Self:
        """The dates as the recordings state them."""
        return cls([campaign.name for campaign in campaigns], [first_date(campaign) for campaign in campaigns])

    @property
    def ordered(self) -> bool:
        """Whether the order is one of time: all have a date."""
        return None not in self.dates

    def since(self, number: int) -> str | None:
        """The date of this campaign, where a change begins; None where the order is not one of time."""
        return self.dates[number] if self.ordered else None

    @property
    def times(self) -> Floats:
        """When the campaigns were recorded, in days; their indices where not all have a date of their own."""
        days = [date.fromisoformat(text).toordinal() for text in self.dates if text is not None]
        rising = self.ordered and days == sorted(set(days))
        return np.array(days if rising else range(len(self.dates)), dtype=float)

    def days(self, first: int, last: int) -> int | None:
        """Days between two campaigns; None where their order is not one of time."""
        start, end = self.since(first), self.since(last)
        return None if start is None or end is None else (date.fromisoformat(end) - date.fromisoformat(start)).days

    def called(self, number: int) -> str:
        """A campaign's date where that is unique, else its name: "campaign B (no date)"."""
        text = self.dates[number]
        if text is not None and self.ordered and self.dates.count(text) == 1:
            return text
        return f"campaign {self.names[number]} ({text or 'no date'})"

    def order_clause(self) -> str:
        """The clause that the order is not one of time; empty where it is."""
        if self.ordered:
            return ""
        listed = ", ".join(self.called(number) for number in range(len(self.names)))
        return f"not every campaign has a date, so they count in the order in which they were given: {listed}"


def first_date(campaign: Campaign) -> str | None:
    """The day of its first recording as stated; None where none has a time."""
    times = (recording.recorded_at for recording in frf_recordings(campaign))
    return min((str(time)[:10] for time in times if time is not None), default=None)


def in_order(campaigns: Sequence[Campaign]) -> list[Campaign]:
    """By the first time of each; in the given order where one has none."""
    times = [_first_time(campaign) for campaign in campaigns]
    known_times = [time for time in times if time is not None]
    if len(known_times) < len(times):
        return list(campaigns)
    return [campaigns[number] for number in np.argsort(known_times, kind="stable")]


def _first_time(campaign: Campaign) -> float | None:
    """Of its recordings, in seconds; None where none has a time."""
    timed = [recording for recording in frf_recordings(campaign) if recording.recorded_at is not None]
    return min((time.timestamp() for time in local_times(timed) or ()), default=None)


@dataclass(frozen=True)
class Change:
    """A relative change of d33 between two campaigns, `before` and `until`: of one sensor relative to the array, or of
    the array (None). For a step these are consecutive; for a gradual change they are the first and the last."""

    sensor: str | None
    before: int
    until: int
    value: float
    uncertainty: float  # of its logarithm
    probability: float
    causes: tuple[str, ...] = ()  # of a change of all sensors: mechanisms that could have caused it
    label: str | None = None  # of a step of one sensor: under which its recordings have this change
    exchanged_with: str | None = None  # of an exchange, where `sensor` is a label: the label that had its d33 before

    @property
    def since(self) -> int:
        """Number of the first campaign with the change."""
        return self.before + 1

    @property
    def is_step(self) -> bool:
        """Whether it is between consecutive campaigns."""
        return self.until == self.since

    @property
    def percent(self) -> dict[str, float]:
        """Value and 95 % interval [%]."""
        half = SDS_OF_95 * self.uncertainty
        ends = {"value": self.value, "low": self.value - half, "high": self.value + half}
        return {name: 100 * end for name, end in ends.items()}


@dataclass(frozen=True, eq=False)
class ArrayOverDates:
    """d33 [pC/N] of the array in the campaigns (dates,) that determine it, over the sensors that they share, with its
    standard uncertainty between dates; and its change from the first to the last, as `Change` and with its interval."""

    numbers: tuple[int, ...]
    d33: Floats
    uncertainty: Floats
    change: Change
    low: float  # relative
    high: float

    @property
    def is_significant(self) -> bool:
        """Whether its 95 % interval excludes no change."""
        return self.low * self.high > 0


Sensor = Floats  # d33, its standard uncertainty, and the ends of its 95 % interval [pC/N]
Values = Mapping[str, Mapping[str, float]]  # of mechanisms' parameters


@dataclass(frozen=True, eq=False)
class SensorsUnderSet:
    """The sensors of a campaign under one set of mechanisms with its probability, and the standard deviation of their
    ln d33 in common by the strengths of these mechanisms."""

    share: float
    sensors: Mapping[str, Sensor]
    deviation: float


def over_sets(parts: Sequence[SensorsUnderSet], level: Mapping[str, Sensor], d33: Sensor) -> dict[str, float | None]:
    """The median and 95 % interval over the sets of a d33 that is `d33` where the sensors are `level`: every set moves
    it as it moves them."""
    common = {part: [name for name in level if name in part.sensors] for part in parts}
    moved = {
        part: np.mean([np.log(np.abs(part.sensors[name][0] / level[name][0])) for name in names])
        for part, names in common.items()
        if names
    }
    shares = np.array([part.share for part in moved])
    if not moved:
        return with_ends(d33[0], *d33[2:])
    deviations = np.hypot([part.deviation for part in moved], d33[1] / np.abs(d33[0]))
    median, *ends = (
        float(
            d33[0]
            * np.exp(mixture_quantile(shares / shares.sum(), np.array(list(moved.values())), deviations, probability))
        )
        for probability in QUANTILES_OF_95
    )
    return with_ends(median, *sorted(ends))


def sensors_of(campaign: Campaign, values: Values, table: SigmaTable, used: Collection[str]) -> dict[str, Sensor]:
    """By id, with mechanisms at these values, from the recordings `used` (ids) by the campaign's own diagnosis; without
    dead sensors, and empty where no recording can be inverted."""
    recordings = tuple(recording for recording in campaign.recordings if recording.id in used)
    model = AdoptedModel(campaign.skin, {name: parameters for name, parameters in values.items() if parameters}, 0.0)
    try:
        as_base, _ = model.as_base_model(replace(campaign, recordings=recordings), table)
        inversion = invert(as_base, table)
    except InvalidInput:
        return {}
    dead = {flag.sensor for flag in inversion.flags if flag.flagged_for == Reason.DEAD}
    numbers = to_lab("d33_pc_per_n", np.column_stack(list(vars(inversion.sensors).values())))
    return {
        sensor: row
        for sensor, row in zip(inversion.sensor_ids, numbers, strict=True)
        if np.isfinite(row[0]) and row[0] != 0 and sensor not in dead
    }


@dataclass(frozen=True, eq=False)
class SensorsOverDates:
    """The sensors of each campaign, and when these were recorded, in any unit (campaigns,).

    `unsure` (campaigns,): the uncertainty of ln d33 of all sensors since the previous campaign by the mechanisms.
    `suspected`: the sensors whose level, in each campaign by itself, differs from the others'.
    """

    campaigns: Sequence[Mapping[str, Sensor]]  # by label
    times: Floats
    unsure: Sequence[float]
    suspected: Sequence[frozenset[str]]

    @cached_property
    def _exchanges(self) -> tuple[list[Change], list[Mapping[str, Sensor]], list[dict[str, str]]]:
        """The exchanges of labels, as a change of each label, the campaigns with these undone, and the label of each
        sensor in each campaign."""
        changes, right, labels = list[Change](), list(self.campaigns), [{sensor: sensor for sensor in self.ids}]
        for number in range(1, len(right)):
            before, held, sure = labels[-1], dict(labels[-1]), dict[str, float]()
            common = 0.0
            while (found := self._exchange(right, number)) is not None:
                (first, second), common, probability = found
                held[first], held[second] = held[second], held[first]
                sure |= {sensor: min(probability, sure.get(sensor, 1.0)) for sensor in (first, second)}
                names = {first: second, second: first}
                right[number:] = [
                    {names.get(sensor, sensor): d33 for sensor, d33 in campaign.items()} for campaign in right[number:]
                ]
            labels.append(held)
            now = {label: sensor for sensor, label in held.items()}
            for sensor in (sensor for sensor in sure if held[sensor] != before[sensor]):
                label = before[sensor]
                ends = [self.campaigns[date][label] for date in (number - 1, number)]
                (first_level, level), uncertainties = _logarithms(ends)
                change, sd = float(np.expm1(level - first_level - common)), float(_between(*uncertainties))
                source = before[now[label]]
                changes.append(Change(label, number - 1, number, change, sd, sure[sensor], (), label, source))
        return changes, right, labels

    def _exchange(
        self, campaigns: Sequence[Mapping[str, Sensor]], number: int
    ) -> tuple[tuple[str, str], float, float] | None:
        """The exchange since the previous campaign that is more probable than all else: the two sensors, the change of
        ln d33 of all with it, and its probability."""
        before, after = campaigns[number - 1 : number + 1]
        shared = [sensor for sensor in before if sensor in after]
        if len(shared) < FEWEST_SENSORS:
            return None
        (first, u_first), (last, u_last) = (_logarithms([d33[sensor] for sensor in shared]) for d33 in (before, after))
        prior = np.array([self._p_change(number, sensor, len(shared)) for sensor in shared])
        weighed = _exchanges_weighed(last - first[:, None], _between(u_first[:, None], u_last), prior)
        best = max(weighed, key=lambda pair: weighed[pair])
        others = np.logaddexp.reduce([0.0, *(odds for pair, (odds, _) in weighed.items() if pair != best)])
        log_odds, common = weighed[best]
        if log_odds - others < np.log((1 - NAMED) / NAMED):
            return None
        row, other = best
        return (shared[row], shared[other]), common, float(1 / (1 + np.exp(others - log_odds)))

    def _p_change(self, number: int, sensor: str, sensors: int) -> float:
        """The prior probability that one of so many sensors changed since the previous campaign."""
        return _P_SUSPECTED if sensor in self.suspected[number - 1] ^ self.suspected[number] else _P_CHANGE / sensors

    @cached_property
    def ids(self) -> list[str]:
        """The sensors of any campaign."""
        return list(dict.fromkeys(sensor for campaign in self.campaigns for sensor in campaign))

    @cached_property
    def changes(self) -> list[Change]:
        """Those stated of the array, then of single sensors: steps between consecutive campaigns, and over all of them
        changes too slow for a step."""
        stepped = {change.sensor for change in self.steps if change.exchanged_with is None}
        gradual = [change for change in self._gradual() if change.sensor not in stepped]
        return sorted([*self.steps, *gradual], key=lambda change: change.sensor is not None)

    @cached_property
    def steps(self) -> list[Change]:
        """The changes between consecutive campaigns, exchanges first."""
        steps = [change for number in range(1, len(self.campaigns)) for change in self._steps(number)]
        return [*self._exchanges[0], *steps]

    @cached_property
    def array(self) -> ArrayOverDates | None:
        """None where fewer than two campaigns share a sensor."""
        levels = self._levels
        dates = np.flatnonzero(np.isfinite(levels.level))
        if len(dates) < 2:
            return None
        level, deviation = levels.level[dates], levels.deviation[dates]
        between = changes_between_ends(self.times[dates], level[None], deviation[None], gain_scatters=True)
        size, sd, low, high = (float(part[0]) for part in (between.value, between.deviation, between.low, between.high))
        numbers = tuple(dates.tolist())
        total = float(np.hypot(sd, np.linalg.norm(self.unsure[numbers[0] + 1 : numbers[-1] + 1])))
        change = _change(None, numbers[0], numbers[-1], size, total, _P_CHANGE)
        ends = (float(np.expm1(size + total / sd * (end - size))) for end in (low, high))
        return ArrayOverDates(numbers, np.exp(level), np.exp(level) * deviation, change, *ends)

    @cached_property
    def _levels(self) -> ArrayLevels:
        return self._levels_of(slice(None))

    def _levels_of(self, numbers: slice) -> ArrayLevels:
        """Of some campaigns (sensors, campaigns), with exchanges undone."""
        value, deviation = np.full((2, len(self.ids), len(self.campaigns)), np.nan)
        for number, campaign in enumerate(self._exchanges[1]):
            rows = [self.ids.index(sensor) for sensor in campaign]
            value[rows, number], deviation[rows, number] = _logarithms(list(campaign.values()))
        return array_levels(value[:, numbers], deviation[:, numbers])

    def _steps(self, number: int) -> list[Change]:
        """The changes since the previous campaign."""
        levels = self._levels_of(slice(number - 1, number + 1))
        steps = []
        shared = np.flatnonzero(np.isfinite(levels.departure).all(axis=1)).tolist()
        for row in shared if len(shared) >= FEWEST_SENSORS else ():
            size, sd = float(np.diff(levels.departure[row])[0]), float(np.hypot(*levels.departure_deviation[row]))
            prior = self._p_change(number, self.ids[row], len(shared))
            step = _change(self.ids[row], number - 1, number, size, sd, prior)
            steps.append(replace(step, label=self._exchanges[2][number][self.ids[row]]))
        if np.isfinite(levels.level).all():
            size, sd = float(np.diff(levels.level)[0]), float(np.linalg.norm([*levels.deviation, self.unsure[number]]))
            steps.append(_change(None, number - 1, number, size, sd, _P_CHANGE))
        return [change for change in steps if _is_stated(change)]

    def _gradual(self) -> list[Change]:
        """The changes between the first and the last of at least three campaigns, of the array and of each sensor."""
        over, levels = self.array, self._levels
        if over is None or len(over.numbers) < FEWEST_DATES:
            return []
        large = over.change.probability > 1 - NAMED and abs(over.change.value) > _LEAST_OF_ARRAY
        gradual = [over.change] if large else []
        between = changes_between_ends(self.times, levels.departure, levels.departure_deviation, gain_scatters=False)
        dates = [np.flatnonzero(np.isfinite(departure)).tolist() for departure in levels.departure]
        for row, sensor in enumerate(self.ids) if len(self.ids) >= FEWEST_SENSORS else ():
            if len(dates[row]) >= FEWEST_DATES:
                size, sd = float(between.value[row]), float(between.deviation[row])
                change = _change(sensor, dates[row][0], dates[row][-1], size, sd, _P_CHANGE / len(self.ids))
                gradual += [change] if _is_stated(change) else []
        return gradual


def _logarithms(sensors: Sequence[Sensor]) -> tuple[Floats, Floats]:
    """ln |d33| of each with its standard uncertainty."""
    d33, uncertainty, *_ = np.reshape(sensors, (-1, 4)).T
    return np.log(np.abs(d33)), uncertainty / np.abs(d33)


def _between(before: Floats, after: Floats) -> Floats:
    """The standard uncertainty of a change of ln d33 from those of both dates, with the gain of the second."""
    return np.sqrt(before**2 + after**2 + GAIN_SCALE**2)


def _exchanges_weighed(size: Floats, sd: Floats, prior: Floats) -> dict[tuple[int, int], tuple[float, float]]:
    """Of pairs of sensors (indices): ln of the odds of their exchange over none, and the change of all with it.

    `size` with `sd` (sensors, labels): the change of ln d33 if a label were that of a sensor; `prior` (sensors,): that
    a sensor changes. 1/f² is χ² of as many degrees of freedom as `array_levels` counts for the stated uncertainties.
    """
    own, deviation = size.diagonal(), sd.diagonal()
    step, margin = float(deviation.min()) / _PER_SD, _BEYOND * float(deviation.max())
    common = np.arange(own.min() - margin, own.max() + margin + step, step)
    scatter2 = PRIOR_SENSORS / chdtri(PRIOR_SENSORS, (np.arange(_SCATTERS) + 0.5) / _SCATTERS)[:, None]

    def log_density(row: int, label: int) -> Floats:
        offset, variance = size[row, label] - common, scatter2 * sd[row, label] ** 2
        same, changed = (log_normal(offset, part) for part in (variance, variance + USUAL_CHANGE**2))
        return np.asarray(np.logaddexp(np.log1p(-prior[row]) + same, np.log(prior[row]) + changed))

    rows = [log_density(row, row) for row in range(len(own))]
    none = np.sum(rows, axis=0)
    total = np.logaddexp.reduce(none, axis=None)
    weighed = {}
    for first, second in combinations(range(len(own)), 2):
        gained = [log_density(*pair) for pair in ((first, second), (second, first))]
        exchanged = none + sum(gained) - rows[first] - rows[second]
        at_once = np.log(_P_EXCHANGE * prior[first] * prior[second])
        log_odds = float(at_once + np.logaddexp.reduce(exchanged, axis=None) - total)
        weighed[first, second] = log_odds, float(common[exchanged.max(axis=0).argmax()])
    return weighed


def _change(sensor: str | None, before: int, until: int, size: float, sd: float, prior: float) -> Change:
    """A change of ln d33, with the probability that it is one; usual changes are about 20 %."""
    unchanged = log_normal(size, sd**2) - log_normal(size, sd**2 + USUAL_CHANGE**2)
    probability = float(1 / (1 + (1 - prior) / prior * np.exp(np.clip(unchanged, -700, 700))))
    return Change(sensor, before, until, float(np.expm1(size)), sd, probability)


def _is_stated(change: Change) -> bool:
    """Whether a change is probable and large enough to be stated."""
    least = _LEAST_OF_ARRAY if change.sensor is None else _LEAST
    return change.probability > 1 - NAMED and abs(float(np.log1p(change.value))) > least


def exchanges(changes: Sequence[Change]) -> list[list[Change]]:
    """The changes of the labels of each exchange: two, or more that have each other's d33 in a ring."""
    found = {(change.since, change.sensor): change for change in changes if change.exchanged_with is not None}
    rings = []
    while found:
        ring = [found.pop(next(iter(found)))]
        while (following := found.pop((ring[-1].since, ring[-1].exchanged_with), None)) is not None:
            ring.append(following)
        rings.append(sorted(ring, key=lambda change: str(change.sensor)))
    return rings


def without_steps(campaign: Campaign, steps: Sequence[Change], number: int) -> Campaign:
    """The campaign of this number with earlier steps of single sensors undone, of each under its label."""
    factors: dict[str, float] = {}
    for change in steps:
        if change.label is not None and change.since <= number:
            factors[change.label] = factors.get(change.label, 1.0) / (1 + change.value)
    if not factors:
        return campaign
    recordings: list[Recording] = []
    for recording in campaign.recordings:
        if isinstance(recording, FrfRecording) and recording.sensor in factors:
            lines = lines_of(recording)
            values = factors[recording.sensor] * lines.values
            recordings.append(FrfRecording.of_lines(recording, lines.frequency, values, lines.coherence))
        else:
            recordings.append(recording)
    return replace(campaign, recordings=tuple(recordings))


class Fault(StrEnum):
    """Why a sensor is left out, in words that fit one or several sensors."""

    DEAD = "dead: no charge above noise"
    WEAK = "nearly dead: a small share of the others' charge"
    OTHER = "without a usable recording: see the findings"


@dataclass(frozen=True)
class Failure:
    """Consecutive campaigns that record a sensor and leave it out: the first of them, and the last before and the first
    after them that use it."""

    fault: Fault
    first: int
    before: int | None
    after: int | None


def used_recordings(result: DiagnosisResult) -> frozenset[str]:
    """Ids of the recordings that a diagnosis used."""
    used = () if result.problem is None else result.problem.lines.campaign.recordings
    return frozenset(recording.id for recording in used)


def faults_of(campaign: Campaign, result: DiagnosisResult) -> dict[str, Fault | None]:
    """Each sensor with FRFs, and why none of these was used, or None."""
    used = used_recordings(result)
    owner = {recording.id: recording.sensor for recording in frf_recordings(campaign)}
    codes: dict[str, set[FindingCode]] = {}
    for finding in result.findings:
        codes.setdefault(str(finding.arguments.get("sensor", owner.get(finding.recording))), set()).add(finding.code)
    faults: dict[str, Fault | None] = {}
    for sensor in owner.values():
        of_sensor = codes.get(sensor, set())
        weak_or_other = Fault.WEAK if FindingCode.WEAK in of_sensor else Fault.OTHER
        faults[sensor] = Fault.DEAD if FindingCode.NO_RESPONSE in of_sensor else weak_or_other
    return faults | {sensor: None for name, sensor in owner.items() if name in used}


def failures(by_campaign: Sequence[Mapping[str, Fault | None]]) -> dict[Failure, list[str]]:
    """The sensors of each failure, those that failed between two campaigns first."""
    sensors: dict[Failure, list[str]] = {}
    for sensor in dict.fromkeys(sensor for faults in by_campaign for sensor in faults):
        recorded = {number: faults[sensor] for number, faults in enumerate(by_campaign) if sensor in faults}
        used = [number for number, fault in recorded.items() if fault is None]
        seen = set()
        for number, fault in recorded.items():
            before = max((other for other in used if other < number), default=None)
            after = min((other for other in used if other > number), default=None)
            if fault is not None and (before, after) not in seen:
                seen.add((before, after))
                sensors.setdefault(Failure(fault, number, before, after), []).append(sensor)
    return dict(sorted(sensors.items(), key=lambda item: (item[0].before is None, item[0].first)))
