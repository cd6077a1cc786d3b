"""One hypothesis: a model, the lines it is to explain, and the coordinates in which it is fitted."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.diagnosis.noise.correlated_error import USUAL
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR, Plateau, level_prior
from underskin.mechanisms.base import Normal, Parameter
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.models.composition import parameters_together
from underskin.mechanisms.registry import CATALOGUE
from underskin.units import Floats

_LEVELS = (0.1, 100.0)  # bounds of the lines' level
_CURVE_LEVELS = (0.5, 3.0)  # no cell is more accurate, however smooth; rougher than its neighbours differ is no noise


@dataclass(frozen=True)
class CovarianceParameter:
    """A coordinate that moves the covariance alone: its name, bounds and log prior density."""

    name: str
    low: float
    high: float
    log_density: Callable[[float], float]


@dataclass(frozen=True)
class Hypothesis:
    """A model and the lines it is to explain, with or without positioning scatter, and how large scatter may be."""

    model: Model
    lines: Lines
    curvature: Curvature
    placed: bool  # whether there is positioning scatter
    gain: Plateau = GAIN_PRIOR
    position: Plateau = POSITION_PRIOR
    smooth: Plateau = USUAL  # η of curves

    @property
    def mean_places(self) -> list[int]:
        """The places of the model's parameters that move the mean."""
        return [index for index, entry in enumerate(self.model.parameters) if not entry.moves_covariance]

    @property
    def covariance(self) -> tuple[CovarianceParameter, ...]:
        """Gain scatter, line level, position scatter or smooth error where there is one, then the model's own."""
        low, high = _CURVE_LEVELS if self.lines.curves else _LEVELS
        level = level_prior(self.lines.noise.log_level_sd)
        common = [
            CovarianceParameter("gain", np.log(1e-3), np.log(0.5), self.gain.log_density),
            CovarianceParameter("level", np.log(low), np.log(high), level.log_density),
        ]
        if self.placed:
            highest = self.position.high + np.log(2.0)
            common.append(CovarianceParameter("position", np.log(2e-5), highest, self.position.log_density))
        if self.lines.curves:
            common.append(CovarianceParameter("smooth", np.log(1e-5), np.log(2.0), self.smooth.log_density))
        own = [
            CovarianceParameter(entry.name, *entry.bounds, entry.log_prior)
            for entry in self.model.parameters
            if entry.moves_covariance
        ]
        return (*common, *own)


@dataclass(frozen=True)
class FitPoint:
    """Where a fit stands: the model's coordinates, the covariance's, and each sensor's most probable log gain."""

    fit: Floats
    covariance: Floats
    bend: Floats


def own_parameters(hypothesis: Hypothesis) -> int:
    """How many of the model's parameters are its mechanisms' own; they come first."""
    mechanisms = [CATALOGUE[name] for name in hypothesis.model.names]
    return sum(map(len, parameters_together(mechanisms, hypothesis.lines.campaign, hypothesis.lines.kind).values()))


def curvature_of_prior(entry: Parameter) -> tuple[float, float]:
    """Precision and centre of a parameter's prior; 0 where it is uniform."""
    if isinstance(entry.prior, Normal):
        return entry.prior.sd**-2, entry.prior.mean
    return 0.0, 0.0
