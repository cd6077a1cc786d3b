"""The mixed model of an array's d33: sensor effect, recording scatter, position scatter and line noise.

Recording i of sensor s gives z_i = FRF_i / ((3/2) ρ² σ_i), in which
    z_i = μ (1 + b_s) m_i(p) e^(ε_i) + n_i,    b_s ~ N(0, t²), ε_i ~ N(0, g²), n_i ~ N(0, u_i²)
with μ the array's d33, t its relative spread over sensors, g the gain scatter of a recording, p the scatter of the
sphere's position (m_i the mean and v_i the variance of what it does to σ_i), u_i the known line noise. The covariance
is built along the model, never along the data. Given (t, g, p), μ is normal by generalised least squares (flat prior,
so the likelihood of (t, g, p) is the restricted one); (t, g, p) are marginalised on a grid under the priors below.
The interval is that of the mixture: with few sensors or recordings it has the wide tails of Student's t. Coverage is
lowest for a large spread of few sensors: with sensors that differ by 10 % (relative standard deviation), 90 % of the
95 % intervals hold the d33 of the population with 4 of them, and 87 % with 2.

Priors: g log-normal, 1–5 %; t zero, or half-Cauchy (Gelman 2006); p zero in most rigs, or 0.05–0.3 mm: the scatter of a
usual rig, before any recording, which the likelihood of a diagnosis uses too.

`many_sensors` sums up many sensors: their median, the range of 90 %, and outliers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri, stdtrit

from underskin.units import Floats, Indices, Mask, to_lab

GAIN_RANGE = (0.01, 0.05)  # relative standard deviation of a recording's gain: a good rig and a poor one
USUAL_GAIN = 0.022  # about the geometric mean of that range
POSITION_RANGE = (0.05e-3, 0.3e-3)  # standard deviation of the sphere's position in x and in y [m], where it scatters
NO_POSITION_SCATTER = 0.7  # probability that a rig's positions do not scatter: most stages repeat to some µm


GAINS = np.geomspace(2e-3, 0.8, 36)
SPREADS = np.concatenate([[0.0], np.geomspace(2e-3, 1.5, 36)])
POSITIONS = np.array([0.0, POSITION_RANGE[0], 0.1e-3, 0.15e-3, 0.2e-3, 0.25e-3, POSITION_RANGE[1]])  # [m]
_GAIN_FACTOR = 2.0  # of the log-normal prior about USUAL_GAIN
_NO_SPREAD, _SPREAD_SCALE = 0.6, 0.05
LEVEL = 0.95  # of intervals
SDS_OF_95 = float(ndtri((1 + LEVEL) / 2))  # half the width of an interval, in sd of a normal distribution


@dataclass(frozen=True)
class Estimate:
    """A value with its standard uncertainty and 95 % interval; arrays where there are several."""

    value: Floats
    uncertainty: Floats
    low: Floats
    high: Floats

    def wider(self, relative: float | Floats) -> "Estimate":
        """The estimate with a further standard uncertainty, relative to the value, or to each."""
        further = relative * np.abs(self.value)
        low, high = (np.hypot(side, SDS_OF_95 * further) for side in (self.value - self.low, self.high - self.value))
        return Estimate(self.value, np.hypot(self.uncertainty, further), self.value - low, self.value + high)

    def d33_rows(self) -> list[list[float]]:
        """Value, uncertainty, low and high of each d33 [pC/N]."""
        parts = [np.atleast_1d(part) for part in (self.value, self.uncertainty, self.low, self.high)]
        return to_lab("d33_pc_per_n", np.column_stack(parts)).tolist()


@dataclass(frozen=True)
class LevelRows:
    """Recordings: `z` and `line` (u) in one unit, `pilot`, a first value of the d33 of each, to which the gain's
    variance is proportional, and m_i and v_i at each of POSITIONS (positions, rows)."""

    z: Floats
    line: Floats
    pilot: Floats
    position_mean: Floats
    position_variance: Floats

    def part(self, chosen: Indices | Mask) -> "LevelRows":
        """Some of the rows."""
        return LevelRows(*(column[..., chosen] for column in vars(self).values()))

    def sums(self, group: Indices, count: int) -> tuple[Floats, Floats, Floats, Floats]:
        """With x = E z over the group's d33 and w the inverse variance about it: Σ w x² and Σ w x z of each group
        (positions, gains, groups), Σ w z² and Σ ln w of all rows (positions, gains)."""
        sums = []
        for position in range(len(POSITIONS)):  # one at a time: all at once would take 2 kB a row for each product
            design, weight = self._moments(position)
            of_groups = (
                _sum_by_group(product, group, count) for product in (weight * design**2, weight * design * self.z)
            )
            sums.append((*of_groups, (weight * self.z**2).sum(-1), np.log(weight).sum(-1)))
        information, moment, squares, log_weight = (np.array(part) for part in zip(*sums, strict=True))
        return information, moment, squares, log_weight

    def _moments(self, position: int) -> tuple[Floats, Floats]:
        """E z over its sensor's d33, and 1/variance about it, each (gains, rows)."""
        mean, variance = self.position_mean[position], np.maximum(self.position_variance[position], 0)
        gain = GAINS[:, None] ** 2
        scatter = mean**2 * np.expm1(gain) * np.exp(gain) + variance
        return mean * np.exp(gain / 2), 1 / (np.square(self.pilot) * scatter + self.line**2)


