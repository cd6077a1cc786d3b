"""Force against displacement of the elastomer: a sphere pressed in and drawn back, a cylinder between platens.

The law of a curve is its force on an elastic body of unit modulus, F₁(u); the body's relaxation E(t) acts through
    F(t) = ∫₀^{t₁} E(t − s) dF₁(u(s)),
with t₁ = t while the contact grows; as a sphere is drawn back, t₁ is the time at which the contact last had its present
size, ∫_{t₁}^{t} E(t − s) du(s) = 0 (Ting 1966). A cylinder's t₁ is always t.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig import effects
from rig.contact import sphere_contact
from rig.effects import COMPRESSION, INDENTATION, Values
from rig.errors import RigError
from rig.experiment import Experiment
from rig.layer import Floats, Layer
from rig.layer_contacts import stiffening

_APPROACH = 0.08  # of the largest indentation, before contact
_RADII = 3000
_LEAST_LOADING = 8  # samples; with fewer no law can be identified

Law = Callable[[Floats, bool], Floats]  # force for unit modulus at displacements, while drawn back or not


@dataclass(frozen=True)
class RecordedCurve:
    """One recording: its entry in the campaign, and its force [N] before noise."""

    entry: dict[str, Any]
    exact_force_n: Floats


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
    return [_curve(experiment, number, shape, speed) for number, (shape, speed) in enumerate(pairs)]


def _curve(experiment: Experiment, number: int, shape: dict[str, float], speed: float) -> RecordedCurve:
    curves, on = experiment.curves, experiment.effects
    assert curves is not None
    random = np.random.default_rng([experiment.seed, 5, number])
    time, pressed = _course(experiment, shape, speed)
    if experiment.kind == INDENTATION:
        law, memory = _sphere(experiment, shape["indenter_radius_mm"]), True
    else:
        law, memory = _cylinder(experiment, shape), False
    modulus = experiment.skin.youngs_modulus_mpa * (effects.of(on, "modulus_error", "factor") or 1.0)
    force = modulus * _with_relaxation(on, law, time, pressed, memory)
    measured = (
        pressed + force / effects.of(on, "instrument_compliance", "stiffness_n_per_mm")
        if ("instrument_compliance" in on)
        else pressed.copy()
    )
    force = force * (1 + _ripple(on, pressed)) + effects.of(on, "force_drift", "n_per_root_s") * np.sqrt(time)
    measured += curves.contact_point_mm * random.normal() + curves.displacement_noise_mm * random.normal(size=len(time))
    noisy = force + curves.force_noise_n * random.normal(size=len(time))
    entry: dict[str, Any] = {"id": f"c{number + 1:02d}", "kind": experiment.kind, **shape}
    entry |= {"displacement_mm": measured.tolist(), "force_n": noisy.tolist()}
    if curves.times:
        entry["time_s"] = time.tolist()
    return RecordedCurve(entry, force)


def _course(experiment: Experiment, shape: Mapping[str, float], speed: float) -> tuple[Floats, Floats]:
    """Times and displacements: loading, hold, unloading; in tension then the same to the other side."""
    curves = experiment.curves
    assert curves is not None
    largest = curves.largest_displacement_mm
    deepest = 0.9 * min(shape.get("sample_height_mm", np.inf), shape.get("indenter_radius_mm", np.inf))
    if largest >= deepest:
        allowed = f"must be below {deepest:g} mm, 0.9 of the sphere's radius or the cylinder's height"
        raise RigError("curves.largest_displacement_mm", largest, allowed)
    start = -_APPROACH * largest if experiment.kind == INDENTATION else 0.0
    corners = [start, largest, largest, start] + ([-largest, start] if curves.tension else [])
    waits = [0.0, (largest - start) / speed, curves.hold_s, (largest - start) / speed] + (
        [largest / speed, largest / speed] if curves.tension else []
    )
    time = np.linspace(0, sum(waits), curves.samples)
    pressed = np.interp(time, np.cumsum(waits), corners)
    loading = int(((time <= waits[1]) & (pressed > 0)).sum())
    if loading < _LEAST_LOADING:
        needed = math.ceil(curves.samples * (_LEAST_LOADING + 1) / max(loading, 1))
        raise RigError(
            "curves.samples",
            curves.samples,
            f"leaves {loading} samples while the load rises, in {waits[1]:g} s of {time[-1]:g} s: must leave at least "
            f"{_LEAST_LOADING}; about {needed} samples do, or a shorter hold_s",
        )
    return time, pressed


def _with_relaxation(on: Mapping[str, Values], law: Law, time: Floats, pressed: Floats, memory: bool) -> Floats:
    """F(t) over the modulus at rest."""
    falling = np.diff(pressed, prepend=pressed[0]) < 0
    back = np.cumsum(falling) > 0 if memory else np.zeros(len(time), dtype=bool)
    elastic = np.where(back, law(pressed, True), law(pressed, False))
    if "contact_creep" not in on:
        return elastic
    fraction, tau = (effects.of(on, "contact_creep", name) for name in ("fraction", "time_s"))
    middle = (time[1:] + time[:-1]) / 2
    elapsed = np.maximum(time[:, None] - middle, 0)
    relaxed = np.where(middle < time[:, None], 1 - fraction * -np.expm1(-elapsed / tau), 0.0)
    growth = np.diff(law(pressed, False))
    if not memory:
        return relaxed @ growth
    # Ting: increments after t1 do not count while the sphere is drawn back.
    depth = np.diff(np.maximum(pressed, 0))
    since = np.cumsum((relaxed * depth)[:, ::-1], axis=1)[:, ::-1]  # ∫ from each increment to t
    peak = int(np.argmax(pressed))
    counted = np.ones_like(relaxed)
    for row in np.flatnonzero(back):
        early = np.flatnonzero(since[row, :peak] >= 0)
        last = early[-1] if len(early) else 0
        counted[row, last + 1 :] = 0
        # t1 lies within this increment.
        counted[row, last] = since[row, last] / (since[row, last] - since[row, last + 1]) if len(early) else 0
    return (relaxed * counted) @ growth


def _sphere(experiment: Experiment, radius: float) -> Law:
    """Force of a sphere for E = 1, from curves over the contact radius; with adhesion it sticks on the way back."""
    on = experiment.effects
    nu = effects.of(on, "compressible_layer", "poisson_ratio") or 0.5
    modulus = experiment.skin.youngs_modulus_mpa
    work = effects.of(on, "adhesion", "work_j_per_m2") * 1e-3 / modulus  # mm, for E = 1
    largest = experiment.curves.largest_displacement_mm if experiment.curves else 0.0
    plane = 1 / (1 - nu**2)
    if "layered_contact" in on:
        h = experiment.skin.thickness_mm
        a = np.geomspace(1e-3, min(4.0, 2.5 * np.sqrt(radius * largest) / h), _RADII)
        contact = sphere_contact(Layer(nu))
        force = contact.force(a, radius / h, 1.0, work / h) * h**2
        depth = contact.depth(a, radius / h, 1.0, work / h) * h
        a = a * h
    else:
        a = np.geomspace(1e-3, 2.5, _RADII) * np.sqrt(radius * largest)
        depth = a**2 / radius - np.sqrt(2 * np.pi * work * a / plane)
        force = 4 * plane * a**3 / (3 * radius) - np.sqrt(8 * np.pi * work * plane * a**3)
    if depth[-1] < largest:
        allowed = f"must be at most {depth[-1]:.3g} mm: beyond, the contact is wider than 4 thicknesses"
        raise RigError("curves.largest_displacement_mm", largest, allowed)
    if "strain_stiffening" in on:
        reached = depth <= 1.01 * largest
        force = np.append(0.0, force[reached] * stiffening(on["strain_stiffening"], 0.2 * a[reached] / radius))
        depth = np.append(0.0 if not work else depth[0], depth[reached])
    holds = int(np.argmin(depth))  # under displacement control the contact tears at the least depth

    def law(displacement: Floats, drawn_back: bool) -> Floats:
        touching = displacement >= (depth[holds] if drawn_back and work else 0.0)
        return np.where(touching, np.interp(displacement, depth[holds:], force[holds:]), 0.0)

    return law


def _cylinder(experiment: Experiment, shape: Mapping[str, float]) -> Law:
    """Force of a cylinder for E = 1: area · u/H, stiffer with strain and friction, softer while a wedge closes."""
    on = experiment.effects
    height, diameter = shape["sample_height_mm"], shape["sample_diameter_mm"]
    held = 1 + 2 * effects.of(on, "platen_friction", "friction") * (diameter / (4 * height)) ** 2
    wedge = effects.of(on, "tilted_platen", "wedge_mm")

    def law(displacement: Floats, drawn_back: bool) -> Floats:  # noqa: ARG001
        touched = displacement
        if wedge:
            closing = np.clip(displacement, 0, wedge)
            touched = np.where(displacement > 0, displacement - closing + closing**2 / (2 * wedge), displacement)
        force = np.pi / 4 * diameter**2 * held * touched / height
        if "strain_stiffening" in on:
            force = force * stiffening(on["strain_stiffening"], np.abs(displacement) / height)
        return np.asarray(force)

    return law


def _ripple(on: Mapping[str, Values], pressed: Floats) -> Floats:
    if "force_ripple" not in on:
        return np.zeros_like(pressed)
    amplitude, pitch = (effects.of(on, "force_ripple", name) for name in ("amplitude", "pitch_mm"))
    return amplitude * np.sin(2 * np.pi * pressed / pitch)


def campaign_of_curves(experiment: Experiment, curves: list[RecordedCurve]) -> dict[str, Any]:
    """The campaign (`campaign/1`) of the curves."""
    assert experiment.curves is not None
    skin: dict[str, Any] = {
        "poisson_ratio": 0.5,
        "youngs_modulus_mpa": experiment.skin.youngs_modulus_mpa if experiment.curves.modulus_declared else None,
        "d33_pc_per_n": None,
    }
    if experiment.kind != COMPRESSION:
        skin["thickness_mm"] = experiment.skin.thickness_mm
    if experiment.skin.id is not None:
        skin["id"] = experiment.skin.id
    return {
        "schema": "campaign/1",
        "name": experiment.name,
        "skin": skin,
        "recordings": [curve.entry for curve in curves],
    }
