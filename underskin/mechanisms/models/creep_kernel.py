"""Compiled: fading memories, and the edge of a contact that recedes on a body that relaxes; see creeping_contact.

Arrays are (points, curves, samples), memories with the pairs on a last axis; g and τ are (points, pairs).
"""

import math

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats, Indices, Mask

_SERIES = 1e-3
_SECANTS, _SETTLED = 12, 1e-9  # of the edge's place between two samples

Pairs = tuple[Floats, Floats]  # g and τ
Now = tuple[float, float, Floats]  # depth, time, memory of depths
Rings = tuple[Floats, Floats, Floats, Floats, Floats]  # depth, time, memory of depths, ℓ and ℓ_s of each sample

_ROWS = "float64[:, :, ::1]"
_MEMORY = "float64[:, :, :, ::1]"
_PAIRS = "float64[:, ::1], float64[:, ::1]"


@compiled()
def _lagging(x: float) -> float:
    """(1 − e^(−x))/x: what is left of a steady change at its end, x of its duration over τ."""
    return 1 - x / 2 + x**2 / 6 if x < _SERIES else -math.expm1(-x) / x


@compiled(f"void({_ROWS}, {_ROWS}, float64[:, ::1], {_MEMORY})")
def memory_rows(history: Floats, time: Floats, times: Floats, memory: Floats) -> None:
    """Fill Y = ∫ e^(−(t−s)/τ) du(s) of histories u, straight between samples; what u is at the first came at once."""
    points, curves, samples = history.shape
    for point in range(points):
        for curve in range(curves):
            u, t, own = history[point, curve], time[point, curve], memory[point, curve]
            for pair in range(times.shape[1]):
                own[0, pair] = u[0]
                for sample in range(1, samples):
                    x = max(t[sample] - t[sample - 1], 0.0) / times[point, pair]
                    step = _lagging(x) * (u[sample] - u[sample - 1])
                    own[sample, pair] = math.exp(-x) * own[sample - 1, pair] + step


@compiled()
def _carried(depth: float, time: float, memory: Floats, pairs: Pairs, now: Now) -> tuple[float, float]:
    """H(s,t) of a ring that was reached at a depth and time, with the memory of depths then, and e(t−s)."""
    age = max(now[1] - time, 0.0)
    carried, remaining = now[0] - depth, 1.0
    for pair in range(len(pairs[0])):
        fraction, decay = pairs[0][pair], math.exp(-age / pairs[1][pair])
        carried += fraction * (now[2][pair] - decay * memory[pair] - now[0] + depth)
        remaining -= fraction * (1.0 - decay)
    return carried, remaining


@compiled()
def _excess(ring: int, rings: Rings, pairs: Pairs, now: Now) -> float:
    """H(s,t) + ℓ_s − ℓ e(t−s) of a ring, above 0 where it holds."""
    depth, time, memory, slack, parting = rings
    carried, remaining = _carried(depth[ring], time[ring], memory[ring], pairs, now)
    return float(carried + parting[ring] - slack[ring] * remaining)


@compiled()
def _between(low: int, high: int, share: float, rings: Rings, pairs: Pairs, memory: Floats) -> None:
    """Fill the memory of depths of a ring that was reached at a share of the way between two samples."""
    for pair in range(len(memory)):
        x = share * max(rings[1][high] - rings[1][low], 0.0) / pairs[1][pair]
        change = share * (rings[0][high] - rings[0][low])
        memory[pair] = math.exp(-x) * rings[2][low, pair] + _lagging(x) * change


@compiled()
def _last_sample(low: int, high: int, record: Indices, rings: Rings, pairs: Pairs, now: Now) -> int:
    """The last of the samples from `low`, which holds, to `high` that does."""
    if _excess(high, rings, pairs, now) >= 0:
        return high
    while high - low > 1:
        middle = (low + high) // 2
        # What was reached between two records was not deeper than the first of them.
        if _excess(record[middle], rings, pairs, now) >= 0:
            low = middle
        else:
            high = middle
    return low


