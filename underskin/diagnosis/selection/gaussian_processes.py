"""Gaussian processes over recordings and over frequency, and the hypothesis that a law is unlisted.

Gaussian processes over an axis: Matérn-3/2, as features at landmarks (Nyström), so that time is linear in rows.

An unmodelled discrepancy along frequency: a complex process that changes the shape of the lines.

A Matérn-3/2 process over log frequency, that all recordings share or that changes along an axis of the campaign, on top
of each recording's own best real multiple of the model.

Something that no mechanism here describes, from recording to recording: a process in gain.

FRF = model · (1 + δ), linear in the model's parameters at their best fit, in sensors' gains and in δ's features. δ is a
Matérn-3/2 process over one axis of the campaign, or over all of them. Scatters of gain and of position are marginalised
over their priors. The residual that it works on is also what laws that nobody listed are screened against.

Unmodelled discrepancies as rivals of the mechanisms, with the noise and the parameters of every hypothesis.

- δ of a recording, FRF = model · (1 + δ); of a line; or both;
- scatter from recording to recording far beyond that of rigs: 20 % have a cause that no mechanism names;
- of curves, a smooth error far beyond that of laws of contact.

Amplitudes of δ below 1.5 % are not considered: a law that is right to that misses no physics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.special import logsumexp

from underskin.diagnosis.data.dataset import recording_axes
from underskin.diagnosis.inference.evidence import around, laplace
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.hypothesis import Hypothesis
from underskin.diagnosis.inference.residuals import line_residuals
from underskin.diagnosis.noise import (
    GAIN_PRIOR,
    POSITION_PRIOR,
    UNNAMED,
    UNUSUAL_GAIN,
    UNUSUAL_POSITION,
    Plateau,
    level_prior,
)
from underskin.mechanisms.models.frf import FAINT
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.recordings.usual_scatter import GAIN_RANGE, NO_POSITION_SCATTER, POSITION_RANGE
from underskin.units import Array, Floats, Indices, Mask

AMPLITUDES = np.array([0.015, 0.05, 0.15, 0.5])  # of an unmodelled discrepancy, relative to the model, equally probable
LANDMARKS = 24


def matern(distance: Floats) -> Floats:
    """The covariance at a distance, over the process' length."""
    scaled = np.sqrt(3.0) * distance
    return (1 + scaled) * np.exp(-scaled)


def features(axis: Floats, length: float, landmarks: int = LANDMARKS) -> Floats:
    """Features whose products are the process' covariance, at up to so many places (rows, landmarks)."""
    values = np.unique(np.round(axis, 9), axis=0)
    chosen = values[np.unique(np.linspace(0, len(values) - 1, landmarks).round().astype(int))]

    def kernel(a: Floats, b: Floats) -> Floats:
        return matern(np.sqrt(((a[:, None] - b[None]) ** 2).sum(axis=2)) / length)

    root = np.linalg.cholesky(kernel(chosen, chosen) + 1e-8 * np.eye(len(chosen)))
    return np.linalg.solve(root, kernel(chosen, axis)).T


def normalised(column: Floats) -> Floats:
    """An axis (rows, 1 or 2) from 0 to 1 over its range."""
    return (column - column.min(axis=0)) / np.ptp(column, axis=0).max()


_LINE_LENGTHS = (0.08, 0.25, 0.8)  # of the logarithm of frequency
_INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS = 0.4, 8  # where both frequency and a recording's axis count
_LEAST_RECORDINGS = 4
_MOST_LINES = 160  # distinct frequencies, beyond which they are binned
_LEAST_LINES = 8  # in a recording


