"""What a mechanism is: a law that the base model leaves out, its parameters, and where in the model it acts.

A mechanism is one file: its docstring states what happens in one plain sentence, then the law, the assumptions and the
source; its class says what it asks of a campaign and overrides the hooks of the stages at which it acts. Values inside
are SI, parameters are in their units.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from inspect import getmodule
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from scipy.special import ndtr, ndtri

from underskin.errors import InvalidInput, UnderskinError
from underskin.mechanisms.autodiff import Array, Differentiated
from underskin.recordings.conditions import Conditions
from underskin.units import Floats

if TYPE_CHECKING:
    from underskin.mechanisms.models.contact_state import Contacts
    from underskin.mechanisms.models.curve_state import Curve
    from underskin.mechanisms.models.frf_design import FrfDesign
    from underskin.mechanisms.models.pickup import Pickup

Kind = Literal["frf", "indentation", "compression"]
UNITS = ("-", "mm", "MPa", "1/MPa", "GPa", "N/mm", "N", "g", "J/m²", "Hz", "s", "µs", "pC", "pC/N", "cycles")


class Unsupported(UnderskinError):
    """A campaign that cannot support a mechanism. Attributes: `mechanism`, `reason` (what is lacking, in words)."""

    def __init__(self, mechanism: str, reason: str) -> None:
        self.mechanism = mechanism
        self.reason = reason
        super().__init__(f"{mechanism}: {reason}")


@dataclass(frozen=True)
class Normal:
    """A normal distribution on the fit coordinate."""

    mean: float
    sd: float


@dataclass(frozen=True)
class Uniform:
    """Equal density on the fit coordinate between the bounds."""


Prior = Normal | Uniform


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may change. Its fit coordinate is the value (`linear`) or its natural logarithm (`log`).

    `low`, `high` and `limit` are values in `unit`; the prior lives on the fit coordinate, truncated to the bounds and
    normalised there. `limit` is the value at which the base model is recovered (it may lie outside the bounds: 0 or ∞
    of a logarithm), None where no finite or infinite value does that.
    """

    name: str
    unit: str
    low: float
    high: float
    prior: Prior
    scale: Literal["linear", "log"]
    limit: float | None
    reason: str

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest fit coordinate."""
        return self.to_fit(self.low), self.to_fit(self.high)

    @property
    def start(self) -> float:
        """The prior's centre on the fit coordinate."""
        low, high = self.bounds
        return float(np.clip(self.prior.mean, low, high)) if isinstance(self.prior, Normal) else (low + high) / 2

    def to_fit(self, value: float) -> float:
        """The fit coordinate of a value."""
        return value if self.scale == "linear" else float(np.log(value))

    def from_fit(self, fit: float) -> float:
        """The value at a fit coordinate."""
        return fit if self.scale == "linear" else float(np.exp(fit))

    def log_prior(self, fit: float) -> float:
        """The logarithm of the prior's density at a fit coordinate; −∞ outside the bounds."""
        low, high = self.bounds
        if not low <= fit <= high:
            return -np.inf
        if isinstance(self.prior, Uniform):
            return -float(np.log(high - low))
        return float(-0.5 * ((fit - self.prior.mean) / self.prior.sd) ** 2 - self._log_area)

    @cached_property
    def _log_area(self) -> float:
        """The logarithm of what a normal prior's bell holds between the bounds."""
        assert isinstance(self.prior, Normal)
        mean, sd = self.prior.mean, self.prior.sd
        inside = ndtr((self.bounds[1] - mean) / sd) - ndtr((self.bounds[0] - mean) / sd)
        return float(np.log(sd * np.sqrt(2 * np.pi) * inside))

    def quantile(self, probability: float) -> float:
        """The prior's quantile on the fit coordinate."""
        low, high = self.bounds
        if isinstance(self.prior, Uniform):
            return low + probability * (high - low)
        mean, sd = self.prior.mean, self.prior.sd
        bottom, top = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
        return float(np.clip(mean + sd * ndtri(bottom + probability * (top - bottom)), low, high))


