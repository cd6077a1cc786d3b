"""Compiled functions for the contact of a sphere: force and depth by the contact radius, and the radius at a travel.

Arrays are (points, curves, samples); equations are in sphere_contact. A `body` (points, curves, samples or 1, 9)
holds the reduced modulus E', the sphere's radius R, 1/k of the stage, the layer's thickness h (0: half space), of
stiffening c (−1: none), q and m, 1 for deep indentation (else 0), and the share of the finite-strain correction.
`cubics` (layers, cells, powers, 7) are a layer's four ratios and the three coefficients of that correction over a/h
from 0 to `LARGEST_A_OVER_H`, highest power first, of each point or one for all; a half space has one cell.

Also fading memories, and the edge of a receding contact on a relaxing body: memories have the Prony pairs on a last
axis; g and τ are (points, pairs).
"""

import math

import numpy as np

from underskin.compiled import compiled
from underskin.physics.elastic_layer import LARGEST_A_OVER_H
from underskin.physics.sphere_law import FULL_SPHERE_OF_LOAD, LOAD_OF_REDUCED
from underskin.units import Floats, Indices, Mask

_STRAIN, _LARGEST_STRAIN = 0.2, 0.9  # representative strain over a/R, and its upper limit
_EXPONENTIAL = 1e-6  # |q| below which the stiffening is exponential
_LARGEST_RATIO = math.log(100.0)  # of stiffening: Gent's law ends at its limit
_STEPS = 60
_TOLERANCE = 3e-7  # of the contact radius, of the last step: the remaining error is about its square
_NO_CONTACT = 1e-15  # m, the radius without contact
_EQUATOR, _PARABOLIC = 0.9995, 0.02  # a/R beyond which a contact grows no more, and below which a series is exact
_LARGEST_CORRECTION = 0.25  # of a tangent's step, by which curvature may correct the next start
LARGEST_CBRT_LOAD = 0.15 ** (1 / 3)  # L^(1/3) beyond which the correction is constant

Constants = tuple[float, float, float, float, float, float, float, float, float]  # the nine numbers of a body
Four = tuple[float, float, float, float]

_ROWS = "float64[:, :, ::1]"
_BODY = "float64[:, :, :, ::1], float64[:, :, :, ::1]"


@compiled()
def _stiffened(strain: float, coefficient: float, form: float, exponent: float) -> tuple[float, float]:
    """Nominal stress at a compressive strain over that of a neo-Hookean solid, and the slope of its logarithm.

    (1 + q c J)^(1/q), J = 3 (I/3)^(m/2) of the invariant I = I1 − 3.
    """
    strain = max(strain, 1e-9)
    stretch = 1.0 - strain
    stress = 1.0 / stretch**2 - stretch
    third = max(stretch * stretch + 2.0 / stretch - 3.0, 1e-18) / 3.0
    excess = 3.0 * coefficient * third ** (0.5 * exponent)
    slope = excess * exponent * stress / (3.0 * third)
    logarithm = excess
    if abs(form) >= _EXPONENTIAL:
        total = max(1.0 + form * excess, 1e-9)
        logarithm = math.log(total) / form
        slope /= total
    if logarithm > _LARGEST_RATIO:
        logarithm, slope = _LARGEST_RATIO, 0.0
    return math.exp(logarithm), slope


@compiled()
def _constants(body: Floats, point: int, curve: int, sample: int) -> Constants:
    values = body[point, curve, min(sample, body.shape[2] - 1)]
    return values[0], values[1], values[2], values[3], values[4], values[5], values[6], values[7], values[8]


@compiled()
def _deep_sphere(a: float, radius: float) -> tuple[float, float, float]:
    """F/E', δ and dδ/da of a sphere in deep indentation (Sneddon 1965): δ = a artanh(a/R), dF = 2E'a dδ.

    Near a = R the depth is continued linearly: no contact is wider.
    """
    x = min(a / radius, _EQUATOR)
    if x < _PARABOLIC:
        square = x * x
        depth, slope = radius * square * (1.0 + square / 3.0), 2.0 * x * (1.0 + 2.0 * square / 3.0)
        return 4.0 / 3.0 * radius**2 * x * square * (1.0 + 0.4 * square), depth, slope
    turned = math.atanh(x)
    slope = turned + x / (1.0 - x * x)
    beyond = a - x * radius
    force = radius**2 * ((1.0 + x * x) * turned - x) + 2.0 * x * radius * slope * beyond
    return force, radius * x * turned + slope * beyond, slope


