"""Equilibrium of the incompressible layer under a dead surface load: Newton's method, pressures eliminated.

Unknowns u and, in each element, p: ∫ P : ∇v = f(v) and ∫ ψ (J − 1) = 0. The zero block of this saddle problem makes a
direct solver pivot and fill; an augmented Lagrangian avoids it. The increment of the pressure is written
dp = −κ M⁻¹ (c + C du), element by element, which leaves a symmetric matrix K + κ Cᵀ M⁻¹ C in the displacements alone.
Each further solve with the same factors makes the constraint better by about κ; the result does not depend on κ.
A compressible layer has ∫ ψ (J − 1 + p/λ) = 0, and κ = λ eliminates its pressures exactly.
Source: Fortin & Glowinski, Augmented Lagrangian Methods (1983).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from tablegen.discretisation import Discretisation
from tablegen.neo_hookean import IDENTITY, NEO_HOOKEAN, Material, cofactor, stress, tangent, volume_ratio
from underskin.errors import SolverError
from underskin.units import Floats

_AUGMENTATION = 1e4  # κ, in units of the shear modulus
_SOLVES_PER_FACTORISATION = 3
_TOLERANCE = 1e-8  # of the load, and of J − 1: rounding's floor is 2e-9 for a/h = 0.02
_MOST_ITERATIONS = 12


@dataclass(frozen=True)
class State:
    """Displacements (all, (displacements,)) and pressure modes (elements, m)."""

    displacement: Floats
    pressure: Floats


class NonlinearLayer:
    """A discretised layer of a material, and its deformation under nodal loads."""

    def __init__(self, discretisation: Discretisation, material: Material = NEO_HOOKEAN) -> None:
        self.discretisation, self.c2, self._compliance = discretisation, material.second_over_first, material.compliance
        # A compressible layer's pressures are eliminated exactly
        self._augmentation = 1 / material.compliance if material.compliance else _AUGMENTATION
        d = discretisation
        elements, points = d.weight.shape
        self._flat_gradient = d.gradient.reshape(elements, points * 5, -1)
        mass = np.einsum("ql,eq,qm->elm", d.pressure, d.weight, d.pressure)
        self._inverse_mass = np.linalg.inv(mass)

    def rest(self) -> State:
        """No displacement, no pressure, no stress."""
        pressure = np.zeros((self._inverse_mass.shape[0], self.discretisation.pressure.shape[1]))
        return State(np.zeros(self.discretisation.size), pressure)

    def internal_force(self, state: State) -> Floats:
        """∫ P : ∇v for every displacement; on the held ones this is the reaction."""
        f, p = self._fields(state)
        weighted = stress(f, p, self.c2) * self.discretisation.weight[..., None]
        return self.discretisation.assemble_vector(self._times_gradient(weighted))

    def element_matrices(self, state: State) -> tuple[Floats, Floats]:
        """K (elements, 2 n, 2 n) and C (elements, m, 2 n) of one Newton step, before anything is eliminated."""
        f, p = self._fields(state)
        return self._stiffness(f, p), self._constraint_gradient(f)

    def condensed_matrix(self, state: State) -> csc_matrix:
        """K + κ Cᵀ M⁻¹ C of the free displacements."""
        stiffness, c = self.element_matrices(state)
        return self.discretisation.assemble_matrix(stiffness + np.swapaxes(c, 1, 2) @ self._scaled(c))

    def volume_change(self, state: State) -> float:
        """The largest coefficient of J − 1 + p/λ, projected on the pressures of each element."""
        constraint = self._volume_defect(state)
        return float(np.abs(np.einsum("elm,em->el", self._inverse_mass, constraint)).max())

    def linear_force(self, load: Floats) -> Floats:
        """The internal force of the linear solution under `load`: one Newton increment from rest."""
        rest = self.rest()
        du, dp = self._increment(rest, load)
        f, p = self._fields(rest)
        gradient = self._fields(State(du, dp))[0] - IDENTITY
        change = (tangent(f, p, self.c2) @ gradient[..., None])[..., 0] - (dp @ self.discretisation.pressure.T)[
            ..., None
        ] * IDENTITY
        return self.discretisation.assemble_vector(self._times_gradient(change * self.discretisation.weight[..., None]))

    def equilibrium(self, start: State, load: Floats) -> State:
        """The deformation in equilibrium with `load` (dead), by Newton's method from `start`.

        Raises SolverError when the iteration does not converge.
        """
        state = start
        free = self.discretisation.free
        scale = float(np.linalg.norm(load[free]))
        for _ in range(_MOST_ITERATIONS):
            residual = (load - self.internal_force(state))[free]
            size = float(np.linalg.norm(residual))
            if not np.isfinite(size) or size > 1e6 * scale:
                break
            if size <= _TOLERANCE * scale and self.volume_change(state) <= _TOLERANCE:
                return state
            du, dp = self._increment(state, load)
            state = State(state.displacement + du, state.pressure + dp)
        raise SolverError("Newton's method did not converge")

    def _increment(self, state: State, load: Floats) -> tuple[Floats, Floats]:
        """One Newton increment (du, dp)."""
        d = self.discretisation
        stiffness, c = self.element_matrices(state)
        scaled = self._scaled(c)
        factors = factorise(d.assemble_matrix(stiffness + np.swapaxes(c, 1, 2) @ scaled))
        residual = load - self.internal_force(state)
        du = np.zeros(d.size)
        dp = np.zeros_like(state.pressure)
        defect = self._volume_defect(state)
        for _ in range(_SOLVES_PER_FACTORISATION):
            push = d.assemble_vector(np.einsum("eln,el->en", scaled, defect))
            step = np.zeros(d.size)
            step[d.free] = factors.solve((residual - push)[d.free])
            du += step
            change = np.einsum("eln,en->el", c, step[d.numbers])
            dp -= self._augmentation * np.einsum("elm,em->el", self._inverse_mass, defect + change)
            defect = (defect + change) * (1 - self._augmentation * self._compliance)
            residual = np.zeros(d.size)  # the momentum balance holds after the first solve
        return du, dp

    def _scaled(self, c: Floats) -> Floats:
        """κ M⁻¹ C."""
        return self._augmentation * self._inverse_mass @ c

    def _fields(self, state: State) -> tuple[Floats, Floats]:
        """F (elements, points, 5) and p (elements, points)."""
        d = self.discretisation
        local = state.displacement[d.numbers]
        gradient = (self._flat_gradient @ local[..., None]).reshape(*d.weight.shape, 5)
        return IDENTITY + gradient, state.pressure @ d.pressure.T

    def _stiffness(self, f: Floats, p: Floats) -> Floats:
        d = self.discretisation
        weighted = tangent(f, p, self.c2) * d.weight[..., None, None]
        product = (weighted @ d.gradient).reshape(self._flat_gradient.shape)
        return np.swapaxes(self._flat_gradient, 1, 2) @ product

    def _volume_defect(self, state: State) -> Floats:
        """∫ ψ (J − 1 + p/λ), (elements, m)."""
        d, (f, p) = self.discretisation, self._fields(state)
        return (d.weight * (volume_ratio(f) - 1 + self._compliance * p)) @ d.pressure

    def _constraint_gradient(self, f: Floats) -> Floats:
        d = self.discretisation
        weighted = cofactor(f)[:, :, None, :] * d.weight[..., None, None] * d.pressure[None, :, :, None]
        modes = np.swapaxes(weighted, 1, 2).reshape(len(f), d.pressure.shape[1], -1)
        return modes @ self._flat_gradient

    def _times_gradient(self, weighted: Floats) -> Floats:
        flat = weighted.reshape(len(weighted), 1, -1)
        return (flat @ self._flat_gradient)[:, 0, :]


def factorise(matrix: csc_matrix) -> SuperLU:
    """LU factors of a symmetric matrix; symmetric mode and minimum degree keep the fill low."""
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.001, options={"SymmetricMode": True})
