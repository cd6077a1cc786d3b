"""A finite block instead of an endless layer: linear, incompressible, three-dimensional.

The block lies on a rigid base; its side walls and its top are free, and the Hertz pressure presses on the
centre of its top. Lengths are in units of the depth h of the sensors' plane, one unit below the top; the base
may lie deeper. By symmetry a quarter is solved: 0 ≤ x ≤ length/2, 0 ≤ y ≤ width/2, 0 ≤ z ≤ depth. With shear
modulus 1, find u and p so that for all v that respect the base and the planes of symmetry, and for all q,

    ∫ 2 ε(u):ε(v) − p div v − q div u = −∫_top pressure · v_z

in Taylor–Hood elements Q_k/Q_(k−1) on a tensor grid (`block_grid.py`), where every matrix is a sum of
Kronecker products of one-dimensional ones; the three-dimensional matrix is never formed. MINRES solves it,
preconditioned by the inverse of each diagonal block of the elasticity operator (fast diagonalisation) and of
the pressure's mass matrix. Source: Elman, Silvester, Wathen, Finite Elements and Fast Iterative Solvers,
2014, chapter 4; Lynch, Rice, Thomas, Numer. Math. 6 (1964) 185.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, minres
from threadpoolctl import threadpool_limits

from docs.paper.block_grid import Axis, graded_nodes, polar_points
from underskin.errors import SolverError
from underskin.units import Floats

_TOLERANCE = 1e-12
_MOST_ITERATIONS = 4000
_DIRECTIONS = range(3)

Axes = tuple[Axis, Axis, Axis]


@dataclass(frozen=True)
class FiniteBlock:
    """Full length (along x), full width (along y) and depth of the base, in units of h; `depth` ≥ 1.

    `bonded`: the base holds the block; otherwise it only carries it, without friction.
    """

    length: float
    width: float
    depth: float
    bonded: bool = True


@dataclass(frozen=True)
class Solution:
    """σ on each sensor, and what the solve says of itself.

    `sigma` (sensors,): the mean stress on each sensor's disc in units of −3F/(2πh²).
    `force`: the force through the sensors' plane over F, 1 but for the solver's tolerance.
    `unknowns`, `iterations`: size and cost of the solve.
    """

    sigma: Floats
    force: float
    unknowns: int
    iterations: int


def solve(block: FiniteBlock, a: float, rho: Floats, order: int = 5) -> Solution:
    """σ of the block under the Hertz pressure of radius `a` (a/h) for sensors of radii `rho` (rT/h, array).

    `order` is that of the displacements, at least 4. Raises SolverError if the iteration does not converge.
    """
    axes, problem, displacement, pressure, iterations = _solved(block, a, order)
    traction = _traction(axes, block.depth - 1.0, displacement, pressure)
    sigma = [-2 * np.pi / 3 * _disc_mean(axes, traction, radius) for radius in rho]
    force = -4 * float(axes[0].integral @ traction @ axes[1].integral)
    return Solution(np.array(sigma), force, problem.unknowns, iterations)


def displacements(block: FiniteBlock, a: float, points: tuple[Floats, Floats, Floats], order: int = 5) -> Floats:
    """Displacements (3, x, y, z) in units of F/(Gh) on the grid of `points` x, y ≥ 0 and z above the base, as `solve`'s
    arguments else; x and y lie in the quarter that is solved."""
    axes, _, displacement, _, _ = _solved(block, a, order)
    factors = [axis.values(along) for axis, along in zip(axes, points, strict=True)]
    return np.stack([_kronecker(factors, component) for component in displacement])


def _solved(block: FiniteBlock, a: float, order: int) -> tuple[Axes, "_Problem", Floats, Floats, int]:
    axes = _grid(block, a, order)
    problem = _Problem(axes, block.bonded)
    with threadpool_limits(1):  # many small products: threads cost more than they bring
        displacement, pressure, iterations = problem.solve(_hertz_load(axes, a))
    return axes, problem, displacement, pressure, iterations


def _grid(block: FiniteBlock, a: float, order: int) -> Axes:
    """Fine at the contact and, less so, where free walls meet the base; a node on the sensors' plane."""
    fine, corner = a / 2, 0.2
    x, y = (graded_nodes(edge / 2, fine, corner) for edge in (block.length, block.width))
    below_top = graded_nodes(1.0, fine, corner)
    if block.depth > 1:
        below_top = np.append(below_top, 1 + graded_nodes(block.depth - 1, corner, corner)[1:])
    return Axis(x, order), Axis(y, order), Axis((block.depth - below_top)[::-1], order)


