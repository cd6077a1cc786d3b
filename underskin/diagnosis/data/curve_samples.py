"""Indentation and compression curves as the diagnosis uses them: samples of force in place of lines of an FRF.

A curve is thinned to means over blocks of samples, with the deviation of each. How large that really is, the level of
the noise says, which every hypothesis fits under the same prior. What a cell adds, and what neighbouring samples share,
is in correlated_error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.data.thinning import thinned
from underskin.diagnosis.noise.correlated_error import USUAL_DRIFT, CurveError, instrument_columns
from underskin.diagnosis.noise.line_noise import LineNoise
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CurveRecording
from underskin.recordings.curve_course import Course, course
from underskin.units import Floats

_READING, _FULL_SCALE = 2e-3, 1e-3  # of a testing machine, whose samples in the air are none
_LEVEL_SD = 0.25  # of the logarithm of the noise's level
_LEAST_SAMPLES = 5
_PLACE = (1.0, 10.0)  # the abscissa: displacement over a curve's range, on this scale
_IN_THE_AIR, _AT_CONTACT = 0.2, 0.7  # of the largest force, what the smooth error counts where there is less
_SURE = 4.0  # standard deviations
_AIR_BLOCKS, _AIR_SAMPLES = 10, 4  # blocks of samples in the air, and samples of each at least
_AWAY = 0.6  # of the samples in the air: what lies near may belong to a contact
_PLAINLY = 4.0  # times the variance that is expected: by chance in 1 of 4,000, of χ² over 7
_FEW_FOR_ZERO = 0.01  # of the largest force: how well a cell's zero is known that no sample shows


def curve_lines(campaign: Campaign, kind: Kind) -> Lines:
    """The thinned curves of one kind; curves with fewer than five finite samples are left out."""
    entries: list[CurveRecording] = []
    forces, deviations, places, errors = [], [], [], []
    for entry in campaign.recordings:
        if not isinstance(entry, CurveRecording) or entry.kind != kind:
            continue
        columns = finite_samples(entry)
        if len(columns[0]) < _LEAST_SAMPLES:
            continue
        seen = course(*columns)
        force_zero = seen.zero if kind == "indentation" else 0.0
        slow = _slow_noise(seen, columns[1]) if kind == "indentation" else 0.0
        columns[1] = columns[1] - force_zero
        means, deviation, way, counts = thinned(columns, seen, slow, kind)
        displacement, force = means[:2]
        if kind == "compression":
            largest = float(np.abs(force).max())
            deviation = np.sqrt(deviation**2 + (_READING * force) ** 2 + (_FULL_SCALE * largest) ** 2)
        time = means[2] if len(means) > 2 else None
        entries.append(replace(entry, displacement_mm=displacement, force_n=force, time_s=time))
        forces.append(force)
        deviations.append(deviation)
        drift = _drift_in_air(seen, columns[1], columns[2] if len(columns) > 2 else None)
        error = _error(
            kind,
            seen,
            displacement,
            force,
            time,
            way,
            drift,
            (*_straight_lines(columns[1], counts), np.full(len(force), slow)),
        )
        errors.append(error)
        span = float(np.ptp(displacement)) or 1.0
        places.append(_PLACE[0] + (_PLACE[1] - _PLACE[0]) * (displacement - displacement.min()) / span)
    value = _joined(forces)
    deviation = _joined(deviations)
    return Lines(
        campaign=replace(campaign, recordings=tuple(entries)),
        value=value.astype(complex),
        deviation=deviation,
        frequency=_joined(places),
        recording=np.repeat(np.arange(len(forces)), [len(force) for force in forces]).astype(np.intp),
        sensor=np.zeros(len(forces), dtype=np.intp),
        noise=LineNoise(deviation, _LEVEL_SD, 0.0),
        scatter=(0.0, -len(value)),  # a force has no imaginary part
        smooth=CurveError.joined(errors),
    )


def finite_samples(entry: CurveRecording) -> list[Floats]:
    """Displacement [mm], force [N] and, where there is one, time [s] of the samples that have all of them."""
    columns = [entry.displacement_mm, entry.force_n, *([] if entry.time_s is None else [entry.time_s])]
    finite = np.isfinite(np.stack(columns)).all(axis=0)
    return [column[finite] for column in columns]


def _slow_noise(seen: Course, force: Floats) -> float:
    """The standard deviation of noise that neighbouring samples share, which second differences do not see: by how
    much means over blocks in the air, away from the contact, scatter about a parabola, which a drift is, beyond what a
    sample's noise gives; 0 where that is not plain."""
    away = int(_AWAY * len(seen.air))
    air = seen.air[:away] if len(seen.air) and seen.air[0] == 0 else seen.air[len(seen.air) - away :]
    count = len(air) // _AIR_BLOCKS
    if count < _AIR_SAMPLES:
        return 0.0
    means = force[air[: count * _AIR_BLOCKS]].reshape(_AIR_BLOCKS, count).mean(axis=1)
    place = np.arange(_AIR_BLOCKS)
    about = means - np.polyval(np.polyfit(place, means, 2), place)
    variance, expected = float(about @ about) / (_AIR_BLOCKS - 3), seen.noise**2 / count
    return float(np.sqrt(variance - expected)) if variance > _PLAINLY * expected else 0.0


