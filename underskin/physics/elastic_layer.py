"""A linear elastic layer of unit thickness on a rigid base, and contacts of rigid indenters with it without friction.

The layer has any Poisson ratio from 0 to 0.5 and is bonded or glued. The glue line deforms in shear: τ = κ (G/h) u_r
at the base; κ = ∞ is bonded, κ = 0 frictionless. It is described by its `slip` = 1/(1 + κ), 0 to 1: in the slip,
everything below is a ratio of linear functions, so both ends can be evaluated.

Derivation (Sneddon, Fourier Transforms (1951), ch. 10): the transforms u, w of the displacements and S, T of σ_zz,
τ_rz obey x' = A x in ζ = k z with (A² − 1)² = 0, so that exp(A ζ) has a closed form, and the 4×4 system of two
conditions at the base (w = 0, u = (k/κ) T) and two at the surface reduces by hand. With C = cosh k, H = sinh k,
p = (1 − 2ν)/(2 − 2ν), which is 0 for an incompressible layer, and g = 2k (1 − p)/κ:

    D      = C² + k² − 2pk² + p²(k² − H²)           + g (CH + k)
    M D    = C + kH − p kH                          + g (H + kC)     M: normal stress, base / surface
    M_t D  = kC + p (H − kC)                        + g kH           M_t: normal stress at the base / surface shear
    M_s D  = kC − p (H + kC)                                         M_s: shear at the base / normal surface stress
    K D    = CH − k + 2pk − p²(CH + k)              + g H²           K: surface deflection, layer / half space

Contacts are solved many at once and with derivatives. Lengths are in units of the thickness, α = a/h. The integral
equation (Lebedev and Ufliand 1958) is

    (π/2) φ(x) − ∫₀^α φ(t) N(x, t) dt = f(x),   N(x, t) = ∫₀^∞ (1 − K(k)) cos kx cos kt dk,
    p̂(k) = ∫₀^α φ(t) cos kt dt

φ is analytic and even, so a few modes eₙ(t/α) = (−1)ⁿ √(4n + 1) P₂ₙ(t/α) represent it; their cosine transforms are
α √(4n + 1) j₂ₙ(kα), and the Galerkin matrix is (π/2) I − α ∫ (1 − K) j jᵀ dk, symmetric. f = 1 is the flat punch φ₀
and f = (t/α)² gives φ₂; a sphere without adhesion is φ_s = φ₂(α)/φ₀(α) φ₀ − φ₂, which is 0 at the edge. What depends on
the layer carries its derivatives by the Poisson ratio and by the slip of the glue line.

With E' = E/(1 − ν²) and the work of adhesion w (JKR), the contact of a sphere is the sum of one without adhesion and
a flat punch whose φ at the edge is that of adhesion:

    P = F R/(E' h³),   Δ = δ R/h²,   U = √(w/(E' h³)) R
    P = (4/3) α³ A(α) − U √(8π α³) G(α),   Δ = α² B(α) − U √(2πα) V(α),   dF/dδ = 2 E' a S(α)  (edge held)

The tip may yield too, as a half space (Johnson, Contact Mechanics (1985), section 4.2: the depths add): with its share
t of the compliance, E' is E* = (1 − t) E' and 1 − K is (1 − t)(1 − K) everywhere above.

A, B, G, V, S are 1 at α = 0 and depend only on α, the Poisson ratio, the glue line and t: they are solved once for each
layer at Chebyshev points in α, which takes about a millisecond.

The stress follows in the same way: at the same points in α, the transforms of both pressures at given wave numbers are
contracted with the layer's transmission. This leaves a few numbers for each position of the sensor, smooth in α, and a
row costs one product of `basis` with them. Both transforms are 1 at k = 0: that of a contact is
[Ps p̂_sphere + (P − Ps) p̂_punch]/P.
"""

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from underskin.autodiff import Differentiated, constant
from underskin.errors import out_of_range
from underskin.physics.hankel_transform import hertz_transform, normal_stress, tangential_stress
from underskin.units import Floats

_SMALLEST_K = 1e-12  # at k = 0 a frictionless base gives 0/0; the limits are reached long before


def slip(glue_stiffness: float) -> float:
    """Slip 1/(1 + κ) of a glue line with τ = κ (G/h) u_r.

    Parameters
    ----------
    glue_stiffness : float
        κ [-], at least 0; infinite when bonded.

    Returns
    -------
    float
        0 (bonded) to 1 (frictionless).

    Raises
    ------
    InvalidInput
        If κ is negative or NaN.
    """
    if not glue_stiffness >= 0:
        raise out_of_range("glue_stiffness", glue_stiffness, "must be at least 0 (infinity: bonded)")
    return 1 / (1 + glue_stiffness)


