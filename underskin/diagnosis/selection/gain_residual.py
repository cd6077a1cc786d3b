"""The gain residual of each recording under an explanation, against which unlisted laws are screened.

FRF = model · (1 + δ), linear in the model's parameters at their best fit, in the sensors' gains and in the features of
δ that a law gives. Scatters of gain and of position are marginalised over their priors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.noise import (
    GAIN_PRIOR,
    POSITION_PRIOR,
    START_GAIN,
)
from underskin.inversion.mixed_model import NO_POSITION_SCATTER, POSITION_RANGE
from underskin.mechanisms.base import Normal, Parameter
from underskin.mechanisms.models.frf import FAINT
from underskin.units import Array, Floats, Indices, Mask

_GAINS = np.geomspace(0.005, 0.5, 17)  # fine enough for 65 recordings, which determine the scatter to 9 %
_USUAL_GAIN_NODE = int(np.abs(np.log(_GAINS) - np.log(START_GAIN)).argmin())
_NEGLIGIBLE = 60.0  # nats behind the best node, from which on a node cannot matter for a law of few features
_USUAL_POSITION = np.geomspace(*POSITION_RANGE, 4)  # [m], with a law; without one the scatter may be larger
_ALL_POSITION = np.geomspace(0.03e-3, 0.6e-3, 12)  # [m]
_BLOCK = 16  # sets of features per block


@dataclass(frozen=True, eq=False)
class ScatterNodes:
    """One scatter of position with several of gain.

    Log weights (gains,), the residuals (recordings,) and their variances (gains, recordings).
    """

    log_weights: Floats
    residual: Floats
    variances: Floats


@dataclass(frozen=True, eq=False)
class SensorPairs:
    """Pairs of a sensor and one of its recordings, sorted by sensor.

    `row` is the recording (pairs,), `first` the index of each sensor's first pair (sensors + 1,).
    """

    row: Indices
    first: Indices

    @classmethod
    def of(cls, sensor: Indices) -> "SensorPairs":
        """From the sensor of each recording (recordings,)."""
        row = np.argsort(sensor, kind="stable")
        return cls(row, np.append(np.flatnonzero(np.diff(sensor[row], prepend=-1)), len(row)))

    def sums(self, values: Floats) -> Floats:
        """Sums over the pairs of each sensor, of values (…, pairs)."""
        return np.asarray(np.add.reduceat(values, self.first[:-1], axis=-1))

    def spread(self, values: Array) -> Array:
        """Values of sensors (…, sensors), repeated at their pairs."""
        return np.repeat(values, np.diff(self.first), axis=-1)


@dataclass(frozen=True, eq=False)
class _WithoutLaw:
    """The residual r at several scatters without a law, the model's parameters and sensors' gains marginalised.

    Its covariance is C = A + F Fᵀ, A = V + τ² S Sᵀ: V the variances, S the sensors, τ their spread, F the `fixed`
    columns. `log_density` of r (scatters,); A⁻¹ = V⁻¹ − Σ uₙ uₙᵀ over sensors, with `sensor_columns` u (scatters,
    pairs); C⁻¹ = A⁻¹ − Tᵀ T with `projector` T = L⁻¹ Fᵀ A⁻¹, L Lᵀ = 1 + Fᵀ A⁻¹ F (scatters, columns, recordings);
    `root` V^(−½) and `weighted` C⁻¹ r (scatters, recordings). Time and memory grow with the number of recordings, not
    of sensors.
    """

    log_density: Floats
    root: Floats
    sensor_columns: Floats
    projector: Floats
    weighted: Floats
    pairs: SensorPairs

    @classmethod
    def of(cls, nodes: ScatterNodes, fixed: Floats, pairs: SensorPairs, spread: float) -> "_WithoutLaw":
        """With `fixed` columns (recordings, columns) and the `spread` of the sensors' log gains."""
        precision = 1 / nodes.variances
        by_sensor = precision[:, pairs.row]
        total = pairs.sums(by_sensor)
        sensor_columns = by_sensor * pairs.spread(spread / np.sqrt(1 + spread**2 * total))

        def times_inverse(rows: Floats) -> Floats:
            """A⁻¹ of rows (scatters, rows, recordings)."""
            weighted = rows * precision[:, None]
            weighted[..., pairs.row] -= (
                pairs.spread(pairs.sums(rows[..., pairs.row] * sensor_columns[:, None])) * sensor_columns[:, None]
            )
            return weighted

        fixed_inverse = times_inverse(fixed.T[None])
        lower = np.linalg.cholesky(fixed_inverse @ fixed + np.eye(fixed.shape[1]))
        projector = np.linalg.solve(lower, fixed_inverse)
        projection = projector @ nodes.residual
        weighted = times_inverse(nodes.residual[None, None])[:, 0] - (projection[:, None] @ projector)[:, 0]
        log_determinant = np.log(nodes.variances).sum(axis=1) + np.log1p(spread**2 * total).sum(axis=1)
        log_determinant += 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
        log_density = nodes.log_weights - 0.5 * (weighted @ nodes.residual + log_determinant)
        return cls(log_density, np.sqrt(precision), sensor_columns, projector, weighted, pairs)

    @classmethod
    def joined(cls, parts: Sequence["_WithoutLaw"]) -> "_WithoutLaw":
        """The scatters of all `parts`, which are of the same recordings."""
        return parts[0].with_scatters(lambda name: np.concatenate([getattr(part, name) for part in parts]))

    def at(self, selected: Mask) -> "_WithoutLaw":
        """At some of the scatters."""
        return self.with_scatters(lambda name: getattr(self, name)[selected])

    def with_scatters(self, values: Callable[[str], Floats]) -> "_WithoutLaw":
        """The same recordings at other scatters; `values` gives each field by its name."""
        return _WithoutLaw(
            values("log_density"),
            values("root"),
            values("sensor_columns"),
            values("projector"),
            values("weighted"),
            self.pairs,
        )

    def products(self, columns: Floats, count: int) -> Floats:
        """XᵀC⁻¹X of each of `count` blocks of columns X (recordings, columns): (count, scatters, size, size)."""
        from underskin.diagnosis.kernels import less_shared

        grams = np.ascontiguousarray(
            _grams(columns * self.root[:, :, None], count) - _grams(self.projector @ columns, count)
        )
        less_shared(np.ascontiguousarray(self.sensor_columns), self.pairs.row, self.pairs.first, columns, grams)
        return grams


