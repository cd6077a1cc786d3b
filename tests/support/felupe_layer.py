"""The bonded layer under a Hertz pressure, solved by FElupe: a check of the tables (GPL: tests and bench).

Nothing here is shared with tablegen: another code, another element (Taylor–Hood, 9 displacement and 4
continuous pressure nodes, against discontinuous pressures of high order), another formulation (displacement,
pressure and volume ratio with a large bulk modulus, against exact incompressibility), another recovery of the
stress on the base.

Lengths in thicknesses, stresses in units of the shear modulus G; E = 3 G. FElupe's axisymmetric X axis is the
axis of rotation, so points are (z, r): z = 0 the base, z = 1 the surface.
"""

from collections.abc import Sequence

import felupe
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Floats = NDArray[np.float64]

BULK_MODULUS = 1e5  # of G: moves σ by less than 5e-6
RIM = 12.0  # distance from the contact to the free rim
_GAUSS = np.polynomial.legendre.leggauss(12)


class FelupeLayer:
    """The layer with a contact of radius a/h, ready to be loaded; `mesh` must have a node at (z, r) = (1, a)."""

    def __init__(self, a: float, mesh: felupe.Mesh | None = None) -> None:
        self.a = a
        self.mesh = graded_mesh(a) if mesh is None else mesh
        region = felupe.RegionBiQuadraticQuad(self.mesh)
        self.field = felupe.FieldsMixed(region, n=3, axisymmetric=True, disconnect=False)
        material = felupe.NearlyIncompressible(felupe.NeoHooke(mu=1.0), bulk=BULK_MODULUS)
        self.body = felupe.SolidBody(material, self.field)
        self.load = felupe.PointLoad(self.field, self.nodes(1.0))
        self._unit_load = self._hertz_forces()
        boundaries = {
            "base": felupe.Boundary(self.field[0], fx=0.0),
            "axis": felupe.Boundary(self.field[0], fy=0.0, skip=(1, 0)),
        }
        self.held, self.free = felupe.dof.partition(self.field, boundaries)
        self.prescribed = felupe.dof.apply(self.field, boundaries, self.held)

    def apply(self, peak_pressure: float) -> None:
        """Set the dead load (per reference area) with the peak q0/G; `solve` then finds its equilibrium."""
        self.load.update(np.stack([-peak_pressure * self._unit_load, np.zeros_like(self._unit_load)], axis=-1))

    def solve(self, tolerance: float = 1e-5) -> None:
        """Newton's method from the present state; the default tolerance moves σ by less than 1e-6."""
        self.field = felupe.newtonraphson(
            x0=self.field,
            items=[self.body, self.load],
            dof0=self.held,
            dof1=self.free,
            ext0=self.prescribed,
            tol=tolerance,
            verbose=0,
        ).x

    def sigma(self, rho: Sequence[float]) -> Floats:
        """σ = (2π/3) · mean stress on the base over each disc · h²/F, F the applied force."""
        profile = self.base_stress()
        primitive = profile.antiderivative()  # the mean over a disc is the mean over r² from 0 to ρ²
        means = [(primitive(x**2) - primitive(0.0)) / x**2 if x > 0 else profile(0.0) for x in rho]
        return 2 * np.pi / 3 * np.array(means) / -self.load.values[:, 0].sum()

    def base_stress(self) -> BSpline:
        """The compressive stress on the base as a spline in r², which has the same moments as the reactions.

        The reactions are ∫ t φ_i dA for the traces φ_i of the shape functions. The spline t = Σ c_k B_k
        solves ∫ t I(B_j) dA = Σ_i B_j(r_i) reaction_i, I the interpolation on these traces.
        """
        size = self.field[0].values.size
        reactions = self.body.assemble.vector(self.field).toarray()[:size, 0].reshape(-1, 2)
        nodes = self.nodes(0.0)
        r = self.mesh.points[nodes, 1]
        knots = np.concatenate([np.arange(0, 4, 0.2), np.arange(4.0, r[-1] - 0.5), [r[-1]]]) ** 2
        padded = np.pad(knots, 5, mode="edge")
        moments = np.zeros((r.size, padded.size - 6))
        for first in range(0, r.size - 1, 2):
            points, weights = _gauss(r[first], r[first + 2])
            splines = BSpline.design_matrix(points**2, padded, 5).toarray()
            shape = _shape(points, r[first], r[first + 2]) * weights * 2 * np.pi * points
            moments[first : first + 3] += shape @ splines
        at_nodes = BSpline.design_matrix(r**2, padded, 5).toarray()
        return BSpline(padded, np.linalg.solve(at_nodes.T @ moments, at_nodes.T @ reactions[nodes, 0]), 5)

    def _hertz_forces(self) -> Floats:
        """∫ √(1 − r²/a²) φ_i dA on the surface; r = a sin θ removes the root at the edge of the contact."""
        r = self.mesh.points[self.nodes(1.0), 1]
        forces = np.zeros(r.size)
        for first in range(0, int(np.searchsorted(r, self.a - 1e-9)), 2):
            angle, weights = _gauss(*np.arcsin(np.clip(r[[first, first + 2]] / self.a, 0, 1)))
            points = self.a * np.sin(angle)
            weights = weights * 2 * np.pi * points * self.a * np.cos(angle) ** 2
            forces[first : first + 3] += _shape(points, r[first], r[first + 2]) @ weights
        return forces

    def nodes(self, z: float) -> NDArray[np.int64]:
        """The nodes at height z, by ascending radius."""
        nodes = np.flatnonzero(np.isclose(self.mesh.points[:, 0], z))
        return nodes[np.argsort(self.mesh.points[nodes, 1])]


