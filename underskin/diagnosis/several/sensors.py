"""The sensors of an array over several campaigns of one skin: dates, d33 of each sensor with the mechanisms of the
diagnosis, what changed since when, and which sensors failed.

Changes are those of the array and those of single sensors relative to it. Two sensors of which each has the d33 of the
other from one campaign on had their labels exchanged: an exchange, which fixes both changes, is compared with two
changes of this size by chance.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime
from enum import StrEnum
from functools import cached_property
from itertools import combinations
from typing import Self

import numpy as np

from underskin.diagnosis.data.names import NAMED
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.several.histories import USUAL_CHANGE, log_normal
from underskin.errors import InvalidInput
from underskin.findings.codes import FindingCode, Reason
from underskin.inversion.array_history import FEWEST_DATES, FEWEST_SENSORS, ArrayLevels, array_levels
from underskin.inversion.array_history import changes as changes_between_ends
from underskin.inversion.invert import invert
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.prediction.adopted_model import AdoptedModel
from underskin.recordings.campaign import Campaign, FrfRecording, Recording, frf_recordings
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.readers.text import time_zone
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab

_LEAST, _LEAST_OF_ARRAY = 0.03, 0.05  # relative changes that are stated: amplifiers are calibrated to some percent
_P_CHANGE, _P_SUSPECTED = 0.05, 0.5  # that d33 changes; of a sensor whose level stands apart in one of two campaigns
_P_EXCHANGE = 0.2  # odds of an exchange, where two sensors have changed at once, over two changes


@dataclass(frozen=True)
class CampaignDates:
    """Names of campaigns in their order, with the dates of their first recordings, None where there is no time."""

    names: Sequence[str]
    dates: Sequence[str | None]

    @classmethod
    def of(cls, campaigns: Sequence[Campaign]) -> Self:
        """The dates as the recordings state them."""
        return cls([campaign.name for campaign in campaigns], [_first_date(campaign) for campaign in campaigns])

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


def _first_date(campaign: Campaign) -> str | None:
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
    zone, written = time_zone(), (recording.recorded_at for recording in frf_recordings(campaign))
    times = (datetime.fromisoformat(time) for time in written if time is not None)
    return min(((time if time.tzinfo else time.replace(tzinfo=zone)).timestamp() for time in times), default=None)


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
    exchanged_with: str | None = None  # the sensor with which it exchanged its d33

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

    campaigns: Sequence[Mapping[str, Sensor]]
    times: Floats
    unsure: Sequence[float]
    suspected: Sequence[frozenset[str]]

    @cached_property
    def ids(self) -> list[str]:
        """The sensors of any campaign."""
        return list(dict.fromkeys(sensor for campaign in self.campaigns for sensor in campaign))

    @cached_property
    def changes(self) -> list[Change]:
        """Those stated of the array, then of single sensors: steps between consecutive campaigns, with exchanges
        marked, and over all of them changes too slow for a step."""
        steps = self.steps
        stepped = {change.sensor for change in steps}
        gradual = [change for change in self._gradual() if change.sensor not in stepped]
        return sorted([*self._with_exchanges(steps), *gradual], key=lambda change: change.sensor is not None)

    @cached_property
    def steps(self) -> list[Change]:
        """The changes between consecutive campaigns."""
        return [change for number in range(1, len(self.campaigns)) for change in self._steps(number)]

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
        """Of some campaigns (sensors, campaigns)."""
        value, deviation = np.full((2, len(self.ids), len(self.campaigns)), np.nan)
        for number, campaign in enumerate(self.campaigns):
            for sensor, (d33, uncertainty, *_) in campaign.items():
                row = self.ids.index(sensor)
                value[row, number], deviation[row, number] = np.log(np.abs(d33)), uncertainty / np.abs(d33)
        return array_levels(value[:, numbers], deviation[:, numbers])

    def _steps(self, number: int) -> list[Change]:
        """The changes since the previous campaign."""
        levels = self._levels_of(slice(number - 1, number + 1))
        suspected = self.suspected[number - 1] ^ self.suspected[number]
        steps = []
        shared = np.flatnonzero(np.isfinite(levels.departure).all(axis=1)).tolist()
        for row in shared if len(shared) >= FEWEST_SENSORS else ():
            size, sd = float(np.diff(levels.departure[row])[0]), float(np.hypot(*levels.departure_deviation[row]))
            prior = _P_SUSPECTED if self.ids[row] in suspected else _P_CHANGE / len(shared)
            steps.append(_change(self.ids[row], number - 1, number, size, sd, prior))
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

    def _with_exchanges(self, steps: Sequence[Change]) -> list[Change]:
        """The steps; two of single sensors are marked as an exchange where that is far more probable."""
        changes = list(steps)
        odds = {
            (first, second): self._log_odds_of_exchange(changes[first], changes[second])
            for first, second in combinations(range(len(changes)), 2)
            if None not in (changes[first].sensor, changes[second].sensor)
            and changes[first].since == changes[second].since
        }
        for first, second in sorted(odds, key=lambda pair: -odds[pair]):
            free = changes[first].exchanged_with is None and changes[second].exchanged_with is None
            if free and odds[first, second] > np.log((1 - NAMED) / NAMED):
                changes[first], changes[second] = (
                    replace(changes[first], exchanged_with=changes[second].sensor),
                    replace(changes[second], exchanged_with=changes[first].sensor),
                )
        return changes

    def _log_odds_of_exchange(self, first: Change, second: Change) -> float:
        """Over two changes of usual size; both changes are relative to that of all sensors."""
        before = self.campaigns[first.before]
        log_ratio = float(np.log(np.abs(before[str(second.sensor)][0] / before[str(first.sensor)][0])))
        log_odds = float(np.log(_P_EXCHANGE))
        for change, expected in ((first, log_ratio), (second, -log_ratio)):
            size, sd = float(np.log1p(change.value)), change.uncertainty
            log_odds += float(log_normal(size - expected, sd**2) - log_normal(size, sd**2 + USUAL_CHANGE**2))
        return log_odds


def _change(sensor: str | None, before: int, until: int, size: float, sd: float, prior: float) -> Change:
    """A change of ln d33, with the probability that it is one; usual changes are about 20 %."""
    unchanged = log_normal(size, sd**2) - log_normal(size, sd**2 + USUAL_CHANGE**2)
    probability = float(1 / (1 + (1 - prior) / prior * np.exp(np.clip(unchanged, -700, 700))))
    return Change(sensor, before, until, float(np.expm1(size)), sd, probability)


def _is_stated(change: Change) -> bool:
    """Whether a change is probable and large enough to be stated."""
    least = _LEAST_OF_ARRAY if change.sensor is None else _LEAST
    return change.probability > 1 - NAMED and abs(float(np.log1p(change.value))) > least


def changed_once(changes: Sequence[Change]) -> list[Change]:
    """The changes, exchanges first, each of these by one of its two sensors."""
    exchanges = [change for change in changes if change.exchanged_with is not None]
    once = [change for change in exchanges if str(change.sensor) < str(change.exchanged_with)]
    return [*once, *(change for change in changes if change.exchanged_with is None)]


def without_steps(campaign: Campaign, steps: Sequence[Change], number: int) -> Campaign:
    """The campaign of this number with earlier steps of single sensors undone."""
    factors: dict[str | None, float] = {}
    for change in steps:
        if change.sensor is not None and change.since <= number:
            factors[change.sensor] = factors.get(change.sensor, 1.0) / (1 + change.value)
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