class GainResidual:
    """The gain residual of each recording, linear in the model's parameters, sensors' gains and a law's features."""

    def __init__(self, problem: FittingProblem, explanation: Explanation) -> None:
        self._best, parameters = explanation.best, explanation.model.parameters
        best = self._best
        size, _, _ = best.tangent.projections(best.levels.position)
        self._least = FAINT * np.abs(size).max()
        slopes = best.tangent.slope_projections[0].T / self._above_faint(size)[:, None]
        centre = np.array([parameter.start for parameter in parameters]) - best.point.fit
        scale = np.array([_prior_sd(parameter) for parameter in parameters])
        self._offset = slopes @ centre
        self.fixed, self.spread = slopes * scale, best.levels.spread
        self._pairs = SensorPairs.of(problem.lines.sensor)
        self._moving = best.relative_place_slopes
        self.usual = self._scatters(_USUAL_POSITION)

    def _above_faint(self, size: Floats) -> Floats:
        return np.where(np.abs(size) > self._least, size, self._least)

    def _scatters(self, positions: Floats) -> list[ScatterNodes]:
        """No scatter of position and each of `positions` [m], with all of gain; relative to the model's mean there."""
        best, scatters = self._best, []
        for position, share in _position_probabilities(positions).items():
            size, ur, uu = best.tangent.projections(position)
            size = self._above_faint(size)
            second_order = best.hypothesis.curvature.square
            position_variance = position**2 * (self._moving**2).sum(axis=0) + 0.5 * position**4 * second_order
            log_weights = GAIN_PRIOR.log_density(np.log(_GAINS)) + np.log(share) - np.log(np.abs(size)).sum()
            variances = _GAINS[:, None] ** 2 + position_variance + uu / size**2
            scatters.append(ScatterNodes(log_weights, ur / size - self._offset, variances))
        return scatters

    @cached_property
    def _log_density_without(self) -> float:
        """log p(residual) without a law."""
        return float(
            logsumexp([self._density_without_law(nodes).log_density for nodes in self._scatters(_ALL_POSITION)])
        )

    def _density_without_law(self, nodes: ScatterNodes) -> _WithoutLaw:
        return _WithoutLaw.of(nodes, self.fixed, self._pairs, self.spread)

    @cached_property
    def _at_usual_scatters(self) -> _WithoutLaw:
        """At all scatters of position and gain that can matter; a law gains at most ½ χ² in each."""
        densities = [self._density_without_law(nodes) for nodes in self.usual]
        least = max(float(density.log_density.max()) for density in densities) - _NEGLIGIBLE
        highest = [
            density.log_density + 0.5 * (density.weighted @ nodes.residual)
            for density, nodes in zip(densities, self.usual, strict=True)
        ]
        return _WithoutLaw.joined(densities).at(np.concatenate(highest) > least)

    @cached_property
    def _at_one_scatter(self) -> _WithoutLaw:
        """Without scatter of position, at one usual scatter of gain."""
        return self._density_without_law(self.usual[0]).at(np.arange(len(_GAINS)) == _USUAL_GAIN_NODE)

    def gains(self, sets: Floats) -> Floats:
        """Gain in log evidence of each set of features (sets, recordings, features), of amplitudes of prior sd 1, over
        none (sets,), marginalised over the priors of the scatters."""
        log_densities = [_log_densities_with(block, self._at_usual_scatters) for block in _blocks(sets)]
        return np.asarray(logsumexp(np.concatenate(log_densities, axis=1), axis=0) - self._log_density_without)

    def amplitudes(self, sets: Floats) -> Floats:
        """The most probable amplitudes of features whose prior sd is 1, at a usual scatter (sets, features)."""
        return np.concatenate([_modes(block, self._at_one_scatter) for block in _blocks(sets)])


