"""Sensors that answer where other ones were pressed: labels exchanged, or cables since some recording.

A sensor that answers where no response is expected of it is linked to the one that is nearest to where it was pressed.
Each link is tried as an exchange of the two, and links that close a cycle of more sensors as a rotation, as by a plug
that is off by one; `exchange_evidence` weighs each against none, at the cost of ln of how many are tried. Put right is
one by which every sensor gains. Where a sensor gains by the label of another one, and none of them puts right both, its
recordings contradict their places and are left out. A recording that answers with far less than is expected may be of a
weak or dead sensor, and does not count.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import dist, log

import numpy as np

from underskin.diagnosis.screening.aligned_lines import aligned_lines
from underskin.diagnosis.screening.displaced_response import displaced_response
from underskin.diagnosis.screening.exchange_evidence import ExchangeEvidence
from underskin.diagnosis.screening.levels import flat_level
from underskin.diagnosis.screening.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unnamed.axes import recording_order
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_LEAST_SHAPE = 0.3  # of the largest: smaller ones are measured by it
_ANSWERS = 0.6  # of a level, or of `_LEAST_SHAPE`, that is not expected: then exchanges are sought
_WEAK = 0.3  # of the level to be expected
_GAIN = log(100)  # of ln evidence beyond ln of how many are tried
_EACH = log(4)  # of ln evidence, by each sensor's own recordings
_FEWEST = 4  # recordings, for one of them to contradict the others
_FAR_OFF = 30.0  # times the usual response


@dataclass(frozen=True)
class _Exchange:
    """Of each sensor the one whose place it answers at, their recordings since the exchange and before, by how much ln
    evidence gains on its cost, and by how much by each sensor."""

    place: Mapping[str, str]
    since: list[int]
    before: list[int]
    gain: float
    least: float


def without_exchanges(
    campaign: Campaign, entries: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings of exchanged sensors with the right sensor, or left out where none is right; the findings."""
    if len(campaign.skin.sensors) < 2 or len(entries) < _FEWEST:
        return list(entries), []
    level = np.array([flat_level(entry) for entry in entries])
    own, near = [entry.sensor for entry in entries], [_nearest(campaign, entry) for entry in entries]
    shape, pressed = (
        displaced_response(campaign.skin, entries, names, np.zeros((1, 2)), table).value[0] for names in (own, near)
    )
    silent, _ = no_response(aligned_lines(entries))
    largest = float(max(shape.max(), pressed.max()))
    usual = _usual(level, np.where(silent, 0.0, np.maximum(shape, pressed)))
    if usual is None:
        return list(entries), []
    unasked = level - usual * shape > _ANSWERS * np.maximum(level, _LEAST_SHAPE * usual * largest)
    if not unasked.any():
        return list(entries), []
    tells = np.flatnonzero(~silent & (level > _WEAK * usual * shape))
    known = [entries[number] for number in tells.tolist()]
    evidence = ExchangeEvidence(campaign.skin, known, level[tells] / (usual * largest), largest, table)
    links = _links(campaign, [entry for entry, odd in zip(known, unasked[tells], strict=True) if odd])
    right, findings = list[FrfRecording | None](entries), list[Finding]()
    mute = set(own) - {entry.sensor for entry in known}
    exchanges, contradicting = _explained(known, links, evidence, mute)
    for found in exchanges:
        findings.append(_finding(found, known))
        for number in found.since:
            right[tells[number]] = _at_place(campaign, known[number], found.place)
    if contradicting:
        findings.append(_contradiction([known[number] for number in contradicting]))
        for number in contradicting:
            right[tells[number]] = None
    return [entry for entry in right if entry is not None], findings


