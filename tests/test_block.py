"""The three-dimensional block: exact where it is wide, convergent, and in balance."""

import numpy as np
import pytest

from tablegen.block import Block, solve
from underskin import half_space, linear_layer
from underskin.hankel import disc_average, hertz_transform
from underskin.units import Floats

A = 0.289
RHO = np.array([0.0, 0.2, 0.6])
PAPER_LENGTH, PAPER_WIDTH = 16.0, 8.0  # 40 mm and 20 mm in units of 2.5 mm


def deep_layer_sigma(depth: float, rho: Floats, bonded: bool) -> Floats:
    """σ one unit below the top of an endless layer of thickness `depth`, by a 4 × 4 solve per wavenumber.

    With u_z = W(z) J0(kr) and u_r = −W'(z)/k J1(kr): shear stress −(W'' + k² W)/k, T3 = 3 W' − W'''/k².
    """
    k, weight = np.polynomial.legendre.leggauss(400)
    k, weight = 22 * (1 + k), 22 * weight
    transmitted = np.array([_transmitted(wavenumber, depth, bonded) for wavenumber in k])
    kernel = hertz_transform(k * A) * transmitted * k * weight / 3
    return disc_average(np.multiply.outer(rho, k)) @ kernel


def _transmitted(k: float, depth: float, bonded: bool) -> float:
    def derivatives(z: float) -> Floats:
        """Rows W, W', W'', W''' of the four solutions exp(±kz), z exp(±kz), scaled so that none overflows."""
        columns = []
        for s, origin in ((k, depth), (-k, 0.0)):
            e = np.exp(s * (z - origin))
            columns.append(e * np.array([1, s, s**2, s**3]))
            columns.append(e * np.array([z, 1 + s * z, s * (2 + s * z), s**2 * (3 + s * z)]))
        return np.stack(columns, axis=1)

    base, top, plane = derivatives(0.0), derivatives(depth), derivatives(depth - 1)
    conditions = np.stack(
        [
            base[0],
            base[1] if bonded else base[2] + k**2 * base[0],
            top[2] + k**2 * top[0],
            3 * top[1] - top[3] / k**2,
        ]
    )
    conditions[2] /= k**2
    conditions[3] /= k
    coefficients = np.linalg.solve(conditions, [0, 0, 0, -1 / k])
    return -float((3 * plane[1] - plane[3] / k**2) @ coefficients)


def test_the_reference_agrees_with_the_library_and_the_half_space() -> None:
    np.testing.assert_allclose(deep_layer_sigma(1.0, RHO, True), linear_layer.sigma(A, RHO), rtol=1e-9)
    np.testing.assert_allclose(deep_layer_sigma(200.0, RHO, True), half_space.sigma(A, RHO), rtol=1e-4)


@pytest.mark.parametrize(("depth", "bonded"), [(1.0, True), (4.0, True), (1.0, False)])
def test_a_very_wide_block_is_the_endless_layer(depth: float, bonded: bool) -> None:
    wide = 16 * max(1.0, depth)
    block = solve(Block(wide, wide, depth, bonded), A, RHO, order=5)
    np.testing.assert_allclose(block.sigma, deep_layer_sigma(depth, RHO, bonded), rtol=1e-5)


def test_the_error_falls_with_the_order_of_the_elements() -> None:
    exact = linear_layer.sigma(A, RHO)
    errors = [
        float(np.max(np.abs(solve(Block(16.0, 16.0, 1.0), A, RHO, order).sigma / exact - 1)))
        for order in (4, 5)
    ]
    assert errors[1] < errors[0] / 10


@pytest.mark.parametrize("depth", [1.0, 12.0])
def test_the_papers_block_converges_and_carries_the_whole_force(depth: float) -> None:
    block = Block(PAPER_LENGTH, PAPER_WIDTH, depth)
    coarse, fine = solve(block, A, RHO, order=4), solve(block, A, RHO, order=5)
    assert fine.force == pytest.approx(1.0, abs=1e-8)
    assert fine.unknowns > coarse.unknowns
    np.testing.assert_allclose(coarse.sigma, fine.sigma, rtol=2e-4)


def test_length_and_width_can_be_exchanged() -> None:
    along = solve(Block(PAPER_LENGTH, PAPER_WIDTH, 4.0), A, RHO, order=4)
    across = solve(Block(PAPER_WIDTH, PAPER_LENGTH, 4.0), A, RHO, order=4)
    np.testing.assert_allclose(along.sigma, across.sigma, rtol=1e-8)


def test_a_narrow_column_carries_the_mean_pressure() -> None:
    """Saint-Venant: many widths below the load the stress is F over the area, so σ = (2π/3) h²/area."""
    side = 0.25
    column = solve(Block(side, side, 2.0), 0.1, np.array([0.0, 0.1]), order=4)
    np.testing.assert_allclose(column.sigma, 2 * np.pi / 3 / side**2, rtol=1e-6)
