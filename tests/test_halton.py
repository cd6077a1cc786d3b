"""Points of Halton's sequence are those of SciPy, which takes longer to load."""

import numpy as np
import pytest
from scipy.stats import qmc

from underskin.halton import halton


@pytest.mark.parametrize(("points", "dimensions"), [(1, 1), (64, 3), (257, 9)])
def test_points_are_those_of_scipy(points: int, dimensions: int) -> None:
    np.testing.assert_array_equal(
        halton(points, dimensions), qmc.Halton(dimensions, scramble=False).random(points + 1)[1:]
    )
