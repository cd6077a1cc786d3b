"""A rigid frictionless sphere pressed into the incompressible layer: equilibrium at a given contact edge.

The material point of the surface that is the contact's edge is prescribed, as a line of the mesh, and the sphere's
indentation δ is an unknown; its equation is that the pressure vanishes at the edge, as it must where nothing adheres.
So the contact's edge is exact, and nothing is searched. In the contact the surface lies on the sphere,
    g(x) = |x − c| − R = 0,   c = (0, 1 + R − δ),
weakly, against multipliers λ (the pressure per undeformed area): ∫ ψ g dA = 0. λ is discontinuous, of two degrees less
than the displacements, and is eliminated edge by edge by the augmented Lagrangian, like the pressures.
With n = ∇g, the force on the surface is λ n; ∇²g = (1 − n ⊗ n)/|x − c| gives its part of the tangent.

At equilibrium the increment for dδ at a fixed edge is that of a moving one too: the pressure at the edge is 0, so that
what the contact gains or loses there as the edge moves is of second order. Hence dF/dδ, and the increment of the stress
on the base over that of the force, from one more solve. Lengths in thicknesses, stresses in G.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import SuperLU

from tablegen.discretisation import Discretisation, Indices
from tablegen.faces import shapes_along
from tablegen.neo_hookean import NEO_HOOKEAN, Material
from tablegen.newton import NonlinearLayer, State, factorise
from underskin.errors import SolverError
from underskin.units import Floats

_NEAR = 0.12  # of the contact radius, where the pressure at the edge is read
_FITTED = 4
_PENALTY = 1e3  # of the stiffness of an element's surface, G over its width
_SOLVES_PER_FACTORISATION = 4
_TOLERANCE = 1e-7  # of the force, and of the gap; rounding's floor is 1e-8 under a force of 1e-9 G h²
_MOST_ITERATIONS = 15


@dataclass(frozen=True)
class PressedState:
    """The layer under the sphere: its deformation, the multipliers (edges, modes) and the indentation.

    `spread`, of a sphere that sticks, says where the edge was touched (`tablegen.sticking`).
    """

    state: State
    multiplier: Floats
    indentation: float
    spread: float = 0.0


Increment = tuple[Floats, Floats, Floats]  # of displacements, pressures, multipliers


@dataclass(frozen=True)
class Tangent:
    """Of one state: factors of the augmented matrix; ∂(volume)/∂u, the same augmented, and ∂(gap)/∂u by element."""

    factors: SuperLU
    constraint: Floats
    scaled: Floats
    touch: Floats


class ContactLayer(NonlinearLayer):
    """A discretised layer with a contact on |r| < a of its surface; the mesh must have a line at r = a."""

    def __init__(self, discretisation: Discretisation, a: float, material: Material = NEO_HOOKEAN) -> None:
        super().__init__(discretisation, material)
        d = discretisation
        columns = np.unique(d.basis.mesh.p[0])
        edges = columns[columns <= a * (1 + 1e-12)]
        x, w = np.polynomial.legendre.leggauss(d.order + 3)
        half = np.diff(edges)[:, None] / 2
        self.r = edges[:-1, None] + half * (1 + x)  # (edges, points)
        self.weight = half * w * self.r
        values, numbers = shapes_along(d, self.r.ravel(), 1)
        self._values = values.reshape(*self.r.shape, -1)
        self.numbers = numbers.reshape(*self._values.shape)[:, 0]  # scalar numbers, (edges, n)
        self._elements = self._top_elements(edges[:-1])
        self._modes = np.polynomial.legendre.legvander(x, d.order - 2)  # (points, modes)
        mass = np.einsum("ql,eq,qm->elm", self._modes, self.weight, self._modes)
        self._scale = _PENALTY / np.diff(edges)[:, None, None] * np.linalg.inv(mass)
        self.a = a
        self._edge_pressure = self._singularity_at_edge(edges)

    def untouched(self) -> PressedState:
        """The sphere just not yet in touch."""
        return PressedState(self.rest(), np.zeros((len(self.r), self._modes.shape[1])), 0.0)

    def press(self, start: PressedState, radius: float) -> PressedState:
        """Equilibrium under the sphere of `radius`, by Newton's method; SolverError when it does not converge."""
        now = start
        for _ in range(_MOST_ITERATIONS):
            force = self._contact_force(now, radius)
            residual, gap = force - self.internal_force(now.state), self._gap(now, radius)
            size = float(np.linalg.norm(residual[self.discretisation.free]))
            scale = float(np.linalg.norm(force))
            if not np.isfinite(size) or size > 1e6 * max(scale, self.a**2):
                break
            balanced = scale > 0 and size <= _TOLERANCE * scale
            touching = np.abs(gap).max() <= _TOLERANCE * self.a**2 / radius * self.weight.sum(axis=1).max()
            if balanced and touching and self.volume_change(now.state) <= 10 * _TOLERANCE * self.a / radius:
                return now
            now = self._step(now, radius, residual, gap)
        raise SolverError("Newton's method did not converge")

    def force(self, now: PressedState, radius: float) -> float:
        """The force on the sphere over 2π."""
        normal, _ = self._normal(now, radius)
        return -float((self.weight * self.pressure(now) * normal[..., 1]).sum())

    def pressure(self, now: PressedState) -> Floats:
        """λ at the points `r` of the contact, (edges, points)."""
        return now.multiplier[:, : self._modes.shape[1]] @ self._modes.T

    def surface(self, now: PressedState, r: Floats) -> Floats:
        """Places (points, 2) of the surface points that were at the radii r."""
        values, numbers = shapes_along(self.discretisation, r, 1)
        u = [(values * now.state.displacement[2 * numbers + c]).sum(axis=1) for c in (0, 1)]
        return np.stack([r + u[0], 1 + u[1]], axis=-1)

    def increment(self, now: PressedState, radius: float) -> Floats:
        """Internal forces (all displacements) gained over the gain in δ, the edge at rest."""
        tangent = self._tangent(now, radius)
        du, dp, _ = self._per_depth(now, radius, tangent)
        stiffness, d = self.element_matrices(now.state)[0], self.discretisation
        local = stiffness @ du[d.numbers][..., None] - np.swapaxes(tangent.constraint, 1, 2) @ dp[..., None]
        return d.assemble_vector(local[..., 0])

    def _step(self, now: PressedState, radius: float, residual: Floats, gap: Floats) -> PressedState:
        """One Newton increment: that at fixed unknowns, and as much of those per unit of them as frees the edge."""
        tangent = self._tangent(now, radius)
        fixed = self._solve(tangent, residual, self._volume_defect(now.state), gap)
        further = self._per_unknown(now, radius, tangent)
        rest = self._at_edge(now.multiplier + fixed[2])
        change = np.linalg.solve(np.stack([self._at_edge(dm) for *_, dm in further], axis=-1), -rest)
        du, dp, dm = (
            one + sum(share * other for share, other in zip(change, others, strict=True))
            for one, *others in zip(fixed, *further, strict=True)
        )
        state = State(now.state.displacement + du, now.state.pressure + dp)
        unknowns = np.array([now.indentation, now.spread])
        unknowns[: change.size] += change
        return PressedState(state, now.multiplier + dm, *unknowns.tolist())

    def _per_unknown(self, now: PressedState, radius: float, tangent: Tangent) -> list[Increment]:
        """What a unit of each unknown beside the displacements adds."""
        return [self._per_depth(now, radius, tangent)]

    def _at_edge(self, multiplier: Floats) -> Floats:
        """The singular tractions at the edge, which must be 0."""
        return np.array([np.sum(self._edge_pressure * multiplier)])

    def _contact_force(self, now: PressedState, radius: float) -> Floats:
        """Nodal forces (all displacements) of the sphere."""
        return self._traction(self.pressure(now), self._normal(now, radius)[0])

    def _tangent(self, now: PressedState, radius: float) -> Tangent:
        stiffness, constraint = self.element_matrices(now.state)
        scaled = self._scaled(constraint)
        matrices = stiffness + np.swapaxes(constraint, 1, 2) @ scaled
        touch, _ = self._touch_gradient(now, radius)
        matrices[self._elements] += self._curvature(now, radius) + np.swapaxes(touch, 1, 2) @ self._scale @ touch
        return Tangent(factorise(self.discretisation.assemble_matrix(matrices)), constraint, scaled, touch)

    def _per_depth(self, now: PressedState, radius: float, tangent: Tangent) -> Increment:
        """What a unit of δ adds: it closes the gap, and it turns the normal, on which the pressure acts."""
        normal, distance = self._normal(now, radius)
        turned = (np.array([0.0, 1.0]) - normal * normal[..., 1:]) / distance[..., None]
        _, gap = self._touch_gradient(now, radius)
        return self._solve(tangent, self._traction(self.pressure(now), turned), np.zeros_like(now.state.pressure), gap)

    def _solve(self, tangent: Tangent, residual: Floats, volume: Floats, gap: Floats) -> Increment:
        """The increment that takes residual, volume defect and gap to 0."""
        d = self.discretisation
        du, dp, dm = np.zeros(d.size), np.zeros_like(volume), np.zeros_like(gap)
        for _ in range(_SOLVES_PER_FACTORISATION):
            push = np.einsum("eln,el->en", tangent.scaled, volume)
            push[self._elements] += np.einsum("eln,elm,em->en", tangent.touch, self._scale, gap)
            step = np.zeros(d.size)
            step[d.free] = tangent.factors.solve((residual - d.assemble_vector(push))[d.free])
            du += step
            volume = volume + np.einsum("eln,en->el", tangent.constraint, step[d.numbers])
            gap = gap + np.einsum("eln,en->el", tangent.touch, step[d.numbers[self._elements]])
            dp -= self._augmentation * np.einsum("elm,em->el", self._inverse_mass, volume)
            volume = volume * (1 - self._augmentation * self._compliance)
            dm -= np.einsum("elm,em->el", self._scale, gap)
            residual = np.zeros(d.size)  # balanced by the first solve
        return du, dp, dm

    def _traction(self, size: Floats, direction: Floats) -> Floats:
        """Nodal forces (all displacements) of a traction of this size along a direction (edges, points, 2)."""
        traction = (self.weight * size)[..., None] * direction
        every = np.zeros_like(self.discretisation.numbers, dtype=float)
        for component in (0, 1):
            every[self._elements, component::2] = np.einsum("eq,eqn->en", traction[..., component], self._values)
        return self.discretisation.assemble_vector(every)

    def _normal(self, now: PressedState, radius: float) -> tuple[Floats, Floats]:
        """n (edges, points, 2) and |x − c| (edges, points)."""
        r, height = self._places(now)
        distance = np.hypot(r, height - radius)
        return np.stack([r, height - radius], axis=-1) / distance[..., None], distance

    def _places(self, now: PressedState) -> tuple[Floats, Floats]:
        """Radius of the contact's points and their height over the sphere's lowest point, (edges, points)."""
        u = now.state.displacement
        radial, axial = (np.einsum("eqn,en->eq", self._values, u[2 * self.numbers + c]) for c in (0, 1))
        return self.r + radial, now.indentation + axial

    def _gap(self, now: PressedState, radius: float) -> Floats:
        """∫ ψ g dA over each edge, (edges, modes)."""
        r, height = self._places(now)
        _, distance = self._normal(now, radius)
        gap = (r**2 + height**2 - 2 * radius * height) / (distance + radius)  # |x − c| − R, without cancellation
        return (self.weight * gap) @ self._modes

    def _touch_gradient(self, now: PressedState, radius: float) -> tuple[Floats, Floats]:
        """Derivatives of `_gap`: to the elements' displacements (edges, modes, 2 n) and to δ (edges, modes)."""
        normal, _ = self._normal(now, radius)
        gradient = np.zeros((len(self.r), self._modes.shape[1], self.discretisation.numbers.shape[1]))
        for component in (0, 1):
            weighted = self.weight * normal[..., component]
            gradient[:, :, component::2] = np.einsum("eq,qm,eqn->emn", weighted, self._modes, self._values)
        return gradient, (self.weight * normal[..., 1]) @ self._modes

    def _curvature(self, now: PressedState, radius: float) -> Floats:
        """−∫ λ ∇²g on the elements' displacements, (edges, 2 n, 2 n)."""
        normal, distance = self._normal(now, radius)
        strength = -self.weight * self.pressure(now) / distance
        size = self.discretisation.numbers.shape[1]
        matrix = np.zeros((len(self.r), size, size))
        for i in (0, 1):
            for j in (0, 1):
                weighted = strength * ((i == j) - normal[..., i] * normal[..., j])
                matrix[:, i::2, j::2] = np.einsum("eq,eqm,eqn->emn", weighted, self._values, self._values)
        return matrix

    def _singularity_at_edge(self, edges: Floats) -> Floats:
        """The weights (edges, modes) that read c₀ of λ = c₀ s^(−1/2) + c₁ s^(1/2) + …, s the distance from the edge.

        A least-squares fit over the edges next to the last one, which itself is too close for its polynomials.
        """
        near = np.flatnonzero(self.a - edges[:-1] <= _NEAR * self.a)[:-1]
        distance = (self.a - self.r[near]).ravel() / self.a
        powers = distance[:, None] ** np.arange(_FITTED)
        fit = np.linalg.lstsq(powers, np.diag(np.sqrt(distance)), rcond=None)[0][0]
        weights = np.zeros((len(self.r), self._modes.shape[1]))
        weights[near] = fit.reshape(near.size, -1) @ self._modes
        return weights

    def _top_elements(self, starts: Floats) -> Indices:
        """The elements under the edges that start at these radii."""
        mesh = self.discretisation.basis.mesh
        corner, far = mesh.p[:, mesh.t].min(axis=1), mesh.p[:, mesh.t].max(axis=1)
        top = np.flatnonzero(far[1] == 1.0)
        top = top[np.argsort(corner[0, top])][: starts.size]
        assert np.array_equal(corner[0, top], starts)
        return np.asarray(top, dtype=np.int64)
