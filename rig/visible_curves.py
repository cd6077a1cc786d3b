"""Visibility of effects in force–displacement curves: χ² of the base model's best fit less that of the truth.

Base models: indentation F = (4/3) E/(1 − ν²) √R (u − z)^(3/2), compression F = E A (u − z)/H, with a zero z for each
curve and one E, within 2 % of the declared one where there is one. Noise is the rig's own, that of displacement
through dF/du.
"""

import numpy as np
from scipy.optimize import least_squares

from rig.effects import INDENTATION
from rig.elastomer import RecordedCurve
from rig.experiment import Experiment
from rig.layer import Floats

_MODULUS = 0.02


def chi2_gain(experiment: Experiment, recorded: list[RecordedCurve]) -> float:
    """The gain in χ² of the truth over the base model."""
    curves = experiment.curves
    assert curves is not None
    displacement = [np.array(curve.entry["displacement_mm"]) for curve in recorded]
    force = [np.array(curve.entry["force_n"]) for curve in recorded]
    exact = [curve.exact_force_n for curve in recorded]
    deviation = [
        np.hypot(curves.force_noise_n, np.gradient(f, u) * curves.displacement_noise_mm)
        if curves.displacement_noise_mm
        else np.full(len(f), max(curves.force_noise_n, 1e-12))
        for f, u in zip(exact, displacement, strict=True)
    ]
    prior = _MODULUS if curves.modulus_declared else np.inf

    def residuals(fit: Floats) -> Floats:
        modulus = experiment.skin.youngs_modulus_mpa * np.exp(fit[0])
        parts = [
            (f - _base(experiment.kind, curve, u - zero, modulus)) / d
            for f, u, d, curve, zero in zip(force, displacement, deviation, recorded, fit[1:], strict=True)
        ]
        return np.concatenate([*parts, [fit[0] / prior]])

    start = np.zeros(1 + len(recorded))
    scale = np.append(0.1, np.full(len(recorded), 0.1 * curves.largest_displacement_mm))
    base = 2 * least_squares(residuals, start, x_scale=scale).cost
    true = sum(float(np.sum(((f - e) / d) ** 2)) for f, e, d in zip(force, exact, deviation, strict=True))
    return float(base - true)


def _base(kind: str, curve: RecordedCurve, displacement: Floats, modulus: float) -> Floats:
    if kind == INDENTATION:
        depth = np.maximum(displacement, 0)
        return np.asarray(4 / 3 * modulus / 0.75 * np.sqrt(curve.entry["indenter_radius_mm"]) * depth**1.5)
    area = np.pi / 4 * curve.entry["sample_diameter_mm"] ** 2
    return np.asarray(modulus * area * displacement / curve.entry["sample_height_mm"])
