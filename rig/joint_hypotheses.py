"""Models of joint campaigns with all hidden effects, or with all but one; their parts and priors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rig.effects import Values
from rig.joint_campaign import D33_DEPARTURE, Hidden, Joint, JointDocument, Population
from rig.joint_curves import CurvePart
from rig.joint_fit import Part, Prior, covariance
from rig.joint_lines import LinesPart
from rig.layer import Floats

_DECLARED_E, _DECLARED_H, _SENSOR = 0.02, 0.01, 0.01
_BY_PRIORS = (
    "modulus_error",
    "thickness_error",
    D33_DEPARTURE,
)  # effects that a model lacks are described by priors only

Hypothesis = tuple[list[Part], dict[str, Prior]]


@dataclass(frozen=True)
class Tied:
    """Skins of one batch: ln of a parameter over that of the population's unknown median, over its standard
    deviation."""

    names: tuple[str, ...]
    median: str
    true: Floats  # logarithms (skins,)
    sd: float

    @property
    def parameters(self) -> tuple[str, ...]:
        """The skins' parameters and the median."""
        return (*self.names, self.median)

    @property
    def count(self) -> int:
        """Of the residuals."""
        return len(self.names)

    def residuals(self, values: Mapping[str, float]) -> Floats:
        """(skins,)"""
        return (self.true + [values[name] - values[self.median] for name in self.names]) / self.sd


def hypothesis(
    joint: Joint, documents: tuple[int, ...], *, without: Hidden | None, curves: bool, declared: bool, free: bool
) -> Hypothesis:
    """Parts and priors of a model of some documents.

    Parameters
    ----------
    joint : Joint
    documents : tuple of int
    without : Hidden, optional
        What the model does not have; all else that is hidden is in it.
    curves : bool
        Whether the documents' curves count.
    declared : bool
        Whether the declared E is known within 2 % where no error of it is hidden, and where that is what is left out.
    free : bool
        Whether the parameters of what is hidden are free; otherwise they are known.
    """
    parts: list[Part] = []
    priors: dict[str, Prior] = {}
    for number in documents:
        document = joint.documents[number]
        lacking = without if without is not None and number in without.documents else None
        parts.append(_lines(document, lacking, free=free))
        if curves and document.curves is not None:
            truth = document.curves.experiment
            model = replace(truth, effects=_remaining(truth.effects, lacking))
            parts += [CurvePart(curve, truth, model, document.skin, free=free) for curve in document.curves.recorded]
            assert truth.curves is not None
            priors[f"{document.skin}/cell"] = Prior(0.0, max(truth.curves.cell_gain, 1e-6))
        priors |= _priors(document, lacking, declared=declared, free=free)
    if joint.population is not None:
        if len(documents) > 1:
            parts += _ties(joint, joint.population, without)
        elif without is not None and without.effect == "modulus_error":
            sd = float(np.hypot(_DECLARED_E, joint.population.modulus_sd))
            name = f"{joint.documents[documents[0]].skin}/modulus"
            priors[name] = replace(priors[name], sd=sd)
    return parts, priors


def skin_covariance(document: JointDocument) -> Floats:
    """Covariance of ln E, ln h and ln d33 by the FRFs of one skin alone, all else known (3, 3)."""
    skin = document.skin
    gains = {f"{skin}/gain {sensor[0]}": Prior(0.0, _SENSOR) for sensor in document.experiment.skin.sensors}
    names = [f"{skin}/{name}" for name in ("modulus", "thickness", "d33")]
    return covariance([_lines(document, None, free=False)], gains, names)


def _remaining(effects: dict[str, Values], without: Hidden | None) -> dict[str, Values]:
    if without is None or without.effect in _BY_PRIORS:
        return effects
    return {name: values for name, values in effects.items() if name != without.effect}


def _lines(document: JointDocument, without: Hidden | None, *, free: bool) -> LinesPart:
    response = document.lines.response
    gains = response.sensor_gains / (without.gains if without is not None and without.gains else 1.0)
    experiment = replace(response.experiment, effects=_remaining(response.experiment.effects, without))
    return LinesPart(document.lines, replace(response, experiment=experiment, sensor_gains=gains), free=free)


def _priors(document: JointDocument, without: Hidden | None, *, declared: bool, free: bool) -> dict[str, Prior]:
    """Of E, h and the sensors' gains of one document's skin."""
    skin, stated, effects = document.skin, document.experiment.skin, document.experiment.effects
    lacking = without.effect if without is not None else None
    result = {}
    if lacking == "modulus_error":
        mean = float(np.log(stated.youngs_modulus_mpa / document.true_modulus_mpa))
        result[f"{skin}/modulus"] = Prior(mean, _DECLARED_E)
    elif declared and "modulus_error" not in effects:
        result[f"{skin}/modulus"] = Prior(0.0, _DECLARED_E)
    if lacking == "thickness_error":
        mean = float(np.log(stated.thickness_mm / document.true_thickness_mm))
        result[f"{skin}/thickness"] = Prior(mean, _DECLARED_H)
    elif "thickness_error" not in effects:
        result[f"{skin}/thickness"] = Prior(0.0, _DECLARED_H)
    spread = float(effects.get("sensor_spread", {}).get("sd", 0.0)) if free else 0.0
    for sensor in stated.sensors:
        result[f"{skin}/gain {sensor[0]}"] = Prior(0.0, float(np.hypot(_SENSOR, spread)))
    return result


def _ties(joint: Joint, population: Population, without: Hidden | None) -> list[Part]:
    """E and d33 of the skins, each tied to its population, except for a skin that is known to depart in it."""

    def tied(name: str, departure: str, sd: float, of: Callable[[JointDocument], float]) -> Tied:
        departing = {hidden.documents[0] for hidden in joint.hidden if hidden.effect == departure and hidden != without}
        members = [document for number, document in enumerate(joint.documents) if number not in departing]
        true = np.log([of(document) for document in members])
        names = tuple(f"{document.skin}/{name}" for document in members)
        return Tied(names, f"median {name}", true - true.mean(), sd)

    return [
        tied("modulus", "modulus_error", population.modulus_sd, lambda document: document.true_modulus_mpa),
        tied("d33", D33_DEPARTURE, population.d33_sd, lambda document: document.experiment.skin.d33_pc_per_n),
    ]
