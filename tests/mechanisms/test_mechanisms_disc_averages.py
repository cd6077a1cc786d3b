"""Averages over discs beside the centre of a profile: exact for polynomials."""

import numpy as np
import pytest

from underskin.mechanisms.models.sigma_curves import CubicBasis
from underskin.mechanisms.models.sigma_kernels import disc_averages


def _averages(offsets: np.ndarray, disc: float, values: np.ndarray, basis: CubicBasis) -> np.ndarray:
    x, weight = np.polynomial.legendre.leggauss(10)
    cosine = np.cos(np.pi * (np.arange(20) + 0.5) / 20)
    total = np.zeros((len(offsets), len(basis.nodes)))
    rings, share = disc * (x + 1) / 2, weight * (x + 1) / 2 / len(cosine)
    disc_averages(offsets, rings, share, cosine, float(basis.nodes[-1]), basis.knots, basis.cubics, total)
    return np.asarray(total @ basis.to_coefficients @ values)


def test_mean_square_centre_half_discs() -> None:
    """The mean of a square is that of the centre and half the discs."""
    basis, offsets = CubicBasis(np.linspace(0.0, 4.0, 33)), np.array([0.0, 0.3, 1.7])
    assert _averages(offsets, 0.8, np.ones(33), basis) == pytest.approx(np.ones(3), rel=1e-12)
    assert _averages(offsets, 0.8, basis.nodes**2, basis) == pytest.approx(offsets**2 + 0.8**2 / 2, rel=1e-12)


def test_beyond_its_end_a_profile_is_0() -> None:
    basis = CubicBasis(np.linspace(0.0, 4.0, 33))
    inside, half, outside = _averages(np.array([3.0, 4.0, 5.0]), 0.5, np.ones(33), basis)
    assert inside == pytest.approx(1.0)
    assert 0.4 < half < 0.5  # the end cuts the disc by a circle that bends away from it
    assert outside == 0.0
