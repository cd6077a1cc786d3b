"""Checks of answers to curves: moduli that contradict each other, a declared thickness that the curves contradict, and
unlisted laws that would look like the answer.

Moduli. b_i = ln(Σ f m/d² / Σ m²/d²) of curve i, its force f over the stated model m: its modulus over the common one.
Its variance is s² + 1/(Σ m²/d² − (Σ m m′/d²)²/Σ m′²/d²), with s = 5 % of a poor rig, d the noise and m′ the slope over
the displacement, since its contact point is fitted as well. Σ (b_i − b̄)²/variance, b̄ the weighted mean, is χ² of n −
1 degrees of freedom. A sphere's modulus goes with 1/√R, so that exchanged radii, or a diameter for a radius, change b
by half a logarithm of a ratio that is known. One curve stands off the others where its b, predicted from theirs with
the scatter that they leave probable, is that far off with a chance of a fiftieth among all curves: the mean over rigs,
of which a poor one, whose scatter few curves underestimate, has up to 2.5 times as much, a twentieth (simulated, 3 to
20 curves). Held ends of blocks of two shapes are one factor between them, which specimens of one elastomer have as
well: those of one silicone, ten each of three, scatter by 3 to 8 %.

Thickness. A layer of another thickness is a rival like a mechanism more: its thickness is a parameter, as where none is
declared, with the prior of one mechanism, and about the declared one with that of `thickness_error`. It is reported
where that is not clearly less probable than the answer, its 95 % interval excludes the declared value: a wrong
thickness and a sample that stiffens with strain look much alike. It is not where it changes neither mechanisms nor
modulus: some percent of thickness make up for what a contact law idealises. That the declared layer's law was tried,
and is clearly less probable, is reported as well.

Unlisted laws. An imitated law acts as listed ones do: it multiplies the force, shifts the travel or adds a force, by a
simple form of the force, the depth, the time or the way back. Each is given the strength that the explanation's own
mechanisms show, χ² beyond what the nuisances take up, under the noise of the fit. It is imitated if the explanation
would be named for it: its parameters leave too little to be named, and without any one of its mechanisms more than that
is left (all to first order in the parameters). Beside the null hypothesis a law of a usual strength counts that would
not show.

The prior of something unlisted times the share of such laws is their weight beside the explanation's own prior, and
never more than that: laws that are more probable are fitted themselves (selection/unlisted_search.py).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from typing import Any

import numpy as np
from scipy.special import chdtrc

from underskin.diagnosis.data.dataset import curve_lines
from underskin.diagnosis.data.names import MOST_QUOTED, NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.residuals import Linearised, force_and_slopes, row_prediction
from underskin.diagnosis.noise import GAIN_PRIOR
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.priors import PRIORS, guess_count, least_evidence, log_prior, log_prior_of
from underskin.diagnosis.validation.signatures import least_chi2
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.findings.formatting import times_in_words
from underskin.inversion.mixed_model import GAIN_RANGE, SDS_OF_95
from underskin.mechanisms.base import Normal
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.platen_friction import PlatenFriction, distinct_shapes
from underskin.mechanisms.laws.strain_stiffening import StrainStiffening
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign, CurveConditions, CurveRecording, IndentationRecording, curves_of
from underskin.units import Floats

_CHANCE = 1e-3  # of a poor rig whose curves would be said to contradict each other
_CHANCE_OF_ONE = 0.02  # of a rig of which a curve would be said to stand off (a poor one: 0.05); no verdict
_SHAPES_OF_A_FACTOR = 2  # of which held ends make one factor, as a difference of the specimens does
_SCATTERS = np.exp(np.linspace(np.log(1e-3), np.log(0.5), 200))  # of gains, over which is integrated


def curve_spread_findings(problem: FittingProblem, stated: Explanation, null: Explanation) -> list[Finding]:
    """The modulus of each curve over their mean, where they differ beyond noise and what a rig scatters; or by no more,
    while platens that hold the ends explain the factor between specimens of two shapes."""
    campaign = problem.lines.campaign
    recordings, shapes = campaign.curves, len(distinct_shapes(campaign))
    is_held = PlatenFriction.name in stated.names
    if is_held and shapes == _SHAPES_OF_A_FACTOR:
        by_null = _moduli(problem, null)
        if by_null is not None and by_null.agree():
            return [by_null.finding(Reason.SPECIMENS_DIFFER, recordings)]
    moduli = _moduli(problem, stated)
    if moduli is None:
        return []
    if moduli.agree():
        return _of_one(moduli, recordings)
    if shapes > 1 and not is_held:
        return [moduli.finding(Reason.SPECIMENS_DIFFER, recordings)]
    spheres = campaign.of(IndentationRecording)
    radii = [sphere.indenter_radius_mm for sphere in spheres] if len(spheres) == len(recordings) else []
    remedies = [words for words, changed in _other_radii(radii) if moduli.agree(np.log(changed) / 2)]
    return [moduli.finding(Reason.CURVES_DIFFER, recordings, remedies=remedies[:MOST_QUOTED])]


def _moduli(problem: FittingProblem, explanation: Explanation) -> "_Moduli | None":
    """The moduli of the curves under a set of mechanisms; None of a single one, and where the model has no force."""
    lines, recordings = problem.lines, problem.lines.campaign.curves
    if len(recordings) < 2:
        return None
    noise = explanation.best.levels.level * lines.deviation
    measured, model = (column.real / noise for column in (lines.value, row_prediction(problem, explanation)))
    slope = np.concatenate(
        [
            _slope(recording.displacement_mm, model[rows])
            for recording, rows in zip(recordings, lines.spans, strict=True)
        ]
    )
    along, square, across, of_slope = (
        np.add.reduceat(product, lines.first) for product in (model * measured, model**2, model * slope, slope**2)
    )
    if not ((along > 0) & (of_slope > 0)).all():  # a model of no force tells nothing of its factor
        return None
    known = square - across**2 / of_slope
    if not (known > 0).all():
        return None
    return _Moduli(np.log(along / square), GAIN_RANGE[1] ** 2 + 1 / known)


def _slope(displacement: Floats, model: Floats) -> Floats:
    """Of a model over the displacement (samples,); 0 where the sample does not move."""
    step = np.gradient(displacement)
    return np.asarray(np.divide(np.gradient(model), step, out=np.zeros_like(model), where=step != 0))


def _of_one(moduli: "_Moduli", curves: Sequence[CurveRecording]) -> list[Finding]:
    """The curve whose modulus stands off most of those of at least two others, where chance hardly does that."""
    if len(curves) < 3:
        return []
    chances = [moduli.chance_of(number) for number in range(len(curves))]
    number = int(np.argmin(chances))
    if chances[number] > _CHANCE_OF_ONE:
        return []
    others, curve = np.delete(moduli.logarithm, number), curves[number]
    off = float(moduli.logarithm[number] - others.mean())
    arguments = {
        "factor": float(np.exp(off)),
        "others": 100 * float(np.std(others, ddof=1)),
        "once": 1 / max(chances[number], 1e-3),
        "radius_mm": curve.indenter_radius_mm * np.exp(2 * off) if isinstance(curve, IndentationRecording) else None,
    }
    return [Finding(Reason.CURVE_STANDS_OFF, curve.id, "force_n", arguments)]


@dataclass(frozen=True)
class _Moduli:
    """Logarithms of the curves' moduli over the common one, and their variances (curves,)."""

    logarithm: Floats
    variance: Floats

    def about_mean(self, moved: Floats | float = 0.0) -> Floats:
        """The logarithms less `moved`, about their weighted mean."""
        logarithm = self.logarithm - moved
        return logarithm - np.average(logarithm, weights=1 / self.variance)

    def agree(self, moved: Floats | float = 0.0) -> bool:
        """Whether the logarithms less `moved` differ by no more than chance."""
        statistic = np.sum(self.about_mean(moved) ** 2 / self.variance)
        return bool(chdtrc(len(self.variance) - 1, statistic) > _CHANCE)

    def finding(self, reason: Reason, curves: Sequence[CurveRecording], **arguments: Any) -> Finding:
        """On the moduli of these curves over their mean."""
        of_curves = {"ids": [curve.id for curve in curves], "factors": np.exp(self.about_mean()).tolist()}
        return Finding(reason, "", "force_n", {**of_curves, **arguments})

    def chance_of(self, number: int) -> float:
        """Of a curve, among all, to lie so far off the others under the scatter of gains that these leave probable."""
        noise = self.variance - GAIN_RANGE[1] ** 2
        others, variance = np.delete(self.logarithm, number), _SCATTERS[:, None] ** 2 + np.delete(noise, number)
        weight = 1 / variance
        total = weight.sum(axis=1)
        mean = weight @ others / total
        spread = (weight * (others - mean[:, None]) ** 2).sum(axis=1)
        log_weight = GAIN_PRIOR.log_density(np.log(_SCATTERS)) - 0.5 * (np.log(variance).sum(axis=1) + spread)
        posterior = np.exp(log_weight - 0.5 * np.log(total) - log_weight.max())
        off = (self.logarithm[number] - mean) ** 2 / (_SCATTERS**2 + noise[number] + 1 / total)
        return len(self.logarithm) * float(posterior @ chdtrc(1, off) / posterior.sum())


