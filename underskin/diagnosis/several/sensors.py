"""The d33 of each sensor in each of several campaigns, the mechanisms found taken into account, and what changed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import in_words
from underskin.diagnosis.reporting.numbers import SDS_OF_95, rounded
from underskin.diagnosis.several.dates import Dated
from underskin.errors import InvalidInput
from underskin.inversion.invert import Inversion, invert
from underskin.prediction.adopted_model import AdoptedModel
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_lab

_STATED = 0.98  # probability of a change that is stated
_PRIOR, USUAL = 0.05, 0.2  # that d33 changes between campaigns, and the sd of such a change's logarithm
_SUSPECTED = 0.5  # the same prior of a sensor that one of two campaigns says stands alone
_WORTH, _MEDIAN_SQUARE = 4.0, 0.455  # sensors that the stated uncertainties are worth; of a χ² of one degree of freedom
_FEWEST_COMMON = 3  # sensors, so that one can be told from the others
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
    """A relative change of d33 from one campaign to the next: of one sensor beyond the others, or of all (None)."""

    sensor: str | None
    since: int  # number of the campaign from which on it is there
    value: float
    uncertainty: float  # of its logarithm
    probability: float
    causes: tuple[str, ...] = ()  # of a change of all: mechanisms that would make it
    exchanged_with: str | None = None  # the sensor that has since then the d33 that this one had, and this one its


Values = Mapping[str, Mapping[str, float]]  # of mechanisms' parameters


def sensors_of(campaign: Campaign, values: Values, table: SigmaTable) -> SensorsOfCampaign | None:
    """With mechanisms at these values; None where no recording can be inverted."""
    model = AdoptedModel(campaign.skin, {name: found for name, found in values.items() if found}, 0.0)
    try:
        as_base, _ = model.as_base_model(campaign, table)
        found: Inversion = invert(as_base, table)
    except InvalidInput:
        return None
    seen = np.flatnonzero(np.isfinite(found.sensors.value))
    value, uncertainty, low, high = (to_lab("d33_pc_per_n", part[seen]) for part in vars(found.sensors).values())
    ids = tuple(found.sensor_ids[row] for row in seen)
    return SensorsOfCampaign(campaign.name, ids, value, uncertainty, low, high)


def corrected(campaign: Campaign, found: Sequence[Change], number: int) -> Campaign:
    """The campaign of this number as it would be had no single sensor changed until then."""
    factors: dict[str, float] = {}
    for change in found:
        if change.sensor is not None and change.since <= number:
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
    each: Sequence[SensorsOfCampaign | None], alone: Sequence[frozenset[str]], unsure: Sequence[float]
) -> list[Change]:
    """What changed from one campaign to the next: all sensors together, and single ones beyond that; `alone` are those
    of which each campaign by itself finds that their level stands beside that of the others, and `unsure` by how much
    ln d33 of all since the campaign before is by the mechanisms taken into account."""
    found: list[Change] = []
    for number in range(1, len(each)):
        before, after = each[number - 1], each[number]
        if before is None or after is None:
            continue
        common = [sensor for sensor in before.ids if sensor in after.ids]
        if common:
            found += _between(before, after, common, number, alone[number - 1] ^ alone[number], unsure[number])
    return found


def _between(
    before: SensorsOfCampaign,
    after: SensorsOfCampaign,
    common: Sequence[str],
    number: int,
    suspected: frozenset[str],
    unsure: float,
) -> list[Change]:
    rows = np.array([(before.ids.index(sensor), after.ids.index(sensor)) for sensor in common])
    change = np.log(np.abs(after.d33[rows[:, 1]] / before.d33[rows[:, 0]]))
    deviation = np.hypot(
        before.uncertainty[rows[:, 0]] / np.abs(before.d33[rows[:, 0]]),
        after.uncertainty[rows[:, 1]] / np.abs(after.d33[rows[:, 1]]),
    )
    middle = _median(change, 1 / deviation)
    around = change - middle
    of_middle = float(1.25 / np.sqrt((deviation**-2).sum()))
    own = np.hypot(deviation, of_middle) * _as_others_scatter(around / np.hypot(deviation, of_middle))
    priors = [_SUSPECTED if sensor in suspected else _PRIOR / len(common) for sensor in common]
    beyond = np.array([_probability(x, sd, prior) for x, sd, prior in zip(around, own, priors, strict=True)])
    found = [
        Change(sensor, number, float(np.expm1(around[place])), float(own[place]), float(beyond[place]))
        for place, sensor in enumerate(common)
        if len(common) >= _FEWEST_COMMON and beyond[place] > _STATED and abs(around[place]) > _LEAST
    ]
    of_all = float(np.hypot(of_middle * _as_all_scatter(around / deviation), unsure))
    together = _probability(middle, of_all, _PRIOR)
    if together > _STATED and abs(middle) > _LEAST_OF_ALL:
        found.insert(0, Change(None, number, float(np.expm1(middle)), of_all, together))
    return found


def _median(values: Floats, weights: Floats) -> float:
    """That by weights: between values, at half of the weight."""
    order = np.argsort(values)
    below = np.cumsum(weights[order]) - weights[order] / 2
    return float(np.interp(weights.sum() / 2, below, values[order]))


def _as_others_scatter(scores: Floats) -> Floats:
    """By how much the changes of the other sensors scatter, over what their uncertainties say (sensors,): these allow
    for a gain that scatters as rigs' may, and sensors tell how much it does here."""
    squares, others = scores**2, len(scores) - 1
    if not others:
        return np.ones(1)
    # The median of the others' squares, so that a second sensor that changed tells nothing of the scatter
    typical = np.array([np.median(np.delete(squares, place)) / _MEDIAN_SQUARE for place in range(len(scores))])
    return np.sqrt((_WORTH + others * typical) / (_WORTH + others))


