"""Each recording beside what the base model and the other recordings let expect of it.

The common delay of the chain, or the phase of its filters, is removed first. A recording's ratio is the median of its
lines in the flat zone over the base model's response; recordings for which little is predicted, near a zero crossing,
have none. The level expected of a recording is the base model's response times the median ratio.

The noise of a line is estimated from differences of neighbouring lines, σ² = median |z_j+1 − z_j|²/(2 ln 2), which a
resonance between a few lines does not affect. A recording shows no response where its mean over n lines is within
noise, n |mean|²/σ² < 9 (which noise alone exceeds once in 8000 recordings), and so are its lines, mean |z|² < 3 σ².
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.mechanisms.models.composition import Prediction
from underskin.mechanisms.models.frf import FrfModel
from underskin.recordings.campaign import Campaign, Conditions, FrfRecording
from underskin.recordings.frf.estimation import lines_of
from underskin.recordings.frf.flat_zone import without_chain_phase
from underskin.recordings.frf.spectra import stacked
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats, Mask

LEAST_RECORDINGS = 3  # so that one can contradict the others
LEAST_LINES = 4  # for a median of their differences
_MEAN, _LINES = 9.0, 3.0  # over their variance
_FLAT_HZ = 130.0  # below it the response is about flat
LEAST_RESPONSE = 0.2  # of the largest prediction: below it, near a zero crossing, a level or sign is not informative


_ONE_LINE = np.ones(1)  # Hz: the base model is the same at all


def base_model(
    campaign: Campaign, recordings: Sequence[FrfRecording], table: SigmaTable, lines_hz: Floats = _ONE_LINE
) -> tuple[FrfModel, Floats, Prediction]:
    """The base model of recordings' contacts at these lines, its declared values, and the FRFs by them."""
    contacts = tuple(recording.without_measurements(frequency_hz=lines_hz) for recording in recordings)
    model = FrfModel((), Conditions("contacts", campaign.skin, contacts), table)
    start = np.array([parameter.start for parameter in model.parameters])
    return model, start, model.predict(start)


def position_slopes(prediction: Prediction) -> Floats:
    """|∂FRF/∂position| (rows,) [C/N/mm]."""
    assert prediction.position_slopes is not None
    return np.asarray(1e-3 * np.hypot(*np.abs(prediction.position_slopes)))


def aligned_lines(recordings: Sequence[FrfRecording]) -> list[Complexes]:
    """The values [C/N] of each recording's lines `without_chain_phase`."""
    conditions = [(recording.indenter_radius_mm, recording.preload_n) for recording in recordings]
    aligned, *_ = without_chain_phase(stacked([lines_of(recording) for recording in recordings]), conditions)
    rows = {int(row): values for stack in aligned for row, values in zip(stack.rows, stack.values, strict=True)}
    return [rows[row] for row in range(len(rows))]


def flat_level(recording: FrfRecording) -> float:
    """|FRF| in the flat zone [C/N]."""
    measured = lines_of(recording)
    return float(np.nanmedian(np.abs(measured.values[_flat(measured.frequency)])))


def _flat(frequency: Floats) -> Mask:
    """The lines in the flat zone; all where none is."""
    flat: Mask = frequency <= _FLAT_HZ
    return flat if flat.any() else np.ones_like(flat)


def no_response(aligned: Sequence[Complexes]) -> tuple[Mask, Floats]:
    """Which recordings show no response, and the variance of each mean [(C/N)²], 0 where there are too few lines.

    `aligned` holds the lines of each recording (lines,) [C/N] without the common delay.
    """
    unresponsive, variance = np.zeros(len(aligned), dtype=bool), np.zeros(len(aligned))
    for index, values in enumerate(aligned):
        lines = values[np.isfinite(values)]
        if len(lines) < LEAST_LINES:
            continue
        noise = float(np.median(np.abs(np.diff(lines)) ** 2)) / (2 * np.log(2.0))
        variance[index] = noise / len(lines)
        small_mean = float(np.abs(lines.mean()) ** 2) < _MEAN * variance[index]
        unresponsive[index] = small_mean and float(np.mean(np.abs(lines) ** 2)) < _LINES * noise
    return unresponsive, variance


@dataclass(frozen=True, eq=False)
class Comparison:
    """Columns over the recordings: level |mean| [C/N], its variance by noise [(C/N)²], whether it shows no response,
    the ratio to the base model, NaN where it is not informative, and the expected level [C/N]."""

    level: Floats
    variance: Floats
    unresponsive: Mask
    ratio: Floats
    expected: Floats


def compared(recordings: Sequence[FrfRecording], shape: Floats) -> Comparison:
    """The recordings compared with the base model's FRFs (recordings,) [C/N]."""
    aligned = aligned_lines(recordings)
    unresponsive, variance = no_response(aligned)
    telling = ~unresponsive & (np.abs(shape) > LEAST_RESPONSE * np.abs(shape[~unresponsive]).max(initial=0.0))
    flat = [_flat(lines_of(recording).frequency) for recording in recordings]
    median = np.array([float(np.nanmedian(values.real[low])) for values, low in zip(aligned, flat, strict=True)])
    ratio = np.where(telling, median / np.where(shape == 0, 1.0, shape), np.nan)
    usual = float(np.nanmedian(np.abs(ratio))) if telling.any() else 0.0
    level = np.array([float(np.abs(np.nanmean(values))) for values in aligned])
    return Comparison(level, variance, unresponsive, ratio, np.abs(shape) * usual)


def times(recording: FrfRecording, real: float, imaginary: float | None = None) -> FrfRecording:
    """The recording with its FRF times a factor, its imaginary part times another one where that is given."""
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    imaginary = real if imaginary is None else imaginary
    scaled = real * recording.frf_re_pc_per_n, imaginary * recording.frf_im_pc_per_n
    return replace(recording, frf_re_pc_per_n=scaled[0], frf_im_pc_per_n=scaled[1])
