"""The course of a curve.

The noise of the raw samples of a curve, over how many of them it hides the travel, and where a curve jumps.

The course of an indentation curve: how noisy it is, where it turns, where it jumps, what the cell shows in the air.

Displacement grows into the sample. All is found from the samples alone, without a law of contact but for a drift of the
force in the air, which is told from the foot of a Hertzian contact.

Curves whose force, displacement and size would need a modulus that no elastomer has: slips of units.

What is judged is the apparent modulus: of a cylinder (F/A)/(u/height) at the largest force, u from the first sample;
of a sphere 3 (1 − ν²) F/(4 √R u^1.5) at the deepest sample, u from the end of the air. It need not be right, only of
the right magnitude.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import (
    Campaign,
    CompressionRecording,
    CurveRecording,
    IndentationRecording,
    SkinDescription,
)
from underskin.units import Floats, Indices

_BEYOND_NOISE = 3.0  # standard deviations; a jump that was none only ends a mean early


def roughness(force: Floats) -> float:
    """The noise of a raw sample; second differences of a smooth curve are small against it, or cautious."""
    second = force[2:] - 2 * force[1:-1] + force[:-2]
    if not len(second):
        return 0.0
    noise = 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
    steps = np.abs(np.diff(force))
    steps = steps[steps > 0]
    quantum = float(steps.min()) if len(steps) else 0.0
    coarse = len(np.unique(force)) < len(force) / 2  # an analog-digital converter's steps show
    return float(np.hypot(noise, quantum / np.sqrt(12.0))) if coarse else noise


def hidden_samples(displacement: Floats) -> int:
    """Over so many samples, at least 1, the displacement moves about as far as twice the noise of their mean.

    Noise σ and a step s from sample to sample: n s = 2 σ/√n.
    """
    step = float(np.ptp(displacement)) / max(int(displacement.argmax()), 1)
    return max(1, int((2 * roughness(displacement) / step) ** (2 / 3))) if step > 0 else 1


def jumps(force: Floats, noise: float, block: int) -> Indices:
    """The samples (jumps,) with which a new course begins, where means over `block` samples would hide it.

    A mean over samples on both sides is a force that never was. `noise`: the standard deviation of one sample. The
    mean of a block ahead less that of the block behind is held against a third of the same over the blocks beyond,
    which on a straight course is equal to it; near there the jump is the largest change between two samples.
    """
    if block == 1 or len(force) < 2 * block + 1:
        return np.zeros(0, dtype=np.intp)
    from scipy.ndimage import maximum_filter1d  # takes 0.2 s to load, which few need

    longer = np.pad(force, 2 * block, mode="reflect", reflect_type="odd")  # straight on at both ends
    means = np.convolve(longer, np.full(block, 1 / block), mode="valid")  # of longer[i : i + block]
    at = np.arange(len(force)) + 2 * block
    size = np.abs(means[at] - means[at - block] - (means[at + block] - means[at - 2 * block]) / 3)
    least = _BEYOND_NOISE * noise * np.sqrt(20 / 9 / block)
    about = np.flatnonzero((size > least) & (size == maximum_filter1d(size, 2 * block + 1)))
    change = np.abs(np.diff(force, prepend=force[0]))
    return np.array([_largest(change, sample - block, sample + block) for sample in about.tolist()], dtype=np.intp)


def _largest(change: Floats, first: int, last: int) -> int:
    """The place of the largest change from first to last."""
    first = max(first, 0)
    return first + int(np.argmax(change[first : last + 1]))


_BLOCKS = 60  # of a curve, over whose means jumps are sought
_AIR = 5  # samples at least that tell what the cell shows in the air
_BEYOND_JUMP, _LEAST_JUMP = 6.0, 2e-3  # standard deviations, and of the range of force, of a jump of contact
_HELD = 0.2  # of the usual step between samples, below which a sphere is held
_HELD_BLOCK = 8  # samples by which a hold is found
_BESIDE_HOLD, _AS_NOISE = 4.0, 1.5  # standard deviations of a mean; times the noise about the mean of a hold
_HIDDEN = 24.0  # times the noise: the way of a sphere that moved on for as long as a hold
_FITTED, _LEAST_FITTED, _CLOSER = 200, 40, 3  # samples that tell a drift in the air; grids of contact points
_LEAST_AIR, _SHORTER = 0.1, 0.9  # of the samples of a way; of those in the air, where these do not lie straight
_PLAIN = 60.0  # F of a drift, beyond which it is plain
_BACK = 0.25  # of the range of displacement, from where it began
_QUIET = 3e-3  # of the range of force
_STRAIGHT = 1.5  # times the noise: samples about the line of a drift
_LOW = 0.3  # of the range of force: the foot of a contact
_RISE = 0.02  # of the range of force: below that a sphere has not yet pressed


@dataclass(frozen=True)
class Course:
    """Of one curve. `air` are samples before contact or after it has ended, none where none were recorded.

    `snap_in` and `pull_off` number the first samples after those jumps; None where there is none.
    """

    noise: float  # standard deviation of a sample of force
    turn: int  # the deepest sample
    arrive: int  # the first sample of the hold there
    leave: int  # the last one
    snap_in: int | None
    pull_off: int | None
    air: Indices
    zero: float  # what the cell shows in the air (where that is after contact, less the drift), or at the first sample
    drift: float  # of the force in the air in time, where it is plain; else 0

    @property
    def has_air(self) -> bool:
        """Whether the force's zero is known from samples."""
        return len(self.air) >= _AIR


