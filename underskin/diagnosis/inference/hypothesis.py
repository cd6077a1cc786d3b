"""One hypothesis: a model, the lines it is to explain, and the coordinates in which it is fitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.curve_products import CurveLines, CurveProducts
from underskin.diagnosis.inference.frf_products import FrfLines, frf_lines
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.diagnosis.inference.pickup_rows import PickupRows, pickup_rows
from underskin.diagnosis.noise.correlated_error import USUAL
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR, Plateau, level_prior
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.models.composition import parameters_together
from underskin.mechanisms.models.curves import CurveModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.units import Floats

_LEVELS = (0.1, 100.0)  # bounds of the lines' level
_CURVE_LEVELS = (0.3, 5.0)  # no cell is more accurate, however smooth; rougher than its neighbours differ is no noise


@dataclass(frozen=True)
class CovarianceParameter:
    """A coordinate that moves the covariance alone: its name, bounds and prior."""

    name: str
    low: float
    high: float
    prior: Plateau


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
    knowledge: Knowledge | None = None  # from recordings of other kinds

    @cached_property
    def mean_places(self) -> list[int]:
        """The places of the model's parameters that move the mean."""
        return [index for index, entry in enumerate(self.model.parameters) if not entry.moves_covariance]

    @cached_property
    def covariance(self) -> tuple[CovarianceParameter, ...]:
        """Gain scatter, line level, position scatter or smooth error where there is one, then the model's own."""
        low, high = _CURVE_LEVELS if self.lines.curves else _LEVELS
        level = level_prior(self.lines.noise.log_level_sd)
        common = [
            CovarianceParameter("gain", np.log(1e-3), np.log(0.5), self.gain),
            CovarianceParameter("level", np.log(low), np.log(high), level),
        ]
        if self.placed:
            highest = self.position.high + np.log(2.0)
            common.append(CovarianceParameter("position", np.log(2e-5), highest, self.position))
        if self.lines.curves:
            common.append(CovarianceParameter("smooth", np.log(1e-5), np.log(2.0), self.smooth))
        own = [
            CovarianceParameter(entry.name, *entry.bounds, _as_plateau(entry))
            for entry in self.model.parameters
            if entry.moves_covariance
        ]
        return (*common, *own)

    @cached_property
    def bounds(self) -> Floats:
        """Lowest and highest coordinates of the model's parameters (2, parameters)."""
        return np.array([entry.bounds for entry in self.model.parameters]).T

    @cached_property
    def priors(self) -> Floats:
        """Of the model's parameters' priors precision and centre (see `curvature_of_prior`), the logarithm of their
        height, and the degrees of freedom of their tails (4, parameters)."""
        rows = []
        for entry in self.model.parameters:
            freedom = entry.prior.freedom if isinstance(entry.prior, Normal) else np.inf
            rows.append((*curvature_of_prior(entry), entry.log_height, freedom))
        return np.array(rows).T

    @cached_property
    def own_parameters(self) -> int:
        """How many of the model's parameters are its mechanisms' own; they come first."""
        mechanisms = [self.lines.mechanisms[name] for name in self.model.names]
        return sum(map(len, parameters_together(mechanisms, self.lines.campaign, self.lines.kind).values()))

    def group(self, number: int) -> object:
        """The same for hypotheses that can be evaluated together; `number` tells those apart that cannot."""
        own = tuple(entry.name for entry in self.covariance)
        return number if self.lines.curves else (self.gain, self.position, own)

    @cached_property
    def _curve_lines(self) -> CurveLines:
        return CurveLines(self.lines)

    def curve_products(self, fit: Floats, *, slopes: bool) -> CurveProducts:
        """Of curves the inner products of the model at points (points, parameters), with derivatives on request."""
        assert isinstance(self.model, CurveModel)
        force, by_force = self.model.forces_and_slopes(fit) if slopes else (self.model.forces(fit), None)
        return CurveProducts.of(self._curve_lines, force, by_force)

    @property
    def frf_model(self) -> FrfModel:
        """The model, which is one of FRFs."""
        assert isinstance(self.model, FrfModel)
        return self.model

    @cached_property
    def frf_lines(self) -> FrfLines:
        """The lines as sums over the model's distinct lines."""
        return frf_lines(self.lines, self.frf_model.design)

    @cached_property
    def pickup_rows(self) -> PickupRows | None:
        """The rows that pick-up reaches, where the model has any."""
        pickup, design = self.model.pickup, self.frf_model.design
        return None if pickup is None else pickup_rows(self.lines, pickup, design)


@dataclass(frozen=True)
class FitPoint:
    """Where a fit stands: the model's coordinates, the covariance's, and each sensor's most probable log gain."""

    fit: Floats
    covariance: Floats
    bend: Floats


def _as_plateau(entry: Parameter) -> Plateau:
    """A parameter's prior within its bounds, normalised there."""
    if isinstance(entry.prior, Normal):
        area = float(np.exp(-entry.log_height))
        return Plateau(entry.prior.mean, entry.prior.mean, entry.prior.sd, entry.prior.sd, area)
    low, high = entry.bounds
    return Plateau(low, high, 1.0, 1.0, high - low)


def curvature_of_prior(entry: Parameter) -> tuple[float, float]:
    """Precision and centre of a parameter's prior; 0 where it is uniform."""
    if isinstance(entry.prior, Normal):
        return entry.prior.sd**-2, entry.prior.mean
    return 0.0, 0.0


def quadratic_of_prior(entry: Parameter, fit: float) -> tuple[float, float]:
    """Precision and centre of a quadratic that has the gradient of a parameter's prior at a fit coordinate, as the
    covariance of a fit counts it; 0 where the prior is uniform."""
    precision, centre = curvature_of_prior(entry)
    freedom = entry.prior.freedom if isinstance(entry.prior, Normal) else np.inf
    if np.isfinite(freedom):
        precision *= (freedom + 1) / (freedom + precision * (fit - centre) ** 2)
    return precision, centre


def own_places(names: Sequence[str], lines: Lines) -> dict[str, slice]:
    """Where in a composed model's parameters each mechanism's are."""
    mechanisms = [mechanism for name, mechanism in lines.mechanisms.items() if name in names]
    places, first = {}, 0
    for name, own in parameters_together(mechanisms, lines.campaign, lines.kind).items():
        places[name] = slice(first, first + len(own))
        first += len(own)
    return places
