"""A rigid sphere pressed into the elastic half space or layer, with adhesion, stiffening and a stage that gives.

All follows from the contact radius a. Half space: δ = a²/R − ℓ, F = 4E'a³/(3R) − K ℓ with the stiffness at a fixed
edge K = 2E'a and the edge's adhesive stretch ℓ = √(2πaw/E') (Johnson, Kendall & Roberts 1971); layer: contact_curves.
A stiffening elastomer multiplies F and K by its secant ratio at the representative strain 0.2 a/R (Lin, Dimitriadis &
Horkay, J. Biomech. Eng. 129 (2007) 904). What the bench commands is the travel δ + F/k.

Under a given travel the contact is stable where the travel grows with a. It ends at the least travel: at JKR's least
depth for a stiff stage, at the least force, −3πwR/2 on the half space, for a soft one.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated, chain, where
from underskin.mechanisms.models.curve_state import Curve, stiffened
from underskin.physics.contact_curves import LARGEST_A_OVER_H, ContactCurves
from underskin.units import Floats

_STRAIN = 0.2
_SMALLEST_TRAVEL = 1e-12  # m; keeps the root's derivative finite
_STEPS = 60
_TOLERANCE = 1e-8  # of the contact radius, of the last step; the error that is left is about its square
_LEAST, _MOST = 0.05, 3.0  # of JKR's unit of length, between which the contact ends
_POINTS, _ROUNDS = 24, 4  # of that search; the travel is flat there


@dataclass(frozen=True)
class ContactAt:
    """Contacts (rows,): δ, F, the stiffness at a fixed edge K and the edge's adhesive stretch ℓ (None without)."""

    depth: Differentiated
    force: Differentiated
    stiffness: Differentiated
    stretch: Differentiated | None

    def moved(self, shift: Floats) -> "ContactAt":
        """With the last variable, the contact radius, made to follow the others: `shift` (variables, rows)."""

        def along(x: Differentiated) -> Differentiated:
            return Differentiated(x.value, x.slopes + x.slopes[-1] * shift)

        stretch = None if self.stretch is None else along(self.stretch)
        return ContactAt(along(self.depth), along(self.force), along(self.stiffness), stretch)

    def where(self, held: NDArray[np.bool_], depth: Differentiated) -> "ContactAt":
        """Nothing, at these depths, where it is not held."""
        stretch = None if self.stretch is None else where(held, self.stretch, 0.0)
        return ContactAt(
            where(held, self.depth, depth), where(held, self.force, 0.0), where(held, self.stiffness, 0.0), stretch
        )


