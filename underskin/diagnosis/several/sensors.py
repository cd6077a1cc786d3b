"""The sensors of an array in several campaigns: the campaigns' dates, each sensor's d33 with the mechanisms of the
diagnosis, and what changed.

- `CampaignDates`: when campaigns were recorded, and their names in reports.
- `d33_changes`: changes of the array and of single sensors.
- `mark_exchanges`: two sensors of which each has the d33 of the other from one campaign on had their labels exchanged.
  Compared are an exchange, which fixes both changes, and two changes of this size by chance.
- `causes`: what could have changed d33 of all sensors. The same factor on all sensors does not tell its cause: d33
  itself, or a mechanism that in this design acts as one factor, such as a glue line that slips by the same share under
  every sphere.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime
from itertools import combinations
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.inference.residuals import with_hidden_mechanism
from underskin.diagnosis.reporting.numbers import parameter_index, rounded
from underskin.diagnosis.several.course import Candidate, SetHistory, Shared, same_strength
from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.array_course import FEWEST_DATES, FEWEST_SENSORS, ArrayLevels, array_levels
from underskin.inversion.array_course import changes as changes_between_ends
from underskin.inversion.invert import Inversion, invert
from underskin.prediction.adopted_model import AdoptedModel
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.readers.calendar_times import time_zone
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab


@dataclass(frozen=True)
class CampaignDates:
    """Names of campaigns in their order, with the dates of their first recordings, None where there is no time."""

    names: Sequence[str]
    dates: Sequence[str | None]

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
        days = [date.fromisoformat(date_text).toordinal() for date_text in self.dates if date_text is not None]
        ordered = self.ordered and days == sorted(days) and len(set(days)) == len(days)
        return np.array(days if ordered else range(len(self.dates)), dtype=float)

    def days(self, first: int, last: int) -> int | None:
        """Days between two campaigns; None where their order is not one of time."""
        start, end = self.dates[first], self.dates[last]
        if start is None or end is None or not self.ordered:
            return None
        return (date.fromisoformat(end) - date.fromisoformat(start)).days

    def called(self, number: int) -> str:
        """A campaign's date where that is unique, else its name: "campaign B (no date)"."""
        date_text = self.dates[number]
        if date_text is not None and self.ordered and self.dates.count(date_text) == 1:
            return date_text
        return f"campaign {self.names[number]} ({date_text or 'no date'})"

    def order_clause(self) -> str:
        """The clause that the order is not one of time; empty where it is."""
        if self.ordered:
            return ""
        listed = ", ".join(self.called(number) for number in range(len(self.names)))
        return f"not every campaign has a date, so they count in the order in which they were given: {listed}"


def in_order(campaigns: Sequence[Campaign]) -> list[Campaign]:
    """By the first time of each; in the given order where one has none."""
    times = [_first_time(campaign) for campaign in campaigns]
    known_times = [time for time in times if time is not None]
    if len(known_times) < len(times):
        return list(campaigns)
    return [campaigns[number] for number in np.argsort(known_times, kind="stable")]


def _first_time(campaign: Campaign) -> float | None:
    """Of its recordings, in seconds; None where none has a time."""
    written = [recording.recorded_at for recording in campaign.recordings if isinstance(recording, FrfRecording)]
    times = [datetime.fromisoformat(time) for time in written if time is not None]
    zone = time_zone()
    return min((time if time.tzinfo else time.replace(tzinfo=zone)).timestamp() for time in times) if times else None


def date_of(campaign: Campaign) -> str | None:
    """The date of its first recording; None where none has a time."""
    times = [
        str(recording.recorded_at)[:10] for recording in campaign.recordings if isinstance(recording, FrfRecording)
    ]
    dates = [time for time in times if time != "None"]
    return min(dates, default=None)


_STATED = 0.98  # probability of a change that is stated
_PRIOR, USUAL = 0.05, 0.2  # that d33 changes between campaigns, and the sd of such a change's logarithm
_SUSPECTED = 0.5  # the same prior of a sensor whose level differs from the others' in one of two campaigns
_LEAST, _LEAST_OF_ALL = 0.03, 0.05  # relative changes that are stated: amplifiers are calibrated to some percent


