"""Sensors that respond where other sensors were pressed: labels exchanged, or cables since some recording.

A sensor that responds where no response is expected is linked to the sensor nearest to the contact. Each link is tried
as an exchange of the two, and links that close a cycle as a rotation, as by a plug that is off by one; each is weighed
against no exchange, at the cost of ln of the number tried. An exchange is undone where every sensor gains by it. Where
a sensor gains by another's label and no exchange fits both, its recordings contradict their positions and are left out.
A recording that is far weaker than expected may be of a weak or dead sensor, and does not count.

The evidence: the level of a recording is
    y_i = d S_i(e) + N(0, (s d S_i)² + (p d |∂S_i/∂position|)² + (f d max S)²),
S_i being the response of the sensor that is assumed to have answered, e the common position error of all contacts,
s the relative scatter of levels (sensors, recordings, unlisted physics), p the scatter of positions, and f what reaches
a distant sensor (its neighbours' charge). With probability ε a level is anything up to twice the largest. The evidence
is averaged over e, d, s, p, f and the recording from which on the sensors are exchanged: one half of the prior for all
recordings, the other half evenly over the later ones. ε bounds the cost of a wrong label, so that an exchange may gain
by one sensor while the other stays as wrong as before; the gain of each sensor, the others being exchanged, shows this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import dist, log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.slips.levels import aligned_lines, flat_level
from underskin.diagnosis.slips.no_response import no_response
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.unlisted.axes import recording_order
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices


@dataclass(frozen=True, eq=False)
class DisplacedResponse:
    """|FRF| of the base model [C/N] and its slope over position [C/N/mm] (displacements, recordings)."""

    value: Floats
    slope: Floats


def displaced_response(
    skin: SkinDescription,
    recordings: Sequence[FrfRecording],
    sensors: Sequence[str],
    displacement_mm: Floats,
    table: SigmaTable,
) -> DisplacedResponse:
    """The response of a sensor to each recording's contact, for common position errors of all contacts.

    Parameters
    ----------
    skin
        The array.
    entries
        A contact without a position is on the sensor that the recording names.
    sensors
        (recordings,) the sensor that responds to each contact.
    displacement_mm
        (displacements, 2) position errors common to all contacts.
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
_FREE = np.array(  # d over its usual value, s, p [mm], f
    [*product(np.exp(np.linspace(-0.6, 0.6, 9)), (0.05, 0.12, 0.3), (0.05, 0.3), (0.02, 0.1))]
)


