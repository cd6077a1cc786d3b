"""Curves whose columns of force and displacement look exchanged.

A stage travels at the speed that it was told, and the force follows: it stays at its zero as long as the sphere or the
platen is in the air, and rises ever faster in a contact. Where instead the "force" moves steadily while the
"displacement" first stands still, or follows it as a force follows a travel, the two are exchanged; of a block only
where it does both, as a displacement may begin late, by play of the extensometer. No material does
that: what is pressed harder is pressed deeper, by Hertz as F^(2/3), never with an exponent above 1.
"""

import numpy as np

from underskin.errors import unusable
from underskin.recordings.campaign import CurveRecording, IndentationRecording
from underskin.recordings.curve_jumps import roughness
from underskin.units import Floats

_LEAST = 32  # samples on the way in
_TURN = 0.99  # of the largest excursion: the way in, without a hold
_STILL = 6.0  # times the noise of one sample: a mean over a block that has not moved
_LEAST_STILL = 0.02  # of its range
_STAYS = 0.8  # of the blocks after the first that moved: a force that snaps in passes its zero once more
_STANDS = 0.15  # of the samples on the way in, at the least
_STEADY = 3.0  # ratio of two mean speeds of a stage on its way
_BLOCKS = 40  # of the way in
_UNIFORM = 0.03  # of its range: the departure of a steady travel from a straight line
_FOLLOWS = 0.4  # of its way where the other has gone half of its own: (1/2)^(3/2) is 0.35, (1/2)^(2/3) is 0.63
_LAGS = 0.49  # the same of a block: it is 0.488 of a neo-Hookean one at 5 % strain, and 1/2 of a straight line


def require_own_columns(recording: CurveRecording) -> None:
    """Raises InvalidInput where force and displacement of a curve look exchanged."""
    if are_exchanged(recording):
        seen = "moves as a force does, and force_n as a stage"
        raise unusable("displacement_mm", seen, "the two columns look exchanged: exchange their names or channels")


def are_exchanged(recording: CurveRecording) -> bool:
    """Whether force and displacement of a curve look exchanged."""
    is_sphere = isinstance(recording, IndentationRecording)
    return look_exchanged(recording.displacement_mm, recording.force_n, sphere=is_sphere)


def look_exchanged(displacement: Floats, force: Floats, *, sphere: bool) -> bool:
    """Whether force (samples,) moves as a stage does, and displacement as a force; only a `sphere` tells it without
    samples in the air."""
    if len(displacement) != len(force) or not np.ptp(displacement) or not np.ptp(force):
        return False
    excursion = np.abs(force - force[0])
    end = int(np.argmax(excursion >= _TURN * excursion.max())) + 1
    if end < _LEAST:
        return False
    travel, load = force[:end], displacement[:end]
    if roughness(travel) / np.ptp(travel) > roughness(load) / max(np.ptp(load), 1e-300):
        return False
    stands = _stands_first(load, travel)
    if sphere:
        return stands > 0 or _follows(load, travel)
    return stands > 0 and _lags(load[stands:], travel[stands:])


def _stands_first(load: Floats, travel: Floats) -> int:
    """The samples for which the first column stands still, on the first part of a way that the second goes steadily; 0
    where it does not."""
    parts = np.array_split(load, min(_BLOCKS, len(load) // 2))
    means, places = np.array([part.mean() for part in parts]), np.cumsum([len(part) for part in parts])
    still = max(_STILL * roughness(load) / np.sqrt(len(parts[0])), _LEAST_STILL * float(np.ptp(load)))
    moved = np.abs(means - means[0]) > still
    if not moved.any():
        return 0
    stands = int(places[np.argmax(moved) - 1])
    if stands < _STANDS * len(load) or moved[np.argmax(moved) :].mean() < _STAYS:
        return 0
    return stands if _is_steady(travel[:stands]) and _is_alike(travel, stands) else 0


def _lags(load: Floats, travel: Floats) -> bool:
    """Whether the first column has gone less than half of its way where the second has gone half: so the force on a
    block, that stiffens as it is pressed; a displacement that begins late, by play, is ahead."""
    few = max(len(load) // _BLOCKS, 1)
    gone = np.abs(travel - travel[0])
    at = max(int(np.argmax(gone >= gone[-1] / 2)), few)
    begin, half, end = (float(part.mean()) for part in (load[:few], load[at - few : at + few], load[-few:]))
    return end != begin and (half - begin) / (end - begin) < _LAGS


def _is_steady(way: Floats) -> bool:
    """Whether both halves of a way are gone in one direction, at about the same speed."""
    first, second = way[len(way) // 2] - way[0], way[-1] - way[len(way) // 2]
    return bool(first * second > 0 and 1 / _STEADY < first / second < _STEADY)


def _is_alike(way: Floats, at: int) -> bool:
    """Whether the parts of a way before and after a sample are gone in one direction, at about the same speed."""
    before, after = (way[at - 1] - way[0]) / at, (way[-1] - way[at - 1]) / (len(way) - at + 1)
    return bool(before * after > 0 and 1 / _STEADY < before / after < _STEADY)


def _follows(load: Floats, travel: Floats) -> bool:
    """Whether the second column goes at one speed, and the first lags behind it as the force on a sphere does."""
    samples = np.arange(len(travel))
    line = np.polyval(np.polyfit(samples, travel, 1), samples)
    if np.abs(travel - line).max() > _UNIFORM * np.ptp(travel):
        return False
    few = max(len(load) // _BLOCKS, 1)
    begin, half, end = (
        float(load[place : place + few].mean()) for place in (0, (len(load) - few) // 2, len(load) - few)
    )
    return end != begin and (half - begin) / (end - begin) < _FOLLOWS
