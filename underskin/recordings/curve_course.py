"""Landmarks of force-displacement curves: noise, turning point, hold, jumps, air; and slips of units of whole curves.

Displacement grows into the sample. Everything is determined from the samples without a contact law, except a drift of
the force in air, which is separated from the foot of a Hertzian contact.

Slips of units are judged by the apparent modulus: for a cylinder (F/A)/(u/height) at the largest force, u from the
first sample; for a sphere 3 (1 − ν²) F/(4 √R u^1.5) at the deepest sample, u from the end of the air. Only its order of
magnitude matters.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
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
from underskin.units import FORCES, Floats, Indices, Mask

_BEYOND_NOISE = 3.0  # standard deviations; a false jump only ends a mean early


def finite_rows(curve: CurveRecording) -> Indices:
    """The samples of a curve at which displacement and force are finite."""
    return np.flatnonzero(np.isfinite(curve.displacement_mm) & np.isfinite(curve.force_n))


def samples_of(curve: CurveRecording, rows: Indices) -> CurveRecording:
    """A curve with only some of its samples."""
    time = None if curve.time_s is None else curve.time_s[rows]
    return replace(curve, displacement_mm=curve.displacement_mm[rows], force_n=curve.force_n[rows], time_s=time)


def roughness(force: Floats) -> float:
    """The noise (standard deviation) of a raw sample from second differences, which are small for a smooth curve; if
    not, the estimate is too large (conservative)."""
    second = force[2:] - 2 * force[1:-1] + force[:-2]
    if not len(second):
        return 0.0
    noise = 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
    steps = np.abs(np.diff(force))
    steps = steps[steps > 0]
    quantum = float(steps.min()) if len(steps) else 0.0
    coarse = len(np.unique(force)) < len(force) / 2  # an analog-digital converter's steps show
    return float(np.hypot(noise, quantum / np.sqrt(12.0))) if coarse else noise


_OTHER_SIGN = 0.1  # of the largest force, below which forces of the other sign are noise or an error of the zero


def is_one_sided(force: Floats) -> bool:
    """Whether a cylinder is only compressed or only pulled."""
    low, high = float(np.min(force)), float(np.max(force))
    return min(high, -low) < _OTHER_SIGN * max(high, -low)


def hidden_samples(displacement: Floats) -> int:
    """The number of samples, at least 1, over which the displacement moves by twice the noise of their mean.

    Noise σ and a step s from sample to sample: n s = 2 σ/√n.
    """
    step = float(np.ptp(displacement)) / max(int(displacement.argmax()), 1)
    return max(1, int((2 * roughness(displacement) / step) ** (2 / 3))) if step > 0 else 1


def jumps(force: Floats, noise: float, block: int) -> Indices:
    """The first samples (jumps,) after discontinuities that means over `block` samples would smooth out.

    `noise` is the standard deviation of one sample. The difference of the means of the blocks ahead and behind is
    compared with a third of that of the blocks beyond these, equal to it on a straight line; the jump is the largest
    change between two samples near there.
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
    """The index of the largest change from `first` to `last`."""
    first = max(first, 0)
    return first + int(np.argmax(change[first : last + 1]))


_BLOCKS = 60  # blocks of a curve, between whose means jumps are sought
_AIR = 5  # least number of samples that determine the force in air
_BEYOND_JUMP, _LEAST_JUMP = 6.0, 2e-3  # least jump of contact: standard deviations, and of the range of force
_HOLD_STEP = 0.2  # of the median step between samples, below which a sphere is held
_HOLD_BLOCK = 8  # samples of a block in the search for a hold
_HOLD_EDGE_NOISES, _AS_NOISE = 4.0, 1.5  # standard deviations of a mean; times the noise about the mean of a hold
_HIDDEN = 24.0  # times the noise: least travel of a sphere moving for as long as the hold
_FITTED, _LEAST_FITTED, _CLOSER = 200, 40, 3  # samples of the fit of a drift in air; refinements of its grid
_LEAST_AIR, _SHORTER = 0.1, 0.9  # least share of samples in air; factor by which that part is shortened until straight
_PLAIN = 60.0  # least F statistic of a drift
RETURN = 0.05  # of the range of displacement: smaller returns are noise
_SAMPLED = 20_000  # samples among which turns are sought
_BACK = 0.25  # of the range of displacement, from its start
_QUIET = 3e-3  # noise of a quiet force, of its range
_STRAIGHT = 1.5  # times the noise: largest scatter of samples about the line of a drift
_LOW = 0.3  # of the range of force: the foot of a contact
_AIR_NOISES, LEAST_CONTACT = 4.0, 1e-3  # standard deviations, and of the largest force: less is out of contact
_LINE = 3  # samples, of which a straight line leaves scatter
_RISE = 0.02  # of the range of force: below it a sphere has not yet pressed
_LEAST_HELD = 8  # samples of a hold
_ROUNDING = 1e-9  # of the range of displacement, in arithmetic
PACE = 0.5  # of the stage's speed: creep is slower


