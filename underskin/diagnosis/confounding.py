"""Which mechanisms a campaign's design cannot tell from d33, E and h, or from each other; worked out before any fit.

Each mechanism's signature is what a typical strength of it (the quartile of its prior away from the limit) would change
in the base model's response. Under the noise that is usual, the information of all signatures and the nuisances is one
matrix JᵀC⁻¹J. What is left of a signature after the nuisances (with their priors) are taken out is the χ² by which the
mechanism would show; the cosine between two such remainders says whether they are twins.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.explanation import Workbench
from underskin.diagnosis.fit import COVARIANCE_NAMES, Fitter
from underskin.diagnosis.likelihood import Marginal, Moments, NoiseLevels
from underskin.diagnosis.smooth_error import TYPICAL
from underskin.mechanisms.catalogue import CATALOGUE
from underskin.mechanisms.mechanism import Normal, Parameter, Unsupported
from underskin.units import Floats

_LEAST_CHI2 = 9.0
_TWINS = 0.98
_GAIN = 0.022


@dataclass(frozen=True)
class Confounding:
    """`confounded_with` is another mechanism, "d33", or "noise" where too little of it shows."""

    mechanism: str
    confounded_with: str
    reason: str


def confounding(bench: Workbench) -> list[Confounding]:
    """What cannot be told apart here; mechanisms that the campaign does not support at all are not listed."""
    fitter = Fitter(bench.hypothesis((), placed=False, whole=True))
    base = fitter.evaluate(fitter.start(np.zeros(0)))
    names, signatures = [], []
    for name, mechanism in CATALOGUE.items():
        if bench.kind not in mechanism.kinds:
            continue
        parameters = mechanism.parameters(bench.lines.campaign, bench.kind)
        if any(entry.name in COVARIANCE_NAMES for entry in parameters):
            continue
        try:
            hypothesis = bench.hypothesis((name,), placed=False, whole=True)
        except Unsupported:
            continue
        fit = np.concatenate([[typical(entry) for entry in parameters], base.point.fit])
        names.append(name)
        signatures.append(hypothesis.model.predict(fit).value - base.prediction.value)
    if not names:
        return []
    slopes = np.concatenate([base.prediction.slopes, np.array(signatures)])
    prediction = replace(base.prediction, slopes=slopes)
    lines = bench.lines
    ratio = TYPICAL if lines.curves else 0.0
    moments = Moments(lines, prediction, np.zeros(lines.recordings), bench.curvature, 0.0, ratio)
    information, _ = Marginal(lines, moments, NoiseLevels(_GAIN, 1.0, 0.0, 0.01)).normal_equations()
    return _told(names, information, fitter.parameters)


def typical(entry: Parameter) -> float:
    """The fit coordinate of a typical strength."""
    if entry.limit is None or not isinstance(entry.prior, Normal):
        return entry.quantile(0.5)
    with np.errstate(divide="ignore"):
        limit = entry.limit if entry.scale == "linear" else float(np.log(entry.limit))
    if not np.isfinite(limit):
        return entry.quantile(0.5)
    return max(entry.quantile(0.25), entry.quantile(0.75), key=lambda end: abs(end - limit))


def _told(names: Sequence[str], information: Floats, nuisances: Sequence[Parameter]) -> list[Confounding]:
    count = len(nuisances)
    prior = np.diag([entry.prior.sd**-2 if isinstance(entry.prior, Normal) else 0.0 for entry in nuisances])
    own, shared, beside = information[count:, count:], information[count:, :count], information[:count, :count] + prior
    left = own - shared @ np.linalg.solve(beside, shared.T)
    chi2 = np.maximum(np.diag(left), 0.0)
    found = []
    for index, name in enumerate(names):
        if own[index, index] < _LEAST_CHI2:
            reason = f"at a typical strength it would show by χ² = {own[index, index]:.2g} only"
            found.append(Confounding(name, "noise", reason))
        elif chi2[index] < _LEAST_CHI2:
            reason = f"beyond what d33, E and h can take up, it would show by χ² = {chi2[index]:.2g} only"
            found.append(Confounding(name, "d33", reason))
    visible = [index for index in range(len(names)) if chi2[index] >= _LEAST_CHI2]
    for place, first in enumerate(visible):
        for second in visible[place + 1 :]:
            cosine = left[first, second] / np.sqrt(chi2[first] * chi2[second])
            apart = (1 - cosine**2) * min(chi2[first], chi2[second])
            if abs(cosine) > _TWINS or apart < _LEAST_CHI2:
                reason = f"their signatures are alike here (cosine {cosine:.2f})"
                found.append(Confounding(names[first], names[second], reason))
    return found
