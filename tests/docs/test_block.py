"""The three-dimensional block: exact where it is wide, convergent, and in balance."""

import numpy as np
import pytest

from docs.paper import deep_layer
from docs.paper.block import FiniteBlock, displacements, solve
from tablegen import linear_layer
from tests.support.cases import first
from underskin.physics import half_space
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import hertz_transform

A = 0.289
RHO = np.array([0.0, 0.2, 0.6])
pytestmark = pytest.mark.soak  # as all that the paper needs

PAPER_LENGTH, PAPER_WIDTH = 16.0, 8.0  # 40 mm and 20 mm in units of 2.5 mm


def test_the_deep_layer_lies_between_the_layer_and_the_half_space() -> None:
    np.testing.assert_allclose(deep_layer.sigma(1.0, A, RHO), linear_layer.sigma(A, RHO), rtol=1e-9)
    np.testing.assert_allclose(deep_layer.sigma(200.0, A, RHO), half_space.sigma(A, RHO), rtol=1e-4)


def test_a_slippery_base_transmits_as_tabulated() -> None:
    """Point load, ρ 0.6: 1.1144 without friction, 0.9882 bonded."""
    assert deep_layer.sigma(1.0, 0.0, np.array([0.6]), bonded=False) == pytest.approx([1.1144], abs=5e-5)
    assert deep_layer.sigma(1.0, 0.0, np.array([0.6])) == pytest.approx([0.9882], abs=5e-5)


def test_the_half_spaces_error_falls_with_the_depth_of_the_base() -> None:
    """−34.7 %, −7.8 %, −0.7 % and −0.01 % with the base at h, 2h, 4h and 12h."""
    endless = np.array([deep_layer.sigma(depth, A, RHO)[1] for depth in (1.0, 2.0, 4.0, 12.0)])
    percent = 100 * (half_space.sigma(A, RHO[1]) / endless - 1)
    np.testing.assert_allclose(percent, [-34.7, -7.8, -0.7, -0.01], atol=0.05)


@pytest.mark.parametrize(("depth", "bonded"), [(1.0, False), (4.0, True)])
def test_a_very_wide_block_is_the_endless_layer(depth: float, bonded: bool) -> None:
    wide = 16 * max(1.0, depth)
    block = solve(FiniteBlock(wide, wide, depth, bonded), A, RHO, order=5)
    np.testing.assert_allclose(block.sigma, deep_layer.sigma(depth, A, RHO, bonded=bonded), rtol=1e-5)


def test_the_error_falls_with_the_order_of_the_elements() -> None:
    """Of a very wide block, which is the endless layer."""
    exact = linear_layer.sigma(A, RHO)
    errors = [
        float(np.max(np.abs(solve(FiniteBlock(16.0, 16.0, 1.0), A, RHO, order).sigma / exact - 1))) for order in (4, 5)
    ]
    assert errors[1] < min(1e-5, errors[0] / 10)


@pytest.mark.parametrize("depth", first(1, [1.0, 12.0]))
def test_the_papers_block_converges_and_carries_the_whole_force(depth: float) -> None:
    block = FiniteBlock(PAPER_LENGTH, PAPER_WIDTH, depth)
    coarse, fine = solve(block, A, RHO, order=4), solve(block, A, RHO, order=5)
    assert fine.force == pytest.approx(1.0, abs=1e-8)
    assert fine.unknowns > coarse.unknowns
    np.testing.assert_allclose(coarse.sigma, fine.sigma, rtol=2e-4)


def test_length_and_width_can_be_exchanged() -> None:
    along = solve(FiniteBlock(PAPER_LENGTH, PAPER_WIDTH, 4.0), A, RHO, order=3)
    across = solve(FiniteBlock(PAPER_WIDTH, PAPER_LENGTH, 4.0), A, RHO, order=3)
    np.testing.assert_allclose(along.sigma, across.sigma, rtol=1e-8)


def test_a_narrow_column_carries_the_mean_pressure() -> None:
    """Saint-Venant: many widths below the load the stress is F over the area, so σ = (2π/3) h²/area."""
    side = 0.25
    column = solve(FiniteBlock(side, side, 2.0), 0.1, np.array([0.0, 0.1]), order=4)
    np.testing.assert_allclose(column.sigma, 2 * np.pi / 3 / side**2, rtol=1e-6)


def test_the_displacement_under_the_load_is_the_endless_layers() -> None:
    """w(0) = F/(4πG) ∫ K(k) J(k) dk in units of h: K the layer's compliance, J the Hertz pressure's transform."""
    x, weight = np.polynomial.legendre.leggauss(400)
    k, weight = 200 * (1 + x), 200 * weight
    exact = float(weight @ (Layer().compliance(k).value * hertz_transform(k * A))) / (4 * np.pi)
    points = (np.array([0.0, 1.0]), np.array([0.0]), np.array([0.0, 1.0]))
    field = displacements(FiniteBlock(16.0, 16.0, 1.0), A, points, order=5)
    assert -field[2, 0, 0, 1] == pytest.approx(exact, rel=1e-3)
    np.testing.assert_allclose(field[:, :, :, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(field[:2, 0, 0, 1], 0.0, atol=1e-12)
