"""The declared thickness of an indented sample against the one that its curves show.

A layer of another thickness is a rival like a mechanism more: its thickness is a parameter, as where none is declared,
with the prior of one mechanism. It is reported where that is not clearly less probable than the answer, its 95 %
interval excludes the declared value: a wrong thickness and a sample that stiffens with strain look much alike. It is
not where it changes neither mechanisms nor modulus: some percent of thickness make up for what a contact law idealises.
That the declared layer's law was tried, and is clearly less probable, is reported as well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.priors import least_evidence, log_prior_of
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import times_in_words
from underskin.inversion.mixed_model import SDS_OF_95
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.strain_stiffening import StrainStiffening
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign

_LAYER = LayeredContact.name


def thickness_findings(
    campaign: Campaign, problem: FittingProblem, result: Search, modulus: Mapping[str, float] | None
) -> list[Finding]:
    """The thickness of the layer that the curves of a campaign show, where the declared one contradicts it and changes
    the answer: its mechanisms or `modulus`, the stated one with `low` and `high` [MPa]."""
    declared, named = campaign.skin.thickness_mm, problem.lines.mechanisms.named
    if problem.kind != "indentation" or declared is None or _LAYER not in named:
        return []
    stated = result.fit_behind(result.answers[0])
    least, weight = least_evidence(stated), result.log_weight(stated)
    findings = []
    layers = [weight - result.log_weight(fit) for fit in result.explanations if _LAYER in fit.names]
    if layers and min(layers) > least:
        arguments = {"declared_mm": declared, "less": times_in_words(min(layers))}
        findings.append(Finding(Reason.DECLARED_LAYER, "", "thickness_mm", arguments))
    fits = _of_any_thickness(campaign, problem, [name for name in stated.names if name in named])
    gains = [fit.log_evidence + log_prior_of(fit, result.supported) - weight for fit in fits]
    for fit, gain in sorted(zip(fits, gains, strict=True), key=lambda pair: -pair[1])[:1]:
        low, value, high = _thickness(fit)
        modulus_mpa = _modulus(campaign, fit)
        is_same = fit.names == stated.names and modulus is not None and modulus["low"] <= modulus_mpa <= modulus["high"]
        if gain > -least and not is_same and not low <= declared <= high:
            arguments = {"declared_mm": declared, "value_mm": value, "low_mm": low, "high_mm": high}
            arguments |= {"modulus_mpa": modulus_mpa, "better": gain > least}
            findings.append(Finding(Reason.THICKNESS_DIFFERS, "", "thickness_mm", arguments))
    return findings


def _of_any_thickness(campaign: Campaign, problem: FittingProblem, stated: Sequence[str]) -> list[Explanation]:
    """The layer of any thickness, alone and beside the other stated mechanisms that do not stiffen as it does."""
    undeclared = replace(campaign, skin=replace(campaign.skin, thickness_mm=None))
    mechanisms = ActiveCatalogue(problem.lines.mechanisms.without)
    mechanisms.bind(undeclared, problem.table, "indentation")
    lines = replace(curve_lines(undeclared, "indentation"), mechanisms=mechanisms)
    free = FittingProblem(lines, problem.table, problem.other_kinds)
    others = {
        name
        for name in stated
        if name not in (_LAYER, StrainStiffening.name)
        and mechanisms[name].unsupported(undeclared, "indentation") is None
    }
    sets = dict.fromkeys(tuple(name for name in mechanisms.named if name in {_LAYER, *more}) for more in ((), others))
    return [fit for names in sets if (fit := free.explain(Request(names))) is not None]


def _thickness(fit: Explanation) -> tuple[float, float, float]:
    """Lower end, value and upper end [mm]."""
    index = fit.spans[_LAYER].start
    half, at = SDS_OF_95 * np.sqrt(fit.best.covariance_of([index])[0, 0]), fit.point.fit[index]
    parameter = fit.model.parameters[index]
    low, value, high = (parameter.from_fit(float(end)) for end in (at - half, at, at + half))
    return low, value, high


def _modulus(campaign: Campaign, fit: Explanation) -> float:
    """E by a fit [MPa]."""
    index = fit.index("youngs_modulus")
    factor = fit.model.parameters[index].from_fit(float(fit.point.fit[index]))  # on a declared one
    return factor * (campaign.skin.youngs_modulus_mpa or 1.0)
