"""A rigid sphere on the elastic half space or layer, with adhesion, stiffening and a stage that gives. SI.

All follows from the contact radius a. Without adhesion, on the half space: δ = a²/R, F = 4E'a³/(3R), and at a fixed
edge the stiffness is K = 2E'a; on the layer these are multiplied by functions of a/h (contact_curves). An edge whose
energy release rate is w is stretched by ℓ: δ and F fall by ℓ and K ℓ, on the half space ℓ = √(2πaw/E') (Johnson,
Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301). A stiffening elastomer has E' times its secant ratio at the
representative strain 0.2 a/R (Lin, Dimitriadis & Horkay, J. Biomech. Eng. 129 (2007) 904). What the stage commands is
δ + F/k.

Under a given travel the contact is stable where the travel grows with a. It ends at the least travel: at JKR's least
depth for a stiff stage, at the least force, −3πwR/2 on the half space, for a soft one.

Arrays are (points, curves, samples), with 1 where nothing differs: points of the fit coordinates, samples of a curve.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.physics.contact_curves import LARGEST_A_OVER_H, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats, Mask

_STRAIN = 0.2
_SMALLEST = 1e-12  # m of depth, below which a radius is not told from 0
_STEPS = 40
_TOLERANCE = 1e-10  # of the contact radius, of the last step
_DIFFERENCE = 1e-6  # of the contact radius, for the slope of the travel
_NODES = 401  # of the layer's functions over a/h
_LEAST, _MOST, _HALVINGS = 0.02, 4.0, 40  # of JKR's unit of length: where the contact ends, and how it is sought
_LAST = 0.25 ** (2 / 3)  # x of JKR's contact at its least depth
_LEAST_TRAVEL = _LAST**2 - _LAST**0.5
_FURTHEST, _FLAT = 300.0, 1e-2  # √(t − t_least) that the spline reaches, and the slope below which it is as good
_EXPONENTIAL = 1e-6  # |q| below which the stiffening is
_LARGEST_RATIO = 100.0  # of stiffening: Gent's law ends at its limit


@dataclass(frozen=True)
class Stiffening:
    """(1 + q c J)^(1/q), J = 3 (I/3)^(m/2) of the invariant I = I1 − 3, about 3 ε^m at a strain ε.

    At m = 2 Yeoh's law (q = 1), Demiray's exponential (0) and Gent's (−1); at m = 1 the modulus grows with the strain.
    """

    coefficient: Floats  # c (points, 1, 1)
    form: Floats  # q
    exponent: Floats  # m

    def secant_ratio(self, strain: Floats) -> Floats:
        """Nominal uniaxial stress at a compressive strain, over E times the strain."""
        safe = np.maximum(strain, 1e-9)
        stretch = 1.0 - safe
        third = np.maximum(stretch * stretch + 2.0 / stretch - 3.0, 1e-18) / 3.0
        growth = 3.0 * self.coefficient * third ** (0.5 * self.exponent)
        small = np.abs(self.form) < _EXPONENTIAL
        q = np.where(small, 1.0, self.form)
        logarithm = np.where(small, growth, np.log(np.maximum(1.0 + q * growth, 1e-9)) / q)
        excess = np.exp(np.minimum(logarithm, np.log(_LARGEST_RATIO)))
        return np.asarray((1.0 / stretch**2 - stretch) / (3.0 * safe) * excess)


class LayerRatios:
    """A layer's force, depth, stiffness and adhesive stretch over the half space's, of a/h; and a/h of the depth."""

    def __init__(self, poisson_ratio: float) -> None:
        """Solve the layer of this Poisson ratio at the nodes (about a millisecond)."""
        alpha = np.linspace(0.0, LARGEST_A_OVER_H, _NODES)
        ratios = _grid().curves(Layer(poisson_ratio)).ratios_at(np.maximum(alpha, 1e-9))
        self._ratios = CubicSpline(alpha, ratios)
        root = alpha * np.sqrt(ratios[:, 1])
        self._alpha = CubicSpline(root, alpha)
        self.deepest = float(root[-1])

    def __call__(self, alpha: Floats) -> Floats:
        """Force, depth, stiffness, stretch (…, 4)."""
        return np.asarray(self._ratios(np.minimum(alpha, LARGEST_A_OVER_H)))

    def alpha_of(self, root: Floats) -> Floats:
        """a/h of √(δR)/h without adhesion."""
        return np.asarray(self._alpha(np.minimum(root, self.deepest)))


@lru_cache(maxsize=256)
def layer_ratios(poisson_ratio: float) -> LayerRatios:
    """Those of one Poisson ratio."""
    return LayerRatios(poisson_ratio)


@cache
def _grid() -> CurveGrid:
    """No stress is asked for: one wave number, of no use."""
    return CurveGrid(np.ones(1))


@dataclass(frozen=True)
class Layers:
    """The layers that each point of the fit coordinates has: their thickness [m] (points, 1, 1) and functions."""

    thickness: Floats
    each: Sequence[LayerRatios]  # of each point, or one for all

    def at(self, a: Floats) -> Floats:
        """Force, depth, stiffness, stretch over the half space's at radii a (points, curves, samples): (…, 4)."""
        alpha = a / self.thickness
        if len(self.each) == 1:
            return self.each[0](alpha)
        return np.stack([ratios(of_point) for ratios, of_point in zip(self.each, alpha, strict=True)])

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

    def at(self, a: Floats) -> tuple[Floats, Floats, Floats, Floats | float]:
        """δ, F and K without adhesion at radii a, and the layer's ratio of the stretch ℓ."""
        modulus = self._modulus_at(a)
        depth: Floats = a * a / self.radius
        stiffness: Floats = 2.0 * modulus * a
        force: Floats = (2 / 3) * stiffness * depth
        if self.layers is None:
            return depth, force, stiffness, 1.0
        ratios = self.layers.at(a)
        return depth * ratios[..., 1], force * ratios[..., 0], stiffness * ratios[..., 2], ratios[..., 3]

    def stretch(self, a: Floats, work: Floats) -> Floats:
        """ℓ of an edge with the energy release rate `work` [J/m²]."""
        ratio = 1.0 if self.layers is None else self.layers.at(a)[..., 3]
        return self._stretch(a, work, ratio)

    def travel(self, a: Floats, work: Floats | None) -> Floats:
        """δ + F/k in equilibrium."""
        depth, force, stiffness, ratio = self.at(a)
        if work is not None:
            stretch = self._stretch(a, work, ratio)
            depth, force = depth - stretch, force - stiffness * stretch
        return np.asarray(depth + self.give * force)

    def force_at(self, travel: Floats, a: Floats) -> Floats:
        """F at a travel, where the edge is at a: as its stretch then is."""
        depth, force, stiffness, _ = self.at(a)
        stretch = (depth + self.give * force - travel) / (1 + self.give * stiffness)
        return np.asarray(force - stiffness * stretch)

    def radius_at(self, travel: Floats, work: Floats | None, least: Floats | float = 0.0) -> Floats:
        """a of the stable contact at a travel in equilibrium; `least` where there is none: its radius at pull-off.

        Newton's steps from above: the travel is convex in a.
        """
        depth = np.maximum(travel, _SMALLEST)
        root = np.sqrt(self.radius * depth)
        if work is None and not np.any(self.give):
            return root if self.layers is None else self.layers.radius_of(root)
        if work is not None and self._plain:
            unit = self._unit(work)
            return np.maximum(_jkr_radius(travel * self.radius / unit**2) * unit, least)
        start = root if self.layers is None else self.layers.radius_of(root)
        if work is not None:
            pulled = np.sqrt(1.5 * np.pi * work * self.give) * self.radius
            start = start + (1.0 if self.layers is None else 1.3) * (self._unit(work) + pulled)
        a = start + np.zeros(np.broadcast_shapes(np.shape(start), np.shape(travel)))
        a = np.maximum(a, least)
        for _ in range(_STEPS):
            here = self.travel(a, work)
            slope = (self.travel(a * (1 + _DIFFERENCE), work) - here) / (_DIFFERENCE * a)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = np.where(slope > 0, (here - travel) / slope, 0.5 * a)
            moved = np.maximum(a - np.clip(step, -a, 0.9 * a), least)
            done = bool((np.abs(moved - a) <= _TOLERANCE * a).all())
            a = moved
            if done:
                break
        return np.asarray(a)

    def pull_off(self, work: Floats | None) -> tuple[Floats, Floats]:
        """The radius and travel (points, curves, 1) below which there is no stable contact; 0 without adhesion."""
        shape = np.broadcast_shapes(np.shape(self.modulus), np.shape(self.radius))
        if work is None:
            return np.zeros(shape), np.zeros(shape)
        unit = self._unit(work)
        if self._plain:
            return _LAST * unit, _LEAST_TRAVEL * unit**2 / self.radius
        unit = unit + np.zeros(shape)
        low, high = _LEAST * unit, _MOST * unit
        if self.layers is not None:
            largest = LARGEST_A_OVER_H * self.layers.thickness
            low, high = np.minimum(low, 0.1 * largest), np.minimum(high, largest)
        for _ in range(_HALVINGS):
            middle = np.sqrt(low * high)
            rising = self.travel(middle * (1 + _DIFFERENCE), work) > self.travel(middle * (1 - _DIFFERENCE), work)
            low, high = np.where(rising, low, middle), np.where(rising, middle, high)
        return high, self.travel(high, work)

    @property
    def _plain(self) -> bool:
        """Whether it is JKR's contact on the half space under a stiff stage: one function of one variable."""
        return self.layers is None and self.stiffening is None and not np.any(self.give)

    def inside(self, a: Floats) -> Mask:
        """Which contacts the layer's functions reach."""
        if self.layers is None:
            return np.ones(np.shape(a), dtype=bool)
        return np.asarray(a < (1 - 1e-9) * LARGEST_A_OVER_H * self.layers.thickness)

    def _unit(self, work: Floats) -> Floats:
        """JKR's unit of length [m]: the contact radius at δ = 0 on the half space under a stiff stage."""
        return np.asarray(np.cbrt(2 * np.pi * self.radius**2 * work / self.modulus))

    def _stretch(self, a: Floats, work: Floats, ratio: Floats | float) -> Floats:
        return np.asarray(np.sqrt(2 * np.pi * a * work / self._modulus_at(a)) * ratio)

    def _modulus_at(self, a: Floats) -> Floats:
        if self.stiffening is None:
            return self.modulus
        return np.asarray(self.modulus * self.stiffening.secant_ratio(np.minimum(_STRAIN * a / self.radius, 0.9)))