@compiled()
def _share(low: int, high: int, rings: Rings, pairs: Pairs, now: Now, memory: Floats) -> float:
    """The share of the way between two samples up to which rings hold: regula falsi, the end that stays halved."""
    depth, time, _, slack, parting = rings
    at_near, at_far = _excess(low, rings, pairs, now), _excess(high, rings, pairs, now)
    inner, outer, share = 0.0, 1.0, 0.0
    for _ in range(_SECANTS):
        fall = at_near - at_far
        tried = min(max(inner + (outer - inner) * at_near / fall, 0.0), 1.0) if fall > 0 else 0.0
        settled = abs(tried - share) < _SETTLED
        share = tried
        if settled:
            break
        _between(low, high, share, rings, pairs, memory)
        place = depth[low] + share * (depth[high] - depth[low])
        carried, remaining = _carried(place, time[low] + share * (time[high] - time[low]), memory, pairs, now)
        stretch = parting[low] + share * (parting[high] - parting[low])
        value = carried + stretch - (slack[low] + share * (slack[high] - slack[low])) * remaining
        if value >= 0:
            inner, at_near, at_far = share, value, 0.5 * at_far
        else:
            outer, at_far, at_near = share, value, 0.5 * at_near
    return share


@compiled(
    f"void({_ROWS}, {_ROWS}, {_MEMORY}, {_ROWS}, {_ROWS}, {_ROWS}, {_MEMORY}, int64[:, :, ::1], int64[:, ::1], "
    f"{_PAIRS}, {_ROWS}, {_ROWS}, {_ROWS}, boolean[:, :, ::1])"
)
def edge_rows(
    depth: Floats,
    time: Floats,
    depth_memory: Floats,
    slack: Floats,
    parting: Floats,
    force: Floats,
    force_memory: Floats,
    record: Indices,
    begins: Indices,
    fractions: Floats,
    times: Floats,
    edge: Floats,
    carried: Floats,
    kept: Floats,
    stuck: Mask,
) -> None:
    """Of samples after the last deeper one (`record`) fill whether any ring holds, and of the outermost that does the
    depth δ it was reached at, H(s,t), and Σ g e^(−(t−s)/τ) Y of the force then.

    Rings let go one after another from the outermost; the one about to lies between two samples.
    """
    points, curves, samples = depth.shape
    memory = np.empty(fractions.shape[1])
    for point in range(points):
        pairs = fractions[point], times[point]
        for curve in range(curves):
            here = point, curve
            rings = depth[here], time[here], depth_memory[here], slack[here], parting[here]
            first = begins[here]
            for sample in range(first, samples):
                high = record[point, curve, sample]
                now = depth[point, curve, sample], time[point, curve, sample], depth_memory[point, curve, sample]
                if high == sample or not _excess(first, rings, pairs, now) >= 0:
                    continue
                low = _last_sample(first, high, record[here], rings, pairs, now)
                high = min(low + 1, high)
                share = _share(low, high, rings, pairs, now, memory) if high > low else 0.0
                _between(low, high, share, rings, pairs, memory)
                place = rings[0][low] + share * (rings[0][high] - rings[0][low])
                reached = rings[1][low] + share * (rings[1][high] - rings[1][low])
                stuck[point, curve, sample] = True
                edge[point, curve, sample] = place
                carried[point, curve, sample] = _carried(place, reached, memory, pairs, now)[0]
                of_force = force[here], time[here], force_memory[here], slack[here], parting[here]
                _between(low, high, share, of_force, pairs, memory)
                total = 0.0
                for pair in range(len(memory)):
                    age = max(now[1] - reached, 0.0)
                    total += pairs[0][pair] * math.exp(-age / pairs[1][pair]) * memory[pair]
                kept[point, curve, sample] = total
