"""The instrument: the written displacement and force of a curve from the exact ones.

Frame, spindle, guide and cell distort first (effects); then each curve gets the cell's gain, its zeros and its drift,
and finally noise and the converters' quantisation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig import effects
from rig.effects import Values
from rig.experiment import Experiment
from rig.layer import Floats


@dataclass(frozen=True)
class Reading:
    """What the instrument shows before noise, (samples,), and the zero of its travel [mm] in this curve."""

    displacement_mm: Floats
    force_n: Floats
    zero_mm: float


def shown(experiment: Experiment, number: int, time: Floats, displacement: Floats, force: Floats) -> Reading:
    """The reading of exact displacement [mm] and force [N] at times [s], of one curve by its number."""
    curves = experiment.curves
    assert curves is not None
    common = np.random.default_rng([experiment.seed, 7]).normal()
    gain, force_zero, drift, drag = np.random.default_rng([experiment.seed, 8, number]).normal(size=4)
    moved, measured_force = _distorted(experiment.effects, time, displacement, force)
    measured_force = (
        np.exp(curves.cell_gain * common + curves.gain * gain) * measured_force + curves.force_zero_n * force_zero
    )
    measured_force = (
        measured_force + curves.drift_n_per_s * drift * time + curves.drift_n_per_mm * drag * (moved - moved[0])
    )
    zero = curves.contact_point_mm * float(np.random.default_rng([experiment.seed, 5, number]).normal())
    return Reading(moved + zero, measured_force, zero)


def noisy(experiment: Experiment, number: int, reading: Reading) -> tuple[Floats, Floats]:
    """Displacement [mm] and force [N] as written, with noise and quantisation."""
    curves = experiment.curves
    assert curves is not None
    random, size = np.random.default_rng([experiment.seed, 5, number]), len(reading.force_n)
    random.normal()  # the zero of the travel
    displacement = reading.displacement_mm + curves.displacement_noise_mm * random.normal(size=size)
    force = reading.force_n + curves.force_noise_n * random.normal(size=size)
    return _stepped(displacement, curves.displacement_step_mm), _stepped(force, curves.force_step_n)


def _stepped(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step if step else values


def _distorted(on: Mapping[str, Values], time: Floats, displacement: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Displacement and force after frame, spindle, guide and cell."""

    def value(name: str, parameter: str) -> float:
        return effects.of(on, name, parameter)

    moved, measured_force = displacement, force
    if "instrument_compliance" in on:
        moved = moved + force / value("instrument_compliance", "stiffness_n_per_mm")
    if "rough_surface" in on:
        height, small = (value("rough_surface", name) for name in ("height_mm", "force_n"))
        moved = moved + height * np.log1p(np.maximum(force, 0) / small)
    if "thermal_drift" in on:
        moved = moved - value("thermal_drift", "drift_mm") * np.expm1(-time / value("thermal_drift", "time_s"))
    if "force_ripple" in on:
        pitch = value("force_ripple", "pitch_mm")
        measured_force = measured_force * (
            1 + value("force_ripple", "amplitude") * np.sin(2 * np.pi * displacement / pitch)
        )
    if "guide_friction" in on:
        sense = _presliding(displacement, value("guide_friction", "slip_mm"))
        measured_force = measured_force * (1 + value("guide_friction", "friction") * sense)
    if "nonlinear_cell" in on:
        measured_force = measured_force * (
            1 + value("nonlinear_cell", "nonlinearity") * measured_force / value("nonlinear_cell", "range_n")
        )
    if "liquid_drag" in on:
        speed = np.gradient(displacement, time)
        measured_force = measured_force + value("liquid_drag", "coefficient_n_s_per_mm") * speed
    return moved, measured_force + value("force_drift", "n_per_root_s") * np.sqrt(time)


def _presliding(displacement: Floats, slip: float) -> Floats:
    """Friction over its limit, −1 to 1, which reverses within the slip after each reversal of motion (Dahl 1968)."""
    steps, state = np.diff(displacement), 1.0
    result = [state]
    for step, remaining in zip(np.sign(steps), np.exp(-np.abs(steps) / slip), strict=True):
        state = step + (state - step) * remaining
        result.append(state)
    return np.array(result)
