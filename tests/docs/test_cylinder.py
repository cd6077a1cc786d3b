"""The cylinder that sticks to its platens: limits of its shape, and convergence."""

import numpy as np
import pytest

from docs.paper.cylinder import gent_lindley, stiffness_ratio

pytestmark = pytest.mark.soak  # as all that the paper needs


def test_a_slender_cylinder_shows_its_modulus() -> None:
    """Saint-Venant: what the ends hold is confined to a length of the order of the diameter."""
    excess = [height * (stiffness_ratio(height, 1.0) - 1) for height in (10.0, 20.0)]
    assert stiffness_ratio(20.0, 1.0) == pytest.approx(1.0, abs=0.01)
    assert excess[1] == pytest.approx(excess[0], rel=0.05)


def test_a_flat_disc_is_as_stiff_as_gent_and_lindley_say() -> None:
    """Lubrication between two plates: the parabolic pressure gives 2 S² E where S is large."""
    assert stiffness_ratio(1.0, 80.0) == pytest.approx(2 * 20.0**2, rel=0.01)
    assert stiffness_ratio(1.0, 40.0) / gent_lindley(1.0, 40.0) == pytest.approx(1.0, abs=0.01)


def test_the_papers_cylinder_converges() -> None:
    coarse, fine = (stiffness_ratio(2.5, 4.0, elements) for elements in (12, 24))
    assert coarse == pytest.approx(fine, rel=1e-4)
    assert fine == pytest.approx(1.379, abs=1e-3)


def test_only_the_shape_matters() -> None:
    assert stiffness_ratio(2.5, 4.0) == pytest.approx(stiffness_ratio(5.0, 8.0), rel=1e-9)
    shapes = np.array([stiffness_ratio(height, 1.0) for height in (0.5, 1.0, 3.0)])
    assert np.all(np.diff(shapes) < 0)