def over_lines(problem: FittingProblem, explanation: Explanation) -> dict[str, float]:
    """The log evidence that a process over frequency gains, the level of the lines' noise free in both: one that all
    recordings share ("frequency_hz"), and for each axis one that changes along it."""
    lines = problem.lines
    if np.bincount(lines.recording).max() < _LEAST_LINES:
        return {}
    relative, weight = line_residuals(problem, explanation)
    noise = _LineNoise(
        float((weight * np.abs(relative) ** 2).sum()),
        2 * len(relative) + lines.scatter[1] - lines.recordings,
        level_prior(lines.noise.log_level_sd),
    )
    plain = noise.plain
    line, centres = frequency_bins(lines.frequency)
    total = np.bincount(line, weight, len(centres))
    sums = np.bincount(line, weight * relative.real, len(centres))
    sums = sums + 1j * np.bincount(line, weight * relative.imag, len(centres))
    distance = np.abs(np.log(centres[:, None] / centres[None]))
    each: list[float] = []
    for length in _LINE_LENGTHS:
        root = np.linalg.cholesky(matern(distance / length) + 1e-9 * np.eye(len(centres)))
        each += noise.gains(root.T @ (total[:, None] * root), root.T @ sums).tolist()
    gains = {"frequency_hz": float(logsumexp(each) - np.log(len(each)) - plain)}
    if lines.recordings < _LEAST_RECORDINGS:
        return gains
    distinct, line = np.unique(lines.frequency, return_inverse=True)
    shapes = features(normalised(np.log(distinct)[:, None]), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)

    def summed(values: Array, of_lines: Floats) -> Array:
        """Over the rows of each recording, of what distinct frequencies have (frequencies, …)."""
        rows = csr_array((values, line, [*lines.first, len(line)]), shape=(lines.recordings, len(distinct)))
        return rows @ of_lines.reshape(len(distinct), -1)

    moments = summed(weight * relative, shapes)
    grams = summed(weight, shapes[:, :, None] * shapes[:, None, :]).reshape(lines.recordings, *2 * (shapes.shape[1],))
    for name, column in recording_axes(lines.campaign).items():
        along = features(normalised(column), _INTERPLAY_LENGTH, _INTERPLAY_LANDMARKS)
        size = along.shape[1] * shapes.shape[1]
        gram = np.einsum("ra,rb,rfg->afbg", along, along, grams, optimize=True).reshape(size, size)
        moment = (along.T @ moments).reshape(size)
        gains[f"frequency_hz and {name}"] = float(
            logsumexp(noise.gains(gram, moment)) - np.log(len(AMPLITUDES)) - plain
        )
    return gains


@dataclass(frozen=True)
class _LineNoise:
    """The lines' residuals without a process: Σ|·|²/d², its degrees of freedom, and the prior of the noise's level."""

    chi2: float
    freedom: int
    prior: Plateau

    def gains(self, gram: Array, moment: Array) -> Floats:
        """log p of the lines with a process of each amplitude, at the level that suits it best."""
        eigenvalues, vectors = np.linalg.eigh(gram)
        return self._best(np.maximum(eigenvalues, 0.0), np.abs(vectors.T @ moment) ** 2, AMPLITUDES)

    @property
    def plain(self) -> float:
        """The same without a process."""
        return float(self._best(np.zeros(0), np.zeros(0), np.zeros(1))[0])

    def _best(self, eigenvalues: Floats, square: Floats, amplitudes: Floats) -> Floats:
        """With AᵀW A's eigenvalues and |AᵀW r|² along them."""
        from underskin.diagnosis.kernels import at_best_level

        each = np.empty(len(amplitudes))
        at_best_level(self.chi2, self.freedom, np.array(self.prior.row), eigenvalues, square, amplitudes, each)
        return each


def frequency_bins(frequency: Floats) -> tuple[Indices, Floats]:
    """Of each row its distinct frequency, or its bin where there are too many, and the frequencies."""
    distinct, line = np.unique(np.round(frequency, 6), return_inverse=True)
    if len(distinct) <= _MOST_LINES:
        return line, distinct
    edges = np.geomspace(distinct[0], distinct[-1] * (1 + 1e-9), _MOST_LINES + 1)
    line = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, _MOST_LINES - 1)
    used, line = np.unique(line, return_inverse=True)
    return line, np.sqrt(edges[used] * edges[used + 1])