@dataclass(frozen=True, eq=False)
class SensorsOfCampaign:
    """d33 [pC/N] of the sensors (sensors,) with a usable recording, and its standard uncertainty."""

    name: str
    ids: tuple[str, ...]
    d33: Floats
    uncertainty: Floats
    low: Floats
    high: Floats

    def in_report(self) -> list[dict[str, Any]]:
        """Rows of `d33.per_sensor`."""
        return [
            {
                "campaign": self.name,
                "sensor": sensor,
                "unit": "pC/N",
                "value": rounded(float(self.d33[row])),
                "low": rounded(float(self.low[row])),
                "high": rounded(float(self.high[row])),
            }
            for row, sensor in enumerate(self.ids)
        ]


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


@dataclass(frozen=True, eq=False)
class ArrayOverDates:
    """d33 [pC/N] of the array in the campaigns (dates,) that determine it, over the sensors that they share, with its
    standard uncertainty between dates; and its change from the first to the last, as `Change` and with its interval.
    """

    numbers: tuple[int, ...]
    d33: Floats
    uncertainty: Floats
    sensors: tuple[str, ...]
    change: Change
    low: float  # relative
    high: float

    @property
    def is_significant(self) -> bool:
        """Whether its 95 % interval excludes no change."""
        return self.low * self.high > 0


Values = Mapping[str, Mapping[str, float]]  # of mechanisms' parameters


def sensors_of(
    campaign: Campaign, values: Values, table: SigmaTable, used: Collection[str]
) -> SensorsOfCampaign | None:
    """With mechanisms at these values, from the recordings `used` (ids) by the campaign's own diagnosis; without dead
    sensors. None where no recording can be inverted."""
    recordings = tuple(recording for recording in campaign.recordings if recording.id in used)
    model = AdoptedModel(campaign.skin, {name: parameters for name, parameters in values.items() if parameters}, 0.0)
    try:
        as_base, _ = model.as_base_model(replace(campaign, recordings=recordings), table)
        inversion: Inversion = invert(as_base, table)
    except InvalidInput:
        return None
    dead = {flag.sensor for flag in inversion.flags if flag.flagged_for == Reason.DEAD}
    usable = np.isfinite(inversion.sensors.value) & (inversion.sensors.value != 0)
    seen = np.array([row for row in np.flatnonzero(usable) if inversion.sensor_ids[row] not in dead], dtype=np.intp)
    value, uncertainty, low, high = (to_lab("d33_pc_per_n", part[seen]) for part in vars(inversion.sensors).values())
    return SensorsOfCampaign(
        campaign.name, tuple(inversion.sensor_ids[row] for row in seen), value, uncertainty, low, high
    )


def corrected(campaign: Campaign, changes: Sequence[Change], number: int) -> Campaign:
    """The campaign of this number with earlier steps of single sensors undone."""
    factors: dict[str, float] = {}
    for change in changes:
        if change.sensor is not None and change.is_step and change.since <= number:
            factors[change.sensor] = factors.get(change.sensor, 1.0) / (1 + change.value)
    if not factors:
        return campaign
    recordings = [
        _scaled(recording, factors[recording.sensor])
        if isinstance(recording, FrfRecording) and recording.sensor in factors
        else recording
        for recording in campaign.recordings
    ]
    return replace(campaign, recordings=tuple(recordings))


def _scaled(recording: FrfRecording, factor: float) -> FrfRecording:
    measured = lines_of(recording)
    return FrfRecording.of_lines(recording, measured.frequency, factor * measured.values, measured.coherence)


def d33_changes(
    campaigns: Sequence[SensorsOfCampaign | None],
    suspected_sensors: Sequence[frozenset[str]],
    unsure: Sequence[float],
    times: Floats,
) -> list[Change]:
    """Changes of the array and of single sensors relative to it: steps between consecutive campaigns, and over all of
    them changes too slow for a step.

    `suspected_sensors`: those whose level, in each campaign by itself, differs from the others'. `unsure`: the
    uncertainty of ln d33 of all sensors since the previous campaign by the mechanisms. `times` (campaigns,): when they
    were recorded, in any unit.
    """
    detected: list[Change] = []
    for number in range(1, len(campaigns)):
        if campaigns[number - 1] is not None and campaigns[number] is not None:
            detected += _steps(
                campaigns, number, suspected_sensors[number - 1] ^ suspected_sensors[number], unsure[number]
            )
    stepped = {change.sensor for change in detected}
    gradual = [change for change in _gradual(campaigns, unsure, times) if change.sensor not in stepped]
    return sorted([*detected, *gradual], key=lambda change: change.sensor is not None)


