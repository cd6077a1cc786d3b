"""The interface of a mechanism: a law that the base model leaves out, its parameters, and the stage at which it acts.

A mechanism is one file: a class that states its texts and traits as attributes and its law in one hook, `act`. It keeps
no state. Values on a state are SI, parameters are in their units. A parameter has bounds, a coordinate on which it is
fitted, and a prior on that coordinate.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.special import gammaln, ndtr, ndtri, stdtr, stdtrit

from underskin.autodiff import Differentiated
from underskin.errors import UnderskinError
from underskin.recordings.campaign import Conditions

# What a parameter changes: the predicted mean; the spread of the sensors' gains; the variance of single lines.
ActsOn = Literal["mean", "gain_spread", "line_variance"]
_AT_BOUND = 1e-6  # of the range of fit coordinates: where a bounded fit stops


@dataclass(frozen=True)
class Normal:
    """A normal distribution on the fit coordinate."""

    mean: float
    sd: float
    freedom: ClassVar[float] = np.inf  # degrees of freedom of its tails

    def log_shape(self, fit: float) -> float:
        """The logarithm of its density over that at the mean."""
        return -0.5 * ((fit - self.mean) / self.sd) ** 2

    @property
    def log_height(self) -> float:
        """The logarithm of its density at the mean."""
        return -0.5 * float(np.log(2 * np.pi)) - float(np.log(self.sd))

    def below(self, fit: float) -> float:
        """The cumulative probability up to a fit coordinate."""
        return float(ndtr((fit - self.mean) / self.sd))

    def at(self, probability: float) -> float:
        """The quantile of a probability."""
        return float(self.mean + self.sd * ndtri(probability))


@dataclass(frozen=True)
class HeavyTailed(Normal):
    """Student's t distribution with three degrees of freedom on the fit coordinate, `sd` its scale.

    For strengths of which typical values are known: close to normal near the mean, but a value more than three
    scales from it is twenty times as likely, since rigs differ by more than published values suggest.
    """

    freedom: ClassVar[float] = 3.0

    def log_shape(self, fit: float) -> float:
        """The logarithm of its density over that at the mean."""
        square = ((fit - self.mean) / self.sd) ** 2
        return -0.5 * (self.freedom + 1) * float(np.log1p(square / self.freedom))

    @property
    def log_height(self) -> float:
        """The logarithm of its density at the mean."""
        half = self.freedom / 2
        shape = gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(self.freedom * np.pi)
        return float(shape - np.log(self.sd))

    def below(self, fit: float) -> float:
        """The cumulative probability up to a fit coordinate."""
        return float(stdtr(self.freedom, (fit - self.mean) / self.sd))

    def at(self, probability: float) -> float:
        """The quantile of a probability."""
        return float(self.mean + self.sd * stdtrit(self.freedom, probability))


@dataclass(frozen=True)
class Uniform:
    """Equal density on the fit coordinate between the bounds."""


Prior = Normal | Uniform


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may change. Its fit coordinate is the value (`linear`) or its natural logarithm (`log`).

    `low`, `high` and `limit` are values in `unit`; the prior is a density on the fit coordinate, truncated to the
    bounds and normalised there. `limit` is the value at which the base model is recovered (it may lie outside the
    bounds: 0 or ∞ of a logarithm), None where no value does that. `shown` is the value used in the mechanism's figure,
    None for a typical strength. The response is `proportional` to a parameter such as d33. A parameter that does not
    act on the mean is positive and has the scale `log`.

    A parameter `relative_to` another one of its mechanism is fitted as a multiple of it: `low`, `high`, `limit` and
    the prior are of the multiple, while laws and reports have the product, in `unit`.

    A bound in `closed` is physical, not an end of the search (a fraction of 1, a special case of the law), so that a
    value there is a result. So is a value at `limit`.

    `starts` are values, within the bounds, at which fits begin instead of quantiles of the prior; of a parameter
    `relative_to` another one, multiples.
    """

    name: str
    unit: str
    low: float
    high: float
    prior: Prior
    scale: Literal["linear", "log"]
    limit: float | None
    reason: str
    acts_on: ActsOn = "mean"
    shown: float | None = None
    proportional: bool = False
    relative_to: str | None = None
    starts: tuple[float, ...] = ()
    closed: tuple[float, ...] = ()

    @property
    def moves_covariance(self) -> bool:
        """Whether it changes the covariance of the rows and not their mean."""
        return self.acts_on != "mean"

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest fit coordinate."""
        return self.to_fit(self.low), self.to_fit(self.high)

    @property
    def start(self) -> float:
        """The prior's centre on the fit coordinate."""
        low, high = self.bounds
        return min(max(self.prior.mean, low), high) if isinstance(self.prior, Normal) else (low + high) / 2

    @property
    def typical(self) -> float:
        """The fit coordinate of a typical strength: the quartile of the prior that is farther from the limit."""
        limit = self.fit_limit
        if limit is None or not isinstance(self.prior, Normal):
            return self.quantile(0.5)
        return max(self.quantile(0.25), self.quantile(0.75), key=lambda end: abs(end - limit))

    @property
    def fit_limit(self) -> float | None:
        """The limit's fit coordinate; None where there is no limit, or it is infinite there."""
        if self.limit is None or (self.scale == "log" and not 0 < self.limit < np.inf):
            return None
        return self.to_fit(self.limit)

    def ends_search(self, fit: float) -> Literal["low", "high"] | None:
        """The bound at which a fit coordinate lies; None inside, and at the limit or a closed bound."""
        low, high = self.bounds
        at_low = fit - low < high - fit
        beyond = self.low if at_low else self.high
        if min(fit - low, high - fit) > _AT_BOUND * (high - low) or beyond in (*self.closed, self.limit):
            return None
        return "low" if at_low else "high"

    def to_fit(self, value: float) -> float:
        """The fit coordinate of a value."""
        return value if self.scale == "linear" else float(np.log(value))

    def from_fit(self, fit: float) -> float:
        """The value at a fit coordinate."""
        return fit if self.scale == "linear" else float(np.exp(fit))

    def log_prior(self, fit: float) -> float:
        """The logarithm of the prior's density, truncated to the bounds and normalised there.

        Parameters
        ----------
        fit
            Fit coordinate: the value in `unit`, or its natural logarithm.

        Returns
        -------
        float
            Natural logarithm of the density per unit of the fit coordinate; −∞ outside the bounds.
        """
        low, high = self.bounds
        if not low <= fit <= high:
            return -np.inf
        if isinstance(self.prior, Uniform):
            return -float(np.log(high - low))
        return self.prior.log_shape(fit) + self.log_height

    @cached_property
    def log_height(self) -> float:
        """The logarithm of a prior's density, truncated to the bounds, at its mean, which may be outside."""
        if isinstance(self.prior, Uniform):
            return self.log_prior(self.start)
        low, high = self.bounds
        return self.prior.log_height - float(np.log(self.prior.below(high) - self.prior.below(low)))

    def quantile(self, probability: float) -> float:
        """The prior's quantile.

        Parameters
        ----------
        probability
            From 0 to 1.

        Returns
        -------
        float
            Fit coordinate below which the prior has that probability; within the bounds.
        """
        low, high = self.bounds
        if isinstance(self.prior, Uniform):
            return low + probability * (high - low)
        bottom, top = self.prior.below(low), self.prior.below(high)
        return float(np.clip(self.prior.at(bottom + probability * (top - bottom)), low, high))


