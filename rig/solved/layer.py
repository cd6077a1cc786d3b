"""A layer of finite strain, axisymmetric, pressed by a rigid frictionless sphere in unilateral contact.

Total Lagrangian, thickness and Young's modulus of the main layer 1. Mixed Q2/P1 elements: biquadratic displacements,
linear discontinuous pressure, eliminated element by element (Fortin and Brezzi 1991). Stored energy

    W = (G/2) f(s) + p (J − 1) − p²/(2λ),   s = I1 − 3 − 2 ln J,   f = s (neo-Hooke), s + c2 s² (Yeoh),
    −Jm ln(1 − s/Jm) (Gent).

The contact is a penalty on the penetration of the Gauss points of the upper face into the sphere; its stiffness is
high enough that, with finite strain, the force at a depth is within 0.3 % of the exact linear one at R/a = 50.
Newton's method at each indentation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

Floats = NDArray[np.float64]
_GAUSS, _WEIGHT = np.polynomial.legendre.leggauss(3)
_PENALTY = 1e4  # E/h
_LARGEST_BULK = 2e4  # λ/G; ν = 0.499975, beyond which nothing changes by 0.01 %
_HIGHEST = 2.0  # E: no contact's pressure; what is higher is a first step's, and must not turn the tangent's sign
_COARSEST = 0.06  # width of the elements in the contact
_REACH = 5.0  # beyond the contact, in thicknesses: stresses on the base have decayed below 1e-5
_ITERATIONS, _SMALL, _HALVINGS = 15, 1e-8, 6


@dataclass(frozen=True)
class Material:
    """Isotropic and hyperelastic: Young's modulus, Poisson's ratio, Yeoh's c2, Gent's Jm (0: none)."""

    modulus: float = 1.0
    poisson: float = 0.5
    c2: float = 0.0
    limit: float = 0.0

    @property
    def shear(self) -> float:
        """Shear modulus G."""
        return self.modulus / (2 * (1 + self.poisson))

    @property
    def bulk(self) -> float:
        """Lamé's λ, bounded for ν = ½."""
        gap = 1 - 2 * self.poisson
        return self.shear * (min(2 * self.poisson / gap, _LARGEST_BULK) if gap > 0 else _LARGEST_BULK)


@dataclass(frozen=True)
class Sublayer:
    """Part of a layered skin, from the base upwards: its thickness and material."""

    thickness: float
    material: Material


class NotConverged(Exception):
    """Newton's method did not converge at an indentation, even in smaller steps."""


def graded(first: float, ratio: float, length: float) -> Floats:
    """Sizes of elements that grow from about `first` and fill a length."""
    count = max(2, int(np.ceil(np.log1p((ratio - 1) * length / first) / np.log(ratio))))
    sizes = ratio ** np.arange(count)
    return np.asarray(length * sizes / sizes.sum())


def _shape(x: float) -> tuple[Floats, Floats]:
    return np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


def _edges(sublayers: tuple[Sublayer, ...], size: float, ratio: float) -> tuple[Floats, list[Material]]:
    """Heights of the elements' edges, from the base up, and the material of each row of elements."""
    top = sum(part.thickness for part in sublayers)
    edges, rows, low = [0.0], [], 0.0
    for part in sublayers:
        fine = size + (ratio - 1) * (top - low - part.thickness)  # an element's size there
        steps = graded(min(fine, part.thickness / 2), ratio, part.thickness)[::-1]
        edges += list(low + np.cumsum(steps))
        rows += [part.material] * len(steps)
        low += part.thickness
    return np.array(edges), rows


