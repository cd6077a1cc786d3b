"""The sensors of an array at several dates.

When campaigns were recorded, and how a report calls them by that. The d33 of each sensor in each of several campaigns,
the mechanisms found taken into account, and what changed.

Two sensors of which each has, from a campaign on, the d33 that the other one had: their labels were exchanged.

Two changes of single sensors at once, which would be this size by chance alone, against an exchange, which fixes both.

A d33 of all sensors that changed from one campaign to the next: how well that is known, and what could have done it.

The same factor on all sensors tells nothing of its cause: d33 itself, or a mechanism that in this design acts as one
factor, such as a glue line that gives way alike under every sphere.
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
from underskin.diagnosis.reporting.numbers import place_of, rounded
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
    """Names of campaigns in their order, with the dates of their first recordings, None of those without a time."""

    names: Sequence[str]
    dates: Sequence[str | None]

    @property
    def ordered(self) -> bool:
        """Whether their order is one of time: all have a date."""
        return None not in self.dates

    def since(self, number: int) -> str | None:
        """The date from which on something is there that begins with this campaign; None where the order is not one of
        time."""
        return self.dates[number] if self.ordered else None

    @property
    def times(self) -> Floats:
        """When the campaigns were recorded, in days; where not all have a date of their own, their places in the
        order."""
        days = [date.fromisoformat(date_text).toordinal() for date_text in self.dates if date_text is not None]
        ordered = self.ordered and days == sorted(days) and len(set(days)) == len(days)
        return np.array(days if ordered else range(len(self.dates)), dtype=float)

    def days(self, first: int, last: int) -> int | None:
        """Between two campaigns; None where their order is not one of time."""
        start, end = self.dates[first], self.dates[last]
        if start is None or end is None or not self.ordered:
            return None
        return (date.fromisoformat(end) - date.fromisoformat(start)).days

    def called(self, number: int) -> str:
        """A campaign by its date where that says which it is, else by its name: "campaign B (no date)"."""
        date_text = self.dates[number]
        if date_text is not None and self.ordered and self.dates.count(date_text) == 1:
            return date_text
        return f"campaign {self.names[number]} ({date_text or 'no date'})"

    def order_clause(self) -> str:
        """That the order is not one of time; empty where it is."""
        if self.ordered:
            return ""
        listed = ", ".join(self.called(number) for number in range(len(self.names)))
        return f"not every campaign has a date, so they count in the order in which they were given: {listed}"


def in_order(campaigns: Sequence[Campaign]) -> list[Campaign]:
    """By the first time of each; as they come where one has none."""
    times = [_first_time(campaign) for campaign in campaigns]
    known_times = [time for time in times if time is not None]
    if len(known_times) < len(times):
        return list(campaigns)
    return [campaigns[number] for number in np.argsort(known_times, kind="stable")]


def _first_time(campaign: Campaign) -> float | None:
    """In seconds; None where none of its recordings has a time."""
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
_SUSPECTED = 0.5  # the same prior of a sensor that one of two campaigns says stands alone
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
    """A relative change of d33 between two campaigns, `before` and `until`: of one sensor beside the array, or of the
    array (None). Of a step these follow each other; of a course they are the first and the last."""

    sensor: str | None
    before: int
    until: int
    value: float
    uncertainty: float  # of its logarithm
    probability: float
    causes: tuple[str, ...] = ()  # of a change of all: mechanisms that would make it
    exchanged_with: str | None = None  # the sensor that has since then the d33 that this one had, and this one its

    @property
    def since(self) -> int:
        """Number of the campaign from which on it is there."""
        return self.before + 1

    @property
    def is_step(self) -> bool:
        """Whether it is from one campaign to the next."""
        return self.until == self.since


@dataclass(frozen=True, eq=False)
class ArrayOverDates:
    """d33 [pC/N] of the array in those campaigns (dates,) that tell one, over the sensors that they share, with its
    standard uncertainty between dates; and its change from the first to the last, as `Change` and with its interval."""

    numbers: tuple[int, ...]
    d33: Floats
    uncertainty: Floats
    sensors: tuple[str, ...]
    change: Change
    low: float  # relative
    high: float

    @property
    def is_significant(self) -> bool:
        """Whether its 95 % interval leaves out that nothing changed."""
        return self.low * self.high > 0


Values = Mapping[str, Mapping[str, float]]  # of mechanisms' parameters


def sensors_of(
    campaign: Campaign, values: Values, table: SigmaTable, used: Collection[str]
) -> SensorsOfCampaign | None:
    """With mechanisms at these values, by the recordings `used` (ids) that its own diagnosis used; without sensors
    that are dead. None where no recording can be inverted."""
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
    """The campaign of this number as it would be had no single sensor changed at once until then."""
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
    """What changed: from one campaign to the next the array, and single sensors beside it; and over all of them what
    changed too slowly for that.

    `suspected_sensors` are those of which each campaign by itself finds that their level stands beside that of the
    others, `unsure` by how much ln d33 of all since the campaign before is by the mechanisms taken into account,
    `times` (campaigns,) when they were recorded, in any unit.
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
    """The campaigns that tell d33, by number, the sensors of any, and their levels (sensors, dates)."""
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
    """The changes since the campaign before this one."""
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
    """The changes between the first and the last of three campaigns or more, of the array and of each sensor."""
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
    """A change of ln d33 where it is to be stated."""
    probability = _probability(size, sd, prior)
    least = _LEAST_OF_ALL if sensor is None else _LEAST
    if probability <= _STATED or abs(size) <= least:
        return []
    return [Change(sensor, before, until, float(np.expm1(size)), sd, probability)]


