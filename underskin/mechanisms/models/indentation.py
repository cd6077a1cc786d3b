"""Indentations by a sphere.

A rigid sphere on the elastic half space or layer, with adhesion, stiffening and a stage that gives. SI.

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
(sphere_kernels).

Arrays are (points, curves, samples), with 1 where nothing differs: points of the fit coordinates, samples of a curve.

The force of a sphere on a body that relaxes, while its contact grows, stays and recedes (Ting's theory). SI.

E(t) = E(0) e(t), e(t) = 1 − Σ g (1 − e^(−t/τ)) over the Prony pairs. While the contact grows it is as large as on an
elastic body at this depth δ, u being that body's force. A ring of the contact that was reached at the time s and has
stuck since carries H(s,t) = ∫ e(t−s') dδ(s') over s < s' < t, and the contact recedes to the ring that is about to let
go:

    H(t1,t) = ℓ e(t−t1) − ℓ_s,   F(t) = ∫₀^{t1} e(t−s) du(s) + K H(t1,t)

(Ting, J. Appl. Mech. 33 (1966) 845: without adhesion the stretches ℓ, ℓ_s are 0, and so is H(t1,t)). K is the stiffness
of the contact as large as at t1, ℓ its adhesive stretch when it was reached and ℓ_s that at which it lets go; an edge
that moves sees the instantaneous modulus (Greenwood & Johnson, Phil. Mag. A 43 (1981) 697). What stiffens has E times
its ratio of stiffening at the present contact: u, K and F above are those at rest, and F is multiplied by it. Where all
rings but those of the first touch have let go, these are an elastic contact of modulus E(0) e at the depth
[(1−g) δ + Σ g Y]/e with the work of separation over e²; it ends at that contact's pull-off. Y is the fading memory of δ
(relaxation). δ and u run straight between samples.

Exact for half space and layer through one growing and one shrinking of the contact, with holds in between. Of small
returns on the way (noise) the rings are taken to have stuck throughout; larger ones are refused by contact_creep.

Arrays are (points, curves, samples), as in sphere_contact.

The force of indentation curves, sample by sample, under a set of mechanisms.

Base model: Hertz on a half space, F = (4/3) E/(1 − ν²) √R (d − d0)^(3/2), with the contact point d0 and, where none is
declared, E free; under a sphere that is pressed deep, Sneddon's law of the whole sphere in its place; and a share of
what finite strain adds to the depth. Stages: declared value → material → contact radius, depth and force together with
the stage's give, through the body's history where it relaxes. What the load cell adds, a zero, a drift and a gain,
stands in the covariance (diagnosis/noise).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache, partial

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.autodiff import constant, contiguous
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.models.composition import (
    STRAIN_SHARE,
    contact_point,
    modulus_parameter,
    required_modulus,
    thickness_parameter,
)
from underskin.mechanisms.models.curve_state import Curve, Samples, numbers
from underskin.mechanisms.models.curves import CurveModel, declared_modulus, times_of
from underskin.mechanisms.models.relaxation import Relaxation, memories
from underskin.mechanisms.models.sphere_kernels import (
    contact_rows,
    creep_edge_rows,
    edge_rows,
    pull_off_rows,
    radius_rows,
)
from underskin.mechanisms.parameter import Parameter
from underskin.physics.contact_curves import LARGEST_A_OVER_H, CurveGrid
from underskin.physics.elastic_layer import Layer
from underskin.physics.sphere_law import PARABOLOID
from underskin.recordings.campaign import Conditions, IndentationConditions, IndentationRecording, SkinDescription
from underskin.recordings.curve_course import curve_landmarks, touch
from underskin.recordings.modulus import estimate
from underskin.surrogate.contact_table import load_contact
from underskin.units import Floats, Indices, Mask, to_si

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


_ITERATIONS, _SETTLED = 40, 1e-9  # of the depths on a stage that gives; of the largest travel
_UNSETTLED = 1e-5


@dataclass(frozen=True)
class Adhesion:
    """Works of adhesion and of separation [J/m²] (points, 1, 1)."""

    work: Floats
    separation: Floats


@dataclass(frozen=True)
class Path:
    """What is commanded: `travel` [m] and `time` [s] of samples (points, curves, samples).

    `begins` (points, curves) is the sample with which contact starts: the first, or one put where it touches; the
    number of samples where there is none.
    """

    travel: Floats
    time: Floats
    begins: Indices

    @property
    def touched(self) -> Mask:
        """From the touch on."""
        return np.asarray(np.arange(self.travel.shape[-1]) >= self.begins[..., None])


def relaxing(sphere: Sphere, relaxation: Relaxation, adhesion: Adhesion | None, path: Path) -> tuple[Floats, Mask]:
    """F (points, curves, samples) [N] where a path's travel is the depth δ, and where there is contact.

    The sphere's own stage is not looked at.
    """
    if np.any(sphere.give):
        sphere = replace(sphere, give=0.0)
    begins, started = np.minimum(path.begins, path.travel.shape[-1] - 1)[..., None], path.touched
    number = np.arange(path.travel.shape[-1])
    depth = np.where(started, path.travel, 0.0)
    time = np.maximum(path.time, np.take_along_axis(path.time, begins, axis=-1))  # what is felt at the touch is at once
    work = None if adhesion is None else adhesion.work
    least, lowest = sphere.pull_off(work)
    held = started & (depth > lowest) if adhesion is not None else started & (depth > 0)
    a = sphere.radius_at(depth, work, np.maximum(least, 1e-12))
    force, stiffness, slack, parting, stiffer = _elastic(sphere, a, adhesion)
    force = np.where(held, force, 0.0)
    depth_memory, force_memory = memories(depth, time, relaxation), memories(force, time, relaxation)
    growing = relaxation.convolved(force, force_memory)
    record = np.maximum.accumulate(np.where(depth >= np.maximum.accumulate(depth, axis=-1), number, 0), axis=-1)
    record = np.maximum(record, begins)
    back = started & (record < number)
    if not back.any():
        return np.where(held, stiffer * growing, 0.0), held
    edge, carried, kept = (np.zeros(depth.shape) for _ in range(3))
    stuck = np.zeros(depth.shape, dtype=bool)
    reached = (depth, time, depth_memory, slack, parting, force, force_memory, record, begins[..., 0])
    creep_edge_rows(*map(contiguous, reached), *relaxation.of_points(len(depth)), edge, carried, kept, stuck)
    answer, some = stiffer * growing, np.s_[..., np.flatnonzero(back.any(axis=(0, 1)))]
    a = sphere.radius_at(contiguous(edge[some]), work, np.maximum(least, 1e-12))
    ring, stiffness, _, _, stiffer_ring = _elastic(sphere, a, adhesion)
    receding = stiffer_ring * (relaxation.unrelaxed * ring + kept[some] + stiffness * carried[some])
    answer[some] = np.where(back[some], receding, answer[some])
    held = np.where(back, stuck, held)
    touch = back & ~held
    if touch.any() and adhesion is not None:
        of_touch, holds = _first_touch(sphere, relaxation, adhesion, depth, depth_memory, time)
        answer, held = np.where(touch, of_touch, answer), np.where(touch, holds, held)
    return np.where(held, answer, 0.0), held


def relaxing_on_stage(
    sphere: Sphere, relaxation: Relaxation, adhesion: Adhesion | None, path: Path
) -> tuple[Floats, Mask]:
    """The same where the travel is δ + F/k of a stage that gives: depths by secant steps at all samples together."""
    give, travel, touched = sphere.give, path.travel, path.touched
    work = None if adhesion is None else adhesion.work
    least, _ = sphere.pull_off(work)
    a = sphere.radius_at(travel, work, np.maximum(least, 1e-12))
    elastic = sphere.force_at(travel, a) if work is not None else sphere.at(a)[0]
    depth = np.where(touched, travel - give * elastic, travel)
    slope = sphere.at(a)[2]
    scale = np.abs(travel).max(axis=-1, keepdims=True) + 1e-15
    force, held = relaxing(sphere, relaxation, adhesion, replace(path, travel=depth))
    for _ in range(_ITERATIONS):
        left = np.where(touched, depth + give * force - travel, 0.0)
        if (np.abs(left) <= _SETTLED * scale).all():
            break
        moved = depth - left / (1 + give * slope)
        after, held = relaxing(sphere, relaxation, adhesion, replace(path, travel=moved))
        change = moved - depth
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = (after - force) / change
        far = np.abs(change) > 1e-12 * scale
        slope = np.where(far & np.isfinite(secant) & (secant > 0), 0.5 * (slope + np.minimum(secant, 4 * slope)), slope)
        depth, force = moved, after
    lost = np.maximum.accumulate(np.abs(left) > _UNSETTLED * scale, axis=-1) & touched
    held = held & ~lost
    return np.where(held, force, 0.0), held


def _elastic(sphere: Sphere, a: Floats, adhesion: Adhesion | None) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """F and K of the elastic contact that grows, at its modulus at rest; ℓ and ℓ_s; and how much stiffer it is."""
    force, _, stiffness, unit = sphere.at(a)
    stiffer = np.ones_like(a)
    if sphere.stiffening is not None:
        stiffer = stiffness / replace(sphere, stiffening=None).at(a)[2]
    force, stiffness = force / stiffer, stiffness / stiffer
    if adhesion is None:
        none = np.zeros_like(force)
        return force, stiffness, none, none, stiffer
    stretch, parting = unit * np.sqrt(adhesion.work), unit * np.sqrt(adhesion.separation)
    return force - stiffness * stretch, stiffness, stretch, parting, stiffer


def _first_touch(
    sphere: Sphere,
    relaxation: Relaxation,
    adhesion: Adhesion,
    depth: Floats,
    memory: Floats,
    time: Floats,
) -> tuple[Floats, Mask]:
    """F of what is left of the first touch, at the first of the times, and whether it holds."""
    left = relaxation.remaining(time - time[..., :1])
    relaxed = relaxation.convolved(depth, memory) / left
    work = adhesion.separation / left**2
    unit = replace(sphere, radius=sphere.radius + np.zeros_like(depth))
    least, lowest = unit.pull_off(work)
    a = unit.radius_at(relaxed, work, least)
    return left * unit.force_at(relaxed, a), relaxed > lowest


_CONTACT_SD, _CONTACT_BOUND = 0.1, 0.8  # of the range of displacement: the contact point's prior and bounds


class IndentationModel(CurveModel):
    """The force of indentations under a set of mechanisms.

    Of measured curves, contact points and an undeclared modulus have priors around the base model's own fits. Of
    conditions alone they are those expected of the declared modulus, with contact at displacement 0.
    """

    def __init__(self, mechanisms: Sequence[Mechanism], conditions: Conditions) -> None:
        """Work out everything that no parameter changes; InvalidInput names a recording that does not load."""
        recordings = [entry for entry in conditions.recordings if isinstance(entry, IndentationConditions)]
        nuisances = _nuisances(recordings, conditions.skin)
        super().__init__(mechanisms, conditions, "indentation", recordings, nuisances)
        self._ids = [entry.id for entry in recordings]
        known = [entry.stage_stiffness_n_per_mm for entry in recordings]
        self._give = np.array([0.0 if stage is None else 1e-3 / stage for stage in known])[:, None]  # m/N
        self._radius = to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in recordings])[:, None]
        middles = np.array([nuisance.start for nuisance in nuisances[len(nuisances) - len(recordings) :]])
        deepest = self.displacement.max(axis=1) - 1e-3 * middles
        self._whole = (deepest > PARABOLOID * self._radius[:, 0]).astype(float)[:, None]

    def _curve(self, own: dict[str, Values], nuisances: Values) -> Curve:
        thickness = self._skin.thickness_mm
        modulus = declared_modulus(self._skin.youngs_modulus_mpa) * nuisances["youngs_modulus"]
        curve = Curve(
            modulus=modulus,
            poisson_ratio=constant(self._skin.poisson_ratio, 0, modulus.value.shape[:-1]),
            strain_share=nuisances[STRAIN_SHARE.name],
            thickness=None if thickness is None else to_si("thickness_mm", thickness) * nuisances["thickness"],
        )
        for mechanism in self._mechanisms:
            mechanism.on_curve(curve, own[mechanism.name])
        return curve

    def _force(self, curve: Curve, contact: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        travel = self.displacement - contact
        samples = Samples(self._ids, travel, self.time)
        for law in curve.laws:
            travel = law.moved(samples, travel)
        force, held, inside = self._force_at(curve, travel, held)
        for law in curve.laws:
            force = law.read(samples, force)
        return force, held, inside

    def _force_at(self, curve: Curve, travel: Floats, held: Mask | None) -> tuple[Floats, Mask, Mask]:
        sphere, adhesion = self._sphere(curve), _adhesion(curve)
        relaxation = curve.prony_pairs
        if relaxation is not None:
            on = relaxing if curve.stage_stiffness is None else relaxing_on_stage
            return self._relaxing(sphere, partial(on, sphere, relaxation, adhesion), adhesion, travel, held)
        if adhesion is None:
            depth = np.maximum(travel, 0.0)
            a = sphere.radius_at(depth, None)
            force = np.where(travel > 0, sphere.at(a)[0], 0.0)
            return force, travel > 0, sphere.inside(a) | (travel <= 0)
        if held is None:
            held = in_contact(travel, self._last_travel(sphere, adhesion.separation))
        a = edges(sphere, travel, held, adhesion.work, adhesion.separation if curve.work_of_separation else None)
        force = np.where(held, sphere.force_at(travel, a), 0.0)
        return force, held, sphere.inside(a) | ~held

    def _last_travel(self, sphere: Sphere, work: Floats) -> Floats:
        """The travel at which contact ends (points, curves, 1): where δ + F/k is least under the stage that is known to
        give although its deflection has been subtracted, else as the sphere's own stage has it."""
        least, travel = sphere.pull_off(work)
        if np.any(self._give):
            on_stage = replace(sphere, give=sphere.give + self._give)
            radius, _ = on_stage.pull_off(work)
            travel = np.where(self._give > 0, sphere.travel(np.maximum(radius, least), work), travel)
        return travel

    def _relaxing(
        self,
        sphere: Sphere,
        force_on: Callable[[Path], tuple[Floats, Mask]],
        adhesion: Adhesion | None,
        travel: Floats,
        held: Mask | None,
    ) -> tuple[Floats, Mask, Mask]:
        """The same through the history, which begins where a recording touches, between two samples."""
        path = _with_touch(travel, self.time)
        force, own = force_on(path)
        own = own & (travel >= 0).cumsum(axis=-1).astype(bool)  # the touch lies after its sample
        held = own if held is None else held
        force = np.where(held, force, 0.0)
        if sphere.layers is None:  # a half space, which has no tables to leave
            return force, held, np.ones_like(held)
        least = sphere.pull_off(None if adhesion is None else adhesion.work)[0]
        a = sphere.radius_at(np.maximum(path.travel, 0.0), None, least)
        return force, held, sphere.inside(a) | ~held

    def _sphere(self, curve: Curve) -> Sphere:
        poisson_ratio = numbers(curve.poisson_ratio)
        layers = None
        if curve.layered:
            assert curve.thickness is not None
            each = poisson_ratio.ravel().tolist()
            alike = each[:1] if len(set(each)) == 1 else each
            layers = Layers(numbers(curve.thickness), [layer_ratios(value) for value in alike])
        stiffening = None if curve.stiffening is None else Stiffening(*map(numbers, curve.stiffening))
        give = 0.0 if curve.stage_stiffness is None else 1.0 / numbers(curve.stage_stiffness)
        reduced = numbers(curve.modulus) / (1 - poisson_ratio**2)
        assert curve.strain_share is not None
        return Sphere(reduced, self._radius, layers, stiffening, give, self._whole, numbers(curve.strain_share))