@dataclass(frozen=True)
class Sphere:
    """Spheres of radius `radius` (rows,) [m] on what `curve` describes; `layer` where that is layered.

    The last of the variables with respect to which the curve is differentiated must change nothing in it: it is used
    for the contact radius.
    """

    curve: Curve
    radius: Floats
    layer: ContactCurves | None

    def rows(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Sphere":
        """Those of some rows."""
        return replace(self, radius=self.radius[rows])

    def at_radius(self, a: Differentiated) -> ContactAt:
        """The equilibrium at contact radii a (rows,) > 0 [m]."""
        equilibrium = self._on_half_space(a) if self.layer is None else self._on_layer(a, self.layer)
        if self.curve.yeoh is None:
            return equilibrium
        strain = _STRAIN * a / self.radius
        ratio = stiffened(1.0 - strain, self.curve.yeoh) / (3.0 * strain)
        return replace(equilibrium, force=equilibrium.force * ratio, stiffness=equilibrium.stiffness * ratio)

    def pull_off(self) -> tuple[Floats, Floats]:
        """The radius and travel (rows,) below which there is no stable contact; 0 without adhesion."""
        work = self.curve.work_of_adhesion
        none = np.zeros_like(self.radius)
        if work is None:
            return none, none
        unit = np.cbrt(2 * np.pi * self.radius**2 * work.value / self.curve.reduced_modulus.value)
        highest = np.minimum(_MOST * unit, self._largest)
        low, high = np.minimum(_LEAST * unit, 0.1 * highest), highest
        for _ in range(_ROUNDS):
            a = low * (high / low) ** np.linspace(0.0, 1.0, _POINTS)[:, None]
            _, slope = _many(self, len(a))._travel(a.ravel())
            unstable = (slope.reshape(a.shape) < 0).sum(axis=0)
            last = np.clip(unstable, 1, _POINTS - 1)
            low, high = a[last - 1, range(len(last))], a[last, range(len(last))]
        return high, self._travel(high)[0]

    def at_travel(
        self, travel: Differentiated, held: NDArray[np.bool_], least: Floats
    ) -> tuple[ContactAt, NDArray[np.bool_]]:
        """Contacts at δ + F/k (rows,), nothing where not `held`, and which rows lie within the layer's reach.

        `least` (rows,): the radius at pull-off. Rows held must have a travel above that of pull-off.
        """
        lowest = _SMALLEST_TRAVEL if self.curve.work_of_adhesion is None else -np.inf
        target = np.where(held, np.maximum(travel.value, lowest), _SMALLEST_TRAVEL)
        limit = np.full_like(self.radius, self._largest)
        inside = np.ones(len(target), dtype=bool)
        if self.layer is not None:
            furthest, _ = self._travel(limit)
            inside = ~held | (target < furthest)
            target = np.where(target < furthest, target, 0.5 * furthest)
        held = held & inside
        a = self._solved(target, least, limit)
        variables = len(self.curve.modulus.slopes)
        seed = np.zeros((variables, len(a)))
        seed[-1] = 1.0
        contact = self.at_radius(Differentiated(a, seed))
        total = self._total(contact)
        given = np.zeros_like(seed) + travel.slopes
        return contact.moved((given - total.slopes) / total.slopes[-1]).where(held, travel), inside

    def _solved(self, target: Floats, least: Floats, most: Floats) -> Floats:
        """a between `least` and `most` with that travel: Newton's steps, halved where they leave what brackets it."""
        low, high = least, most
        a = np.sqrt(self.radius * np.maximum(target, _SMALLEST_TRAVEL)) + 2 * least
        if self.layer is not None:  # a² = Rδ/B, B(a/h) of a bonded incompressible layer within some percent
            alpha = a / self._largest * LARGEST_A_OVER_H
            a = a * np.sqrt((1 + 1.25 * alpha) / (1 + 0.35 * alpha))
        a = np.minimum(a, 0.5 * (low + np.minimum(most, 2 * a)))
        for _ in range(_STEPS):
            travel, slope = self._travel(a)
            high = np.where(travel > target, a, high)
            low = np.where(travel < target, a, low)
            with np.errstate(divide="ignore", invalid="ignore"):
                tried = a - (travel - target) / slope
            tried = np.where((tried >= low) & (tried <= high), tried, 0.5 * (low + np.minimum(high, 4 * a)))
            done = np.abs(tried - a) <= _TOLERANCE * a
            a = tried
            if done.all():
                break
        return a

    def _travel(self, a: Floats) -> tuple[Floats, Floats]:
        """δ + F/k and its slope by a, (rows,)."""
        fixed = replace(self, curve=self.curve.fixed(1))
        total = fixed._total(fixed.at_radius(Differentiated(a, np.ones((1, len(a))))))
        return total.value, total.slopes[0]

    def _total(self, at: ContactAt) -> Differentiated:
        stage = self.curve.stage_stiffness
        return at.depth if stage is None else at.depth + at.force / stage

    @property
    def _largest(self) -> float:
        """The contact radius [m] that the layer's curves reach."""
        if self.layer is None:
            return np.inf
        assert self.curve.thickness is not None
        return LARGEST_A_OVER_H * float(self.curve.thickness.value[0])

    def _on_half_space(self, a: Differentiated) -> ContactAt:
        modulus, work = self.curve.reduced_modulus, self.curve.work_of_adhesion
        stiffness = 2.0 * modulus * a
        area = a * a / self.radius
        depth, force = area, (2 / 3) * stiffness * area
        if work is None:
            return ContactAt(depth, force, stiffness, None)
        stretch = ((2 * np.pi) * a * work / modulus) ** 0.5
        return ContactAt(depth - stretch, force - stiffness * stretch, stiffness, stretch)

    def _on_layer(self, a: Differentiated, layer: ContactCurves) -> ContactAt:
        assert self.curve.thickness is not None
        h, modulus, work = self.curve.thickness, self.curve.reduced_modulus, self.curve.work_of_adhesion
        alpha = a / h
        root = None if work is None else self.radius * (work / (modulus * h * h * h)) ** 0.5
        rows = layer.at_radius(alpha.value, np.zeros_like(alpha.value) if root is None else root.value)

        def by_parameters(quantity: Differentiated) -> Differentiated:
            by_alpha, by_root, by_poisson_ratio, _ = quantity.slopes
            terms = [(by_alpha, alpha), (by_poisson_ratio, self.curve.poisson_ratio)]
            return chain(quantity.value, *terms, *([] if root is None else [(by_root, root)]))

        scale = modulus * h * h * h / self.radius
        force = scale * by_parameters(rows.load)
        depth = h * h / self.radius * by_parameters(rows.depth)
        stiffness = 2.0 * modulus * a * by_parameters(rows.stiffness)
        if root is None:
            return ContactAt(depth, force, stiffness, None)
        pushing = scale * by_parameters(rows.sphere_load)
        return ContactAt(depth, force, stiffness, (pushing - force) / stiffness)


def in_contact(travel: Floats, pull_off: Floats, first: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which samples are: from the first that reaches the surface, at 0, to the first below pull-off, and so on."""
    meets, parts = travel >= 0, travel < pull_off
    last = np.maximum.accumulate(np.where(meets | parts | first, np.arange(len(travel)), 0))
    return np.asarray(meets[last])


def _many(sphere: Sphere, times: int) -> Sphere:
    """The same spheres so many times over."""
    curve, work = sphere.curve, sphere.curve.work_of_adhesion
    if work is not None and len(work.value) > 1:
        curve = replace(curve, work_of_adhesion=Differentiated(np.tile(work.value, times), np.tile(work.slopes, times)))
    return Sphere(curve, np.tile(sphere.radius, times), sphere.layer)
