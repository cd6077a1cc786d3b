"""Solves the finite-strain layer and writes `finite_strain.npz`: `python -m rig.finite_strain_solve` (a minute).

An incompressible neo-Hookean layer (G = 1, h = 1), bonded to a rigid base, pressed by the Hertz pressure as a dead load
of radius a. Total Lagrangian, axisymmetric, mixed: biquadratic displacements, linear discontinuous pressure (Q2/P1,
Fortin and Brezzi 1991):  δ∫ (G/2)(F:F − 3) − p (det F − 1) dV = δ(work of the load). Newton's method, load by load.

Kept is what finite strain *adds* to the stress on the base, from the nodal reactions R_i of the same mesh:
    Δ(k; a, x) = Σ_i [R_i(x)/F(x) − R_i(→0)/F(→0)] J0(k r_i) = c1 x + c2 x² + c3 x³ + c4 x⁴,  x = L^(1/3).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from scipy.special import j0

from rig.layer import RIM, WAVENUMBERS, Floats

DATA = Path(__file__).with_name("finite_strain.npz")
RADII = np.concatenate([[0.04, 0.08, 0.12, 0.17, 0.23, 0.3], np.arange(0.4, 3.3, 0.14)])
LOADS = np.array([0.116, 0.232, 0.348, 0.4642])  # x
HIGHEST_WAVENUMBER = 12.0  # the addition by finite strain is smooth on the base
_SHEAR = 1.0
_Q0_OVER_E_X = 1.5 / np.pi * 0.5625 ** (-2 / 3)  # q0/E = this · L^(1/3)
_GAUSS = np.polynomial.legendre.leggauss(3)


def hertz_force(a: float, x: float) -> float:
    """Total force of the load, E = 3 G."""
    return 2 / 3 * np.pi * a**2 * _Q0_OVER_E_X * x * 3 * _SHEAR


@dataclass(frozen=True)
class Mesh:
    """A grid of nine-node rectangles: `r`, `z` of the nodes, `cells` (elements, 9), row by row."""

    r: Floats
    z: Floats
    cells: NDArray[np.intp]
    edges_r: Floats


def graded(start: float, first: float, ratio: float, end: float) -> Floats:
    """Points from start to end, steps growing from `first`."""
    count = int(np.ceil(np.log1p((ratio - 1) * (end - start) / first) / np.log(ratio)))
    steps = ratio ** np.arange(count)
    return start + (end - start) * np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def make_mesh(a: float, fineness: float = 2.5) -> Mesh:
    """The mesh for a contact of radius a: fine at the contact's edge and at the surface."""
    size = min(a / 4, 0.12) / fineness
    ratio = 1 + 0.35 / fineness
    inner = a - graded(0.0, size / 2, ratio, a)[::-1]
    outer = graded(a, size / 2, ratio, a + 5.0)
    edges_r = np.concatenate([inner, outer[1:]])
    edges_z = 1 - graded(0.0, size, ratio, 1.0)[::-1]
    nodes_r = np.sort(np.concatenate([edges_r, (edges_r[1:] + edges_r[:-1]) / 2]))
    nodes_z = np.sort(np.concatenate([edges_z, (edges_z[1:] + edges_z[:-1]) / 2]))
    number = np.arange(len(nodes_r) * len(nodes_z)).reshape(len(nodes_z), len(nodes_r))
    cells = [
        number[2 * j : 2 * j + 3, 2 * i : 2 * i + 3].ravel()
        for j in range(len(edges_z) - 1)
        for i in range(len(edges_r) - 1)
    ]
    r, z = np.meshgrid(nodes_r, nodes_z)
    return Mesh(r.ravel(), z.ravel(), np.array(cells), edges_r)


