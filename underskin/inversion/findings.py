"""What looks wrong in a campaign's FRF recordings and their d33 and is used all the same, in words."""

from collections.abc import Sequence

import numpy as np

from underskin.inversion.mixed_model import Estimate
from underskin.prediction import plausibility
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.estimation import Frf
from underskin.units import Floats, findings, to_lab

_CLEAR = 3.0  # standard deviations that a force's mean must be from 0 to be a preload, not what a coupling left
_CONTRADICTS = 3.0  # times


def in_words(
    recorded: Sequence[FrfRecording], measured: Sequence[Frf], level: Floats, array: Estimate | None
) -> tuple[str, ...]:
    """Of time series defects and the mean force, of the level [C/N] and of the array's d33 slips of units and sign."""
    defects = [
        f"recording {item.id}: {defect.statement}"
        for item, frf in zip(recorded, measured, strict=True)
        for defect in frf.found
    ]
    forces = [f"recording {item.id}: {said}" for item in recorded if (said := _force(item)) is not None]
    typical = to_lab("frf_pc_per_n", np.nanmedian(np.abs(level)))
    slips = [f"FRF, median of the recordings: {one.statement}" for one in findings("frf_pc_per_n", typical)]
    found = () if array is None else plausibility.of_array(float(to_lab("d33_pc_per_n", array.value)))
    return (*defects, *forces, *slips, *found)


def _force(recording: FrfRecording) -> str | None:
    """The mean of a force that has one, where it contradicts the preload."""
    if recording.force_n is None:
        return None
    mean, scatter = float(np.mean(recording.force_n)), float(np.std(recording.force_n))
    if abs(mean) <= _CLEAR * scatter or 1 / _CONTRADICTS <= abs(mean) / recording.preload_n <= _CONTRADICTS:
        return None
    return f"force_n is {mean:.3g} N in the mean, but preload_n is {recording.preload_n:g}: is one in another unit?"