@compiled()
def _strain_ratio(
    load: float, by_load: float, deep: float, cubics: Floats, u: float, per_h: float
) -> tuple[float, float]:
    """δ of the solved contact over the linear one's at the same force, less 1, and its derivative by a.

    x (p0 + p1 x + p2 x²) with x = L^(1/3) of the `load` L, d ln L/da = `by_load`; each p is a cubic over a/h.
    """
    x = min(load ** (1 / 3), LARGEST_CBRT_LOAD)
    by_x = by_load * x / 3.0 if x < LARGEST_CBRT_LOAD else 0.0
    c3, c2, c1, c0 = cubics[0], cubics[1], cubics[2], cubics[3]
    p0 = ((c3[4] * u + c2[4]) * u + c1[4]) * u + c0[4]
    p1 = ((c3[5] * u + c2[5]) * u + c1[5]) * u + c0[5] - deep * FULL_SPHERE_OF_LOAD
    p2 = ((c3[6] * u + c2[6]) * u + c1[6]) * u + c0[6]
    by_p0 = (3.0 * c3[4] * u + 2.0 * c2[4]) * u + c1[4]
    by_p1 = (3.0 * c3[5] * u + 2.0 * c2[5]) * u + c1[5]
    by_p2 = (3.0 * c3[6] * u + 2.0 * c2[6]) * u + c1[6]
    ratio = x * (p0 + x * (p1 + x * p2))
    by_a = (p0 + x * (2.0 * p1 + 3.0 * x * p2)) * by_x + x * (by_p0 + x * (by_p1 + x * by_p2)) * per_h
    return ratio, by_a


@compiled()
def _contact(a: float, constants: Constants, cubics: Floats) -> tuple[Four, Four]:
    """F, δ and K without adhesion at the radius a, and ℓ/√w of the adhesive stretch; and their logarithms' derivatives
    by a."""
    modulus, radius, _, thickness, coefficient, form, exponent, deep, share = constants
    cell, u, per_h, log_modulus_slope, inverse = 0, 0.0, 0.0, 0.0, 1.0 / a
    if coefficient >= 0:
        strain = _STRAIN * a / radius
        ratio, slope = _stiffened(min(strain, _LARGEST_STRAIN), coefficient, form, exponent)
        modulus *= ratio
        log_modulus_slope = slope * _STRAIN / radius if strain < _LARGEST_STRAIN else 0.0
    depth, stiffness = a * a / radius, 2.0 * modulus * a
    force, stretch = 2.0 / 3.0 * stiffness * depth, math.sqrt(2.0 * math.pi * a / modulus)
    by_force, by_depth, by_stiffness = 3.0 * inverse + log_modulus_slope, 2.0 * inverse, inverse + log_modulus_slope
    by_stretch = 0.5 * (inverse - log_modulus_slope)
    if deep > 0:
        force, depth, slope = _deep_sphere(a, radius)
        force, by_force, by_depth = (
            modulus * force,
            stiffness * slope / (modulus * force) + log_modulus_slope,
            slope / depth,
        )
    if thickness > 0:
        cells = cubics.shape[0]
        position = min(a / thickness, LARGEST_A_OVER_H) * cells / LARGEST_A_OVER_H
        cell = min(int(position), cells - 1)
        u = (position - cell) * LARGEST_A_OVER_H / cells
        per_h = 1.0 / thickness if position < cells else 0.0
        c3, c2, c1, c0 = cubics[cell, 0], cubics[cell, 1], cubics[cell, 2], cubics[cell, 3]
        of_force = ((c3[0] * u + c2[0]) * u + c1[0]) * u + c0[0]
        of_depth = ((c3[1] * u + c2[1]) * u + c1[1]) * u + c0[1]
        of_stiffness = ((c3[2] * u + c2[2]) * u + c1[2]) * u + c0[2]
        of_stretch = ((c3[3] * u + c2[3]) * u + c1[3]) * u + c0[3]
        by_force += ((3.0 * c3[0] * u + 2.0 * c2[0]) * u + c1[0]) / of_force * per_h
        by_depth += ((3.0 * c3[1] * u + 2.0 * c2[1]) * u + c1[1]) / of_depth * per_h
        by_stiffness += ((3.0 * c3[2] * u + 2.0 * c2[2]) * u + c1[2]) / of_stiffness * per_h
        by_stretch += ((3.0 * c3[3] * u + 2.0 * c2[3]) * u + c1[3]) / of_stretch * per_h
        force, depth, stiffness, stretch = (
            force * of_force,
            depth * of_depth,
            stiffness * of_stiffness,
            stretch * of_stretch,
        )
    if share != 0:
        ratio, by_a = _strain_ratio(
            LOAD_OF_REDUCED * force / (modulus * radius**2), by_force - log_modulus_slope, deep, cubics[cell], u, per_h
        )
        total = 1.0 + share * ratio
        depth, by_depth = depth * total, by_depth + share * by_a / total
    return (force, depth, stiffness, stretch), (by_force, by_depth, by_stiffness, by_stretch)


