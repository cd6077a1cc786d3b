"""A sphere pressed into the layer, solved by FElupe: a check of the contact table (GPL: tests only).

Beside what `tests.support.felupe_layer` does otherwise than tablegen, the contact is another one: the indentation is
prescribed and the contact's edge is found; two points of every edge of the surface are in contact or not, with a
pressure that a penalty on the penetration gives first and Uzawa's iteration corrects. Lengths in thicknesses, stresses
in units of G; points are (z, r).
"""

import warnings
from collections.abc import Sequence

import felupe
import numpy as np
from felupe.mechanics import Assemble, Results
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from tests.support.felupe_layer import RIM, FelupeLayer, Floats, quadratic_mesh

_PENALTY = 1e4  # of G over the thickness
_FIRST_STEP = 1 / 2  # of the indentation
_CORRECTIONS = 1  # leaves a hundredth of the penetration, or less
_GAUSS = np.polynomial.legendre.leggauss(2)


class Sphere:
    """FElupe's view of a rigid sphere over the surface: an item with forces and a tangent."""

    def __init__(self, field: felupe.FieldContainer, nodes: NDArray[np.int64], radius: float) -> None:
        self.field, self.radius, self.indentation = field, radius, 0.0
        r = field.region.mesh.points[nodes, 1]
        self.edges = np.stack([nodes[0:-2:2], nodes[1:-1:2], nodes[2::2]], axis=1)
        x, w = _GAUSS
        self.shape = np.stack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2], axis=-1)  # (points, 3)
        half = (r[2::2] - r[0:-2:2])[:, None] / 2
        self.r = r[0:-2:2, None] + half * (1 + x)
        self.weight = 2 * np.pi * self.r * half * w
        self.multiplier = np.zeros_like(self.r)
        self.results = Results()
        self.assemble = Assemble(vector=self._vector, matrix=self._matrix, multiplier=None)

    @property
    def force(self) -> float:
        """What presses the sphere up."""
        pressure, normal, _ = self._state()
        return float(-(self.weight * pressure * normal[..., 0]).sum())

    @property
    def contact_radius(self) -> float:
        """Where the pressure ends, in the deformed state, to the distance of two points."""
        pressure, _, places = self._state()
        return float(places[..., 1][pressure > 0].max())

    def _state(self) -> tuple[Floats, Floats, Floats]:
        """Pressure, normal and place (relative to the sphere's centre in z) of the points of the surface."""
        u = np.einsum("qn,enc->eqc", self.shape, self.field[0].values[self.edges])
        places = np.stack([u[..., 0] + self.indentation - self.radius, self.r + u[..., 1]], axis=-1)
        distance = np.hypot(places[..., 0], places[..., 1])
        pressure = np.clip(self.multiplier + _PENALTY * (self.radius - distance), 0, None)
        return pressure, places / distance[..., None], places

    def correct(self) -> None:
        """Take the present pressure for the multiplier."""
        self.multiplier = self._state()[0]

    def _vector(self, **_: object) -> csr_matrix:
        pressure, normal = self._state()[:2]
        traction = (self.weight * pressure)[..., None] * normal
        forces = np.zeros_like(self.field[0].values)
        np.add.at(forces, self.edges, -np.einsum("qn,eqc->enc", self.shape, traction))
        return csr_matrix(forces.reshape(-1, 1))

    def _matrix(self, **_: object) -> csr_matrix:
        pressure, normal, places = self._state()
        outer = normal[..., :, None] * normal[..., None, :]
        distance = np.hypot(places[..., 0], places[..., 1])[..., None, None]
        touching = (pressure > 0)[..., None, None]
        tangent = touching * (_PENALTY * outer - pressure[..., None, None] / distance * (np.eye(2) - outer))
        blocks = np.einsum("eq,qm,qn,eqcd->emcnd", self.weight, self.shape, self.shape, tangent)
        numbers = (2 * self.edges[..., None] + np.arange(2)).reshape(len(self.edges), -1)
        rows = np.broadcast_to(numbers[:, :, None], (*numbers.shape, numbers.shape[1]))
        size = self.field[0].values.size
        entries = (blocks.ravel(), (rows.ravel(), np.swapaxes(rows, 1, 2).ravel()))
        return coo_matrix(entries, shape=(size, size)).tocsr()


def press(radius: float, indentation: float, a: float, rho: Sequence[float]) -> tuple[float, float, Floats]:
    """Force over G h², contact radius and σ on sensors `rho` of a sphere at this indentation.

    `a` is where the edge of the contact is expected: the mesh is fine there, no more.
    """
    layer = FelupeLayer(a, _mesh(a))
    sphere = Sphere(layer.field, layer.nodes(1.0), radius)
    reached, step = 0.0, _FIRST_STEP
    while reached < 1:
        goal = min(1.0, reached + step)
        sphere.indentation = goal * indentation
        if not _solved(layer, sphere, goal / reached if reached else 1.0):
            step /= 2
            assert step > 1e-3
            continue
        reached = goal
    for _ in range(_CORRECTIONS):
        sphere.correct()
        assert _solved(layer, sphere, 1.0)
    profile = layer.base_stress()
    primitive = profile.antiderivative()
    means = np.array([(primitive(x**2) - primitive(0.0)) / x**2 for x in rho])
    return sphere.force, sphere.contact_radius, 2 * np.pi / 3 * means / sphere.force


def _solved(layer: FelupeLayer, sphere: Sphere, factor: float) -> bool:
    """Newton's method from `factor` times the present state; where it fails, that state is back as it was."""
    before = [part.values.copy() for part in layer.field.fields]
    for part in layer.field.fields[:2]:  # displacement and pressure; the third is the ratio of volumes
        part.values *= factor
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # an iteration that has left all bounds
            felupe.newtonraphson(
                x0=layer.field,
                items=[layer.body, sphere],
                dof0=layer.held,
                dof1=layer.free,
                ext0=layer.prescribed,
                tol=1e-5,
                maxiter=40,
                verbose=0,
            )
    except (Warning, RuntimeError, felupe.NewtonConvergenceError):
        for part, values in zip(layer.field.fields, before, strict=True):
            part.values[:] = values
        return False
    return True


def _mesh(a: float) -> felupe.Mesh:
    """Coarser than `felupe_layer.graded_mesh`, since each step takes several solves; errors of 3e-4."""
    inside, outside, depth = (_graded(length, 0.04 * min(a, 1.0)) for length in (a, RIM, 1.0))
    return quadratic_mesh(1 - depth[::-1], np.append(a - inside[::-1], (a + outside)[1:]))


def _graded(length: float, smallest: float) -> Floats:
    """Nodes from 0 to `length`, their spacing growing from `smallest` to 0.12, and further beyond 4."""
    nodes, step = [0.0], smallest
    while nodes[-1] < length:
        nodes.append(nodes[-1] + step)
        step = min(1.5 * step, 0.12 if nodes[-1] < 4 else 2.0)
    return np.append(np.array(nodes[:-1]) * (length / nodes[-1]), length)
