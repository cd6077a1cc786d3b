"""The contact of a sphere with an elastic or a relaxing body, half space or layer, sample by sample. SI.

Elastic contact, all as functions of the contact radius a. Without adhesion, on the half space: δ = a²/R,
F = 4E'a³/(3R), and at a fixed edge the stiffness is K = 2E'a; on the layer these are multiplied by functions of a/h
(elastic_layer). An edge of energy release rate w is stretched by ℓ: δ and F fall by ℓ and K ℓ, on the half space
ℓ = √(2πaw/E') (Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301). A stiffening elastomer has E' times its
nominal stress over a neo-Hookean solid's at the representative strain 0.2 a/R (after Lin, Dimitriadis & Horkay,
J. Biomech. Eng. 129 (2007) 904; their ratio to Hooke's law would include the neo-Hookean solid's own 9 % at a/R 0.4,
where the contact of a sphere gets softer by 5 %). The stage is commanded to δ + F/k.

Deep indentation: δ = a artanh(a/R), dF = 2E'a dδ (Sneddon, Int. J. Eng. Sci. 3 (1965) 47). Finite strain softens the
contact: at the same force, δ of the solved frictionless contact with a neo-Hookean layer is up to 3.4 % above the
linear one's (contact table), of which `strain_share` is taken; a is then the radius of the linear contact.

At a given travel the contact is stable where the travel grows with a. It ends at the least travel: at JKR's least depth
for a stiff stage, at the least force, −3πwR/2 on the half space, for a soft one.

Relaxing body (Ting, J. Appl. Mech. 33 (1966) 845): E(t) = E(0) e(t), e(t) = 1 − Σ g (1 − e^(−t/τ)) over the Prony
pairs; u is the elastic body's force at the depth δ. While the contact grows it is as large as on the elastic body. A
ring of the contact that was reached at the time s and has stuck since carries H(s,t) = ∫ e(t−s') dδ(s') over
s < s' < t, and the contact recedes to the ring that is about to let go:

    H(t1,t) = ℓ e(t−t1) − ℓ_s,   F(t) = ∫₀^{t1} e(t−s) du(s) + K H(t1,t)

Without adhesion the stretches ℓ, ℓ_s and H(t1,t) are 0. K is the stiffness of the contact at its size at t1, ℓ its
adhesive stretch when it was reached and ℓ_s that at which it lets go; a moving edge has the instantaneous modulus
(Greenwood & Johnson, Phil. Mag. A 43 (1981) 697). With stiffening, u, K and F above are those at rest, and F is
multiplied by the stiffening ratio at the present contact. Where only the rings of the first touch still hold, the
contact is elastic with modulus E(0) e at the depth [(1−g) δ + Σ g Y]/e and the work of separation over e²; it ends at
that contact's pull-off. Y is the fading memory of δ (relaxation). δ and u are linear between samples. Exact for half
space and layer through one growth and one shrinkage of the contact, with holds in between; in small returns on the way
(noise) rings are assumed to stick. Where a sphere presses again the surface may not have recovered: the rings are
marched as springs side by side (`ring_rows`), exact on a half space through any history of a round contact (Popov, Heß
& Willert, Handbook of Contact Mechanics, 2019, chapter 8), and adhesion is added as on the elastic body.

Arrays are (points, curves, samples), with 1 where nothing differs: points of the fit coordinates, samples of a
curve. The functions of a are compiled (sphere_kernels).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.autodiff import contiguous
from underskin.mechanisms.models.curve_state import Relaxation, memories
from underskin.physics.elastic_layer import LARGEST_A_OVER_H, Layer, curves_of
from underskin.surrogate.hdf5_format import load_contact
from underskin.units import Floats, Indices, Mask

_SMALLEST = 1e-12  # m of depth, below which a radius counts as 0
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
    """Force, depth, stiffness and adhesive stretch of a layer over the half space's, as functions of a/h; and a/h of
    depth.

    Attributes: `cubics` (cells, powers, 7), these four and the three coefficients of finite strain.
    """

    def __init__(self, poisson_ratio: float) -> None:
        """Solve the layer of this Poisson ratio at the nodes (about a millisecond)."""
        alpha = np.linspace(0.0, LARGEST_A_OVER_H, _NODES)
        ratios = curves_of(Layer(poisson_ratio)).ratios_at(np.maximum(alpha, 1e-9))
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
    """The ratios for one Poisson ratio."""
    return LayerRatios(poisson_ratio)


@cache
def _half_space() -> Floats:
    """The cubics (1, 1, powers, 7) of a half space, whose four ratios are not used."""
    cubics = np.zeros((1, 1, 4, 7))
    cubics[0, 0, 3, 4:] = load_contact().softening_coefficients(np.zeros(()))
    return cubics


@dataclass(frozen=True)
class Layers:
    """The layer at each point of the fit coordinates: thickness [m] (points, 1, 1) and functions of a/h."""

    thickness: Floats
    by_point: Sequence[LayerRatios]  # one for each point of the fit coordinates, or one for all

    @cached_property
    def cubics(self) -> Floats:
        """The functions as cubics (points or 1, cells, powers, 4)."""
        return np.stack([ratios.cubics for ratios in self.by_point])

    def radius_of(self, root: Floats) -> Floats:
        """a of √(δR) [m] without adhesion."""
        relative = root / self.thickness
        if len(self.by_point) == 1:
            return self.by_point[0].alpha_of(relative) * self.thickness
        parts = [ratios.alpha_of(of_point) for ratios, of_point in zip(self.by_point, relative, strict=True)]
        return np.stack(parts) * self.thickness


@dataclass(frozen=True)
class Sphere:
    """Spheres of `radius` on elastomer of reduced modulus E' = E/(1 − ν²); `compliance` is 1/k of the stage [m/N]."""

    modulus: Floats
    radius: Floats
    layers: Layers | None = None
    stiffening: Stiffening | None = None
    compliance: Floats | float = 0.0
    deep: Floats | float = 0.0  # 1 where it is pressed so deep that it is no paraboloid (curves, 1), else 0
    strain_share: Floats | float = 0.0  # of finite strain's correction of the depth

    def at(self, a: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """F, δ and K without adhesion at radii a, and ℓ/√w of the adhesive stretch."""
        from underskin.mechanisms.models.sphere_kernels import contact_rows

        shape = np.broadcast_shapes(np.shape(a), self._body.shape[:-1])
        contact = np.empty((4, *shape))
        contact_rows(_wide(a, shape), self._wide_body(shape), self._cubics, contact)
        force, depth, stiffness, stretch = contact
        return force, depth, stiffness, stretch

    def travel(self, a: Floats, work: Floats) -> Floats:
        """The travel δ + F/k in equilibrium."""
        force, depth, stiffness, unit = self.at(a)
        stretch = unit * np.sqrt(work)
        return np.asarray(depth - stretch + self.compliance * (force - stiffness * stretch))

    def force_at(self, travel: Floats, a: Floats) -> Floats:
        """F at a travel with the edge at a, stretched accordingly."""
        force, depth, stiffness, _ = self.at(a)
        stretch = (depth + self.compliance * force - travel) / (1 + self.compliance * stiffness)
        return np.asarray(force - stiffness * stretch)

    def radius_at(self, travel: Floats, work: Floats | None, least: Floats | float = 0.0) -> Floats:
        """The radius of the stable contact at a travel in equilibrium; without one `least`, the radius at pull-off."""
        from underskin.mechanisms.models.sphere_kernels import radius_rows

        depth = np.maximum(travel, _SMALLEST)
        root = np.sqrt(self.radius * depth)
        start = root if self.layers is None else self.layers.radius_of(root)
        if work is None and not (np.any(self.compliance) or np.any(self.deep) or np.any(self.strain_share)):
            return start
        if work is None:
            work = np.zeros((1, 1, 1))
        pulled = np.sqrt(1.5 * np.pi * work * self.compliance) * self.radius
        start = start + (1.0 if self.layers is None else 1.3) * (self._unit(work) + pulled)
        shape = np.broadcast_shapes(np.shape(start), np.shape(travel), self._body.shape[:-1])
        a = np.array(np.broadcast_to(start, shape))
        of_curve = [_wide(values, shape, np.shape(values)[-1:] or (1,)) for values in (work, least)]
        radius_rows(_wide(travel, shape), *of_curve, a, self._wide_body(shape), self._cubics)
        return a

    def pull_off(self, work: Floats | None) -> tuple[Floats, Floats]:
        """The radius and travel (points, curves, 1) below which there is no stable contact; 0 without adhesion."""
        from underskin.mechanisms.models.sphere_kernels import pull_off_rows

        shape = self._body.shape[:-1]
        if work is None:
            return np.zeros(shape), np.zeros(shape)
        shape = np.broadcast_shapes(shape, np.shape(work))
        radius, travel = np.empty(shape), np.empty(shape)
        pull_off_rows(_wide(work, shape), self._wide_body(shape), self._cubics, radius, travel)
        return radius, travel

    @cached_property
    def _body(self) -> Floats:
        """The columns of `sphere_kernels`' `body`."""
        thickness = 0.0 if self.layers is None else self.layers.thickness
        law = self.stiffening
        stiffening = (-1.0, 0.0, 0.0) if law is None else (law.coefficient, law.form, law.exponent)
        columns = (self.modulus, self.radius, self.compliance, thickness, *stiffening, self.deep, self.strain_share)
        rows = np.empty((*np.broadcast_shapes(*map(np.shape, columns)), len(columns)))
        for number, column in enumerate(columns):
            rows[..., number] = column
        return rows.reshape((1,) * (4 - rows.ndim) + rows.shape)

    def _wide_body(self, shape: tuple[int, ...]) -> Floats:
        """The body broadcast to points and curves of a shape."""
        return _wide(self._body, (*shape[:2], *self._body.shape[2:]))

    @property
    def _cubics(self) -> Floats:
        return _half_space() if self.layers is None else self.layers.cubics

    def inside(self, a: Floats) -> Mask:
        """Which contacts are within the range of the layer's functions."""
        if self.layers is None:
            return np.ones(np.shape(a), dtype=bool)
        return np.asarray(a < (1 - 1e-9) * LARGEST_A_OVER_H * self.layers.thickness)

    def _unit(self, work: Floats) -> Floats:
        """JKR's unit of length [m]: the contact radius at δ = 0 on the half space under a stiff stage."""
        return np.asarray(np.cbrt(2 * np.pi * self.radius**2 * work / self.modulus))


def _wide(values: Floats | float, shape: tuple[int, ...], last: tuple[int, ...] = ()) -> Floats:
    """Broadcast to a shape, with `last` in place of its last axis; contiguous."""
    target = (*shape[:-1], *last) if last else shape
    if isinstance(values, np.ndarray) and values.shape == target:
        return contiguous(values)
    return contiguous(np.broadcast_to(values, target))


def in_contact(travel: Floats, pull_off: Floats) -> Mask:
    """Which samples are in contact: from the first at or beyond the surface, travel 0, to the first below pull-off,
    and so on."""
    meets = travel >= 0
    changes = meets | (travel < pull_off)
    changes[..., 0] = True
    last = np.maximum.accumulate(np.where(changes, np.arange(travel.shape[-1]), 0), axis=-1)
    return np.asarray(np.take_along_axis(meets, last, axis=-1))


def edges(sphere: Sphere, travel: Floats, contact_mask: Mask, work: Floats, separation: Floats | None) -> Floats:
    """The contact radius at each sample (points, curves, samples).

    The edge advances where its energy release rate is the `work` of adhesion, recedes where it is that of
    `separation`, and rests in between.
    """
    from underskin.mechanisms.models.sphere_kernels import edge_rows

    receding_work = work if separation is None else separation
    least, _ = sphere.pull_off(receding_work)
    if separation is None:
        return sphere.radius_at(travel, work, least)
    first_least, _ = sphere.pull_off(work)
    advancing, receding = sphere.radius_at(travel, work, first_least), sphere.radius_at(travel, receding_work, least)
    a = np.empty_like(receding)
    edge_rows(advancing, receding, contiguous(np.broadcast_to(contact_mask, a.shape)), a)
    return a


_ITERATIONS, _SETTLED = 40, 1e-9  # of the depths on a stage that gives; of the largest travel
_UNSETTLED = 1e-5


@dataclass(frozen=True)
class Adhesion:
    """Works of adhesion and of separation [J/m²] (points, 1, 1)."""

    work: Floats
    separation: Floats


@dataclass(frozen=True)
class Path:
    """The commanded `travel` [m] and `time` [s] of the samples (points, curves, samples).

    `first_contact` (points, curves): index of the sample at which contact starts, the first or one that was moved to
    the touch; the number of samples without contact. `again` (curves,): which press again after a way back.
    """

    travel: Floats
    time: Floats
    first_contact: Indices
    again: Mask

    @property
    def touched(self) -> Mask:
        """Whether a sample is at or after the touch."""
        return np.asarray(np.arange(self.travel.shape[-1]) >= self.first_contact[..., None])


def relaxing(sphere: Sphere, relaxation: Relaxation, adhesion: Adhesion | None, path: Path) -> tuple[Floats, Mask]:
    """F (points, curves, samples) [N] where a path's travel is the depth δ, and where there is contact.

    The compliance of the sphere's stage is ignored.
    """
    from underskin.mechanisms.models.sphere_kernels import creep_edge_rows

    if np.any(sphere.compliance):
        sphere = replace(sphere, compliance=0.0)
    if path.again.all():
        return _relaxing_again(sphere, relaxation, adhesion, path)
    if path.again.any():
        parts = [
            relaxing(sphere, relaxation, adhesion, replace(path, again=np.full(len(path.again), again)))
            for again in (False, True)
        ]
        force, contact_mask = (np.where(path.again[:, None], last, first) for first, last in zip(*parts, strict=True))
        return force, contact_mask
    first_contact, started = np.minimum(path.first_contact, path.travel.shape[-1] - 1)[..., None], path.touched
    number = np.arange(path.travel.shape[-1])
    depth = np.where(started, path.travel, 0.0)
    # The load at the touch is a step
    time = np.maximum(path.time, np.take_along_axis(path.time, first_contact, axis=-1))
    work = None if adhesion is None else adhesion.work
    least, lowest = sphere.pull_off(work)
    contact_mask = started & (depth > lowest) if adhesion is not None else started & (depth > 0)
    a = sphere.radius_at(depth, work, np.maximum(least, 1e-12))
    force, stiffness, advancing_stretch, receding_stretch, stiffer = _elastic(sphere, a, adhesion)
    force = np.where(contact_mask, force, 0.0)
    depth_memory, force_memory = memories(depth, time, relaxation), memories(force, time, relaxation)
    growing = relaxation.convolved(force, force_memory)
    record = np.maximum.accumulate(np.where(depth >= np.maximum.accumulate(depth, axis=-1), number, 0), axis=-1)
    record = np.maximum(record, first_contact)
    returning = started & (record < number)
    if not returning.any():
        return np.where(contact_mask, stiffer * growing, 0.0), contact_mask
    edge, relaxed_depth, memory_force = (np.zeros(depth.shape) for _ in range(3))
    stuck = np.zeros(depth.shape, dtype=bool)
    inputs = (
        depth,
        time,
        depth_memory,
        advancing_stretch,
        receding_stretch,
        force,
        force_memory,
        record,
        first_contact[..., 0],
    )
    creep_edge_rows(
        *map(contiguous, inputs), *relaxation.of_points(len(depth)), edge, relaxed_depth, memory_force, stuck
    )
    answer, columns = stiffer * growing, np.s_[..., np.flatnonzero(returning.any(axis=(0, 1)))]
    a = sphere.radius_at(contiguous(edge[columns]), work, np.maximum(least, 1e-12))
    ring, stiffness, _, _, stiffer_ring = _elastic(sphere, a, adhesion)
    receding = stiffer_ring * (relaxation.unrelaxed * ring + memory_force[columns] + stiffness * relaxed_depth[columns])
    answer[columns] = np.where(returning[columns], receding, answer[columns])
    contact_mask = np.where(returning, stuck, contact_mask)
    touch = returning & ~contact_mask
    rows = np.flatnonzero(touch.any(axis=(0, 1)))
    if len(rows) and adhesion is not None:
        age, at_touch = time - time[..., :1], np.s_[..., rows]
        samples = (np.take(column, rows, axis=2) for column in (depth, depth_memory, age))
        of_touch, holds = _first_touch(sphere, relaxation, adhesion, *samples)
        answer[at_touch] = np.where(touch[at_touch], of_touch, answer[at_touch])
        contact_mask[at_touch] = np.where(touch[at_touch], holds, contact_mask[at_touch])
    return np.where(contact_mask, answer, 0.0), contact_mask


_RINGS = 128  # of a contact: F is straight between them, within 3e-5 of the largest


def _relaxing_again(
    sphere: Sphere, relaxation: Relaxation, adhesion: Adhesion | None, path: Path
) -> tuple[Floats, Mask]:
    """As `relaxing`, of spheres that press again."""
    from underskin.mechanisms.models.sphere_kernels import ring_rows

    depth = np.where(path.touched, path.travel, 0.0)
    reach = np.maximum(depth.max(axis=-1, keepdims=True), _SMALLEST) * np.linspace(0.0, 1.0, _RINGS + 1) ** 2
    slope = np.diff(_elastic(sphere, sphere.radius_at(reach, None), None)[0]) / np.diff(reach)
    force, edge = np.zeros(depth.shape), np.full(depth.shape, -1.0)
    inputs = (depth, path.time, path.first_contact, path.again, reach, np.diff(slope, prepend=0.0))
    ring_rows(*map(contiguous, inputs), *relaxation.of_points(len(depth)), force, edge)
    contact_mask = edge >= 0
    if sphere.stiffening is not None:
        force = force * _elastic(sphere, sphere.radius_at(np.maximum(edge, 0.0), None), None)[-1]
    if adhesion is None:
        return force, contact_mask
    depth = np.maximum(path.travel, 0.0)
    plain = np.where(depth > 0, sphere.at(sphere.radius_at(depth, None))[0], 0.0)
    sticking = in_contact(path.travel, sphere.pull_off(adhesion.separation)[1])
    a = edges(sphere, path.travel, sticking, adhesion.work, adhesion.separation)
    adhesive = np.where(sticking, sphere.force_at(path.travel, a), 0.0) - plain
    return force + adhesive, contact_mask | sticking


def _at_points(state: Any, points: Indices) -> Any:
    """A state whose arrays (points or 1, curves, samples, …) are those at some of the points."""
    if isinstance(state, np.ndarray):
        return state[points] if state.ndim > 2 and len(state) > 1 else state
    if isinstance(state, Layers):
        ratios = state.by_point if len(state.by_point) == 1 else [state.by_point[point] for point in points]
        return Layers(_at_points(state.thickness, points), ratios)
    if not is_dataclass(state) or isinstance(state, type):
        return state
    return replace(state, **{part.name: _at_points(getattr(state, part.name), points) for part in fields(state)})


def relaxing_on_stage(
    sphere: Sphere, relaxation: Relaxation, adhesion: Adhesion | None, path: Path
) -> tuple[Floats, Mask]:
    """As `relaxing`, with travel δ + F/k of a compliant stage: secant steps for the depths of all samples together."""
    compliance, travel, touched = sphere.compliance, path.travel, path.touched
    work = None if adhesion is None else adhesion.work
    least, _ = sphere.pull_off(work)
    a = sphere.radius_at(travel, work, np.maximum(least, 1e-12))
    elastic = sphere.force_at(travel, a) if work is not None else sphere.at(a)[0]
    depth = np.where(touched, travel - compliance * elastic, travel)
    slope = sphere.at(a)[2]
    scale = np.abs(travel).max(axis=-1, keepdims=True) + 1e-15
    force, contact_mask = relaxing(sphere, relaxation, adhesion, replace(path, travel=depth))
    for _ in range(_ITERATIONS):
        residual = np.where(touched, depth + compliance * force - travel, 0.0)
        moving = np.flatnonzero((np.abs(residual) > _SETTLED * scale).any(axis=(1, 2)))
        if not len(moving):
            break
        before, steepness, compliances = depth[moving], slope[moving], _at_points(compliance, moving)
        moved = before - residual[moving] / (1 + compliances * steepness)
        after, contact_mask[moving] = relaxing(
            _at_points(sphere, moving),
            _at_points(relaxation, moving),
            _at_points(adhesion, moving),
            Path(moved, path.time[moving], path.first_contact[moving], path.again),
        )
        change = moved - before
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (after - force[moving]) / change
        far = (np.abs(change) > 1e-12 * scale[moving]) & np.isfinite(secant) & (secant > 0)
        slope[moving] = np.where(far, 0.5 * (steepness + np.minimum(secant, 4 * steepness)), steepness)
        depth[moving], force[moving] = moved, after
    lost = np.maximum.accumulate(np.abs(residual) > _UNSETTLED * scale, axis=-1) & touched
    contact_mask = contact_mask & ~lost
    return np.where(contact_mask, force, 0.0), contact_mask


def _elastic(sphere: Sphere, a: Floats, adhesion: Adhesion | None) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """F and K of the growing elastic contact, at its modulus at rest; ℓ and ℓ_s; and the stiffening ratio."""
    force, _, stiffness, unit = sphere.at(a)
    stiffer = np.ones_like(a)
    if sphere.stiffening is not None:
        stiffer = stiffness / replace(sphere, stiffening=None).at(a)[2]
    force, stiffness = force / stiffer, stiffness / stiffer
    if adhesion is None:
        none = np.zeros_like(force)
        return force, stiffness, none, none, stiffer
    stretch, receding_stretch = unit * np.sqrt(adhesion.work), unit * np.sqrt(adhesion.separation)
    return force - stiffness * stretch, stiffness, stretch, receding_stretch, stiffer


def _first_touch(
    sphere: Sphere,
    relaxation: Relaxation,
    adhesion: Adhesion,
    depth: Floats,
    memory: Floats,
    age: Floats,
) -> tuple[Floats, Mask]:
    """F of the remaining first touch, of this `age`, and whether it holds."""
    remaining = relaxation.remaining(age)
    relaxed = relaxation.convolved(depth, memory) / remaining
    work = adhesion.separation / remaining**2
    unit = replace(sphere, radius=sphere.radius + np.zeros_like(depth))
    least, lowest = unit.pull_off(work)
    a = unit.radius_at(relaxed, work, least)
    return remaining * unit.force_at(relaxed, a), relaxed > lowest
