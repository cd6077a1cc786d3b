"""Parameters that recordings of one skin share: logarithms of E, h and the effects' numbers over the truth."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rig.effects import Values
from rig.experiment import Experiment


def scaled(experiment: Experiment, skin: str, values: Mapping[str, float]) -> Experiment:
    """The experiment with E, h and the effects' parameters at the values."""
    declared = experiment.skin
    changed = replace(
        declared,
        youngs_modulus_mpa=declared.youngs_modulus_mpa * np.exp(values.get(f"{skin}/modulus", 0.0)),
        thickness_mm=declared.thickness_mm * np.exp(values.get(f"{skin}/thickness", 0.0)),
    )
    effects: dict[str, Values] = {
        name: {
            parameter: value
            if isinstance(value, str)
            else value * float(np.exp(values.get(f"{skin}/{name}.{parameter}", 0.0)))
            for parameter, value in of_effect.items()
        }
        for name, of_effect in experiment.effects.items()
    }
    return replace(experiment, skin=changed, effects=effects)


def parameters_of_effects(experiment: Experiment, skin: str) -> tuple[str, ...]:
    """Names of the effects' numbers; errors of E and h and the sensor spread have parameters of their own."""
    of_effects = {"modulus_error", "thickness_error", "sensor_spread"}
    return tuple(
        f"{skin}/{name}.{parameter}"
        for name, values in experiment.effects.items()
        for parameter, value in values.items()
        if name not in of_effects and not isinstance(value, str)
    )
