"""Where a curve jumps: a sphere snaps into contact, or comes off, between two samples."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from underskin.units import Floats

_BEYOND_NOISE = 3.0  # standard deviations; a jump that was none only ends a mean early


def jumps(force: Floats, noise: float, block: int) -> NDArray[np.intp]:
    """The samples (jumps,) with which a new course begins, where means over `block` samples would hide it.

    A mean over samples on both sides is a force that never was. `noise`: the standard deviation of one sample. The
    mean of a block ahead less that of the block behind is held against a third of the same over the blocks beyond,
    which on a straight course is equal to it; near there the jump is the largest change between two samples.
    """
    if block == 1 or len(force) < 2 * block + 1:
        return np.zeros(0, dtype=np.intp)
    longer = np.pad(force, 2 * block, mode="reflect", reflect_type="odd")  # straight on at both ends
    means = np.convolve(longer, np.full(block, 1 / block), mode="valid")  # of longer[i : i + block]
    at = np.arange(len(force)) + 2 * block
    size = np.abs(means[at] - means[at - block] - (means[at + block] - means[at - 2 * block]) / 3)
    least = _BEYOND_NOISE * noise * np.sqrt(20 / 9 / block)
    about = np.flatnonzero((size > least) & (size == maximum_filter1d(size, 2 * block + 1)))
    change = np.abs(np.diff(force, prepend=force[0]))
    return np.array([_largest(change, sample - block, sample + block) for sample in about.tolist()], dtype=np.intp)


def around_jumps(force: Floats, noise: float, block: int) -> NDArray[np.intp]:
    """The samples within a block of a jump: a force that tears off falls steeply, and a mean would hide that too."""
    near = (jumps(force, noise, block)[:, None] + np.arange(-block, block + 1)).ravel()
    return np.unique(near[(near >= 0) & (near < len(force))])


def _largest(change: Floats, first: int, last: int) -> int:
    """The place of the largest change from first to last."""
    first = max(first, 0)
    return first + int(np.argmax(change[first : last + 1]))
