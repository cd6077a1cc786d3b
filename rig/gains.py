"""What multiplies d33 from one recording to the next: sensor, age, time of day, history, place; and stress."""

from typing import TYPE_CHECKING

import numpy as np

from rig import effects
from rig.effects import Values
from rig.errors import RigError
from rig.layer import Floats

if TYPE_CHECKING:
    from rig.bench import Bench


def sensitivity(bench: "Bench") -> Floats:
    """The product of all that is switched on, (rows,).

    Raises RigError where an effect needs what the experiment does not have: load cycles, a time, the plate's size.
    """
    result = bench.sensor_gains[bench.plan.sensor].copy()
    for name, law in (
        ("ageing", _ageing),
        ("cracked_electrode", _cracked),
        ("temperature_drift", _temperature),
        ("hysteretic_d33", _hysteresis),
        ("bending_substrate", _bending),
    ):
        if name in bench.on:
            result *= law(bench)
    return result


def under_stress(values: Values, stress: Floats) -> Floats:
    """d33 under a static mean stress [MPa], over that at rest: preload_dependent_d33."""
    beta = float(values["beta_per_mpa"])
    if values["law"] == "linear":
        return 1 + beta * stress
    return 1 + beta * stress / (1 + np.abs(stress) / float(values["saturation_mpa"]))


def _cycles(bench: "Bench", effect: str) -> Floats:
    if bench.plan.cycles is None:
        raise RigError("design.cycles_per_recording", None, f"required by the effect {effect}")
    return bench.plan.cycles.astype(float)


def _ageing(bench: "Bench") -> Floats:
    rate, unit = (effects.of(bench.on, "ageing", name) for name in ("rate", "cycles"))
    cycles = _cycles(bench, "ageing")
    age = cycles / unit
    lost = np.log10(1 + age) if bench.on["ageing"]["law"] == "log" else -np.expm1(-age)
    if rate * lost.max() >= 1:
        allowed = f"must be below {1 / lost.max():.3g}: by {cycles.max():.0f} load cycles nothing would be left"
        raise RigError("effects.ageing.rate", rate, allowed)
    return 1 - rate * lost


def _cracked(bench: "Bench") -> Floats:
    amplitude, since = (effects.of(bench.on, "cracked_electrode", name) for name in ("amplitude", "at_cycle"))
    return np.where(_cycles(bench, "cracked_electrode") >= since, 1 - amplitude, 1.0)


def _temperature(bench: "Bench") -> Floats:
    if bench.plan.hours is None:
        raise RigError("design.start", None, "required by the effect temperature_drift")
    amplitude, period = (effects.of(bench.on, "temperature_drift", name) for name in ("amplitude", "period_h"))
    return 1 + amplitude * np.sin(2 * np.pi * bench.plan.hours / period)


def _hysteresis(bench: "Bench") -> Floats:
    falling = np.diff(bench.plan.preload_n, prepend=0.0) < 0
    return np.where(falling, 1 - effects.of(bench.on, "hysteretic_d33", "amplitude"), 1.0)


def _bending(bench: "Bench") -> Floats:
    skin = bench.experiment.skin
    if skin.width_mm is None or skin.length_mm is None:
        raise RigError("skin.width_mm", None, "required, with length_mm, by the effect bending_substrate")
    centres = np.array([sensor[1:] for sensor in skin.sensors])
    middle = (centres.max(axis=0) + centres.min(axis=0)) / 2
    x, y = np.clip((bench.place - middle) / [skin.length_mm / 2, skin.width_mm / 2], -1, 1).T
    return 1 + effects.of(bench.on, "bending_substrate", "amplitude") * (1 - x**2) * (1 - y**2)
