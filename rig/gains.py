"""Factors on d33 from one recording to the next: sensor, age, time of day, history, position; and static stress."""

from collections.abc import Mapping

import numpy as np

from rig import effects
from rig.effects import Values
from rig.errors import RigError
from rig.experiment import DeclaredSkin
from rig.layer import Floats
from rig.plan import Plan


def sensitivity(
    on: Mapping[str, Values], plan: Plan, sensor_gains: Floats, skin: DeclaredSkin, position: Floats
) -> Floats:
    """The product of all factors that are switched on.

    Parameters
    ----------
    on : effects that are switched on, with their parameters
    plan : the recordings in order
    sensor_gains : (sensors,), true d33 of each sensor over that of the skin
    skin : as declared
    position : (rows, 2), mm, true position of the sphere

    Returns
    -------
    (rows,)

    Raises
    ------
    RigError
        Where an effect needs what the experiment does not have: load cycles, a time, the size of the plate.
    """
    result = sensor_gains[plan.sensor].copy()
    if "ageing" in on:
        result *= _ageing(on["ageing"], plan)
    if "cracked_electrode" in on:
        result *= _cracked(on["cracked_electrode"], plan)
    if "temperature_drift" in on:
        result *= _temperature(on["temperature_drift"], plan)
    if "hysteretic_d33" in on:
        falling = np.diff(plan.preload_n, prepend=0.0) < 0
        result *= np.where(falling, 1 - effects.of(on, "hysteretic_d33", "amplitude"), 1.0)
    if "bending_substrate" in on:
        result *= _bending(on["bending_substrate"], skin, position)
    return result


def under_stress(values: Values, stress: Floats) -> Floats:
    """d33 under static stress over that at rest (effect preload_dependent_d33).

    Parameters
    ----------
    values : mapping
        Law and parameters of the effect.
    stress : ndarray
        Static mean stress [MPa].

    Returns
    -------
    ndarray
        Of the shape of `stress`.
    """
    beta = float(values["beta_per_mpa"])
    if values["law"] == "linear":
        return 1 + beta * stress
    return 1 + beta * stress / (1 + np.abs(stress) / float(values["saturation_mpa"]))


def _cycles(plan: Plan, effect: str) -> Floats:
    if plan.cycles is None:
        raise RigError("design.cycles_per_recording", None, f"required by the effect {effect}")
    return plan.cycles.astype(float)


def _ageing(values: Values, plan: Plan) -> Floats:
    rate, unit = float(values["rate"]), float(values["cycles"])
    cycles = _cycles(plan, "ageing")
    age = cycles / unit
    lost = np.log10(1 + age) if values["law"] == "log" else -np.expm1(-age)
    if rate * lost.max() >= 1:
        allowed = f"must be below {1 / lost.max():.3g}: by {cycles.max():.0f} load cycles nothing would be left"
        raise RigError("effects.ageing.rate", rate, allowed)
    return 1 - rate * lost


def _cracked(values: Values, plan: Plan) -> Floats:
    cracked = _cycles(plan, "cracked_electrode") >= float(values["at_cycle"])
    return np.where(cracked, 1 - float(values["amplitude"]), 1.0)


def _temperature(values: Values, plan: Plan) -> Floats:
    if plan.hours is None:
        raise RigError("design.start", None, "required by the effect temperature_drift")
    return 1 + float(values["amplitude"]) * np.sin(2 * np.pi * plan.hours / float(values["period_h"]))


def _bending(values: Values, skin: DeclaredSkin, position: Floats) -> Floats:
    if skin.width_mm is None or skin.length_mm is None:
        raise RigError("skin.width_mm", None, "required, with length_mm, by the effect bending_substrate")
    centres = np.array([sensor[1:] for sensor in skin.sensors])
    middle = (centres.max(axis=0) + centres.min(axis=0)) / 2
    x, y = np.clip((position - middle) / [skin.length_mm / 2, skin.width_mm / 2], -1, 1).T
    return 1 + float(values["amplitude"]) * (1 - x**2) * (1 - y**2)
