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
    recordings: Sequence[FrfRecording],
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
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in skin.sensors}
    contacts = tuple(
        recording.without_measurements(
            frequency_hz=np.ones(1),
            sensor=sensor,
            position_mm=_moved(recording.position_mm or positions[recording.sensor], displacement),
        )
        for displacement in displacement_mm
        for recording, sensor in zip(recordings, sensors, strict=True)
    )
    model = compose((), Conditions("contacts", skin, contacts), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    shape = len(displacement_mm), len(recordings)
    slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes))
    return DisplacedResponse(*(np.nan_to_num(part).reshape(shape) for part in (np.abs(prediction.value), slope)))


def _moved(position: tuple[float, float], displacement: Floats) -> tuple[float, float]:
    return position[0] + float(displacement[0]), position[1] + float(displacement[1])


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
        self,
        skin: SkinDescription,
        recordings: Sequence[FrfRecording],
        level: Floats,
        largest: float,
        table: SigmaTable,
    ) -> None:
        """Work out the evidence as given; `level` (recordings,) over the usual one at the `largest` S [C/N]."""
        self._skin, self._recordings, self._table = skin, recordings, table
        angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        around = np.column_stack([np.cos(angles), np.sin(angles)])
        self._miss_mm = np.concatenate([np.zeros((1, 2)), *(distance * around for distance in _DISTANCES_MM)])
        labelled = self._response(recordings, [recording.sensor for recording in recordings])
        self._largest, self._level, self._labelled = largest, level, labelled
        self._total = np.stack(
            [self._density(labelled, self._level, at).sum(axis=-1) for at in range(len(self._miss_mm))]
        )
        self._total += self._prior[:, None]

    def exchange(self, indices: Indices, others: Sequence[str]) -> Start:
        """The most probable start of an exchange; `own` are the sensors' recordings in time, `others` the sensor that
        each is of."""
        turned = self._response([self._recordings[number] for number in indices], others)
        given = DisplacedResponse(self._labelled.value[:, indices], self._labelled.slope[:, indices])
        level, displacements = self._level[indices], range(len(self._miss_mm))
        change = np.stack([self._density(turned, level, at) - self._density(given, level, at) for at in displacements])
        since = np.cumsum(change[..., ::-1], axis=-1)[..., ::-1]
        evidence = logsumexp(self._total[..., None] + since, axis=(0, 1))
        prior = np.full(len(indices), -log(2 * max(len(indices) - 1, 1)))
        prior[0] = -log(2)
        weighed = evidence - logsumexp(self._total) + prior
        first = int(np.argmax(weighed))
        sensor = np.array([self._recordings[number].sensor for number in indices[first:]])
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

    def _response(self, recordings: Sequence[FrfRecording], sensors: Sequence[str]) -> DisplacedResponse:
        return displaced_response(self._skin, recordings, sensors, self._miss_mm, self._table)

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
_GAIN_OF_EACH = log(4)  # of ln evidence, by each sensor's own recordings
_FEWEST = 4  # recordings, for one of them to contradict the others
_FAR_OFF = 30.0  # times the usual response


@dataclass(frozen=True)
class _Exchange:
    """Of each sensor the one whose place it answers at, their recordings since the exchange and before, by how much ln
    evidence gains on its cost, and by how much by each sensor."""

    true_sensor: Mapping[str, str]
    since: list[int]
    before: list[int]
    gain: float
    least: float


