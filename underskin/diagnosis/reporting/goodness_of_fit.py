"""How well the answer fits, what warns of it, and what each kind of recording adds.

How much better the recordings are described: errors before and after, in sample and on groups held out. Findings on the
stated explanation itself: what in its fit should not be taken at face value. What each kind of recording told, and
where they contradict each other, as a report has it.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import NOTHING_MISSING, SIMPLEST, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.reporting.numbers import SDS_OF_95, at_bounds, parameter, place_of, rounded, with_hidden
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import OfCurves, hidden_factors, may_hide
from underskin.diagnosis.selection.search import KindsTogether
from underskin.diagnosis.validation import cross_validation
from underskin.diagnosis.validation.cross_validation import NOISY
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import in_percent
from underskin.mechanisms.base import Kind, Mechanism
from underskin.mechanisms.unlisted.expressions import CurveLaw
from underskin.mechanisms.unlisted.laws import UnlistedLaw, in_plain_words

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
    if not isinstance(law, UnlistedLaw):
        return name
    return f"unnamed: {law.description.acts_on} over {law.description.axis}, {law.description.form}"


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
    rows = [explanation.best.hypothesis.mean_indices.index(place) for place in places]
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


# With depth, as a layer on a stiff base does
_STIFFENS = ("strain_stiffening", "compressible_layer", "layered_contact")


def fit_warnings(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """Parameters at their bounds, recordings beyond the tables as found or as declared, noise that is larger than the
    lines' own, and a thickness that only the curves tell."""
    found = [
        *(one.finding for one in at_bounds(explanation)),
        *_beyond_tables(problem, explanation),
        *_noisy(problem, explanation),
    ]
    return [*found, *_kept(problem, explanation), *_of_unknown_thickness(problem, explanation)]


