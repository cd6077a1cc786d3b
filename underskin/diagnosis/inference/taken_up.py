"""What a fit to curves takes up of changes of the force: their χ², and what is left beside the parameters."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.curve_products import CurveProducts
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import Hypothesis
from underskin.diagnosis.inference.likelihood import Likelihoods
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.mechanisms.models.curves import CurveModel
from underskin.units import Floats, Indices

_FLAT = 1e-3  # of a parameter's bounds: deviations of the least prior, for those that change nothing


def force_and_slopes(explanation: Explanation) -> tuple[Floats, Floats, Floats]:
    """The force (samples,), its derivatives by the parameters (parameters, samples) and by the travel (samples,)."""
    model, fit = explanation.best.hypothesis.model, explanation.point.fit
    assert isinstance(model, CurveModel)
    force, slopes = (values[0] for values in model.forces_and_slopes(fit[None]))
    return force, slopes, -slopes[model.contact_points].sum(axis=0)


def precision_of(hypothesis: Hypothesis) -> Floats:
    """Of the parameters' priors (parameters,)."""
    return np.asarray(hypothesis.priors[0] + (_FLAT / np.ptp(hypothesis.bounds, axis=0)) ** 2)


def information(explanation: Explanation, rows: Floats, noise: Explanation | None = None) -> Floats:
    """Jᵀ C⁻¹ J of changes of the force J (changes, samples) under the noise that the explanation, or another, found."""
    fitter = Fitter([explanation.best.hypothesis])
    covariance = (noise or explanation).point.covariance
    at = fitter.evaluate(fitter.at(replace(explanation.point, covariance=covariance)))
    levels = fitter.levels(at.points.covariance[:, None])
    assert isinstance(at.products, CurveProducts)
    along, square = at.products.of_rows(rows, levels)
    likelihood = Likelihoods(fitter.lines, fitter.curvature, at.products, levels, at.points.bend)
    level2 = float(levels.level.flat[0]) ** 2
    return np.asarray(likelihood.information(along[None] / level2, square[None] / level2)[0])


def beside(whole: Floats, places: Indices, precision: Floats) -> Floats:
    """Of the `information` of parameters and further changes that of these changes (changes, changes), less what the
    parameters at `places` take up; `precision` of all parameters (parameters,)."""
    first = len(precision)
    own = whole[np.ix_(places, places)] + np.diag(precision[places])
    shared = whole[first:, places]
    return np.asarray(whole[first:, first:] - shared @ np.linalg.solve(own, shared.T))