def array_over_dates(
    campaigns: Sequence[SensorsOfCampaign | None], unsure: Sequence[float], times: Floats
) -> ArrayOverDates | None:
    """None where fewer than two campaigns share a sensor."""
    numbers, sensors, levels = _levels(campaigns)
    has = np.flatnonzero(np.isfinite(levels.level))
    if len(has) < 2:
        return None
    known_numbers = [numbers[index] for index in has]
    end_changes = changes_between_ends(
        times[known_numbers], levels.level[None, has], levels.deviation[None, has], gain_scatters=True
    )
    value, sd, low, high = (
        float(part[0]) for part in (end_changes.value, end_changes.deviation, end_changes.low, end_changes.high)
    )
    wider = float(np.hypot(sd, _unsure_between(unsure, known_numbers[0], known_numbers[-1]))) / sd
    d33 = np.exp(levels.level[has])
    change = Change(
        None,
        known_numbers[0],
        known_numbers[-1],
        float(np.expm1(value)),
        wider * sd,
        _probability(value, wider * sd, _PRIOR),
    )
    ends = (float(np.expm1(value + wider * (end - value))) for end in (low, high))
    pooled = tuple(name for name, counts in zip(sensors, levels.pooled, strict=True) if counts)
    return ArrayOverDates(tuple(known_numbers), d33, d33 * levels.deviation[has], pooled, change, *ends)


def _levels(campaigns: Sequence[SensorsOfCampaign | None]) -> tuple[list[int], list[str], ArrayLevels]:
    """The numbers of campaigns that determine d33, the sensors of any of them, and their levels (sensors, dates)."""
    campaigns_with_d33 = {
        number: sensors_of_campaign
        for number, sensors_of_campaign in enumerate(campaigns)
        if sensors_of_campaign is not None
    }
    sensors = list(
        dict.fromkeys(
            sensor for sensors_of_campaign in campaigns_with_d33.values() for sensor in sensors_of_campaign.ids
        )
    )
    value, deviation = np.full((2, len(sensors), len(campaigns_with_d33)), np.nan)
    for number, sensors_of_campaign in enumerate(campaigns_with_d33.values()):
        rows = [sensors.index(sensor) for sensor in sensors_of_campaign.ids]
        value[rows, number] = np.log(np.abs(sensors_of_campaign.d33))
        deviation[rows, number] = sensors_of_campaign.uncertainty / np.abs(sensors_of_campaign.d33)
    return list(campaigns_with_d33), sensors, array_levels(value, deviation)


def _steps(
    campaigns: Sequence[SensorsOfCampaign | None], number: int, suspected: frozenset[str], unsure: float
) -> list[Change]:
    """The changes since the previous campaign."""
    _, sensors, levels = _levels(campaigns[number - 1 : number + 1])
    detected = []
    shared = np.isfinite(levels.departure).all(axis=1)
    for row in np.flatnonzero(shared) if shared.sum() >= FEWEST_SENSORS else ():
        size = float(np.diff(levels.departure[row])[0])
        sd = float(np.hypot(*levels.departure_deviation[row]))
        prior = _SUSPECTED if sensors[row] in suspected else _PRIOR / int(shared.sum())
        detected += _stated(sensors[row], number - 1, number, size, sd, prior)
    if np.isfinite(levels.level).all():
        size, sd = float(np.diff(levels.level)[0]), float(np.hypot(*levels.deviation))
        detected += _stated(None, number - 1, number, size, float(np.hypot(sd, unsure)), _PRIOR)
    return detected


