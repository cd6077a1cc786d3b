"""Force of a rigid sphere at a given depth, on the half space or the layer, with adhesion and stiffening.

Half space: F = (4/3) E' √R δ^(3/2), a² = Rδ; with adhesion δ = a²/R − √(2πaw/E'), F = 4E'a³/(3R) − √(8πwE'a³) on the
branch that is stable under a given displacement (Johnson, Kendall & Roberts 1971). Layer: contact_curves. A stiffening
elastomer multiplies F by its secant ratio at the representative strain 0.2 a/R (Lin, Dimitriadis & Horkay, J. Biomech.
Eng. 129 (2007) 904).
"""

import numpy as np
from numpy.typing import NDArray

from underskin.contact_curves import ContactCurves
from underskin.mechanisms.curve_state import Curve, stiffened
from underskin.mechanisms.differentiated import Array, Differentiated, chain
from underskin.units import Floats

_STRAIN = 0.2
_SMALLEST_DEPTH = 1e-12  # m; keeps the root's derivative finite
_LAST_STABLE = 0.25 ** (2 / 3)  # of x² − √x
_NEWTON_STEPS = 40


def force(
    curve: Curve, radius: Floats, depth: Differentiated, touched: NDArray[np.bool_], layer: ContactCurves | None
) -> tuple[Differentiated, NDArray[np.bool_]]:
    """F (rows,) [N] at depths [m], 0 where there is no contact, and which rows `layer` reaches.

    `touched` says that the surfaces have met before: only then adhesion holds at a depth below 0.
    """
    if layer is not None:
        answer, contact_radius, inside = _on_layer(curve, radius, depth, layer)
    elif curve.work_of_adhesion is None:
        answer, contact_radius, inside = _hertz(curve, radius, depth)
    else:
        answer, contact_radius, inside = _adhesive(curve, radius, depth, curve.work_of_adhesion)
    if curve.yeoh is not None:
        strain = _STRAIN * contact_radius / radius
        answer = answer * stiffened(1.0 - strain, curve.yeoh) / (3.0 * strain)
    held = touched & (True if curve.work_of_adhesion is not None else depth.value > 0)
    lost = np.isnan(answer.value)
    beyond = np.asarray(lost & (depth.value > 0) & ~inside)
    kept = held & ~lost
    return (
        Differentiated(np.where(kept, answer.value, 0.0), np.where(kept, answer.slopes, 0.0)),
        np.asarray(~(beyond & held)),
    )


def _hertz(curve: Curve, radius: Floats, depth: Differentiated) -> tuple[Differentiated, Differentiated, Array]:
    pressed = Differentiated(np.maximum(depth.value, _SMALLEST_DEPTH), depth.slopes)
    root = pressed**0.5
    answer = (4 / 3) * np.sqrt(radius) * curve.reduced_modulus * pressed * root
    return answer, np.sqrt(radius) * root, np.ones(len(radius), dtype=bool)


def _adhesive(
    curve: Curve, radius: Floats, depth: Differentiated, work: Differentiated
) -> tuple[Differentiated, Differentiated, Array]:
    # Lengths a = a0 x, a0³ = 2πwR²/E', in which δ R/a0² = x² − √x.
    unit = ((2 * np.pi) * radius**2 * work / curve.reduced_modulus) ** (1 / 3)
    scaled = depth * radius / (unit * unit)
    x = np.sqrt(np.maximum(scaled.value, 0.0)) + 1.0
    for _ in range(_NEWTON_STEPS):
        step = (x**2 - np.sqrt(x) - scaled.value) / (2 * x - 0.5 / np.sqrt(x))
        x = np.maximum(x - step, _LAST_STABLE * (1 + 1e-9))
        if not (np.abs(step) > 1e-13 * x).any():
            break
    pulled_off = scaled.value < _LAST_STABLE**2 - np.sqrt(_LAST_STABLE)
    slope = 1 / (2 * x - 0.5 / np.sqrt(x))
    a = unit * chain(np.where(pulled_off, np.nan, x), (slope, scaled))
    cube = a * a * a * curve.reduced_modulus
    return (4 / 3) * cube / radius - ((8 * np.pi) * work * cube) ** 0.5, a, np.ones(len(radius), dtype=bool)


def _on_layer(
    curve: Curve, radius: Floats, depth: Differentiated, layer: ContactCurves
) -> tuple[Differentiated, Differentiated, Array]:
    assert curve.thickness is not None
    h = curve.thickness
    scaled = depth * radius / (h * h)
    scale = curve.reduced_modulus * h * h * h / radius
    adhesion = curve.work_of_adhesion
    root = None if adhesion is None else radius * (adhesion / (curve.reduced_modulus * h * h * h)) ** 0.5
    if root is None:
        scaled = Differentiated(np.maximum(scaled.value, _SMALLEST_DEPTH), scaled.slopes)
    solved = layer.at_depth(scaled.value, np.zeros_like(scaled.value) if root is None else root.value)

    def differentiated(value: Floats, slopes: Floats) -> Differentiated:
        by_depth, by_root, by_poisson_ratio, _ = slopes
        terms = [(by_depth, scaled), (by_poisson_ratio, curve.poisson_ratio)]
        return chain(value, *terms, *([] if root is None else [(by_root, root)]))

    load = differentiated(solved.load.value, solved.load.slopes)
    alpha = differentiated(solved.alpha.value, solved.alpha.slopes)
    return scale * load, h * alpha, ~np.isnan(solved.alpha.value)