_LENGTHS = (0.15, 0.4, 1.2)  # of a recording's axis, over its range
_GAINS = np.geomspace(0.005, 0.5, 17)  # fine enough for 65 recordings, which determine the scatter to 9 %
_USUAL_GAIN = 6  # of these
_GONE = 60.0  # nats behind the best node, which a process of few features cannot lose there
_USUAL_POSITION = np.geomspace(0.05e-3, 0.3e-3, 4)  # [m], beside a process; without one the scatter may be larger
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

    def summed(self, alike: Indices, weights: Floats) -> "tuple[SensorPairs, Floats]":
        """With what recordings of a sensor that are alike weigh together (scatters, pairs)."""
        if len(self.row) == 0:
            return self, weights
        sensor, row = self.spread(np.arange(len(self.first) - 1)), alike[self.row]
        order = np.lexsort((row, sensor))
        begins = np.flatnonzero(np.diff(sensor[order] * (int(alike.max()) + 1) + row[order], prepend=-1))
        first = np.searchsorted(sensor[order][begins], np.arange(len(self.first)))
        return SensorPairs(row[order][begins], first, self.single), np.add.reduceat(weights[:, order], begins, axis=-1)


@dataclass(frozen=True, eq=False)
class _WithoutProcess:
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
    def of(cls, nodes: ScatterNodes, fixed: Floats, pairs: SensorPairs, spread: float) -> "_WithoutProcess":
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
    def joined(cls, each: Sequence["_WithoutProcess"]) -> "_WithoutProcess":
        """The scatters of all of these, which are of the same recordings."""
        return each[0].with_scatters(lambda name: np.concatenate([getattr(entry, name) for entry in each]))

    def at(self, kept: Mask) -> "_WithoutProcess":
        """At some of the scatters."""
        return self.with_scatters(lambda name: getattr(self, name)[kept])

    def with_scatters(self, values: Callable[[str], Floats]) -> "_WithoutProcess":
        """The same recordings at other scatters, each field by its name."""
        return _WithoutProcess(
            values("log_density"), values("root"), values("shared"), values("taken"), values("weighed"), self.pairs
        )

    def summed(self, alike: Indices) -> "_WithoutProcess":
        """With the sums over recordings that are alike, which have the same features, in their place."""
        order = np.argsort(alike, kind="stable")
        first = np.searchsorted(alike[order], np.arange(int(alike.max()) + 1))
        square, taken, weighed = (
            np.add.reduceat(values[..., order], first, axis=-1) for values in (self.root**2, self.taken, self.weighed)
        )
        pairs, shared = self.pairs.summed(alike, self.shared)
        return replace(self, root=np.sqrt(square), shared=shared, taken=taken, weighed=weighed, pairs=pairs)

    def products(self, columns: Floats, count: int) -> Floats:
        """XᵀC⁻¹X of each of `count` blocks of columns X (recordings, columns): (count, scatters, size, size)."""
        from underskin.diagnosis.kernels import less_shared

        grams = np.ascontiguousarray(_weighed_grams(columns, count, self.root) - _grams(self.taken @ columns, count))
        less_shared(np.ascontiguousarray(self.shared), self.pairs.row, self.pairs.first, columns, grams)
        return grams


def over_recordings(problem: FittingProblem, explanation: Explanation) -> dict[str, float]:
    """The log evidence that a process of each kind gains over none."""
    campaign = problem.collapsed.campaign
    axes = {name: normalised(column) for name, column in recording_axes(campaign).items()}
    if problem.collapsed.recordings < _LEAST_RECORDINGS or not axes:
        return {}
    if len(axes) > 1:
        axes["all"] = np.concatenate(list(axes.values()), axis=1) / np.sqrt(len(axes))
    residual = GainResidual(problem, explanation)
    return {name: _smooth(residual, column) for name, column in axes.items()}


