"""A curve of an elastomer as part of a joint analysis: what is expected of the truth, less what a model expects.

Expected are forces without noise and without scatter, along the recorded displacement. The curve's gain, zero of force
and linear drift are part of the covariance, as they are at the truth; its zero of displacement, and the gain of the
cell that all curves share, are parameters.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rig.contact_course import Body, contact_history
from rig.cylinder import cylinder_force
from rig.effects import INDENTATION
from rig.elastomer import RecordedCurve, frame_compliance, pressed_body, true_modulus
from rig.experiment import Experiment
from rig.joint_parameters import parameters_of_effects, scaled
from rig.layer import Floats
from rig.visible_curves import force_deviation
from rig.whitening import Whitener

_SLOPE = 1e-4  # of the largest displacement
_SAMPLES = 120  # of a curve: so many weigh as much as all
_JUMP = 0.1  # of the largest force, between neighbouring samples; samples next to a jump do not count
_NO_WEIGHT = 1e6
_BEYOND = 1.2  # of the largest displacement: how far the law of a body reaches
_UNKNOWN = 10.0  # of the largest force: scatter of the zero of force and of the drift


class CurvePart:
    """A curve under a model.

    Parameters
    ----------
    curve : RecordedCurve
    truth, model : Experiment
        The experiment that recorded it, and what is assumed: the same with other effects.
    skin : str
        Id of the skin whose elastomer it is.
    free : bool
        Whether the parameters of the model's effects are free.
    """

    def __init__(self, curve: RecordedCurve, truth: Experiment, model: Experiment, skin: str, *, free: bool) -> None:
        assert model.curves is not None
        self._model, self._design, self._skin, self._recording = model, model.curves, skin, curve.entry
        at = np.unique(np.linspace(0, len(curve.time_s) - 1, _SAMPLES).astype(int))
        self._time_s = curve.time_s[at]
        self._displacement_mm = (curve.exact_displacement_mm - curve.zero_mm)[at]  # from the touch of the surfaces
        self._bodies: dict[tuple[float, ...], Body] = {}
        self._shape = (f"{skin}/thickness", *(parameters_of_effects(model, skin) if free else ()))
        self._zero = f"{skin}/{curve.entry['id']} zero"
        self.parameters = (f"{skin}/modulus", *self._shape, f"{skin}/cell", self._zero)
        self.count = len(at)
        here = dict.fromkeys(self.parameters, 0.0)
        self._expected = self._force(truth, here, 0.0)
        step = _SLOPE * self._design.largest_displacement_mm
        slope = np.abs(self._force(truth, here, -step) - self._force(truth, here, step)) / (2 * step)
        self._whiten = self._noise(slope, len(curve.time_s))
        self._bodies.clear()  # those of the truth

    def residuals(self, values: Mapping[str, float]) -> Floats:
        """Expected force less the model's (samples,), over its noise."""
        shift = values[self._zero] * self._design.largest_displacement_mm
        force = np.exp(values[f"{self._skin}/cell"]) * self._force(self._model, values, shift)
        return self._whiten((self._expected - force)[None])[0]

    def _force(self, assumed: Experiment, values: Mapping[str, float], shift_mm: float) -> Floats:
        """Force [N] with the zero of displacement shifted."""
        experiment = scaled(assumed, self._skin, values)
        displacement, modulus = self._displacement_mm - shift_mm, true_modulus(experiment)
        if experiment.kind != INDENTATION:
            return modulus * cylinder_force(experiment.effects, self._recording, self._time_s, displacement)
        body = replace(self._body(experiment, values), modulus=modulus)
        return contact_history(body, self._time_s, displacement, frame_compliance(experiment.effects))[1]

    def _body(self, experiment: Experiment, values: Mapping[str, float]) -> Body:
        key = tuple(values[name] for name in self._shape)
        if key not in self._bodies:
            deepest = _BEYOND * float(self._displacement_mm.max())
            radius = self._recording["indenter_radius_mm"]
            self._bodies[key] = pressed_body(experiment, experiment.effects, radius, deepest)
        return self._bodies[key]

    def _noise(self, slope: Floats, samples: int) -> Whitener:
        largest = float(np.abs(self._expected).max())
        deviation = force_deviation(self._design, slope, largest) * np.sqrt(self.count / samples)
        jumps = np.flatnonzero(np.abs(np.diff(self._expected)) > _JUMP * largest)
        deviation[np.concatenate([jumps, jumps + 1])] *= _NO_WEIGHT
        along = [self._design.gain * self._expected]
        if self._design.force_zero_n:
            way = self._displacement_mm if self._design.drift_n_per_mm else self._time_s
            along += [np.full(self.count, _UNKNOWN * largest), _UNKNOWN * largest * (way - way[0]) / np.ptp(way)]
        return Whitener(deviation[None], np.stack(along)[:, None])
