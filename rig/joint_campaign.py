"""Several campaigns of one truth: FRF lines and curves of one elastomer, dates of one skin, skins of one batch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.effects import Values
from rig.elastomer import RecordedCurve
from rig.errors import RigError
from rig.experiment import Experiment
from rig.recorded import RecordedLines, campaign

D33_DEPARTURE = "d33_departure"  # a skin's d33 is not of the population's; E and h depart by the effects of their names

_TRIES = 200


@dataclass(frozen=True)
class CurveSet:
    """Curves of kind indentation or compression; their experiment states the true E and h of the elastomer."""

    experiment: Experiment
    recorded: tuple[RecordedCurve, ...]


@dataclass(frozen=True)
class JointDocument:
    """One campaign: FRF lines of a skin, whose experiment declares E and h, and for some kinds curves of its
    elastomer."""

    lines: RecordedLines
    curves: CurveSet | None = None

    @property
    def experiment(self) -> Experiment:
        """The experiment of the lines."""
        return self.lines.response.experiment

    @property
    def skin(self) -> str:
        """The id of the skin."""
        assert self.experiment.skin.id is not None
        return self.experiment.skin.id

    @property
    def true_modulus_mpa(self) -> float:
        """E at rest [MPa]."""
        return self.experiment.skin.youngs_modulus_mpa * _factor(self.experiment, "modulus_error")

    @property
    def true_thickness_mm(self) -> float:
        """h [mm]."""
        return self.experiment.skin.thickness_mm * _factor(self.experiment, "thickness_error")

    def campaign(self) -> dict[str, Any]:
        """The campaign (`campaign/1`)."""
        document = campaign(self.lines)
        if self.curves is None:
            return document
        design = self.curves.experiment.curves
        checked = {"units_checked": True} if design is not None and design.units_checked else {}
        entries = [*document["recordings"], *(curve.entry for curve in self.curves.recorded)]
        return {**document, **checked, "recordings": entries}


def _factor(experiment: Experiment, effect: str) -> float:
    return float(experiment.effects[effect]["factor"]) if effect in experiment.effects else 1.0


@dataclass(frozen=True)
class Hidden:
    """One thing that the campaigns do not state.

    Attributes
    ----------
    effect : str
        An effect's name, or `D33_DEPARTURE`.
    parameters : dict
    documents : tuple of int
        Numbers of the documents on which it acts.
    gains : tuple of float
        Its factor on d33 of each sensor, where it is one.
    sensors : tuple of str
        The sensors concerned, where not all are.
    since : str, optional
        Date from which it acts, where it did not before.
    departs : bool
        Whether it tells one skin from the others of its make.
    """

    effect: str
    parameters: Values
    documents: tuple[int, ...] = (0,)
    gains: tuple[float, ...] = ()
    sensors: tuple[str, ...] = ()
    since: str | None = None
    departs: bool = False


@dataclass(frozen=True)
class Population:
    """Skins of one batch: E [MPa] and d33 [pC/N] are log-normal, with these medians and standard deviations of the
    logarithm."""

    modulus_mpa: float
    modulus_sd: float
    d33_pc_per_n: float
    d33_sd: float


@dataclass(frozen=True)
class Joint:
    """Campaigns to be judged together, what they hide and, for several skins, their population."""

    name: str
    what: str
    documents: tuple[JointDocument, ...]
    hidden: tuple[Hidden, ...]
    population: Population | None = None


def first_feasible(
    draw: Callable[[np.random.Generator, str, str], Joint], random: np.random.Generator, name: str, skin: str
) -> Joint:
    """The first draw that the rig can carry out; raises RuntimeError if many draws in a row cannot."""
    for _ in range(_TRIES):
        try:
            return draw(random, name, skin)
        except RigError:
            continue
    raise RuntimeError(f"no feasible campaigns {name}")