def _gradual(campaigns: Sequence[SensorsOfCampaign | None], unsure: Sequence[float], times: Floats) -> list[Change]:
    """The changes between the first and the last of at least three campaigns, of the array and of each sensor."""
    numbers, sensors, levels = _levels(campaigns)
    over = array_over_dates(campaigns, unsure, times)
    if over is None or len(over.numbers) < FEWEST_DATES:
        return []
    detected = []
    if over.change.probability > _STATED and abs(over.change.value) > _LEAST_OF_ALL:
        detected.append(over.change)
    end_changes = changes_between_ends(
        times[numbers], levels.departure, levels.departure_deviation, gain_scatters=False
    )
    dates = np.isfinite(levels.departure).sum(axis=1)
    for row in np.flatnonzero(dates >= FEWEST_DATES) if len(sensors) >= FEWEST_SENSORS else ():
        where = np.flatnonzero(np.isfinite(levels.departure[row]))
        first, last = (numbers[where[end]] for end in (0, -1))
        size, sd = float(end_changes.value[row]), float(end_changes.deviation[row])
        detected += _stated(sensors[row], first, last, size, sd, _PRIOR / len(sensors))
    return detected


def _stated(sensor: str | None, before: int, until: int, size: float, sd: float, prior: float) -> list[Change]:
    """A change of ln d33, if it is probable and large enough to be stated."""
    probability = _probability(size, sd, prior)
    least = _LEAST_OF_ALL if sensor is None else _LEAST
    if probability <= _STATED or abs(size) <= least:
        return []
    return [Change(sensor, before, until, float(np.expm1(size)), sd, probability)]


def _unsure_between(unsure: Sequence[float], first: int, last: int) -> float:
    return float(np.linalg.norm(unsure[first + 1 : last + 1]))


def _probability(change: float, deviation: float, prior: float) -> float:
    """The probability that d33 changed; usual changes are about 20 %."""
    both = (deviation**2 + USUAL**2, deviation**2)
    changed, same = (-0.5 * (change**2 / variance + np.log(variance)) for variance in both)
    return float(1 / (1 + (1 - prior) / prior * np.exp(np.clip(same - changed, -700, 700))))


def per_sensor(campaigns: Sequence[SensorsOfCampaign | None]) -> list[dict[str, Any]]:
    """Rows of all campaigns."""
    return [
        row
        for sensors_of_campaign in campaigns
        if sensors_of_campaign is not None
        for row in sensors_of_campaign.in_report()
    ]


_LEAST_ODDS = float(np.log(0.98 / 0.02))  # of an exchange that is stated, over two changes
_LOG_PRIOR = float(np.log(0.2))  # of an exchange, where two sensors have changed at once, over two changes


def mark_exchanges(detected: Sequence[Change], campaigns: Sequence[SensorsOfCampaign | None]) -> list[Change]:
    """The changes; two of single sensors are marked as an exchange where that is far more probable."""
    changes = list(detected)
    single = [index for index, change in enumerate(changes) if change.sensor is not None and change.is_step]
    odds = {
        (first, second): _log_odds(changes[first], changes[second], campaigns)
        for first, second in combinations(single, 2)
        if changes[first].since == changes[second].since
    }
    for first, second in sorted(odds, key=lambda pair: -odds[pair]):
        free = changes[first].exchanged_with is None and changes[second].exchanged_with is None
        if free and odds[first, second] > _LEAST_ODDS:
            changes[first], changes[second] = (
                replace(changes[index], exchanged_with=changes[partner].sensor)
                for index, partner in ((first, second), (second, first))
            )
    return changes


def _log_odds(first: Change, second: Change, campaigns: Sequence[SensorsOfCampaign | None]) -> float:
    """Of an exchange over two changes of usual size; both changes are relative to that of all sensors."""
    before = campaigns[first.since - 1]
    assert before is not None
    first_d33, second_d33 = (float(before.d33[before.ids.index(str(change.sensor))]) for change in (first, second))
    log_ratio = float(np.log(np.abs(second_d33 / first_d33)))
    log_odds = _LOG_PRIOR
    for change, expected in ((first, log_ratio), (second, -log_ratio)):
        size, sd = float(np.log1p(change.value)), change.uncertainty
        by_chance = -0.5 * (size**2 / (sd**2 + USUAL**2) + np.log(sd**2 + USUAL**2))
        log_odds += -0.5 * (((size - expected) / sd) ** 2 + np.log(sd**2)) - by_chance
    return log_odds


def changed_once(changes: Sequence[Change]) -> Iterator[Change]:
    """The changes, exchanges first, each of these by one of its two sensors."""
    exchanges = [change for change in changes if change.exchanged_with is not None]
    yield from (change for change in exchanges if str(change.sensor) < str(change.exchanged_with))
    yield from (change for change in changes if change.exchanged_with is None)