@compiled()
def _travel(a: float, root_work: float, constants: Constants, cubics: Floats) -> tuple[float, float]:
    """δ + F/k in equilibrium, where δ and F fall by ℓ and K ℓ, and its derivative by a."""
    (force, depth, stiffness, unit), (by_force, by_depth, by_stiffness, by_stretch) = _contact(a, constants, cubics)
    stretch = unit * root_work
    lost = stiffness * stretch
    travel = depth - stretch + constants[2] * (force - lost)
    of_force = force * by_force - lost * (by_stiffness + by_stretch)
    return travel, depth * by_depth - stretch * by_stretch + constants[2] * of_force


@compiled()
def _solved(target: float, start: float, lowest: float, root_work: float, constants: Constants, cubics: Floats) -> Four:
    """The radius, not below `lowest`, at which the travel is `aim`; and the last tangent: its radius, travel and slope.

    Newton steps, and halvings where one leaves the current bracket.
    """
    radius, below, above, bounded = start, lowest, math.inf, False
    touching = at_touching = slope = 0.0
    for _ in range(_STEPS):
        touching = radius
        at_touching, slope = _travel(radius, root_work, constants, cubics)
        if at_touching > target:
            above = radius
        else:
            below, bounded = radius, True
        step = (at_touching - target) / slope if slope > 0 else 0.5 * radius
        radius = max(radius - min(max(step, -radius), 0.9 * radius), lowest)
        if slope > 0 and abs(radius - touching) <= _TOLERANCE * touching:
            break
        if radius >= above or (bounded and radius <= below):
            radius = 0.5 * (below + above) if above < math.inf else 2 * touching
            if above - below <= _TOLERANCE * above:
                break
    return radius, touching, at_touching, slope


@compiled(f"void({_ROWS}, {_BODY}, float64[:, :, :, ::1])")
def contact_rows(a: Floats, body: Floats, cubics: Floats, contact: Floats) -> None:
    """Fill F, δ, K and ℓ/√w (4, points, curves, samples) at radii a."""
    points, curves, samples = a.shape
    for point in range(points):
        layer = cubics[min(point, len(cubics) - 1)]
        for curve in range(curves):
            for sample in range(samples):
                here, _ = _contact(a[point, curve, sample], _constants(body, point, curve, sample), layer)
                for number in range(4):
                    contact[number, point, curve, sample] = here[number]