def _as_all_scatter(scores: Floats) -> float:
    """The same of the change that all sensors share."""
    if len(scores) < _FEWEST_COMMON:
        return 1.0
    others = len(scores) - 1
    return float(np.sqrt((_WORTH + others * np.median(scores**2) / _MEDIAN_SQUARE) / (_WORTH + others)))


def _probability(change: float, deviation: float, prior: float) -> float:
    """That it changed at all: usual changes are of some 20 %."""
    both = (deviation**2 + USUAL**2, deviation**2)
    changed, same = (-0.5 * (change**2 / variance + np.log(variance)) for variance in both)
    return float(1 / (1 + (1 - prior) / prior * np.exp(np.clip(same - changed, -700, 700))))


def per_sensor(each: Sequence[SensorsOfCampaign | None]) -> list[dict[str, Any]]:
    """Of all campaigns."""
    return [row for one in each if one is not None for row in one.in_report()]


def change_in_words(change: Change, dated: Dated) -> str:
    """A clause on d33 of one or of all sensors; of all, that a change of level tells nothing of its cause."""
    if change.exchanged_with is not None:
        both = f"sensors {change.sensor} and {change.exchanged_with}"
        return f"{both} look exchanged since {dated.called(change.since)}: each has the d33 that the other had"
    whose = "of all sensors" if change.sensor is None else f"of sensor {change.sensor}, beyond the others,"
    way = "fell" if change.value < 0 else "rose"
    before, after = (dated.called(number) for number in (change.since - 1, change.since))
    low, high = sorted(abs(100 * (change.value + end * SDS_OF_95 * change.uncertainty)) for end in (-1, 1))
    size = f"{abs(100 * change.value):.3g} % ({low:.3g} to {high:.3g})"
    causes = " or ".join([*(in_words([name]) for name in change.causes), "an amplifier's gain", "the temperature"])
    level = "" if change.sensor is not None else f", a change of level that {causes} would make"
    untold = f"{level}: these recordings do not tell which" if level else ""
    return f"d33 {whose} {way} by {size} between {before} and {after}{untold}"
