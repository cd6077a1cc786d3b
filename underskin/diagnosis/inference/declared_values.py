"""What the declared values of a skin may be off by, in d33."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.mechanisms.parameter import Normal
from underskin.physics.skin import INCOMPRESSIBLE, Indenter
from underskin.prediction.declared_skin import declared_skin, log_slopes
from underskin.recordings.conditions import Tolerances, frf_of
from underskin.units import to_si


def declared_d33(problem: FittingProblem, explanation: Explanation) -> float:
    """The standard deviation of ln d33 by the skin's tolerances, beyond what its fit allows the declared values.

    A prior's centre that is off by e moves the posterior mean of ln d33 by C/s² · e: C is the covariance of ln d33 and
    that factor, s the standard deviation of its prior. So a value that the recordings tell themselves moves nothing.
    """
    skin = problem.lines.campaign.skin
    off = skin.tolerances or Tolerances()
    best = explanation.best
    places = {parameter.name: place for place, parameter in enumerate(explanation.model.parameters)}
    index = {name: best.hypothesis.mean_places.index(places[name]) for name in ("d33", "youngs_modulus", "thickness")}
    variance = (_by_sensor_radius(problem) * off.sensor_radius_percent / 100) ** 2
    percents = {"youngs_modulus": off.youngs_modulus_percent, "thickness": off.thickness_percent}
    for name, percent in percents.items():
        prior = explanation.model.parameters[places[name]].prior
        assert isinstance(prior, Normal)
        moved = float(best.covariance[index["d33"], index[name]]) / prior.sd**2
        variance += moved**2 * max((percent / 100) ** 2 - prior.sd**2, 0.0)
    return float(np.sqrt(variance))


def _by_sensor_radius(problem: FittingProblem) -> float:
    """∂ ln FRF/∂ ln rT of the base model, the median of the recordings inside the table; 0 where none is."""
    campaign = problem.lines.campaign
    frfs = frf_of(campaign)
    skin = declared_skin(replace(campaign.skin, poisson_ratio=INCOMPRESSIBLE))  # as the table is
    indenter = Indenter(to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in frfs]))
    preload = to_si("preload_n", [entry.preload_n for entry in frfs])
    slopes = log_slopes(problem.table, skin, indenter, preload)["sensor_radius"]
    inside = np.isfinite(slopes)
    return float(np.median(slopes[inside])) if inside.any() else 0.0