def _beyond_tables(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    best = explanation.best
    outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
    known = [in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names]
    answer = in_words(known) or SIMPLEST[problem.kind]
    entries = problem.lines.campaign.recordings
    return [
        Finding(Reason.OUT_OF_TABLES_FITTED, entries[number].id, "preload_n", {"answer": answer})
        for number in outside.tolist()
    ]


def _kept(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """On contacts that lie within the tables as found, and beyond them as declared."""
    if problem.kind != "frf":
        return []
    best, skin = explanation.best, problem.lines.campaign.skin
    kept = np.unique(best.hypothesis.lines.recording[best.prediction.inside & ~explanation.model.valid])
    if not len(kept):
        return []
    assert skin.youngs_modulus_mpa is not None
    fit = dict(zip([entry.name for entry in explanation.model.parameters], explanation.point.fit, strict=True))
    found_mpa = None
    if "modulus_factor" in fit:
        found_mpa = skin.youngs_modulus_mpa * float(np.exp(fit["modulus_factor"] + fit["youngs_modulus"]))
    arguments = {
        "contacts": len(kept),
        "recordings": problem.lines.recordings,
        "declared_mpa": skin.youngs_modulus_mpa,
        "found_mpa": found_mpa,
        "answer": in_words([in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names]),
    }
    return [Finding(Reason.CONTACTS_KEPT, "", "skin.youngs_modulus_mpa", arguments)]


def _noisy(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    level = explanation.best.levels.level
    if problem.lines.curves or level < NOISY:
        return []
    return [Finding(Reason.LINE_NOISE_LEVEL, "", "frf_re_pc_per_n", {"level": level})]


def _of_unknown_thickness(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    if problem.kind != "indentation" or problem.lines.campaign.skin.thickness_mm is not None:
        return []
    mechanisms = [problem.lines.mechanisms[name] for name in explanation.names]
    alike = [one for one in mechanisms if one.name in _STIFFENS or _of_depth(one)]
    if not alike:
        return []
    answer = in_words([in_plain_words(one) for one in alike])
    is_tried = "layered_contact" in problem.lines.mechanisms.named
    return [Finding(Reason.THICKNESS_UNKNOWN, "", "thickness_mm", {"answer": answer, "is_tried": is_tried})]


def _of_depth(mechanism: Mechanism) -> bool:
    return isinstance(mechanism, CurveLaw) and mechanism.description.axis in ("displacement_mm", "force_n")


_CALLED: Mapping[Kind, str] = {"frf": "the FRFs", "indentation": "the indentations", "compression": "the block"}
_MODULUS_ERROR = "modulus_error"


def by_kind(joined: KindsTogether, leading: Sequence[str]) -> list[dict[str, Any]]:
    """E by each kind alone, and from curves the parameters of their mechanisms under the leading set, or under what the
    curves alone find where the kinds contradict each other; empty where there is one kind."""
    if joined.beside is None or joined.apart is None:
        return []
    told = []
    for kind in joined.beside.kinds:
        known = joined.beside.told_alone(kind) if joined.apart_is_likelier else joined.beside.told(kind, leading)
        explanation = known.best
        stated = [_of_elastomer(parameter(explanation, place_of(explanation, "youngs_modulus")), known)]
        for own in parameter_slices(explanation.names, explanation.best.hypothesis.lines).values():
            stated += [parameter(explanation, place) for place in range(own.start, own.stop)]
        told += [{"kind": kind.kind, **_entry(entry)} for entry in stated]
    own_modulus = _modulus_alone(joined)
    return told if own_modulus is None else [own_modulus, *told]


def _of_elastomer(modulus: Mapping[str, Any], known: OfCurves) -> dict[str, Any]:
    """With an interval that allows for what an apparent modulus hides, and for how the skin's may differ."""
    return with_hidden(modulus, known.hidden, known.tolerance)


def _entry(stated: Mapping[str, Any]) -> dict[str, Any]:
    return {"parameter": stated["name"], **{key: stated[key] for key in ("unit", "value", "low", "high")}}


def _modulus_alone(joined: KindsTogether) -> dict[str, Any] | None:
    """E as the recordings of the first kind alone have it; None where they do not ask for another than is declared."""
    assert joined.apart is not None
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    leader = joined.apart.answers[0]
    explanation = joined.apart.fit_behind(leader)
    kind = {"kind": joined.problem.kind}
    if declared is None:
        return {**kind, **_entry(parameter(explanation, place_of(explanation, "youngs_modulus")))}
    if _MODULUS_ERROR not in explanation.names:
        return None
    place = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[_MODULUS_ERROR].start
    factor = parameter(explanation, place)
    ends = {key: rounded(declared * factor[key]) for key in ("value", "low", "high")}
    return {**kind, "parameter": "youngs_modulus", "unit": "MPa", **ends}


def moduli_clause(joined: KindsTogether, told: Sequence[Mapping[str, Any]]) -> str:
    """E by kind; empty where there is one kind."""
    moduli = [entry for entry in told if entry["parameter"] == "youngs_modulus"]
    if not moduli:
        return ""
    each = ", ".join(
        f"E from {_CALLED[entry['kind']]}: {entry['value']:.3g} MPa (95 %: {entry['low']:.3g} to {entry['high']:.3g})"
        for entry in moduli
    )
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    return f"{each}, declared {declared:g}" if declared is not None else each


def contradictions(joined: KindsTogether) -> list[dict[str, Any]]:
    """That the kinds are not of one material, where this is more probable than that they are."""
    if joined.beside is None or not joined.apart_is_likelier:
        return []
    kinds = [joined.problem.kind, *(kind.kind for kind in joined.beside.kinds)]
    named = " and ".join(_CALLED[kind] for kind in kinds)
    said = (
        f"{named[0].upper()}{named[1:]} contradict each other (probability {in_percent(joined.contradictory)}): they "
        "are not of one material, or one of them is wrong, so each is explained alone."
    )
    return [{"parameter": "youngs_modulus", "kinds": kinds, "statement": said}]


def of_curves_alone(joined: KindsTogether, names: Sequence[str], leading: Sequence[str]) -> list[dict[str, Any]]:
    """Name, parameters and share of the misfit of mechanisms that act on the curves beside alone."""
    entries = []
    for kind in () if joined.beside is None else joined.beside.kinds:
        assert joined.beside is not None
        told = joined.beside.told(kind, leading)
        entries += [
            _of_mechanism(name, explanation, told.each[0][0])
            for explanation, _ in told.each
            for name in names
            if name in explanation.names
        ]
    return entries


def _of_mechanism(name: str, explanation: Explanation, without: Explanation) -> dict[str, Any]:
    places = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[name]
    left, all_of_it = (_left(entry) for entry in (explanation, without))
    return {
        "name": name,
        "parameters": [parameter(explanation, place) for place in range(places.start, places.stop)],
        "explains_percent": rounded(100 * max(1 - left / max(all_of_it, 1e-300), 0.0), 3),
    }


def _left(explanation: Explanation) -> float:
    """Σ (F − model)² of the samples, what the cell may add not counted."""
    predicted = explanation.model.predict(explanation.point.fit).value.real
    return float(((explanation.best.hypothesis.lines.value.real - predicted) ** 2).sum())