@compiled(f"void({_ROWS}, {_ROWS}, {_ROWS}, {_ROWS}, {_BODY})")
def radius_rows(travel: Floats, work: Floats, least: Floats, a: Floats, body: Floats, cubics: Floats) -> None:
    """Solve travel(a) = travel by Newton steps from radii `a` above, in place.

    `work` and `least`, the lower bound of the radius, are (points, curves, samples or 1). The parabola through the
    last two samples' tangents gives a start for the next from which one step is mostly enough.
    """
    points, curves, samples = travel.shape
    is_uniform = work.shape[2] == 1 and body.shape[2] == 1
    for point in range(points):
        layer = cubics[min(point, len(cubics) - 1)]
        for curve in range(curves):
            constants, root_work = _constants(body, point, curve, 0), math.sqrt(work[point, curve, 0])
            touching, at_touching, slope, curvature = 0.0, 0.0, 0.0, 0.0
            for sample in range(samples):
                if not is_uniform:
                    constants = _constants(body, point, curve, sample)
                    root_work = math.sqrt(work[point, curve, min(sample, work.shape[2] - 1)])
                lowest = least[point, curve, min(sample, least.shape[2] - 1)]
                target, radius = travel[point, curve, sample], a[point, curve, sample]
                if root_work == 0 and target <= 0:  # not in contact, where Newton's steps would shrink without end
                    a[point, curve, sample], slope = max(lowest, _NO_CONTACT), 0.0
                    continue
                if is_uniform and slope > 0:
                    tangent = (target - at_touching) / slope
                    correction = 0.5 * curvature * tangent / slope
                    radius = min(
                        radius,
                        touching + tangent * (1.0 - min(max(correction, -_LARGEST_CORRECTION), _LARGEST_CORRECTION)),
                    )
                before, former = touching, slope
                radius, touching, at_touching, slope = _solved(
                    target, max(radius, lowest), lowest, root_work, constants, layer
                )
                curvature = (slope - former) / (touching - before) if former > 0 and touching != before else 0.0
                a[point, curve, sample] = radius


@compiled()
def _least_travel(low: float, high: float, root_work: float, constants: Constants, cubics: Floats) -> float:
    """The radius between two at which the slope of the travel is 0; the nearer bound where it does not change sign.

    Regula falsi (Illinois) of slope √a over a^(3/2), which is linear for JKR's contact with a half space.
    """
    below, above = low**1.5, high**1.5
    at_below = _travel(low, root_work, constants, cubics)[1] * math.sqrt(low)
    at_above = _travel(high, root_work, constants, cubics)[1] * math.sqrt(high)
    if at_below >= 0:
        return low
    if at_above <= 0:
        return high
    radius, before = high, 0.0
    for _ in range(_STEPS):
        power = (below * at_above - above * at_below) / (at_above - at_below)
        radius, before = power ** (2 / 3), radius
        if abs(radius - before) <= _TOLERANCE * radius:
            break
        scaled_slope = _travel(radius, root_work, constants, cubics)[1] * math.sqrt(radius)
        if scaled_slope > 0:
            above, at_above, at_below = power, scaled_slope, 0.5 * at_below
        else:
            below, at_below, at_above = power, scaled_slope, 0.5 * at_above
    return radius


@compiled(f"void({_ROWS}, {_BODY}, {_ROWS}, {_ROWS})")
def pull_off_rows(work: Floats, body: Floats, cubics: Floats, radius: Floats, travel: Floats) -> None:
    """Fill the radius and the travel at which the equilibrium travel is least."""
    points, curves, samples = radius.shape
    for point in range(points):
        layer = cubics[min(point, len(cubics) - 1)]
        for curve in range(curves):
            for sample in range(samples):
                constants = _constants(body, point, curve, sample)
                root_work = math.sqrt(work[point, curve, sample])
                unit = (2.0 * math.pi * root_work**2 * constants[1] ** 2 / constants[0]) ** (1 / 3)
                low, high, thickness = 0.02 * unit, 4.0 * unit, constants[3]
                if thickness > 0:
                    low, high = min(low, 0.1 * LARGEST_A_OVER_H * thickness), min(high, LARGEST_A_OVER_H * thickness)
                high = _least_travel(low, high, root_work, constants, layer) if low < high else high
                radius[point, curve, sample] = high
                travel[point, curve, sample] = _travel(high, root_work, constants, layer)[0]


