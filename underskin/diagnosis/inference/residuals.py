"""Residuals of an explanation, changes of the force beyond its parameters, and parameters that it may hide.

- The residual of a recording is its relative deviation from the model; that of a line its deviation from its
  recording's best real multiple of the model. The lines of a recording share one gain error, so level and shape are
  kept apart.
- Changes of the prediction: what the fitted parameters absorb of them, and the χ² beyond that.
- A mechanism may be present without being visible: a glue line that slips by the same share under every sphere only
  changes d33. The posterior of a parameter with that mechanism added is a mixture over values spread evenly over its
  prior, at each of which everything else is fitted again, each weighted by its evidence. Where the sensors' spread is
  free, the parameter is averaged over it at each value.
- The uncertainty of d33 by the tolerances of a skin's declared values.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from underskin.diagnosis.inference.evidence import (
    level_integrals,
    marginalise_sensor_spread,
    mean_integrals,
)
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.inference.hypothesis import Evaluated, Points, cell_response
from underskin.errors import InvalidInput
from underskin.halton import halton
from underskin.mechanisms.base import Normal, Unsupported
from underskin.mechanisms.models.curves import CurveModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.physics.charge_response import INCOMPRESSIBLE, Indenter
from underskin.prediction.pressed_skin import declared_skin, log_slopes
from underskin.recordings.campaign import Tolerances, frf_of
from underskin.units import Array, Floats, Indices, Mask, to_si


def row_prediction(problem: FittingProblem, explanation: Explanation) -> Array:
    """The explanation's prediction on all rows."""
    predicted, lines = explanation.best.prediction.value, problem.lines
    return predicted if len(predicted) == len(lines.value) else predicted[lines.recording]


@dataclass(frozen=True)
class Residuals:
    """Residuals at an explanation's most probable parameters: of recordings over the model, and of lines over their
    recording's best real multiple of it."""

    gain: Floats  # (recordings,) relative
    gain_deviation: Floats  # (recordings,) expected sd: gain scatter, positioning and lines
    line: Array  # (rows,) complex, relative
    line_weight: Floats  # (rows,) 1/variance of real and of imaginary part, without the noise's level

    @classmethod
    def of(cls, problem: FittingProblem, explanation: Explanation, gain: float = 0.0, position: float = 0.0) -> Self:
        """With these scatters of gain (relative) and of position [m]; mains pick-up adds to the variance of lines."""
        lines, prediction, best = problem.lines, row_prediction(problem, explanation), explanation.best
        further = 0.0 if best.prediction.pickup_rows is None else best.pickup_variance / best.levels.level**2
        precision = 1 / (lines.deviation**2 + further)
        along = np.add.reduceat(precision * (prediction.conj() * lines.value).real, lines.first)
        size = np.add.reduceat(precision * np.abs(prediction) ** 2, lines.first)
        fitted = prediction * (along / size)[lines.recording]
        line = (lines.value - fitted) / np.where(np.abs(fitted) > 0, fitted, 1.0)
        deviation = np.sqrt(gain**2 + best.position_variance(position) + 1 / size)
        return cls(along / size - 1, deviation, line, precision * np.abs(fitted) ** 2)


@dataclass(frozen=True)
class Reading:
    """What instruments are expected to read with their most probable gains: the `value` of each row, the `variance` of
    its real and of its imaginary part, and that of a `relative` factor on it (rows,)."""

    value: Array
    variance: Floats
    relative: Floats

    @classmethod
    def of(cls, problem: FittingProblem, explanation: Explanation, fitted: Mask | None = None) -> Self:
        """Of all rows of a problem by an explanation of those that are `fitted`, by default all of them."""
        lines, levels, fit = problem.lines, explanation.best.levels, explanation.point.fit
        model = problem.hypothesis(explanation.names, has_position_scatter=False, all_lines=True).model
        noise = (levels.level * lines.deviation) ** 2
        if not isinstance(model, FrfModel):
            assert lines.smooth is not None
            force = model.predict(fit).value.real
            cell = cell_response(lines, levels, force, fitted)
            noise = noise + cell.variance + (levels.smooth * lines.smooth.scale) ** 2
            return cls(cell.reading(lines, force), noise, np.zeros(len(force)))
        prediction = model.predict(fit, slopes=False, place=False)
        known = np.unique(lines.sensor[lines.recording if fitted is None else lines.recording[fitted]])
        gains, spread = np.zeros(lines.sensors.shape[1]), np.full(lines.sensors.shape[1], levels.spread)
        gains[known], spread[known] = explanation.best.sensor_gains[known], 0.0
        p2, curvature = levels.position**2, problem.curvature  # a contact on an extremum of σ feels it in second order
        factor = np.exp(gains[lines.sensor] + 0.5 * p2 * curvature.laplacian)
        moved = p2 * (model.relative_place_slopes(fit) ** 2).sum(axis=0) + 0.5 * p2**2 * curvature.square
        relative = levels.gain**2 + spread[lines.sensor] ** 2 + moved
        value = prediction.value * factor[lines.recording]
        return cls(value, noise + prediction.pickup_variance, relative[lines.recording])

    @property
    def of_parts(self) -> Floats:
        """The variance of real and of imaginary part (2, rows)."""
        return np.asarray(self.variance + self.relative * np.array([self.value.real, self.value.imag]) ** 2)


