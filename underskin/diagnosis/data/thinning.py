"""A curve thinned to means over blocks of neighbouring samples.

They lie evenly along it, and ever closer towards its jumps and the kinks where contact begins and ends. The deviation
of a mean is the samples' noise, read from second differences, of the force and, times the slope, of the displacement.
"""

from collections.abc import Sequence

import numpy as np

from underskin.mechanisms.base import Kind
from underskin.recordings.curve_course import Course, foot
from underskin.recordings.curve_jumps import hidden_samples, roughness
from underskin.units import Floats, Indices, Mask

_SAMPLES, _MOST_SAMPLES = 50, 160  # of a curve, before and after blocks are split
_STRAIGHT = 3.0  # standard deviations of χ² about a straight line beyond which a block is split
_LEAST_NOISE = 2e-5  # of the range of force: what numbers written with five digits are good to
_COARSE, _BEYOND_NOISE = 240, 4.0  # samples at which changes of force are summed, standard deviations of noise
_NEAR_JUMP = np.array([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64])  # from it, where blocks begin: in samples, or in
# as many of them as hide the travel, since a law of single displacements that are noisy is biased where it bends
_BESIDE = 5  # samples on either side of the deepest one
_STEP = 0.2  # of the larger step of both ways, which the smaller must exceed for their lines to meet in a corner
_RESTS = 1e-3  # of that step: where the deepest samples differ by less, the sphere was held
_SURE = 4.0  # standard deviations
_DISTINCT = 5.0  # standard deviations by which two displacements differ, between which a slope is read


def thinned(
    columns: Sequence[Floats], seen: Course, slow: float, kind: Kind
) -> tuple[list[Floats], Floats, Floats, Floats]:
    """The means of displacement [mm], force [N] and, where there is one, time [s] over blocks (blocks,), the deviation
    of the force's [N], how far along the curve each lies, 0 to 1, and the samples in each; `slow` is what neighbouring
    samples of force share [N]."""
    unsteady = roughness(columns[0])
    columns = _with_corner(_with_still_hold(columns, seen), seen.turn)
    displacement, force = columns[:2]
    way = way_along(displacement, force, seen.noise)
    even = np.searchsorted(way, np.linspace(0.0, 1.0, _SAMPLES, endpoint=False))
    steepness = float(np.ptp(force)) / max(float(displacement.max() - np.median(displacement)), 1e-300)
    unseen = seen.noise / steepness if steepness else float(np.ptp(displacement))  # travel that noise of force hides
    straight = ((force, seen.noise), (displacement, max(unsteady, unseen)))
    starts = _split(np.union1d(even, _around(seen, displacement, force, kind)), straight)
    counts = np.diff(np.append(starts, len(way)))
    *means, place = [np.add.reduceat(column, starts) / counts for column in (*columns, way)]
    unsure = np.zeros(len(starts))
    for number in range(len(columns)):
        sag, doubt = _sag(columns[number], starts, _corners(seen))
        means[number] = means[number] - sag
        unsure = doubt if number == 1 else unsure
    held = (starts >= seen.arrive) & (starts <= seen.leave) & (seen.arrive < seen.turn)
    slope = np.where(held, 0.0, _slopes(means[0], means[1], unsteady / np.sqrt(counts), starts >= seen.turn))
    least = _LEAST_NOISE * float(np.ptp(force))
    deviation = np.sqrt((seen.noise**2 + (slope * unsteady) ** 2) / counts + least**2 + unsure**2 + slow**2)
    return means, deviation, place, counts.astype(float)