@compiled(f"void({_ROWS}, {_ROWS}, boolean[:, :, ::1], {_ROWS})")
def edge_rows(advancing: Floats, receding: Floats, contact_mask: Mask, a: Floats) -> None:
    """Fill the radius of an edge that advances to `advancing`, recedes to `receding`, and rests in between; it restarts
    after a sample out of contact."""
    points, curves, samples = a.shape
    for point in range(points):
        for curve in range(curves):
            edge = 0.0
            for sample in range(samples):
                forward = advancing[point, curve, sample]
                if contact_mask[point, curve, sample] and edge > 0:
                    edge = min(max(edge, forward), receding[point, curve, sample])
                else:
                    edge = forward
                a[point, curve, sample] = edge
                if not contact_mask[point, curve, sample]:
                    edge = 0.0


_SECANTS, _SETTLED = (
    12,
    1e-4,
)  # steps to the edge's place between two samples, and the last one, whose error is far less
_SAME_INTERVAL = 1e-9  # relative, of clocks whose steps differ by rounding

Pairs = tuple[Floats, Floats, int, Floats]  # g and τ, the length of the series, and room for e^(−t/τ) − 1
Now = tuple[float, float, Floats]  # depth, time, memory of depths
Rings = tuple[Floats, Floats, Floats, Floats, Floats]  # depth, time, memory of depths, ℓ and ℓ_s of each sample

_MEMORY = "float64[:, :, :, ::1]"
_PAIRS = "float64[:, ::1], float64[:, ::1], int64"


@compiled()
def _fill_losses(age: float, pairs: Pairs) -> Floats:
    """e^(−age/τ) − 1 of all pairs, exact to rounding, with one exponential for each single pair and one for the series.

    Single pairs come first, then a `series` whose times fall by a factor of 4 each, then the products of every single
    pair with the whole series, whose rates add.
    """
    _, times, series, losses = pairs
    singles = (len(times) - series) // (1 + series)
    for pair in range(singles + min(series, 1)):
        losses[pair] = math.expm1(-age / times[pair])
    for pair in range(singles + 1, singles + series):
        twice = losses[pair - 1] * (2.0 + losses[pair - 1])
        losses[pair] = twice * (2.0 + twice)
    product = singles + series
    for single in range(singles if series > 0 else 0):
        loss = losses[single]
        for pair in range(singles, singles + series):
            losses[product] = loss + losses[pair] * (1.0 + loss)
            product += 1
    return losses


@compiled()
def _lagging(loss: float, duration: float, time: float) -> float:
    """(1 − e^(−x))/x: the remaining fraction of a steady change at its end, x its duration over τ."""
    return -loss * time / duration if duration > 0.0 else 1.0


@compiled(f"void({_ROWS}, {_ROWS}, {_PAIRS}, {_MEMORY})")
def memory_rows(history: Floats, time: Floats, fractions: Floats, times: Floats, series: int, memory: Floats) -> None:
    """Fill Y = ∫ e^(−(t−s)/τ) du(s) of histories u, linear between samples; u at the first sample is a step."""
    points, curves, samples = history.shape
    count = times.shape[1]
    losses, lagging = np.zeros(count), np.zeros(count)
    for point in range(points):
        of_pairs = times[point]
        pairs = fractions[point], of_pairs, series, losses
        for curve in range(curves):
            u, t, memories = history[point, curve], time[point, curve], memory[point, curve]
            interval = -1.0
            for pair in range(count):
                memories[0, pair] = u[0]
            for sample in range(1, samples):
                passed = max(t[sample] - t[sample - 1], 0.0)
                if abs(passed - interval) > _SAME_INTERVAL * passed:
                    interval = passed
                    _fill_losses(passed, pairs)
                    for pair in range(count):
                        lagging[pair] = _lagging(losses[pair], passed, of_pairs[pair])
                step = u[sample] - u[sample - 1]
                for pair in range(count):
                    before = memories[sample - 1, pair]
                    memories[sample, pair] = before + losses[pair] * before + lagging[pair] * step


