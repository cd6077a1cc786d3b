"""The normal stress on the bonded base, recovered from the reactions.

Reactions of the held displacements determine the piecewise polynomial t with ∫ t N_i r dr = reaction_i: it balances
the load exactly and is far more accurate than stresses evaluated inside the elements. What is left of the mesh in t is
an oscillation between nodes; a smooth even spline fitted to it with the weight r averages it out, which gives the point
sensor (ρ = 0) the accuracy of the discs. The spline is fitted to *differences* from a known profile, so that its own
error is that of the small difference.
"""

from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import spsolve

from tablegen.discretisation import Discretisation
from tablegen.faces import gauss_rule, shapes_along
from underskin.units import Floats

PROFILE_END = 8.0  # thicknesses
_KNOT_SPACING = 0.15  # with the mesh's 0.2 and degree 5: bias below 1e-6 of σ, measured
_DEGREE = 5
_POINTS = 8  # a mesh interval


class BaseStress:
    """Reads the compressive stress on the base, in units of the shear modulus, from nodal internal forces."""

    def __init__(self, discretisation: Discretisation) -> None:
        self.discretisation = discretisation
        self.scalars = discretisation.scalars_on(lambda x: x[1] == 0.0)
        columns = np.unique(discretisation.basis.mesh.p[0])
        self._r, self._weight = gauss_rule(columns, _POINTS)
        values, numbers = shapes_along(discretisation, self._r, 0)
        points = np.broadcast_to(np.arange(self._r.size)[:, None], numbers.shape)
        shape = (self._r.size, discretisation.basis.N)
        every = coo_matrix((values.ravel(), (points.ravel(), numbers.ravel())), shape=shape).tocsc()
        self._shapes: csc_matrix = every[:, self.scalars]

    def at_points(self, internal_force: Floats) -> Floats:
        """The stress at the integration points of the base, in order of r."""
        coefficients = spsolve(self._mass, internal_force[2 * self.scalars + 1])
        return np.asarray(self._shapes @ coefficients)

    def total_force(self, stress: Floats) -> float:
        """∫ t r dr over the whole base, for a stress at the integration points; the 2π is left out."""
        return float(self._weight @ stress)

    @property
    def points(self) -> Floats:
        """Radii of the integration points."""
        return self._r

    def smooth(self, stress: Floats) -> BSpline:
        """The even spline on |r| ≤ `PROFILE_END` nearest to a stress at the integration points, weighted with r."""
        inside = self._r <= PROFILE_END
        r, root = self._r[inside], np.sqrt(self._weight[inside])
        positive = np.concatenate([np.arange(1, 28) * _KNOT_SPACING, np.arange(4.5, PROFILE_END, 0.5)])
        inner = np.concatenate([-positive[::-1], [0.0], positive])
        ends = np.full(_DEGREE + 1, PROFILE_END)
        mirrored = np.concatenate([-r[::-1], r])
        values = np.concatenate([stress[inside][::-1], stress[inside]])
        knots = np.concatenate([-ends, inner, ends])
        return make_lsq_spline(mirrored, values, knots, k=_DEGREE, w=np.concatenate([root[::-1], root]))

    @cached_property
    def _mass(self) -> csc_matrix:
        return (self._shapes.T @ self._shapes.multiply(self._weight[:, None])).tocsc()


def disc_averages(profile: BSpline, rho: Floats) -> Floats:
    """(2/ρ²) ∫₀^ρ t r dr for ascending ρ; t(0) at ρ = 0."""
    edges = np.unique(np.concatenate([[0.0], profile.t[profile.t > 0], rho]))
    r, weight = gauss_rule(edges[edges <= rho[-1]], _DEGREE)
    pieces = (weight * profile(r)).reshape(-1, _DEGREE).sum(axis=1)
    moments = np.interp(rho, edges[edges <= rho[-1]], np.concatenate([[0.0], np.cumsum(pieces)]))
    positive = rho > 0
    return np.where(positive, 2 * moments / np.where(positive, rho, 1.0) ** 2, profile(0.0))
