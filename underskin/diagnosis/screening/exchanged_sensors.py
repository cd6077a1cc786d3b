"""Two sensors that answer where the other one was pressed: labels exchanged, or cables since some recording.

With d shape_i the response expected of recording i and d shape'_i that of the other sensor to the same contact,
    m_i = |level_i − d shape_i| / u_i,  m'_i = |level_i − d shape'_i| / u_i,
    u_i = d max(shape_i, shape'_i, 0.3 max shape),
the sensors are exchanged from recording k on, in the order of time, where m is small before k, and m' but not m since.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from underskin.diagnosis.screening.levels import flat_level
from underskin.diagnosis.screening.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.unnamed.axes import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

_LEAST_SHAPE = 0.3  # of the largest: a smaller one is measured by it
_CONTRADICTS, _AGREES, _AGREED = 0.6, 0.2, 0.3  # m since and m' since, and m before, in the mean
_AGREES_ALONE = 0.1  # m' of a single recording
_FEWEST = 4  # recordings, for one of them to contradict the others
_FAR_OFF = 30.0  # times the usual response
_MOST_SENSORS = 8  # that contradict their places, among which pairs are sought


@dataclass(frozen=True)
class _Exchange:
    """Two sensors, the recordings of them since the exchange, and those of them before."""

    sensors: tuple[str, str]
    since: Indices
    before: Indices
    answered: bool  # by a sensor where the other one was pressed; else both are silent since


def without_exchanges(
    campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings of exchanged sensors with the right sensor, or left out where that one is silent; the findings."""
    if len(campaign.skin.sensors) < 2 or len(entries) < _FEWEST:
        return list(entries), []
    level = np.array([flat_level(entry) for entry in entries])
    shape = _shape(campaign, entries, table)
    if not shape.max() > 0:
        return list(entries), []
    silent, _ = no_response(entries)
    d33 = _usual(level, np.where(silent, 0.0, shape))
    if d33 is None:
        return list(entries), []
    unit = np.maximum(np.maximum(level / d33, shape), _LEAST_SHAPE * shape.max())
    contradicting = np.abs(level / d33 - shape) > _CONTRADICTS * unit
    if not contradicting.any():
        return list(entries), []
    odd = [entry for entry, wrong in zip(entries, contradicting, strict=True) if wrong]
    suspects = _suspects(entries, contradicting)
    right, findings, settled = list(entries), list[Finding](), set[str]()
    nearest = [(name, _pressed(campaign, odd, name)) for name in suspects]
    for first, second in (*combinations(suspects, 2), *nearest):
        pair = (min(first, second), max(first, second))
        if first == second or settled & set(pair):
            continue
        found = _exchange(campaign, entries, table, pair, level / d33, shape)
        if found is None:
            continue
        for number in found.since.tolist():
            right[number] = _at_place(campaign, entries[number], *pair)
        findings.append(_finding(found, entries))
        settled |= set(pair)
        if not found.answered:
            left_out = set(found.since.tolist())
            return [entry for number, entry in enumerate(right) if number not in left_out], findings
    return right, findings


def _exchange(
    campaign: Campaign,
    entries: Sequence[FrfRecording],
    table: SigmaTable,
    pair: tuple[str, str],
    level: Floats,
    shape: Floats,
) -> _Exchange | None:
    """Whether two sensors are exchanged, and since when; `level` over d (recordings,)."""
    order = recording_order(entries)
    own = np.array(sorted(np.flatnonzero([entry.sensor in pair for entry in entries]), key=lambda n: order[n]))
    other = _shape(campaign, [_at_place(campaign, entries[number], *pair) for number in own], table)
    unit = np.maximum(np.maximum(shape[own], other), _LEAST_SHAPE * shape.max())
    as_given, exchanged = np.abs(level[own] - shape[own]) / unit, np.abs(level[own] - other) / unit
    before = np.concatenate([[0.0], np.cumsum(np.minimum(as_given, 1) ** 2)])
    since = np.concatenate([[0.0], np.cumsum(np.minimum(exchanged, 1) ** 2)])
    k = int(np.argmin(before + since[-1] - since))
    late = np.arange(len(own)) >= k
    tells = late & (np.maximum(shape[own], other) > _LEAST_SHAPE * shape.max())
    agrees = _AGREES if tells.sum() > 1 else _AGREES_ALONE
    if not tells.any() or as_given[tells].mean() < _CONTRADICTS or exchanged[tells].mean() > agrees:
        return None
    if k and as_given[:k].mean() > _AGREED:
        return None
    answered = bool((level[own][late] > _LEAST_SHAPE * shape.max()).any())
    both = [{entries[number].sensor for number in part} == set(pair) for part in (own[:k], own[k:])]
    if not answered and not all(both):
        return None
    return _Exchange(pair, own[late], own[:k], answered)


def _finding(found: _Exchange, entries: Sequence[FrfRecording]) -> Finding:
    first, second = found.sensors
    if not len(found.before):
        return Finding(Reason.LABELS_EXCHANGED, "", "sensor", {"first": first, "second": second})
    since = entries[int(found.since[0])].id
    arguments = {"first": first, "second": second, "since": since, "recordings": len(found.since)}
    return Finding(Reason.CABLES_EXCHANGED, "", "sensor", {**arguments, "put_right": found.answered})


def _suspects(entries: Sequence[FrfRecording], contradicting: Mask) -> list[str]:
    """The sensors with most recordings that contradict what is expected."""
    sensors = [entry.sensor for entry, wrong in zip(entries, contradicting, strict=True) if wrong]
    return sorted(sorted(set(sensors)), key=sensors.count, reverse=True)[:_MOST_SENSORS]


def _pressed(campaign: Campaign, entries: Sequence[FrfRecording], name: str) -> str:
    """The sensor that is nearest to where most of these recordings of the one of that name were pressed."""
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    pressed = [
        min(places, key=lambda other: float(np.hypot(*np.subtract(places[other], entry.position_mm or places[name]))))
        for entry in entries
        if entry.sensor == name
    ]
    return max(sorted(set(pressed)), key=pressed.count)


def _usual(level: Floats, shape: Floats) -> float | None:
    """d: the level over the shape in recordings that are neither silent nor far from their sensor; None where one of
    them is off by far, which is a slip of units."""
    telling = shape > _LEAST_SHAPE * shape.max(initial=0.0)
    if not telling.any():
        return None
    ratio = level[telling] / shape[telling]
    if ratio.max() > _FAR_OFF * np.median(ratio):
        return None
    return float(np.median(ratio[ratio > _LEAST_SHAPE * np.quantile(ratio, 0.9)]))


def _shape(campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable) -> Floats:
    """Magnitude of the base model's prediction (recordings,)."""
    model = compose((), replace(campaign, recordings=tuple(entries)), table, "frf")
    value = model.predict(np.array([parameter.start for parameter in model.parameters])).value
    own = value[np.searchsorted(model.recording, np.arange(len(entries)))]
    return np.nan_to_num(np.abs(own.real))


def _at_place(campaign: Campaign, entry: FrfRecording, first: str, second: str) -> FrfRecording:
    """The recording as one of the other sensor, the contact where it was."""
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    place = entry.position_mm or known[entry.sensor]
    return replace(entry, sensor=second if entry.sensor == first else first, position_mm=place)