@compiled()
def _relaxed_depth(depth: float, time: float, memory: Floats, pairs: Pairs, now: Now) -> tuple[float, float]:
    """H(s,t) of a ring reached at a depth and time, with the memory of depths then, and e(t−s)."""
    losses = _fill_losses(max(now[1] - time, 0.0), pairs)
    beyond, remaining = now[0] - depth, 1.0
    relaxed_depth = beyond
    for pair in range(len(losses)):
        fraction, loss = pairs[0][pair], losses[pair]
        relaxed_depth += fraction * (now[2][pair] - memory[pair] - loss * memory[pair] - beyond)
        remaining += fraction * loss
    return relaxed_depth, remaining


@compiled()
def _excess(ring: int, rings: Rings, pairs: Pairs, now: Now) -> float:
    """H(s,t) + ℓ_s − ℓ e(t−s) of a ring: at least 0 while it holds."""
    depth, time, memory, advancing_stretch, receding_stretch = rings
    relaxed_depth, remaining = _relaxed_depth(depth[ring], time[ring], memory[ring], pairs, now)
    return float(relaxed_depth + receding_stretch[ring] - advancing_stretch[ring] * remaining)


@compiled()
def _between(low: int, high: int, share: float, rings: Rings, pairs: Pairs, memory: Floats) -> None:
    """Fill the memory of depths for a ring reached at a fraction `share` of the way between two samples."""
    passed = share * max(rings[1][high] - rings[1][low], 0.0)
    change = share * (rings[0][high] - rings[0][low])
    losses = _fill_losses(passed, pairs)
    for pair in range(len(memory)):
        before = rings[2][low, pair]
        memory[pair] = before + losses[pair] * before + _lagging(losses[pair], passed, pairs[1][pair]) * change


@compiled()
def _last_sample(
    first: int, high: int, near: int, record: Indices, rings: Rings, pairs: Pairs, now: Now
) -> tuple[int, float, float]:
    """The last of the samples from `first` to `high` whose ring holds, searched from a sample `near` it in ever longer
    steps and then by halving, and the excesses there and at the next sample; −1 where not even the first one does.

    What was reached between two records was not deeper than the first of them.
    """
    step, at_low, at_beyond = 1, 0.0, -1.0
    at_near = _excess(record[near], rings, pairs, now)
    if at_near >= 0:
        low, at_low, beyond = near, at_near, near + step
        while beyond <= high:
            at_beyond = _excess(record[beyond], rings, pairs, now)
            if at_beyond < 0:
                break
            step *= 2
            low, at_low, beyond = beyond, at_beyond, min(beyond + step, max(high, beyond + 1))
        beyond = min(beyond, high + 1)
    else:
        low, beyond, at_beyond = near - step, near, at_near
        while low > first:
            at_low = _excess(record[low], rings, pairs, now)
            if at_low >= 0:
                break
            step *= 2
            low, beyond, at_beyond = low - step, low, at_low
        if low <= first:
            at_low = _excess(first, rings, pairs, now)
            if beyond <= first or not at_low >= 0:
                return -1, 0.0, 0.0
            low = first
    while beyond - low > 1:
        middle = (low + beyond) // 2
        at_middle = _excess(record[middle], rings, pairs, now)
        if at_middle >= 0:
            low, at_low = middle, at_middle
        else:
            beyond, at_beyond = middle, at_middle
    return low, at_low, at_beyond


