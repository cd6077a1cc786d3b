"""The sphere of `tablegen.contact` without slip: a point of the surface stays where on the sphere it was touched.

Beside g = 0 the contact then has r + u_r = ρ(r), weakly, against multipliers τ, the radial traction. The sphere comes
straight down, so that with its radius a point keeps its place on it. The material point r is touched when the contact's
edge is there, so that ρ(r) is the radius of the deformed edge as the contact of the same sphere has grown to r: the
history of loading is one function, known from the smaller contacts. It is
    ρ(r) = r + f(r) r²/R,  f(0) = 0,
f a spline through the earlier edges and, at the present one, an unknown (`spread`). Its equation is that the radial
traction vanishes at the edge, as the pressure does: the sum of the increments of ever wider contacts has no singularity
at the edge. Increments are those of a contact at rest: of a punch that sticks. Sources: Mossakovskii, J. Appl. Math.
Mech. 27 (1963) 418; Spence, Proc. R. Soc. A 305 (1968) 55, for the linear half space, where nothing slips at ν = ½.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from tablegen.contact import ContactLayer, Increment, PressedState, Tangent
from tablegen.discretisation import Discretisation
from tablegen.neo_hookean import NEO_HOOKEAN, Material
from underskin.units import Floats


@dataclass(frozen=True)
class Touched:
    """f at one edge of spheres with the strains a/R, ascending."""

    edge: float
    strain: Floats
    spread: Floats

    def at(self, radius: float) -> float:
        """f of the sphere of this radius."""
        spline = make_interp_spline(self.strain, self.spread, k=min(5, self.strain.size - 1))
        return float(spline(self.edge / radius))


class StickingLayer(ContactLayer):
    """A contact that sticks; `earlier` are the smaller edges, ascending."""

    def __init__(
        self,
        discretisation: Discretisation,
        a: float,
        material: Material = NEO_HOOKEAN,
        earlier: Sequence[Touched] = (),
    ) -> None:
        super().__init__(discretisation, a, material)
        self._earlier = earlier
        nodes = np.array([0.0, *(touched.edge for touched in earlier), a])
        cardinal = make_interp_spline(nodes, np.eye(nodes.size), k=min(5, nodes.size - 1))(self.r)
        self._spread = (self.weight * self.r**2)[..., None] * cardinal[..., 1:]  # (edges, points, edges touched)
        count = self._modes.shape[1]
        scale = np.zeros((len(self.r), 2 * count, 2 * count))
        scale[:, :count, :count] = scale[:, count:, count:] = self._scale
        self._scale = scale

    def untouched(self) -> PressedState:
        """The sphere just not yet in touch."""
        return PressedState(self.rest(), np.zeros((len(self.r), self._scale.shape[1])), 0.0)

    def _per_unknown(self, now: PressedState, radius: float, tangent: Tangent) -> list[Increment]:
        slip = self._spread[..., -1] @ self._modes / radius
        gap = np.concatenate([np.zeros_like(slip), -slip], axis=1)
        nothing = np.zeros(self.discretisation.size), np.zeros_like(now.state.pressure)
        return [*super()._per_unknown(now, radius, tangent), self._solve(tangent, *nothing, gap)]

    def _at_edge(self, multiplier: Floats) -> Floats:
        return np.array([np.sum(self._edge_pressure * part) for part in np.split(multiplier, 2, axis=1)])

    def _contact_force(self, now: PressedState, radius: float) -> Floats:
        shear = now.multiplier[:, self._modes.shape[1] :] @ self._modes.T
        return super()._contact_force(now, radius) + self._traction(shear, np.array([1.0, 0.0]))

    def _gap(self, now: PressedState, radius: float) -> Floats:
        spread = np.array([*(touched.at(radius) for touched in self._earlier), now.spread])
        moved = self.weight * (self._places(now)[0] - self.r) - self._spread @ spread / radius
        return np.concatenate([super()._gap(now, radius), moved @ self._modes], axis=1)

    def _touch_gradient(self, now: PressedState, radius: float) -> tuple[Floats, Floats]:
        gradient, by_depth = super()._touch_gradient(now, radius)
        slip = np.zeros_like(gradient)
        slip[:, :, 0::2] = np.einsum("eq,qm,eqn->emn", self.weight, self._modes, self._values)
        return np.concatenate([gradient, slip], axis=1), np.concatenate([by_depth, np.zeros_like(by_depth)], axis=1)
