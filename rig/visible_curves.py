"""Visibility of effects in force–displacement curves: χ² of the base model's best fit less that of the truth.

Base models: indentation F = (4/3) E/(1 − ν²) √R (u − z)^(3/2), compression F = (E A/3)(λ⁻² − λ) with λ = 1 − (u − z)/H.
Plain weighted least squares with the rig's own noise refit the modulus, which is free, and what every curve has: its
zero of displacement z and, of an indentation, its zero of force, a linear drift (in travel where the rig drifts so,
else in time) and the gain of the cell within its scatter. The truth is refitted alike, but for z. Effects that are
`effects_in_model` act in the base model at their true strength, along the recorded displacement.

A factor on E shows as a departure from the declared modulus alone: under modulus_error and compressible_layer, and in
compression, a declared modulus is known within 2 %.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from rig.contact_course import Body, contact_history
from rig.curve_fit import Curve, Law, Priors, least_chi2
from rig.effects import INDENTATION, Values
from rig.elastomer import RecordedCurve, frame_compliance, pressed_body, true_modulus
from rig.errors import RigError
from rig.experiment import CurveDesign, Experiment
from rig.layer import Floats

THRESHOLD = 30.0
_DECLARED = 0.02
_FACTORS_ON_E = {"modulus_error", "compressible_layer"}
_SHIFTS = (
    0.0,
    -0.2,
    0.2,
)  # starts of z over the largest displacement; with effects in the model the first that has a fit
_OUT_OF_REACH: tuple[float, list[Floats]] = (np.inf, [])  # of a body that stiffens to infinity before its depth
_STEP = 1e-4  # of the largest displacement
_POINTS = 200  # of a course along the recorded displacement
_JUMP = 0.02  # of the largest force, between neighbouring samples
_LEAST_NOISE = 1e-6  # of the largest force
_LEAST_STRETCH = 0.02  # of λ, for a fit that goes astray


@dataclass(frozen=True)
class Visibility:
    """Result of `visibility`: χ² of the base model less that of the truth, and the base model's rms misfit [%]."""

    chi2_gain: float
    base_misfit_percent: float

    @property
    def identifiable(self) -> bool:
        """Whether the truth gains more than the threshold."""
        return self.chi2_gain > THRESHOLD


def visibility(
    experiment: Experiment, recorded: list[RecordedCurve], effects_in_model: tuple[str, ...] = ()
) -> Visibility:
    """Visibility of the effects against a model with only those of `effects_in_model`, at their true strength."""
    design = experiment.curves
    assert design is not None
    depth, on = design.largest_displacement_mm, {name: experiment.effects[name] for name in effects_in_model}
    exact, base = [curve.exact_force_n for curve in recorded], _Base(experiment, recorded, on)
    curves = [_Base(experiment, recorded, {}).measured(number) for number in range(len(recorded))]
    priors = base.priors()
    fits: Iterator[tuple[float, list[Floats]]] = (
        least_chi2(base.law(), curves, priors, shift * depth, _STEP * depth) for shift in _SHIFTS
    )
    if effects_in_model:
        fits = iter([next((fit for fit in fits if np.isfinite(fit[0])), _OUT_OF_REACH)])
    chi2, fitted = min(fits, key=lambda result: result[0])
    if not np.isfinite(chi2):
        return Visibility(np.inf, np.inf)
    true, _ = least_chi2(
        lambda number, log_modulus, _: exact[number] * np.exp(log_modulus),
        curves,
        replace(priors, log_modulus=0.0),
        0.0,
        _STEP * depth,
    )
    misfit = sum(float(np.sum((mine - other) ** 2)) for mine, other in zip(fitted, exact, strict=True))
    return Visibility(chi2 - true, 100 * float(np.sqrt(misfit / sum(float(np.sum(force**2)) for force in exact))))


def force_deviation(design: CurveDesign, slope: Floats, largest_n: float) -> Floats:
    """Deviation of force [N] by noise and steps, those of displacement through the slope |dF/du| [N/mm] (samples,)."""
    travel = np.hypot(design.displacement_noise_mm, design.displacement_step_mm / np.sqrt(12))
    noise = np.sqrt(design.force_noise_n**2 + design.force_step_n**2 / 12 + (slope * travel) ** 2)
    return np.maximum(noise, _LEAST_NOISE * largest_n + 1e-15)


