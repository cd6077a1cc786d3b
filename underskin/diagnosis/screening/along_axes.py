"""Whether something follows an axis along which recordings differ: then a law may be at work, and no slip need be."""

from collections.abc import Sequence

import numpy as np

from underskin.units import Floats, Mask

_LEAST = 2  # recordings: a single one is extreme along some axis
_BESIDE = 0.25  # of them, as many may be lacking or too many
_TERMS, _SIZE = 4, 0.3  # cosines over the rank along an axis, and the prior standard deviation of each


def follows_an_axis(chosen: Mask, axes: Sequence[Floats]) -> bool:
    """Whether some recordings are, but for few, those on one side of an axis, or on one level of it."""
    if chosen.sum() < _LEAST:
        return False
    allowed = _BESIDE * chosen.sum()
    for axis in axes:
        for level in np.unique(axis):
            for part in (axis >= level, axis == level):
                beside = int((part ^ chosen).sum())
                if min(beside, len(chosen) - beside) <= allowed:
                    return True
    return False


def smooth_along(axis: Floats) -> Floats:
    """Cosines over the rank along an axis, times their prior standard deviation (recordings, terms)."""
    _, place = np.unique(axis, return_inverse=True)
    share = place / max(int(place.max()), 1)
    return np.asarray(_SIZE * np.cos(np.pi * np.outer(share, np.arange(1, _TERMS + 1))))