Values = Mapping[str, Differentiated]  # of one mechanism's parameters, by name, in their units


class Mechanism:
    """A law that the base model leaves out. Subclasses override what they need; every hook's default does nothing.

    `axes` are names of the campaign's axes on which the effect shows, `needs` says what the campaign must hold.
    """

    name: ClassVar[str]
    kinds: ClassVar[tuple[Kind, ...]] = ("frf",)
    axes: ClassVar[tuple[str, ...]]
    needs: ClassVar[str] = "nothing beyond the recordings themselves"
    # What a model must prepare for it: further fields that tell contacts apart, the contacts' stiffness, neighbours,
    # room for an offset [m] and for a layer that much thicker or thinner.
    contact_axes: ClassVar[tuple[str, ...]] = ()
    needs_stiffness: ClassVar[bool] = False
    needs_neighbours: ClassVar[bool] = False
    largest_offset: ClassVar[float] = 0.0
    largest_stretch: ClassVar[float] = 1.0

    @property
    def plain(self) -> str:
        """What happens and how it shows, in one sentence without a formula."""
        return " ".join(self._documentation.split("\n\n")[0].split())

    @property
    def law(self) -> str:
        """The equation, in words and symbols."""
        return self._section("Law")

    @property
    def assumptions(self) -> str:
        """What is taken for granted."""
        return self._section("Assumptions")

    @property
    def source(self) -> str:
        """Where the law comes from."""
        return self._section("Source")

    @property
    def _documentation(self) -> str:
        return getattr(getmodule(type(self)), "__doc__", None) or ""

    def _section(self, title: str) -> str:
        found = re.search(rf"^{title}: (.*?)(?=\n\n|\Z)", self._documentation, re.MULTILINE | re.DOTALL)
        if found is None:
            raise InvalidInput("docstring", type(self).__module__, f"must have a paragraph '{title}: …'")
        return " ".join(found.group(1).split())

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """Its parameters for recordings of one kind; bounds may depend on the campaign."""
        return ()

    def parameters_beside(self, others: Collection[str], conditions: Conditions, kind: Kind) -> tuple[Parameter, ...]:
        """Its parameters in a model that these other mechanisms are in too, which may show more of it."""
        return self.parameters(conditions, kind)

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """What the campaign lacks to support it, in words; None where nothing is lacking."""
        return None

    # Stages of the FRF model, in the order in which they act.

    def on_declared(self, contacts: Contacts, values: Values) -> None:
        """Change the declared modulus and thickness."""

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Change what each contact is made of: modulus, Poisson ratio, glue, adhesion, half space or layer."""

    def offset(self, values: Values) -> tuple[Differentiated, Differentiated] | None:
        """What is added to the contact's position, x and y [m]."""
        return None

    def force_nodes(self, force: Floats, dynamic_force: Floats) -> tuple[Array, Array] | None:
        """Forces [N] (nodes, contacts) and weights (nodes, contacts): Σ weight · σ(force) is the oscillation's σ."""
        return None

    def mobility(self, values: Values) -> Differentiated:
        """The share of that σ in what is measured."""
        raise NotImplementedError

    def on_d33(self, mean_stress: Differentiated, values: Values) -> Differentiated | None:
        """The factor on d33 at each point, from the static mean stress there [Pa] (compression positive)."""
        return None

    def on_recordings(self, design: FrfDesign, values: Values) -> Differentiated | None:
        """The factor on each recording."""
        return None

    def neighbour_fraction(self, values: Values) -> Differentiated | None:
        """The share of its neighbours' charge that a sensor shows."""
        return None

    def on_lines(self, design: FrfDesign, contacts: Contacts, values: Values) -> Differentiated | None:
        """The complex factor on each distinct line (contact and frequency)."""
        return None

    def pickup(self, conditions: Conditions, design: FrfDesign) -> Pickup | None:
        """Charge from elsewhere that is random on each row, and on which rows."""
        return None

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Change what governs an indentation or compression."""

    def spread(self, values: Values) -> Differentiated | None:
        """The standard deviation of the logarithms of the sensors' gains."""
        return None
