"""Where a parameter's 95 % interval ends by the profile of the posterior, which need not be Gaussian."""

import numpy as np

from underskin.diagnosis.inference.evidence import held_points
from underskin.diagnosis.inference.laplace import Evidence
from underskin.diagnosis.inference.optimizer import Fitter

_FALL = 1.92  # of the log posterior density at the ends: half of the 95 % quantile of χ² with one degree of freedom
_STRIDES = 8


def profile_end(evidence: Evidence, place: int, limit: float) -> float | None:
    """Where between a limit and the most probable value the log posterior density has fallen by 1.92.

    Parameters
    ----------
    evidence
        The fit.
    place
        Of the parameter among the model's; the others are fitted anew at each of its values.
    limit
        Fit coordinate.

    Returns
    -------
    float or None
        Fit coordinate; None where the density has not fallen that far at the limit: the interval goes beyond it.
    """
    entry = evidence.hypothesis.model.parameters[place]
    middle = float(evidence.point.fit[place])
    values = np.linspace(np.clip(limit, *entry.bounds), middle, _STRIDES, endpoint=False)
    held = Fitter([evidence.hypothesis], held=[(place,)])
    begun = held.evaluate(held_points(held, [evidence], [place], [0] * _STRIDES, values))
    fitted = held.descend(held.settle(begun, 1), 1)
    priors = np.array([entry.log_prior(value) for value in values.tolist()])
    fallen = np.append(fitted.cost - priors - evidence.cost, 0.0)
    beyond = np.flatnonzero(fallen > _FALL)
    if not len(beyond):
        return None
    values = np.append(values, middle)
    last = int(beyond[-1])
    share = (fallen[last] - _FALL) / (fallen[last] - fallen[last + 1])
    return float(values[last] + share * (values[last + 1] - values[last]))