@dataclass(frozen=True)
class ScatterPosterior:
    """The posterior of gain and position scatter: `weights` (positions, gains) that sum to 1."""

    weights: Floats

    def d33(self, rows: LevelRows, group: Indices, count: int) -> Estimate:
        """The d33 of each group of recordings, from the recordings of that group only.

        Parameters
        ----------
        rows : LevelRows
            The recordings [C/N].
        group : (rows,) array of int
            The number of each one's group, from 0.
        count : int
            Number of groups.

        Returns
        -------
        Estimate
            d33 with standard uncertainty and 95 % interval [C/N], (count,) each; NaN for a group without recordings.
        """
        information, moment, _, _ = rows.sums(group, count)
        with np.errstate(divide="ignore", invalid="ignore"):
            values, variances = moment / information, 1 / information
            posterior = self.weights[..., None]
            value = (posterior * values).sum(axis=(0, 1))
            between = (posterior * (values - value) ** 2).sum(axis=(0, 1))
            variance = (posterior * variances).sum(axis=(0, 1))
            unsure = (posterior * (variances - variance) ** 2).sum(axis=(0, 1))
            # An uncertain variance: the Student t whose variance has the same mean and spread.
            freedom = 4 + 2 * variance**2 / np.maximum(unsure, 1e-12 * variance**2)
            scale = np.sqrt(variance * (freedom - 2) / freedom + between)
        half_width = stdtrit(freedom, (1 + LEVEL) / 2) * scale
        return Estimate(value, np.sqrt(variance + between), value - half_width, value + half_width)


@dataclass(frozen=True)
class MixedModel:
    """`mean` is the array's d33; `spread` (relative), `gain` (relative) and `position` [m] the scatters."""

    mean: Estimate
    spread: Estimate
    gain: Estimate
    position: Estimate
    scatter: ScatterPosterior


def fit(rows: LevelRows, sensor: Indices) -> MixedModel:
    """The mixed model of recordings of an array.

    Parameters
    ----------
    rows : LevelRows
        The recordings [C/N].
    sensor : (rows,) array of int
        The number of each one's sensor, from 0.

    Returns
    -------
    MixedModel
        The array's d33 [C/N] and the scatters. With one sensor the spread is 0 and the mean is that sensor's own d33.

    Source
    ------
    Restricted likelihood with the priors of the module; Gelman 2006 for that of the spread.
    """
    count = int(sensor.max()) + 1
    spreads = SPREADS if count > 1 else SPREADS[:1]
    information, moment, squares, log_weight = rows.sums(sensor, count)
    information, moment = information[:, :, None, :], moment[:, :, None, :]
    between = (spreads[:, None] * float(np.median(np.abs(rows.pilot)))) ** 2
    inflation = 1 + between * information
    total, first = (information / inflation).sum(-1), (moment / inflation).sum(-1)
    means = first / total
    residual = squares[..., None] - (between * moment**2 / inflation).sum(-1)
    log_density = 0.5 * (log_weight[..., None] - np.log(inflation).sum(-1) - residual + means * first - np.log(total))
    posterior = np.exp(log_density - log_density.max()) * _prior(spreads)
    posterior /= posterior.sum()
    return MixedModel(
        _mixture(posterior, means, np.sqrt(1 / total)),
        _scale_estimate(posterior.sum(axis=(0, 1)), spreads),
        _scale_estimate(posterior.sum(axis=(0, 2)), GAINS),
        _scale_estimate(posterior.sum(axis=(1, 2)), POSITIONS),
        ScatterPosterior(posterior.sum(axis=2)),
    )