@dataclass(frozen=True)
class Layer:
    """An elastic layer of unit thickness.

    Its functions take wave numbers k ≥ 0 in units of 1/h, (k,); derivatives are by ν and slip, of `stiffening` also by
    the tip's share.

    Parameters
    ----------
    poisson_ratio : float, or ndarray (…, 1)
        0 to 0.5, 0.5 included. Arrays are several layers; functions then answer (…, k).
    slip : float, or ndarray (…, 1)
        0 (bonded) to 1 (frictionless).
    tip : float
        Share of the indenter in the compliance of its contact with a half space of the layer's material: 0 (rigid) to
        below 1.

    Raises
    ------
    InvalidInput
        Outside these ranges.
    """

    poisson_ratio: float | Floats = 0.5
    slip: float | Floats = 0.0
    tip: float = 0.0

    def __post_init__(self) -> None:
        if not np.all((self.poisson_ratio >= 0) & (self.poisson_ratio <= 0.5)):
            raise out_of_range("poisson_ratio", self.poisson_ratio, "must be 0 to 0.5")
        if not np.all((self.slip >= 0) & (self.slip <= 1)):
            raise out_of_range("slip", self.slip, "must be 0 (bonded) to 1 (frictionless)")
        if not 0 <= self.tip < 1:
            raise out_of_range("tip", self.tip, "must be 0 (rigid) to below 1")

    def transmission(self, k: Floats) -> Differentiated:
        """Normal transmission M(k), 1 at k = 0, as `hankel_transform.normal_stress` takes it (γ_n, σ)."""
        k, decay, cosh, sinh = _scaled_hyperbolic(k)
        bonded = (cosh + k * sinh) * decay, -k * sinh * decay, np.zeros_like(k)
        return self._ratio(k, bonded, (sinh + k * cosh) * decay)

    def tangential_transmission(self, k: Floats) -> Differentiated:
        """Tangential transmission M_t(k), 0 at k = 0, as `hankel_transform.tangential_stress` takes it (γ_t)."""
        k, decay, cosh, sinh = _scaled_hyperbolic(k)
        bonded = k * cosh * decay, (sinh - k * cosh) * decay, np.zeros_like(k)
        return self._ratio(k, bonded, k * sinh * decay)

    def base_shear(self, k: Floats) -> Differentiated:
        """Shear M_s(k) that a normal surface stress puts on the base; like k at k = 0."""
        k, decay, cosh, sinh = _scaled_hyperbolic(k)
        bonded = k * cosh * decay, -(sinh + k * cosh) * decay, np.zeros_like(k)
        return self._ratio(k, bonded, np.zeros_like(k))

    def compliance(self, k: Floats) -> Differentiated:
        """Compliance K(k): surface deflection over that of the half space of the same ν; 0 at k = 0, 1 at k = ∞."""
        k, decay, cosh, sinh = _scaled_hyperbolic(k)
        bonded = _sinh_cosh_minus(k), 2 * k * decay**2, -(cosh * sinh + k * decay**2)
        return self._ratio(k, bonded, sinh**2)

    def stiffening(self, k: Floats) -> Differentiated:
        """What the base takes from the contact's compliance, (1 − t)(1 − K(k)) of that of two half spaces.

        Exact to rounding where K is close to 1; falls like k² e^(−2k). Derivatives by ν, slip and the tip's share t.
        """
        k, decay, _, sinh = _scaled_hyperbolic(k)
        square, far = k * (1 + k), decay**2
        bonded = (1 + square - sinh) * far, -2 * square * far, (square + sinh) * far
        held = self._ratio(k, bonded, (k + sinh) * far)
        value = (1 - self.tip) * held.value
        return Differentiated(value, np.stack([*((1 - self.tip) * held.slopes), -held.value]))

    def _ratio(self, k: Floats, bonded: tuple[Floats, Floats, Floats], glue: Floats) -> Differentiated:
        """[(1 − s) (b₀ + b₁ p + b₂ p²) + 2ks (1 − p) g]/[the same of D], all scaled by e^(−2k); s is the slip."""
        _, decay, cosh, sinh = _scaled_hyperbolic(k)
        square = (k * decay) ** 2
        denominator = cosh**2 + square, -2 * square, square - sinh**2
        ratio = self._mixed(k, bonded, glue) / self._mixed(k, denominator, cosh * sinh + k * decay**2)
        by_p, by_slip = ratio.slopes
        return Differentiated(ratio.value, np.stack([-by_p / (2 * (1 - self.poisson_ratio) ** 2), by_slip]))

    def _mixed(self, k: Floats, bonded: tuple[Floats, Floats, Floats], glue: Floats) -> Differentiated:
        """(1 − s) (b₀ + b₁ p + b₂ p²) + 2ks (1 − p) g with its derivatives with respect to p and s."""
        p, s = (1 - 2 * self.poisson_ratio) / (2 - 2 * self.poisson_ratio), self.slip
        constant, linear, quadratic = bonded
        held, yielding = constant + p * (linear + p * quadratic), 2 * k * (1 - p) * glue
        by_p = (1 - s) * (linear + 2 * p * quadratic) - 2 * k * s * glue
        return Differentiated((1 - s) * held + s * yielding, np.stack(np.broadcast_arrays(by_p, yielding - held)))


