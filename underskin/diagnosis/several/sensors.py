"""The d33 of each sensor in each of several campaigns, the mechanisms found taken into account, and what changed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.reporting.numbers import rounded
from underskin.errors import InvalidInput
from underskin.findings.codes import Reason
from underskin.inversion.array_course import FEWEST_DATES, FEWEST_SENSORS, ArrayLevels, array_levels
from underskin.inversion.array_course import changes as changes_between_ends
from underskin.inversion.invert import Inversion, invert
from underskin.prediction.adopted_model import AdoptedModel
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab

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
    recordings = tuple(entry for entry in campaign.recordings if entry.id in used)
    model = AdoptedModel(campaign.skin, {name: found for name, found in values.items() if found}, 0.0)
    try:
        as_base, _ = model.as_base_model(replace(campaign, recordings=recordings), table)
        found: Inversion = invert(as_base, table)
    except InvalidInput:
        return None
    dead = {flag.sensor for flag in found.flags if flag.flagged_for == Reason.DEAD}
    told = np.isfinite(found.sensors.value) & (found.sensors.value != 0)
    seen = np.array([row for row in np.flatnonzero(told) if found.sensor_ids[row] not in dead], dtype=np.intp)
    value, uncertainty, low, high = (to_lab("d33_pc_per_n", part[seen]) for part in vars(found.sensors).values())
    return SensorsOfCampaign(campaign.name, tuple(found.sensor_ids[row] for row in seen), value, uncertainty, low, high)


def corrected(campaign: Campaign, found: Sequence[Change], number: int) -> Campaign:
    """The campaign of this number as it would be had no single sensor changed at once until then."""
    factors: dict[str, float] = {}
    for change in found:
        if change.sensor is not None and change.is_step and change.since <= number:
            factors[change.sensor] = factors.get(change.sensor, 1.0) / (1 + change.value)
    if not factors:
        return campaign
    entries = [
        _times(entry, factors[entry.sensor]) if isinstance(entry, FrfRecording) and entry.sensor in factors else entry
        for entry in campaign.recordings
    ]
    return replace(campaign, recordings=tuple(entries))


def _times(entry: FrfRecording, factor: float) -> FrfRecording:
    measured = lines_of(entry)
    return FrfRecording.of_lines(entry, measured.frequency, factor * measured.values, measured.coherence)


def changes(
    each: Sequence[SensorsOfCampaign | None],
    alone: Sequence[frozenset[str]],
    unsure: Sequence[float],
    times: Floats,
) -> list[Change]:
    """What changed: from one campaign to the next the array, and single sensors beside it; and over all of them what
    changed too slowly for that.

    `alone` are those of which each campaign by itself finds that their level stands beside that of the others, `unsure`
    by how much ln d33 of all since the campaign before is by the mechanisms taken into account, `times` (campaigns,)
    when they were recorded, in any unit.
    """
    found: list[Change] = []
    for number in range(1, len(each)):
        if each[number - 1] is not None and each[number] is not None:
            found += _steps(each, number, alone[number - 1] ^ alone[number], unsure[number])
    stepped = {change.sensor for change in found}
    gradual = [change for change in _gradual(each, unsure, times) if change.sensor not in stepped]
    return sorted([*found, *gradual], key=lambda change: change.sensor is not None)


def array_over_dates(
    each: Sequence[SensorsOfCampaign | None], unsure: Sequence[float], times: Floats
) -> ArrayOverDates | None:
    """None where fewer than two campaigns share a sensor."""
    numbers, sensors, levels = _levels(each)
    has = np.flatnonzero(np.isfinite(levels.level))
    if len(has) < 2:
        return None
    told = [numbers[place] for place in has]
    found = changes_between_ends(times[told], levels.level[None, has], levels.deviation[None, has], gain_scatters=True)
    value, sd, low, high = (float(part[0]) for part in (found.value, found.deviation, found.low, found.high))
    wider = float(np.hypot(sd, _unsure_between(unsure, told[0], told[-1]))) / sd
    d33 = np.exp(levels.level[has])
    change = Change(
        None, told[0], told[-1], float(np.expm1(value)), wider * sd, _probability(value, wider * sd, _PRIOR)
    )
    ends = (float(np.expm1(value + wider * (end - value))) for end in (low, high))
    pooled = tuple(name for name, counts in zip(sensors, levels.pooled, strict=True) if counts)
    return ArrayOverDates(tuple(told), d33, d33 * levels.deviation[has], pooled, change, *ends)


def _levels(each: Sequence[SensorsOfCampaign | None]) -> tuple[list[int], list[str], ArrayLevels]:
    """The campaigns that tell d33, by number, the sensors of any, and their levels (sensors, dates)."""
    told = {number: one for number, one in enumerate(each) if one is not None}
    sensors = list(dict.fromkeys(sensor for one in told.values() for sensor in one.ids))
    value, deviation = np.full((2, len(sensors), len(told)), np.nan)
    for date, one in enumerate(told.values()):
        rows = [sensors.index(sensor) for sensor in one.ids]
        value[rows, date] = np.log(np.abs(one.d33))
        deviation[rows, date] = one.uncertainty / np.abs(one.d33)
    return list(told), sensors, array_levels(value, deviation)


def _steps(
    each: Sequence[SensorsOfCampaign | None], number: int, suspected: frozenset[str], unsure: float
) -> list[Change]:
    """The changes since the campaign before this one."""
    _, sensors, levels = _levels(each[number - 1 : number + 1])
    found = []
    common = np.isfinite(levels.departure).all(axis=1)
    for row in np.flatnonzero(common) if common.sum() >= FEWEST_SENSORS else ():
        size = float(np.diff(levels.departure[row])[0])
        sd = float(np.hypot(*levels.departure_deviation[row]))
        prior = _SUSPECTED if sensors[row] in suspected else _PRIOR / int(common.sum())
        found += _stated(sensors[row], number - 1, number, size, sd, prior)
    if np.isfinite(levels.level).all():
        size, sd = float(np.diff(levels.level)[0]), float(np.hypot(*levels.deviation))
        found += _stated(None, number - 1, number, size, float(np.hypot(sd, unsure)), _PRIOR)
    return found


def _gradual(each: Sequence[SensorsOfCampaign | None], unsure: Sequence[float], times: Floats) -> list[Change]:
    """The changes between the first and the last of three campaigns or more, of the array and of each sensor."""
    numbers, sensors, levels = _levels(each)
    over = array_over_dates(each, unsure, times)
    if over is None or len(over.numbers) < FEWEST_DATES:
        return []
    found = []
    if over.change.probability > _STATED and abs(over.change.value) > _LEAST_OF_ALL:
        found.append(over.change)
    own = changes_between_ends(times[numbers], levels.departure, levels.departure_deviation, gain_scatters=False)
    dates = np.isfinite(levels.departure).sum(axis=1)
    for row in np.flatnonzero(dates >= FEWEST_DATES) if len(sensors) >= FEWEST_SENSORS else ():
        where = np.flatnonzero(np.isfinite(levels.departure[row]))
        first, last = (numbers[where[end]] for end in (0, -1))
        size, sd = float(own.value[row]), float(own.deviation[row])
        found += _stated(sensors[row], first, last, size, sd, _PRIOR / len(sensors))
    return found


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


def per_sensor(each: Sequence[SensorsOfCampaign | None]) -> list[dict[str, Any]]:
    """Of all campaigns."""
    return [row for one in each if one is not None for row in one.in_report()]
