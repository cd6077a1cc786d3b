"""The noise of the raw samples of a curve, over how many of them it hides the travel, and where a curve jumps."""

import numpy as np

from underskin.units import Floats, Indices

_BEYOND_NOISE = 3.0  # standard deviations; a jump that was none only ends a mean early


def roughness(force: Floats) -> float:
    """The noise of a raw sample; second differences of a smooth curve are small against it, or cautious."""
    second = force[2:] - 2 * force[1:-1] + force[:-2]
    if not len(second):
        return 0.0
    noise = 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
    steps = np.abs(np.diff(force))
    steps = steps[steps > 0]
    quantum = float(steps.min()) if len(steps) else 0.0
    coarse = len(np.unique(force)) < len(force) / 2  # an analog-digital converter's steps show
    return float(np.hypot(noise, quantum / np.sqrt(12.0))) if coarse else noise


def hidden_samples(displacement: Floats) -> int:
    """Over so many samples, at least 1, the displacement moves about as far as twice the noise of their mean.

    Noise σ and a step s from sample to sample: n s = 2 σ/√n.
    """
    step = float(np.ptp(displacement)) / max(int(displacement.argmax()), 1)
    return max(1, int((2 * roughness(displacement) / step) ** (2 / 3))) if step > 0 else 1


def jumps(force: Floats, noise: float, block: int) -> Indices:
    """The samples (jumps,) with which a new course begins, where means over `block` samples would hide it.

    A mean over samples on both sides is a force that never was. `noise`: the standard deviation of one sample. The
    mean of a block ahead less that of the block behind is held against a third of the same over the blocks beyond,
    which on a straight course is equal to it; near there the jump is the largest change between two samples.
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
    """The place of the largest change from first to last."""
    first = max(first, 0)
    return first + int(np.argmax(change[first : last + 1]))
