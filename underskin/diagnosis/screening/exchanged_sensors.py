"""Two sensors that answer where the other one was pressed: labels exchanged, or cables since some recording.

A sensor that answers where no response is expected of it makes a pair with the one that is nearest to where it was
pressed. Of each pair, `exchange_evidence` weighs an exchange against none; it costs ln of how many pairs there are. A
recording that answers with far less than is expected may be of a weak or dead sensor, and does not count. Two sensors
that fall silent together while others answer have their cables exchanged as well: each was recorded while the other one
was pressed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist, log

import numpy as np

from underskin.diagnosis.screening.displaced_response import displaced_response
from underskin.diagnosis.screening.exchange_evidence import ExchangeEvidence
from underskin.diagnosis.screening.levels import flat_level
from underskin.diagnosis.screening.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unnamed.axes import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Mask

_LEAST_SHAPE = 0.3  # of the largest: smaller ones are measured by it
_ANSWERS = 0.6  # of a level, or of `_LEAST_SHAPE`, that is not expected: then exchanges are sought
_WEAK = 0.3  # of the level to be expected
_GAIN = log(100)  # of ln evidence beyond ln of how many pairs there are
_FEWEST = 4  # recordings, for one of them to contradict the others
_FAR_OFF = 30.0  # times the usual response


@dataclass(frozen=True)
class _Exchange:
    """Two sensors, the recordings of them since the exchange and before, and by how much ln evidence gains on its
    cost."""

    sensors: tuple[str, str]
    since: list[int]
    before: list[int]
    gain: float


def without_exchanges(
    campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings of exchanged sensors with the right sensor, or left out where that one is silent; the findings."""
    if len(campaign.skin.sensors) < 2 or len(entries) < _FEWEST:
        return list(entries), []
    level = np.array([flat_level(entry) for entry in entries])
    own, near = [entry.sensor for entry in entries], [_nearest(campaign, entry) for entry in entries]
    shape, pressed = (
        displaced_response(campaign.skin, entries, names, np.zeros((1, 2)), table).value[0] for names in (own, near)
    )
    silent, _ = no_response(entries)
    largest = float(max(shape.max(), pressed.max()))
    usual = _usual(level, np.where(silent, 0.0, np.maximum(shape, pressed)))
    if usual is None:
        return list(entries), []
    unasked = level - usual * shape > _ANSWERS * np.maximum(level, _LEAST_SHAPE * usual * largest)
    right, findings = list(entries), list[Finding]()
    if unasked.any():
        tells = np.flatnonzero(~silent & (level > _WEAK * usual * shape))
        known = [entries[number] for number in tells.tolist()]
        evidence = ExchangeEvidence(campaign.skin, known, level[tells] / (usual * largest), largest, table)
        for found in _exchanges(campaign, known, unasked[tells], evidence):
            findings.append(_finding(found, known, put_right=True))
            for number in found.since:
                right[tells[number]] = _at_place(campaign, known[number], *found.sensors)
    unheard = _falling_silent(entries, silent)
    if unheard is None:
        return right, findings
    left = [entry for number, entry in enumerate(right) if number not in unheard.since]
    return left, [*findings, _finding(unheard, entries, put_right=False)]


def _exchanges(
    campaign: Campaign, entries: Sequence[FrfRecording], unasked: Mask, evidence: ExchangeEvidence
) -> list[_Exchange]:
    """The plainest exchanges, each sensor in one of them at most."""
    order = recording_order(entries)
    pairs = _pairs(campaign, [entry for entry, odd in zip(entries, unasked, strict=True) if odd])
    found = []
    for pair in pairs:
        own = sorted((n for n, entry in enumerate(entries) if entry.sensor in pair), key=lambda n: order[n])
        others = [pair[1] if entries[number].sensor == pair[0] else pair[0] for number in own]
        start = evidence.exchange(np.array(own), others)
        gain = start.gain - log(len(pairs))
        if gain > _GAIN:
            found.append(_Exchange(pair, own[start.first :], own[: start.first], gain))
    chosen, settled = list[_Exchange](), set[str]()
    for one in sorted(found, key=lambda one: -one.gain):
        if not settled & set(one.sensors):
            chosen.append(one)
            settled |= set(one.sensors)
    return chosen


def _pairs(campaign: Campaign, unasked: Sequence[FrfRecording]) -> list[tuple[str, str]]:
    """The sensors of these recordings, each with the sensor that is nearest to where it was pressed."""
    pairs = {(entry.sensor, _nearest(campaign, entry)) for entry in unasked}
    return sorted({(min(pair), max(pair)) for pair in pairs if pair[0] != pair[1]})


def _nearest(campaign: Campaign, entry: FrfRecording) -> str:
    """The sensor that is nearest to where a recording was pressed."""
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    pressed = entry.position_mm or places[entry.sensor]
    return min(places, key=lambda name: dist(places[name], pressed))


def _falling_silent(entries: Sequence[FrfRecording], silent: Mask) -> _Exchange | None:
    """The two sensors that answer until some recording and never since, where others do; None where not two do so."""
    order = np.argsort(recording_order(entries), kind="stable").tolist()
    falling = dict[str, list[int]]()
    for name in {entry.sensor for entry in entries}:
        own = [number for number in order if entries[number].sensor == name]
        answers = [bool(~silent[number]) for number in own]
        if answers[0] and not answers[-1] and answers == sorted(answers, reverse=True):
            falling[name] = own
    if len(falling) != 2:
        return None
    first, second = sorted(falling)
    own = [number for number in order if entries[number].sensor in falling]
    before = [number for number in own if not silent[number]]
    since = own[len(before) :]
    others = [number for number in order[order.index(since[0]) :] if number not in own]
    if silent[since].all() and others and not silent[others].any():
        return _Exchange((first, second), since, before, np.inf)
    return None


def _finding(found: _Exchange, entries: Sequence[FrfRecording], *, put_right: bool) -> Finding:
    first, second = found.sensors
    if not found.before:
        return Finding(Reason.LABELS_EXCHANGED, "", "sensor", {"first": first, "second": second})
    since = entries[found.since[0]].id
    arguments = {"first": first, "second": second, "since": since, "recordings": len(found.since)}
    return Finding(Reason.CABLES_EXCHANGED, "", "sensor", {**arguments, "put_right": put_right})


def _usual(level: Floats, shape: Floats) -> float | None:
    """The level over the shape in recordings that are neither silent nor far from any sensor; None where one of them
    is off by far, which is a slip of units."""
    telling = shape > _LEAST_SHAPE * shape.max(initial=0.0)
    if not telling.any():
        return None
    ratio = level[telling] / shape[telling]
    if ratio.max() > _FAR_OFF * np.median(ratio):
        return None
    return float(np.median(ratio[ratio > _LEAST_SHAPE * np.quantile(ratio, 0.9)]))


def _at_place(campaign: Campaign, entry: FrfRecording, first: str, second: str) -> FrfRecording:
    """The recording as one of the other sensor, the contact where it was."""
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    place = entry.position_mm or known[entry.sensor]
    return replace(entry, sensor=second if entry.sensor == first else first, position_mm=place)