@dataclass(frozen=True)
class CurveLandmarks:
    """Landmarks of one curve. `air`: the samples before or after contact, empty where none were recorded.

    `snap_in` and `pull_off` are the first samples after those events, `detaches` the last one before the latter: of a
    jump that before it, else that of least force; None without one.
    """

    noise: float  # standard deviation of a sample of force
    turn: int  # the deepest sample
    arrive: int  # the first sample of the hold there
    leave: int  # the last one
    snap_in: int | None
    detaches: int | None
    pull_off: int | None
    air: Indices
    zero: (
        float  # force in air (less the drift where the air is after contact), or of the first or the least deep sample
    )
    drift: float  # of the force in air per time, where significant; else 0

    @property
    def has_air(self) -> bool:
        """Whether the force's zero is known from samples."""
        return len(self.air) >= _AIR


def touch(displacement: Floats, snap_in: int) -> float:
    """The approximate contact point of a sphere that snaps in at this sample: half a step of the stage beyond the
    sample before, since a compliant stage lets the sphere jump further in."""
    before = displacement[max(snap_in - 2, 0) : snap_in + 1]
    steps = np.diff(before)
    return float(before[-2] + 0.5 * max(min(steps), 0.0)) if len(before) > 1 else float(displacement[0])


def snap_in_interval(displacement: Floats, force: Floats, time: Floats | None) -> tuple[float, float, float] | None:
    """The displacements [mm] of the samples before and after a snap-in, with the estimated contact point as the middle
    one; None where no snap-in is seen."""
    seen = curve_landmarks(displacement, force, time)
    if not seen.snap_in:
        return None
    before, after = displacement[seen.snap_in - 1 : seen.snap_in + 1].tolist()
    contact_point = touch(displacement, seen.snap_in)
    return (before, contact_point, after) if before < contact_point < after else None


def visible_contact(displacement: Floats, force: Floats, time: Floats | None) -> tuple[Mask, Mask]:
    """For which samples (samples,) a snap-in or a pull-off shows whether there is contact, and which are in contact.

    The pull-off shows it of the way back, the snap-in of the way in, where contact ends with a pull-off or not at all.
    """
    seen = curve_landmarks(displacement, force, time)
    number = np.arange(len(force))
    returns = float(displacement[seen.turn] - displacement[-1]) > RETURN * float(np.ptp(displacement))
    in_contact = number >= (0 if seen.snap_in is None else seen.snap_in)
    if seen.pull_off is not None:
        in_contact &= number < seen.pull_off
    known = np.full(len(number), seen.pull_off is not None)
    known[: seen.turn + 1] = seen.snap_in is not None and (seen.pull_off is not None or not returns)
    known[seen.turn + 1 :] |= known[0]
    return known, in_contact


