"""Values of parameters at points of several models, whose parameters have different places in their fit coordinates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from underskin.autodiff import Differentiated
from underskin.mechanisms.base import Mechanism, Values
from underskin.mechanisms.parameter import Parameter
from underskin.units import Floats, Indices, Mask


class Seeds:
    """Points of fit coordinates as values in their units, with derivatives by each point's own coordinates.

    Attributes: `owner`, which model each point is of; `variables`, by how many the derivatives are; `position`, two
    further variables of value 0, or none.
    """

    def __init__(self, fit: Floats, log: Mask, owner: Indices, *, slopes: bool, further: int) -> None:
        """`log` says which coordinates (points, parameters) are logarithms; without `slopes`, derivatives are by the
        `further` variables alone."""
        self.owner = owner
        self._value = np.where(log, np.exp(np.where(log, fit, 0.0)), fit)
        self._slope = np.where(log, self._value, 1.0)
        self._slopes = slopes
        count = fit.shape[1] if slopes else 0
        self.variables = count + further
        self.position = []
        for place in range(count, self.variables):
            by_place = np.zeros((self.variables, 1, 1))
            by_place[place] = 1.0
            self.position.append(Differentiated(np.zeros((1, 1)), by_place))

    def of(self, points: Indices, places: Indices) -> Differentiated:
        """The parameters that are at these places of each model, at some of the points: (points, 1)."""
        place = places[self.owner[points]]
        slopes = np.zeros((self.variables, len(points), 1))
        if self._slopes:
            slopes[place, np.arange(len(points)), 0] = self._slope[points, place]
        return Differentiated(self._value[points, place][:, None], slopes)


class Acting:
    """A mechanism with certain parameters, in those of several models that have it. Attribute: `has` (models,)."""

    def __init__(self, mechanism: Mechanism, parameters: Mapping[str, Parameter], models: int) -> None:
        """In none of so many models yet."""
        self.mechanism = mechanism
        self.has = np.zeros(models, dtype=bool)
        self._places = {name: np.zeros(models, dtype=np.intp) for name in parameters}
        self._relative = [(name, entry.relative_to) for name, entry in parameters.items() if entry.relative_to]
        self._hooks = _overridden(type(mechanism))

    def add(self, model: int, places: Mapping[str, int]) -> None:
        """Note that a model has it, its parameters at these places."""
        self.has[model] = True
        for name, place in places.items():
            self._places[name][model] = place

    def on(self, *hooks: str) -> bool:
        """Whether it has one of these hooks."""
        return not self._hooks.isdisjoint(hooks)

    def values(self, points: Indices, seeds: Seeds) -> Values:
        """Its parameters in their units at points whose models have it."""
        values = {name: seeds.of(points, places) for name, places in self._places.items()}
        for name, other in self._relative:
            values[name] = values[name] * values[other]
        return values


_HOOKS: dict[type[Mechanism], frozenset[str]] = {}  # what each class has of its own


def _overridden(own: type[Mechanism]) -> frozenset[str]:
    if own not in _HOOKS:
        _HOOKS[own] = frozenset(name for name in dir(Mechanism) if getattr(own, name) is not getattr(Mechanism, name))
    return _HOOKS[own]
