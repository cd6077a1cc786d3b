"""A linear elastic layer of unit thickness on a rigid base, of any Poisson ratio from 0 to 0.5, bonded or glued.

The glue line deforms in shear: τ = κ (G/h) u_r at the base; κ = ∞ is bonded, κ = 0 frictionless. It is described by
its `slip` = 1/(1 + κ), 0 to 1: in the slip, everything below is a ratio of linear functions, so both ends can be
evaluated.

Derivation (Sneddon, Fourier Transforms (1951), ch. 10): the transforms u, w of the displacements and S, T of σ_zz,
τ_rz obey x' = A x in ζ = k z with (A² − 1)² = 0, so that exp(A ζ) has a closed form, and the 4×4 system of two
conditions at the base (w = 0, u = (k/κ) T) and two at the surface reduces by hand. With C = cosh k, H = sinh k,
p = (1 − 2ν)/(2 − 2ν), which is 0 for an incompressible layer, and g = 2k (1 − p)/κ:

    D      = C² + k² − 2pk² + p²(k² − H²)           + g (CH + k)
    M D    = C + kH − p kH                          + g (H + kC)     M: normal stress, base / surface
    M_t D  = kC + p (H − kC)                        + g kH           M_t: normal stress at the base / surface shear
    K D    = CH − k + 2pk − p²(CH + k)              + g H²           K: surface deflection, layer / half space
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underskin.autodiff import Differentiated
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

    Its functions take wave numbers k ≥ 0 in units of 1/h, (k,); their derivatives are those by ν and by the slip.

    Parameters
    ----------
    poisson_ratio : float, or ndarray (…, 1)
        0 to 0.5, 0.5 included. Arrays are several layers; functions then answer (…, k).
    slip : float, or ndarray (…, 1)
        0 (bonded) to 1 (frictionless).

    Raises
    ------
    InvalidInput
        Outside these ranges.
    """

    poisson_ratio: float | Floats = 0.5
    slip: float | Floats = 0.0

    def __post_init__(self) -> None:
        if not np.all((self.poisson_ratio >= 0) & (self.poisson_ratio <= 0.5)):
            raise out_of_range("poisson_ratio", self.poisson_ratio, "must be 0 to 0.5")
        if not np.all((self.slip >= 0) & (self.slip <= 1)):
            raise out_of_range("slip", self.slip, "must be 0 (bonded) to 1 (frictionless)")

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

    def compliance(self, k: Floats) -> Differentiated:
        """Compliance K(k): surface deflection over that of the half space of the same ν; 0 at k = 0, 1 at k = ∞."""
        k, decay, cosh, sinh = _scaled_hyperbolic(k)
        bonded = _sinh_cosh_minus(k), 2 * k * decay**2, -(cosh * sinh + k * decay**2)
        return self._ratio(k, bonded, sinh**2)

    def stiffening(self, k: Floats) -> Differentiated:
        """1 − K(k), exact to rounding where K is close to 1; falls like k² e^(−2k)."""
        k, decay, _, sinh = _scaled_hyperbolic(k)
        square, far = k * (1 + k), decay**2
        bonded = (1 + square - sinh) * far, -2 * square * far, (square + sinh) * far
        return self._ratio(k, bonded, (k + sinh) * far)

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