class PressedLayer:
    """The layer and the sphere; each call of `press` continues from the previous state."""

    def __init__(
        self,
        sublayers: tuple[Sublayer, ...],
        radius: float,
        widest: float,
        fineness: float = 1.0,
        lateral: float | None = None,
    ) -> None:
        """`widest`: contact radius up to which the mesh is fine; `lateral`: radius of the skin's free edge."""
        self.radius = radius
        self.top = float(sum(part.thickness for part in sublayers))
        size = min(widest / 20, _COARSEST) / fineness
        ratio = 1 + 0.35 / fineness
        fine = np.linspace(0, 1.1 * widest, int(np.ceil(1.1 * widest / size)) + 1)
        end = widest + _REACH if lateral is None else lateral
        edges_r = np.concatenate([fine, fine[-1] + np.cumsum(graded(size, ratio, end - fine[-1]))])
        edges_z, rows = _edges(sublayers, min(1.5 * size, 0.12 / fineness), ratio)
        self._build(edges_r, edges_z, rows)
        self.hardest = max(part.material.modulus for part in sublayers)
        self.penalty = _PENALTY * self.hardest
        self.u = np.zeros((len(self.r), 2))
        self.pressure = np.zeros((len(self.cells), 3))
        self.depth = 0.0

    def _build(self, edges_r: Floats, edges_z: Floats, rows: list[Material]) -> None:
        r = np.sort(np.concatenate([edges_r, (edges_r[1:] + edges_r[:-1]) / 2]))
        z = np.sort(np.concatenate([edges_z, (edges_z[1:] + edges_z[:-1]) / 2]))
        nr, nz = len(edges_r) - 1, len(edges_z) - 1
        number = np.arange(len(r) * len(z)).reshape(len(z), len(r))
        self.cells = np.array(
            [number[2 * j : 2 * j + 3, 2 * i : 2 * i + 3].ravel() for j in range(nz) for i in range(nr)]
        )
        self.r, self.z = (grid.ravel() for grid in np.meshgrid(r, z))
        self.base, self.face = number[0], number[-1]
        material = [rows[j] for j in range(nz) for _ in range(nr)]
        self.shear, self.bulk, self.c2, self.limit = (
            np.array([getattr(part, name) for part in material])[:, None] for name in ("shear", "bulk", "c2", "limit")
        )
        self._integration(np.tile(np.diff(edges_r), nz), np.repeat(np.diff(edges_z), nr))
        self.spots = np.stack([2 * self.cells, 2 * self.cells + 1], axis=2).reshape(len(self.cells), 18)
        self.free = np.ones(2 * len(self.r), dtype=bool)
        self.free[2 * self.base] = self.free[2 * self.base + 1] = False
        self.free[2 * np.flatnonzero(self.r == 0)] = False
        self.kept = np.flatnonzero(self.free)
        self._surface(np.diff(edges_r))

    def _integration(self, wide: Floats, high: Floats) -> None:
        """The operator B from nodal displacements to (u_r,r, u_r,z, u_z,r, u_z,z, u_r/r), the pressure's shapes and the
        weights, at nine Gauss points of each element."""
        count = len(self.cells)
        self.b, self.weight = np.zeros((count, 9, 5, 18)), np.zeros((count, 9))
        self.q = np.zeros((9, 3))
        for k in range(9):
            (nz, dz), (nr, dr) = _shape(_GAUSS[k // 3]), _shape(_GAUSS[k % 3])
            n = np.outer(nz, nr).ravel()
            along_r = np.outer(nz, dr).ravel() / (wide / 2)[:, None]
            along_z = np.outer(dz, nr).ravel() / (high / 2)[:, None]
            r = self.r[self.cells] @ n
            self.b[:, k, 0, 0::2], self.b[:, k, 1, 0::2] = along_r, along_z
            self.b[:, k, 2, 1::2], self.b[:, k, 3, 1::2] = along_r, along_z
            self.b[:, k, 4, 0::2] = n / r[:, None]
            self.weight[:, k] = _WEIGHT[k // 3] * _WEIGHT[k % 3] * wide * high / 4 * 2 * np.pi * r
            self.q[k] = 1, _GAUSS[k % 3], _GAUSS[k // 3]
        self.mass = np.einsum("ek,ki,kj->eij", self.weight, self.q, self.q) / self.bulk[:, :, None]
        self.inverse_mass = np.linalg.inv(self.mass)

    def _surface(self, wide: Floats) -> None:
        """Nodes, shapes and weights of the Gauss points of the upper face (edges, points, nodes)."""
        self.edges = np.array([self.face[2 * i : 2 * i + 3] for i in range(len(wide))])
        self.n = np.array([_shape(x)[0] for x in _GAUSS])
        at = self.r[self.edges] @ self.n.T
        self.area = _WEIGHT * wide[:, None] / 2 * 2 * np.pi * at

    def _elements(self) -> tuple[Floats, Floats, Floats]:
        """Residual and stiffness of each element with its pressures eliminated, and what the pressures then are:
        (elements, 18), (elements, 18, 18), and (elements, 3, 19) for 1 and the increment of displacements."""
        f = np.einsum("ekij,ej->eki", self.b, self.u[self.cells].reshape(-1, 18)) + np.array([1.0, 0, 0, 1, 1])
        a, b, c, d, t = np.moveaxis(f, 2, 0)
        plane = a * d - b * c
        j = plane * t
        if not np.all(j > 0):
            raise NotConverged
        first = np.stack([d * t, -c * t, -b * t, a * t, plane], axis=2)
        second = np.zeros((*j.shape, 5, 5))
        for row, column, value in ((0, 3, t), (1, 2, -t), (0, 4, d), (1, 4, -c), (2, 4, -b), (3, 4, a)):
            second[..., row, column] = second[..., column, row] = value
        f1, f2 = self._energy(np.sum(f * f, axis=2) - 3 - 2 * np.log(j))
        g = 2 * (f - first / j[..., None])
        half = self.shear / 2
        p = self.pressure @ self.q.T
        stress = (half * f1)[..., None] * g + p[..., None] * first
        outer = first[..., :, None] * first[..., None, :]
        tangent = (half * f2)[..., None, None] * g[..., :, None] * g[..., None, :]
        tangent += (2 * half * f1)[..., None, None] * (np.eye(5) + outer / (j * j)[..., None, None])
        tangent += (p - 2 * half * f1 / j)[..., None, None] * second
        weighted = self.weight[..., None, None] * tangent
        count = len(self.cells)
        flat = self.b.reshape(count, 45, 18)
        stiffness = flat.transpose(0, 2, 1) @ np.matmul(weighted, self.b).reshape(count, 45, 18)
        residual = np.einsum("em,emi->ei", (self.weight[..., None] * stress).reshape(count, 45), flat)
        rows = np.matmul(first[..., None, :], self.b)[..., 0, :] * self.weight[..., None]  # δJ of the displacements
        coupling = np.einsum("ki,ekj->eij", self.q, rows)
        excess = np.einsum("ek,ki->ei", self.weight * (j - 1), self.q)
        excess -= np.einsum("eij,ej->ei", self.mass, self.pressure)
        update = self.inverse_mass @ np.concatenate([excess[:, :, None], coupling], axis=2)
        back = coupling.transpose(0, 2, 1)
        residual += (back @ update[:, :, :1])[..., 0]
        return residual, stiffness + back @ update[:, :, 1:], update

    def _energy(self, s: Floats) -> tuple[Floats, Floats]:
        """First and second derivative of f(s)."""
        first, second = 1 + 2 * self.c2 * s, 2 * self.c2 + 0 * s
        if np.any(self.limit > 0):
            room = 1 - s / self.limit
            if not np.all(room > 0):
                raise NotConverged
            return 1 / room, 1 / (self.limit * room * room)
        return first, second

    def _contact(self, held: NDArray[np.bool_] | None = None) -> tuple[Floats, Floats, float]:
        """Residual (edges, 6) and stiffness (edges, 6, 6) of the penalty, and the force on the sphere.

        `held` are the points that touch (edges, points), even where they must pull; otherwise those inside the sphere.
        """
        r, below = self._positions()
        distance = np.hypot(r, below)
        gap = distance - self.radius
        touching = gap < 0 if held is None else held
        normal = np.stack([r, -below], axis=2) / distance[..., None]
        active = self.penalty * self.area * touching
        load = active * gap
        shapes = np.zeros((3, 2, 6))
        shapes[:, 0, 0::2] = shapes[:, 1, 1::2] = self.n
        along = np.einsum("eki,kij->ekj", normal, shapes)
        residual = np.einsum("ek,ekj->ej", load, along)
        curved = np.clip(load, -_HIGHEST * self.hardest * self.area, 0.0) / distance
        stiffness = np.einsum("ek,eki,ekj->eij", active - curved, along, along)
        stiffness += np.einsum("ek,kli,klj->eij", curved, shapes, shapes)
        return residual, stiffness, float(np.sum(load * normal[..., 1]))

    def _system(self, held: NDArray[np.bool_] | None = None) -> tuple[Floats, csc_matrix, Floats]:
        residual, stiffness, update = self._elements()
        pushed, stiffer, _ = self._contact(held)
        ends = np.stack([2 * self.edges, 2 * self.edges + 1], axis=2).reshape(-1, 6)
        total = np.zeros(2 * len(self.r))
        np.add.at(total, self.spots, residual)
        self.reaction = total[2 * self.base + 1].copy()
        np.add.at(total, ends, pushed)
        rows = np.concatenate([np.repeat(part, part.shape[1], axis=1).ravel() for part in (self.spots, ends)])
        columns = np.concatenate([np.tile(part, (1, part.shape[1])).ravel() for part in (self.spots, ends)])
        values = np.concatenate([stiffness.ravel(), stiffer.ravel()])
        matrix = coo_matrix((values, (rows, columns)), shape=(len(total),) * 2).tocsc()
        return total, matrix[self.kept][:, self.kept], update

    def press(self, depth: float, halvings: int = 4) -> float:
        """Go to an indentation; returns the force of the sphere [E h²]. Halves the step where Newton fails."""
        state = self.u.copy(), self.pressure.copy(), self.depth
        try:
            return self._newton(depth)
        except NotConverged:
            if not halvings:
                raise
            self.u, self.pressure, self.depth = state
            self.press((state[2] + depth) / 2, halvings - 1)
            return self.press(depth, halvings - 1)

    def _newton(self, depth: float) -> float:
        touching = self._gap() < 0
        self.depth = depth
        # The first step takes along what touches, or the sphere would press it all by the step, or leave it.
        system = self._system(touching if touching.any() else None)
        for _ in range(_ITERATIONS):
            total, matrix, (excess, coupling) = system[0], system[1], np.split(system[2], [1], axis=2)
            lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            step = np.zeros(2 * len(self.r))
            step[self.kept] = lu.solve(-total[self.kept])
            if not np.all(np.isfinite(step)):
                raise NotConverged
            pressure = excess[..., 0] + np.einsum("eij,ej->ei", coupling, step[self.spots])
            largest = np.abs(step).max()
            system = self._moved(step.reshape(-1, 2), pressure, min(1.0, 0.3 / largest))
            if largest < _SMALL * self.top:
                return self._contact()[2]
        raise NotConverged

    def _moved(self, step: Floats, pressure: Floats, share: float) -> tuple[Floats, csc_matrix, Floats]:
        """The system after a share of a step, halved until no element is turned inside out."""
        u, p = self.u, self.pressure
        for _ in range(_HALVINGS):
            self.u, self.pressure = u + share * step, p + share * pressure
            try:
                return self._system()
            except NotConverged:
                share /= 2
        raise NotConverged

    def contact_radius(self) -> float:
        """Radius of the outermost point in contact."""
        touching = self._gap() < 0
        return float(self._positions()[0][touching].max()) if touching.any() else 0.0

    def _positions(self) -> tuple[Floats, Floats]:
        """Radius of the points of the upper face, and how far they lie below the sphere's centre."""
        u = self.u[self.edges]
        below = self.top + self.radius - self.depth - (self.z[self.edges] + u[..., 1]) @ self.n.T
        return (self.r[self.edges] + u[..., 0]) @ self.n.T, below

    def _gap(self) -> Floats:
        return np.asarray(np.hypot(*self._positions()) - self.radius)

    def base_pressure(self, at: Floats) -> Floats:
        """Compressive stress on the base at radii, from the nodal reactions by the consistent mass matrix of the
        base."""
        nodes = len(self.base)
        r = self.r[self.base]
        mass = np.zeros((nodes, nodes))
        for i in range(0, nodes - 1, 2):
            part = slice(i, i + 3)
            for x, w in zip(_GAUSS, _WEIGHT, strict=True):
                n = _shape(x)[0]
                mass[part, part] += w * (r[i + 2] - r[i]) / 2 * 2 * np.pi * (n @ r[part]) * np.outer(n, n)
        values = np.linalg.solve(mass, self.reaction)
        cell = np.clip(np.searchsorted(r[::2], at, side="right") - 1, 0, (nodes - 3) // 2)
        x = 2 * (at - r[2 * cell]) / (r[2 * cell + 2] - r[2 * cell]) - 1
        n = np.stack([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2])
        pressure = np.sum(n * values[2 * cell + np.arange(3)[:, None]], axis=0)
        return np.where(at <= r[-1], pressure, 0.0)