def without_exchanges(
    campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings of exchanged sensors with the right sensor, or left out where none is right; the findings."""
    if len(campaign.skin.sensors) < 2 or len(recordings) < _FEWEST:
        return list(recordings), []
    level = np.array([flat_level(recording) for recording in recordings])
    labels, near = (
        [recording.sensor for recording in recordings],
        [_nearest(campaign, recording) for recording in recordings],
    )
    shape, pressed = (
        displaced_response(campaign.skin, recordings, names, np.zeros((1, 2)), table).value[0]
        for names in (labels, near)
    )
    silent, _ = no_response(aligned_lines(recordings))
    largest = float(max(shape.max(), pressed.max()))
    usual = _usual(level, np.where(silent, 0.0, np.maximum(shape, pressed)))
    if usual is None:
        return list(recordings), []
    unasked = level - usual * shape > _ANSWERS * np.maximum(level, _LEAST_SHAPE * usual * largest)
    if not unasked.any():
        return list(recordings), []
    tells = np.flatnonzero(~silent & (level > _WEAK * usual * shape))
    informative = [recordings[number] for number in tells.tolist()]
    evidence = ExchangeEvidence(campaign.skin, informative, level[tells] / (usual * largest), largest, table)
    links = _links(campaign, [recording for recording, odd in zip(informative, unasked[tells], strict=True) if odd])
    right, findings = list[FrfRecording | None](recordings), list[Finding]()
    mute = set(labels) - {recording.sensor for recording in informative}
    exchanges, contradicting = _explained(informative, links, evidence, mute)
    for exchange in exchanges:
        findings.append(_finding(exchange, informative))
        for number in exchange.since:
            right[tells[number]] = _relabelled(campaign, informative[number], exchange.true_sensor)
    if contradicting:
        findings.append(_contradiction([informative[number] for number in contradicting]))
        for number in contradicting:
            right[tells[number]] = None
    return [recording for recording in right if recording is not None], findings


def _explained(
    recordings: Sequence[FrfRecording], links: Sequence[tuple[str, str]], evidence: ExchangeEvidence, mute: set[str]
) -> tuple[list[_Exchange], list[int]]:
    """The exchanges by which every sensor gains, each sensor in one of them at most and none of the `mute`, whose
    recordings tell nothing; and the recordings of other sensors that gain alone."""
    moves = _weighed(recordings, [{name: sensor} for name, sensor in links], evidence)
    best = {name: sensor for move in reversed(moves) for name, sensor in move.true_sensor.items()}
    chosen, settled = list[_Exchange](), set(mute)
    for exchange in _weighed(recordings, _permutations(links, best), evidence):
        consistent = all(best.get(name, sensor) == sensor for name, sensor in exchange.true_sensor.items())
        if consistent and exchange.least > _GAIN_OF_EACH and not settled & set(exchange.true_sensor):
            chosen.append(exchange)
            settled |= set(exchange.true_sensor)
    return chosen, sorted({number for move in moves if not settled & set(move.true_sensor) for number in move.since})


def _weighed(
    recordings: Sequence[FrfRecording], tried: Sequence[Mapping[str, str]], evidence: ExchangeEvidence
) -> list[_Exchange]:
    """The plain ones of those tried, the plainest first."""
    order = recording_order(recordings)
    exchanges = []
    for true_sensor in tried:
        indices = sorted(
            (n for n, recording in enumerate(recordings) if recording.sensor in true_sensor), key=lambda n: order[n]
        )
        start = evidence.exchange(np.array(indices), [true_sensor[recordings[number].sensor] for number in indices])
        gain = start.gain - log(len(tried))
        if gain > _GAIN:
            exchanges.append(_Exchange(true_sensor, indices[start.first :], indices[: start.first], gain, start.least))
    return sorted(exchanges, key=lambda exchange: -exchange.gain)


def _links(campaign: Campaign, unasked: Sequence[FrfRecording]) -> list[tuple[str, str]]:
    """The sensors of these recordings, each with the sensor that is nearest to where it was pressed."""
    links = {(recording.sensor, _nearest(campaign, recording)) for recording in unasked}
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


def _nearest(campaign: Campaign, recording: FrfRecording) -> str:
    """The sensor that is nearest to where a recording was pressed."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    pressed = recording.position_mm or positions[recording.sensor]
    return min(positions, key=lambda name: dist(positions[name], pressed))


def _finding(exchange: _Exchange, recordings: Sequence[FrfRecording]) -> Finding:
    since = recordings[exchange.since[0]].id if exchange.before else None
    names = sorted(exchange.true_sensor)
    if len(names) > 2:
        targets = [exchange.true_sensor[name] for name in names]
        arguments = {"sensors": names, "places": targets, "since": since, "recordings": len(exchange.since)}
        return Finding(Reason.LABELS_PERMUTED, "", "sensor", arguments)
    first, second = names
    if since is None:
        return Finding(Reason.LABELS_EXCHANGED, "", "sensor", {"first": first, "second": second})
    arguments = {"first": first, "second": second, "since": since, "recordings": len(exchange.since)}
    return Finding(Reason.CABLES_EXCHANGED, "", "sensor", arguments)


def _contradiction(recordings: Sequence[FrfRecording]) -> Finding:
    arguments = {"sensors": sorted({recording.sensor for recording in recordings}), "recordings": len(recordings)}
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


def _relabelled(campaign: Campaign, recording: FrfRecording, true_sensor: Mapping[str, str]) -> FrfRecording:
    """The recording as one of the right sensor, the contact where it was."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return replace(
        recording,
        sensor=true_sensor[recording.sensor],
        position_mm=recording.position_mm or positions[recording.sensor],
    )
