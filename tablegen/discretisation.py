"""Displacements of order k with discontinuous pressures of order k − 1 (Q_k/P_(k−1)), axisymmetric.

The pair is inf-sup stable, and since no pressure is shared between elements, pressures are eliminated element by
element. scikit-fem gives mesh, shape functions and numbering; the element matrices are batched products of
  gradient (elements, points, 5, 2 n)   so that δF = gradient · (element's displacements)
  pressure (points, m)                  Legendre products of total degree k − 1
because assembling form by form costs (2n)² passes through the interpreter for high orders, the products none.
Displacement numbers: 2 i + c for scalar number i and component c (0 radial, 1 axial).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import Basis, ElementQuadP, MeshQuad

from underskin.units import Floats

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Discretisation:
    """Mesh, elements and shape functions as arrays; build it with `discretise`."""

    basis: Basis
    order: int
    gradient: Floats  # (elements, points, 5, 2 n)
    pressure: Floats  # (points, m)
    weight: Floats  # (elements, points): dA · r, the 2π left out
    numbers: Indices  # (elements, 2 n)

    @property
    def size(self) -> int:
        """Number of displacements, supported ones included."""
        return 2 * int(self.basis.N)

    @cached_property
    def free(self) -> Indices:
        """Displacements that are not held: the base is bonded, the axis stays on the axis, the rim is free."""
        base = self.scalars_on(lambda x: x[1] == 0.0)
        axis = self.scalars_on(lambda x: x[0] == 0.0)
        held = np.concatenate([2 * base, 2 * base + 1, 2 * axis])
        return np.setdiff1d(np.arange(self.size), held)

    def scalars_on(self, place: object) -> Indices:
        """Scalar numbers on the facets whose midpoints satisfy `place`."""
        facets = self.basis.mesh.facets_satisfying(place)
        return np.asarray(self.basis.get_dofs(facets).all(), dtype=np.int64)

    @cached_property
    def _pattern(self) -> tuple[Indices, csc_matrix]:
        """Where each entry of the element matrices falls in the sparse matrix of the free displacements."""
        position = np.full(self.size, -1)
        position[self.free] = np.arange(self.free.size)
        local = position[self.numbers]
        rows = np.broadcast_to(local[:, :, None], (*local.shape, local.shape[1]))
        columns = np.broadcast_to(local[:, None, :], rows.shape)
        inner = ((rows >= 0) & (columns >= 0)).ravel()
        key = columns.ravel()[inner] * self.free.size + rows.ravel()[inner]
        entries, inverse = np.unique(key, return_inverse=True)
        target = np.full(inner.size, entries.size)
        target[inner] = inverse
        pointers = np.searchsorted(entries, np.arange(self.free.size + 1) * self.free.size)
        shape = (self.free.size, self.free.size)
        return target, csc_matrix((np.zeros(entries.size), entries % self.free.size, pointers), shape=shape)

    def assemble_matrix(self, element_matrices: Floats) -> csc_matrix:
        """The sparse matrix of the free displacements from (elements, 2 n, 2 n)."""
        target, pattern = self._pattern
        data = np.bincount(target, element_matrices.ravel(), pattern.nnz + 1)[:-1]
        return csc_matrix((data, pattern.indices, pattern.indptr), shape=pattern.shape)

    def assemble_vector(self, element_vectors: Floats) -> Floats:
        """The vector of all displacements from (elements, 2 n)."""
        return np.asarray(np.bincount(self.numbers.ravel(), element_vectors.ravel(), self.size), dtype=float)


def discretise(mesh: MeshQuad, order: int) -> Discretisation:
    """The discretisation of a tensor mesh (all elements oriented alike, as the odd edge modes need)."""
    basis = Basis(mesh, ElementQuadP(order), intorder=2 * order + 1)
    r = np.asarray(basis.global_coordinates())[0]
    n = basis.Nbfun
    gradient = np.zeros((mesh.nelements, r.shape[1], 5, 2 * n))
    for i in range(n):
        shape = basis.basis[i][0]
        gradient[:, :, 0:2, 2 * i] = np.moveaxis(np.broadcast_to(shape.grad, (2, *r.shape)), 0, -1)
        gradient[:, :, 2:4, 2 * i + 1] = gradient[:, :, 0:2, 2 * i]
        gradient[:, :, 4, 2 * i] = np.asarray(shape) / r
    scalars = basis.element_dofs.T
    numbers = np.stack([2 * scalars, 2 * scalars + 1], axis=-1).reshape(len(scalars), -1)
    return Discretisation(basis, order, gradient, _pressure_modes(basis, order), basis.dx * r, numbers)


def _pressure_modes(basis: Basis, order: int) -> Floats:
    """P_i(ξ) P_j(η), i + j < order, at the integration points of the reference square: (points, m)."""
    legendre = np.polynomial.legendre.legvander(2 * basis.X - 1, order - 1)
    pairs = [(i, j) for i in range(order) for j in range(order - i)]
    return np.stack([legendre[0, :, i] * legendre[1, :, j] for i, j in pairs], axis=-1)
