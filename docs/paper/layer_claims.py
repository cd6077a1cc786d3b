"""The paper's statements about the layer's surface and about tension next to the contact."""

from dataclasses import dataclass

import numpy as np

from docs.paper.markdown import percent
from docs.paper.prototype import INDENTERS_MM, RHO, SKIN
from underskin.physics import elastic_layer
from underskin.physics.elastic_layer import ContactEquation
from underskin.units import Floats

_THICKER_MM = np.linspace(1.5, 5.0, 8)
_OFFSETS = np.linspace(0.0, 4.0, 161)
_PRELOAD_N = 1.0


@dataclass(frozen=True)
class Claim:
    """One row: the paper's statement, the finding here, and the verdict."""

    claim: str
    found: str
    verdict: str


def surface_deflection() -> Claim:
    """Section 2.1, the other half of what it says about thickness."""
    depth = _depth_mm(_THICKER_MM)
    grows = percent(float(np.interp(5.0, _THICKER_MM, depth)), float(np.interp(2.5, _THICKER_MM, depth)))
    return Claim(
        "A thicker layer exalts its surface deflection under contact forces (section 2.1)",
        f"the sphere sinks {1e3 * depth[0]:.0f} µm into 1.5 mm and {1e3 * depth[-1]:.0f} µm into 5 mm (R 4 mm, 1 N, "
        f"contact with the bonded layer): from 2.5 to 5 mm {grows:+.0f} %",
        "holds" if bool(np.all(np.diff(depth) > 0)) else "does not hold",
    )


def tension() -> Claim:
    """Section 1: how tangential forces are told by sensors of pressure alone."""
    layer = elastic_layer.Layer(0.5)
    normal = elastic_layer.gamma_n(layer, _OFFSETS, RHO)
    tangential = elastic_layer.gamma_t(layer, _OFFSETS, RHO)
    most = int(np.argmax(tangential))
    confirmed = bool(normal.min() >= 0) and bool(tangential[most] > 0)
    return Claim(
        "A tangential force is told by tensile stress just outside the compressed region alone (section 1)",
        f"a normal force makes no tension on the base (γ_n ≥ {max(normal.min(), 0.0):.3f} up to 4 h away, "
        f"{normal[0]:.2f} below it); a tangential one presses on one side and pulls as much on the other, most at "
        f"{_OFFSETS[most]:.2f} h, with {100 * tangential[most] / normal[0]:.0f} % of what an equal normal force gives "
        "below it",
        "holds" if confirmed else "does not hold",
    )


def _depth_mm(thickness_mm: Floats) -> Floats:
    """How far the small sphere sinks into bonded layers, (n,) [mm]."""
    alpha = np.linspace(0.02, 1.6, 400)
    solved = ContactEquation(alpha).solve(elastic_layer.Layer(0.5))
    force = solved.sphere_force.value * 4 * alpha**3 / 3  # F R/(E' h³)
    depth = solved.sphere_depth.value * alpha**2  # δ R/h²
    h, radius = thickness_mm * 1e-3, INDENTERS_MM[0] * 1e-3
    plane_strain = float(SKIN.youngs_modulus) / (1 - 0.5**2)
    at = np.interp(_PRELOAD_N * radius / (plane_strain * h**3), force, alpha)
    return np.asarray(1e3 * np.interp(at, alpha, depth) * h**2 / radius)