def _lagrange(x: float) -> tuple[Floats, Floats]:
    return np.array([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


class FiniteStrainLayer:
    """Assembly for one mesh; unknowns are u_r, u_z of every node, then three pressures an element."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        nodes, elements = len(mesh.r), len(mesh.cells)
        r, z = mesh.r[mesh.cells], mesh.z[mesh.cells]
        half_r, half_z = (r[:, 2] - r[:, 0]) / 2, (z[:, 6] - z[:, 0]) / 2
        gradients, weights, modes = [], [], []
        for y, wy in zip(*_GAUSS, strict=True):
            for x, wx in zip(*_GAUSS, strict=True):
                (lx, dx), (ly, dy) = _lagrange(x), _lagrange(y)
                shape = np.outer(ly, lx).ravel()
                radius = r @ shape
                # Rows of B: the gradients dr, dz and the hoop term N/r, of each node.
                slope_r = np.outer(ly, dx).ravel() / half_r[:, None]
                slope_z = np.outer(dy, lx).ravel() / half_z[:, None]
                gradients.append(np.stack([slope_r, slope_z, shape / radius[:, None]], axis=1))
                weights.append(2 * np.pi * radius * half_r * half_z * wx * wy)
                modes.append([1.0, x, y])
        self.gradients = np.array(gradients).transpose(1, 0, 2, 3)  # (elements, points, 3, 9)
        self.weights = np.array(weights).T
        self.modes = np.array(modes)
        displacement = np.stack([2 * mesh.cells, 2 * mesh.cells + 1], axis=2).reshape(elements, 18)
        pressure = 2 * nodes + np.arange(3 * elements).reshape(elements, 3)
        self.unknowns = np.concatenate([displacement, pressure], axis=1)
        self.size = 2 * nodes + 3 * elements
        base = np.flatnonzero(mesh.z < 1e-12)
        rolls = np.flatnonzero((mesh.r < 1e-12) | (mesh.r > mesh.r.max() - 1e-12))
        self.base = base
        fixed = np.unique(np.concatenate([2 * base, 2 * base + 1, 2 * rolls]))
        self.free = np.setdiff1d(np.arange(self.size), fixed)

    def load(self, a: float) -> Floats:
        """Consistent nodal forces of a Hertz pressure of unit total force, pressing down, (unknowns,)."""
        forces = np.zeros(self.size)
        top = np.flatnonzero(self.mesh.z > 1 - 1e-12)
        edges = self.mesh.edges_r
        angle, weight = np.polynomial.legendre.leggauss(16)
        for element in np.flatnonzero(edges[:-1] < a * (1 - 1e-9)):
            low, high = edges[element], edges[element + 1]
            # r = a sin θ removes the square root at the edge.
            ends = np.arcsin(np.minimum(np.array([low, high]) / a, 1.0))
            theta = ends.mean() + np.diff(ends) / 2 * angle
            r = a * np.sin(theta)
            dr = a * np.cos(theta) * np.diff(ends) / 2 * weight
            share = 1.5 / (np.pi * a**2) * np.cos(theta) * 2 * np.pi * r * dr
            for point, part in zip((2 * r - low - high) / (high - low), share, strict=True):
                forces[2 * top[2 * element : 2 * element + 3] + 1] -= part * _lagrange(point)[0]
        return forces

    def residual(self, state: Floats) -> tuple[Floats, coo_matrix]:
        """Internal forces and their tangent."""
        local = state[self.unknowns]
        u = local[:, :18].reshape(-1, 9, 2)
        slope = np.einsum("epcn,enk->epck", self.gradients, u)
        deformation = np.zeros((*slope.shape[:2], 5))  # F_rr, F_rz, F_zr, F_zz, F_hoop
        deformation[..., 0], deformation[..., 1] = 1 + slope[..., 0, 0], slope[..., 1, 0]
        deformation[..., 2], deformation[..., 3] = slope[..., 0, 1], 1 + slope[..., 1, 1]
        deformation[..., 4] = 1 + slope[..., 2, 0]
        pressure = local[:, 18:] @ self.modes.T
        volume, cofactor, second = _determinant(deformation)
        stress = _SHEAR * deformation - pressure[..., None] * cofactor
        tangent = _SHEAR * np.eye(5) - pressure[..., None, None] * second
        b = self._b_matrix()
        w = self.weights
        forces = np.empty((len(local), 21))
        forces[:, :18] = np.einsum("ep,epc,epcn->en", w, stress, b)
        forces[:, 18:] = -np.einsum("ep,ep,pm->em", w, volume - 1, self.modes)
        matrix = np.zeros((len(local), 21, 21))
        weighted = (w[..., None, None] * (tangent @ b)).reshape(len(b), -1, 18)
        matrix[:, :18, :18] = b.reshape(len(b), -1, 18).transpose(0, 2, 1) @ weighted
        coupling = -np.einsum("ep,epc,epcn,pm->enm", w, cofactor, b, self.modes, optimize=True)
        matrix[:, :18, 18:] = coupling
        matrix[:, 18:, :18] = coupling.transpose(0, 2, 1)
        total = np.bincount(self.unknowns.ravel(), forces.ravel(), self.size).astype(np.float64)
        rows = np.repeat(self.unknowns, 21, axis=1).ravel()
        columns = np.tile(self.unknowns, (1, 21)).ravel()
        return total, coo_matrix((matrix.ravel(), (rows, columns)), shape=(self.size, self.size))

    def _b_matrix(self) -> Floats:
        g = self.gradients
        b = np.zeros((*g.shape[:2], 5, 18))
        b[:, :, 0, 0::2], b[:, :, 1, 0::2] = g[:, :, 0], g[:, :, 1]
        b[:, :, 2, 1::2], b[:, :, 3, 1::2] = g[:, :, 0], g[:, :, 1]
        b[:, :, 4, 0::2] = g[:, :, 2]
        return b

    def solve(self, state: Floats, forces: Floats) -> Floats:
        """Newton's method from `state`; raises RuntimeError where it does not converge."""
        state = state.copy()
        for _ in range(12):
            internal, matrix = self.residual(state)
            if not np.isfinite(internal).all():
                break
            gap = (forces - internal)[self.free]
            if np.abs(gap).max() < 1e-9 * np.abs(forces).max():
                return state
            state[self.free] += self._step(matrix, gap)
        raise RuntimeError("Newton's method did not converge: a finer mesh or smaller loads are needed")

    def approach(self, state: Floats, before: Floats, forces: Floats, halvings: int = 5) -> Floats:
        """`solve` from the answer to the loads `before`, by half the way where the whole is too far."""
        try:
            return self.solve(state, forces)
        except RuntimeError:
            if halvings == 0:
                raise
        middle = (before + forces) / 2
        half_way = self.approach(state, before, middle, halvings - 1)
        return self.approach(half_way, middle, forces, halvings - 1)

    def _step(self, matrix: coo_matrix, gap: Floats) -> Floats:
        return np.asarray(splu(matrix.tocsc()[self.free][:, self.free]).solve(gap))

    def linear_forces(self, state: Floats, forces: Floats) -> Floats:
        """Internal forces of the linear answer to `forces`, (unknowns,)."""
        matrix = self.residual(state)[1]
        answer = np.zeros(self.size)
        answer[self.free] = self._step(matrix, forces[self.free])
        return np.asarray(matrix @ answer)

    def spectrum(self, internal: Floats, k: Floats) -> Floats:
        """Σ R_i J0(k r_i) over the base, R_i the upward reactions in the internal forces."""
        return np.asarray(internal[2 * self.base + 1] @ j0(np.multiply.outer(self.mesh.r[self.base], k)))


def _determinant(f: Floats) -> tuple[Floats, Floats, Floats]:
    """det F, its first and its second derivative with respect to (F_rr, F_rz, F_zr, F_zz, F_hoop)."""
    rr, rz, zr, zz, hoop = np.moveaxis(f, -1, 0)
    plane = rr * zz - rz * zr
    first = np.stack([zz * hoop, -zr * hoop, -rz * hoop, rr * hoop, plane], axis=-1)
    second = np.zeros((*f.shape, 5))
    for i, j, value in ((0, 3, hoop), (1, 2, -hoop), (0, 4, zz), (1, 4, -zr), (2, 4, -rz), (3, 4, rr)):
        second[..., i, j] = second[..., j, i] = value
    return plane * hoop, first, second


def added_spectrum(a: float, k: Floats, loads: Floats, fineness: float = 2.5) -> Floats:
    """Δ(k; a, x) at each load x, (loads, k)."""
    layer = FiniteStrainLayer(make_mesh(a, fineness))
    unit = layer.load(a)
    state = np.zeros(layer.size)
    state[2 * len(layer.mesh.r) :: 3] = _SHEAR  # the pressure at rest
    linear = layer.spectrum(layer.linear_forces(state, unit), k)
    added, force = [], 0.0
    for x in loads:
        before, force = force, hertz_force(a, x)
        state = layer.approach(state, before * unit, force * unit)
        added.append(layer.spectrum(layer.residual(state)[0], k) / force - linear)
    return np.array(added)


def main() -> None:
    """Solve every contact radius and write the coefficients c1 to c4, (radii, 4, k)."""
    k = WAVENUMBERS[WAVENUMBERS < HIGHEST_WAVENUMBER]
    powers = LOADS[:, None] ** np.arange(1, len(LOADS) + 1)
    coefficients = np.array([np.linalg.solve(powers, added_spectrum(a, k, LOADS)) for a in RADII])
    np.savez_compressed(DATA, a_over_h=RADII, coefficients=coefficients.astype(np.float32), rim=RIM)


if __name__ == "__main__":
    main()