def prior_scatter() -> ScatterPosterior:
    """The prior of gain and position scatter."""
    weights = _prior(SPREADS[:1])[..., 0]
    return ScatterPosterior(weights / weights.sum())


def _prior(spreads: Floats) -> Floats:
    """Prior weight of each node, the cells of the grid included (positions, gains, spreads)."""
    gain = np.exp(-0.5 * (np.log(GAINS / USUAL_GAIN) / np.log(_GAIN_FACTOR)) ** 2)
    spread = np.ones(1)
    if len(spreads) > 1:
        spread = np.gradient(spreads) / (1 + (spreads / _SPREAD_SCALE) ** 2)
        spread *= (1 - _NO_SPREAD) / spread[1:].sum()
        spread[0] = _NO_SPREAD
    position = np.full(len(POSITIONS), (1 - NO_POSITION_SCATTER) / (len(POSITIONS) - 1))
    position[0] = NO_POSITION_SCATTER
    return position[:, None, None] * gain[:, None] * spread


def _mixture(weights: Floats, means: Floats, deviations: Floats) -> Estimate:
    """Mean and central interval of a mixture of normals; its uncertainty is that of a normal with this interval."""
    relevant = weights > 1e-7 * weights.max()
    weight, mean, deviation = weights[relevant] / weights[relevant].sum(), means[relevant], deviations[relevant]
    low, high = (mixture_quantile(weight, mean, deviation, q) for q in ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    uncertainty = (high - low) / (2 * SDS_OF_95)
    return Estimate(np.array(weight @ mean), np.array(uncertainty), low, high)


def mixture_quantile(weights: Floats, means: Floats, deviations: Floats, probability: float) -> Floats:
    """The quantile of each mixture of normals (…, nodes), by bisection."""
    low, high = (means - 40 * deviations).min(axis=-1), (means + 40 * deviations).max(axis=-1)
    for _ in range(60):
        middle = (low + high) / 2
        below = (weights * ndtr((middle[..., None] - means) / deviations)).sum(axis=-1) < probability
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray((low + high) / 2)


def _scale_estimate(weights: Floats, nodes: Floats) -> Estimate:
    """Mean, deviation and central interval of a scatter over its nodes."""
    value = float(weights @ nodes)
    low, high = np.interp([(1 - LEVEL) / 2, (1 + LEVEL) / 2], np.cumsum(weights) - weights / 2, nodes)
    return Estimate(np.array(value), np.sqrt(weights @ (nodes - value) ** 2), np.asarray(low), np.asarray(high))


def _sum_by_group(values: Floats, group: Indices, count: int) -> Floats:
    """Sums over the last axis by group: (…, rows) → (…, count)."""
    return values @ np.eye(count)[group] if count <= 64 else _sorted_sums(values, group, count)


def _sorted_sums(values: Floats, group: Indices, count: int) -> Floats:
    order = np.argsort(group, kind="stable")
    present, first = np.unique(group[order], return_index=True)
    sums = np.zeros((*values.shape[:-1], count))
    sums[..., present] = np.add.reduceat(values[..., order], first, axis=-1)
    return sums


MOST_NAMED = 12  # sensors that a figure draws and names one by one
_MIDDLE = (0.05, 0.95)  # quantiles of the range
ROBUST = 1.4826  # standard deviation over median absolute deviation of a normal distribution
_APART = 4.5  # standard deviations about the median; by chance exceeded in 4 % of arrays of 13, 0.6 % of 60


@dataclass(frozen=True)
class ManySensors:
    """`median`, and `low` and `high` between which 90 % lie, in the unit of the values; `apart`: the indices of the
    outliers, the furthest first."""

    median: float
    low: float
    high: float
    apart: tuple[int, ...]


def many_sensors(values: Floats, uncertainties: Floats) -> ManySensors:
    """The summary of at least one value (sensors,) with standard uncertainties (sensors,), in the same unit.

    An outlier lies more than 4.5 standard deviations from the median: that of the sensors by the median absolute
    deviation, or its own standard uncertainty, whichever is larger.
    """
    median = float(np.median(values))
    distance = np.abs(values - median)
    deviation = np.maximum(ROBUST * np.median(distance), uncertainties)
    outliers = np.flatnonzero(distance > _APART * deviation)
    low, high = np.quantile(values, _MIDDLE)
    return ManySensors(
        median, float(low), float(high), tuple(outliers[np.argsort(-distance[outliers], kind="stable")].tolist())
    )
