"""The block's tensor grid, one edge at a time: graded nodes, one-dimensional matrices, points on a disc."""

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, BilinearForm, ElementLinePp, MeshLine

from underskin.units import Floats

_RATIO = 2.0

_mass = BilinearForm(lambda u, v, _: u * v)
_trial_slope = BilinearForm(lambda u, v, _: u.grad[0] * v)
_stiffness = BilinearForm(lambda u, v, _: u.grad[0] * v.grad[0])


class Axis:
    """Matrices along one edge: displacements of order k ≥ 4, pressures of order k − 1, both continuous.

    Rows are test functions, columns trial functions:
      mass ∫ v u, stiffness ∫ v' u', trial_slope ∫ v u', test_slope ∫ v' u    displacement × displacement
      pressure ∫ q u, pressure_slope ∫ q u'                                   pressure × displacement
      pressure_mass ∫ q p                                                     pressure × pressure
    `elements` restricts the integrals, `rows` the displacements used as test functions.
    """

    def __init__(
        self,
        nodes: Floats,
        order: int,
        elements: NDArray[np.int64] | None = None,
        rows: slice = slice(None),
    ) -> None:
        self.nodes = nodes
        self.order = order
        mesh = MeshLine(nodes)
        self._basis = Basis(mesh, ElementLinePp(order), intorder=2 * order, elements=elements)
        pressures = Basis(mesh, ElementLinePp(order - 1), intorder=2 * order, elements=elements)
        self.mass = _mass.assemble(self._basis).toarray()[rows]
        self.stiffness = _stiffness.assemble(self._basis).toarray()[rows]
        slope = _trial_slope.assemble(self._basis).toarray()
        self.trial_slope = slope[rows]
        self.test_slope = slope.T[rows]
        self.pressure = _mass.assemble(self._basis, pressures).toarray()[:, rows]
        self.pressure_slope = _trial_slope.assemble(self._basis, pressures).toarray()[:, rows]
        self.pressure_mass = _mass.assemble(pressures).toarray()

    @property
    def at_zero(self) -> NDArray[np.bool_]:
        """Which displacement sits at coordinate 0."""
        return np.arange(self._basis.N) == self._basis.nodal_dofs[0, 0]

    @property
    def integral(self) -> Floats:
        """∫ of each shape function."""
        ones = np.zeros(self._basis.N)
        ones[self._basis.nodal_dofs[0]] = 1.0  # the vertex functions add up to 1
        return np.asarray(self.mass @ ones)

    def values(self, points: Floats) -> Floats:
        """Shape functions at points: (points, displacements)."""
        element = np.clip(np.searchsorted(self.nodes, points, side="right") - 1, 0, len(self.nodes) - 2)
        local = (points - self.nodes[element]) / np.diff(self.nodes)[element]
        shapes = ElementLinePp(self.order)  # a fresh one: it remembers the points of its first evaluation
        values = np.zeros((len(points), self._basis.N))
        for i, numbers in enumerate(self._basis.element_dofs):
            values[np.arange(len(points)), numbers[element]] = shapes.lbasis(local[None], i)[0]
        return values

    def layer_above(self, plane: float) -> "Axis":
        """Only the elements above the node at `plane`, and as test function only that node's."""
        node = int(np.argmin(np.abs(self.nodes - plane)))
        number = int(self._basis.nodal_dofs[0, node])
        return Axis(self.nodes, self.order, np.array([node]), slice(number, number + 1))


def graded_nodes(length: float, first: float, last: float) -> Floats:
    """Nodes from 0 to `length`: `first` apart at 0, `last` at the end (at most), growing between."""
    half = length / 2
    return np.concatenate([_growing(half, first), length - _growing(half, last)[-2::-1]])


def _growing(length: float, first: float) -> Floats:
    nodes = [0.0]
    step = first
    while nodes[-1] < length:
        nodes.append(nodes[-1] + step)
        step *= _RATIO
    return np.array(nodes) * (length / nodes[-1])


def polar_points(radius: float) -> tuple[Floats, Floats, Floats]:
    """Points x, y of a quarter disc and the area of each; a square root at the rim keeps the high order."""
    x, w = np.polynomial.legendre.leggauss(64)
    angle, weight = np.pi / 4 * (1 + x), np.pi / 4 * w  # on (0, π/2), for the azimuth and for θ
    r = radius * np.sin(angle)  # r = radius sin θ makes √(1 − r²/radius²) = cos θ smooth
    r_weight = weight * radius**2 * np.sin(angle) * np.cos(angle)
    return (
        np.multiply.outer(r, np.cos(angle)).ravel(),
        np.multiply.outer(r, np.sin(angle)).ravel(),
        np.multiply.outer(r_weight, weight).ravel(),
    )