def _hertz_load(axes: Axes, a: float) -> Floats:
    """Nodal loads (z components, on the top) of the Hertz pressure of total force 1 over the whole disc."""
    x, y, area = polar_points(a)
    pressure = 1.5 / (np.pi * a**2) * np.sqrt(1 - (x**2 + y**2) / a**2)
    load = axes[0].values(x).T @ ((area * pressure)[:, None] * axes[1].values(y))
    top = axes[2].values(axes[2].nodes[-1:])[0]
    return -load[:, :, None] * top


def _traction(axes: Axes, plane: float, displacement: Floats, pressure: Floats) -> Floats:
    """Coefficients (x, y) of the stress T3 on the plane z = `plane`, from consistent reactions.

    With v_z = N(x, y) χ(z), where χ falls from 1 on the plane to 0 across the elements just above it, the
    internal virtual work of those elements is −∫ T3 N: so T3 balances the load exactly.
    """
    x, y, z = axes
    above = z.layer_above(plane)
    reaction = _elasticity_row((x, y, above), 2, displacement) - _gradient((x, y, above), 2, pressure)
    return -np.linalg.solve(x.mass, np.linalg.solve(y.mass, reaction[:, :, 0].T).T)


def _disc_mean(axes: Axes, traction: Floats, radius: float) -> float:
    """The mean of the stress over a disc, or its value at the centre for radius 0."""
    x, y, area = polar_points(radius) if radius > 0 else (np.zeros(1), np.zeros(1), np.ones(1))
    stress = np.einsum("qi,ij,qj->q", axes[0].values(x), traction, axes[1].values(y), optimize=True)
    return float(area @ stress / area.sum())


def _kronecker(factors: list[Floats], u: Floats) -> Floats:
    """(A ⊗ B ⊗ C) u for u (x, y, z): each factor meets the first axis, which then goes to the end."""
    for factor in factors:
        u = np.moveaxis(np.tensordot(factor, u, axes=1), 0, -1)
    return u


def _elasticity_row(axes: Axes, a: int, u: Floats) -> Floats:
    """∫ 2 ε(u):ε(v) = Σ_b ∫ (∂_b u_a + ∂_a u_b) ∂_b v_a for v along direction `a`, from u (3, x, y, z)."""
    terms = []
    for b in _DIRECTIONS:
        factors = [axis.mass for axis in axes]
        factors[b] = axes[b].stiffness
        terms.append((2 if a == b else 1) * _kronecker(factors, u[a]))
        if a != b:
            factors = [axis.mass for axis in axes]
            factors[a], factors[b] = axes[a].trial_slope, axes[b].test_slope
            terms.append(_kronecker(factors, u[b]))
    return np.add.reduce(terms)


def _gradient(axes: Axes, a: int, p: Floats) -> Floats:
    """∫ p div v for v along direction `a`."""
    factors = [axis.pressure.T for axis in axes]
    factors[a] = axes[a].pressure_slope.T
    return _kronecker(factors, p)


def _divergence(axes: Axes, u: Floats) -> Floats:
    """∫ q div u, from u (3, x, y, z)."""
    terms = []
    for a in _DIRECTIONS:
        factors = [axis.pressure for axis in axes]
        factors[a] = axes[a].pressure_slope
        terms.append(_kronecker(factors, u[a]))
    return np.add.reduce(terms)


