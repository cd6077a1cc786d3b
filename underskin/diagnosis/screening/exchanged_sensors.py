"""What sensors answer to contacts that all miss their places by the same vector, by the base model.

How probable the levels of recordings are with the labels of sensors exchanged from some recording on, and without.

A recording's level is
    y_i = d S_i(e) + N(0, (s d S_i)² + (p d |∂S_i/∂place|)² + (f d max S)²),
with S_i the response of the sensor that is taken to have answered, e the vector by which all contacts miss their
places, s what sensors, scatter and unnamed physics make of a level, p the scatter of places, and f what reaches a
sensor that is pressed nowhere near (its neighbours' charge). With probability ε a level is anything up to twice the
largest. The evidence is averaged over e, d, s, p and f, and over the recordings from which on the sensors may be
exchanged: one half for all of them, the other half evenly over the later ones.

ε bounds what a wrong label costs, so that the evidence of an exchange may be that of one sensor alone, while the other
one stays as wrong as it was. Each sensor's own gain, with the others exchanged, tells.

Sensors that answer where other ones were pressed: labels exchanged, or cables since some recording.

A sensor that answers where no response is expected of it is linked to the one that is nearest to where it was pressed.
Each link is tried as an exchange of the two, and links that close a cycle of more sensors as a rotation, as by a plug
that is off by one; each is weighed against none, at the cost of ln of how many are tried. Put right is
one by which every sensor gains. Where a sensor gains by the label of another one, and none of them puts right both, its
recordings contradict their places and are left out. A recording that answers with far less than is expected may be of a
weak or dead sensor, and does not count.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import dist, log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.screening.levels import aligned_lines, flat_level
from underskin.diagnosis.screening.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.unlisted.axes import recording_order
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices


@dataclass(frozen=True, eq=False)
class DisplacedResponse:
    """|FRF| of the base model [C/N] and how steep it is [C/N/mm] (displacements, recordings)."""

    value: Floats
    slope: Floats


def displaced_response(
    skin: SkinDescription,
    entries: Sequence[FrfRecording],
    sensors: Sequence[str],
    displacement_mm: Floats,
    table: SigmaTable,
) -> DisplacedResponse:
    """The response of one sensor to each recording's contact.

    Parameters
    ----------
    skin
        The array.
    entries
        The recordings; a contact without a place is on the sensor that the recording names.
    sensors
        (recordings,) the sensor that is to answer to each.
    displacement_mm
        (displacements, 2) by how much all contacts miss their places.
    table
        The σ table.
    """
    places = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in skin.sensors}
    contacts = tuple(
        entry.without_measurements(
            frequency_hz=np.ones(1), sensor=sensor, position_mm=_moved(entry.position_mm or places[entry.sensor], by)
        )
        for by in displacement_mm
        for entry, sensor in zip(entries, sensors, strict=True)
    )
    model = compose((), Conditions("contacts", skin, contacts), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    shape = len(displacement_mm), len(entries)
    slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes))
    return DisplacedResponse(*(np.nan_to_num(part).reshape(shape) for part in (np.abs(prediction.value), slope)))


def _moved(place: tuple[float, float], by: Floats) -> tuple[float, float]:
    return place[0] + float(by[0]), place[1] + float(by[1])


_ASTRAY = 1e-5  # ε
_DISTANCES_MM, _DIRECTIONS, _MISS_MM = (0.3, 0.7, 1.2, 1.8), 8, 0.7  # of e, and its prior standard deviation
_FREE = np.array(  # d over the usual one, s, p [mm], f
    [*product(np.exp(np.linspace(-0.6, 0.6, 9)), (0.05, 0.12, 0.3), (0.05, 0.3), (0.02, 0.1))]
)


@dataclass(frozen=True)
class Start:
    """From which of the sensors' recordings on, in time, they are exchanged, and by how much ln evidence gains: by all,
    and at least by each of them with the others exchanged."""

    first: int
    gain: float
    least: float


class ExchangeEvidence:
    """The evidence of exchanges among the sensors of a campaign."""

    def __init__(
        self, skin: SkinDescription, entries: Sequence[FrfRecording], level: Floats, largest: float, table: SigmaTable
    ) -> None:
        """Work out the evidence as given; `level` (recordings,) over the usual one at the `largest` S [C/N]."""
        self._skin, self._entries, self._table = skin, entries, table
        angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        around = np.column_stack([np.cos(angles), np.sin(angles)])
        self._miss_mm = np.concatenate([np.zeros((1, 2)), *(distance * around for distance in _DISTANCES_MM)])
        own = self._response(entries, [entry.sensor for entry in entries])
        self._largest, self._level, self._own = largest, level, own
        self._total = np.stack([self._density(own, self._level, at).sum(axis=-1) for at in range(len(self._miss_mm))])
        self._total += self._prior[:, None]

    def exchange(self, own: Indices, others: Sequence[str]) -> Start:
        """The most probable start of an exchange; `own` are the sensors' recordings in time, `others` the sensor that
        each is of."""
        turned = self._response([self._entries[number] for number in own], others)
        given = DisplacedResponse(self._own.value[:, own], self._own.slope[:, own])
        level, places = self._level[own], range(len(self._miss_mm))
        change = np.stack([self._density(turned, level, at) - self._density(given, level, at) for at in places])
        since = np.cumsum(change[..., ::-1], axis=-1)[..., ::-1]
        evidence = logsumexp(self._total[..., None] + since, axis=(0, 1))
        prior = np.full(len(own), -log(2 * max(len(own) - 1, 1)))
        prior[0] = -log(2)
        weighed = evidence - logsumexp(self._total) + prior
        first = int(np.argmax(weighed))
        sensor = np.array([self._entries[number].sensor for number in own[first:]])
        without = [
            logsumexp(self._total + change[..., first:][..., sensor != name].sum(axis=-1)) for name in set(sensor)
        ]
        return Start(first, float(logsumexp(weighed)), float(evidence[first] - max(without)))

    @property
    def _prior(self) -> Floats:
        """Of e but for a constant (displacements,), which stand for areas."""
        distance = np.hypot(*self._miss_mm.T)
        area = np.maximum(distance, _DISTANCES_MM[0] / 2)
        return np.asarray(np.log(area) - distance**2 / (2 * _MISS_MM**2))

    def _response(self, entries: Sequence[FrfRecording], sensors: Sequence[str]) -> DisplacedResponse:
        return displaced_response(self._skin, entries, sensors, self._miss_mm, self._table)

    def _density(self, response: DisplacedResponse, level: Floats, at: int) -> Floats:
        """ln of that of each level under one displacement (d and noises, recordings)."""
        d, s, p, f = _FREE.T[:, :, None]
        value, slope = response.value[at] / self._largest, response.slope[at] / self._largest
        variance = d**2 * ((s * value) ** 2 + (p * slope) ** 2 + f**2)
        usual = np.exp(-0.5 * (level - d * value) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        return np.asarray(np.log((1 - _ASTRAY) * usual + 0.5 * _ASTRAY))


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
