"""What an explanation leaves of each recording's gain, against which unlisted laws are screened.

FRF = model · (1 + δ), linear in the model's parameters at their best fit, in sensors' gains and in δ's features, which
a law gives. Scatters of gain and of position are marginalised over their priors.
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
)
from underskin.mechanisms.models.frf import FAINT
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER
from underskin.units import Array, Floats, Indices, Mask

_GAINS = np.geomspace(0.005, 0.5, 17)  # fine enough for 65 recordings, which determine the scatter to 9 %
_USUAL_GAIN = 6  # of these
_GONE = 60.0  # nats behind the best node, which a law of few features cannot lose there
_USUAL_POSITION = np.geomspace(0.05e-3, 0.3e-3, 4)  # [m], beside a law; without one the scatter may be larger
_ANY_POSITION = np.geomspace(0.03e-3, 0.6e-3, 12)
_BLOCK = 16  # sets of features worked on at once
_FEW = 3  # features, up to which products of their pairs are fewer than copies of them weighed for each scatter


@dataclass(frozen=True, eq=False)
class ScatterNodes:
    """One scatter of place with several of gain: log weights (gains,), and under it each recording's residual, and its
    variances (gains, recordings)."""

    log_weights: Floats
    residual: Floats
    variances: Floats


@dataclass(frozen=True, eq=False)
class SensorPairs:
    """Sensors of several recordings with each of these, or with what stands for some (pairs,), one after another.

    `first` is where each begins (sensors + 1,), `row` the recording; `single` are the recordings that have a sensor to
    themselves, whose spread is a variance like any other.
    """

    row: Indices
    first: Indices
    single: Mask

    @classmethod
    def of(cls, sensor: Indices) -> "SensorPairs":
        """By the sensor of each recording (recordings,)."""
        single = np.bincount(sensor)[sensor] == 1
        row = np.argsort(sensor, kind="stable")
        row = row[~single[row]]
        return cls(row, np.append(np.flatnonzero(np.diff(sensor[row], prepend=-1)), len(row)), single)

    def sums(self, values: Floats) -> Floats:
        """Over the pairs of each sensor (…, pairs)."""
        if len(self.row) == 0:
            return values
        return np.asarray(np.add.reduceat(values, self.first[:-1], axis=-1))

    def spread(self, values: Array) -> Array:
        """A number of each sensor at its pairs (…, sensors)."""
        return np.repeat(values, np.diff(self.first), axis=-1)


@dataclass(frozen=True, eq=False)
class _WithoutLaw:
    """At several scatters, with what is fixed taken out: C = A + F Fᵀ and A = V + τ² S Sᵀ, V the variances, τ the
    spread of the sensors S, and F the `fixed` columns.

    `log_density` of the residual r (scatters,); A⁻¹ = V⁻¹ − Σ uₙ uₙᵀ over sensors, with `shared` u (scatters, pairs);
    C⁻¹ = A⁻¹ − Tᵀ T with `taken` T = L⁻¹ Fᵀ A⁻¹, L Lᵀ = 1 + Fᵀ A⁻¹ F (scatters, columns, recordings); `root` V^(−½)
    and `weighed` C⁻¹ r (scatters, recordings). Time and memory grow with the recordings, however many sensors they are
    of.
    """

    log_density: Floats
    root: Floats
    shared: Floats
    taken: Floats
    weighed: Floats
    pairs: SensorPairs

    @classmethod
    def of(cls, nodes: ScatterNodes, fixed: Floats, pairs: SensorPairs, spread: float) -> "_WithoutLaw":
        """With these columns (recordings, columns), and sensors that spread so."""
        variances = nodes.variances + spread**2 * pairs.single
        precision = 1 / variances
        by_sensor = precision[:, pairs.row]
        total = pairs.sums(by_sensor)
        shared = by_sensor * pairs.spread(spread / np.sqrt(1 + spread**2 * total))

        def weighed_by_sensors(rows: Floats) -> Floats:
            """A⁻¹ of rows (scatters, rows, recordings)."""
            weighed = rows * precision[:, None]
            weighed[..., pairs.row] -= (
                pairs.spread(pairs.sums(rows[..., pairs.row] * shared[:, None])) * shared[:, None]
            )
            return weighed

        across = weighed_by_sensors(fixed.T[None])
        lower = np.linalg.cholesky(across @ fixed + np.eye(fixed.shape[1]))
        taken = np.linalg.solve(lower, across)
        of_fixed = taken @ nodes.residual
        weighed = weighed_by_sensors(nodes.residual[None, None])[:, 0] - (of_fixed[:, None] @ taken)[:, 0]
        log_determinant = np.log(variances).sum(axis=1) + np.log1p(spread**2 * total).sum(axis=1)
        log_determinant += 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
        log_density = nodes.log_weights - 0.5 * (weighed @ nodes.residual + log_determinant)
        return cls(log_density, np.sqrt(precision), shared, taken, weighed, pairs)

    @classmethod
    def joined(cls, each: Sequence["_WithoutLaw"]) -> "_WithoutLaw":
        """The scatters of all of these, which are of the same recordings."""
        return each[0].with_scatters(lambda name: np.concatenate([getattr(entry, name) for entry in each]))

    def at(self, kept: Mask) -> "_WithoutLaw":
        """At some of the scatters."""
        return self.with_scatters(lambda name: getattr(self, name)[kept])

    def with_scatters(self, values: Callable[[str], Floats]) -> "_WithoutLaw":
        """The same recordings at other scatters, each field by its name."""
        return _WithoutLaw(
            values("log_density"), values("root"), values("shared"), values("taken"), values("weighed"), self.pairs
        )

    def products(self, columns: Floats, count: int) -> Floats:
        """XᵀC⁻¹X of each of `count` blocks of columns X (recordings, columns): (count, scatters, size, size)."""
        from underskin.diagnosis.kernels import less_shared

        grams = np.ascontiguousarray(_weighed_grams(columns, count, self.root) - _grams(self.taken @ columns, count))
        less_shared(np.ascontiguousarray(self.shared), self.pairs.row, self.pairs.first, columns, grams)
        return grams


class GainResidual:
    """Each recording's gain residual, linear in the model's parameters, sensors' gains and a law's features."""

    def __init__(self, problem: FittingProblem, explanation: Explanation) -> None:
        self._best, parameters = explanation.best, explanation.model.parameters
        best = self._best
        size, _, _ = best.marginal.projections(best.levels.position)
        self._least = FAINT * np.abs(size).max()
        slopes = best.marginal.slope_projections / self._not_faint(size)[:, None]
        centre = np.array([entry.start for entry in parameters]) - best.point.fit
        scale = np.array([_prior_sd(entry) for entry in parameters])
        self._known = slopes @ centre
        self.fixed, self.spread = slopes * scale, best.levels.spread
        self._pairs = SensorPairs.of(problem.lines.sensor)
        self._moving = best.relative_place_slopes
        self.usual = self._scatters(_USUAL_POSITION)

    def _not_faint(self, size: Floats) -> Floats:
        return np.where(np.abs(size) > self._least, size, self._least)

    def _scatters(self, positions: Floats) -> list[ScatterNodes]:
        """No scatter of position and each of these [m], with all of gain; relative to the model's mean under it."""
        best, scatters = self._best, []
        for position, share in _shares(positions).items():
            size, ur, uu = best.marginal.projections(position)
            size = self._not_faint(size)
            second_order = best.hypothesis.curvature.square
            has_position_scatter = position**2 * (self._moving**2).sum(axis=0) + 0.5 * position**4 * second_order
            log_weights = GAIN_PRIOR.log_density(np.log(_GAINS)) + np.log(share) - np.log(np.abs(size)).sum()
            variances = _GAINS[:, None] ** 2 + has_position_scatter + uu / size**2
            scatters.append(ScatterNodes(log_weights, ur / size - self._known, variances))
        return scatters

    @cached_property
    def _plain(self) -> float:
        """log p(residual) without a law."""
        return float(logsumexp([self._without(nodes).log_density for nodes in self._scatters(_ANY_POSITION)]))

    def _without(self, nodes: ScatterNodes) -> _WithoutLaw:
        return _WithoutLaw.of(nodes, self.fixed, self._pairs, self.spread)

    @cached_property
    def _usual(self) -> _WithoutLaw:
        """At all scatters of place and gain that can matter: no law gains more in one than half of χ² there."""
        each = [self._without(nodes) for nodes in self.usual]
        least = max(float(entry.log_density.max()) for entry in each) - _GONE
        highest = [
            entry.log_density + 0.5 * (entry.weighed @ nodes.residual)
            for entry, nodes in zip(each, self.usual, strict=True)
        ]
        return _WithoutLaw.joined(each).at(np.concatenate(highest) > least)

    @cached_property
    def _still(self) -> _WithoutLaw:
        """Without scatter of place, at one usual scatter of gain."""
        return self._without(self.usual[0]).at(np.arange(len(_GAINS)) == _USUAL_GAIN)

    def gains(self, sets: Floats, amplitudes: Floats) -> Floats:
        """What each set of features (sets, recordings, features) gains over none at all, in log evidence (sets,).

        Over the priors of the scatters, and of the amplitudes, each as probable as the others.
        """
        each = [_with(some, amplitudes, self._usual) for some in _blocks(sets)]
        return np.asarray(logsumexp(np.concatenate(each, axis=1), axis=0) - self._plain)

    def amplitudes(self, sets: Floats) -> Floats:
        """The most probable amplitudes of features whose prior sd is 1, at a usual scatter (sets, features)."""
        return np.concatenate([_most_probable(some, self._still) for some in _blocks(sets)])


