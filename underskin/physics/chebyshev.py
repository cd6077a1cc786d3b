"""Interpolation of smooth functions on [0, end] at Chebyshev points; the error falls geometrically with their number.

Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 3.
"""

import numpy as np
from numpy.polynomial import chebyshev

from underskin.units import Floats


class ChebyshevInterval:
    """Chebyshev interpolation on [0, end].

    Parameters
    ----------
    end : float
        Upper end of the interval.
    count : int
        Number of points.

    Attributes
    ----------
    nodes : ndarray, (count,)
        The interpolation points, all inside (0, end).
    """

    def __init__(self, end: float, count: int) -> None:
        self.end = end
        self.nodes = end / 2 * (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        transform = self.basis(self.nodes).T * (2 / count)
        transform[0] /= 2
        self._transform = transform
        self._derivative = chebyshev.chebder(np.eye(count)) * (2 / end)

    def basis(self, x: Floats) -> Floats:
        """Chebyshev polynomials at x (rows,): (rows, count). A function is `basis(x) @ coefficients`."""
        return np.asarray(chebyshev.chebvander(2 / self.end * x - 1, len(self.nodes) - 1), dtype=float)

    def coefficients(self, values: Floats) -> Floats:
        """Coefficients (count, ...) of the interpolant from values at the nodes (count, ...)."""
        return np.tensordot(self._transform, values, 1)

    def derivative(self, coefficients: Floats) -> Floats:
        """Coefficients (count, ...) of the derivative of the interpolant; the last is 0."""
        shorter = np.tensordot(self._derivative, coefficients, 1)
        return np.concatenate([shorter, np.zeros_like(coefficients[:1])])
