"""Unlisted laws of curves that would look like an explanation, or would not show beside the null hypothesis.

Such a law acts as listed ones do: it multiplies the force, shifts the travel or adds a force, by a simple form of the
force, the depth, the time or the way back. Each is given the strength that the explanation's own mechanisms show, χ²
beyond what the nuisances take up, under the noise of the fit. It is imitated if the explanation would be named for it:
its parameters leave too little to be named, and without any one of its mechanisms more than that is left (all to first
order in the parameters). Beside the null hypothesis a law of a usual strength counts that would not show.

The prior of something unlisted times the share of such laws is their weight beside the explanation's own prior, and
never more than that: laws that are more probable are fitted themselves (selection/unlisted_search.py).
"""

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from underskin.diagnosis.data.names import NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.residuals import Linearised, force_and_slopes
from underskin.diagnosis.selection.priors import PRIORS, guess_count, least_evidence, log_prior
from underskin.diagnosis.validation.signatures import least_chi2
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.recordings.campaign import CurveConditions
from underskin.units import Floats

_FORMS: Mapping[str, Callable[[Floats], Floats]] = {  # of a variable from 0 to 1
    "root": np.sqrt,
    "linear": lambda x: x,
    "square": np.square,
    "exponential approach": lambda x: 1 - np.exp(-5 * x),
    "threshold": lambda x: np.maximum(x - 0.5, 0.0),
    "step": lambda x: (x > 0.5).astype(float),
}
_USUAL_CHANGE = 0.05  # of the force, as a root mean square: what a law changes that is taken for missing physics
_ROUNDING = 1e-6  # of a law's own χ²: what is left beyond the nuisances is rounding


def odds_of_imitated_laws(explanation: Explanation, null: Explanation, supported: int) -> float:
    """Odds, at most 1, that one of the unlisted laws is there that an explanation by `supported` mechanisms imitates,
    or, of the `null` hypothesis, one that would not show."""
    if not explanation.names:
        return _odds_of_hidden_laws(null, supported)
    hypothesis, fit = explanation.best.hypothesis, explanation.point.fit
    force, slopes, laws = _changes(explanation)
    null_model = null.best.hypothesis.model
    assert isinstance(null_model, CurveModel)
    change = force - null_model.forces(null.point.fit[None])[0]
    linearised = Linearised.of_forces(explanation, slopes, np.concatenate([laws, change[None]]))
    beyond_nuisances = linearised.chi2(slice(hypothesis.mechanism_parameter_count, None))
    visible = beyond_nuisances[:-1] > _ROUNDING * np.diag(linearised.of_changes)[:-1]
    if not (visible.any() and beyond_nuisances[-1] > 0):
        return 0.0
    strength = beyond_nuisances[-1] / beyond_nuisances[:-1][visible]
    least = least_chi2(supported, least_evidence(explanation))
    imitated = strength * linearised.chi2()[:-1][visible] < least
    for span in explanation.spans.values():
        imitated &= strength * linearised.chi2(np.delete(np.arange(len(fit)), span))[:-1][visible] > least
    return _odds(int(imitated.sum()), int(visible.sum()), guess_count(explanation), supported)


def _odds_of_hidden_laws(null: Explanation, supported: int) -> float:
    force, slopes, laws = _changes(null)
    size = np.sqrt((laws**2).mean(axis=1))
    laws = laws[size > 0] * (_USUAL_CHANGE * np.sqrt((force**2).mean()) / size[size > 0])[:, None]
    chi2 = Linearised.of_forces(null, slopes, laws).chi2()
    hidden = int((chi2 < least_chi2(supported, least_evidence(null))).sum())
    return _odds(hidden, len(laws), 0, supported)


def _odds(count: int, laws: int, size: int, supported: int) -> float:
    """Of an unlisted law beside a set of `size` mechanisms; the share of all such laws is by Jeffreys' prior, since
    these are a sample."""
    share = (count + 0.5) / (laws + 1)
    return min(float(PRIORS[NONE_OF_THESE] * share / np.exp(log_prior(size, supported))), 1.0)


def _changes(explanation: Explanation) -> tuple[Floats, Floats, Floats]:
    """The force (samples,), its derivatives by the parameters (parameters, samples), and the change of the force by
    each law (laws, samples), up to its strength."""
    force, slopes, stiffness = force_and_slopes(explanation)
    model, fit = explanation.best.hypothesis.model, explanation.point.fit
    assert isinstance(model, CurveModel)
    campaign = explanation.best.hypothesis.lines.campaign
    recordings = [recording for recording in campaign.recordings if isinstance(recording, CurveConditions)]
    return force, slopes, _law_changes(recordings, fit[model.contact_points], force, stiffness)


def _law_changes(
    recordings: Sequence[CurveConditions], contact_points: Floats, force: Floats, stiffness: Floats
) -> Floats:
    """`contact_points` (recordings,) [mm]; `force` and `stiffness`, its derivative by the travel, (samples,)."""
    travel = [np.asarray(recording.displacement_mm) for recording in recordings]
    depth = np.concatenate([np.maximum(mm - point, 0.0) for mm, point in zip(travel, contact_points, strict=True)])
    time = np.concatenate([times_of(recording) - times_of(recording)[0] for recording in recordings])
    way_back = np.concatenate([np.arange(len(mm)) > int(np.argmax(mm)) for mm in travel]).astype(float)
    variables = {"force": np.maximum(force, 0.0), "depth": depth, "time": time}
    shapes = {
        name: [form(variable / variable.max()) for form in _FORMS.values()]
        for name, variable in variables.items()
        if variable.max() > 0
    }
    forms = [way_back, *itertools.chain(*shapes.values())]
    laws = [factor * form for factor in (force, stiffness) for form in forms]
    return np.array([*laws, *shapes.get("time", [])])  # an added force follows time
