"""Spherical Bessel functions of all even orders at once."""

import numpy as np
import pytest
from scipy.special import spherical_jn

from underskin.physics.contact_kernel import even_orders


@pytest.mark.parametrize("orders", [1, 2, 18])
def test_every_order_is_scipys(orders: int) -> None:
    """Below 1, up to the last order, beyond it, and where j0 or j1 vanishes."""
    s = np.concatenate([[0.0], np.geomspace(1e-12, 150.0, 2000), np.pi * np.arange(1, 30), [4.493409457909064]])
    found = np.empty((len(s), orders))
    even_orders(s, found)
    assert np.abs(found - spherical_jn(2 * np.arange(orders), s[:, None])).max() < 1e-14


def test_small_values_keep_their_digits() -> None:
    s = np.geomspace(1e-3, 20.0, 200)
    found = np.empty((len(s), 18))
    even_orders(s, found)
    exact = spherical_jn(34, s)
    assert found[:, 17] == pytest.approx(exact, rel=1e-9, abs=1e-300)