def _slopes(displacement: Floats, force: Floats, noise: Floats, back: Mask) -> Floats:
    """How steep the force rises over displacement at each block (blocks,): the lesser of the slopes to either side.

    Each is that to the next block of the same way whose displacement differs by more than its `noise` (blocks,); `back`
    are blocks of the way back. Beside a jump, one side has none; between blocks as close as the noise, a slope would be
    noise too.
    """
    apart = displacement - displacement[:, None]
    distinct = (np.abs(apart) > _DISTINCT * np.hypot(noise, noise[:, None])) & (back == back[:, None])
    number = np.arange(len(displacement))
    after = distinct & (number > number[:, None])
    before = distinct & (number < number[:, None])
    slopes = []
    for beside, other in ((after, after.argmax(axis=1)), (before, number[-1] - before[:, ::-1].argmax(axis=1))):
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.abs((force[other] - force) / (displacement[other] - displacement))
        slopes.append(np.where(beside.any(axis=1), slope, np.inf))
    least = np.minimum(*slopes)
    return np.where(np.isfinite(least), least, 0.0)


def _corners(seen: Course) -> Indices:
    """The first samples of what is not smoothly joined to what was before."""
    places = (seen.snap_in, seen.pull_off, seen.turn, seen.leave)
    return np.unique(np.array([place for place in places if place is not None], dtype=np.intp))


def _sag(column: Floats, starts: Indices, corners: Indices) -> tuple[Floats, Floats]:
    """How far the mean over each block lies beside the column's value in the block's middle, and how surely.

    By the parabola through the means of the block and of those beside it, bent no more than those of its neighbours:
    beside a kink one is bent that the curve is not, and what it would add is doubtful. 0 where a corner lies among
    them.
    """
    ends = np.append(starts[1:], len(column))
    counts = ends - starts
    middle, mean = (starts + ends - 1) / 2, np.add.reduceat(column, starts) / counts
    sag, doubt = np.zeros(len(starts)), np.zeros(len(starts))
    if len(starts) < 3:
        return sag, doubt
    first, second = np.diff(middle[:-1]), np.diff(middle[1:])
    bend = 2 * (np.diff(mean[1:]) / second - np.diff(mean[:-1]) / first) / (first + second)
    beside = np.stack([np.append(bend[1:], bend[-1]), bend, np.append(bend[0], bend[:-1])])
    alike = (np.sign(beside) == np.sign(bend)).all(axis=0)
    limited = np.where(alike, np.sign(bend) * np.abs(beside).min(axis=0), 0.0)
    smooth = ~((corners[:, None] > starts[:-2]) & (corners[:, None] < ends[2:])).any(axis=0)
    unit = np.where(smooth, (counts[1:-1] ** 2 - 1) / 24, 0.0)
    sag[1:-1] = limited * unit
    doubt[1:-1] = np.abs(bend - limited) * unit
    return sag, doubt