def _unsure_between(unsure: Sequence[float], first: int, last: int) -> float:
    return float(np.linalg.norm(unsure[first + 1 : last + 1]))


def _probability(change: float, deviation: float, prior: float) -> float:
    """That it changed at all: usual changes are of some 20 %."""
    both = (deviation**2 + USUAL**2, deviation**2)
    changed, same = (-0.5 * (change**2 / variance + np.log(variance)) for variance in both)
    return float(1 / (1 + (1 - prior) / prior * np.exp(np.clip(same - changed, -700, 700))))


def per_sensor(campaigns: Sequence[SensorsOfCampaign | None]) -> list[dict[str, Any]]:
    """Of all campaigns."""
    return [
        row
        for sensors_of_campaign in campaigns
        if sensors_of_campaign is not None
        for row in sensors_of_campaign.in_report()
    ]


_LEAST_ODDS = float(np.log(0.98 / 0.02))  # of an exchange that is stated, over two changes
_LOG_PRIOR = float(np.log(0.2))  # of an exchange, where two sensors have changed at once, over two changes


def mark_exchanges(detected: Sequence[Change], campaigns: Sequence[SensorsOfCampaign | None]) -> list[Change]:
    """The changes, two of single sensors marked as an exchange where that is far more probable."""
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
    """Of an exchange over two changes of usual size; both changes are beyond that of all sensors."""
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
    """One of each exchange."""
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
_LIKELY = 0.1  # of the weight of the most probable cause, from which on another one is listed
_SPACING = 0.03  # of ln d33: places over a mechanism's prior lie about as far apart


def unsure_of_changes(candidates: Sequence[Candidate], leader: SetHistory) -> list[float]:
    """Of each campaign by how much ln d33 since the one before is unsure by the mechanisms' strengths; a mechanism that
    is in both with one strength moves both alike. 0 of the first."""
    deviations = [0.0]
    for number in range(1, len(candidates)):
        before, after = (_moving(candidates[index], leader.sets[index]) for index in (number - 1, number))
        shared = [name for name in before.names if name in after.names and _stays(before, after, name)]
        of_both = (_added(candidates[number - 1], before, shared), _added(candidates[number], after, shared))
        deviations.append(float(np.hypot(*of_both)))
    return deviations


def causes(candidate: Candidate, names: Sequence[str], change: Change) -> tuple[str, ...]:
    """The mechanisms that, appearing beside a campaign's own `names`, would change d33 of all sensors so: ageing, which
    is d33 itself and only falls, then the most probable first."""
    explanation = _moving(candidate, names)
    before = float(explanation.point.fit[place_of(explanation, "d33")] - np.log1p(change.value))
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
    """Of a set that part which moves predictions: a spread of the sensors does not change what one of them has."""
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
    slices = parameter_slices(fit.names, hypothesis.lines)
    indices = [index for name in shared for index in range(slices[name].start, slices[name].stop)]
    rows = [hypothesis.mean_indices.index(index) for index in indices if index in hypothesis.mean_indices]
    d33 = hypothesis.mean_indices.index(place_of(fit, "d33"))
    cross_covariance = covariance[d33, rows]
    return float(
        covariance[d33, d33] - cross_covariance @ np.linalg.solve(covariance[np.ix_(rows, rows)], cross_covariance)
    )


def _normal(offset: Floats, deviation: float) -> Floats:
    return np.asarray(np.exp(-0.5 * np.square(offset / deviation)) / deviation)
