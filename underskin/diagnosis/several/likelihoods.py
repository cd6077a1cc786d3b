"""Normal likelihoods of a few quantities: ln L(q) = height + linear·q − ½ qᵀ precision q, and integrals over them."""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.units import Floats

_INFORMS = 0.2  # of a prior's precision: what recordings add at least to say anything


def of_posterior(log_evidence: float, mean: Floats, covariance: Floats, centre: Floats, precision: Floats) -> Knowledge:
    """The likelihood that turns independent normal priors, of this centre and precision (quantities,), into a normal
    posterior of this mean and covariance, with this evidence.

    In directions in which that adds next to nothing to the priors the likelihood is flat: the quotient of both would
    otherwise grow without end.
    """
    root = np.sqrt(precision)
    values, vectors = np.linalg.eigh(np.linalg.inv(root[:, None] * covariance * root))
    informing = vectors[:, values > 1 + _INFORMS]
    added = values[values > 1 + _INFORMS]
    own = (informing * (added - 1)) @ informing.T * np.outer(root, root)
    linear = own @ centre + root * (informing @ (added * (informing.T @ (root * (mean - centre)))))
    return Knowledge(own, linear, log_evidence - log_integral(Knowledge(own, linear, 0.0), centre, precision).item())


def posterior(likelihood: Knowledge, centre: Floats, precision: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance under independent normal priors of this centre and precision (quantities,); of a stack of
    likelihoods one each."""
    covariance = np.linalg.inv(likelihood.precision + np.diag(precision))
    mean = np.einsum("...pq,...q->...p", covariance, likelihood.linear + precision * centre)
    return np.asarray(mean), np.asarray(covariance, float)


def log_integral(likelihood: Knowledge, centre: Floats, precision: Floats) -> Floats:
    """ln ∫ L(q) N(q; centre, 1/precision) dq; of a stack of likelihoods one each."""
    towards = likelihood.linear + precision * centre
    mean, covariance = posterior(likelihood, centre, precision)
    volume = np.log(precision).sum() + np.linalg.slogdet(covariance)[1]
    square = (towards * mean).sum(axis=-1) - (precision * centre**2).sum()
    return np.asarray(likelihood.height + 0.5 * (volume + square))


def of_mean(likelihood: Knowledge, variance: Floats) -> Knowledge:
    """∫ L(q) N(q; μ, variance) dq, as a likelihood of μ; of variances (…, quantities) a stack (…)."""
    loose = np.eye(len(likelihood.linear)) + likelihood.precision * variance[..., None, :]
    shrunk = np.linalg.inv(loose)
    linear = shrunk @ likelihood.linear
    square = (likelihood.linear * variance * linear).sum(axis=-1)
    height = likelihood.height + 0.5 * (square - np.linalg.slogdet(loose)[1])
    return Knowledge(shrunk @ likelihood.precision, linear, height)


def mixed(each: Sequence[tuple[float, Knowledge]], centre: Floats, precision: Floats) -> Knowledge:
    """A mixture of likelihoods, with log weights, as one: that of the evidence, mean and covariance which the mixture
    has under independent normal priors."""
    log_weights = np.array([share + log_integral(one, centre, precision).item() for share, one in each])
    total = float(np.logaddexp.reduce(log_weights))
    weights = np.exp(log_weights - total)
    found = [posterior(one, centre, precision) for _, one in each]
    means, covariances = np.array([mean for mean, _ in found]), np.array([covariance for _, covariance in found])
    mean = weights @ means
    away = means - mean
    covariance = np.einsum("n,npq->pq", weights, covariances + away[:, :, None] * away[:, None, :])
    return of_posterior(total, mean, covariance, centre, precision)
