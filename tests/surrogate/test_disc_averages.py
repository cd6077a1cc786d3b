"""Averages over discs beside the centre of a profile: exact for polynomials."""

import numpy as np
import pytest

from underskin.surrogate.sigma_table import CubicAxis

AXIS = CubicAxis(np.linspace(0.0, 4.0, 33))


def test_mean_square_centre_half_discs() -> None:
    """The mean of a square is that of the centre and half the discs."""
    offsets = np.array([0.0, 0.3, 1.7])
    average = AXIS.disc_averages(offsets, 0.8)
    assert average.sum(axis=1) == pytest.approx(np.ones(3), rel=1e-12)
    assert average @ AXIS.nodes**2 == pytest.approx(offsets**2 + 0.8**2 / 2, rel=1e-12)


def test_beyond_its_end_a_profile_is_0() -> None:
    inside, half, outside = AXIS.disc_averages(np.array([3.0, 4.0, 5.0]), 0.5).sum(axis=1)
    assert inside == pytest.approx(1.0)
    assert 0.4 < half < 0.5  # the end cuts the disc by a circle that bends away from it
    assert outside == 0.0