Kind = Literal["frf", "indentation", "compression"]
UNITS = (
    *("-", "mm", "MPa", "1/MPa", "GPa", "N/mm", "N·s/mm", "N", "1/N", "g", "J/m²", "Hz", "s", "1/s", "ms", "µs", "°"),
    *("pC", "pC/N", "pF", "MΩ", "cycles", "h"),
)
AXES = (  # fields of a campaign along which an effect can show
    *("preload_n", "indenter_radius_mm", "position_mm", "sensor", "dwell_s", "load_cycles", "dynamic_force_n"),
    *("frequency_hz", "phase", "displacement_mm", "force_n", "time_s", "sample_height_mm", "sample_diameter_mm"),
)
TEXTS = ("plain", "law", "assumptions", "source", "needs")
NEEDED_FIELDS = ("dwell_s", "dynamic_force_n", "load_cycles", "sensor")  # of a recording, that a mechanism may require
READS = (*NEEDED_FIELDS, "stiffness", "id")


Origin = Literal["skin", "rig", "chain"]


class Stage(Enum):
    """Where in a model a mechanism acts, in the order of composition; the value names the stage in a sentence."""

    DECLARED = "declared values"
    MATERIAL = "material"
    POSITION = "position"
    CONTACT = "contact radius and pressure"
    LOAD_INCREMENT = "increment with the load"
    SENSOR = "d33 of each sensor"
    NEIGHBOURS = "charge of the neighbours"
    RECORDING = "factor on each recording"
    LINES = "dynamics, line by line"
    ADDED_CHARGE = "charge from elsewhere, as a covariance"
    CURVE = "curves"