def force_and_slopes(explanation: Explanation) -> tuple[Floats, Floats, Floats]:
    """The force (samples,), its derivatives by the parameters (parameters, samples) and by the travel (samples,)."""
    model, fit = explanation.best.hypothesis.model, explanation.point.fit
    assert isinstance(model, CurveModel)
    force, slopes = (values[0] for values in model.forces_and_slopes(fit[None]))
    return force, slopes, -slopes[model.contact_points].sum(axis=0)


@dataclass(frozen=True)
class Linearised:
    """What parameters of a fit and further changes of its prediction would tell, to first order: `information` JᵀC⁻¹J
    on both, the parameters first, and the `precision` of the parameters' priors (parameters,)."""

    information: Floats
    precision: Floats

    @classmethod
    def of_forces(
        cls, explanation: Explanation, slopes: Floats, changes: Floats, noise: Explanation | None = None
    ) -> Self:
        """Of changes of the force of curves (changes, samples) beside its derivatives, the `slopes` (parameters,
        samples), under the noise of the explanation or of another one."""
        hypothesis = explanation.best.hypothesis
        fitter, covariance = Fitter(hypothesis), (noise or explanation).point.covariance
        at = fitter.evaluate(fitter.at(replace(explanation.point, covariance=covariance)), slopes=False)
        information = fitter.tangent(at.points, at.products).information_on_forces(np.concatenate([slopes, changes]))
        return cls(information, hypothesis.prior_precision)

    @property
    def of_changes(self) -> Floats:
        """The information on the changes (changes, changes)."""
        return self.information[len(self.precision) :, len(self.precision) :]

    def absorbed(self, indices: Indices | slice = slice(None)) -> Floats:
        """How far each change shifts the parameters at these indices, all others held (indices, changes)."""
        count = len(self.precision)
        rows = np.arange(count)[indices]
        block = self.information[np.ix_(rows, rows)] + np.diag(self.precision[rows])
        return np.asarray(np.linalg.solve(block, self.information[rows, count:]), dtype=float)

    def beyond(self, indices: Indices | slice = slice(None)) -> Floats:
        """The information on the changes that the parameters at these indices leave (changes, changes)."""
        shared = self.information[len(self.precision) :, : len(self.precision)][:, indices]
        return np.asarray(self.of_changes - shared @ self.absorbed(indices))

    def chi2(self, indices: Indices | slice = slice(None)) -> Floats:
        """χ² by which each change would show beyond the parameters at these indices (changes,)."""
        return np.diag(self.beyond(indices))


_NODES = {0: 1, 1: 12, 2: 24}  # by number of parameters
_MOST_NODES = 48
_MOST = 600.0  # nats of the largest share: exp(710) overflows
MAY_MATTER_NATS = 6.0  # behind the best: 0.2 % of its probability, so that what is farther behind changes no sum