@compiled()
def _share(
    low: int, high: int, at_low: float, at_high: float, rings: Rings, pairs: Pairs, now: Now, memory: Floats
) -> float:
    """The fraction of the way between two samples up to which rings hold, by the excesses at both (regula falsi,
    Illinois)."""
    depth, time, _, advancing_stretch, receding_stretch = rings
    inner, outer, share, at_near, at_far = 0.0, 1.0, 0.0, at_low, at_high
    for _ in range(_SECANTS):
        fall = at_near - at_far
        tried = min(max(inner + (outer - inner) * at_near / fall, 0.0), 1.0) if fall > 0 else 0.0
        settled = abs(tried - share) < _SETTLED
        share = tried
        if settled:
            break
        _between(low, high, share, rings, pairs, memory)
        position = depth[low] + share * (depth[high] - depth[low])
        relaxed_depth, remaining = _relaxed_depth(
            position, time[low] + share * (time[high] - time[low]), memory, pairs, now
        )
        stretch = receding_stretch[low] + share * (receding_stretch[high] - receding_stretch[low])
        value = (
            relaxed_depth
            + stretch
            - (advancing_stretch[low] + share * (advancing_stretch[high] - advancing_stretch[low])) * remaining
        )
        if value >= 0:
            inner, at_near, at_far = share, value, 0.5 * at_far
        else:
            outer, at_far, at_near = share, value, 0.5 * at_near
    return share


@compiled(
    f"void({_ROWS}, {_ROWS}, {_MEMORY}, {_ROWS}, {_ROWS}, {_ROWS}, {_MEMORY}, int64[:, :, ::1], int64[:, ::1], "
    f"{_PAIRS}, {_ROWS}, {_ROWS}, {_ROWS}, boolean[:, :, ::1])"
)
def creep_edge_rows(
    depth: Floats,
    time: Floats,
    depth_memory: Floats,
    advancing_stretch: Floats,
    receding_stretch: Floats,
    force: Floats,
    force_memory: Floats,
    record: Indices,
    first_contact: Indices,
    fractions: Floats,
    times: Floats,
    series: int,
    edge: Floats,
    relaxed_depth: Floats,
    memory_force: Floats,
    stuck: Mask,
) -> None:
    """For samples after the last deeper one (`record`) fill whether any ring holds, and of the outermost ring that does
    the depth δ at which it was reached, H(s,t), and Σ g e^(−(t−s)/τ) Y of the force then.

    Rings let go one after another from the outermost; the next one lies between two samples.
    """
    points, curves, samples = depth.shape
    memory, room = np.empty(fractions.shape[1]), np.empty(fractions.shape[1])
    for point in range(points):
        pairs = fractions[point], times[point], series, room
        for curve in range(curves):
            here = point, curve
            rings = depth[here], time[here], depth_memory[here], advancing_stretch[here], receding_stretch[here]
            first, low = first_contact[here], samples
            for sample in range(first, samples):
                high = record[point, curve, sample]
                now = depth[point, curve, sample], time[point, curve, sample], depth_memory[point, curve, sample]
                if high == sample:
                    low = sample
                    continue
                near = min(max(low, first), high)
                low, at_low, at_next = _last_sample(first, high, near, record[here], rings, pairs, now)
                if low < 0:
                    continue
                high = min(low + 1, high)
                share = _share(low, high, at_low, at_next, rings, pairs, now, memory) if high > low else 0.0
                _between(low, high, share, rings, pairs, memory)
                position = rings[0][low] + share * (rings[0][high] - rings[0][low])
                ring_time = rings[1][low] + share * (rings[1][high] - rings[1][low])
                stuck[point, curve, sample] = True
                edge[point, curve, sample] = position
                relaxed_depth[point, curve, sample] = _relaxed_depth(position, ring_time, memory, pairs, now)[0]
                of_force = force[here], time[here], force_memory[here], advancing_stretch[here], receding_stretch[here]
                _between(low, high, share, of_force, pairs, memory)
                losses = _fill_losses(max(now[1] - ring_time, 0.0), pairs)
                total = 0.0
                for pair in range(len(memory)):
                    total += pairs[0][pair] * (1.0 + losses[pair]) * memory[pair]
                memory_force[point, curve, sample] = total


Step = tuple[float, float, float, Floats, Floats]  # depth before and now, duration, decay and lag of memories