def _blocks(sets: Floats) -> list[Floats]:
    """Blocks of sets that are small enough for intermediate results to stay in the processor's cache."""
    return [sets[start : start + _BLOCK] for start in range(0, len(sets), _BLOCK)]


def _modes(sets: Floats, without: _WithoutLaw) -> Floats:
    """The most probable amplitudes of features at one scatter (sets, features)."""
    count, rows, size = sets.shape
    columns = np.ascontiguousarray(sets.transpose(1, 0, 2)).reshape(rows, -1)
    gram = without.products(columns, count)[:, 0] + np.eye(size)
    return np.asarray(np.linalg.solve(gram, (sets.transpose(0, 2, 1) @ without.weighted[0])[..., None])[..., 0])


def _log_densities_with(sets: Floats, without: _WithoutLaw) -> Floats:
    """log p(residual, features) at each scatter (scatters, sets)."""
    from underskin.diagnosis.kernels import law_gains

    count, rows, size = sets.shape
    columns = np.ascontiguousarray(sets.transpose(1, 0, 2)).reshape(rows, -1)
    gram = without.products(columns, count)
    moment = (without.weighted @ columns).reshape(-1, count, size).swapaxes(0, 1)
    gains = np.empty(count * len(without.root))
    law_gains(gram.reshape(-1, size, size), np.ascontiguousarray(moment).reshape(-1, size), gains)
    return np.asarray(without.log_density[:, None] + gains.reshape(count, -1).T)


def _grams(columns: Floats, count: int) -> Floats:
    """Products of each of `count` blocks of columns (scatters, rows, columns) with itself, (count, scatters, size,
    size)."""
    blocks = columns.reshape(*columns.shape[:2], count, -1).transpose(2, 0, 3, 1)
    return np.asarray(blocks @ blocks.swapaxes(-1, -2))


def _position_probabilities(positions: Floats) -> dict[float, float]:
    """Prior probabilities of no scatter of position (key 0) and of each of `positions` [m]."""
    shares = np.exp([POSITION_PRIOR.log_density(float(np.log(position))) for position in positions])
    shares *= (1 - NO_POSITION_SCATTER) / shares.sum()
    return {0.0: NO_POSITION_SCATTER, **dict(zip(positions.tolist(), shares.tolist(), strict=True))}


def _prior_sd(parameter: Parameter) -> float:
    if isinstance(parameter.prior, Normal):
        return parameter.prior.sd
    low, high = parameter.bounds
    return (high - low) / np.sqrt(12.0)