def sigma(a: float, rho: Sequence[float], load_parameter: float) -> Floats:
    """σ(a/h, rT/h, L) of the incompressible neo-Hookean layer for each of `rho` (0 is the point sensor)."""
    layer = FelupeLayer(a)
    layer.apply(peak_pressure(load_parameter))
    layer.solve()
    return layer.sigma(rho)


def peak_pressure(load_parameter: float) -> float:
    """q0/G for E = 3 G, ν = 0.5: q0/E = (3/2π) (3/4 · 3/4)^(−2/3) L^(1/3)."""
    return float(3 * 1.5 / np.pi * 0.75 ** (-4 / 3) * load_parameter ** (1 / 3))


def graded_mesh(a: float) -> felupe.Mesh:
    """A mesh that is fine at the contact's edge (1, a); errors of 3e-5 at most, on the axis, elsewhere 1e-5."""
    smallest = 0.04 * min(a, 1.0)
    r = np.append(a - _graded(a, smallest)[::-1], (a + _graded(RIM, smallest))[1:])
    return quadratic_mesh(1 - _graded(1.0, smallest)[::-1], r)


def quadratic_mesh(z: Floats, r: Floats) -> felupe.Mesh:
    """9-node quadrilaterals between the lines of a tensor grid."""
    return felupe.Grid(z, r).add_midpoints_edges().add_midpoints_faces()


def _graded(length: float, smallest: float) -> Floats:
    """Nodes from 0 to `length`, their spacing growing from `smallest` to 0.05, and further beyond 5."""
    nodes = [0.0]
    step = smallest
    while nodes[-1] < length:
        nodes.append(nodes[-1] + step)
        step = min(1.4 * step, 0.05 if nodes[-1] < 5 else 2.0)
    scaled = np.array(nodes) * (length / nodes[-1])
    scaled[-1] = length
    return scaled


def _gauss(low: float, high: float) -> tuple[Floats, Floats]:
    """Gauss–Legendre points and weights on an interval."""
    points, weights = _GAUSS
    return (low + high) / 2 + (high - low) / 2 * points, weights * (high - low) / 2


def _shape(r: Floats, low: float, high: float) -> Floats:
    """The three quadratic shape functions of an edge, (3, points)."""
    x = (2 * r - low - high) / (high - low)
    return np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