@compiled()
def _followed(
    ring: int, reach: float, pressed: Floats, memory: Floats, pairs: Pairs, step: Step
) -> tuple[float, float]:
    """Move a ring on by a step: its force over its stiffness, and how far it is pressed beyond where it would have
    recovered to; negative where it is left behind."""
    before, now, duration, decay, lag = step
    carried = at_once = 1.0 - pairs[0].sum()
    carried *= pressed[ring]
    for pair in range(len(decay)):
        carried += pairs[0][pair] * decay[pair] * memory[ring, pair]
        at_once += pairs[0][pair] * lag[pair]
    recovery = -carried / at_once
    change = now - reach - pressed[ring]
    beyond = max(change - recovery, 0.0)
    for pair in range(len(decay)):
        memory[ring, pair] = decay[pair] * memory[ring, pair] + lag[pair] * recovery
    pressed[ring] += recovery + beyond
    if beyond == 0.0:
        return 0.0, change - recovery
    passed = beyond / (beyond + max(pressed[ring] - recovery - beyond + reach - before, 0.0)) * duration  # since met
    losses = _fill_losses(passed, pairs)
    sudden = 1.0 - pairs[0].sum()
    for pair in range(len(decay)):
        own = _lagging(losses[pair], passed, pairs[1][pair])
        memory[ring, pair] += own * beyond
        sudden += pairs[0][pair] * own
    return sudden * beyond, beyond


@compiled()
def _march(
    depth: Floats,
    time: Floats,
    first: int,
    reach: Floats,
    stiffness: Floats,
    pairs: Pairs,
    force: Floats,
    edge: Floats,
) -> None:
    """As `ring_rows`, of one curve."""
    rings, reached = len(stiffness), 0
    pressed, memory = np.zeros(rings), np.zeros((rings, len(pairs[0])))
    decay, lag = np.zeros(len(pairs[0])), np.zeros(len(pairs[0]))
    for sample in range(first, len(depth)):
        before = max(sample - 1, first)
        duration = max(time[sample] - time[before], 0.0)
        losses = _fill_losses(duration, pairs)
        for pair in range(len(decay)):
            decay[pair], lag[pair] = 1.0 + losses[pair], _lagging(losses[pair], duration, pairs[1][pair])
        step = (depth[before] if sample > first else 0.0, depth[sample], duration, decay, lag)
        while reached < rings and reach[reached] < depth[sample]:
            reached += 1
        outermost, excess, gap = -1, 0.0, reach[0]
        for ring in range(reached):
            carried, beyond = _followed(ring, reach[ring], pressed, memory, pairs, step)
            force[sample] += stiffness[ring] * carried
            if beyond > 0:
                outermost, excess = ring, beyond
            elif ring == outermost + 1:
                gap = -beyond
        if outermost + 1 == reached:
            gap = reach[reached] - depth[sample]
        if outermost >= 0:
            edge[sample] = reach[outermost] + excess / (excess + gap) * (reach[outermost + 1] - reach[outermost])


@compiled(f"void({_ROWS}, {_ROWS}, int64[:, ::1], boolean[::1], {_ROWS}, {_ROWS}, {_PAIRS}, {_ROWS}, {_ROWS})")
def ring_rows(
    depth: Floats,
    time: Floats,
    first_contact: Indices,
    again: Mask,
    reach: Floats,
    stiffness: Floats,
    fractions: Floats,
    times: Floats,
    series: int,
    force: Floats,
    edge: Floats,
) -> None:
    """Of the curves that press `again`, fill F and the depth that belongs to the edge, from −1 where there is none.

    The contact is a row of rings, springs side by side: ring j of `stiffness` k_j touches at the depth `reach` δ_j
    (points, curves, rings). Its surface is pressed in by v_j ≥ δ − δ_j and carries k_j ∫ e(t−s) dv_j(s) ≥ 0, one of the
    two with equality: where it is left behind it recovers without force. v is linear between samples, from where the
    ring is met.
    """
    points, curves, _ = depth.shape
    room = np.empty(fractions.shape[1])
    for point in range(points):
        pairs = fractions[point], times[point], series, room
        for curve in range(curves):
            if again[curve]:
                here = point, curve
                curve_rows = depth[here], time[here], first_contact[here]
                _march(*curve_rows, reach[here], stiffness[here], pairs, force[here], edge[here])
