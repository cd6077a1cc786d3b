"""Errors of interpolation, measured by leaving out nodes of a table."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from underskin.surrogate.influence_table import interpolation_weights
from underskin.units import Floats

_GAIN = 4.0  # a spline through all nodes is at least as much better than one with a node left out


def left_out_errors(axes: Sequence[Floats], values: Floats, first: int = 0) -> Iterator[Floats]:
    """Bounds on |spline − truth| along each axis.

    Each inner node is interpolated from the others; the bound is the largest error of a node and its neighbours, over
    `_GAIN`.

    Parameters
    ----------
    axes : sequence of ndarray
        Nodes along the interpolated axes.
    values : ndarray
        The interpolated axes follow each other from number `first` on.
    first : int
        Number of leading axes that are not interpolated.

    Yields
    ------
    ndarray
        One for each of `axes`, of the shape of `values`.
    """
    for number, nodes in enumerate(axes, start=first):
        left_out = np.zeros_like(values)
        along, errors = np.moveaxis(values, number, 0), np.moveaxis(left_out, number, 0)
        for i in range(1, nodes.size - 1):
            others = np.delete(np.arange(nodes.size), i)
            errors[i] = np.tensordot(interpolation_weights(nodes[others], nodes[i]), along[others], axes=1) - along[i]
        yield maximum_filter1d(np.abs(left_out), 3, axis=number) / _GAIN
