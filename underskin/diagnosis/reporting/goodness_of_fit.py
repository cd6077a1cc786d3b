"""How well the answer fits, findings on the fit, and what each kind of recording contributes.

Errors before and after, in sample and on held-out groups; parameters at bounds, contacts beyond the tables and large
noise as findings; Young's modulus by kind of recording, and contradictions between the kinds.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import NOTHING_MISSING, SIMPLEST, in_words
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import parameter_slices
from underskin.diagnosis.reporting.numbers import (
    SDS_OF_95,
    at_bounds,
    parameter_index,
    parameter_with_interval,
    rounded,
    with_hidden,
)
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import CurvePosterior, hidden_factors, may_hide
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
    score: cross_validation.PredictionScore,
) -> float | None:
    """Share of the base model's misfit beyond noise that returns where the mechanism is left out of its set [%].

    None where the misfit without it is within noise: an effect that only many recordings together show. A mechanism
    that adds variance reduces no misfit (see `_share_of_variance`).
    """
    mechanism_parameters = problem.lines.mechanisms[name].parameters(problem.lines.campaign, problem.kind)
    if any(parameter.acts_on == "line_variance" for parameter in mechanism_parameters):
        return round(100 * _share_of_variance(explanation), 1)
    rest = tuple(other for other in explanation.names if other != name)
    fitted = [candidate for candidate in (*search.explanations, *search.laws) if candidate.names == rest]
    without = fitted[0] if fitted else problem.explain([Request(rest)])[0]
    assert without is not None  # a single request is never pruned
    base = next(candidate for candidate in search.explanations if not candidate.names)
    noise = score.noise / score.size
    misfit_of_base, misfit_without = (_relative_square(problem, candidate) - noise for candidate in (base, without))
    misfit = max(score.square / score.size - noise, 0.0)
    share = (misfit_without - misfit) / max(misfit_of_base, misfit_without) if misfit_without > 0 else None
    return None if share is None else round(100 * float(np.clip(share, 0.0, 1.0)), 1)


def _relative_square(problem: FittingProblem, explanation: Explanation) -> float:
    misfit = cross_validation.in_sample(problem, explanation)
    return misfit.square / misfit.size


def _share_of_variance(explanation: Explanation) -> float:
    """Share of mains pick-up q in the lines' variance, Σ q² · q²/(q² + n²) / Σ q², n being a line's own noise."""
    best = explanation.best
    pickup = best.pickup_variance
    noise = (best.levels.level * best.hypothesis.lines.deviation) ** 2
    return float((pickup**2 / (pickup + noise)).sum() / pickup.sum())


def fit_summary(
    search: Search, problem: FittingProblem, groups: Sequence[cross_validation.HeldOut], explanation: Explanation
) -> dict[str, Any]:
    """Errors before and after, held-out groups, the fitted noise, and the modulus of curves."""
    base = next(candidate for candidate in search.explanations if not candidate.names)
    inside = [cross_validation.in_sample(problem, candidate) for candidate in (base, explanation)]
    outside = cross_validation.total(groups)
    parts = {
        name: {
            "rmse_percent": rounded(fitted.rmse_percent),
            **_least_squares(problem, candidate),
            **({"correlated_rmse_percent": rounded(fitted.rmse_percent)} if problem.lines.curves else {}),
            "heldout_rmse_percent": rounded(held_out.rmse_percent),
            "log_score": rounded(held_out.log_score / held_out.recordings) if held_out.recordings else None,
            **({"youngs_modulus": modulus(problem, candidate)} if problem.lines.curves else {}),
        }
        for name, candidate, fitted, held_out in zip(
            ("before", "after"), (base, explanation), inside, outside, strict=True
        )
    }
    floor = outside[1].floor_percent if outside[1].recordings else inside[1].floor_percent
    return {
        **parts,
        "mechanisms": [
            name for name in explanation.names if name in problem.lines.mechanisms.named
        ],  # of `after`, also where a misfit beyond them is unexplained
        "noise_floor_percent": rounded(floor),
        "groups": [
            {
                "group": group.group,
                "chosen": [_plainly(problem, name) for name in group.chosen] or [NOTHING_MISSING],
                "before_rmse_percent": rounded(group.before.rmse_percent),
                "after_rmse_percent": rounded(group.after.rmse_percent),
                "noise_floor_percent": rounded(group.after.floor_percent),
            }
            for group in groups
        ],
        "noise": _noise(explanation),
    }


def _plainly(problem: FittingProblem, name: str) -> str:
    """A mechanism's name; of an unlisted law the quantity it acts on, its axis and its form."""
    law = problem.lines.mechanisms[name]
    if not isinstance(law, UnlistedLaw):
        return name
    return f"unnamed: {law.description.acts_on} over {law.description.axis}, {law.description.form}"


