"""The spline at single points: the same numbers as SciPy's, and a table's `at` the same as its columns."""

import itertools
import math

import numpy as np
import pytest
from scipy.interpolate import NdBSpline

from underskin import load_table
from underskin.surrogate.point_spline import PointSpline
from underskin.surrogate.sigma_table import interpolation_coefficients

TABLE = load_table()
GENERATOR = np.random.default_rng(3)
AXES = [np.cumsum(GENERATOR.uniform(0.1, 1.0, count)) - 1 for count in (7, 9, 6)]
SPLINE = NdBSpline(*interpolation_coefficients(AXES, GENERATOR.normal(size=(7, 9, 6))), 3)
POINT_SPLINE = PointSpline(SPLINE)

INSIDE = GENERATOR.uniform([axis[0] for axis in AXES], [axis[-1] for axis in AXES], (300, 3))
NODES = np.array(list(itertools.product(*AXES)))


@pytest.mark.parametrize("points", [INSIDE, NODES], ids=["inside", "nodes and limits"])
def test_values_are_scipys(points: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> None:
    expected = SPLINE(points)
    for point, value in zip(points.tolist(), expected.tolist(), strict=True):
        cell = POINT_SPLINE.cell(*point)
        assert cell is not None
        assert POINT_SPLINE.value(cell, *point) == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_there_is_no_cell_outside(axis: int) -> None:
    middle = [float(nodes[2]) for nodes in AXES]
    low, high = float(AXES[axis][0]), float(AXES[axis][-1])
    for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf), -math.inf, math.inf, math.nan):
        point = [*middle[:axis], value, *middle[axis + 1 :]]
        assert POINT_SPLINE.cell(*point) is None


def test_table_answers_point_answers_column() -> None:
    """The table answers a point as it answers a column.

    σ to rounding; the error exactly, at nodes and limits too.

    Not at L's nodes: there the last bit of the cube root decides which of two cells' errors is reported.
    """
    limits = [list(limits) for limits in TABLE.domain.values()]
    corners = np.array([*itertools.product(*limits), (3.0, 3.0, 0.1)])
    nodes = np.stack([GENERATOR.choice(axis, 2000) for axis in TABLE.axes[:2]] + [GENERATOR.uniform(0, 0.1, 2000)], 1)
    random = GENERATOR.uniform(0, [3.05, 3.05, 0.102], (3000, 3))
    points = np.concatenate([corners, nodes, random])
    columns = TABLE.sigma(*points.T)
    assert 0.85 < columns.inside.mean() < 1
    assert columns.inside[: len(corners)].all()
    for row, point in enumerate(points.tolist()):
        found = TABLE.at(*point)
        assert (found is not None) == columns.inside[row]
        if found is not None:
            assert found[0] == pytest.approx(columns.sigma[row], rel=1e-13)
            assert found[1] == columns.rel_error[row]
