"""Indentation and compression curves as the diagnosis uses them: samples of force in place of lines of an FRF.

A curve is thinned to means over blocks of neighbouring samples that lie evenly along it; near a jump every sample
stays. The deviation of a sample is its noise, read from second differences of the raw samples, and an instrument's
usual accuracy: 0.2 % of the reading and 0.1 % of the full scale. How accurate it really is, the level of the noise
says, which every hypothesis fits under the same prior. What neighbouring samples share is in smooth_error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.data.snap_in import around_jumps
from underskin.diagnosis.noise.correlated_error import SmoothError
from underskin.diagnosis.noise.line_noise import LineNoise
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording
from underskin.units import Floats

_SAMPLES = 60
_READING, _FULL_SCALE = 2e-3, 1e-3
_LEVEL_SD = 0.25  # of the logarithm of the noise's level
_LEAST_SAMPLES = 5
_COARSE, _BEYOND_NOISE = 240, 4.0  # samples at which changes of force are summed, standard deviations of noise
_PLACE = (1.0, 10.0)  # the abscissa: displacement over a curve's range, on this scale

CurveRecording = IndentationRecording | CompressionRecording


def curve_lines(campaign: Campaign, kind: Kind) -> Lines:
    """The thinned curves of one kind; curves with fewer than five finite samples are left out."""
    entries: list[CurveRecording] = []
    forces, deviations, places, scales, ways = [], [], [], [], []
    for entry in campaign.recordings:
        if not isinstance(entry, IndentationRecording | CompressionRecording) or entry.kind != kind:
            continue
        columns = [entry.displacement_mm, entry.force_n, *([] if entry.time_s is None else [entry.time_s])]
        finite = np.isfinite(np.stack(columns)).all(axis=0)
        if finite.sum() < _LEAST_SAMPLES:
            continue
        columns = [column[finite] for column in columns]
        noise = _roughness(columns[1])
        way = _way(columns[0], columns[1], noise)
        even = np.searchsorted(way, np.linspace(0.0, 1.0, _SAMPLES, endpoint=False))
        block = int(np.ceil(len(way) / _SAMPLES))
        largest = float(np.abs(columns[1]).max())
        starts = np.union1d(even, around_jumps(columns[1], float(np.hypot(noise, _FULL_SCALE * largest)), block))
        counts = np.diff(np.append(starts, len(way)))
        *thinned, place = [np.add.reduceat(column, starts) / counts for column in (*columns, way)]
        displacement, force = thinned[:2]
        entries.append(
            replace(entry, displacement_mm=displacement, force_n=force, time_s=thinned[2] if len(thinned) > 2 else None)
        )
        forces.append(force)
        deviations.append(np.sqrt(noise**2 / counts + (_READING * force) ** 2 + (_FULL_SCALE * largest) ** 2))
        scales.append(np.full(len(force), largest))
        ways.append(place)
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
        smooth=SmoothError(_joined(scales), _joined(ways)),
    )


def _joined(columns: Sequence[Floats]) -> Floats:
    return np.concatenate([*columns, np.zeros(0)])


def _way(displacement: Floats, force: Floats, noise: float) -> Floats:
    """How far along the curve each sample lies, 0 to 1: as much by displacement, by force and by count.

    A sphere's way through the air is long and says little; force counts where it changes by more than its noise.
    """
    coarse = np.linspace(0, len(force) - 1, min(len(force), _COARSE)).round().astype(int)
    steps = np.maximum(np.abs(np.diff(force[coarse])) - _BEYOND_NOISE * noise, 0.0)
    changed = np.interp(np.arange(len(force)), coarse, np.concatenate([[0.0], np.cumsum(steps)]))
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(displacement)))])
    parts = [part / part[-1] for part in (moved, changed, np.arange(len(force), dtype=float)) if part[-1] > 0]
    return np.asarray(sum(parts) / len(parts))


def _roughness(force: Floats) -> float:
    """The noise of a raw sample; second differences of a smooth curve are small against it, or cautious."""
    second = force[2:] - 2 * force[1:-1] + force[:-2]
    return 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
