"""The force of a sphere on a body that relaxes, while its contact grows, stays and recedes (Ting's theory). SI.

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
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.autodiff import contiguous
from underskin.mechanisms.models.creep_kernel import edge_rows
from underskin.mechanisms.models.relaxation import Relaxation, memories
from underskin.mechanisms.models.sphere_contact import Sphere
from underskin.units import Floats, Indices, Mask

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
    edge_rows(*map(contiguous, reached), *relaxation.of_points(len(depth)), edge, carried, kept, stuck)
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