def mean_of_logs(log_values: list[float] | Floats) -> float:
    """log of the mean of what these are the logarithms of."""
    return float(logsumexp(log_values) - np.log(len(log_values)))


def _smooth(residual: "GainResidual", column: Floats) -> float:
    values, alike = np.unique(column, axis=0, return_inverse=True)
    if len(values) == len(column):
        return mean_of_logs(residual.gains(np.stack([features(column, length) for length in _LENGTHS]), AMPLITUDES))
    sets = np.stack([features(values, length) for length in _LENGTHS])
    return mean_of_logs(residual.gains(sets, AMPLITUDES, alike.reshape(-1)))


class GainResidual:
    """Each recording's gain residual, linear in the model's parameters, sensors' gains and a process' features."""

    def __init__(self, problem: FittingProblem, explanation: Explanation) -> None:
        self._best, parameters = explanation.best, explanation.model.parameters
        best = self._best
        size, _, _ = best.marginal.along(best.levels.position)
        self._least = FAINT * np.abs(size).max()
        slopes = best.marginal.slopes_along / self._not_faint(size)[:, None]
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
            size, ur, uu = best.marginal.along(position)
            size = self._not_faint(size)
            second_order = best.hypothesis.curvature.square
            has_position_scatter = position**2 * (self._moving**2).sum(axis=0) + 0.5 * position**4 * second_order
            log_weights = GAIN_PRIOR.log_density(np.log(_GAINS)) + np.log(share) - np.log(np.abs(size)).sum()
            variances = _GAINS[:, None] ** 2 + has_position_scatter + uu / size**2
            scatters.append(ScatterNodes(log_weights, ur / size - self._known, variances))
        return scatters

    @cached_property
    def _plain(self) -> float:
        """log p(residual) without a process."""
        return float(logsumexp([self._without(nodes).log_density for nodes in self._scatters(_ANY_POSITION)]))

    def _without(self, nodes: ScatterNodes) -> _WithoutProcess:
        return _WithoutProcess.of(nodes, self.fixed, self._pairs, self.spread)

    @cached_property
    def _usual(self) -> _WithoutProcess:
        """At all scatters of place and gain that can matter: no process gains more in one than half of χ² there."""
        each = [self._without(nodes) for nodes in self.usual]
        least = max(float(entry.log_density.max()) for entry in each) - _GONE
        highest = [
            entry.log_density + 0.5 * (entry.weighed @ nodes.residual)
            for entry, nodes in zip(each, self.usual, strict=True)
        ]
        return _WithoutProcess.joined(each).at(np.concatenate(highest) > least)

    @cached_property
    def _still(self) -> _WithoutProcess:
        """Without scatter of place, at one usual scatter of gain."""
        return self._without(self.usual[0]).at(np.arange(len(_GAINS)) == _USUAL_GAIN)

    def gains(self, sets: Floats, amplitudes: Floats, alike: Indices | None = None) -> Floats:
        """What each set of features (sets, recordings, features) gains over none at all, in log evidence (sets,).

        Where recordings are `alike` (recordings,), features are those of the distinct ones (sets, distinct, features).
        Over the priors of the scatters, and of the amplitudes, each as probable as the others.
        """
        without = self._usual if alike is None else self._usual.summed(alike)
        each = [_with(some, amplitudes, without) for some in _blocks(sets)]
        return np.asarray(logsumexp(np.concatenate(each, axis=1), axis=0) - self._plain)

    def amplitudes(self, sets: Floats) -> Floats:
        """The most probable amplitudes of features whose prior sd is 1, at a usual scatter (sets, features)."""
        return np.concatenate([_most_probable(some, self._still) for some in _blocks(sets)])


def _blocks(sets: Floats) -> list[Floats]:
    """So few sets at a time that what is worked out from them stays in the processor's cache."""
    return [sets[start : start + _BLOCK] for start in range(0, len(sets), _BLOCK)]