def _blocks(sets: Floats) -> list[Floats]:
    """So few sets at a time that what is worked out from them stays in the processor's cache."""
    return [sets[start : start + _BLOCK] for start in range(0, len(sets), _BLOCK)]


def _most_probable(sets: Floats, without: _WithoutLaw) -> Floats:
    """The most probable amplitudes of features at one scatter (sets, features)."""
    count, rows, size = sets.shape
    columns = np.ascontiguousarray(sets.transpose(1, 0, 2)).reshape(rows, -1)
    gram = without.products(columns, count)[:, 0] + np.eye(size)
    return np.asarray(np.linalg.solve(gram, (sets.transpose(0, 2, 1) @ without.weighed[0])[..., None])[..., 0])


def _with(sets: Floats, amplitudes: Floats, without: _WithoutLaw) -> Floats:
    """log p(residual, features) at each scatter (scatters, sets)."""
    from underskin.diagnosis.kernels import gained

    count, rows, size = sets.shape
    columns = np.ascontiguousarray(sets.transpose(1, 0, 2)).reshape(rows, -1)
    gram = without.products(columns, count)
    moment = (without.weighed @ columns).reshape(-1, count, size).swapaxes(0, 1)
    each = np.empty((count * len(without.root), len(amplitudes)))
    gained(gram.reshape(-1, size, size), np.ascontiguousarray(moment).reshape(-1, size), amplitudes, each)
    more = np.logaddexp.reduce(each.reshape(count, -1, len(amplitudes)), axis=-1) - np.log(len(amplitudes))
    return np.asarray(without.log_density[:, None] + more.T)


