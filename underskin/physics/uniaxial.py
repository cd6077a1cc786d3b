"""Nominal stress over E of an incompressible solid that is pressed or pulled along one axis, compression positive."""

import numpy as np

from underskin.units import Floats

_LEAST_EXPONENT = 1e-3  # of Ogden's exponent, below which his law is taken there


def neo_hookean(stretch: Floats) -> Floats:
    """(λ⁻² − λ)/3."""
    return np.asarray((1.0 / (stretch * stretch) - stretch) / 3.0)


def stiffening(stretch: Floats, second: Floats, third: Floats, exponent: Floats, alpha: Floats) -> Floats:
    """Ogden's 2/(3α) (λ^(−α/2 − 1) − λ^(α − 1)) times Yeoh's 1 + 2 c2 J + 3 c3 J², J = 3 (I/3)^(m/2), I = λ² + 2/λ − 3.

    Neo-Hookean at α = 2 and c2 = c3 = 0; Yeoh's law at α = 2 and m = 2.
    """
    alpha = np.where(np.abs(alpha) < _LEAST_EXPONENT, _LEAST_EXPONENT, alpha)
    invariant = stretch * stretch + 2.0 / stretch - 3.0
    grown = 3.0 * (np.maximum(invariant, 0.0) / 3.0) ** (0.5 * exponent)
    stress = 2.0 / (3.0 * alpha) * (stretch ** (-0.5 * alpha - 1.0) - stretch ** (alpha - 1.0))
    return np.asarray(stress * (1.0 + 2.0 * second * grown + 3.0 * third * grown * grown))
