"""The material law: derivatives, objectivity, the stress-free state."""

import numpy as np
import pytest

from tablegen.neo_hookean import IDENTITY, cofactor, stress, tangent, volume_ratio

GENERATOR = np.random.default_rng(20180203)
F = IDENTITY + 0.3 * GENERATOR.standard_normal((20, 5))
P = GENERATOR.standard_normal(20)


def full(components: np.ndarray) -> np.ndarray:
    """The 3 × 3 matrix of (rr, rz, zr, zz, θθ), in the order r, z, θ."""
    rr, rz, zr, zz, tt = components
    return np.array([[rr, rz, 0], [zr, zz, 0], [0, 0, tt]])


def test_volume_and_cofactor_are_those_of_the_matrix() -> None:
    for f in F:
        matrix = full(f)
        assert volume_ratio(f) == pytest.approx(np.linalg.det(matrix), rel=1e-12)
        assert full(cofactor(f)) == pytest.approx(np.linalg.det(matrix) * np.linalg.inv(matrix).T, rel=1e-10, abs=1e-12)


def energy(f: np.ndarray, p: np.ndarray, c2: float) -> np.ndarray:
    volume, k = volume_ratio(f), np.square(f).sum(axis=-1) - 3
    return np.asarray((k + c2 * k**2 - 2 * np.log(np.abs(volume))) / 2 - p * (volume - 1))


@pytest.mark.parametrize("c2", [0.0, 3.0])
def test_stress_is_the_derivative_of_the_energy_and_tangent_that_of_the_stress(c2: float) -> None:
    step = 1e-6
    for i in range(5):
        moved = np.zeros(5)
        moved[i] = step
        slope = (energy(F + moved, P, c2) - energy(F - moved, P, c2)) / (2 * step)
        assert stress(F, P, c2)[:, i] == pytest.approx(slope, rel=1e-5, abs=1e-6)
        slopes = (stress(F + moved, P, c2) - stress(F - moved, P, c2)) / (2 * step)
        assert tangent(F, P, c2)[..., i] == pytest.approx(slopes, rel=1e-5, abs=1e-5)


def test_no_stress_at_rest_and_youngs_modulus_is_three() -> None:
    assert stress(IDENTITY, np.zeros(())) == pytest.approx(np.zeros(5), abs=1e-15)
    strain = 1e-6  # axial strain e, lateral −e/2, no lateral stress
    f = IDENTITY + strain * np.array([-0.5, 0, 0, 1, -0.5])
    p = np.asarray(f[0] ** 2 - 1)  # P_rr = 0 where J = 1
    assert stress(f, p)[3] / strain == pytest.approx(3.0, rel=1e-5)


@pytest.mark.parametrize("c2", [0.0, 3.0])
def test_uniaxial_compression_follows_exact_law(c2: float) -> None:
    """Nominal stress (λ − λ⁻²) (1 + 2 c₂ K), K = λ² + 2/λ − 3, for stretch λ (G = 1)."""
    stretch = 0.7
    stiffened = 1 + 2 * c2 * (stretch**2 + 2 / stretch - 3)
    f = np.array([stretch**-0.5, 0, 0, stretch, stretch**-0.5])
    p = np.asarray(stiffened * f[0] ** 2 - 1)
    assert stress(f, p, c2)[0] == pytest.approx(0.0, abs=1e-14)
    assert stress(f, p, c2)[3] == pytest.approx(stiffened * (stretch - stretch**-2), rel=1e-13)
