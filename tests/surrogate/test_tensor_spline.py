"""The tensor spline: the same numbers and slopes as SciPy's, and a table's `at` the same as its columns."""

import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.interpolate import NdBSpline, make_interp_spline

from underskin import load_table
from underskin.surrogate.sigma_table import TensorSpline
from underskin.units import Floats

TABLE = load_table()
GENERATOR = np.random.default_rng(3)
AXES = [np.cumsum(GENERATOR.uniform(0.1, 1.0, count)) - 1 for count in (7, 9, 6)]
VALUES = GENERATOR.normal(size=(7, 9, 6))
SPLINE = TensorSpline.through(AXES, VALUES)

INSIDE = GENERATOR.uniform([axis[0] for axis in AXES], [axis[-1] for axis in AXES], (300, 3))
NODES = np.array(list(itertools.product(*AXES)))


def _scipys() -> NdBSpline:
    coefficients, knots = VALUES, []
    for number, nodes in enumerate(AXES):
        spline = make_interp_spline(nodes, coefficients, k=3, axis=number)
        knots.append(spline.t)
        coefficients = np.moveaxis(spline.c, 0, number)
    return NdBSpline(tuple(knots), np.ascontiguousarray(coefficients), 3)


@pytest.mark.parametrize("points", [INSIDE, NODES], ids=["inside", "nodes and limits"])
def test_values_and_slopes_are_scipys(points: Floats) -> None:
    expected = _scipys()
    np.testing.assert_allclose(SPLINE.values(*points.T), expected(points), atol=1e-12)
    slopes = [expected(points, nu=order) for order in np.eye(3, dtype=int)]
    np.testing.assert_allclose(SPLINE.gradient(*points.T), slopes, atol=1e-10)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_there_is_no_value_outside(axis: int) -> None:
    middle = [float(nodes[2]) for nodes in AXES]
    low, high = float(AXES[axis][0]), float(AXES[axis][-1])
    for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf), -math.inf, math.inf, math.nan):
        point = [*middle[:axis], value, *middle[axis + 1 :]]
        assert np.isnan(SPLINE.values(*point))
        assert np.isnan(SPLINE.gradient(*point)).all()


def test_the_table_answers_a_point_as_it_answers_a_column() -> None:
    """σ to rounding; the error exactly, at nodes and limits too. Not at L's nodes: there the last bit of the cube root
    decides which of two cells' errors is reported."""
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


_ONE_BY_ONE = """
import sys
import numpy as np
import service.cli.serve
from underskin import load_table
from underskin.mechanisms.registry import CATALOGUE
CATALOGUE.load()
table = load_table()
points = [np.random.default_rng(4).uniform(*axis[[0, -1]], 200) for axis in table.axes]
points = [np.append(values, axis[[0, 1, -2, -1]]) for values, axis in zip(points, table.axes)]
rows = list(zip(points[0], points[1], points[2] ** 3)) + [(99.0, 0.1, 0.1)]
one_by_one = [table.sigma(*row) for row in rows]
assert "numba" not in sys.modules, "a server, or a single value, loads compiled code"
compiled = table.sigma(*np.transpose(rows))
np.testing.assert_array_equal([answer.sigma for answer in one_by_one], compiled.sigma)
np.testing.assert_array_equal([answer.rel_error for answer in one_by_one], compiled.rel_error)
"""


@pytest.mark.slow
def test_a_single_value_is_the_batch_s_bit_for_bit() -> None:
    """Without compiled code, at nodes and ends of the table too."""
    subprocess.run([sys.executable, "-c", _ONE_BY_ONE], check=True)