def _split(starts: Indices, columns: Sequence[tuple[Floats, float]]) -> Indices:
    """Blocks halved until each column is straight within its noise: a mean over a bend lies beside the curve.

    The most bent ones first, as long as there are not too many.
    """
    while len(starts) < _MOST_SAMPLES:
        ends = np.append(starts[1:], len(columns[0][0]))
        blocks = list(zip(starts, ends, strict=True))
        excess = np.array([max(_bend(one[low:high], noise) for one, noise in columns) for low, high in blocks])
        worst = np.argsort(-excess)[: max(_MOST_SAMPLES - len(starts), 0)]
        worst = worst[excess[worst] > _STRAIGHT]
        if not len(worst):
            break
        starts = np.union1d(starts, (starts[worst] + ends[worst]) // 2)
    return starts


def _bend(force: Floats, noise: float) -> float:
    """How far χ² about a straight line lies above its expectation, in its standard deviations."""
    freedom = len(force) - 2
    if freedom < 1:
        return 0.0
    place = np.arange(len(force)) - (len(force) - 1) / 2
    left = force - force.mean() - place * (place @ force) / (place @ place)
    least = max(noise, _LEAST_NOISE * float(np.abs(force).max()))
    if not least**2 > 0:
        return 0.0
    return float((left @ left) / least**2 - freedom) / np.sqrt(2.0 * freedom)


def _around(seen: Course, displacement: Floats, force: Floats, kind: Kind) -> Indices:
    """The samples with which blocks begin near the jumps, where a force falls steeply, and where the way turns: how
    far a contact has grown is told by single samples; and where contact begins and ends without a jump: a mean over
    that kink lies above the curve."""
    places = _corners(seen)
    if kind == "indentation":
        places = np.concatenate([places, _hidden_jumps(seen, force), _feet(seen, displacement, force)])
    apart = hidden_samples(displacement) * np.concatenate([-_NEAR_JUMP[:0:-1], _NEAR_JUMP])
    near = (places[:, None] + apart).ravel()
    return np.unique(near[(near >= 0) & (near < len(force))])


def _feet(seen: Course, displacement: Floats, force: Floats) -> Indices:
    """Where contact begins, and where it ends, on the ways on which no jump is seen."""
    ways = (
        (seen.snap_in, np.arange(seen.arrive + 1)),
        (seen.pull_off, np.arange(len(force) - 1, seen.leave - 1, -1)),
    )
    feet = [(own, foot(displacement[own], force[own])) for jump, own in ways if jump is None]
    return np.array([own[place] for own, place in feet if place is not None], dtype=np.intp)


def _hidden_jumps(seen: Course, force: Floats) -> Indices:
    """The least force of each way on which no jump is seen, where it lies below the air: there contact may begin or
    end by a jump that noise hides, and means over it would take from the adhesion."""
    ways = (seen.snap_in, 0, seen.turn), (seen.pull_off, seen.turn, len(force))
    least = [first + int(np.argmin(force[first:end])) for jump, first, end in ways if jump is None and first < end]
    return np.array([place for place in least if force[place] < -_SURE * seen.noise], dtype=np.intp)


def _with_still_hold(columns: Sequence[Floats], seen: Course) -> list[Floats]:
    """With the displacement of a hold that is noisy on a straight line.

    Noise of the displacement moves no contact; a law would answer to it, the more the steeper it is.
    """
    whole = [column.copy() for column in columns]
    if seen.arrive < seen.turn:
        held = whole[0][seen.arrive : seen.leave + 1]
        place = np.arange(len(held)) - (len(held) - 1) / 2
        held[:] = held.mean() + place * float(place @ held) / float(place @ place)
    return whole


def _with_corner(columns: Sequence[Floats], turn: int) -> list[Floats]:
    """With the deepest sample where the way in and the way back meet, which was between two samples.

    How far the contact has grown is remembered on all of the way back. By straight lines through the samples on either
    side; as it is where the sphere was held.
    """
    whole = [column.copy() for column in columns]
    displacement = columns[0]
    before, after = np.arange(turn - _BESIDE, turn), np.arange(turn + 1, turn + 1 + _BESIDE)
    if before[0] < 0 or after[-1] >= len(displacement):
        return whole
    lines = [[np.polyfit(side - turn, column[side], 1) for side in (before, after)] for column in columns]
    (rise, high), (fall, low) = lines[0]
    steep = min(rise, -fall) > _STEP * max(rise, -fall)
    rests = displacement[turn] - max(displacement[turn - 1], displacement[turn + 1]) < _RESTS * max(rise, -fall)
    if not steep or rests:
        return whole
    place = (low - high) / (rise - fall)
    peak = high + rise * place
    if abs(place) > 1 or not 0 <= peak - displacement[turn] <= max(rise, -fall):
        return whole
    for column, ((up, at_up), (down, at_down)) in zip(whole, lines, strict=True):
        column[turn] = 0.5 * (at_up + up * place + at_down + down * place)
    return whole


def way_along(displacement: Floats, force: Floats, noise: float) -> Floats:
    """How far along the curve each sample lies, 0 to 1: as much by displacement, by force and by count.

    A sphere's way through the air is long and says little; force counts where it changes by more than its noise.
    """
    coarse = np.linspace(0, len(force) - 1, min(len(force), _COARSE)).round().astype(int)
    steps = np.maximum(np.abs(np.diff(force[coarse])) - _BEYOND_NOISE * noise, 0.0)
    changed = np.interp(np.arange(len(force)), coarse, np.concatenate([[0.0], np.cumsum(steps)]))
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(displacement)))])
    parts = [part / part[-1] for part in (moved, changed, np.arange(len(force), dtype=float)) if part[-1] > 0]
    return np.asarray(sum(parts) / len(parts))
