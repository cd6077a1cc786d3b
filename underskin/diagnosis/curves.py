"""Indentation and compression curves as the diagnosis uses them: samples of force in place of lines of an FRF.

A curve is thinned to means over blocks of neighbouring samples; near a jump every sample stays. The deviation of a
sample is its noise, read from second differences of the raw samples, and an instrument's usual accuracy: 0.2 % of the
reading and 0.1 % of the full scale. How accurate it really is, the level of the noise says, which every hypothesis fits
under the same wide prior.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.jumps import around_jumps
from underskin.diagnosis.line_noise import LineNoise
from underskin.diagnosis.lines import Lines
from underskin.mechanisms.mechanism import Kind
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording
from underskin.units import Floats

_SAMPLES = 60
_READING, _FULL_SCALE = 2e-3, 1e-3
_LEVEL_SD = 0.5  # of the logarithm of the noise's level
_LEAST_SAMPLES = 5
_PLACE = (1.0, 10.0)  # the abscissa: displacement over a curve's range, on this scale

CurveRecording = IndentationRecording | CompressionRecording


def curve_lines(campaign: Campaign, kind: Kind) -> Lines:
    """The thinned curves of one kind; curves with fewer than five finite samples are left out."""
    entries: list[CurveRecording] = []
    forces, deviations, places = [], [], []
    for entry in campaign.recordings:
        if not isinstance(entry, IndentationRecording | CompressionRecording) or entry.kind != kind:
            continue
        columns = [entry.displacement_mm, entry.force_n, *([] if entry.time_s is None else [entry.time_s])]
        finite = np.isfinite(np.stack(columns)).all(axis=0)
        if finite.sum() < _LEAST_SAMPLES:
            continue
        columns = [column[finite] for column in columns]
        noise = _roughness(columns[1])
        block = int(np.ceil(len(columns[0]) / _SAMPLES))
        starts = np.union1d(np.arange(0, len(columns[0]), block), around_jumps(columns[1], noise, block))
        counts = np.diff(np.append(starts, len(columns[0])))
        thinned = [np.add.reduceat(column, starts) / counts for column in columns]
        displacement, force = thinned[:2]
        entries.append(
            replace(entry, displacement_mm=displacement, force_n=force, time_s=thinned[2] if len(thinned) > 2 else None)
        )
        forces.append(force)
        scale = float(np.abs(force).max())
        deviations.append(np.sqrt(noise**2 / counts + (_READING * force) ** 2 + (_FULL_SCALE * scale) ** 2))
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
    )


def _joined(columns: Sequence[Floats]) -> Floats:
    return np.concatenate([*columns, np.zeros(0)])


def _roughness(force: Floats) -> float:
    """The noise of a raw sample; second differences of a smooth curve are small against it, or cautious."""
    second = force[2:] - 2 * force[1:-1] + force[:-2]
    return 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