@dataclass(frozen=True)
class Start:
    """The first exchanged recording of the sensors in time, the gain of ln evidence, and the least gain by a single
    sensor with the others exchanged."""

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
        """Compute the evidence of the given labels; `level` (recordings,) is over the usual one at the `largest` S
        [C/N]."""
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
        """The most probable start of an exchange; `indices` are the sensors' recordings in time, `others` the sensor of
        each after the exchange."""
        turned = self._response([self._recordings[index] for index in indices], others)
        given = DisplacedResponse(self._labelled.value[:, indices], self._labelled.slope[:, indices])
        level, displacements = self._level[indices], range(len(self._miss_mm))
        change = np.stack([self._density(turned, level, at) - self._density(given, level, at) for at in displacements])
        since = np.cumsum(change[..., ::-1], axis=-1)[..., ::-1]
        evidence = logsumexp(self._total[..., None] + since, axis=(0, 1))
        prior = np.full(len(indices), -log(2 * max(len(indices) - 1, 1)))
        prior[0] = -log(2)
        weighed = evidence - logsumexp(self._total) + prior
        first = int(np.argmax(weighed))
        sensor = np.array([self._recordings[index].sensor for index in indices[first:]])
        without = [
            logsumexp(self._total + change[..., first:][..., sensor != name].sum(axis=-1)) for name in set(sensor)
        ]
        return Start(first, float(logsumexp(weighed)), float(evidence[first] - max(without)))

    @property
    def _prior(self) -> Floats:
        """Log prior of e but for a constant (displacements,), each displacement standing for an area."""
        distance = np.hypot(*self._miss_mm.T)
        area = np.maximum(distance, _DISTANCES_MM[0] / 2)
        return np.asarray(np.log(area) - distance**2 / (2 * _MISS_MM**2))

    def _response(self, recordings: Sequence[FrfRecording], sensors: Sequence[str]) -> DisplacedResponse:
        return displaced_response(self._skin, recordings, sensors, self._miss_mm, self._table)

    def _density(self, response: DisplacedResponse, level: Floats, at: int) -> Floats:
        """Log density of each level under one displacement (d and noises, recordings)."""
        d, s, p, f = _FREE.T[:, :, None]
        value, slope = response.value[at] / self._largest, response.slope[at] / self._largest
        variance = d**2 * ((s * value) ** 2 + (p * slope) ** 2 + f**2)
        usual = np.exp(-0.5 * (level - d * value) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        return np.asarray(np.log((1 - _ASTRAY) * usual + 0.5 * _ASTRAY))


_LEAST_SHAPE = 0.3  # of the largest response: the least scale of a level
_ANSWERS = 0.6  # unexpected share of a level, or of `_LEAST_SHAPE`, above which exchanges are tried
_WEAK = 0.3  # of the expected level
_GAIN = log(100)  # of ln evidence beyond ln of the number tried
_GAIN_OF_EACH = log(4)  # of ln evidence, by each sensor's own recordings
_FEWEST = 4  # recordings, so that one can contradict the others
_FAR_OFF = 30.0  # times the usual response


@dataclass(frozen=True)
class _Exchange:
    """An exchange: of each label the sensor at whose position it responds, the recordings since the exchange and
    before, the gain of ln evidence after its cost, and the least gain by a single sensor."""

    true_sensor: Mapping[str, str]
    since: list[int]
    before: list[int]
    gain: float
    least: float


def without_exchanges(
    campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable
) -> tuple[list[FrfRecording], list[Finding]]:
    """The recordings with true sensors, without those that fit no sensor, and the findings."""
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
    informative = [recordings[index] for index in tells.tolist()]
    evidence = ExchangeEvidence(campaign.skin, informative, level[tells] / (usual * largest), largest, table)
    links = _links(campaign, [recording for recording, odd in zip(informative, unasked[tells], strict=True) if odd])
    right, findings = list[FrfRecording | None](recordings), list[Finding]()
    mute = set(labels) - {recording.sensor for recording in informative}
    exchanges, contradicting = _explained(informative, links, evidence, mute)
    for exchange in exchanges:
        findings.append(_finding(exchange, informative))
        for index in exchange.since:
            right[tells[index]] = _relabelled(campaign, informative[index], exchange.true_sensor)
    if contradicting:
        findings.append(_contradiction([informative[index] for index in contradicting]))
        for index in contradicting:
            right[tells[index]] = None
    return [recording for recording in right if recording is not None], findings


def _explained(
    recordings: Sequence[FrfRecording], links: Sequence[tuple[str, str]], evidence: ExchangeEvidence, mute: set[str]
) -> tuple[list[_Exchange], list[int]]:
    """The exchanges by which every sensor gains, and the recordings of other sensors that gain alone.

    Each sensor is in one exchange at most, and none of the `mute`, whose recordings carry no information.
    """
    moves = _weighed(recordings, [{name: sensor} for name, sensor in links], evidence)
    best = {name: sensor for move in reversed(moves) for name, sensor in move.true_sensor.items()}
    chosen, settled = list[_Exchange](), set(mute)
    for exchange in _weighed(recordings, _permutations(links, best), evidence):
        consistent = all(best.get(name, sensor) == sensor for name, sensor in exchange.true_sensor.items())
        if consistent and exchange.least > _GAIN_OF_EACH and not settled & set(exchange.true_sensor):
            chosen.append(exchange)
            settled |= set(exchange.true_sensor)
    return chosen, sorted({index for move in moves if not settled & set(move.true_sensor) for index in move.since})


def _weighed(
    recordings: Sequence[FrfRecording], tried: Sequence[Mapping[str, str]], evidence: ExchangeEvidence
) -> list[_Exchange]:
    """The significant exchanges of those tried, the largest gain first."""
    order = recording_order(recordings)
    exchanges = []
    for true_sensor in tried:
        indices = sorted(
            (index for index, recording in enumerate(recordings) if recording.sensor in true_sensor),
            key=lambda index: order[index],
        )
        start = evidence.exchange(np.array(indices), [true_sensor[recordings[index].sensor] for index in indices])
        gain = start.gain - log(len(tried))
        if gain > _GAIN:
            exchanges.append(_Exchange(true_sensor, indices[start.first :], indices[: start.first], gain, start.least))
    return sorted(exchanges, key=lambda exchange: -exchange.gain)


def _links(campaign: Campaign, unasked: Sequence[FrfRecording]) -> list[tuple[str, str]]:
    """The sensors of these recordings, each with the sensor nearest to the contact."""
    links = {(recording.sensor, _nearest(campaign, recording)) for recording in unasked}
    return sorted(link for link in links if link[0] != link[1])


def _permutations(links: Sequence[tuple[str, str]], best: Mapping[str, str]) -> list[dict[str, str]]:
    """The exchange of each link, and the cycles of three sensors or more that the `best` assignments form; the last
    sensor of a chain, without a significant assignment, may close it."""
    tried = [{first: second, second: first} for first, second in sorted({(min(link), max(link)) for link in links})]
    for start in sorted(best):
        cycle = [start]
        while (following := best.get(cycle[-1])) is not None and following not in cycle:
            cycle.append(following)
        if len(cycle) > 2 and (following is None or following == start == min(cycle)):
            tried.append(dict(zip(cycle, [*cycle[1:], start], strict=True)))
    return tried


def _nearest(campaign: Campaign, recording: FrfRecording) -> str:
    """The sensor nearest to the contact of a recording."""
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
    """The median level over shape in recordings that are neither silent nor far from any sensor; None where one is far
    off, as by a wrong unit."""
    telling = shape > _LEAST_SHAPE * shape.max(initial=0.0)
    if not telling.any():
        return None
    ratio = level[telling] / shape[telling]
    if ratio.max() > _FAR_OFF * np.median(ratio):
        return None
    return float(np.median(ratio[ratio > _LEAST_SHAPE * np.quantile(ratio, 0.9)]))


def _relabelled(campaign: Campaign, recording: FrfRecording, true_sensor: Mapping[str, str]) -> FrfRecording:
    """The recording with its true sensor, the contact unchanged."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return replace(
        recording,
        sensor=true_sensor[recording.sensor],
        position_mm=recording.position_mm or positions[recording.sensor],
    )