def contact_events(curve: CurveRecording) -> list[Finding]:
    """The snap-in of a sphere, at the first sample in contact, and its pull-off, at the last one, as a finding; none
    without."""
    columns = [curve.displacement_mm, curve.force_n, *([] if curve.time_s is None else [curve.time_s])]
    finite = np.isfinite(np.stack(columns)).all(axis=0)
    displacement, force, *time = (column[finite] for column in columns)
    if not (curve.has_sphere and len(force)):
        return []
    seen = curve_landmarks(displacement, force, *time)
    clock = time[0] if time else np.arange(float(len(force)))
    in_air = seen.zero + seen.drift * (clock - (np.median(clock[seen.air]) if seen.drift else 0.0))
    events = {
        name: {
            "displacement_mm": float(displacement[sample]),
            "time_s": float(time[0][sample]) if time else None,
            "force_n": float(force[sample] - in_air[sample]),
        }
        for name, sample in (("snap_in", seen.snap_in), ("pull_off", seen.detaches))
        if sample is not None
    }
    return [Finding(Reason.CONTACT_EVENTS, curve.id, "force_n", {"events": events})] if events else []


def turning_points(travel: Floats) -> Indices:
    """The samples between which the travel is monotonic, except for returns below a twentieth of its range; includes
    the first and the last sample."""
    at = np.unique(np.linspace(0, len(travel) - 1, min(len(travel), _SAMPLED)).round().astype(np.intp))
    values, least = travel[at].tolist(), RETURN * float(np.ptp(travel))
    turns, extreme, direction = [0], 0, 0
    for index, value in enumerate(values):
        if direction == 0:
            if abs(value - values[0]) > least:
                direction, extreme = (1 if value > values[0] else -1), index
        elif (value - values[extreme]) * direction >= 0:
            extreme = index
        elif (values[extreme] - value) * direction > least:
            turns.append(extreme)
            direction, extreme = -direction, index
    return at[np.unique([*turns, len(values) - 1])]


