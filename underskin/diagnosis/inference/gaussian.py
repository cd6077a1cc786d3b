"""Gaussian likelihoods of a few quantities, and mixtures of normal distributions of one quantity.

The likelihood of parameters q by recordings of another kind, date or skin is kept as

    ln L(q) = height + linear·q − ½ qᵀ precision q,

which is additive over independent recordings and integrates in closed form over normal priors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from underskin.units import Floats

_INFORMS = 0.2  # of a prior's precision: the least that informative recordings add
LEAST_EIGENVALUE = 1e-11  # of scaled covariances or their information, which are about 1: less is rounding


@dataclass(frozen=True, eq=False)
class Gaussian:
    """ln L(q) = height + linear·q − ½ qᵀ precision q of q (quantities,), or a stack (…) of these over common axes."""

    precision: Floats  # (…, quantities, quantities)
    linear: Floats  # (…, quantities)
    height: float | Floats  # (…)

    @classmethod
    def of(cls, mean: Floats, precision: Floats, height: float) -> Self:
        """height − ½ (q − mean)ᵀ precision (q − mean)."""
        return cls(precision, precision @ mean, float(height - 0.5 * mean @ precision @ mean))

    @classmethod
    def from_posterior(
        cls, log_evidence: float, mean: Floats, covariance: Floats, centre: Floats, precision: Floats
    ) -> Self:
        """The likelihood that turns independent normal priors, of this centre and precision (quantities,), into a
        normal posterior of this mean and covariance, with this evidence.

        Flat in directions where the posterior hardly differs from the priors: there their quotient would grow without
        limit.
        """
        root = np.sqrt(precision)
        shares, vectors = np.linalg.eigh(root[:, None] * covariance * root)
        values = 1 / np.maximum(shares, LEAST_EIGENVALUE)
        informing = vectors[:, values > 1 + _INFORMS]
        ratios = values[values > 1 + _INFORMS]
        added = (informing * (ratios - 1)) @ informing.T * np.outer(root, root)
        linear = added @ centre + root * (informing @ (ratios * (informing.T @ (root * (mean - centre)))))
        return cls(added, linear, log_evidence - cls(added, linear, 0.0).log_integral(centre, precision).item())

    @classmethod
    def mixture(cls, components: Sequence[tuple[float, "Gaussian"]], centre: Floats, precision: Floats) -> Self:
        """A mixture of likelihoods, with log weights, as one Gaussian: with the evidence, mean and covariance that the
        mixture has under independent normal priors."""
        log_weights = np.array(
            [share + component.log_integral(centre, precision).item() for share, component in components]
        )
        total = float(np.logaddexp.reduce(log_weights))
        weights = np.exp(log_weights - total)
        posteriors = [component.posterior(centre, precision) for _, component in components]
        mean, covariance = moments(weights, [mean for mean, _ in posteriors], [matrix for _, matrix in posteriors])
        return cls.from_posterior(total, mean, covariance, centre, precision)

    def __add__(self, other: "Gaussian") -> "Gaussian":
        return Gaussian(self.precision + other.precision, self.linear + other.linear, self.height + other.height)

    def log_density(self, point: Floats) -> float:
        """ln L at one point (quantities,)."""
        return float(self.log_densities(point[None])[0])

    def log_densities(self, points: Floats) -> Floats:
        """ln L at points (points, quantities)."""
        quadratic = np.einsum("np,pq,nq->n", points, self.precision, points)
        return np.asarray(self.height + points @ self.linear - 0.5 * quadratic)

    def gradients(self, points: Floats) -> Floats:
        """∂ ln L/∂q at points (points, quantities)."""
        return np.asarray(self.linear - points @ self.precision)

    def posterior(self, centre: Floats, precision: Floats) -> tuple[Floats, Floats]:
        """Mean (…, quantities) and covariance under normal priors of this centre and precision, independent
        (quantities,) or not (quantities, quantities)."""
        prior = _matrix(precision)
        covariance = np.linalg.inv(self.precision + prior)
        mean = np.einsum("...pq,...q->...p", covariance, self.linear + prior @ centre)
        return np.asarray(mean), np.asarray(covariance, float)

    def log_integral(self, centre: Floats, precision: Floats) -> Floats:
        """ln ∫ L(q) N(q; centre, 1/precision) dq (…)."""
        prior = _matrix(precision)
        towards = self.linear + prior @ centre
        mean, covariance = self.posterior(centre, prior)
        volume = np.linalg.slogdet(prior)[1] + np.linalg.slogdet(covariance)[1]
        square = (towards * mean).sum(axis=-1) - centre @ prior @ centre
        return np.asarray(self.height + 0.5 * (volume + square))

    def of_mean(self, variance: Floats) -> "Gaussian":
        """∫ L(q) N(q; μ, diag variance) dq as a likelihood of μ; for variances (…, quantities) a stack (…)."""
        loosened = np.eye(self.linear.shape[-1]) + self.precision * variance[..., None, :]
        shrunk = np.linalg.inv(loosened)
        linear = np.einsum("...pq,...q->...p", shrunk, self.linear)
        square = (self.linear * variance * linear).sum(axis=-1)
        return Gaussian(shrunk @ self.precision, linear, self.height + 0.5 * (square - np.linalg.slogdet(loosened)[1]))

    def over(self, matrix: Floats, offset: Floats) -> "Gaussian":
        """The likelihood of x (parameters,) where q = matrix x + offset."""
        return Gaussian(
            matrix.T @ self.precision @ matrix,
            matrix.T @ (self.linear - self.precision @ offset),
            self.log_density(offset),
        )


def _matrix(precision: Floats) -> Floats:
    return np.diag(precision) if precision.ndim == 1 else precision


def moments(shares: Floats, means: Sequence[Floats], covariances: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Mean and covariance of a mixture of distributions; `shares` sum to 1."""
    mean = np.asarray(shares @ np.array(means))
    offsets = np.array(means) - mean
    return mean, np.tensordot(shares, np.array(covariances), 1) + (shares[:, None] * offsets).T @ offsets


@dataclass(frozen=True)
class NormalMixture:
    """A mixture of normal distributions of one quantity; `share` (components,) need not sum to 1."""

    share: Floats
    mean: Floats
    deviation: Floats

    def times(self, factor: float) -> "NormalMixture":
        """With every share multiplied by the factor."""
        return NormalMixture(factor * self.share, self.mean, self.deviation)

    def moved(self, by: float) -> "NormalMixture":
        """With every mean shifted by `by`."""
        return NormalMixture(self.share, self.mean + by, self.deviation)

    def averaged_over(self, changes: Floats) -> "NormalMixture":
        """The mean of the distributions moved by each of the changes (changes,)."""
        return NormalMixture.joined([self.moved(change).times(1 / len(changes)) for change in changes.tolist()])

    @classmethod
    def joined(cls, mixtures: Sequence["NormalMixture"]) -> Self:
        """All components of several mixtures."""
        return cls(
            *(
                np.concatenate([getattr(mixture, name) for mixture in mixtures])
                for name in ("share", "mean", "deviation")
            )
        )