def with_hidden_mechanism(
    problem: FittingProblem, explanation: Explanation, name: str, parameter_name: str
) -> NormalMixture | None:
    """A parameter of the model with one more mechanism, each share relative to the explanation without it, at most
    e^600.

    None where the recordings do not support the mechanism, or it moves no prediction.
    """
    best, catalogue = explanation.best, problem.lines.mechanisms
    names = tuple(mechanism for mechanism in catalogue if mechanism in {*explanation.names, name})
    if not catalogue[name].moves_predictions:
        return None
    try:
        hypothesis = problem.hypothesis(names, best.hypothesis.has_position_scatter)
    except (Unsupported, InvalidInput):
        return None
    slices = hypothesis.spans
    new = range(slices[name].start, slices[name].stop)
    if any(
        len(explanation.coordinates(mechanism)) != slices[mechanism].stop - slices[mechanism].start
        for mechanism in explanation.names
    ):
        return None  # with it another mechanism has other parameters
    parameters = [hypothesis.model.parameters[index] for index in new]
    levels = _evenly(len(parameters))
    fit = np.zeros((len(levels), len(hypothesis.model.parameters)))
    fit[:, hypothesis.mechanism_parameter_count :] = best.point.fit[best.hypothesis.mechanism_parameter_count :]
    for mechanism in explanation.names:
        fit[:, slices[mechanism]] = explanation.coordinates(mechanism)
    for column, parameter in zip(new, parameters, strict=True):
        fit[:, column] = [parameter.quantile(level) for level in levels[:, column - new.start].tolist()]
    held = Fitter(hypothesis, held=new)
    at = _fitted(held, fit, explanation)
    if not len(at):
        return None
    values, _, covariances = mean_integrals(held, at)
    gained = values + level_integrals(held, at) - best.log_evidence
    shares = np.exp(np.minimum(gained, gained - gained.max() + _MOST)) / len(fit)
    index = hypothesis.index(parameter_name)
    spread = marginalise_sensor_spread(held, at, index)
    if spread is not None:
        return NormalMixture.joined(
            [normals.times(share) for normals, share in zip(spread, shares.tolist(), strict=True)]
        )
    row = int(np.searchsorted(np.flatnonzero(held.free), index))
    deviation = np.sqrt([covariance[row, row] for covariance in covariances])
    return NormalMixture(shares, at.points.fit[:, index], deviation)


def _evenly(parameters: int) -> Floats:
    """Probabilities between 0 and 1, spread evenly over so many parameters (nodes, parameters)."""
    count = _NODES.get(parameters, _MOST_NODES)
    levels = (np.arange(count) + 0.5) / count
    if parameters < 2:
        return np.asarray(levels[:, None][:, :parameters])
    return np.column_stack([levels, halton(count, parameters - 1)])


def _fitted(held: Fitter, fit: Floats, explanation: Explanation) -> Evaluated:
    """The nodes within `MAY_MATTER_NATS` of the explanation, with all that is not held fitted."""
    point, cost = explanation.point, explanation.best.cost
    covariance, sensor_log_gain = (
        np.tile(values, (len(fit), 1)) for values in (point.covariance, point.sensor_log_gain)
    )
    initial = held.rescaled(Points(fit, covariance, sensor_log_gain))
    fitted = held.descend(initial, 1, lambda at: np.full(len(at), cost + MAY_MATTER_NATS))
    return fitted[np.flatnonzero(fitted.cost < cost + MAY_MATTER_NATS)]


def declared_d33(problem: FittingProblem, explanation: Explanation) -> float:
    """The standard deviation of ln d33 by the skin's tolerances, beyond the priors of the fit.

    An error e of a prior's centre moves the posterior mean of ln d33 by C/s² · e: C is the covariance of ln d33 and
    that factor, s the standard deviation of its prior. A value that the recordings determine therefore moves nothing.
    """
    skin = problem.lines.campaign.skin
    off = skin.tolerances or Tolerances()
    variance = (_by_sensor_radius(problem) * off.sensor_radius_percent / 100) ** 2
    percents = {"youngs_modulus": off.youngs_modulus_percent, "thickness": off.thickness_percent}
    for name, percent in percents.items():
        index = explanation.index(name)
        prior = explanation.model.parameters[index].prior
        assert isinstance(prior, Normal)
        moved = float(explanation.best.covariance_of([explanation.index("d33"), index])[0, 1]) / prior.sd**2
        variance += moved**2 * max((percent / 100) ** 2 - prior.sd**2, 0.0)
    return float(np.sqrt(variance))


def _by_sensor_radius(problem: FittingProblem) -> float:
    """∂ ln FRF/∂ ln rT of the base model, the median of the recordings inside the table; 0 where none is."""
    campaign = problem.lines.campaign
    frfs = frf_of(campaign)
    skin = declared_skin(replace(campaign.skin, poisson_ratio=INCOMPRESSIBLE))  # as the table is
    indenter = Indenter(to_si("indenter_radius_mm", [recording.indenter_radius_mm for recording in frfs]))
    preload = to_si("preload_n", [recording.preload_n for recording in frfs])
    slopes = log_slopes(problem.table, skin, indenter, preload)["sensor_radius"]
    inside = np.isfinite(slopes)
    return float(np.median(slopes[inside])) if inside.any() else 0.0