def _other_radii(radii: Sequence[float]) -> Iterator[tuple[str, Floats]]:
    """Each slip of a lab in the radii, in words, and the radius over the declared one by curve (curves,)."""
    declared = np.array(radii)
    for low, high in combinations(sorted(set(radii)), 2):
        exchanged = np.where(declared == low, high, np.where(declared == high, low, declared))
        yield f"the spheres of {low:g} and {high:g} mm are exchanged", exchanged / declared
    for radius in sorted(set(radii)):
        for factor, words in ((0.5, "the diameter"), (2.0, "half the radius")):
            if len(set(radii)) > 1:
                changed = np.where(declared == radius, factor, 1.0)
                yield f"{radius:g} mm is {words} of that sphere", changed


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
    layer = problem.explain(
        Request(tuple(name for name in named if name in {_LAYER, *stated.names}), never_pruned=True)
    )
    less = 0.0 if layer is None else weight - result.log_weight(layer)
    if less > least:
        arguments = {"declared_mm": declared, "less": times_in_words(less)}
        findings.append(Finding(Reason.DECLARED_LAYER, "", "thickness_mm", arguments))
    fits = _of_any_thickness(campaign, problem, [name for name in stated.names if name in named])
    gains = [
        fit.log_evidence + _log_declared_prior(fit, declared) + log_prior_of(fit, result.supported) - weight
        for fit in fits
    ]
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


def _log_declared_prior(fit: Explanation, declared_mm: float) -> float:
    """The logarithm of the prior of a thickness beside a declared one, that of `thickness_error`, over the prior under
    which it was fitted."""
    index = fit.spans[_LAYER].start
    at, fitted = float(fit.point.fit[index]), fit.model.parameters[index].prior
    declared = ThicknessError.parameters_stated[0].prior
    assert isinstance(fitted, Normal)
    assert isinstance(declared, Normal)
    off = at - float(np.log(declared_mm))
    return declared.log_height + declared.log_shape(off) - fitted.log_height - fitted.log_shape(at)


def _modulus(campaign: Campaign, fit: Explanation) -> float:
    """E by a fit [MPa]."""
    index = fit.index("youngs_modulus")
    factor = fit.model.parameters[index].from_fit(float(fit.point.fit[index]))  # on a declared one
    return factor * (campaign.skin.youngs_modulus_mpa or 1.0)


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
    recordings = curves_of(explanation.best.hypothesis.lines.campaign)
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
    forms = [way_back, *chain(*shapes.values())]
    laws = [factor * form for factor in (force, stiffness) for form in forms]
    return np.array([*laws, *shapes.get("time", [])])  # an added force follows time
