"""The linear layer on its rigid base, in transformed space: one 4 × 4 propagator a wavenumber; lengths in units of h.

With u_r = U J1(kr), u_z = W J0(kr), τ_rz = T J1(kr), σ_zz = S J0(kr) and G = 1, equilibrium and Hooke's law read
    d/dz (U, W, T, S) = A (U, W, T, S),    (A² − k²)² = 0,
so that exp(A) is a cubic in A. At the base W = 0 and T = κ U (the glue line; κ = ∞ is bonded), at the surface T = 0 and
S = −p. `Layer.transmission` M(k) is the pressure on the base over that on the surface, `Layer.compliance` K(k) the
deflection of the surface over that of the half space of the same ν. Source: the state-space method, Bahar, J. Eng.
Mech. Div. ASCE 98 (1972); Small and Booker, Int. J. Numer. Methods Eng. 20 (1984), for the finite-layer form.

Stresses on the base are summed as a Fourier–Bessel series on a disc so wide that its rim has no influence.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0, j1, jn_zeros

Floats = NDArray[np.float64]

RIM = 24.0  # radius of the disc; stress on the base falls at least like e^(−r)
_HIGHEST_WAVENUMBER = 40.0  # M(k) is below 1e-15 there
_ZEROS = jn_zeros(0, int(_HIGHEST_WAVENUMBER * RIM / math.pi))
WAVENUMBERS: Floats = _ZEROS / RIM
SERIES: Floats = 2 / (3 * RIM**2 * j1(_ZEROS) ** 2)  # weight of each term of a stress in units of 3F/(2πh²)


@dataclass(frozen=True)
class Layer:
    """A linear elastic layer of unit thickness.

    Parameters
    ----------
    poisson_ratio : float
        0 to 0.5.
    glue_stiffness : float
        κ in units of G/h; infinite when bonded.
    """

    poisson_ratio: float = 0.5
    glue_stiffness: float = math.inf

    def transmission(self, k: Floats) -> Floats:
        """Pressure on the base over that on the surface, M(k), for wavenumbers k (k,)."""
        return self._base_and_surface(k)[0]

    def compliance(self, k: Floats) -> Floats:
        """Deflection of the surface over that of the half space of the same ν, K(k), for wavenumbers k (k,)."""
        return self._base_and_surface(k)[1]

    def _base_and_surface(self, k: Floats) -> tuple[Floats, Floats]:
        propagator = _propagator(k, self.poisson_ratio)
        # At the base the state is a (yields, 0, 1, 0) + b (0, 0, 0, 1) for bonded glue, yields = 1/κ.
        give = 0.0 if math.isinf(self.glue_stiffness) else 1.0
        hold = 1.0 if math.isinf(self.glue_stiffness) else self.glue_stiffness
        shear = give * propagator[..., 0] + hold * propagator[..., 2]
        normal = propagator[..., 3]
        determinant = shear[:, 2] * normal[:, 3] - normal[:, 2] * shear[:, 3]
        a, b = normal[:, 2] / determinant, -shear[:, 2] / determinant  # T = 0 and S = −1 at the surface
        deflection = -(a * shear[:, 1] + b * normal[:, 1])
        scale = np.exp(-k)  # the propagator is scaled so
        return -b * scale, deflection * k / (1 - self.poisson_ratio)


def _propagator(k: Floats, nu: float) -> NDArray[np.float64]:
    """exp(A) e^(−k), (k, 4, 4)."""
    share = nu / (1 - nu)
    system = np.zeros((len(k), 4, 4))
    system[:, 0, 1], system[:, 0, 2] = k, 1
    system[:, 1, 0], system[:, 1, 3] = -share * k, (1 - 2 * nu) / (2 * (1 - nu))
    system[:, 2, 0], system[:, 2, 3] = 2 * k**2 / (1 - nu), share * k
    system[:, 3, 2] = -k
    decay = np.exp(-2 * k)
    cosh, sinh = (1 + decay) / 2, (1 - decay) / 2
    small = k < 0.02
    safe = np.where(small, 1.0, k)
    sinc = np.where(small, np.exp(-k) * (1 + k**2 / 6), sinh / safe)
    cubic = np.where(small, np.exp(-k) * (1 / 6 + k**2 / 60), (safe * cosh - sinh) / (2 * safe**3))
    square = system @ system
    terms = (
        ((cosh - k * sinh / 2), np.eye(4)),
        ((3 * sinc - cosh) / 2, system),
        (sinc / 2, square),
        (cubic, square @ system),
    )
    return np.sum([factor[:, None, None] * power for factor, power in terms], axis=0)


def hertz_shape(s: Floats) -> Floats:
    """Transform of the Hertz pressure over its force, s = k a; 1 at s = 0."""
    small = np.abs(s) < 0.05
    safe = np.where(small, 1.0, s)
    return np.where(small, 1 - s**2 / 10 + s**4 / 280, 3 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)


def disc_mean(s: Floats) -> Floats:
    """Mean of J0 over a disc, 2 J1(s)/s, s = k rT."""
    return 2 * j1(s) / s


def base_stress(spectrum: Floats, rt_over_h: float, offset_over_h: Floats) -> Floats:
    """Mean stress on sensors under axisymmetric loads.

    Parameters
    ----------
    spectrum : ndarray, (rows, WAVENUMBERS)
        Transform of the stress on the base.
    rt_over_h : float
        Sensor radius over thickness.
    offset_over_h : ndarray, (rows,) or (rows, sensors)
        Distance of the sensors from the axis of the load.

    Returns
    -------
    ndarray
        In units of 3F/(2πh²), of the shape of `offset_over_h`; 0 beyond the rim of the disc.
    """
    weighted = spectrum * (SERIES * disc_mean(WAVENUMBERS * rt_over_h))
    waves = j0(np.multiply.outer(offset_over_h, WAVENUMBERS))
    return np.where(offset_over_h + rt_over_h < RIM, np.einsum("rk,r...k->r...", weighted, waves), 0.0)
