"""Relaxation of the elastomer: E(t) = E (1 − Σ g (1 − e^(−t/τ))), of one or two Prony pairs (g, τ)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig.effects import Values
from rig.layer import Floats

_PAIRS = (("fraction", "time_s"), ("fraction_2", "time_2_s"))


@dataclass(frozen=True)
class Relaxation:
    """`fraction` of the modulus at rest and `time_s` of each pair; without pairs the body is elastic."""

    fraction: tuple[float, ...] = ()
    time_s: tuple[float, ...] = ()

    def remaining(self, elapsed_s: Floats) -> Floats:
        """E(t)/E, of the shape of the elapsed times."""
        result = np.ones_like(elapsed_s)
        for fraction, tau in zip(self.fraction, self.time_s, strict=True):
            result += fraction * np.expm1(-elapsed_s / tau)
        return result


def of_effects(on: Mapping[str, Values]) -> Relaxation:
    """The relaxation that the effect contact_creep states."""
    values = on.get("contact_creep", {})
    pairs = [(float(values[g]), float(values[tau])) for g, tau in _PAIRS if g in values]
    return Relaxation(tuple(g for g, _ in pairs), tuple(tau for _, tau in pairs))