def _jkr_radius(travel: Floats) -> Floats:
    """x of x² − √x = t, on the stable side: a and δ R in units of (2πwR²/E')^(1/3), and its square.

    By a spline in √(t − t_least), in which x is smooth, and two of Newton's steps.
    """
    above = np.sqrt(np.maximum(travel - _LEAST_TRAVEL, 0.0))
    x = np.asarray(_jkr_spline()(np.minimum(above, _FURTHEST)))
    x = np.where(above < _FURTHEST, x, above)
    for _ in range(2):
        root = np.sqrt(x)
        slope = 2 * x - 0.5 / root
        x = np.where(
            slope > _FLAT, x - (x * x - root - np.maximum(travel, _LEAST_TRAVEL)) / np.maximum(slope, _FLAT), x
        )
    return np.asarray(x)


@cache
def _jkr_spline() -> CubicSpline:
    x = _LAST + np.concatenate([[0.0], np.geomspace(1e-5, _FURTHEST + 2, 800)])
    return CubicSpline(np.sqrt(np.maximum(x * x - np.sqrt(x) - _LEAST_TRAVEL, 0.0)), x)


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
    edge = np.zeros_like(receding[..., 0])
    for sample in range(travel.shape[-1]):
        forward, back = advancing[..., sample], receding[..., sample]
        edge = np.where(held[..., sample] & (edge > 0), np.minimum(np.maximum(edge, forward), back), forward)
        a[..., sample] = edge
        edge = np.where(held[..., sample], edge, 0.0)
    return a
