"""A rigid sphere on the elastic half space or layer, with adhesion, stiffening and a stage that gives. SI.

All follows from the contact radius a. Without adhesion, on the half space: δ = a²/R, F = 4E'a³/(3R), and at a fixed
edge the stiffness is K = 2E'a; on the layer these are multiplied by functions of a/h (contact_curves). An edge whose
energy release rate is w is stretched by ℓ: δ and F fall by ℓ and K ℓ, on the half space ℓ = √(2πaw/E') (Johnson,
Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301). A stiffening elastomer has E' times its nominal stress
over a neo-Hookean solid's at the representative strain 0.2 a/R (after Lin, Dimitriadis & Horkay, J. Biomech. Eng. 129
(2007) 904, whose ratio to Hooke's law would count the neo-Hookean solid's own 9 % at a/R 0.4, where a sphere's contact
gets softer by 5 %). What the stage commands is δ + F/k.

Pressed deep, the sphere is no paraboloid: δ = a artanh(a/R), dF = 2E'a dδ (Sneddon, Int. J. Eng. Sci. 3 (1965) 47).
Finite strain makes the contact softer: at the same force, δ of the solved frictionless contact of the round sphere with
a neo-Hookean layer is up to 3.4 % above the linear one's (contact table), of which `strain_share` is taken; a is then
the radius of the linear contact.

Under a given travel the contact is stable where the travel grows with a. It ends at the least travel: at JKR's least
depth for a stiff stage, at the least force, −3πwR/2 on the half space, for a soft one. The functions of a are compiled
(sphere_kernel).

Arrays are (points, curves, samples), with 1 where nothing differs: points of the fit coordinates, samples of a curve.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.autodiff import contiguous
from underskin.mechanisms.models.sphere_kernel import contact_rows, edge_rows, pull_off_rows, radius_rows
from underskin.physics.contact_curves import LARGEST_A_OVER_H, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.surrogate.contact_table import load_contact
from underskin.units import Floats, Mask

_SMALLEST = 1e-12  # m of depth, below which a radius is not told from 0
_NODES = 401  # of the layer's functions over a/h


@dataclass(frozen=True)
class Stiffening:
    """(1 + q c J)^(1/q), J = 3 (I/3)^(m/2) of the invariant I = I1 − 3, about 3 ε^m at a strain ε.

    At m = 2 Yeoh's law (q = 1), Demiray's exponential (0) and Gent's (−1); at m = 1 the modulus grows with the strain.
    """

    coefficient: Floats  # c (points, 1, 1)
    form: Floats  # q
    exponent: Floats  # m


class LayerRatios:
    """A layer's force, depth, stiffness and adhesive stretch over the half space's, of a/h; and a/h of the depth.

    Attributes: `cubics` (cells, powers, 7), these four and finite strain's three coefficients.
    """

    def __init__(self, poisson_ratio: float) -> None:
        """Solve the layer of this Poisson ratio at the nodes (about a millisecond)."""
        alpha = np.linspace(0.0, LARGEST_A_OVER_H, _NODES)
        ratios = _grid().curves(Layer(poisson_ratio)).ratios_at(np.maximum(alpha, 1e-9))
        columns = np.concatenate([ratios, load_contact().softening_coefficients(alpha)], axis=1)
        self.cubics = np.ascontiguousarray(CubicSpline(alpha, columns).c.transpose(1, 0, 2))
        root = alpha * np.sqrt(ratios[:, 1])
        self._alpha = CubicSpline(root, alpha)
        self._deepest = float(root[-1])

    def alpha_of(self, root: Floats) -> Floats:
        """a/h of √(δR)/h without adhesion."""
        return np.asarray(self._alpha(np.minimum(root, self._deepest)))


@lru_cache(maxsize=256)
def layer_ratios(poisson_ratio: float) -> LayerRatios:
    """Those of one Poisson ratio."""
    return LayerRatios(poisson_ratio)


@cache
def _half_space() -> Floats:
    """The cubics (1, 1, powers, 7) of a half space, whose ratios nobody asks for."""
    cubics = np.zeros((1, 1, 4, 7))
    cubics[0, 0, 3, 4:] = load_contact().softening_coefficients(np.zeros(()))
    return cubics


@cache
def _grid() -> CurveGrid:
    """No stress is asked for: one wave number, of no use."""
    return CurveGrid(np.ones(1))


@dataclass(frozen=True)
class Layers:
    """The layers that each point of the fit coordinates has: their thickness [m] (points, 1, 1) and functions."""

    thickness: Floats
    each: Sequence[LayerRatios]  # of each point, or one for all

    @cached_property
    def cubics(self) -> Floats:
        """The functions as cubics (points or 1, cells, powers, 4)."""
        return np.stack([ratios.cubics for ratios in self.each])

    def radius_of(self, root: Floats) -> Floats:
        """a of √(δR) [m] without adhesion."""
        relative = root / self.thickness
        if len(self.each) == 1:
            return self.each[0].alpha_of(relative) * self.thickness
        parts = [ratios.alpha_of(of_point) for ratios, of_point in zip(self.each, relative, strict=True)]
        return np.stack(parts) * self.thickness


@dataclass(frozen=True)
class Sphere:
    """Spheres of `radius` on elastomer of reduced modulus E' = E/(1 − ν²); `give` is 1/k of the stage [m/N]."""

    modulus: Floats
    radius: Floats
    layers: Layers | None = None
    stiffening: Stiffening | None = None
    give: Floats | float = 0.0
    whole: Floats | float = 0.0  # 1 where it is pressed so deep that it is no paraboloid (curves, 1), else 0
    strain_share: Floats | float = 0.0  # of finite strain's correction of the depth

    def at(self, a: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """F, δ and K without adhesion at radii a, and ℓ/√w of the adhesive stretch."""
        shape = np.broadcast_shapes(np.shape(a), self._body.shape[:-1])
        contact = np.empty((4, *shape))
        contact_rows(_wide(a, shape), self._wide_body(shape), self._cubics, contact)
        force, depth, stiffness, stretch = contact
        return force, depth, stiffness, stretch

    def travel(self, a: Floats, work: Floats) -> Floats:
        """δ + F/k in equilibrium."""
        force, depth, stiffness, unit = self.at(a)
        stretch = unit * np.sqrt(work)
        return np.asarray(depth - stretch + self.give * (force - stiffness * stretch))

    def force_at(self, travel: Floats, a: Floats) -> Floats:
        """F at a travel, where the edge is at a: as its stretch then is."""
        force, depth, stiffness, _ = self.at(a)
        stretch = (depth + self.give * force - travel) / (1 + self.give * stiffness)
        return np.asarray(force - stiffness * stretch)

    def radius_at(self, travel: Floats, work: Floats | None, least: Floats | float = 0.0) -> Floats:
        """a of the stable contact at a travel in equilibrium; `least` where there is none: its radius at pull-off."""
        depth = np.maximum(travel, _SMALLEST)
        root = np.sqrt(self.radius * depth)
        start = root if self.layers is None else self.layers.radius_of(root)
        if work is None and not (np.any(self.give) or np.any(self.whole) or np.any(self.strain_share)):
            return start
        if work is None:
            work = np.zeros((1, 1, 1))
        pulled = np.sqrt(1.5 * np.pi * work * self.give) * self.radius
        start = start + (1.0 if self.layers is None else 1.3) * (self._unit(work) + pulled)
        shape = np.broadcast_shapes(np.shape(start), np.shape(travel), self._body.shape[:-1])
        a = np.array(np.broadcast_to(start, shape))
        of_curve = [_wide(values, shape, np.shape(values)[-1:] or (1,)) for values in (work, least)]
        radius_rows(_wide(travel, shape), *of_curve, a, self._wide_body(shape), self._cubics)
        return a

    def pull_off(self, work: Floats | None) -> tuple[Floats, Floats]:
        """The radius and travel (points, curves, 1) below which there is no stable contact; 0 without adhesion."""
        shape = self._body.shape[:-1]
        if work is None:
            return np.zeros(shape), np.zeros(shape)
        shape = np.broadcast_shapes(shape, np.shape(work))
        radius, travel = np.empty(shape), np.empty(shape)
        pull_off_rows(_wide(work, shape), self._wide_body(shape), self._cubics, radius, travel)
        return radius, travel

    @cached_property
    def _body(self) -> Floats:
        """As the compiled functions take it."""
        thickness = 0.0 if self.layers is None else self.layers.thickness
        law = self.stiffening
        stiffening = (-1.0, 0.0, 0.0) if law is None else (law.coefficient, law.form, law.exponent)
        columns = (self.modulus, self.radius, self.give, thickness, *stiffening, self.whole, self.strain_share)
        whole = np.empty((*np.broadcast_shapes(*map(np.shape, columns)), len(columns)))
        for number, column in enumerate(columns):
            whole[..., number] = column
        return whole.reshape((1,) * (4 - whole.ndim) + whole.shape)

    def _wide_body(self, shape: tuple[int, ...]) -> Floats:
        """For points and curves of a shape."""
        return _wide(self._body, (*shape[:2], *self._body.shape[2:]))

    @property
    def _cubics(self) -> Floats:
        return _half_space() if self.layers is None else self.layers.cubics

    def inside(self, a: Floats) -> Mask:
        """Which contacts the layer's functions reach."""
        if self.layers is None:
            return np.ones(np.shape(a), dtype=bool)
        return np.asarray(a < (1 - 1e-9) * LARGEST_A_OVER_H * self.layers.thickness)

    def _unit(self, work: Floats) -> Floats:
        """JKR's unit of length [m]: the contact radius at δ = 0 on the half space under a stiff stage."""
        return np.asarray(np.cbrt(2 * np.pi * self.radius**2 * work / self.modulus))


def _wide(values: Floats | float, shape: tuple[int, ...], last: tuple[int, ...] = ()) -> Floats:
    """Broadcast to a shape, but along the last axis to what is `last`; contiguous."""
    whole = (*shape[:-1], *last) if last else shape
    if isinstance(values, np.ndarray) and values.shape == whole:
        return contiguous(values)
    return contiguous(np.broadcast_to(values, whole))


def in_contact(travel: Floats, pull_off: Floats) -> Mask:
    """Which samples are: from the first that reaches the surface, at 0, to the first below pull-off, and so on."""
    meets = travel >= 0
    changes = meets | (travel < pull_off)
    changes[..., 0] = True
    last = np.maximum.accumulate(np.where(changes, np.arange(travel.shape[-1]), 0), axis=-1)
    return np.asarray(np.take_along_axis(meets, last, axis=-1))


def edges(sphere: Sphere, travel: Floats, held: Mask, work: Floats, separation: Floats | None) -> Floats:
    """The edge's radius at each sample (points, curves, samples).

    The edge advances where its energy release rate is the `work` of adhesion, recedes where it is that of `separation`,
    and rests in between.
    """
    parting = work if separation is None else separation
    least, _ = sphere.pull_off(parting)
    if separation is None:
        return sphere.radius_at(travel, work, least)
    first_least, _ = sphere.pull_off(work)
    advancing, receding = sphere.radius_at(travel, work, first_least), sphere.radius_at(travel, parting, least)
    a = np.empty_like(receding)
    edge_rows(advancing, receding, contiguous(np.broadcast_to(held, a.shape)), a)
    return a