def foot(displacement: Floats, force: Floats) -> int | None:
    """The sample of an approach (samples,) from which the force rises by Hertz's law; None for too few samples.

    F = b + k (d − d0)^(3/2) by least squares over a grid of d0, to the samples before the force is large.
    """
    high = np.flatnonzero(force - force[: max(len(force) // 50, 3)].mean() > _LOW * float(np.ptp(force)))
    count = int(high[0]) if len(high) else len(force)
    at = np.unique(np.linspace(0, count - 1, min(count, _FITTED)).round().astype(int))
    if len(at) < _LEAST_FITTED:
        return None
    travel, measured = displacement[at], force[at]

    def misfit(contact_point: float) -> float:
        hertz = np.maximum(travel - contact_point, 0.0) ** 1.5
        hertz, about = hertz - hertz.mean(), measured - measured.mean()
        square = float(hertz @ hertz)
        return float(about @ about) - (float(hertz @ about) ** 2 / square if square > 0 else 0.0)

    return int(np.argmax(displacement > _least(travel, misfit)[1]))


def creeps_under_force(displacement: Floats, force: Floats, time: Floats, noise: Floats) -> bool:
    """Whether a sphere sinks in under a held force, by samples and their `noise` of force (samples,): up to the deepest
    one the force stays within noise, over some of the travel and at less than half of the speed before."""
    turn = int(np.argmax(displacement))
    off = np.abs(force[: turn + 1] - force[turn]) > _AIR_NOISES * np.hypot(noise[: turn + 1], noise[turn])
    first = turn + 1 - int(np.argmax(off[::-1])) if off.any() else 0
    begun = np.flatnonzero(force[:first] > force[turn] / 2)  # the second half of the force's rise
    if not len(begun) or not time[turn] > time[first] > time[begun[0]]:
        return False
    sunk, risen = displacement[turn] - displacement[first], displacement[first] - displacement[begun[0]]
    slows = sunk / (time[turn] - time[first]) < PACE * risen / (time[first] - time[begun[0]])
    return bool(slows and sunk > RETURN * np.ptp(displacement))


def presses_again(displacement: Floats) -> bool:
    """Whether a curve is loaded again after its way back, by more than a twentieth of its range."""
    least = RETURN * np.ptp(displacement)
    returned = np.flatnonzero(np.maximum.accumulate(displacement) - displacement > least)
    after = displacement[returned[0] :] if len(returned) else displacement[:1]
    return bool((after - np.minimum.accumulate(after)).max() > least)


def curve_landmarks(displacement: Floats, force: Floats, time: Floats | None = None) -> CurveLandmarks:
    """The landmarks of finite samples (samples,); without times, evenly sampled ones are assumed."""
    time = np.arange(float(len(force))) if time is None else time
    return _landmarks(*(np.asarray(column, dtype=float).tobytes() for column in (displacement, force, time)))


@lru_cache(maxsize=256)  # a diagnosis needs them for every model of the same recordings
def _landmarks(*columns: bytes) -> CurveLandmarks:
    displacement, force, time = map(np.frombuffer, columns)
    noise = roughness(force)
    block = int(np.ceil(len(force) / _BLOCKS))
    turn = _deepest(displacement)
    span = float(np.ptp(force))
    least = np.maximum(_BEYOND_JUMP * noise, _LEAST_JUMP * span)
    snap_in, pull_off = _jumps_of_contact(force, turn, noise, block)
    arrive, leave = _hold(displacement, turn)
    way_in = slice(turn + 1)
    drifting = (
        None if snap_in is not None else _straight_air(displacement[way_in], force[way_in], time[way_in], noise, 1.0)
    )
    if drifting is not None and not _is_plausible_drift(displacement, force, time, turn + 1, noise, *drifting):
        drifting = None
    drifting_after = None
    if drifting is None and snap_in is None and pull_off is None:
        drifting_after = _drifting_after(displacement, force, time, leave, noise)
    _, drift = drifting or drifting_after or (0, 0.0)
    level = force - drift * (time - time[0])
    if pull_off is None and drift:
        _, pull_off = _jumps_of_contact(level, turn, noise, block)
    detaches = None if pull_off is None else pull_off - 1
    if pull_off is None:
        start_force = float(np.median(level[: max(3, block)]))
        detaches, pull_off = _slow_pull_off(displacement, level - start_force, turn, noise, least)
    if drifting is not None:
        air = np.arange(drifting[0])
    elif drifting_after is not None:
        air = np.arange(max(len(force) - drifting_after[0], pull_off or 0), len(force))
    else:
        air = _air(force, turn, snap_in, pull_off, noise, span)
    measured = level if drifting_after is not None else force
    shallowest = 0 if turn >= _AIR else int(displacement.argmin())  # recorded from the deepest sample on
    zero = float(np.median(measured[air])) if len(air) >= _AIR else float(force[shallowest])
    return CurveLandmarks(noise, turn, arrive, leave, snap_in, detaches, pull_off, air, zero, drift)


def _jumps_of_contact(force: Floats, turn: int, noise: float, block: int) -> tuple[int | None, int | None]:
    """The first samples after a jump from the air into contact, and after one back into it; None without one."""
    span = float(np.ptp(force))
    jump_samples = jumps(force, float(np.hypot(noise, 1e-3 * span)), block)
    least = np.maximum(_BEYOND_JUMP * noise, _LEAST_JUMP * span)
    start_force, end_force = (float(np.median(part)) for part in (force[: max(3, block)], force[-max(3, block) :]))
    few = max(2, min(block, 5))
    before = np.array([np.median(force[max(sample - few, 0) : max(sample, 1)]) for sample in jump_samples.tolist()])
    after = np.array([np.median(force[sample : sample + few]) for sample in jump_samples.tolist()])
    step = after - before
    in_air = least + _RISE * span
    down = np.flatnonzero(
        (jump_samples < turn) & (step < -least) & (np.abs(before - start_force) < in_air) & (jump_samples > few)
    )
    up = np.flatnonzero((jump_samples > turn) & (step > least) & (np.abs(after - end_force) < in_air))
    snap_in = (
        int(jump_samples[down[np.argmin(step[down])]])
        if len(down)
        else _single_snap(force[: turn + 1], start_force, noise)
    )
    return snap_in, int(jump_samples[up[np.argmax(step[up])]]) if len(up) else None


def pressed_depth(displacement: Floats, force: Floats, time: Floats | None = None) -> float:
    """The travel of a sphere from its last sample in the air, or from the first sample, to the deepest one."""
    landmarks = curve_landmarks(displacement, force, time)
    before = landmarks.air[landmarks.air < landmarks.turn]
    return float(displacement[landmarks.turn] - displacement[before[-1] if len(before) else 0])


def back_in_air(displacement: Floats, force: Floats, turn: int, noise: float) -> tuple[int, Floats] | None:
    """The first sample after the deepest one whose force, less that in the air, is no more than noise; and the distance
    of the force from there on from the straight line, over the travel, through the second half of these samples. None
    where too few follow for a line."""
    after = np.flatnonzero(force[turn + 1 :] <= max(_AIR_NOISES * noise, LEAST_CONTACT * float(np.abs(force).max())))
    end = turn + 1 + int(after[0]) if len(after) else len(force)
    half = end + (len(force) - end) // 2
    if len(force) - half <= _LINE:
        return None
    travel = displacement[end:] - displacement[half:].mean()
    air, about = travel[half - end :], force[half:] - force[half:].mean()
    square = float(air @ air)
    slope = float(air @ about) / square if square > 0 else 0.0
    return end, force[end:] - force[half:].mean() - slope * travel


def leaves_line(away: Floats, noise: float, least: float) -> Indices:
    """The first samples of pairs beyond the line of the air, whose second half `away` (samples,) shows the scatter: of
    thousands of samples in the air, single ones are by chance."""
    beyond = np.abs(away) > max(_AIR_NOISES * noise, least, _AIR_NOISES * float(away[len(away) // 2 :].std()))
    return np.flatnonzero(beyond[:-1] & beyond[1:])


def _slow_pull_off(
    displacement: Floats, force: Floats, turn: int, noise: float, least: float
) -> tuple[int, int] | tuple[None, None]:
    """Of a sphere that comes off without a jump, the sample of least force, and the first one back in the air.

    A sphere that still sticks pulls the force below the air. Strands of a gel, or a slow cell, draw its end out.
    """
    air = back_in_air(displacement, force, turn, noise)
    if air is None:
        return None, None
    end, away = air
    off = leaves_line(away, noise, least)
    if not len(off) or away[off].min() > -least:
        return None, None
    return end + int(np.argmin(away)), end + int(off[-1]) + 2


def _deepest(displacement: Floats) -> int:
    """The deepest sample of a moving mean over `hidden_samples`."""
    count = hidden_samples(displacement)
    from scipy.ndimage import uniform_filter1d  # takes 0.2 s to load, which few need

    return int(np.argmax(uniform_filter1d(displacement, count, mode="nearest") if count > 1 else displacement))


def _single_snap(force: Floats, air_force: float, noise: float) -> int | None:
    """A snap-in during the approach that lasts a single sample, so that block means do not show it: one of the last
    samples no higher than the force in air, `air_force`; None without one."""
    low = np.flatnonzero(force <= air_force + _BEYOND_JUMP * noise)
    if not len(low) or not noise > 0:
        return None
    first = max(int(low[-1]) - _AIR, _AIR)
    fallen = [
        sample
        for sample in range(first, int(low[-1]) + 1)
        if force[sample] < np.median(force[sample - _AIR : sample]) - _BEYOND_JUMP * noise
        and force[sample] < force[sample - 1] - _BEYOND_JUMP * noise
    ]
    return fallen[0] if fallen else None


def fall_while_held(curve: CurveRecording) -> float:
    """The share of the force that is lost while the largest displacement is held, of a prepared curve; 0 without a hold
    over which the displacement stays within its noise, or within the noise of the force."""
    rows = finite_rows(curve)
    travel, force = (np.asarray(column, dtype=float)[rows] for column in (curve.displacement_mm, curve.force_n))
    if len(rows) < _LEAST_HELD:
        return 0.0
    top = int(np.argmax(np.abs(force - force[0])))
    travel, force = (column * (1.0 if force[top] >= force[0] else -1.0) for column in (travel, force))
    course = curve_landmarks(travel, force)
    rests, held = travel[course.arrive : course.leave + 1], force[course.arrive : course.leave + 1] - course.zero
    if len(held) < _LEAST_HELD or not held.max() > 0:
        return 0.0
    if np.std(rests) > _AS_NOISE * roughness(rests) + _ROUNDING * np.ptp(travel):
        return 0.0
    few = max(len(held) // 50, 1)
    lost, noise = held[:few].mean() - held[-few:].mean(), course.noise * np.sqrt(2 / few)
    return float(lost / held[:few].mean()) if lost > _AIR_NOISES * noise else 0.0


def _hold(displacement: Floats, turn: int) -> tuple[int, int]:
    """The first and the last sample of the hold around the deepest sample.

    With a noisy displacement, a hold is extended by blocks while their means agree with its own, and counts only where
    it is much longer than noise would hide of a turn. Otherwise it begins at the deepest sample and ends with the first
    step.
    """
    noise = roughness(displacement)
    steps = np.abs(np.diff(displacement[turn:], append=-np.inf))
    resting = steps <= _HOLD_STEP * float(np.median(np.abs(np.diff(displacement)))) + 1e-300
    plain = turn, turn + int(np.argmin(resting))
    starts = [turn - _HOLD_BLOCK, turn - _HOLD_BLOCK // 2, turn]
    starts = [start for start in starts if start >= 0 and start + _HOLD_BLOCK <= len(displacement)]
    if not noise > 0 or not starts:
        return plain
    low = min(starts, key=lambda start: float(np.std(displacement[start : start + _HOLD_BLOCK])))
    high = low + _HOLD_BLOCK
    while True:
        hold = displacement[low:high]
        least = _HOLD_EDGE_NOISES * noise * np.sqrt(1 / _HOLD_BLOCK + 1 / len(hold))
        before, after = displacement[max(low - _HOLD_BLOCK, 0) : low], displacement[high : high + _HOLD_BLOCK]
        earlier, later = (len(part) and abs(part.mean() - hold.mean()) < least for part in (before, after))
        if not (earlier or later):
            break
        low, high = low - len(before) * bool(earlier), high + len(after) * bool(later)
    beyond = [displacement[max(low - 2 * _HOLD_BLOCK, 0) : low], displacement[high : high + 2 * _HOLD_BLOCK]]
    falls = [(hold.mean() - part.mean()) / len(part) for part in beyond if len(part) == 2 * _HOLD_BLOCK]
    # Least speed of the moving sphere: next to the hold, where noise may hide it, and over the whole approach
    speed = min([*falls, float(np.ptp(displacement)) / max(turn, 1)]) if falls else 0.0
    is_still = bool(np.std(hold) < _AS_NOISE * noise)
    return (low, high - 1) if is_still and speed > 0 and len(hold) * speed > _HIDDEN * noise else plain


def _air(force: Floats, turn: int, snap_in: int | None, pull_off: int | None, noise: float, span: float) -> Indices:
    """The samples in air: up to the snap-in, or while the force stays at its initial value; else those after
    contact."""
    if snap_in is not None:
        return np.arange(snap_in)
    start_force = float(np.median(force[: max(3, min(turn, len(force)) // 50)])) if turn else float(force[0])
    off = np.abs(force[: turn + 1] - start_force) > max(4 * noise, _RISE * span)
    staying = off[::-1].cumprod()[::-1].astype(bool)  # from where it stays off
    first = int(np.argmax(staying)) if staying.any() else 0
    if first >= _AIR:
        return np.arange(first)
    return np.arange(pull_off, len(force)) if pull_off is not None else np.zeros(0, dtype=np.intp)


def _drifting_after(
    displacement: Floats, force: Floats, time: Floats, leave: int, noise: float
) -> tuple[int, float] | None:
    """The number of samples in air after contact, and their drift of force per time; None where it is not significant,
    or does not connect the initial with the final force."""
    after = slice(None, leave, -1)
    air = _straight_air(displacement[after], force[after], time[after], noise, _LEAST_AIR)
    if air is None:
        return None
    expected = air[1] * float(time[-1] - time[0])
    return air if abs(float(force[-1] - force[0]) - expected) < 0.5 * abs(expected) + 4 * noise else None


def _straight_air(
    displacement: Floats, force: Floats, time: Floats, noise: float, least: float
) -> tuple[int, float] | None:
    """The number of samples before contact, of samples from air to the deepest one, and the drift of the force per
    time; None without a significant drift.

    F = b + s t + k (d − d0)^(3/2) by least squares with and without the drift s over a grid of contact points d0. The
    samples before d0, or the first of them but at least a share `least`, must lie on a straight line: with a law that
    rises differently from Hertz's, contact begins earlier, and its foot would pass for air.
    """
    count = len(displacement)
    at = np.linspace(0, count - 1, min(count, _FITTED)).round().astype(int)
    if len(at) < _LEAST_FITTED or not np.ptp(time) > 0:
        return None
    travel, columns = displacement[at], np.column_stack([np.ones(len(at)), (time[at] - time[0]) / np.ptp(time)])

    def misfit(contact_point: float, drifts: bool) -> float:
        hertz = np.maximum(travel - contact_point, 0.0) ** 1.5
        design = np.column_stack([hertz, columns[:, : 1 + drifts]])
        residual = force[at] - design @ np.linalg.lstsq(design, force[at], rcond=None)[0]
        return float(residual @ residual)

    (steady, _), (drifting, contact_point) = (
        _least(travel, partial(misfit, drifts=drifts)) for drifts in (False, True)
    )
    first = int(np.argmax(displacement > contact_point))
    if first < _LEAST_AIR * count or steady < (1 + _PLAIN / len(at)) * drifting:
        return None
    shortest = max(least * first, _LEAST_AIR * count)
    while first >= max(shortest, _AIR) and np.ptp(time[:first]) > 0:
        line = np.polyfit(time[:first], force[:first], 1)
        if np.std(force[:first] - np.polyval(line, time[:first])) < _STRAIGHT * noise:
            return first, float(line[0])
        first = int(_SHORTER * first)
    return None


def _least(travel: Floats, misfit: Callable[[float], float]) -> tuple[float, float]:
    """The least misfit over contact points along the approach, and that point: on a grid that is then refined."""
    grid = travel[: len(travel) - _LEAST_FITTED // 2 : 2]
    for _ in range(_CLOSER):
        misfits = [misfit(contact_point) for contact_point in grid.tolist()]
        best = int(np.argmin(misfits))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        least, contact_point = misfits[best], float(grid[best])
        grid = np.linspace(low, high, _LEAST_FITTED // 4)
    return least, contact_point


def _is_plausible_drift(
    displacement: Floats, force: Floats, time: Floats, count: int, noise: float, first: int, slope: float
) -> bool:
    """Whether an apparent drift is one, not the foot of a contact law other than Hertz's; `first` samples are in air.

    Contact does not lower the force; a drift persists where the withdrawal has returned or left the contact; with a
    small noise the straightness of the samples in air decides.
    """
    if slope < 0:
        return True
    returned = count + int(np.argmin(displacement[count:])) if count < len(force) else 0
    free = max(displacement[0] + _BACK * float(np.ptp(displacement)), displacement[first - 1])
    if returned and displacement[returned] <= free:
        expected = slope * float(time[returned] - time[0])
        return abs(float(force[returned] - force[0]) - expected) < 0.5 * expected + 4 * noise
    return noise < _QUIET * float(np.ptp(force))


# Times the declared modulus, or the other curves': half of a gram-force over a newton, the smallest slip that is told
FAR = 0.5 / FORCES["gf"]
# Solid elastomers end near 100 MPa (Ashby, Materials Selection in Mechanical Design, 3rd ed., appendix: 0.002 to 0.1
# GPa); the softest gels that hold a shape have some kPa
_RUBBER_MPA = 0.003, 100.0
_ELASTOMER_MPA = 0.02, 100.0  # without the softest gels
_AS_NEAR = 1.0  # decades: slips within it of the best one are named too
# For each slip of units, the decades by which force and displacement are corrected
_SLIPS = {
    **{f"N for {unit}": (float(np.log10(in_newtons)), 0) for unit, in_newtons in FORCES.items()},
    "mm for m": (0, 3),
    "mm for µm": (0, -3),
    "mm for nm": (0, -6),
}
_LAW = {"indentation": 1.5, "compression": 1.0}  # powers of the displacement that a force goes with


def implausible(campaign: Campaign) -> list[Finding]:
    """For each kind of curve: that all of them, or two of them, need an impossible modulus; none where `units_checked`
    confirms the units."""
    if campaign.units_checked:
        return []
    kinds: dict[str, list[CurveRecording]] = {}
    for curve in campaign.curves:
        kinds.setdefault(curve.kind, []).append(curve)
    return [finding for curves in kinds.values() for finding in contradictions(campaign.skin, curves)]


def contradictions(skin: SkinDescription, curves: Sequence[CurveRecording]) -> list[Finding]:
    """Curves of one kind all far from the declared modulus or from that of rubber; or two curves far apart."""
    modulus = np.array([apparent_mpa(curve, skin.poisson_ratio) for curve in curves])
    if not np.isfinite(modulus).any():
        return []
    median_mpa, declared = float(np.nanmedian(modulus)), skin.youngs_modulus_mpa
    low, high = _RUBBER_MPA if declared is None else (declared / FAR, declared * FAR)
    if len(curves) == 2 and modulus.max() > FAR * modulus.min():
        first, second = modulus.tolist()
        return [Finding(Reason.TWO_MODULI, "", "force_n", {"first_mpa": first, "second_mpa": second})]
    if low <= median_mpa <= high:
        return []
    arguments: dict[str, Any] = {"modulus_mpa": median_mpa, "slips": _slips(median_mpa, declared, _LAW[curves[0].kind])}
    if declared is not None:
        return [Finding(Reason.MODULUS_BESIDE_DECLARED, "", "force_n", {**arguments, "declared_mpa": declared})]
    return [Finding(Reason.MODULUS_BESIDE_RUBBER, "", "force_n", {**arguments, "low_mpa": low, "high_mpa": high})]


def _slips(modulus_mpa: float, declared_mpa: float | None, power: float) -> tuple[str, ...]:
    """The slips of units that bring a modulus nearest to the declared one, or to those usual for elastomers."""
    low, high = _ELASTOMER_MPA if declared_mpa is None else (declared_mpa / FAR, declared_mpa * FAR)
    middle = float(np.log10(low * high)) / 2
    decades = {words: np.log10(modulus_mpa) + force - power * travel for words, (force, travel) in _SLIPS.items()}
    distances = {
        words: abs(decade - middle)
        for words, decade in decades.items()
        if abs(decade - middle) <= np.log10(high) - middle
    }
    return tuple(
        words
        for words in sorted(distances, key=distances.__getitem__)
        if distances[words] <= min(distances.values()) + _AS_NEAR
    )


def apparent_mpa(curve: CurveRecording, poisson_ratio: float) -> float:
    """The apparent modulus [MPa]; NaN where the curve does not load."""
    finite = finite_rows(curve)
    displacement: Floats = curve.displacement_mm[finite]
    force: Floats = curve.force_n[finite]
    if len(displacement) < 2:
        return float("nan")
    return _APPARENT[curve.kind](curve, displacement, force, poisson_ratio)


def _of_sphere(curve: IndentationRecording, displacement: Floats, force: Floats, poisson_ratio: float) -> float:
    """At the deepest sample, from the contact point: the approach through air may be long, and adhesion may exceed the
    load."""
    landmarks = curve_landmarks(displacement, force)
    load, moved = float(force[landmarks.turn]) - landmarks.zero, pressed_depth(displacement, force)
    if not (load > 0 and moved > 0):
        return float("nan")
    return float(0.75 * (1 - poisson_ratio**2) * load / (np.sqrt(curve.indenter_radius_mm) * moved**1.5))


def _of_cylinder(curve: CompressionRecording, displacement: Floats, force: Floats, _: float) -> float:
    at = int(np.argmax(np.abs(force)))
    load, moved = abs(force[at] - force[0]), abs(displacement[at] - displacement[0])
    if not load or not moved:
        return float("nan")
    return float(load / (np.pi / 4 * curve.sample_diameter_mm**2) / (moved / curve.sample_height_mm))


_APPARENT: Mapping[str, Callable[[Any, Floats, Floats, float], float]] = {
    "indentation": _of_sphere,
    "compression": _of_cylinder,
}