def _least_squares(problem: FittingProblem, explanation: Explanation) -> dict[str, float | None]:
    """Of indentations, the residual of a plain least-squares fit of the same law [%], and its modulus [MPa]."""
    if problem.kind != "indentation":
        return {}
    fit, residual_percent = explanation.least_squares
    index = parameter_index(explanation, "youngs_modulus")
    declared = problem.lines.campaign.skin.youngs_modulus_mpa or 1.0  # the parameter is a factor on it
    modulus_mpa = declared * float(explanation.model.parameters[index].from_fit(float(fit[index])))
    return {"rmse_percent": rounded(residual_percent), "least_squares_modulus_mpa": rounded(modulus_mpa)}


def modulus(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    """Young's modulus under an explanation with its 95 % interval, from factors on the declared one, or free.

    The interval allows for mechanisms that an apparent modulus may hide.
    """
    hiding = may_hide(problem.lines.campaign, problem.lines.mechanisms.named)
    return with_hidden(_apparent_modulus(problem, explanation), hidden_factors(hiding, explanation.names))


def _apparent_modulus(problem: FittingProblem, explanation: Explanation) -> dict[str, Any]:
    fitted = parameter_with_interval(explanation, parameter_index(explanation, "youngs_modulus"))
    declared = problem.lines.campaign.skin.youngs_modulus_mpa
    if declared is None:
        return fitted
    names = [parameter.name for parameter in explanation.model.parameters]
    if _FACTOR in names:
        fitted = {**fitted, **_product(explanation, [names.index("youngs_modulus"), names.index(_FACTOR)])}
    scaled = {name: rounded(declared * fitted[name]) for name in ("value", "low", "high")}
    return {**fitted, "unit": "MPa", **scaled}


def _product(explanation: Explanation, indices: Sequence[int]) -> dict[str, float | None]:
    """The product of parameters on a logarithmic scale, with its 95 % interval."""
    rows = [explanation.best.hypothesis.mean_indices.index(index) for index in indices]
    middle = float(explanation.point.fit[list(indices)].sum())
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


# Mechanisms that stiffen the response with depth, as a layer on a stiff base does
_STIFFENS = ("strain_stiffening", "compressible_layer", "layered_contact")


def fit_warnings(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """Findings on the fit: parameters at bounds, contacts beyond the tables (fitted or declared), noise larger than the
    lines' own, and a thickness inferred from curves alone."""
    findings = [
        *(bound.finding for bound in at_bounds(explanation)),
        *_beyond_tables(problem, explanation),
        *_noisy(problem, explanation),
    ]
    return [*findings, *_within_fitted_tables(problem, explanation), *_of_unknown_thickness(problem, explanation)]


def _beyond_tables(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    best = explanation.best
    outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
    mechanisms = [in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names]
    answer = in_words(mechanisms) or SIMPLEST[problem.kind]
    recordings = problem.lines.campaign.recordings
    return [
        Finding(Reason.OUT_OF_TABLES_FITTED, recordings[index].id, "preload_n", {"answer": answer})
        for index in outside.tolist()
    ]


def _within_fitted_tables(problem: FittingProblem, explanation: Explanation) -> list[Finding]:
    """The finding on contacts that lie within the tables with the fitted modulus, and beyond them with the declared."""
    if problem.kind != "frf":
        return []
    best, skin = explanation.best, problem.lines.campaign.skin
    recordings = np.unique(best.hypothesis.lines.recording[best.prediction.inside & ~explanation.model.valid])
    if not len(recordings):
        return []
    assert skin.youngs_modulus_mpa is not None
    fit = dict(zip([parameter.name for parameter in explanation.model.parameters], explanation.point.fit, strict=True))
    fitted_mpa = None
    if "modulus_factor" in fit:
        fitted_mpa = skin.youngs_modulus_mpa * float(np.exp(fit["modulus_factor"] + fit["youngs_modulus"]))
    arguments = {
        "contacts": len(recordings),
        "recordings": problem.lines.recordings,
        "declared_mpa": skin.youngs_modulus_mpa,
        "found_mpa": fitted_mpa,
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
    stiffening = [mechanism for mechanism in mechanisms if mechanism.name in _STIFFENS or _of_depth(mechanism)]
    if not stiffening:
        return []
    answer = in_words([in_plain_words(mechanism) for mechanism in stiffening])
    is_tried = "layered_contact" in problem.lines.mechanisms.named
    return [Finding(Reason.THICKNESS_UNKNOWN, "", "thickness_mm", {"answer": answer, "is_tried": is_tried})]


def _of_depth(mechanism: Mechanism) -> bool:
    return isinstance(mechanism, CurveLaw) and mechanism.description.axis in ("displacement_mm", "force_n")


_KIND_WORDS: Mapping[Kind, str] = {"frf": "the FRFs", "indentation": "the indentations", "compression": "the block"}
_MODULUS_ERROR = "modulus_error"


def by_kind(joined: KindsTogether, leading: Sequence[str]) -> list[dict[str, Any]]:
    """E by each kind alone, and the parameters of the curves' own mechanisms; empty where there is one kind.

    The parameters are those under the leading set, or under the curves' own best set where the kinds contradict each
    other.
    """
    if joined.other_kinds is None or joined.apart is None:
        return []
    rows = []
    for kind in joined.other_kinds.kinds:
        curves = (
            joined.other_kinds.posterior_alone(kind)
            if joined.apart_is_likelier
            else joined.other_kinds.posterior(kind, leading)
        )
        explanation = curves.best
        parameters = [
            _of_elastomer(parameter_with_interval(explanation, parameter_index(explanation, "youngs_modulus")), curves)
        ]
        for span in parameter_slices(explanation.names, explanation.best.hypothesis.lines).values():
            parameters += [parameter_with_interval(explanation, index) for index in range(span.start, span.stop)]
        rows += [{"kind": kind.kind, **_row(parameter)} for parameter in parameters]
    first_modulus = _modulus_of_first_kind(joined)
    return rows if first_modulus is None else [first_modulus, *rows]


def _of_elastomer(modulus: Mapping[str, Any], curves: CurvePosterior) -> dict[str, Any]:
    """With an interval that allows for hidden mechanisms, and for a difference between block and skin."""
    return with_hidden(modulus, curves.hidden, curves.tolerance)


def _row(parameter: Mapping[str, Any]) -> dict[str, Any]:
    return {"parameter": parameter["name"], **{key: parameter[key] for key in ("unit", "value", "low", "high")}}


def _modulus_of_first_kind(joined: KindsTogether) -> dict[str, Any] | None:
    """E by the recordings of the first kind alone; None where their best set keeps the declared one."""
    assert joined.apart is not None
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    leader = joined.apart.answers[0]
    explanation = joined.apart.fit_behind(leader)
    kind = {"kind": joined.problem.kind}
    if declared is None:
        return {**kind, **_row(parameter_with_interval(explanation, parameter_index(explanation, "youngs_modulus")))}
    if _MODULUS_ERROR not in explanation.names:
        return None
    index = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[_MODULUS_ERROR].start
    factor = parameter_with_interval(explanation, index)
    ends = {key: rounded(declared * factor[key]) for key in ("value", "low", "high")}
    return {**kind, "parameter": "youngs_modulus", "unit": "MPa", **ends}


def moduli_clause(joined: KindsTogether, rows: Sequence[Mapping[str, Any]]) -> str:
    """A clause on E by kind; empty where there is one kind."""
    moduli = [row for row in rows if row["parameter"] == "youngs_modulus"]
    if not moduli:
        return ""
    text = ", ".join(
        f"E from {_KIND_WORDS[row['kind']]}: {row['value']:.3g} MPa (95 %: {row['low']:.3g} to {row['high']:.3g})"
        for row in moduli
    )
    declared = joined.problem.lines.campaign.skin.youngs_modulus_mpa
    return f"{text}, declared {declared:g}" if declared is not None else text


def contradictions(joined: KindsTogether) -> list[dict[str, Any]]:
    """The statement that the kinds are not of one material, where this is more probable than the opposite."""
    if joined.other_kinds is None or not joined.apart_is_likelier:
        return []
    kinds = [joined.problem.kind, *(kind.kind for kind in joined.other_kinds.kinds)]
    named = " and ".join(_KIND_WORDS[kind] for kind in kinds)
    statement = (
        f"{named[0].upper()}{named[1:]} contradict each other (probability {in_percent(joined.contradictory)}): they "
        "are not of one material, or one of them is wrong, so each is explained alone."
    )
    return [{"parameter": "youngs_modulus", "kinds": kinds, "statement": statement}]


def mechanisms_of_curves(joined: KindsTogether, names: Sequence[str], leading: Sequence[str]) -> list[dict[str, Any]]:
    """Name, parameters and share of the misfit of mechanisms that act on the additional curves only."""
    rows = []
    for kind in () if joined.other_kinds is None else joined.other_kinds.kinds:
        assert joined.other_kinds is not None
        curves = joined.other_kinds.posterior(kind, leading)
        rows += [
            _of_mechanism(name, explanation, curves.fits[0][0])
            for explanation, _ in curves.fits
            for name in names
            if name in explanation.names
        ]
    return rows


def _of_mechanism(name: str, explanation: Explanation, without: Explanation) -> dict[str, Any]:
    span = parameter_slices(explanation.names, explanation.best.hypothesis.lines)[name]
    misfit, misfit_without = (_misfit_square(candidate) for candidate in (explanation, without))
    return {
        "name": name,
        "parameters": [parameter_with_interval(explanation, index) for index in range(span.start, span.stop)],
        "explains_percent": rounded(100 * max(1 - misfit / max(misfit_without, 1e-300), 0.0), 3),
    }


def _misfit_square(explanation: Explanation) -> float:
    """Σ (F − model)² of the samples, without zero offset, drift and gain of the cell."""
    predicted = explanation.model.predict(explanation.point.fit).value.real
    return float(((explanation.best.hypothesis.lines.value.real - predicted) ** 2).sum())
