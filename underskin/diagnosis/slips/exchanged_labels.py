"""Sensors that respond where other sensors were pressed: labels exchanged, or cables since some recording.

A sensor that responds where no response is expected is linked to the sensor nearest to the contact. Each link is tried
as an exchange of the two, and links that close a cycle as a rotation, as by a plug that is off by one, at the cost of
ln of the number tried. An exchange is undone where every sensor gains by it. Where a sensor gains by another's label
and no exchange fits both, its recordings contradict their positions and are left out. A recording that is far weaker
than expected may be of a weak or dead sensor, and does not count.

The level of a recording is
    y_i = S_i + N(0, (s S_i)² + (p |∂S_i/∂position|)² + (f max S)²),
S_i being the response of the sensor that is assumed to have answered, times the usual ratio of levels to responses, s
the relative scatter of levels (sensors, recordings, unlisted physics), p the error of positions, and f what reaches a
distant sensor (its neighbours' charge). With probability ε a level is anything up to twice the largest. The evidence is
averaged over the recording from which on the sensors are exchanged: one half of the prior for all recordings, the other
half evenly over the later ones. ε bounds the cost of a wrong label, so that an exchange may gain by one sensor while
the other stays as wrong as before; the gain of each sensor shows this.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import dist, log

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.slips.comparison import aligned_lines, base_model, flat_level, no_response, position_slopes
from underskin.diagnosis.slips.levels import LEAST_LEVELS, POSITION_MM, Alternative
from underskin.diagnosis.slips.table import ASTRAY, GAIN, Screened
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.forms import recording_order
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats

_SCATTER, _REACHES = 0.2, 0.05  # s, f; p is the largest of a stage
_SMALL = 0.3  # of the largest response: the least scale of a level; and of the expected level: a weak one
_ANSWERS = 0.6  # unexpected share of a level, or of `_SMALL`, above which exchanges are tried
_FAR_OFF = 30.0  # times the usual response

Labels = Mapping[str, str]  # of each label the sensor at whose position it responds
LogDensity = Callable[[Sequence[int], Sequence[str]], Floats]  # of recordings, if the given sensors answered


@dataclass(frozen=True, eq=False)
class _Exchange:
    """The true sensors, the recordings since the exchange and before, the gain of ln evidence, and the least gain by a
    single sensor."""

    true_sensor: Labels
    since: list[int]
    before: list[int]
    gain: float
    least: float


def exchanged_labels(screened: Screened) -> Iterator[Alternative]:
    """The exchanges by which every sensor gains, and the recordings of other sensors that gain alone."""
    recordings = screened.recordings
    if len(screened.positions) < 2 or len(recordings) < LEAST_LEVELS:
        return
    level = np.array([flat_level(recording) for recording in recordings])
    labels = [recording.sensor for recording in recordings]
    near = [_nearest(screened, recording) for recording in recordings]
    shape, pressed = (_responses(screened, range(len(recordings)), names)[0] for names in (labels, near))
    silent, _ = no_response(aligned_lines(recordings))
    largest = float(max(shape.max(), pressed.max()))
    usual = _usual(level, np.where(silent, 0.0, np.maximum(shape, pressed)))
    unasked = level - (usual or np.inf) * shape > _ANSWERS * np.maximum(level, _SMALL * (usual or 1.0) * largest)
    if not unasked.any():
        return
    assert usual is not None

    def log_density(indices: Sequence[int], sensors: Sequence[str]) -> Floats:
        value, slope = _responses(screened, indices, sensors) / largest
        variance = (_SCATTER * value) ** 2 + (POSITION_MM[-1] * slope) ** 2 + _REACHES**2
        misfit = level[list(indices)] / (usual * largest) - value
        density = np.exp(-0.5 * misfit**2 / variance) / np.sqrt(2 * np.pi * variance)
        return np.asarray(np.log((1 - ASTRAY) * density + 0.5 * ASTRAY))

    tells = ~silent & (level > _SMALL * usual * shape)
    of_recordings = [*zip(labels, near, strict=True)]
    links = sorted(
        {of_recordings[index] for index in np.flatnonzero(tells & unasked)} - {(name, name) for name in near}
    )
    order = [index for index in np.argsort(recording_order(recordings), kind="stable").tolist() if tells[index]]
    weighed = partial(_weighed, labels, order, log_density)
    moves = weighed([{name: sensor} for name, sensor in links])
    best = {name: sensor for move in reversed(moves) for name, sensor in move.true_sensor.items()}
    mute = set(labels) - {labels[index] for index in order}
    exchanges = [
        exchange
        for exchange in weighed(_permutations(links, best))
        if exchange.least > GAIN / 2  # by each of two, or of more
        and all(best.get(name, sensor) == sensor for name, sensor in exchange.true_sensor.items())
        and not mute & set(exchange.true_sensor)
    ]
    for exchange in exchanges:
        right = {index: exchange.true_sensor[labels[index]] for index in exchange.since}
        undone = screened.relabelled(right, _finding(exchange, recordings), moved=False)
        yield Alternative(0.0, exchange.gain, undo=undone)
    settled = mute.union(*(exchange.true_sensor for exchange in exchanges))
    alone = [move for move in moves if not settled & set(move.true_sensor)]
    if alone:
        off = np.isin(np.arange(len(recordings)), [index for move in alone for index in move.since])
        arguments = {"sensors": sorted({labels[index] for index in np.flatnonzero(off)}), "recordings": int(off.sum())}
        finding = Finding(Reason.LABELS_CONTRADICT_PLACES, "", "sensor", arguments)
        yield Alternative(0.0, alone[0].gain, undo=screened.without(off, finding))


def _weighed(
    labels: Sequence[str], order: Sequence[int], log_density: LogDensity, tried: Sequence[Labels]
) -> list[_Exchange]:
    """The significant exchanges of those tried, the largest gain first; `order` holds the recordings in time."""
    given = dict(zip(order, log_density(order, [labels[index] for index in order]), strict=True))
    exchanges = []
    for true_sensor in tried:
        indices = [index for index in order if labels[index] in true_sensor]
        names = np.array([labels[index] for index in indices])
        change = log_density(indices, [true_sensor[name] for name in names]) - [given[index] for index in indices]
        prior = np.full(len(indices), -log(2 * max(len(indices) - 1, 1)))
        prior[0] = -log(2)
        since = np.cumsum(change[::-1])[::-1] + prior
        first, gain = int(np.argmax(since)), float(logsumexp(since)) - log(len(tried))
        of_each = [change[first:][names[first:] == name].sum() for name in set(names[first:])]
        if gain > GAIN:
            exchanges.append(_Exchange(true_sensor, indices[first:], indices[:first], gain, float(min(of_each))))
    return sorted(exchanges, key=lambda exchange: -exchange.gain)


def _responses(screened: Screened, indices: Sequence[int], sensors: Sequence[str]) -> Floats:
    """|FRF| of the base model [C/N] and its slope over position [C/N/mm] (2, recordings) if the given sensors answered;
    the contact is on the sensor that the recording names where its position is not given."""
    chosen = [screened.recordings[index] for index in indices]
    pressed = [recording.position_mm or screened.positions[recording.sensor] for recording in chosen]
    there = [replace(one, sensor=name, position_mm=at) for one, name, at in zip(chosen, sensors, pressed, strict=True)]
    *_, prediction = base_model(screened.campaign, there, screened.table)
    return np.nan_to_num([np.abs(prediction.value), position_slopes(prediction)])


def _permutations(links: Sequence[tuple[str, str]], best: Labels) -> list[dict[str, str]]:
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


def _nearest(screened: Screened, recording: FrfRecording) -> str:
    """The sensor nearest to the contact of a recording."""
    pressed = recording.position_mm or screened.positions[recording.sensor]
    return min(screened.positions, key=lambda name: dist(screened.positions[name], pressed))


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


def _finding(exchange: _Exchange, recordings: Sequence[FrfRecording]) -> Finding:
    names = sorted(exchange.true_sensor)
    since = recordings[exchange.since[0]].id if exchange.before else None
    arguments: dict[str, object] = {"since": since, "recordings": len(exchange.since)}
    if len(names) > 2:
        arguments |= {"sensors": names, "places": [exchange.true_sensor[name] for name in names]}
        return Finding(Reason.LABELS_PERMUTED, "", "sensor", arguments)
    pair = dict(zip(("first", "second"), names, strict=True))
    if since is None:
        return Finding(Reason.LABELS_EXCHANGED, "", "sensor", pair)
    return Finding(Reason.CABLES_EXCHANGED, "", "sensor", {**pair, **arguments})
