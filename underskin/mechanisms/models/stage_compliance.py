"""The indentation under a stage that gives while the body relaxes: δ + F/k = travel, F following all of δ's history."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated
from underskin.mechanisms.models.indentation_law import Sphere
from underskin.mechanisms.models.receding_contact import Presses, relaxing
from underskin.units import Floats

_STEPS = 25
_TOLERANCE = 1e-8  # of the largest travel, of the last step


def relaxing_on_stage(
    spheres: Sphere, travel: Differentiated, presses: Presses
) -> tuple[Differentiated, NDArray[np.bool_], NDArray[np.bool_]]:
    """As `relaxing`, at the stage's travel (rows,) [m]. Newton's steps in the depths at all samples together."""
    stage = spheres.curve.stage_stiffness
    assert stage is not None
    give = float(1 / stage.value[0])
    bare = replace(spheres, curve=replace(spheres.curve, stage_stiffness=None))
    sample = _numbers(presses)
    count = int(sample.max()) + 1
    seeds = np.zeros((count + 1, len(sample)))
    seeds[sample, np.arange(len(sample))] = 1.0
    still = replace(bare, curve=bare.curve.fixed(count + 1))
    timed = replace(presses, time=Differentiated(presses.time.value, np.zeros_like(seeds)))
    depth = _elastic_depth(spheres, travel, presses)
    lost = np.zeros(len(depth), dtype=bool)
    for _ in range(_STEPS):
        force, held, _ = relaxing(still, Differentiated(depth, seeds), timed)
        own = force.slopes[sample, np.arange(len(sample))]
        if spheres.curve.work_of_adhesion is not None:
            lost |= presses.started & (~held | (1 + give * own <= 0))
        kept = np.where(lost, 0.0, give)
        slopes = kept * force.slopes[:count]
        step = _solved(slopes, presses.recording, sample, (depth + kept * force.value - travel.value)[None])[0]
        depth = depth - step
        if not (np.abs(step) > _TOLERANCE * np.abs(travel.value).max()).any():
            break
    fixed = Differentiated(depth, np.zeros((len(spheres.curve.modulus.slopes), len(depth))))
    answer, held, inside = relaxing(bare, fixed, presses)
    moved = travel.slopes - kept * answer.slopes + kept * give * answer.value * stage.slopes
    by_depth = _solved(slopes, presses.recording, sample, moved)
    total = answer.slopes + _applied(force.slopes[:count], presses.recording, sample, by_depth)
    keep = held & ~lost
    return Differentiated(np.where(keep, answer.value, 0.0), np.where(keep, total, 0.0)), keep, inside


def _elastic_depth(spheres: Sphere, travel: Differentiated, presses: Presses) -> Floats:
    """Where Newton's steps start: the body as if it did not relax."""
    least, lowest = (limit[presses.recording] for limit in spheres.pull_off())
    held = presses.started & (travel.value > lowest)
    return spheres.rows(presses.recording).at_travel(travel, held, least)[0].depth.value


def _numbers(presses: Presses) -> NDArray[np.intp]:
    """Each sample's number within its recording."""
    rows = np.arange(len(presses.recording))
    first = np.diff(presses.recording, prepend=-1) > 0
    return rows - np.maximum.accumulate(np.where(first, rows, 0))


def _matrices(slopes: Floats, recording: NDArray[np.intp], sample: NDArray[np.intp]) -> Floats:
    """∂/∂δ of each recording's samples (recordings, samples, samples) from `slopes` (samples, rows)."""
    whole = np.zeros((int(recording[-1]) + 1, len(slopes), len(slopes)))
    whole[recording, sample] = slopes.T
    return whole


def _solved(slopes: Floats, recording: NDArray[np.intp], sample: NDArray[np.intp], right: Floats) -> Floats:
    """x (variables, rows) with (1 + slopes) x = right."""
    matrices = np.eye(len(slopes)) + _matrices(slopes, recording, sample)
    columns = np.zeros((len(matrices), len(slopes), len(right)))
    columns[recording, sample] = right.T
    return np.asarray(np.linalg.solve(matrices, columns)[recording, sample].T)


def _applied(slopes: Floats, recording: NDArray[np.intp], sample: NDArray[np.intp], by_depth: Floats) -> Floats:
    """slopes · by_depth (variables, rows)."""
    columns = np.zeros((int(recording[-1]) + 1, len(slopes), len(by_depth)))
    columns[recording, sample] = by_depth.T
    return np.asarray((_matrices(slopes, recording, sample) @ columns)[recording, sample].T)