@dataclass(frozen=True)
class _Base:
    """The base model of recorded curves, with the effects `on`."""

    experiment: Experiment
    recorded: list[RecordedCurve]
    on: Mapping[str, Values]
    bodies: dict[float, Body] = field(default_factory=dict)  # by the sphere's radius

    def measured(self, number: int) -> Curve:
        """Force, noise (that of displacement through dF/du), and columns of zero of force and drift."""
        design, curve = self.experiment.curves, self.recorded[number]
        assert design is not None
        step = _STEP * design.largest_displacement_mm
        slope = np.abs(self.law()(number, 0.0, -step) - self.law()(number, 0.0, step)) / (2 * step)
        noise = force_deviation(design, slope, float(np.abs(curve.exact_force_n).max()))
        columns = np.zeros((0, len(noise)))
        if self.experiment.kind == INDENTATION:
            along = curve.exact_displacement_mm if design.drift_n_per_mm else curve.time_s
            columns = np.stack([np.ones_like(along), (along - along[0]) / np.ptp(along)])
        return Curve(np.array(curve.entry["force_n"]), noise, columns)

    def priors(self) -> Priors:
        """Of ln E over the true modulus, and of the gains."""
        design, skin = self.experiment.curves, self.experiment.skin
        assert design is not None
        compressed = self.experiment.kind != INDENTATION
        factors = _FACTORS_ON_E & set(self.experiment.effects) - set(self.on)
        if not (design.modulus_declared and (compressed or factors)):
            return Priors(gain=design.gain)
        declared = skin.youngs_modulus_mpa * float(self.on.get("modulus_error", {}).get("factor", 1.0))
        deviation = float(np.hypot(_DECLARED, design.cell_gain))
        return Priors(float(np.log(declared / true_modulus(self.experiment))), deviation, design.gain)

    def law(self) -> Law:
        """Force at ln E over the true modulus and a shift of the zero of displacement."""
        if self.experiment.kind != INDENTATION:
            return self._neo_hookean
        return self._history if self.on else self._hertz

    def _displacement(self, number: int, shift: float) -> Floats:
        curve = self.recorded[number]
        return curve.exact_displacement_mm - curve.zero_mm - shift

    def _modulus(self, log_modulus: float) -> float:
        return true_modulus(self.experiment) * float(np.exp(log_modulus))

    def _neo_hookean(self, number: int, log_modulus: float, shift: float) -> Floats:
        recording = self.recorded[number].entry
        area = np.pi / 4 * recording["sample_diameter_mm"] ** 2
        stretch = np.maximum(1 - self._displacement(number, shift) / recording["sample_height_mm"], _LEAST_STRETCH)
        return self._modulus(log_modulus) * area * (stretch**-2 - stretch) / 3

    def _hertz(self, number: int, log_modulus: float, shift: float) -> Floats:
        depth = np.maximum(self._displacement(number, shift), 0)
        radius = self.recorded[number].entry["indenter_radius_mm"]
        return np.asarray(4 / 3 * self._modulus(log_modulus) / 0.75 * np.sqrt(radius) * depth**1.5)

    def _body(self, radius: float) -> Body:
        if radius not in self.bodies:
            deepest = max(float((curve.exact_displacement_mm - curve.zero_mm).max()) for curve in self.recorded)
            self.bodies[radius] = pressed_body(self.experiment, self.on, radius, 1.2 * deepest)
        return self.bodies[radius]

    def _history(self, number: int, log_modulus: float, shift: float) -> Floats:
        """Force of the effects in the model, calculated at some samples and at those next to a jump. Infinite beyond
        the rig's laws."""
        displacement, curve = self._displacement(number, shift), self.recorded[number]
        radius = curve.entry["indenter_radius_mm"]
        body = replace(self._body(radius), modulus=self._modulus(log_modulus))
        jumps = np.flatnonzero(np.abs(np.diff(curve.exact_force_n)) > _JUMP * np.abs(curve.exact_force_n).max())
        even = np.linspace(0, len(displacement) - 1, min(_POINTS, len(displacement))).astype(int)
        at = np.unique(np.concatenate([even, jumps, jumps + 1]))
        try:
            _, force = contact_history(body, curve.time_s[at], displacement[at], frame_compliance(self.on))
        except RigError:  # a step of the fit that went far astray, which is then rejected
            return np.full(len(displacement), np.inf)
        return np.interp(np.arange(len(displacement)), at, force)