class _Problem:
    """The saddle-point system on the free displacements and its preconditioner."""

    def __init__(self, axes: Axes, bonded: bool) -> None:
        self.axes = axes
        self.shape_u = (3, *(axis.mass.shape[0] for axis in axes))
        self.shape_p = tuple(axis.pressure_mass.shape[0] for axis in axes)
        self.free = np.stack([_free(axes, a, bonded) for a in _DIRECTIONS])
        self.unknowns = int(self.free.sum()) + int(np.prod(self.shape_p))
        self.inverses = [_FastInverse(axes, a, self.free[a]) for a in _DIRECTIONS]
        self.inverse_masses = [np.linalg.inv(axis.pressure_mass) for axis in axes]

    def solve(self, load: Floats) -> tuple[Floats, Floats, int]:
        """Displacement (3, x, y, z), pressure (x, y, z) and the number of iterations for a load along z."""
        right = self._joined(np.stack([np.zeros_like(load), np.zeros_like(load), load]), np.zeros(self.shape_p))
        iterations = 0

        def count(_: Floats) -> None:
            nonlocal iterations
            iterations += 1

        n = right.size
        solution, failure = minres(
            LinearOperator((n, n), matvec=self._apply, dtype=float),
            right,
            M=LinearOperator((n, n), matvec=self._precondition, dtype=float),
            rtol=_TOLERANCE,
            maxiter=_MOST_ITERATIONS,
            callback=count,
        )
        if failure:
            raise SolverError(f"the block's linear system did not converge in {_MOST_ITERATIONS} iterations")
        return *self._split(solution), iterations

    def _apply(self, vector: Floats) -> Floats:
        u, p = self._split(vector)
        forces = [_elasticity_row(self.axes, a, u) - _gradient(self.axes, a, p) for a in _DIRECTIONS]
        return self._joined(np.stack(forces), -_divergence(self.axes, u))

    def _precondition(self, vector: Floats) -> Floats:
        u, p = self._split(vector)
        inverse_u = np.stack([inverse(component) for inverse, component in zip(self.inverses, u, strict=True)])
        return self._joined(inverse_u, _kronecker(self.inverse_masses, p))

    def _joined(self, u: Floats, p: Floats) -> Floats:
        return np.concatenate([(u * self.free).ravel(), p.ravel()])

    def _split(self, vector: Floats) -> tuple[Floats, Floats]:
        size = int(np.prod(self.shape_u))
        return vector[:size].reshape(self.shape_u), vector[size:].reshape(self.shape_p)


def _free(axes: Axes, a: int, bonded: bool) -> NDArray[np.bool_]:
    """The free displacements along `a`: held across x = 0, y = 0, z = 0, and everywhere on a bonded base."""
    held_at_zero = {a, 2} if bonded else {a}
    held = [axis.at_zero & (direction in held_at_zero) for direction, axis in enumerate(axes)]
    return ~(held[0][:, None, None] | held[1][:, None] | held[2])


class _FastInverse:
    """The inverse of one diagonal block, 2 K⊗M⊗M + M⊗K⊗M + M⊗M⊗K with the 2 in the block's own direction."""

    def __init__(self, axes: Axes, a: int, free: NDArray[np.bool_]) -> None:
        self.modes = []
        values = []
        for direction, axis in enumerate(axes):
            free_rows = np.flatnonzero(free.any(axis=tuple(set(_DIRECTIONS) - {direction})))
            square = np.ix_(free_rows, free_rows)
            value, vector = eigh(axis.stiffness[square], axis.mass[square])
            modes = np.zeros((free.shape[direction], free_rows.size))
            modes[free_rows] = vector
            self.modes.append(modes)
            values.append((2 if direction == a else 1) * value)
        self.values = values[0][:, None, None] + values[1][:, None] + values[2]

    def __call__(self, u: Floats) -> Floats:
        return _kronecker(self.modes, _kronecker([m.T for m in self.modes], u) / self.values)