def _straight_lines(force: Floats, counts: Floats) -> tuple[Floats, Floats, Floats]:
    """The samples of each block, the slope [N per sample] of the straight line through them, and the sum of their
    squares about it [N²]."""
    starts = (np.cumsum(counts) - counts).astype(np.intp)
    block = np.repeat(np.arange(len(counts)), counts.astype(np.intp))
    place = np.arange(len(force)) - (starts + (counts - 1) / 2)[block]
    about = force - (np.add.reduceat(force, starts) / counts)[block]
    slope = np.add.reduceat(place * about, starts) / np.maximum(np.add.reduceat(place**2, starts), 0.5)
    return counts, slope, np.add.reduceat((about - slope[block] * place) ** 2, starts)


def _drift_in_air(seen: Course, force: Floats, time: Floats | None) -> float:
    """How far [N] the cell runs off over the whole curve if it goes on as in the air; 0 where no plain drift and no
    snap-in tells the air from the foot of a contact.

    Without times, samples are taken at a steady rate.
    """
    along = np.arange(float(len(force))) if time is None else time
    if seen.drift:
        return abs(seen.drift) * float(np.ptp(along))
    if seen.snap_in is None or not seen.has_air:
        return 0.0
    air = along[seen.air] - along[seen.air].mean()
    square = float(air @ air)
    if not square > 0:
        return 0.0
    slope = abs(float(air @ force[seen.air])) / square
    return slope * float(np.ptp(along)) if slope > _SURE * seen.noise / np.sqrt(square) else 0.0


def _error(
    kind: Kind,
    seen: Course,
    displacement: Floats,
    force: Floats,
    time: Floats | None,
    way: Floats,
    drift: float,
    samples: tuple[Floats, Floats, Floats, Floats],
) -> CurveError:
    """What the samples of one curve share; `drift` [N] is what the air shows, `samples` as CurveError has them."""
    largest = float(np.abs(force).max()) or 1.0
    if kind == "compression":
        return CurveError(np.full(len(force), largest), way, np.zeros((len(force), 0)), *samples)
    in_air = np.abs(force) < 4 * seen.noise + 1e-3 * largest
    if seen.pull_off is None and seen.snap_in is None:
        in_air &= displacement < displacement[np.argmax(displacement)]
    scale = np.maximum(np.abs(force), np.where(in_air, _IN_THE_AIR, _AT_CONTACT) * largest)
    zero = largest if seen.has_air else _FEW_FOR_ZERO * largest
    # Without times, samples are taken at a steady rate: an hour's drift follows their order, not the travel.
    counts = samples[0]
    order = np.cumsum(counts) - counts / 2
    size = max(USUAL_DRIFT * largest, drift) if seen.has_air else 0.0
    columns = instrument_columns(displacement, order if time is None else time, zero, size)
    return CurveError(scale, way, columns, *samples)


def _joined(columns: Sequence[Floats]) -> Floats:
    return np.concatenate([*columns, np.zeros(0)])