def _grams(columns: Floats, count: int) -> Floats:
    """Products of each of `count` blocks of columns (scatters, rows, columns) with itself, (count, scatters, size,
    size)."""
    blocks = columns.reshape(*columns.shape[:2], count, -1).transpose(2, 0, 3, 1)
    return np.asarray(blocks @ blocks.swapaxes(-1, -2))


def _weighed_grams(columns: Floats, count: int, root: Floats) -> Floats:
    """The same of columns (rows, columns) whose rows weigh root² (scatters, rows)."""
    size = columns.shape[1] // count
    if size > _FEW:
        return _grams(columns * root[:, :, None], count)
    one, other = np.triu_indices(size)
    blocks = columns.reshape(len(columns), count, size)
    products = root**2 @ (blocks[..., one] * blocks[..., other]).reshape(len(columns), -1)
    grams = np.empty((count, len(root), size, size))
    grams[..., one, other] = grams[..., other, one] = products.reshape(len(root), count, -1).swapaxes(0, 1)
    return grams


def _shares(positions: Floats) -> dict[float, float]:
    """The shares of no scatter of position, and of each of these."""
    shares = np.exp([POSITION_PRIOR.log_density(float(np.log(position))) for position in positions])
    shares *= (1 - NO_POSITION_SCATTER) / shares.sum()
    return {0.0: NO_POSITION_SCATTER, **dict(zip(positions.tolist(), shares.tolist(), strict=True))}


def _prior_sd(entry: Parameter) -> float:
    if isinstance(entry.prior, Normal):
        return entry.prior.sd
    low, high = entry.bounds
    return (high - low) / np.sqrt(12.0)
