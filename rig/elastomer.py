"""Force–displacement curves of the elastomer: a sphere pressed in and drawn back, a cylinder between platens."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig import effects, instrument
from rig.contact_course import Body, contact_history
from rig.cylinder import cylinder_force
from rig.effects import COMPRESSION, INDENTATION, Values
from rig.errors import RigError
from rig.experiment import CurveDesign, Experiment
from rig.layer import Floats
from rig.relaxation import of_effects
from rig.sphere import sphere_law

_AIR = 0.08  # of the largest indentation, on either side of the contact
_STEPS = 600  # of a course at least; fewer samples are taken from a finer course
_LEAST_LOADING = 8  # samples; with fewer no law can be identified


@dataclass(frozen=True)
class RecordedCurve:
    """One recording.

    Attributes
    ----------
    entry : dict
        Its entry in the campaign.
    exact_displacement_mm, exact_force_n : ndarray, (samples,)
        What the instrument shows before noise and the converters' steps.
    time_s : ndarray, (samples,)
    zero_mm : float
        The displacement shown at the touch of the surfaces.
    """

    entry: dict[str, Any]
    exact_displacement_mm: Floats
    exact_force_n: Floats
    time_s: Floats
    zero_mm: float


def record_curves(experiment: Experiment) -> list[RecordedCurve]:
    """Carry out an experiment of kind indentation or compression."""
    curves = experiment.curves
    assert curves is not None
    if experiment.kind == INDENTATION:
        shapes = [{"indenter_radius_mm": radius} for radius in curves.indenters_mm]
    else:
        shapes = [
            {"sample_height_mm": height, "sample_diameter_mm": diameter}
            for height in curves.heights_mm
            for diameter in curves.diameters_mm
        ]
    pairs = [
        (shape, speed) for _ in range(curves.repeats) for shape in shapes for speed in curves.speeds_mm_per_s
    ]  # fmt: skip
    return [_curve(experiment, curves, number, shape, speed) for number, (shape, speed) in enumerate(pairs)]


def true_modulus(experiment: Experiment) -> float:
    """E before relaxation [MPa]: the declared one with its scatter, and the effect modulus_error."""
    scatter = experiment.curves.modulus_scatter if experiment.curves else 0.0
    error = np.exp(scatter * np.random.default_rng([experiment.seed, 6]).normal())
    factor = effects.of(experiment.effects, "modulus_error", "factor") or 1.0
    return float(experiment.skin.youngs_modulus_mpa * error * factor)


def pressed_body(
    experiment: Experiment, on: Mapping[str, Values], radius_mm: float, beyond_mm: float = 0.0
) -> Body:  # fmt: skip
    """The elastomer under a sphere, with the effects `on`, to the largest depth of the experiment or beyond.

    Raises RigError beyond what the rig has solved.
    """
    assert experiment.curves is not None
    largest = experiment.curves.largest_displacement_mm
    law = sphere_law(on, radius_mm, experiment.skin.thickness_mm, largest, beyond_mm)
    work = effects.of(on, "adhesion", "work_j_per_m2") * 1e-3  # J/m² = 1e-3 N/mm
    separation = on.get("adhesion", {}).get("work_of_separation_j_per_m2")
    leaving = work if separation is None else float(separation) * 1e-3
    return Body(law, true_modulus(experiment), of_effects(on), work, leaving)


def frame_compliance(on: Mapping[str, Values]) -> float:
    """Uncorrected compliance [mm/N] behind the sphere: the effect instrument_compliance."""
    frame = effects.of(on, "instrument_compliance", "stiffness_n_per_mm")
    return 1 / frame if frame else 0.0


def _curve(
    experiment: Experiment, curves: CurveDesign, number: int, shape: dict[str, float], speed: float
) -> RecordedCurve:
    if experiment.kind == INDENTATION:
        time, displacement, force = _indented(experiment, curves, shape["indenter_radius_mm"], speed)
    else:
        time, displacement = _compressed(curves, shape, speed)
        force = true_modulus(experiment) * cylinder_force(experiment.effects, shape, time, displacement)
    reading = instrument.shown(experiment, number, time, displacement, force)
    measured, noisy = instrument.noisy(experiment, number, reading)
    recording: dict[str, Any] = {"id": f"c{number + 1:02d}", "kind": experiment.kind, **shape}
    recording |= {"displacement_mm": _written(measured), "force_n": _written(noisy)}
    if curves.times:
        recording["time_s"] = _written(time)
    if curves.stage_stiffness_n_per_mm and curves.stage_declared:
        recording["stage_stiffness_n_per_mm"] = curves.stage_stiffness_n_per_mm
    return RecordedCurve(recording, reading.displacement_mm, reading.force_n, time, reading.zero_mm)


def _written(values: Floats) -> list[float]:
    return [float(f"{value:.9g}") for value in values]


def _indented(
    experiment: Experiment, curves: CurveDesign, radius: float, speed: float
) -> tuple[Floats, Floats, Floats]:
    """Times, depths and forces of a sphere: through the air, in, hold, back, and through the air again."""
    on, largest = experiment.effects, curves.largest_displacement_mm
    _check_depth(largest, 0.9 * radius)
    body = pressed_body(experiment, on, radius)
    stage = curves.stage_stiffness_n_per_mm
    compliance = frame_compliance(on) + (1 / stage if stage else 0.0)
    air = _AIR * largest
    start = -(air if curves.approach_mm is None else curves.approach_mm)
    peak = largest + compliance * body.elastic(largest)
    corners, waits = [start, peak, peak], [0.0, (peak - start) / speed, curves.hold_s]
    if curves.retract:
        end = min(body.last_touch(compliance), 0.0) - (air if curves.retreat_mm is None else curves.retreat_mm)
        corners, waits = [*corners, end], [*waits, (peak - end) / speed]
    substeps = math.ceil(_STEPS / curves.samples)
    time = np.linspace(0, sum(waits), (curves.samples - 1) * substeps + 1)
    travel = np.interp(time, np.cumsum(waits), corners)
    sunk = effects.of(on, "plastic_set", "ratio") * np.maximum.accumulate(np.maximum(travel, 0)) * largest / peak
    depth, force = contact_history(body, time, travel - sunk, compliance)
    time, depth, force = time[::substeps], (depth + sunk)[::substeps], force[::substeps]
    _check_loading(curves, int(((time <= waits[1]) & (depth > 0)).sum()), waits[1], float(time[-1]))
    return time, depth, force


def _compressed(curves: CurveDesign, shape: Mapping[str, float], speed: float) -> tuple[Floats, Floats]:
    """Times and shortenings of a cylinder: loading, hold, unloading; for tension then the same with the opposite
    sign."""
    largest = curves.largest_displacement_mm
    _check_depth(largest, 0.9 * shape["sample_height_mm"])
    corners = [0.0, largest, largest, 0.0] + ([-largest, 0.0] if curves.tension else [])
    ramp = largest / speed
    waits = [0.0, ramp, curves.hold_s, ramp] + ([ramp, ramp] if curves.tension else [])
    time = np.linspace(0, sum(waits), curves.samples)
    pressed = np.interp(time, np.cumsum(waits), corners)
    _check_loading(curves, int(((time <= ramp) & (pressed > 0)).sum()), ramp, float(time[-1]))
    return time, pressed


def _check_depth(largest: float, deepest: float) -> None:
    if largest >= deepest:
        allowed = f"must be below {deepest:g} mm, 0.9 of the sphere's radius or the cylinder's height"
        raise RigError("curves.largest_displacement_mm", largest, allowed)


def _check_loading(curves: CurveDesign, loading: int, ramp_s: float, total_s: float) -> None:
    if loading < _LEAST_LOADING:
        needed = math.ceil(curves.samples * (_LEAST_LOADING + 1) / max(loading, 1))
        allowed = (
            f"leaves {loading} samples while the load rises, in {ramp_s:g} s of {total_s:g} s: must leave at least "
            f"{_LEAST_LOADING}; about {needed} samples do, or a shorter hold_s"
        )
        raise RigError("curves.samples", curves.samples, allowed)


def campaign_of_curves(experiment: Experiment, curves: list[RecordedCurve]) -> dict[str, Any]:
    """The campaign (`campaign/1`) of the curves."""
    design = experiment.curves
    assert design is not None
    skin: dict[str, Any] = {
        "poisson_ratio": 0.5,
        "youngs_modulus_mpa": experiment.skin.youngs_modulus_mpa if design.modulus_declared else None,
        "d33_pc_per_n": None,
    }
    if experiment.kind != COMPRESSION:
        skin["thickness_mm"] = experiment.skin.thickness_mm
    if experiment.skin.id is not None:
        skin["id"] = experiment.skin.id
    return {
        "schema": "campaign/1",
        "name": experiment.name,
        **({"units_checked": True} if design.units_checked else {}),
        "skin": skin,
        "recordings": [curve.entry for curve in curves],
    }
