"""Solves spheres in true contact and writes `contact_strain.npz`: `python -m rig.contact_strain_solve` (minutes).

A frictionless sphere on the bonded incompressible neo-Hookean layer (`rig.solved.layer`), under the force at which the
contact of the linear layer (`rig.contact`) has the radius a: with a/h and x = L^(1/3), L = F/(R²E), given, R follows.
Kept is what finite strain *adds* there to the stress on the base of the linear layer's contact, from the nodal
reactions R_i, in the form of `rig.finite_strain_solve`:
    Σ_i R_i(x)/F J0(k r_i) = c0 + c1 x + c2 x² + c3 x³ + c4 x⁴,   Δ(k; a, x) = c1 x + c2 x² + c3 x³ + c4 x⁴,
by least squares over the loads. c0, the linear contact on the same mesh, takes the mesh's own error away.
"""

from multiprocessing import Pool
from pathlib import Path

import numpy as np
from scipy.special import j0

from rig.contact import sphere_contact
from rig.layer import RIM, WAVENUMBERS, Floats, Layer
from rig.solved.layer import Material, PressedLayer, Sublayer

DATA = Path(__file__).with_name("contact_strain.npz")
RADII = np.concatenate([[0.04, 0.08, 0.12, 0.17, 0.23, 0.3], np.arange(0.4, 2.65, 0.14)])
LOADS = np.array([0.01, 0.08, 0.15, 0.22, 0.28, 0.34, 0.40, 0.4642])  # x
HIGHEST_WAVENUMBER = 12.0  # the addition by finite strain is smooth on the base
_FINENESS = 1.4
_WIDER = 1.1  # the contact may be wider than the linear one by
_DEPTHS = np.geomspace(0.25, 1.0, 7)  # the course of depths, over that of the linear contact
_SAME_FORCE = 1e-5  # relative


def spectrum_at(a: float, x: float, k: Floats, fineness: float = _FINENESS) -> Floats:
    """Σ R_i/F J0(k r_i) under the force at which the linear contact has radius a, (k,)."""
    contact, a_over_h = sphere_contact(Layer()), np.array([a])
    scaled = float(contact.force(a_over_h, 1.0, 1.0)[0])  # F R/(E h³): both F and δ are as 1/R
    radius = np.cbrt(scaled) / x
    force, depth = scaled / radius, float(contact.depth(a_over_h, radius, 1.0)[0])
    pressed = PressedLayer((Sublayer(1.0, Material()),), radius, _WIDER * a, fineness)
    pressed_states = [(share * depth, pressed.press(share * depth)) for share in _DEPTHS]
    while abs(pressed_states[-1][1] / force - 1) > _SAME_FORCE:
        (before, low), (depth, high) = pressed_states[-2:]
        depth += (force - high) * (depth - before) / (high - low)
        pressed_states.append((depth, pressed.press(depth)))
    return np.asarray(pressed.reaction @ j0(np.multiply.outer(pressed.r[pressed.base], k)) / pressed_states[-1][1])


def coefficients(a: float) -> tuple[Floats, float]:
    """c1 to c4 at a contact radius (4, k), and the largest residual of their fit."""
    k = WAVENUMBERS[WAVENUMBERS < HIGHEST_WAVENUMBER]
    spectra = np.array([spectrum_at(a, float(x), k) for x in LOADS])
    powers = LOADS[:, None] ** np.arange(5)
    fitted = np.linalg.lstsq(powers, spectra, rcond=None)[0]
    return fitted[1:], float(np.abs(powers @ fitted - spectra).max())


def main() -> None:
    """Solve every contact radius and write the coefficients c1 to c4, (radii, 4, k)."""
    with Pool(2) as pool:
        solved = pool.map(coefficients, RADII, chunksize=1)
    for a, (_, residual) in zip(RADII, solved, strict=True):
        print(f"a/h {a:.2f}: largest residual of the fit {residual:.1e}")
    fitted_spectra = np.array([fitted for fitted, _ in solved]).astype(np.float32)
    np.savez_compressed(DATA, a_over_h=RADII, coefficients=fitted_spectra, rim=RIM)


if __name__ == "__main__":
    main()