def gamma_n(layer: Layer, offset: ArrayLike, rho: ArrayLike) -> Floats:
    """Stress factor γ_n of a normal point force, averaged over the sensor.

    Parameters
    ----------
    layer : Layer
    offset : array_like
        Distance r̂/h of the force from the centre of the sensor [-].
    rho : array_like
        ρ = rT/h [-].

    Returns
    -------
    ndarray
        [-], of the broadcast shape.
    """
    return normal_stress(lambda k: layer.transmission(k).value, np.ones_like, 0.0, rho, offset)


def gamma_t(layer: Layer, offset: ArrayLike, rho: ArrayLike) -> Floats:
    """Stress factor γ_t of a tangential point force, positive where the force points away from the sensor.

    Parameters and result as in `gamma_n`.
    """
    return tangential_stress(lambda k: layer.tangential_transmission(k).value, rho, offset)


def sigma(layer: Layer, a: ArrayLike, rho: ArrayLike, offset: ArrayLike = 0.0) -> Floats:
    """Transmission factor σ(a/h, ρ) under the Hertz pressure.

    Parameters
    ----------
    layer : Layer
    a : array_like
        Contact radius a/h [-].
    rho : array_like
        ρ = rT/h [-].
    offset : array_like
        Distance r̂/h of the load from the centre of the sensor [-].

    Returns
    -------
    ndarray
        [-], of the broadcast shape.
    """
    return normal_stress(lambda k: layer.transmission(k).value, hertz_transform, a, rho, offset)


