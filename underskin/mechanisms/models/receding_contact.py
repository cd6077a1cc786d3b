"""The force of a sphere on a body that relaxes, while its contact grows, stays and recedes (Ting's theory).

E(t) = E(0) e(t), e(t) = 1 − g + g e^(−t/τ). While the contact grows it is as large as on an elastic body at this depth
δ, u being that body's force. A ring of the contact that was reached at the time s and has stuck since carries
H(s,t) = ∫ e(t−s') dδ(s') over s < s' < t, and the contact recedes to the ring that is about to let go:

    H(t1,t) = −ℓ (1 − e(t−t1)),   F(t) = ∫₀^{t1} e(t−s) du(s) + K H(t1,t)

(Ting, J. Appl. Mech. 33 (1966) 845: without adhesion the stretch ℓ is 0, and so is H(t1,t)). K and ℓ are stiffness and
adhesive stretch of the contact as large as at t1; an edge that moves sees the instantaneous modulus (Greenwood &
Johnson, Phil. Mag. A 43 (1981) 697). Where all rings but those of the first touch have let go, these are an elastic
contact of modulus E(0) e at the depth [(1−g) δ + g Y]/e with the adhesion w/e²; it ends at that contact's pull-off.
Y is the fading memory of δ (relaxation). δ and u run straight between samples.

Exact for half space and layer through one growing and one shrinking of the contact, with holds in between. Of small
returns on the way (noise) the rings are taken to have stuck throughout; larger ones are refused by contact_creep.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underskin.autodiff import Differentiated, exp, where
from underskin.mechanisms.models.indentation_law import ContactAt, Sphere
from underskin.mechanisms.models.relaxation import faded, lagging

_STEPS = 40
_TOLERANCE = 1e-8  # of the last step; the error that is left is about its square

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Presses:
    """Recordings of samples (rows,): `recording` of each, its `time` [s], whether its contact `started`.

    `begins` marks the sample with which a recording's contact starts: the first, or one put where it touches.
    """

    recording: Rows
    time: Differentiated
    started: NDArray[np.bool_]
    begins: NDArray[np.bool_]


@dataclass(frozen=True)
class _History:
    """What is remembered at the samples (rows,)."""

    depth: Differentiated
    time: Differentiated
    memory: Differentiated  # Y of δ
    stretch: Differentiated | None
    fraction: Differentiated
    tau: Differentiated

    def fixed(self) -> "_History":
        """Differentiated by nothing but one more variable."""

        def still(x: Differentiated) -> Differentiated:
            return Differentiated(x.value, np.zeros((1, len(x.value))))

        stretch = None if self.stretch is None else still(self.stretch)
        numbers = (self.depth, self.time, self.memory, self.fraction, self.tau)
        depth, time, memory, fraction, tau = map(still, numbers)
        return _History(depth, time, memory, stretch, fraction, tau)

    def kept(self, since: Differentiated, now: Rows) -> Differentiated:
        """e^(−(t−s)/τ) at samples `now`, s being `since`."""
        return exp((since - self.time[now]) / self.tau)

    def carried(self, ring: "_Ring", now: Rows) -> Differentiated:
        """H(s,t) at samples `now`."""
        grown = (1.0 - self.fraction) * (self.depth[now] - ring.depth)
        return grown + self.fraction * (self.memory[now] - self.kept(ring.time, now) * ring.memory)

    def excess(self, ring: "_Ring", now: Rows) -> Differentiated:
        """H(s,t) + ℓ (1 − e(t−s)), above 0 where the ring holds."""
        carried = self.carried(ring, now)
        if ring.stretch is None:
            return carried
        return carried + ring.stretch * self.fraction * (1.0 - self.kept(ring.time, now))

    def ring(self, after: Rows, share: Differentiated) -> "_Ring":
        """The rings reached at a `share` of the way from the samples `after` to the next ones."""
        then = np.minimum(after + 1, len(self.depth.value) - 1)

        def between(x: Differentiated) -> Differentiated:
            return x[after] + share * (x[then] - x[after])

        x = share * (self.time[then] - self.time[after]) / self.tau
        newer = lagging(x) * share * (self.depth[then] - self.depth[after])
        stretch = None if self.stretch is None else between(self.stretch)
        return _Ring(between(self.depth), between(self.time), exp(-x) * self.memory[after] + newer, stretch, x)


@dataclass(frozen=True)
class _Ring:
    """Of rings (rows,): δ, time and Y when they were reached, their ℓ, and the time since the sample before over τ."""

    depth: Differentiated
    time: Differentiated
    memory: Differentiated
    stretch: Differentiated | None
    since: Differentiated


def relaxing(
    spheres: Sphere, depth: Differentiated, presses: Presses
) -> tuple[Differentiated, NDArray[np.bool_], NDArray[np.bool_]]:
    """F (rows,) [N] at depths δ [m], where there is contact, and where that lies within the layer's reach.

    `spheres` (recordings,): without a stage. The last variable must be free (Sphere).
    """
    assert spheres.curve.relaxation is not None
    fraction, tau = spheres.curve.relaxation
    least, lowest = (limit[presses.recording] for limit in spheres.pull_off())
    sphere = spheres.rows(presses.recording)
    depth = depth.spread(len(presses.started))
    held = presses.started & (depth.value > lowest)
    elastic, inside = sphere.at_travel(depth, held, least)
    fresh = presses.begins | ~presses.started
    memory = faded(depth, presses.time, fresh, tau)
    history = _History(depth, presses.time, memory, elastic.stretch, fraction, tau)
    force_memory = faded(elastic.force, presses.time, fresh, tau)
    force = (1.0 - fraction) * elastic.force + fraction * force_memory
    after, short = _last_held(history, presses)
    now = np.flatnonzero(presses.started & (after >= 0) & ((after < np.arange(len(after))) | short))
    if len(now):
        share = _shares(history, after[now], now, short[now])
        ring = history.ring(after[now], share)
        at, reached = sphere.rows(now).at_travel(ring.depth, ring.depth.value > lowest[now], least[now])
        older = elastic.force[after[now]]
        kept = exp(-ring.since) * force_memory[after[now]] + lagging(ring.since) * (at.force - older)
        receded = (1.0 - fraction) * at.force + fraction * history.kept(ring.time, now) * kept
        force = _put(force, now, receded + at.stiffness * history.carried(ring, now))
        inside[now] = reached
    now = np.flatnonzero(presses.started & (after < 0))
    held[now] = False
    begin = np.maximum.accumulate(np.where(presses.begins, np.arange(len(after)), 0))
    adhesive = spheres.curve.work_of_adhesion is not None
    if len(now) and (adhesive or (depth.value[presses.begins] > 0).any()):
        left, at, holds, reached = _first_touch(sphere.rows(now), history, begin[now], now)
        force = _put(force, now, left * at.force)
        held[now], inside[now] = holds, reached
    return where(held, force, 0.0), held, inside


def _last_held(history: _History, presses: Presses) -> tuple[Rows, NDArray[np.bool_]]:
    """The sample after which the outermost ring in contact was reached, −1 for the first touch, and whether beyond it.

    A ring is reached at a sample deeper than all before. Where the outermost such ring so far still holds, the edge is
    that ring; otherwise it lies between two samples.
    """
    fraction, tau = float(history.fraction.value[0]), float(history.tau.value[0])
    depth, time, memory = (x.value for x in (history.depth, history.time, history.memory))
    stretch = np.zeros_like(depth) if history.stretch is None else history.stretch.value
    after, short = np.full(len(depth), -1), np.zeros(len(depth), dtype=bool)
    for number in range(int(presses.recording[-1]) + 1):
        rows = np.flatnonzero(presses.started & (presses.recording == number))
        if not len(rows):
            continue
        rings = rows[depth[rows] >= np.maximum.accumulate(depth[rows])]
        outermost = np.searchsorted(rings, rows, side="right") - 1
        back = np.flatnonzero(rings[outermost] != rows)
        after[rows] = rows
        now = rows[back][:, None]
        kept = np.exp(-np.maximum(time[now] - time[rings], 0.0) / tau)
        excess = (1 - fraction) * (depth[now] - depth[rings]) + fraction * (memory[now] - kept * memory[rings])
        excess += stretch[rings] * fraction * (1 - kept)
        holds = (excess >= 0) & (rings <= now)
        last = np.where(holds.any(axis=1), len(rings) - 1 - np.argmax(holds[:, ::-1], axis=1), -1)
        between = (last >= 0) & (last < outermost[back])
        following = rings[np.minimum(last + 1, len(rings) - 1)] - 1
        after[rows[back]] = np.where(last < 0, -1, np.where(between, following, rings[np.maximum(last, 0)]))
        short[rows[back]] = between
    return after, short


def _shares(history: _History, after: Rows, now: Rows, short: NDArray[np.bool_]) -> Differentiated:
    """Where between two samples the ring at the edge was reached; 0, at the sample, where not `short` of the next."""
    share = Differentiated(np.zeros(len(now)), np.zeros((len(history.depth.slopes), len(now))))
    after, now = after[short], now[short]
    if not len(now):
        return share
    still, one = history.fixed(), np.ones((1, len(now)))
    low, high = np.zeros(len(now)), np.ones(len(now))
    value = 0.5 * (low + high)
    for _ in range(_STEPS):
        excess = still.excess(still.ring(after, Differentiated(value, one)), now)
        low, high = np.where(excess.value >= 0, value, low), np.where(excess.value < 0, value, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            tried = value - excess.value / excess.slopes[0]
        tried = np.where((tried >= low) & (tried <= high), tried, 0.5 * (low + high))
        done = np.abs(tried - value) < _TOLERANCE
        value = tried
        if done.all():
            break
    slopes = np.zeros((len(share.slopes), len(now)))
    slopes[-1] = 1.0
    excess = history.excess(history.ring(after, Differentiated(value, slopes)), now)
    held = excess.slopes[-1] == 0  # through a hold every ring is the same
    slopes = np.where(held, 0.0, -excess.slopes / np.where(held, 1.0, excess.slopes[-1]))
    slopes[-1] = 0.0
    share.value[short], share.slopes[:, short] = value, slopes
    return share


def _first_touch(
    sphere: Sphere, history: _History, begin: Rows, now: Rows
) -> tuple[Differentiated, ContactAt, NDArray[np.bool_], NDArray[np.bool_]]:
    """e, and the elastic contact that stands for what is left of the first touch; whether it holds, is within reach."""
    fraction, work = history.fraction, sphere.curve.work_of_adhesion
    left = 1.0 - fraction + fraction * history.kept(history.time[begin], now)
    if work is not None:
        sphere = replace(sphere, curve=replace(sphere.curve, work_of_adhesion=work / (left * left)))
    least, lowest = sphere.pull_off()
    depth = ((1.0 - fraction) * history.depth[now] + fraction * history.memory[now]) / left
    holds = depth.value > lowest
    at, inside = sphere.at_travel(depth, holds, least)
    return left, at, holds, inside


def _put(force: Differentiated, rows: Rows, new: Differentiated) -> Differentiated:
    value, slopes = force.value.copy(), force.slopes.copy()
    value[rows], slopes[:, rows] = new.value, new.slopes
    return Differentiated(value, slopes)
