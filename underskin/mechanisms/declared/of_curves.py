"""A declared law of indentation curves: by its expression over depth, force or time of each sample."""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np

from underskin.mechanisms.base import Kind, Stage, Values
from underskin.mechanisms.declared.expressions import Value
from underskin.mechanisms.declared.mechanism import DeclaredMechanism
from underskin.mechanisms.models.curve_state import Curve, Samples, numbers
from underskin.recordings.conditions import Conditions, IndentationConditions, curves_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_LARGEST = 1e6  # a factor, newtons or millimetres: the bound on what an expression gives far from usual parameters


class DeclaredOfCurves(DeclaredMechanism):
    """One of indentations: a factor on the force of the contact, as the modulus has it where nothing sticks and no
    stage gives (`modulus`), or on the cell's gain (`gain`), newtons added to what is read (`force`), millimetres added
    to the travel (`position`)."""

    kinds = ("indentation",)
    stage = Stage.CURVE
    needs_axes = "of every sample"
    begins: Mapping[str, float] | None = None  # when each recording begins [s], by its id

    def bind(self, conditions: Conditions, table: SigmaTable) -> "DeclaredOfCurves":
        """The same, bound to the recordings of a campaign."""
        other = copy(self)
        curves = curves_of(conditions)
        other.begins = {entry.id: float(entry.time_s[0]) for entry in curves if entry.time_s is not None}
        return other

    def unsupported(self, conditions: Conditions, kind: Kind) -> str | None:
        """Times that recordings lack."""
        curves = [entry for entry in conditions.recordings if isinstance(entry, IndentationConditions)]
        untimed = "time_s" in self.axes_read and any(entry.time_s is None for entry in curves)
        return "not every recording has time_s" if untimed else None

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Change its samples."""
        curve.laws.append(_Bound(self, {name: numbers(value) for name, value in values.items()}))

    def change(self, samples: Samples, force: Floats, values: Mapping[str, Floats]) -> Floats:
        """The expression at samples (points, curves, samples) where the contact bears `force` [N]."""
        axes: dict[str, Value] = {
            "displacement_mm": 1e3 * np.maximum(samples.travel, 0.0),
            "force_n": np.maximum(force, 0.0),
            "time_s": self._since_the_beginning(samples),
        }
        with np.errstate(all="ignore"):
            found = np.asarray(self.laws[0]({**values, **axes})) + np.zeros(np.broadcast(samples.travel, force).shape)
        return np.clip(np.nan_to_num(found, nan=_LARGEST, posinf=_LARGEST, neginf=-_LARGEST), -_LARGEST, _LARGEST)

    def _since_the_beginning(self, samples: Samples) -> Floats:
        known = self.begins or {}
        first = [known.get(name, float(own[0])) for name, own in zip(samples.ids, samples.time, strict=True)]
        return np.asarray(samples.time - np.array(first)[:, None])


@dataclass(frozen=True)
class _Bound:
    """A law at values of its parameters (points, 1, 1)."""

    law: DeclaredOfCurves
    values: Mapping[str, Floats]

    def moved(self, samples: Samples, travel: Floats) -> Floats:
        """The travel [m] at which a sphere presses."""
        if self.law.acts_on != "position":
            return travel
        return travel + 1e-3 * self.law.change(samples, np.zeros_like(travel), self.values)

    def read(self, samples: Samples, force: Floats) -> Floats:
        """The force [N] that is read where the contact bears `force`."""
        if self.law.acts_on == "position":
            return force
        change = self.law.change(samples, force, self.values)
        return force + change if self.law.acts_on == "force" else force * change
