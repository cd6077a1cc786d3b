"""Interpolation of smooth functions on [0, end] at Chebyshev's points: the error falls geometrically with their count.

Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 3.
"""

import numpy as np
from numpy.polynomial import chebyshev

from underskin.units import Floats


class ChebyshevInterval:
    """`nodes` (count,), all inside (0, end), where a function must be known."""

    def __init__(self, end: float, count: int) -> None:
        self.end = end
        self.nodes = end / 2 * (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        transform = self.basis(self.nodes).T * (2 / count)
        transform[0] /= 2
        self._transform = transform
        self._derivative = chebyshev.chebder(np.eye(count)) * (2 / end)

    def basis(self, x: Floats) -> Floats:
        """The polynomials at x (rows,): (rows, count). A function there is basis @ coefficients."""
        return np.asarray(chebyshev.chebvander(2 / self.end * x - 1, len(self.nodes) - 1), dtype=float)

    def coefficients(self, values: Floats) -> Floats:
        """From values at the nodes (count, ...)."""
        return np.tensordot(self._transform, values, 1)

    def derivative(self, coefficients: Floats) -> Floats:
        """The coefficients (count, ...) of the derivative; the last is 0."""
        shorter = np.tensordot(self._derivative, coefficients, 1)
        return np.concatenate([shorter, np.zeros_like(coefficients[:1])])