def _adhesion(curve: Curve) -> Adhesion | None:
    if curve.work_of_adhesion is None:
        return None
    work = numbers(curve.work_of_adhesion)
    return Adhesion(work, work if curve.work_of_separation is None else numbers(curve.work_of_separation))


def _with_touch(travel: Floats, time: Floats) -> Path:
    """The path, with the touch, travel 0, in the place of the last sample before it."""
    touched = travel >= 0
    first = np.where(touched.any(axis=-1), touched.argmax(axis=-1), travel.shape[-1])
    time = np.broadcast_to(time, travel.shape).copy()
    travel = travel.copy()
    point, curve = np.nonzero((first > 0) & (first < travel.shape[-1]))
    then = first[point, curve]
    before, after = travel[point, curve, then - 1], travel[point, curve, then]
    share = before / (before - after)
    time[point, curve, then - 1] += share * (time[point, curve, then] - time[point, curve, then - 1])
    travel[point, curve, then - 1] = 0.0
    begins = np.where((first > 0) & (first < travel.shape[-1]), first - 1, first)
    return Path(travel, time, begins)


def _nuisances(recordings: Sequence[IndentationConditions], skin: SkinDescription) -> list[Parameter]:
    """The nuisances' parameters; raises InvalidInput where no measured curve loads, or one does not move."""
    estimates, contact_points, refused = [], [], None
    for entry in recordings:
        span = float(np.ptp(to_si("displacement_mm", entry.displacement_mm)))
        begins = 0.0
        if isinstance(entry, IndentationRecording):
            seen = curve_landmarks(entry.displacement_mm, entry.force_n, entry.time_s)
            force = entry.force_n - seen.drift * times_of(entry)
            columns = [np.asarray(column, dtype=float).tobytes() for column in (entry.displacement_mm, force)]
            try:
                modulus, begins = _hertz(*columns, entry.indenter_radius_mm, skin.poisson_ratio)
                estimates.append(modulus if modulus > 0 else _secant_modulus(entry, skin.poisson_ratio))
            except InvalidInput as refusal:
                refused = refusal.at(f"recordings[{entry.id}].{refusal.field}")
                # A curve that does not load begins where it shows least force.
                begins = float(to_si("displacement_mm", entry.displacement_mm[int(np.abs(force).argmin())]))
            if seen.snap_in is not None:
                begins = float(to_si("displacement_mm", touch(entry.displacement_mm, seen.snap_in)))
            if refused is not None and span == 0:
                raise refused
        contact_points.append(contact_point(entry.id, begins, _CONTACT_SD * span, _CONTACT_BOUND * span))
    if refused is not None and not estimates:
        raise refused
    thickness = [] if skin.thickness_mm is None else [thickness_parameter(skin)]
    if not estimates:
        required_modulus(skin)
    return [modulus_parameter(skin, estimates), STRAIN_SHARE, *thickness, *contact_points]


def _secant_modulus(entry: IndentationRecording, poisson_ratio: float) -> float:
    """Of a curve that does not load: Hertz's modulus [Pa] of the range of force over the range of travel."""
    force, travel = (float(np.ptp(to_si(name, getattr(entry, name)))) for name in ("force_n", "displacement_mm"))
    radius = float(to_si("indenter_radius_mm", entry.indenter_radius_mm))
    return max(0.75 * (1 - poisson_ratio**2) * force / (np.sqrt(radius) * max(travel, 1e-300) ** 1.5), 1e-300)


@lru_cache(maxsize=1024)  # a diagnosis composes some dozen models of the same recordings
def _hertz(displacement_mm: bytes, force_n: bytes, radius_mm: float, poisson_ratio: float) -> tuple[float, float]:
    """Modulus [Pa] and contact point [m] of the base model's own fit."""
    fit = estimate(
        to_si("displacement_mm", np.frombuffer(displacement_mm)),
        to_si("force_n", np.frombuffer(force_n)),
        float(to_si("indenter_radius_mm", radius_mm)),
        poisson_ratio,
    )
    return fit.modulus, fit.contact_point
