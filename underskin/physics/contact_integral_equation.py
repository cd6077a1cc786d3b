"""The frictionless contact of a rigid axisymmetric indenter with the layer: the integral equation, by Legendre modes.

Lengths in units of the thickness, α = a/h (Lebedev and Ufliand 1958):

    (π/2) φ(x) − ∫₀^α φ(t) N(x, t) dt = f(x),   N(x, t) = ∫₀^∞ (1 − K(k)) cos kx cos kt dk,
    p̂(k) = ∫₀^α φ(t) cos kt dt

φ is analytic and even, so a few modes eₙ(t/α) = (−1)ⁿ √(4n + 1) P₂ₙ(t/α) represent it; their cosine transforms are
α √(4n + 1) j₂ₙ(kα), and the Galerkin matrix is (π/2) I − α ∫ (1 − K) j jᵀ dk, symmetric. f = 1 is the flat punch φ₀
and f = (t/α)² gives φ₂; a sphere without adhesion is φ_s = φ₂(α)/φ₀(α) φ₀ − φ₂, which is 0 at the edge.

What depends on the layer carries its derivatives by the Poisson ratio and by the slip of the glue line.
"""

from dataclasses import dataclass

import numpy as np

from underskin.autodiff import Differentiated, constant
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats

_END = 18.0  # where 1 − K has fallen below 1e-13
_FIRST_PANELS = (0.0, 0.02, 0.15, 0.7)  # on a nearly frictionless base, K changes rapidly near k = 0


@dataclass(frozen=True)
class EdgeSolutions:
    """Contacts of radii α (m,): ratios (m,) to the half space at the same radius, and shapes (m, n).

    Attributes
    ----------
    sphere_force : Differentiated, (m,)
        F R/(E' h³) over 4α³/3.
    sphere_depth : Differentiated, (m,)
        δ R/h² over α².
    stiffness : Differentiated, (m,)
        dF/dδ at a fixed edge over 2E'a.
    edge_force, edge_depth : Differentiated, (m,)
        Force and depth of a flat punch per value φ(a) at its edge.
    sphere_shape, punch_shape : Differentiated, (m, n)
        Legendre coefficients of φ over ∫φ dt.
    """

    sphere_force: Differentiated
    sphere_depth: Differentiated
    stiffness: Differentiated
    edge_force: Differentiated
    edge_depth: Differentiated
    sphere_shape: Differentiated
    punch_shape: Differentiated


class ContactEquation:
    """The integral equation at given contact radii; computes the layer-independent part once.

    Parameters
    ----------
    alpha : ndarray, (m,)
        a/h, all above 0.
    """

    def __init__(self, alpha: Floats) -> None:
        largest = float(np.max(alpha))
        self.alpha = alpha
        self.modes = 8 + int(np.ceil(2.5 * largest))
        self._k, self._weight = _nodes(largest)
        self._transforms = mode_transforms(np.multiply.outer(alpha, self._k), self.modes)
        order = np.arange(self.modes)
        self._edge = np.sqrt(4 * order + 1) * (-1.0) ** order  # eₙ(1)

    def solve(self, layer: Layer) -> EdgeSolutions:
        """Solve all contacts on one layer."""
        punch, square = self._flat_and_square(layer)
        punch_edge, square_edge = self._at_the_edge(punch), self._at_the_edge(square)
        depth = square_edge / punch_edge
        sphere = _last_axis(depth, None) * punch - square
        return EdgeSolutions(
            sphere_force=3 * np.pi / 4 * _last_axis(sphere, 0),
            sphere_depth=depth,
            stiffness=np.pi / 2 * _last_axis(punch, 0),
            edge_force=_last_axis(punch, 0) / punch_edge,
            edge_depth=constant(2 / np.pi, 2) / punch_edge,
            sphere_shape=sphere / _last_axis(sphere, slice(1)),
            punch_shape=punch / _last_axis(punch, slice(1)),
        )

    def _at_the_edge(self, modes: Differentiated) -> Differentiated:
        """φ(α), (m,), from the coefficients (m, n)."""
        return Differentiated(modes.value @ self._edge, modes.slopes @ self._edge)

    def _flat_and_square(self, layer: Layer) -> tuple[Differentiated, Differentiated]:
        """φ₀ and φ₂, (m, n)."""
        stiffening = layer.stiffening(self._k)
        matrix, *slopes = (self._galerkin(kernel) for kernel in (stiffening.value, *stiffening.slopes))
        right = np.zeros((self.modes, 2))
        right[0] = 1, 1 / 3
        right[1, 1] = -2 / (3 * np.sqrt(5))
        inverse = np.linalg.inv(np.pi / 2 * np.eye(self.modes) - matrix)
        solution = inverse @ right
        changes = np.stack([inverse @ (slope @ solution) for slope in slopes])
        both = Differentiated(solution, changes)
        return _last_axis(both, 0), _last_axis(both, 1)

    def _galerkin(self, kernel: Floats) -> Floats:
        """α ∫ kernel j jᵀ dk, (m, n, n)."""
        weighted = self._transforms * (self._weight * kernel)[:, None]
        return self.alpha[:, None, None] * (weighted.transpose(0, 2, 1) @ self._transforms)


def mode_transforms(s: Floats, modes: int) -> Floats:
    """Cosine transforms of the modes over α, √(4n + 1) j₂ₙ(s).

    Parameters
    ----------
    s : ndarray
        k α [-], of any shape.
    modes : int
        Number of modes n.

    Returns
    -------
    ndarray, (*s.shape, modes)
    """
    from underskin.physics.contact_kernel import even_orders

    values = np.empty((s.size, modes))
    even_orders(np.ascontiguousarray(s, dtype=float).ravel(), values)
    return np.sqrt(4 * np.arange(modes) + 1) * values.reshape(*s.shape, modes)


def _nodes(largest: float) -> tuple[Floats, Floats]:
    """Gauss–Legendre nodes and weights on [0, 20], fine enough for products of modes up to the largest radius."""
    x, w = np.polynomial.legendre.leggauss(16)
    panels = max(6, int(np.ceil(_END * 2 * largest / 16.0)))
    edges = np.concatenate([_FIRST_PANELS[:-1], np.linspace(_FIRST_PANELS[-1], _END, panels + 1)])
    half = np.diff(edges)[:, None] / 2
    k = edges[:-1, None] + half * (1 + x)
    return k.ravel(), (half * w).ravel()


def _last_axis(x: Differentiated, index: int | slice | None) -> Differentiated:
    """x[..., index] with its derivatives."""
    return Differentiated(x.value[..., index], x.slopes[..., index])
