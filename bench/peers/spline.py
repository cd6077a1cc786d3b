"""σ from the table by scipy alone, as a lab would write it; the peers run it, one in an environment of its own."""

import h5py
import numpy as np
from scipy.interpolate import NdBSpline, make_interp_spline


def read_spline(table: str) -> NdBSpline:
    """The cubic spline through the table's σ, over a/h, rT/h and L^(1/3)."""
    with h5py.File(table) as file:
        axes = [np.asarray(file[f"sigma/{name}"]) for name in ("a_over_h", "rt_over_h", "cbrt_load_parameter")]
        coefficients = np.asarray(file["sigma/sigma"])
    knots = []
    for number, nodes in enumerate(axes):
        spline = make_interp_spline(nodes, coefficients, k=3, axis=number)
        knots.append(spline.t)
        coefficients = np.moveaxis(spline.c, 0, number)
    return NdBSpline(tuple(knots), np.ascontiguousarray(coefficients), 3)
