"""The diagnosis under other priors than its own, within a context: for tests of what depends on them."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from underskin.diagnosis.noise import GAIN_PRIOR, POSITION_PRIOR, Plateau
from underskin.diagnosis.selection.priors import PRIORS
from underskin.mechanisms.base import HeavyTailed, Mechanism, Parameter
from underskin.mechanisms.registry import CATALOGUE

_NOTHING = "nothing_missing"


@dataclass(frozen=True)
class Priors:
    """By which factors the priors of scatter and of strengths are wider, and the prior that nothing is missing."""

    scatter: float = 1.0
    strengths: float = 1.0
    nothing: float = PRIORS[_NOTHING]


@contextmanager
def other_priors(priors: Priors) -> Iterator[None]:
    """Diagnose under these priors; the diagnosis's own are always restored."""
    scatter = {id(plateau): dict(vars(plateau)) for plateau in (GAIN_PRIOR, POSITION_PRIOR)}
    sets = dict(PRIORS)
    try:
        for plateau in (GAIN_PRIOR, POSITION_PRIOR):
            vars(plateau).update(vars(_wider(plateau, priors.scatter)))
        for mechanism in CATALOGUE.values():
            vars(mechanism)["parameters"] = partial(_parameters, mechanism, priors.strengths)
        remaining = (1 - priors.nothing) / (1 - sets[_NOTHING])
        PRIORS.update({name: priors.nothing if name == _NOTHING else remaining * share for name, share in sets.items()})
        yield
    finally:
        for plateau in (GAIN_PRIOR, POSITION_PRIOR):
            vars(plateau).update(scatter[id(plateau)])
        for mechanism in CATALOGUE.values():
            vars(mechanism).pop("parameters", None)
        PRIORS.update(sets)


def _wider(plateau: Plateau, factor: float) -> Plateau:
    """About the middle, the constant part and what falls off beside it."""
    half = factor * (plateau.high - plateau.low) / 2
    falls = factor * plateau.fall_low, factor * plateau.fall_high
    return Plateau(plateau.middle - half, plateau.middle + half, *falls, factor * plateau.area)


def _parameters(mechanism: Mechanism, factor: float, *arguments: Any) -> tuple[Parameter, ...]:
    """A mechanism's parameters, with priors of strengths wider by this factor."""
    parameters = type(mechanism).parameters(mechanism, *arguments)
    return tuple(
        replace(parameter, prior=HeavyTailed(parameter.prior.mean, factor * parameter.prior.sd))
        if isinstance(parameter.prior, HeavyTailed)
        else parameter
        for parameter in parameters
    )
