"""The level that a law which nobody listed refers to: where its factor is 1 is a convention of its form.

A resonance beside the response may leave the low frequencies as they are, or the high ones: both fit alike, and d33
differs by what the law does between them. So d33 may be that of any line, or any recording.
"""

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.mechanisms.unnamed.laws import UnnamedLaw
from underskin.units import Floats

_LEVELS = 9  # evenly over the rows
_FACTORS = ("gain", "frequency_response")


def law_levels(problem: FittingProblem, explanation: Explanation) -> Floats:
    """Logarithms of the factors (levels,) by which d33 may be another, equally probable; 0 alone where no law is a
    factor."""
    known, names = problem.lines.mechanisms, explanation.names
    laws = [law for name in names if isinstance(law := known[name], UnnamedLaw) and law.spoken.acts_on in _FACTORS]
    if not laws:
        return np.zeros(1)
    left = tuple(name for name in names if all(name != law.name for law in laws))
    with_law, without = (problem.hypothesis(each, placed=False, whole=True) for each in (names, left))
    fit = np.zeros(len(without.model.parameters))
    for name, place in own_places(left, without.lines).items():
        fit[place] = explanation.own(name)
    fit[without.own_parameters :] = explanation.point.fit[with_law.own_parameters :]
    here, there = (
        np.abs(hypothesis.frf_model.predict(at, slopes=False, place=False).value)
        for hypothesis, at in ((with_law, explanation.point.fit), (without, fit))
    )
    some = (there > 0) & (here > 0)
    shares = (np.arange(_LEVELS) + 0.5) / _LEVELS
    return np.quantile(np.log(here[some] / there[some]), shares)
