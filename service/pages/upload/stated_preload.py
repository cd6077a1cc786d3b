"""The stated preload of a recording compared with the one measured by its own force channel."""

import numpy as np

from underskin.findings.sentences import more_alike
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.frf.spectra import mean_of
from underskin.units import readable_unit

_ALIKE = 0.2  # allowed deviation of the measured preload, relative to the stated one
_REPORTED_RATIO = 3.0  # times the stated preload: beyond that, the findings of a campaign's d33 say so
_PARTS, _STEADY = 4, 0.2  # of a recording, in which the means of a static force are alike, as a part of its mean


def measured_otherwise(recording: FrfRecording) -> float | None:
    """The static force [N] of the recording if it differs from the stated preload; None if they agree, or if the
    channel has no static force: that of a piezo sensor decays to 0."""
    force = recording.force_n
    mean = None if force is None or len(force) < _PARTS else mean_of(force)
    if force is None or mean is None:
        return None
    means = [float(part.mean()) for part in np.array_split(force, _PARTS)]
    is_steady = max(means) - min(means) <= _STEADY * abs(mean)
    return abs(mean) if is_steady and abs(abs(mean) / recording.preload_n - 1) > _ALIKE else None


def in_words(force_n: float) -> str:
    """A force in the unit in which it reads well."""
    unit, count = readable_unit("force_n", force_n)
    return f"{count * force_n:#.3g} {unit}"


def doubts(campaign: Campaign) -> list[str]:
    """A sentence on the first recording of a campaign whose stated preload differs from the measured one, and how
    many more there are."""
    measured = [
        (recording, mean)
        for recording in campaign.of(FrfRecording)
        if (mean := measured_otherwise(recording)) is not None
    ]
    doubtful = [
        (recording, mean)
        for recording, mean in measured
        if 1 / _REPORTED_RATIO <= mean / recording.preload_n <= _REPORTED_RATIO
    ]
    if not doubtful:
        return []
    (first, mean), *further = doubtful
    which = f"{first.id}: " if len(campaign.recordings) > 1 else ""
    alike = more_alike(len(further), "recording")
    words = (
        f"{which}pressed by {first.preload_n:g} N as stated, but its force is {in_words(mean)} on average{alike}: "
        "is this the preload of this recording, and is its force measured from 0?"
    )
    return [words]
