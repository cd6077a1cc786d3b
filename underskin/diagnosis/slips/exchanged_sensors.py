"""Sensors that respond where other sensors were pressed: labels exchanged, or cables since some recording.

A sensor that responds where no response is expected is linked to the sensor nearest to the contact. Each link is tried
as an exchange of the two, and links that close a cycle as a rotation, as by a plug that is off by one; each is weighed
against no exchange, at the cost of ln of the number tried. An exchange is undone where every sensor gains by it. Where
a sensor gains by another's label and no exchange fits both, its recordings contradict their positions and are left out.
A recording that is far weaker than expected may be of a weak or dead sensor, and does not count.

The level of a recording is
    y_i = S_i + N(0, (s S_i)² + (p |∂S_i/∂position|)² + (f max S)²),
S_i being the response of the sensor that is assumed to have answered, times the usual ratio of levels to responses, s
the relative scatter of levels (sensors, recordings, unlisted physics), p the error of positions, and f what reaches a
distant sensor (its neighbours' charge). With probability ε a level is anything up to twice the largest. The evidence is
averaged over the recording from which on the sensors are exchanged: one half of the prior for all recordings, the other
half evenly over the later ones. ε bounds the cost of a wrong label, so that an exchange may gain by one sensor while
the other stays as wrong as before; the gain of each sensor shows this.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import dist, log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.slips.comparison import aligned_lines, flat_level, no_response
from underskin.diagnosis.slips.levels import GAIN, LEAST_LEVELS, POSITION_MM
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.composed import compose
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording, SkinDescription
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SCATTER, _REACHES = 0.2, 0.05  # s, f; p is the largest of a stage
_ASTRAY = 1e-5  # ε


@dataclass(frozen=True, eq=False)
class Response:
    """|FRF| of the base model [C/N] and its slope over position [C/N/mm] (recordings,)."""

    value: Floats
    slope: Floats

    def log_density(self, level: Floats, usual: float, largest: float) -> Floats:
        """Log density of each level [C/N], which is `usual` times the response, over that at the `largest` one."""
        value, slope, relative = self.value / largest, self.slope / largest, level / (usual * largest)
        variance = (_SCATTER * value) ** 2 + (POSITION_MM[-1] * slope) ** 2 + _REACHES**2
        density = np.exp(-0.5 * (relative - value) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        return np.asarray(np.log((1 - _ASTRAY) * density + 0.5 * _ASTRAY))


def response_of(
    skin: SkinDescription, recordings: Sequence[FrfRecording], sensors: Sequence[str], table: SigmaTable
) -> Response:
    """The response of the given `sensors` (recordings,) to each recording's contact, which is on the sensor that the
    recording names where its position is not given."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in skin.sensors}
    contacts = tuple(
        recording.without_measurements(
            frequency_hz=np.ones(1), sensor=sensor, position_mm=recording.position_mm or positions[recording.sensor]
        )
        for recording, sensor in zip(recordings, sensors, strict=True)
    )
    model = compose((), Conditions("contacts", skin, contacts), table, "frf")
    prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
    assert prediction.position_slopes is not None
    slope = 1e-3 * np.hypot(*np.abs(prediction.position_slopes))
    return Response(*(np.nan_to_num(part) for part in (np.abs(prediction.value), slope)))


_SMALL = 0.3  # of the largest response: the least scale of a level; and of the expected level: a weak one
_ANSWERS = 0.6  # unexpected share of a level, or of `_SMALL`, above which exchanges are tried
_GAIN_OF_EACH = log(4)  # of ln evidence, by each sensor's own recordings
_FAR_OFF = 30.0  # times the usual response


