"""The neo-Hookean solid, and Yeoh's with a second term, in axisymmetry, at all integration points.

Energy per undeformed volume W = (G/2)(K + c₂ K² − 2 ln J) − p (J − 1), K = I₁ − 3, with G = 1; neo-Hookean at c₂ = 0.
An incompressible solid has J = 1, another one p = −λ (J − 1). The deformation gradient has the five components F =
(F_rr, F_rz, F_zr, F_zz, F_θθ), the last axis of every array here; cof F = ∂J/∂F. Where J = 1 the term in ln J is only
a shift of p by G, so that p = 0 at rest; but elements meet J = 1 on average only, and without that term modes that
violate it inside an element lose their stiffness once the pressure exceeds about 1.5 G (found as a negative
eigenvalue in the element under the centre of the contact). Source: Holzapfel, Nonlinear Solid Mechanics (2000), ch.
6; Auricchio et al., Comput. Methods Appl. Mech. Engrg. 194 (2005) 1075, on that loss of stability.
"""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats


@dataclass(frozen=True)
class Material:
    """c₂ and ν; the shear modulus is 1."""

    second_over_first: float = 0.0
    poisson_ratio: float = 0.5

    @property
    def youngs_modulus(self) -> float:
        """E over G."""
        return 2 * (1 + self.poisson_ratio)

    @property
    def compliance(self) -> float:
        """1/λ, times G; 0 of an incompressible solid."""
        return (1 - 2 * self.poisson_ratio) / (2 * self.poisson_ratio)


NEO_HOOKEAN = Material()
IDENTITY = np.array([1.0, 0.0, 0.0, 1.0, 1.0])
SHEAR_MODULUS = 1.0
YOUNGS_MODULUS = NEO_HOOKEAN.youngs_modulus


def cofactor(f: Floats) -> Floats:
    """cof F = ∂J/∂F, shape (…, 5)."""
    rr, rz, zr, zz, tt = np.moveaxis(f, -1, 0)
    return np.stack([zz * tt, -zr * tt, -rz * tt, rr * tt, rr * zz - rz * zr], axis=-1)


def volume_ratio(f: Floats) -> Floats:
    """J = det F, shape (…)."""
    rr, rz, zr, zz, tt = np.moveaxis(f, -1, 0)
    return (rr * zz - rz * zr) * tt


def stress(f: Floats, p: Floats, c2: float = 0.0) -> Floats:
    """First Piola–Kirchhoff stress P = (1 + 2 c₂ K) F − (p + 1/J) cof F, shape (…, 5)."""
    stiffened = f if c2 == 0.0 else _stiffening(f, c2)[..., None] * f
    return stiffened - (p + 1 / volume_ratio(f))[..., None] * cofactor(f)


def tangent(f: Floats, p: Floats, c2: float = 0.0) -> Floats:
    """∂P/∂F = 1 + 2 c₂ K + 4 c₂ F ⊗ F − (p + 1/J) ∂²J/∂F² + cof F ⊗ cof F / J², shape (…, 5, 5), symmetric."""
    rr, rz, zr, zz, tt = np.moveaxis(f, -1, 0)
    second = np.zeros((*p.shape, 5, 5))
    for i, j, value in ((0, 3, tt), (1, 2, -tt), (0, 4, zz), (3, 4, rr), (1, 4, -zr), (2, 4, -rz)):
        second[..., i, j] = second[..., j, i] = value
    volume, cof = volume_ratio(f), cofactor(f)
    shift = (p + 1 / volume)[..., None, None]
    normalised = cof / volume[..., None]
    rest = normalised[..., :, None] * normalised[..., None, :] - shift * second
    if c2 == 0.0:
        return np.eye(5) + rest
    return _stiffening(f, c2)[..., None, None] * np.eye(5) + 4 * c2 * f[..., :, None] * f[..., None, :] + rest


def _stiffening(f: Floats, c2: float) -> Floats:
    """1 + 2 c₂ (I₁ − 3), shape (…)."""
    return np.asarray(1 + 2 * c2 * ((f**2).sum(axis=-1) - 3))
