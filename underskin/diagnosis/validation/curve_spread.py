"""Curves that contradict each other: their moduli differ by more than noise and a poor rig scatter; and one that stands
off others which agree.

b_i = ln(Σ f m/d² / Σ m²/d²) of curve i, its force f over the stated model m: its modulus over the common one. Its
variance is s² + 1/(Σ m²/d² − (Σ m m′/d²)²/Σ m′²/d²), with s = 5 % of a poor rig, d the noise and m′ the slope over the
displacement, since its contact point is fitted as well. Σ (b_i − b̄)²/variance, b̄ the weighted mean, is χ² of n − 1
degrees of freedom. A sphere's modulus goes with 1/√R, so that exchanged radii, or a diameter for a radius, change b by
half a logarithm of a ratio that is known. One curve stands off the others where its b, predicted from theirs with the
scatter that they leave probable, is that far off with a chance of a fiftieth among all curves: the mean over rigs, of
which a poor one, whose scatter few curves underestimate, has up to 2.5 times as much, a twentieth (simulated, 3 to 20
curves). Held ends of blocks of two shapes are one factor between them, which specimens of one elastomer have as well:
those of one silicone, ten each of three, scatter by 3 to 8 %.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import chdtrc

from underskin.diagnosis.data.names import MOST_QUOTED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import row_prediction
from underskin.diagnosis.noise import GAIN_PRIOR
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.mixed_model import GAIN_RANGE
from underskin.mechanisms.laws.platen_friction import PlatenFriction, distinct_shapes
from underskin.recordings.campaign import CurveRecording, IndentationRecording
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
    spheres = [recording for recording in recordings if isinstance(recording, IndentationRecording)]
    radii = [sphere.indenter_radius_mm for sphere in spheres] if len(spheres) == len(recordings) else []
    remedies = [words for words, changed in _other_radii(radii) if moduli.agree(np.log(changed) / 2)]
    return [moduli.finding(Reason.CURVES_DIFFER, recordings, remedies=remedies[:MOST_QUOTED])]


def _moduli(problem: FittingProblem, explanation: Explanation) -> "_Moduli | None":
    """The moduli of the curves under a set of mechanisms; None of a single one, and where the model has no force."""
    lines, recordings = problem.lines, problem.lines.campaign.curves
    if not lines.curves or len(recordings) < 2:
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
