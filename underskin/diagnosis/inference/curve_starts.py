"""Where fits of curves begin: contact points, moduli, and the least-squares fit with the noise that it leaves."""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.hypothesis import Hypothesis
from underskin.diagnosis.inference.least_squares import LeastSquares
from underskin.diagnosis.inference.noise_steps import SettlingEvaluator
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, START_GAIN
from underskin.mechanisms.models.curves import CurveModel
from underskin.recordings.conditions import curves_of
from underskin.units import Floats

_SETTLING = 20
_OFF_SAMPLE = 1e-6  # of the gap between two samples: a contact point at a sample is past it
_SOFTER = (1.0, 0.25, 0.06)
_DEPTHS = (np.geomspace(1.5, 0.003, 24), np.geomspace(0.8, 1.25, 9), np.geomspace(0.96, 1.04, 7))  # of the one before
_SMOOTH_STARTS = (np.log(1e-3), np.log(3e-2))  # of curves: close fit, and loose


def softer(fitter: SettlingEvaluator, at: Evaluated) -> Evaluated:
    """Of curves whose modulus is not declared: also with smaller moduli, since what sticks looks stiff."""
    places = [place for place, entry in enumerate(fitter.hypotheses[0].model.parameters) if entry.proportional]
    if not places:
        return at
    points = at.points[np.repeat(np.arange(len(at)), len(_SOFTER))]
    fit = points.fit.copy()
    fit[:, places] += np.tile(np.log(_SOFTER), len(at))[:, None]
    return fitter.evaluate(replace(points, fit=fit), slopes=False)


def with_contact_points(fitter: SettlingEvaluator, at: Evaluated) -> Evaluated:
    """Of indentations: each one's contact point where it fits best, in ever finer steps of the depth.

    Curves are independent of each other but for what they share, so that one set of depths serves all of them.
    """
    (entry,) = fitter.hypotheses
    assert isinstance(entry.model, CurveModel)
    places = entry.model.contact_points
    travels = [one.displacement_mm for one in curves_of(fitter.lines.campaign)]
    deepest, span = np.array([travel.max() for travel in travels]), np.array([np.ptp(one) for one in travels])
    covariance = np.tile([GAIN_PRIOR.middle, 0.0, entry.smooth.middle, *at.points.covariance[0, 3:]], (len(at), 1))
    levels = fitter.levels(covariance[:1, None])
    depth = np.repeat(span[None], len(at), axis=0)
    for ratios in _DEPTHS:
        depths = depth[:, None] * ratios[:, None]  # (starts, ratios, curves)
        tried = np.clip(deepest - depths, fitter.low[0, places], fitter.high[0, places]).reshape(-1, len(places))
        points = at.points[np.repeat(np.arange(len(at)), len(ratios))]
        fit = points.fit.copy()
        fit[:, places] = tried
        sums = fitter.products(replace(points, fit=fit), slopes=False, place=False).summed(levels)
        uu, uy, yy = (part[:, 0] for part in (sums.uu, sums.uy, np.broadcast_to(sums.yy, sums.uu.shape)))
        left = yy - 2 * uy + uu - (uu - uy) ** 2 / (START_GAIN**-2 + uu)
        best = left.reshape(depths.shape).argmin(axis=1)[:, None]
        depth = np.take_along_axis(depths, best, axis=1)[:, 0]
    chosen = at.points.fit.copy()
    chosen[:, places] = np.clip(deepest - depth, fitter.low[0, places], fitter.high[0, places])
    return fitter.evaluate(replace(at.points, fit=chosen, covariance=covariance), slopes=False)


def between_samples(hypothesis: Hypothesis, fit: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Bounds of fit coordinates (parameters,) that keep each contact point between the samples where it is.

    Of what sticks: there the force jumps as a contact point passes a sample, and no slope says so.
    """
    assert isinstance(hypothesis.model, CurveModel)
    low, high = low.copy(), high.copy()
    curves = curves_of(hypothesis.lines.campaign)
    for place, curve in zip(hypothesis.model.contact_points.tolist(), curves, strict=True):
        travel = curve.displacement_mm[: int(curve.displacement_mm.argmax()) + 1]
        before, after = travel[travel < fit[place]], travel[travel >= fit[place]]
        if len(before) and len(after):
            first, last = float(before.max()), float(after.min())
            low[place] = max(low[place], first + _OFF_SAMPLE * (last - first))
            high[place] = min(high[place], last)
    return np.minimum(low, fit), np.maximum(high, fit)


def by_least_squares(fitter: SettlingEvaluator, start: Points) -> Evaluated:
    """The best of the least-squares fits of one hypothesis of curves from these starts, with the noise it leaves.

    A small smooth error and a close fit, or a large one and a loose fit: each may be a maximum of its own.
    """
    fitting = LeastSquares(fitter.hypotheses[0])
    fits, costs = zip(*(fitting.fitted(fit) for fit in start.fit), strict=True)
    fit = fits[int(np.argmin(costs))]
    smooth = np.clip(_SMOOTH_STARTS, *_smooth_range(fitter))
    covariance = np.array([[GAIN_PRIOR.middle, 0.0, value] for value in smooth])
    both = start[np.zeros(len(smooth), dtype=np.intp)]
    at = fitter.settle(
        fitter.evaluate(replace(both, fit=np.tile(fit, (len(smooth), 1)), covariance=covariance)), _SETTLING
    )
    return at[at.best()]


def _smooth_range(fitter: SettlingEvaluator) -> tuple[float, float]:
    """Where the logarithm of the smooth error of curves may begin."""
    smooth = fitter.hypotheses[0].smooth
    return smooth.low, max(smooth.high, float(np.log(3e-2)))
