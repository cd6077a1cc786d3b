"""What the declared values of a skin may be off by, in d33."""

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.mechanisms.parameter import Normal
from underskin.physics.skin import Indenter, Skin
from underskin.prediction.pressed_skin import frf_gradient, transmission
from underskin.recordings.conditions import Tolerances, frf_of
from underskin.units import Floats, to_si


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
    skin, frfs = problem.lines.campaign.skin, frf_of(problem.lines.campaign)
    assert skin.thickness_mm is not None
    assert skin.youngs_modulus_mpa is not None
    assert skin.sensor_radius_mm is not None
    declared = Skin.from_lab(
        thickness_mm=skin.thickness_mm,
        youngs_modulus_mpa=skin.youngs_modulus_mpa,
        sensor_radius_mm=skin.sensor_radius_mm,
        units_checked=True,
    )
    indenter = Indenter(to_si("indenter_radius_mm", [entry.indenter_radius_mm for entry in frfs]))
    preload = to_si("preload_n", [entry.preload_n for entry in frfs])
    table = problem.table
    slopes: Floats = frf_gradient(table, declared, indenter, preload, 1.0)["sensor_radius"] * declared.sensor_radius
    relative = slopes / transmission(table, declared, indenter, preload).frf(1.0)
    inside = np.isfinite(relative)
    return float(np.median(relative[inside])) if inside.any() else 0.0
