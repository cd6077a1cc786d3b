"""Hertz's law by nanite's model function and lmfit's least squares, as nanite fits it; in an environment of its own.

Curves as JSON on standard input, fits as JSON on standard output.
"""

import json
import sys
from typing import Any

import lmfit  # type: ignore[import-not-found]  # in an environment of its own
import numpy as np
from nanite.model import model_hertz_paraboloidal as hertz  # type: ignore[import-not-found]  # as well


def fitted(curve: dict[str, Any]) -> dict[str, float]:
    """E [Pa], contact point [m] and the sum of squares [N²] of the best of the fits from several starts."""
    tip, force = (np.array(curve[name]) for name in ("tip_m", "force_n"))  # (samples,)

    def residuals(parameters: lmfit.Parameters) -> Any:
        return hertz.hertz_paraboloidal(tip, **parameters.valuesdict()) - force

    fits = []
    for modulus, contact_point, baseline in curve["starts"]:
        parameters = hertz.get_parameter_defaults()
        parameters["R"].value, parameters["nu"].value = curve["radius_m"], curve["poisson_ratio"]
        parameters["E"].value = modulus
        parameters["contact_point"].value, parameters["baseline"].value = contact_point, baseline
        fits.append(lmfit.minimize(residuals, parameters))
    best = min(fits, key=lambda fit: float((fit.residual**2).sum()))
    values = best.params.valuesdict()
    squares = float((best.residual**2).sum())
    return {"youngs_modulus_pa": values["E"], "contact_point_m": values["contact_point"], "left_n2": squares}


json.dump([fitted(curve) for curve in json.load(sys.stdin)], sys.stdout)