def _most_probable(sets: Floats, without: _WithoutProcess) -> Floats:
    """The most probable amplitudes of features at one scatter (sets, features)."""
    count, rows, size = sets.shape
    columns = np.ascontiguousarray(sets.transpose(1, 0, 2)).reshape(rows, -1)
    gram = without.products(columns, count)[:, 0] + np.eye(size)
    return np.asarray(np.linalg.solve(gram, (sets.transpose(0, 2, 1) @ without.weighed[0])[..., None])[..., 0])


def _with(sets: Floats, amplitudes: Floats, without: _WithoutProcess) -> Floats:
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


_KINDS = {"recordings": 0.45, "lines": 0.4, "both": 0.05, "scatter": 0.1}


@dataclass(frozen=True)
class Discrepancy:
    """The evidence for δ on top of one explanation: log Z of the whole, and of δ over each axis against none."""

    log_evidence: float
    axes: dict[str, float]  # log evidence gained; "frequency_hz" for lines


def discrepancy(problem: FittingProblem, explanation: Explanation) -> Discrepancy:
    """What a process gains on top of an explanation."""
    if problem.lines.curves:
        return _along_curves(problem, explanation)
    over = {
        "recordings": over_recordings(problem, explanation),
        "lines": over_lines(problem, explanation),
        "scatter": _unusual_scatter(explanation),
    }
    gained = {
        kind: float(logsumexp(list(gains.values())) - np.log(len(gains))) for kind, gains in over.items() if gains
    }
    if "recordings" in gained and "lines" in gained:
        gained["both"] = gained["recordings"] + gained["lines"]
    each = [np.log(_KINDS[kind]) + gain for kind, gain in gained.items()]
    total = float(logsumexp(each)) if each else -np.inf
    return Discrepancy(explanation.log_evidence + total, {**over["recordings"], **over["lines"], **over["scatter"]})


def _unusual_scatter(explanation: Explanation) -> dict[str, float]:
    """What scatter beyond the usual gains; looked for where the fit went beyond the usual itself."""
    levels = explanation.best.levels
    usual = explanation.best.hypothesis
    evidence = {}
    if levels.gain > GAIN_RANGE[1]:
        wider = replace(usual, gain=UNUSUAL_GAIN)
        evidence["scatter of gain"] = _refitted(wider, explanation, 0, UNUSUAL_GAIN.low)
    if levels.position > POSITION_RANGE[1]:
        wider = replace(usual, position=UNUSUAL_POSITION)
        evidence["scatter of position"] = _refitted(wider, explanation, 2, UNUSUAL_POSITION.low)
    return {name: log_evidence - explanation.log_evidence for name, log_evidence in evidence.items()}


def _refitted(hypothesis: Hypothesis, explanation: Explanation, place: int, least: float) -> float:
    """The evidence of a hypothesis whose `place`-th parameter of the covariance is large, from at least `least`."""
    fitter = Fitter([hypothesis])
    covariance = explanation.point.covariance.copy()
    covariance[place] = max(covariance[place], least)
    point = replace(explanation.point, covariance=covariance)
    improved = fitter.improve(fitter.at(point))
    if not hypothesis.lines.curves:
        return laplace(fitter, improved).log_evidence
    # By the quadratic of both: integrals over what is loose would take longer than all else, and add about the same.
    plain = Fitter([explanation.best.hypothesis])
    beneath = around(plain, plain.evaluate(plain.at(explanation.point)))[0].log_evidence
    return explanation.log_evidence + around(fitter, improved)[0].log_evidence - beneath


def _along_curves(problem: FittingProblem, explanation: Explanation) -> Discrepancy:
    """The smooth error that every hypothesis has of curves, large: everything is fitted again beneath it."""
    log_evidence = _refitted(
        replace(problem.hypothesis(explanation.names, has_position_scatter=False), smooth=UNNAMED),
        explanation,
        2,
        UNNAMED.low,
    )
    return Discrepancy(log_evidence, {"displacement_mm": log_evidence - explanation.log_evidence})