def touch(displacement: Floats, snap_in: int) -> float:
    """About where a sphere touches that snaps in with this sample: half a step of its stage beyond the one before,
    since a stage that gives lets it jump further in."""
    before = displacement[max(snap_in - 2, 0) : snap_in + 1]
    steps = np.diff(before)
    return float(before[-2] + 0.5 * max(min(steps), 0.0)) if len(before) > 1 else float(displacement[0])


def foot(displacement: Floats, force: Floats) -> int | None:
    """The sample, of a way into contact (samples,), with which a force begins to rise as Hertz's law has it; None of
    too few samples.

    F = b + k (d − d0)^(3/2) by least squares over a grid of d0, to the samples before the force is large.
    """
    high = np.flatnonzero(force - force[: max(len(force) // 50, 3)].mean() > _LOW * float(np.ptp(force)))
    count = int(high[0]) if len(high) else len(force)
    at = np.unique(np.linspace(0, count - 1, min(count, _FITTED)).round().astype(int))
    if len(at) < _LEAST_FITTED:
        return None
    travel, measured = displacement[at], force[at]

    def left(begins: float) -> float:
        hertz = np.maximum(travel - begins, 0.0) ** 1.5
        hertz, about = hertz - hertz.mean(), measured - measured.mean()
        square = float(hertz @ hertz)
        return float(about @ about) - (float(hertz @ about) ** 2 / square if square > 0 else 0.0)

    return int(np.argmax(displacement > _least(travel, left)[1]))


def course(displacement: Floats, force: Floats, time: Floats | None = None) -> Course:
    """Of samples (samples,), all finite; without times they were taken at a steady rate."""
    time = np.arange(float(len(force))) if time is None else time
    return _course(*(np.asarray(column, dtype=float).tobytes() for column in (displacement, force, time)))


@lru_cache(maxsize=256)  # a diagnosis asks again for every model that it composes of the same recordings
def _course(*columns: bytes) -> Course:
    displacement, force, time = map(np.frombuffer, columns)
    noise = roughness(force)
    block = int(np.ceil(len(force) / _BLOCKS))
    turn = _deepest(displacement)
    span = float(np.ptp(force))
    found = jumps(force, float(np.hypot(noise, 1e-3 * span)), block)
    least = np.maximum(_BEYOND_JUMP * noise, _LEAST_JUMP * span)
    begin, end = (float(np.median(part)) for part in (force[: max(3, block)], force[-max(3, block) :]))
    # From the air into contact, or back into it
    few = max(2, min(block, 5))
    before = np.array([np.median(force[max(place - few, 0) : max(place, 1)]) for place in found.tolist()])
    after = np.array([np.median(force[place : place + few]) for place in found.tolist()])
    step = after - before
    in_air = least + _RISE * span
    down = np.flatnonzero((found < turn) & (step < -least) & (np.abs(before - begin) < in_air) & (found > few))
    up = np.flatnonzero((found > turn) & (step > least) & (np.abs(after - end) < in_air))
    snap_in = int(found[down[np.argmin(step[down])]]) if len(down) else _single_snap(force[: turn + 1], begin, noise)
    pull_off = int(found[up[np.argmax(step[up])]]) if len(up) else None
    arrive, leave = _held(displacement, turn)
    drifting = None if snap_in is not None else _drifting_air(displacement, force, time, turn + 1, noise)
    if drifting is None and snap_in is None and pull_off is None:
        back = _drifting_after(displacement, force, time, leave, noise)
        if back is not None:
            air, drift = np.arange(len(force) - back[0], len(force)), back[1]
            zero = float(np.median(force[air] - drift * (time[air] - time[0])))
            return Course(noise, turn, arrive, leave, None, None, air, zero, drift)
    air = _air(force, turn, snap_in, pull_off, noise, span) if drifting is None else np.arange(drifting[0])
    zero = float(np.median(force[air])) if len(air) >= _AIR else float(force[0])
    return Course(noise, turn, arrive, leave, snap_in, pull_off, air, zero, 0.0 if drifting is None else drifting[1])


def _deepest(displacement: Floats) -> int:
    """The deepest sample, of means over samples as close as the noise."""
    count = hidden_samples(displacement)
    from scipy.ndimage import uniform_filter1d  # takes 0.2 s to load, which few need

    return int(np.argmax(uniform_filter1d(displacement, count, mode="nearest") if count > 1 else displacement))


def _single_snap(force: Floats, begin: float, noise: float) -> int | None:
    """The sample on the way in with which the force falls, where it rises again at once, so that no means show it: one
    of the last that lie no higher than the air, `begin`."""
    low = np.flatnonzero(force <= begin + _BEYOND_JUMP * noise)
    if not len(low) or not noise > 0:
        return None
    first = max(int(low[-1]) - _AIR, _AIR)
    fallen = [
        place
        for place in range(first, int(low[-1]) + 1)
        if force[place] < np.median(force[place - _AIR : place]) - _BEYOND_JUMP * noise
        and force[place] < force[place - 1] - _BEYOND_JUMP * noise
    ]
    return fallen[0] if fallen else None


def _held(displacement: Floats, turn: int) -> tuple[int, int]:
    """The first and the last sample of the hold around the deepest one.

    Where the displacement is noisy, a hold grows by blocks as long as their means are its own; it is none unless it is
    much longer than what noise hides of a turn. Else it begins with the deepest sample, and steps tell its end.
    """
    noise = roughness(displacement)
    steps = np.abs(np.diff(displacement[turn:], append=-np.inf))
    resting = steps <= _HELD * float(np.median(np.abs(np.diff(displacement)))) + 1e-300
    plain = turn, turn + int(np.argmin(resting))
    starts = [turn - _HELD_BLOCK, turn - _HELD_BLOCK // 2, turn]
    starts = [start for start in starts if start >= 0 and start + _HELD_BLOCK <= len(displacement)]
    if not noise > 0 or not starts:
        return plain
    low = min(starts, key=lambda start: float(np.std(displacement[start : start + _HELD_BLOCK])))
    high = low + _HELD_BLOCK
    while True:
        held = displacement[low:high]
        least = _BESIDE_HOLD * noise * np.sqrt(1 / _HELD_BLOCK + 1 / len(held))
        before, after = displacement[max(low - _HELD_BLOCK, 0) : low], displacement[high : high + _HELD_BLOCK]
        earlier, later = (len(part) and abs(part.mean() - held.mean()) < least for part in (before, after))
        if not (earlier or later):
            break
        low, high = low - len(before) * bool(earlier), high + len(after) * bool(later)
    beyond = [displacement[max(low - 2 * _HELD_BLOCK, 0) : low], displacement[high : high + 2 * _HELD_BLOCK]]
    falls = [(held.mean() - part.mean()) / len(part) for part in beyond if len(part) == 2 * _HELD_BLOCK]
    # Of the sphere on its way, at least: beside the hold, which noise may hide, and over all of the way in
    speed = min([*falls, float(np.ptp(displacement)) / max(turn, 1)]) if falls else 0.0
    still = bool(np.std(held) < _AS_NOISE * noise)
    return (low, high - 1) if still and speed > 0 and len(held) * speed > _HIDDEN * noise else plain


def _air(force: Floats, turn: int, snap_in: int | None, pull_off: int | None, noise: float, span: float) -> Indices:
    """The samples in the air: up to the snap-in, or while the force stays where it began; else those after the end."""
    if snap_in is not None:
        return np.arange(snap_in)
    begin = float(np.median(force[: max(3, min(turn, len(force)) // 50)])) if turn else float(force[0])
    off = np.abs(force[: turn + 1] - begin) > max(4 * noise, _RISE * span)
    staying = off[::-1].cumprod()[::-1].astype(bool)  # from where it stays off
    first = int(np.argmax(staying)) if staying.any() else 0
    if first >= _AIR:
        return np.arange(first)
    return np.arange(pull_off, len(force)) if pull_off is not None else np.zeros(0, dtype=np.intp)


def _drifting_air(
    displacement: Floats, force: Floats, time: Floats, count: int, noise: float
) -> tuple[int, float] | None:
    """How many of the first `count` samples, the way in, lie before contact, and the drift of the force in time; None
    where it does not plainly drift.

    See `_straight_air`.
    """
    air = _straight_air(displacement[:count], force[:count], time[:count], noise, 1.0)
    return air if air is not None and _believed(displacement, force, time, count, noise, *air) else None


def _drifting_after(
    displacement: Floats, force: Floats, time: Floats, leave: int, noise: float
) -> tuple[int, float] | None:
    """How many samples lie in the air after contact, and the drift of the force in time that they show; None where it
    is not plain, or does not lead from where the force began to where it ended."""
    after = slice(None, leave, -1)
    air = _straight_air(displacement[after], force[after], time[after], noise, _LEAST_AIR)
    if air is None:
        return None
    expected = air[1] * float(time[-1] - time[0])
    return air if abs(float(force[-1] - force[0]) - expected) < 0.5 * abs(expected) + 4 * noise else None


def _straight_air(
    displacement: Floats, force: Floats, time: Floats, noise: float, least: float
) -> tuple[int, float] | None:
    """How many samples, the first of which lie in the air and the last deepest, lie before contact, and the drift of
    the force in time; None where it does not plainly drift.

    F = b + s t + k (d − d0)^(3/2) by least squares with and without the drift s over a grid of contact points d0; the
    samples before d0, or the first of them but at least a share `least`, must lie on a straight line: a law that rises
    otherwise than Hertz's begins earlier, but so the foot of a contact passes for air.
    """
    count = len(displacement)
    at = np.linspace(0, count - 1, min(count, _FITTED)).round().astype(int)
    if len(at) < _LEAST_FITTED or not np.ptp(time) > 0:
        return None
    travel, columns = displacement[at], np.column_stack([np.ones(len(at)), (time[at] - time[0]) / np.ptp(time)])

    def left(begins: float, drifts: bool) -> float:
        hertz = np.maximum(travel - begins, 0.0) ** 1.5
        design = np.column_stack([hertz, columns[:, : 1 + drifts]])
        residual = force[at] - design @ np.linalg.lstsq(design, force[at], rcond=None)[0]
        return float(residual @ residual)

    (steady, _), (drifting, begins) = (_least(travel, partial(left, drifts=drifts)) for drifts in (False, True))
    first = int(np.argmax(displacement > begins))
    if first < _LEAST_AIR * count or steady < (1 + _PLAIN / len(at)) * drifting:
        return None
    shortest = max(least * first, _LEAST_AIR * count)
    while first >= max(shortest, _AIR) and np.ptp(time[:first]) > 0:
        line = np.polyfit(time[:first], force[:first], 1)
        if np.std(force[:first] - np.polyval(line, time[:first])) < _STRAIGHT * noise:
            return first, float(line[0])
        first = int(_SHORTER * first)
    return None


def _least(travel: Floats, left: Callable[[float], float]) -> tuple[float, float]:
    """The least misfit over contact points along the way in, and that point: on a grid, then ever closer around it."""
    grid = travel[: len(travel) - _LEAST_FITTED // 2 : 2]
    for _ in range(_CLOSER):
        misfits = [left(begins) for begins in grid.tolist()]
        best = int(np.argmin(misfits))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        least, begins = misfits[best], float(grid[best])
        grid = np.linspace(low, high, _LEAST_FITTED // 4)
    return least, begins


def _believed(
    displacement: Floats, force: Floats, time: Floats, count: int, noise: float, first: int, slope: float
) -> bool:
    """Whether what looks like a drift is none of the foot of a law that rises otherwise than Hertz's; `first` samples
    lie in the air.

    A contact does not lower the force; a drift is still there where the way back has returned, or left the contact; a
    small noise shows how straight the samples in the air are.
    """
    if slope < 0:
        return True
    returned = count + int(np.argmin(displacement[count:])) if count < len(force) else 0
    free = max(displacement[0] + _BACK * float(np.ptp(displacement)), displacement[first - 1])
    if returned and displacement[returned] <= free:
        expected = slope * float(time[returned] - time[0])
        return abs(float(force[returned] - force[0]) - expected) < 0.5 * expected + 4 * noise
    return noise < _QUIET * float(np.ptp(force))


FAR = 100.0  # times the declared modulus, or the other curves'
_RUBBER_MPA = 0.003, 300.0
_ELASTOMER_MPA = 0.02, 300.0  # from gels to the hardest polyurethanes
_AS_NEAR = 1.0  # decades: another slip that brings the modulus about as near to that of elastomers
# Of a slip in words: the decades by which the force, and by which the displacement, is put right
_SLIPS = {
    "N for mN": (-3, 0),
    "N for µN": (-6, 0),
    "N for kN": (3, 0),
    "mm for m": (0, 3),
    "mm for µm": (0, -3),
    "mm for nm": (0, -6),
}
_LAW = {"indentation": 1.5, "compression": 1.0}  # powers of the displacement that a force goes with


def implausible(campaign: Campaign) -> list[Finding]:
    """Of each kind of curve that all of them, or two of them, need a modulus that they cannot have; none where
    `units_checked` confirms the units."""
    if campaign.units_checked:
        return []
    kinds: dict[str, list[CurveRecording]] = {}
    for entry in campaign.recordings:
        if isinstance(entry, IndentationRecording | CompressionRecording):
            kinds.setdefault(entry.kind, []).append(entry)
    return [finding for curves in kinds.values() for finding in contradictions(campaign.skin, curves)]


def contradictions(skin: SkinDescription, curves: Sequence[CurveRecording]) -> list[Finding]:
    """All curves of one kind far from the declared modulus, or from what rubber can be; two far from each other."""
    modulus = np.array([apparent_mpa(entry, skin.poisson_ratio) for entry in curves])
    if not np.isfinite(modulus).any():
        return []
    usual, declared = float(np.nanmedian(modulus)), skin.youngs_modulus_mpa
    low, high = _RUBBER_MPA if declared is None else (declared / FAR, declared * FAR)
    if len(curves) == 2 and modulus.max() > FAR * modulus.min():
        first, second = modulus.tolist()
        return [Finding(Reason.TWO_MODULI, "", "force_n", {"first_mpa": first, "second_mpa": second})]
    if low <= usual <= high:
        return []
    needed: dict[str, Any] = {"modulus_mpa": usual, "slips": _slips(usual, declared, _LAW[curves[0].kind])}
    if declared is not None:
        return [Finding(Reason.MODULUS_BESIDE_DECLARED, "", "force_n", {**needed, "declared_mpa": declared})]
    return [Finding(Reason.MODULUS_BESIDE_RUBBER, "", "force_n", {**needed, "low_mpa": low, "high_mpa": high})]


def _slips(modulus_mpa: float, declared_mpa: float | None, power: float) -> tuple[str, ...]:
    """The slips of units that bring a modulus nearest to what is declared, or usual for elastomers."""
    low, high = _ELASTOMER_MPA if declared_mpa is None else (declared_mpa / FAR, declared_mpa * FAR)
    middle = float(np.log10(low * high)) / 2
    decades = {words: np.log10(modulus_mpa) + force - power * travel for words, (force, travel) in _SLIPS.items()}
    off = {
        words: abs(meant - middle) for words, meant in decades.items() if abs(meant - middle) <= np.log10(high) - middle
    }
    return tuple(words for words in sorted(off, key=off.__getitem__) if off[words] <= min(off.values()) + _AS_NEAR)


def apparent_mpa(entry: CurveRecording, poisson_ratio: float) -> float:
    """NaN where the curve does not press."""
    finite = np.isfinite(entry.displacement_mm) & np.isfinite(entry.force_n)
    place: Floats = entry.displacement_mm[finite]
    force: Floats = entry.force_n[finite]
    if len(place) < 2:
        return float("nan")
    if isinstance(entry, IndentationRecording):
        load, moved = _pressed(place, force)
        return float(0.75 * (1 - poisson_ratio**2) * load / (np.sqrt(entry.indenter_radius_mm) * moved**1.5))
    at = int(np.argmax(np.abs(force)))
    load, moved = abs(force[at] - force[0]), abs(place[at] - place[0])
    if not load or not moved:
        return float("nan")
    return float(load / (np.pi / 4 * entry.sample_diameter_mm**2) / (moved / entry.sample_height_mm))


def _pressed(place: Floats, force: Floats) -> tuple[float, float]:
    """The force of a sphere where it is deepest, and the way there from contact; NaN where it is not pressed there: a
    sphere may come a long way through the air, and what sticks pulls harder than it was pressed."""
    seen = course(place, force)
    before = seen.air[seen.air < seen.turn]
    begin = float(place[before[-1]]) if len(before) else float(place[0])
    load, moved = float(force[seen.turn]) - seen.zero, float(place[seen.turn]) - begin
    return (load, moved) if load > 0 and moved > 0 else (float("nan"), 1.0)