def findings(changes: Sequence[Change], dated: CampaignDates) -> list[Finding]:
    """One finding for each exchange."""
    return [
        Finding(
            Reason.LEVELS_EXCHANGED,
            "",
            "sensor",
            {"since": dated.called(change.since), "first": change.sensor, "second": change.exchanged_with},
        )
        for change in changed_once(changes)
        if change.exchanged_with is not None
    ]


AGEING = "ageing"
_LIKELY = 0.1  # of the weight of the most probable cause: least weight of a listed one
_SPACING = 0.03  # of ln d33: about the distance of nodes over a mechanism's prior


def unsure_of_changes(candidates: Sequence[Candidate], leader: SetHistory) -> list[float]:
    """Of each campaign the uncertainty of ln d33 since the previous one by the mechanisms' strengths; a mechanism with
    the same strength in both cancels. 0 for the first."""
    deviations = [0.0]
    for number in range(1, len(candidates)):
        before, after = (_moving(candidates[index], leader.sets[index]) for index in (number - 1, number))
        shared = [name for name in before.names if name in after.names and _stays(before, after, name)]
        of_both = (_added(candidates[number - 1], before, shared), _added(candidates[number], after, shared))
        deviations.append(float(np.hypot(*of_both)))
    return deviations


def causes(candidate: Candidate, names: Sequence[str], change: Change) -> tuple[str, ...]:
    """The mechanisms that, added to a campaign's own `names`, would change d33 of all sensors so: ageing, which is d33
    itself and only decreases it, then the most probable first."""
    explanation = _moving(candidate, names)
    before = float(explanation.point.fit[parameter_index(explanation, "d33")] - np.log1p(change.value))
    weights = {AGEING: float(_normal(np.log1p([change.value]), USUAL)[0])} if change.value < 0 else {}
    width = float(np.hypot(change.uncertainty, _SPACING))
    for name in candidate.problem.lines.mechanisms.named:
        mixture = (
            None if name in {*names, AGEING} else with_hidden_mechanism(candidate.problem, explanation, name, "d33")
        )
        if mixture is not None:
            weights[name] = float(mixture.share @ _normal(mixture.mean - before, width))
    most = max(weights.values(), default=0.0)
    likely = {name: weight for name, weight in weights.items() if weight > _LIKELY * most}
    return tuple(sorted(likely, key=lambda name: (name != AGEING, -likely[name])))


def _moving(candidate: Candidate, names: Sequence[str]) -> Explanation:
    """The explanation of the mechanisms of a set that move predictions: the spread of the sensors does not change a
    sensor's d33."""
    mechanisms = candidate.problem.lines.mechanisms
    explanation = candidate.explained(frozenset(name for name in names if mechanisms[name].moves_predictions))
    assert explanation is not None
    return explanation


def _stays(before: Explanation, after: Explanation, name: str) -> bool:
    return same_strength(*(Shared.of(fit, [name], skin=False) for fit in (before, after)))


def _added(candidate: Candidate, fit: Explanation, shared: Sequence[str]) -> float:
    """Standard deviation of ln d33 beyond the base model's, with the parameters of `shared` mechanisms known."""
    nothing = candidate.explained(frozenset())
    assert nothing is not None
    return float(np.sqrt(max(_variance(fit, shared) - _variance(nothing, ()), 0.0)))


def _variance(fit: Explanation, shared: Sequence[str]) -> float:
    hypothesis, covariance = fit.best.hypothesis, fit.best.covariance
    places = parameter_slices(fit.names, hypothesis.lines)
    known = [place for name in shared for place in range(places[name].start, places[name].stop)]
    rows = [hypothesis.mean_indices.index(place) for place in known if place in hypothesis.mean_indices]
    d33 = hypothesis.mean_indices.index(parameter_index(fit, "d33"))
    with_known = covariance[d33, rows]
    return float(covariance[d33, d33] - with_known @ np.linalg.solve(covariance[np.ix_(rows, rows)], with_known))


def _normal(offset: Floats, deviation: float) -> Floats:
    return np.asarray(np.exp(-0.5 * np.square(offset / deviation)) / deviation)
