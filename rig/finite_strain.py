"""Effect of finite strain on the stress on the base: interpolates the coefficients that two solvers store.

Δ(k; a/h, x) = c1 x + c2 x² + c3 x³ + c4 x⁴ with x = L^(1/3), L = F/(R² E): a cubic spline over a/h, 0 at a/h = 0.
`finite_strain_solve` prescribes the Hertz pressure as a dead load; `contact_strain_solve` presses a sphere, which
takes most of that back, and a is that of the linear layer's contact under the same force.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from rig.errors import RigError
from rig.layer import RIM, WAVENUMBERS, Floats

LARGEST_LOAD = 0.1  # L
DEAD_PRESSURE, SPHERE = "finite_strain", "contact_strain"
WIDEST = {DEAD_PRESSURE: 3.2, SPHERE: 2.6}  # a/h


@lru_cache
def _curve(law: str) -> CubicSpline:
    with np.load(Path(__file__).with_name(f"{law}.npz")) as data:
        assert data["rim"] == RIM
        radii, coefficients = data["a_over_h"], data["coefficients"].astype(np.float64)
    return CubicSpline(np.append(0.0, radii), np.concatenate([0 * coefficients[:1], coefficients]))


def added_spectrum(a_over_h: Floats, load: Floats, law: str = DEAD_PRESSURE) -> Floats:
    """Addition Δ of finite strain to the spectrum p̂ M.

    Parameters
    ----------
    a_over_h : ndarray, (rows,)
        Contact radius over thickness.
    load : ndarray, (rows,)
        Load parameter L.
    law : str
        `DEAD_PRESSURE` or `SPHERE`.

    Returns
    -------
    ndarray, (rows, WAVENUMBERS)

    Raises
    ------
    RigError
        Where a contact or a load is beyond what was solved.
    """
    widest = WIDEST[law]
    if np.any(a_over_h > widest):
        raise RigError("contact radius", f"{np.max(a_over_h):.3g} h", f"must be at most {widest} h: lower preload_n")
    if np.any(load > LARGEST_LOAD):
        allowed = f"must be at most {LARGEST_LOAD}: lower preload_n, or a larger indenter_radius_mm"
        raise RigError("load parameter F/(R²E)", float(np.max(load)), allowed)
    powers = np.cbrt(load)[:, None] ** np.arange(1, 5)
    tabulated = np.einsum("rp,rpk->rk", powers, _curve(law)(a_over_h))
    added = np.zeros((len(tabulated), len(WAVENUMBERS)))
    added[:, : tabulated.shape[1]] = tabulated
    return added
