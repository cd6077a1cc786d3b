"""The sample rate that a column of times tells."""

import numpy as np

from underskin.units import Floats

_JITTER = 0.01  # of a sample: more is not evenly sampled


def mean_step(time: Floats) -> float:
    """From one sample to the next, on average, in the unit of the times."""
    with np.errstate(all="ignore"):
        return float((time[-1] - time[0]) / max(len(time) - 1, 1))


def even_rate(time: Floats) -> float | None:
    """Samples in a unit of the times; None where they are not evenly spaced and rising."""
    step = mean_step(time)
    with np.errstate(all="ignore"):
        jitter = np.abs(time - (time[0] + step * np.arange(len(time)))).max()
    return 1 / step if step > 0 and jitter <= _JITTER * step else None
