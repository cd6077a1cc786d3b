"""One hypothesis' evidence by nested sampling (dynesty), against which Laplace's method is checked: tests and bench.

Likelihood and priors are those of the diagnosis; no density is taken as normal, and no most probable point is sought.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import dynesty
import numpy as np

from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.hypothesis import CovarianceParameter, FitPoint
from underskin.units import Floats

_NODES = 8001  # of the grid on which a covariance parameter's prior is inverted
_MOST_UNIFORM = 6  # parameters up to which dynesty draws uniformly


class Posterior:
    """One hypothesis' likelihood and prior as functions of all its parameters x: the mean's, then the covariance's."""

    def __init__(self, fitter: Fitter, around: FitPoint) -> None:
        """`around` gives the place where the sensors' gains are linearised first."""
        self.fitter, self._around = fitter, around
        hypothesis = fitter.hypothesis
        self._places = hypothesis.mean_indices
        self._mean = [hypothesis.model.parameters[place] for place in self._places]
        self._covariance = [_quantiles(entry) for entry in fitter.covariance]
        bounds = [*(entry.bounds for entry in self._mean), *((entry.low, entry.high) for entry in fitter.covariance)]
        self._low, self._high = np.array(bounds).T

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return len(self._mean) + len(self._covariance)

    def log_density(self, x: Floats) -> float:
        """Likelihood times prior, up to what all hypotheses share; −∞ outside the bounds."""
        fitter, count = self.fitter, len(self._mean)
        if ((x < self._low) | (x > self._high)).any():
            return -np.inf
        fit = self._around.fit.copy()
        fit[self._places] = x[:count]
        points = fitter.with_covariance(fitter.at(replace(self._around, fit=fit)), x[None, count:])
        return -float(fitter.evaluate(points, slopes=False).cost[0])

    def log_prior(self, x: Floats) -> float:
        """The prior's density, within the bounds."""
        count = len(self._mean)
        mean = sum(entry.log_prior(value) for entry, value in zip(self._mean, x[:count], strict=True))
        covariance = zip(self.fitter.covariance, x[count:].tolist(), strict=True)
        return mean + sum(float(entry.prior.log_density(value)) for entry, value in covariance)

    def log_likelihood(self, x: Floats) -> float:
        """The likelihood alone, within the bounds."""
        return self.log_density(x) - self.log_prior(x)

    def drawn(self, unit: Floats) -> Floats:
        """The parameters at these quantiles of their priors."""
        count = len(self._mean)
        mean = [entry.quantile(u) for entry, u in zip(self._mean, unit[:count], strict=True)]
        covariance = [quantile(u) for quantile, u in zip(self._covariance, unit[count:].tolist(), strict=True)]
        return np.array([*mean, *covariance])


def _quantiles(entry: CovarianceParameter) -> Callable[[float], float]:
    """The quantile function of a covariance parameter's prior, whose mass is all within its bounds."""
    x = np.linspace(entry.low, entry.high, _NODES)
    density = np.exp(entry.prior.log_density(x))
    below = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2))
    return lambda probability: float(np.interp(probability * below[-1], below, x))


@dataclass(frozen=True)
class Sampled:
    """The log evidence, its standard error as the sampler estimates it, and the likelihoods worked out."""

    log_evidence: float
    error: float
    likelihoods: int


def nested(posterior: Posterior) -> Sampled:
    """By dynesty as it comes, uniformly from several ellipsoids; in more than six dimensions by random walks.

    There its ellipsoids may hold so little of the posterior that it advises walks.
    """
    walks = {"sample": "rwalk", "nlive": 250} if posterior.size > _MOST_UNIFORM else {}
    random = np.random.default_rng(1)
    sampler = dynesty.NestedSampler(posterior.log_likelihood, posterior.drawn, posterior.size, rstate=random, **walks)
    sampler.run_nested(print_progress=False)
    found = sampler.results
    return Sampled(float(found.logz[-1]), float(found.logzerr[-1]), int(np.sum(found.ncall)))