class Unsupported(UnderskinError):
    """A campaign cannot support a mechanism. Attributes: `mechanism`, `reason` (what is lacking, in words)."""

    def __init__(self, mechanism: str, reason: str) -> None:
        self.mechanism = mechanism
        self.reason = reason
        super().__init__(f"{mechanism}: {reason}")


Values = Mapping[str, Differentiated]  # of one mechanism's parameters, by name, in their units


class Mechanism:
    """A law that the base model leaves out.

    Texts: `plain` (what happens and how it shows, one sentence without a formula), `law` (the equation),
    `assumptions`, `source` (a publication), `needs` (what the campaign must hold).
    Traits: `stage` and `order` (rank among the mechanisms of that stage, smallest first) give the order of
    composition; `kinds` of recordings that it acts on; `axes` of the campaign on which the effect shows;
    `parameters_stated`, the parameters where they are the same for all campaigns and kinds; `reads`, of READS:
    fields of a recording without which it cannot be predicted, the contacts' `stiffness`, and `id` where its lines
    differ between recordings of one and the same contact; `of`, what it belongs to: the skin, the rig that presses it,
    or the measuring chain.
    """

    name: str
    plain: str
    law: str
    assumptions: str
    source: str
    needs: str = "nothing beyond the recordings themselves"
    stage: ClassVar[Stage]
    order: ClassVar[int] = 100
    of: ClassVar[Origin] = "skin"
    kinds: ClassVar[tuple[Kind, ...]] = ("frf",)
    axes: ClassVar[tuple[str, ...]]
    reads: ClassVar[tuple[str, ...]] = ()
    parameters_stated: tuple[Parameter, ...] = ()

    def __init_subclass__(cls) -> None:
        """Join texts that are written over several lines."""
        for name in TEXTS:
            if isinstance(text := vars(cls).get(name), str):
                setattr(cls, name, " ".join(text.split()))

    @property
    def rank(self) -> tuple[int, int, str]:
        """Its place in the order of composition."""
        return list(Stage).index(self.stage), self.order, self.name

    @property
    def acts_on_frfs(self) -> bool:
        """Whether FRFs are among the recordings that it acts on."""
        return "frf" in self.kinds

    @property
    def needs_lines(self) -> bool:
        """Whether it acts on single lines, so that the lines of a recording cannot be replaced by their mean."""
        return self.stage in (Stage.LINES, Stage.ADDED_CHARGE)

    @property
    def moves_predictions(self) -> bool:
        """Whether it changes the mean of the recordings; else it changes their covariance alone."""
        return self.stage is not Stage.ADDED_CHARGE and type(self).act is not Mechanism.act

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The parameters for recordings of one kind; bounds may depend on the campaign, and what can be identified
        on the other mechanisms of the model."""
        return self.parameters_stated

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """What the campaign lacks to support it, in words; None where nothing is lacking."""
        return None

    def guesses(self, conditions: Conditions, kind: Kind) -> Sequence[Sequence[float]]:
        """Starting values of the parameters for fits, in their order and units, estimated from measured recordings."""
        return ()

    def act(self, state: Any, values: Values) -> None:
        """Change the state of the model at this mechanism's stage.

        `state`: of FRFs the `Contacts` at the stages DECLARED, MATERIAL and CONTACT, and an `FrfState` at the others;
        of indentations and compressions the `Curve`. At the stage ADDED_CHARGE it is called once for a model, without
        values.
        """
