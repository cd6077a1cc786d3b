"""How much better the recordings are described: errors before and after, in sample and on groups held out."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import NOTHING_MISSING
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.reporting.numbers import SDS_OF_95, parameter, place_of, rounded, with_hidden
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.curve_knowledge import hidden_factors, may_hide
from underskin.diagnosis.validation import cross_validation
from underskin.mechanisms.unnamed.laws import UnnamedLaw

_FACTOR = "modulus_factor"  # of modulus_error


def explains_percent(
    search: Search,
    problem: FittingProblem,
    explanation: Explanation,
    name: str,
    whole: cross_validation.PredictionScore,
) -> float | None:
    """How much of the base model's misfit beyond noise comes back where the mechanism is left out of its set [%].

    None where the misfit without it is no larger than noise makes it: an effect that only many recordings together
    tell. A mechanism that adds variance takes nothing away (see `_share_of_variance`).
    """
    own = problem.lines.mechanisms[name].parameters(problem.lines.campaign, problem.kind)
    if any(entry.acts_on == "line_variance" for entry in own):
        return round(100 * _share_of_variance(explanation), 1)
    rest = tuple(entry for entry in explanation.names if entry != name)
    known = [entry for entry in (*search.explanations, *search.laws) if entry.names == rest]
    without = known[0] if known else problem.explain([Request(rest)])[0]
    assert without is not None  # alone, nothing is left out
    nothing = next(entry for entry in search.explanations if not entry.names)
    noise = whole.noise / whole.size
    of_base, beyond = (_relative_square(problem, entry) - noise for entry in (nothing, without))
    left = max(whole.square / whole.size - noise, 0.0)
    back = (beyond - left) / max(of_base, beyond) if beyond > 0 else None
    return None if back is None else round(100 * float(np.clip(back, 0.0, 1.0)), 1)


def _relative_square(problem: FittingProblem, explanation: Explanation) -> float:
    misfit = cross_validation.in_sample(problem, explanation)
    return misfit.square / misfit.size


def _share_of_variance(explanation: Explanation) -> float:
    """What mains pick-up is of the lines' variance where it acts: Σ q² · q²/(q² + n²) / Σ q², n a line's own noise."""
    best = explanation.best
    pickup = best.pickup_variance
    noise = (best.levels.level * best.hypothesis.lines.deviation) ** 2
    return float((pickup**2 / (pickup + noise)).sum() / pickup.sum())


def fit_summary(
    search: Search, problem: FittingProblem, groups: Sequence[cross_validation.HeldOut], explanation: Explanation
) -> dict[str, Any]:
    """Errors before and after, held-out groups, the fitted noise, and of curves the modulus."""
    nothing = next(entry for entry in search.explanations if not entry.names)
    inside = [cross_validation.in_sample(problem, entry) for entry in (nothing, explanation)]
    outside = cross_validation.total(groups)
    parts = {
        name: {
            "rmse_percent": rounded(fitted.rmse_percent),
            **_least_squares(problem, entry),
            **({"correlated_rmse_percent": rounded(fitted.rmse_percent)} if problem.lines.curves else {}),
            "heldout_rmse_percent": rounded(left.rmse_percent),
            "log_score": rounded(left.log_score / left.recordings) if left.recordings else None,
            **({"youngs_modulus": modulus(problem, entry)} if problem.lines.curves else {}),
        }
        for name, entry, fitted, left in zip(("before", "after"), (nothing, explanation), inside, outside, strict=True)
    }
    floor = outside[1].floor_percent if outside[1].recordings else inside[1].floor_percent
    return {
        **parts,
        "mechanisms": [
            name for name in explanation.names if name in problem.lines.mechanisms.named
        ],  # of `after`, also where something beyond them is unexplained
        "noise_floor_percent": rounded(floor),
        "groups": [
            {
                "group": entry.group,
                "chosen": [_plainly(problem, name) for name in entry.chosen] or [NOTHING_MISSING],
                "before_rmse_percent": rounded(entry.before.rmse_percent),
                "after_rmse_percent": rounded(entry.after.rmse_percent),
                "noise_floor_percent": rounded(entry.after.floor_percent),
            }
            for entry in groups
        ],
        "noise": _noise(explanation),
    }


def _plainly(problem: FittingProblem, name: str) -> str:
    """A mechanism's name; of a law that nobody listed where it enters, what it follows, its form."""
    law = problem.lines.mechanisms[name]
    if not isinstance(law, UnnamedLaw):
        return name
    return f"unnamed: {law.spoken.acts_on} over {law.spoken.axis}, {law.spoken.form}"


def _least_squares(problem: FittingProblem, explanation: Explanation) -> dict[str, float | None]:
    """Of indentations, what plain least squares of the same law leave [%], and their modulus [MPa]."""
    if problem.kind != "indentation":
        return {}
    fit, left = explanation.least_squares
    place = place_of(explanation, "youngs_modulus")
    declared = problem.lines.campaign.skin.youngs_modulus_mpa or 1.0  # of which the parameter is a factor
    modulus_mpa = declared * float(explanation.model.parameters[place].from_fit(float(fit[place])))
    return {"rmse_percent": rounded(left), "least_squares_modulus_mpa": rounded(modulus_mpa)}


def modulus(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    """Young's modulus under an explanation, with its 95 % interval, which allows for what an apparent modulus hides;
    from factors on what was declared, or free."""
    mechanisms = problem.lines.mechanisms
    hiding = may_hide(mechanisms, problem.lines.campaign, mechanisms.named)
    return with_hidden(_apparent_modulus(problem, explanation), hidden_factors(hiding, explanation.names))


def _apparent_modulus(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    fitted = parameter(explanation, place_of(explanation, "youngs_modulus"))
    declared = problem.lines.campaign.skin.youngs_modulus_mpa
    if declared is None:
        return fitted
    names = [entry.name for entry in explanation.model.parameters]
    if _FACTOR in names:
        fitted = {**fitted, **_product(explanation, [names.index("youngs_modulus"), names.index(_FACTOR)])}
    scaled = {name: rounded(declared * fitted[name]) for name in ("value", "low", "high")}
    return {**fitted, "unit": "MPa", **scaled}


def _product(explanation: Explanation, places: Sequence[int]) -> dict[str, float | None]:
    """Of parameters on a logarithmic scale, with the 95 % interval."""
    rows = [explanation.best.hypothesis.mean_places.index(place) for place in places]
    middle = float(explanation.point.fit[list(places)].sum())
    half = SDS_OF_95 * float(np.sqrt(explanation.best.covariance[np.ix_(rows, rows)].sum()))
    return {
        key: rounded(float(np.exp(middle + way * half)), 6) for key, way in (("value", 0), ("low", -1), ("high", 1))
    }


def _noise(explanation: Explanation) -> dict[str, Any]:
    levels = explanation.best.levels
    return {
        "gain_percent": rounded(100 * levels.gain),
        "position_mm": rounded(1e3 * levels.position),
        "line_level": rounded(levels.level),
        "smooth_percent": rounded(100 * levels.smooth),
    }