def _scaled_hyperbolic(k: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """k, at least `_SMALLEST_K`, with e^(−k), e^(−k) cosh k and e^(−k) sinh k."""
    k = np.maximum(k, _SMALLEST_K)
    decay = np.exp(-k)
    return k, decay, (1 + decay**2) / 2, -np.expm1(-2 * k) / 2


def _sinh_cosh_minus(k: Floats) -> Floats:
    """e^(−2k) (sinh k cosh k − k), by its series below k = 1/4."""
    x = np.minimum(2 * k, 0.5) ** 2
    series = 2 / 3 * k**3 * (1 + x / 20 * (1 + x / 42 * (1 + x / 72 * (1 + x / 110 * (1 + x / 156)))))
    direct = -np.expm1(-4 * k) / 4 - k * np.exp(-2 * k)
    return np.where(k < 0.25, series * np.exp(-2 * k), direct)


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
            edge_depth=constant(2 / np.pi, len(punch_edge.slopes)) / punch_edge,
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


LARGEST_A_OVER_H = 4.0  # largest a/h
_NODES = 28
_TABLE: Floats = LARGEST_A_OVER_H / 128 * np.arange(1.0, 129.0)  # of a/h, for first guesses
_SMALLEST = 1e-12
_TOLERANCE = 1e-7  # of the last step; the remaining error is about its square

# Sums of terms: factor, exponent of α, the curve among A, G, B, V, S, and whether it is multiplied by U.
_Law = tuple[tuple[float, float, int, bool], ...]
_SPHERE_LOAD: _Law = ((4 / 3, 3.0, 0, False),)
_LOAD: _Law = (*_SPHERE_LOAD, (-np.sqrt(8 * np.pi), 1.5, 1, True))
_DEPTH: _Law = ((1.0, 2.0, 2, False), (-np.sqrt(2 * np.pi), 0.5, 3, True))
_STIFFNESS: _Law = ((1.0, 0.0, 4, False),)


@dataclass(frozen=True)
class ContactRows:
    """Contacts (rows,) with derivatives by P, U, ν, the slip of the glue line and the tip's share.

    NaN where there is none: below pull-off, or beyond a/h = LARGEST_A_OVER_H.

    Attributes
    ----------
    alpha : Differentiated
        a/h.
    load, depth : Differentiated
        P and Δ.
    sphere_load : Differentiated
        Ps, the share of the sphere in P; that of the punch is P − Ps ≤ 0.
    stiffness : Differentiated
        S = (dF/dδ at a fixed edge)/(2 E' a); without adhesion this is the total dF/dδ.
    """

    alpha: Differentiated
    load: Differentiated
    depth: Differentiated
    sphere_load: Differentiated
    stiffness: Differentiated


class ChebyshevInterval:
    """Interpolation of smooth functions on [0, end] at Chebyshev points; the error falls geometrically with them.

    Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 3.

    Parameters
    ----------
    end : float
        Upper end of the interval.
    count : int
        Number of points.

    Attributes
    ----------
    nodes : ndarray, (count,)
        The interpolation points, all inside (0, end).
    """

    def __init__(self, end: float, count: int) -> None:
        self.end = end
        self.nodes = end / 2 * (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        transform = self.basis(self.nodes).T * (2 / count)
        transform[0] /= 2
        self._transform = transform
        self._derivative = chebyshev.chebder(np.eye(count)) * (2 / end)

    def basis(self, x: Floats) -> Floats:
        """Chebyshev polynomials at x (rows,): (rows, count). A function is `basis(x) @ coefficients`."""
        return np.asarray(chebyshev.chebvander(2 / self.end * x - 1, len(self.nodes) - 1), dtype=float)

    def coefficients(self, values: Floats) -> Floats:
        """Coefficients (count, ...) of the interpolant from values at the nodes (count, ...)."""
        return np.tensordot(self._transform, values, 1)

    def derivative(self, coefficients: Floats) -> Floats:
        """Coefficients (count, ...) of the derivative of the interpolant; the last is 0."""
        shorter = np.tensordot(self._derivative, coefficients, 1)
        return np.concatenate([shorter, np.zeros_like(coefficients[:1])])


class CurveGrid:
    """The part common to all layers: the Chebyshev points in α and the modes' transforms at given wave numbers.

    Parameters
    ----------
    wave_numbers : ndarray, (k,)
        In units of 1/h.
    """

    def __init__(self, wave_numbers: Floats) -> None:
        self.interval, self.equation = _at_nodes()
        s = np.multiply.outer(self.interval.nodes, wave_numbers)
        self.transforms = mode_transforms(s, self.equation.modes).transpose(0, 2, 1)
        self.table_basis = self.interval.basis(_TABLE)

    def curves(self, layer: Layer) -> "ContactCurves":
        """The contact curves of one layer."""
        return ContactCurves(self, layer)


@lru_cache(maxsize=64)
def curves_of(layer: Layer) -> "ContactCurves":
    """The contact curves of one layer where no stress is needed."""
    return CurveGrid(np.zeros(0)).curves(layer)


@cache
def _at_nodes() -> tuple[ChebyshevInterval, ContactEquation]:
    """The part that is also independent of the wave numbers."""
    interval = ChebyshevInterval(LARGEST_A_OVER_H, _NODES)
    return interval, ContactEquation(interval.nodes)


class ContactCurves:
    """The functions A, B, G, V, S of one layer and the transforms of the pressures.

    Attributes
    ----------
    sphere_transform, punch_transform : Differentiated, (points, k)
        At the points `interval.nodes` in α, with derivatives by ν, the slip and the tip's share.
    """

    def __init__(self, grid: CurveGrid, layer: Layer) -> None:
        self.interval = grid.interval
        solved = grid.equation.solve(layer)
        ratios = (solved.sphere_force, solved.edge_force, solved.sphere_depth, solved.edge_depth, solved.stiffness)
        at_nodes = np.stack([_stacked(ratio) for ratio in ratios], axis=-1).transpose(1, 0, 2)
        coefficients = self.interval.coefficients(at_nodes)  # (count, 4, 5)
        slopes = self.interval.derivative(coefficients[:, :1])
        self._coefficients = np.concatenate([coefficients[:, :1], slopes, coefficients[:, 1:]], axis=1)
        # A, G and their slopes for the compiled function.
        self._of_load = np.ascontiguousarray(self._coefficients[:, :2, :2].reshape(-1, 4).T)
        at = self._evaluated(grid.table_basis)
        self._start = _Start(at)
        shapes = np.concatenate([_stacked(solved.sphere_shape), _stacked(solved.punch_shape)]).transpose(1, 0, 2)
        transforms = (shapes @ grid.transforms).transpose(1, 0, 2)
        sphere, punch = np.split(transforms, 2)
        self.sphere_transform = Differentiated(sphere[0], sphere[1:])
        self.punch_transform = Differentiated(punch[0], punch[1:])

    def at_load(self, load: Floats, root_adhesion: Floats) -> ContactRows:
        """Contacts under given loads, on the branch that is stable under force control.

        Parameters
        ----------
        load : ndarray, (rows,)
            P [-].
        root_adhesion : ndarray, (rows,)
            U [-].
        """
        jkr = 3 * np.pi * root_adhesion**2
        equivalent = load + jkr + np.sqrt(np.maximum(jkr * (2 * load + jkr), 0.0))
        alpha = self._newton(load, root_adhesion, self._start(np.cbrt(equivalent), root_adhesion))
        at = self._evaluated(self.interval.basis(alpha))
        _, by_alpha, *partial = _law(_LOAD, alpha, root_adhesion, at)
        slopes = np.stack([1 / by_alpha, *(-x / by_alpha for x in partial)])

        def rows(law: _Law) -> Differentiated:
            value, by_alpha, *partial = _law(law, alpha, root_adhesion, at)
            total = by_alpha * slopes
            total[1:] += partial
            return Differentiated(value, total)

        laws = (_LOAD, _DEPTH, _SPHERE_LOAD, _STIFFNESS)
        return ContactRows(Differentiated(alpha, slopes), *map(rows, laws))

    def stiffness_at(self, alpha: Floats) -> Differentiated:
        """S at a/h (rows,) from 0 to LARGEST_A_OVER_H, with derivatives by α, ν, the slip and the tip's share."""
        value, *slopes = self._evaluated(self.interval.basis(alpha))[:, _STIFFNESS[0][2]]
        return Differentiated(value, np.stack(slopes))

    def ratios_at(self, alpha: Floats) -> Floats:
        """A, B, S and V at a/h (rows,) from 0 to LARGEST_A_OVER_H: (rows, 4)."""
        ratios = self._evaluated(self.interval.basis(alpha))[0]
        return np.stack([ratios[0], ratios[2], ratios[4], ratios[3]], axis=-1)

    def _newton(self, load: Floats, root_adhesion: Floats, start: Floats) -> Floats:
        """α from first guesses; NaN where there is none."""
        from underskin.physics.contact_kernel import radii_under_load

        alpha, of_load = start.copy(), (np.ascontiguousarray(x) for x in (load, root_adhesion))
        radii_under_load(self._of_load, LARGEST_A_OVER_H, *of_load, _SMALLEST, _TOLERANCE, alpha)
        return alpha

    def _evaluated(self, basis: Floats) -> Floats:
        """The curves' values and derivatives with respect to α, ν, slip and tip: (5, curves, rows)."""
        flat = self._coefficients.reshape(len(self._coefficients), -1)
        values: Floats = (basis @ flat).T.reshape(self._coefficients.shape[1], -1, len(basis))
        return values


class _Start:
    """A first guess of α, on the stable side of P's minimum, where U = (sphere's slope)/(adhesion's slope)."""

    def __init__(self, at: Floats) -> None:
        value, slope, *_ = _law(_LOAD, _TABLE, np.zeros_like(_TABLE), at)
        adhesion = slope - _law(_LOAD, _TABLE, np.ones_like(_TABLE), at)[1]
        self._root = np.append(0.0, np.cbrt(value))
        self._critical = np.append(0.0, (slope / np.maximum(adhesion, _SMALLEST * slope)) ** (2 / 3))
        self._alpha = np.append(0.0, _TABLE)

    def __call__(self, root: Floats, root_adhesion: Floats) -> Floats:
        """From the cube root of the load that a sphere without adhesion would have, and U."""
        unstable = np.interp(root_adhesion ** (2 / 3), self._critical, self._alpha)
        start: Floats = np.maximum(np.interp(root, self._root, self._alpha), 1.02 * unstable)
        return start


def _stacked(x: Differentiated) -> Floats:
    """The value and its derivatives along the first axis: one product with a matrix serves all of them."""
    return np.concatenate([x.value[None], x.slopes])


def _law(law: _Law, alpha: Floats, root_adhesion: Floats, at: Floats) -> Floats:
    """Σ of factor · U^m · α^n · curve over the law's terms, with its derivatives by α, U and as `at`'s: (6, rows)."""
    total = np.zeros((1 + len(at), len(alpha)))
    other_than_root = np.arange(len(total)) != 2
    for factor, exponent, column, adhesive in law:
        power: Floats = factor * alpha**exponent
        term = power * at[:, column]
        term[1] += exponent / alpha * term[0]
        total[other_than_root] += root_adhesion * term if adhesive else term
        if adhesive:
            total[2] += term[0]
    return total