def _explained(
    entries: Sequence[FrfRecording], links: Sequence[tuple[str, str]], evidence: ExchangeEvidence, mute: set[str]
) -> tuple[list[_Exchange], list[int]]:
    """The exchanges by which every sensor gains, each sensor in one of them at most and none of the `mute`, whose
    recordings tell nothing; and the recordings of other sensors that gain alone."""
    moves = _weighed(entries, [{name: place} for name, place in links], evidence)
    best = {name: place for one in reversed(moves) for name, place in one.place.items()}
    chosen, settled = list[_Exchange](), set(mute)
    for one in _weighed(entries, _permutations(links, best), evidence):
        consistent = all(best.get(name, place) == place for name, place in one.place.items())
        if consistent and one.least > _EACH and not settled & set(one.place):
            chosen.append(one)
            settled |= set(one.place)
    return chosen, sorted({number for one in moves if not settled & set(one.place) for number in one.since})


def _weighed(
    entries: Sequence[FrfRecording], tried: Sequence[Mapping[str, str]], evidence: ExchangeEvidence
) -> list[_Exchange]:
    """The plain ones of those tried, the plainest first."""
    order = recording_order(entries)
    found = []
    for place in tried:
        own = sorted((n for n, entry in enumerate(entries) if entry.sensor in place), key=lambda n: order[n])
        start = evidence.exchange(np.array(own), [place[entries[number].sensor] for number in own])
        gain = start.gain - log(len(tried))
        if gain > _GAIN:
            found.append(_Exchange(place, own[start.first :], own[: start.first], gain, start.least))
    return sorted(found, key=lambda one: -one.gain)


def _links(campaign: Campaign, unasked: Sequence[FrfRecording]) -> list[tuple[str, str]]:
    """The sensors of these recordings, each with the sensor that is nearest to where it was pressed."""
    links = {(entry.sensor, _nearest(campaign, entry)) for entry in unasked}
    return sorted(link for link in links if link[0] != link[1])


def _permutations(links: Sequence[tuple[str, str]], best: Mapping[str, str]) -> list[dict[str, str]]:
    """The exchange of each link, and the cycles of three sensors or more that the `best` places make; the last sensor
    of a chain, of which no place is plain, may close it."""
    tried = [{first: second, second: first} for first, second in sorted({(min(link), max(link)) for link in links})]
    for start in sorted(best):
        cycle = [start]
        while (following := best.get(cycle[-1])) is not None and following not in cycle:
            cycle.append(following)
        if len(cycle) > 2 and (following is None or following == start == min(cycle)):
            tried.append(dict(zip(cycle, [*cycle[1:], start], strict=True)))
    return tried


def _nearest(campaign: Campaign, entry: FrfRecording) -> str:
    """The sensor that is nearest to where a recording was pressed."""
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    pressed = entry.position_mm or places[entry.sensor]
    return min(places, key=lambda name: dist(places[name], pressed))


def _finding(found: _Exchange, entries: Sequence[FrfRecording]) -> Finding:
    since = entries[found.since[0]].id if found.before else None
    names = sorted(found.place)
    if len(names) > 2:
        places = [found.place[name] for name in names]
        arguments = {"sensors": names, "places": places, "since": since, "recordings": len(found.since)}
        return Finding(Reason.LABELS_PERMUTED, "", "sensor", arguments)
    first, second = names
    if since is None:
        return Finding(Reason.LABELS_EXCHANGED, "", "sensor", {"first": first, "second": second})
    arguments = {"first": first, "second": second, "since": since, "recordings": len(found.since)}
    return Finding(Reason.CABLES_EXCHANGED, "", "sensor", arguments)


def _contradiction(entries: Sequence[FrfRecording]) -> Finding:
    arguments = {"sensors": sorted({entry.sensor for entry in entries}), "recordings": len(entries)}
    return Finding(Reason.LABELS_CONTRADICT_PLACES, "", "sensor", arguments)


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


def _at_place(campaign: Campaign, entry: FrfRecording, place: Mapping[str, str]) -> FrfRecording:
    """The recording as one of the right sensor, the contact where it was."""
    known = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return replace(entry, sensor=place[entry.sensor], position_mm=entry.position_mm or known[entry.sensor])
