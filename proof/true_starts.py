"""Starting points of fits that know what the virtual rig hides: its parameters in the catalogue's terms.

The rig's laws are not the catalogue's, so these are starts and not answers.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from rig.effects import Values
from underskin.diagnosis.inference.explanation import Explanation
from underskin.mechanisms.base import Parameter

_NO_SATURATION = 1e3  # MPa: clipped to the parameter's bound
_LAST_SATURATION = 0.9  # of ageing: a loss that ends


def _misalignment(values: Values) -> dict[str, float]:
    x, y = float(values["x_mm"]), float(values["y_mm"])
    return {"offset_x": x, "offset_y": y, "offset": float(np.hypot(x, y))}


def _preload_dependence(values: Values) -> dict[str, float]:
    saturation = float(values.get("saturation_mpa", _NO_SATURATION))
    return {"stress_coefficient": float(values["beta_per_mpa"]), "saturation_stress": saturation}


def _ageing(values: Values) -> dict[str, float]:
    ends = 0.0 if values["law"] == "log" else _LAST_SATURATION
    return {"loss": float(values["rate"]), "onset": float(values["cycles"]), "saturation": ends}


def _relaxation(values: Values) -> dict[str, float]:
    exponent, step = float(values.get("exponent", 0.0)), float(values.get("step", 0.0))
    return {"exponent": exponent, "step": step, "step_frequency": float(values.get("corner_hz", 20.0))}


_RENAMED: Mapping[str, Mapping[str, str]] = {  # effect: the rig's parameter, and the catalogue's
    "moving_contact_edge": {"mobile_fraction": "mobile_fraction"},
    "adhesion": {"work_j_per_m2": "work_of_adhesion"},
    "strain_stiffening": {"coefficient": "stiffening"},
    "compressible_layer": {"poisson_ratio": "poisson_ratio"},
    "interface_slip": {"glue_stiffness": "glue_stiffness"},
    "sensor_spread": {"sd": "spread"},
    "contact_resonance": {"tip_mass_g": "tip_mass", "damping": "damping_ratio"},
    "amplifier_high_pass": {"corner_hz": "corner"},
    "contact_creep": {"fraction": "relaxed_fraction", "time_s": "relaxation_time"},
    "mains_pickup": {"charge_pc": "pickup_charge"},
    "amplitude_nonlinearity": {"mobility": "mobile_fraction"},
    "crosstalk": {"fraction": "fraction"},
    "timing_delay": {"delay_us": "delay"},
    "modulus_error": {"factor": "modulus_factor"},
    "thickness_error": {"factor": "thickness_factor"},
}
_TRANSLATED: Mapping[str, Callable[[Values], dict[str, float]]] = {
    "misalignment": _misalignment,
    "preload_dependent_d33": _preload_dependence,
    "ageing": _ageing,
    "sensor_relaxation": _relaxation,
}


def true_values(effect: str, values: Values) -> dict[str, float]:
    """The catalogue's parameters of an effect of the rig, by name."""
    if effect in _TRANSLATED:
        return _TRANSLATED[effect](values)
    return {parameter: float(values[theirs]) for theirs, parameter in _RENAMED.get(effect, {}).items()}


def with_true_values(initial: Explanation, effects: Mapping[str, Values]) -> Explanation:
    """An explanation moved to the true values; parameters without a counterpart stay where they are."""
    true_parameters = {
        name: value for effect, values in effects.items() for name, value in true_values(effect, values).items()
    }
    moved = initial.point.fit.copy()
    for index, parameter in enumerate(initial.model.parameters[: initial.best.hypothesis.mechanism_parameter_count]):
        if parameter.name in true_parameters:
            moved[index] = _coordinate(parameter, true_parameters[parameter.name])
    return replace(initial, best=replace(initial.best, point=replace(initial.point, fit=moved)))


def _coordinate(parameter: Parameter, value: float) -> float:
    """The fit coordinate, within the bounds."""
    low, high = parameter.bounds
    least = parameter.low if parameter.scale == "log" else -np.inf
    return float(np.clip(parameter.to_fit(max(value, least)), low, high))