LogDensity = Callable[[Sequence[int], Sequence[str]], Floats]  # of recordings, if the given sensors answered


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
    if len(campaign.skin.sensors) < 2 or len(recordings) < LEAST_LEVELS:
        return list(recordings), []
    level = np.array([flat_level(recording) for recording in recordings])
    labels, near = (
        [recording.sensor for recording in recordings],
        [_nearest(campaign, recording) for recording in recordings],
    )
    shape, pressed = (response_of(campaign.skin, recordings, names, table).value for names in (labels, near))
    silent, _ = no_response(aligned_lines(recordings))
    largest = float(max(shape.max(), pressed.max()))
    usual = _usual(level, np.where(silent, 0.0, np.maximum(shape, pressed)))
    if usual is None:
        return list(recordings), []
    unasked = level - usual * shape > _ANSWERS * np.maximum(level, _SMALL * usual * largest)
    if not unasked.any():
        return list(recordings), []
    tells = np.flatnonzero(~silent & (level > _SMALL * usual * shape))
    informative = [recordings[index] for index in tells.tolist()]

    def log_density(indices: Sequence[int], sensors: Sequence[str]) -> Floats:
        pressed = [informative[index] for index in indices]
        return response_of(campaign.skin, pressed, sensors, table).log_density(level[tells[indices]], usual, largest)

    links = _links(campaign, [recording for recording, odd in zip(informative, unasked[tells], strict=True) if odd])
    right, findings = list[FrfRecording | None](recordings), list[Finding]()
    mute = set(labels) - {recording.sensor for recording in informative}
    exchanges, contradicting = _explained(informative, links, log_density, mute)
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
    recordings: Sequence[FrfRecording], links: Sequence[tuple[str, str]], log_density: LogDensity, mute: set[str]
) -> tuple[list[_Exchange], list[int]]:
    """The exchanges by which every sensor gains, and the recordings of other sensors that gain alone.

    Each sensor is in one exchange at most, and none of the `mute`, whose recordings carry no information.
    """
    moves = _weighed(recordings, [{name: sensor} for name, sensor in links], log_density)
    best = {name: sensor for move in reversed(moves) for name, sensor in move.true_sensor.items()}
    chosen, settled = list[_Exchange](), set(mute)
    for exchange in _weighed(recordings, _permutations(links, best), log_density):
        consistent = all(best.get(name, sensor) == sensor for name, sensor in exchange.true_sensor.items())
        if consistent and exchange.least > _GAIN_OF_EACH and not settled & set(exchange.true_sensor):
            chosen.append(exchange)
            settled |= set(exchange.true_sensor)
    return chosen, sorted({index for move in moves if not settled & set(move.true_sensor) for index in move.since})


def _weighed(
    recordings: Sequence[FrfRecording], tried: Sequence[Mapping[str, str]], log_density: LogDensity
) -> list[_Exchange]:
    """The significant exchanges of those tried, the largest gain first."""
    order = np.argsort(recording_order(recordings), kind="stable").tolist()
    given = log_density(range(len(recordings)), [recording.sensor for recording in recordings])
    exchanges = []
    for true_sensor in tried:
        indices = [index for index in order if recordings[index].sensor in true_sensor]
        labels = np.array([recordings[index].sensor for index in indices])
        change = log_density(indices, [true_sensor[label] for label in labels]) - given[indices]
        prior = np.full(len(indices), -log(2 * max(len(indices) - 1, 1)))
        prior[0] = -log(2)
        weighed = np.cumsum(change[::-1])[::-1] + prior
        first, gain = int(np.argmax(weighed)), float(logsumexp(weighed)) - log(len(tried))
        of_each = [change[first:][labels[first:] == label].sum() for label in set(labels[first:])]
        if gain > GAIN:
            exchanges.append(_Exchange(true_sensor, indices[first:], indices[:first], gain, float(min(of_each))))
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
    telling = shape > _SMALL * shape.max(initial=0.0)
    if not telling.any():
        return None
    ratio = level[telling] / shape[telling]
    if ratio.max() > _FAR_OFF * np.median(ratio):
        return None
    return float(np.median(ratio[ratio > _SMALL * np.quantile(ratio, 0.9)]))


def _relabelled(campaign: Campaign, recording: FrfRecording, true_sensor: Mapping[str, str]) -> FrfRecording:
    """The recording with its true sensor, the contact unchanged."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    return replace(
        recording,
        sensor=true_sensor[recording.sensor],
        position_mm=recording.position_mm or positions[recording.sensor],
    )
