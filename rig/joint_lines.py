"""FRF lines of a skin as part of a joint analysis: what is expected of the truth, less what a model expects.

Expected are responses without noise and without scatter; scatter of gain and of position is part of the covariance, as
it is at the truth.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rig.joint_parameters import parameters_of_effects, scaled
from rig.layer import Floats
from rig.linear_filters import Complexes
from rig.recorded import RecordedLines
from rig.true_response import TrueResponse
from rig.whitening import Whitener

_SMALL_MM = 1e-3


class LinesPart:
    """FRF lines of a skin under a model.

    Parameters
    ----------
    recorded : RecordedLines
    model : TrueResponse
        What is assumed: other effects or gains than those of the recordings.
    free : bool
        Whether the parameters of the model's effects are free.
    """

    def __init__(self, recorded: RecordedLines, model: TrueResponse, *, free: bool) -> None:
        at_aim = np.zeros_like(recorded.response.missed_mm)
        true, self._model = replace(recorded.response, missed_mm=at_aim), replace(model, missed_mm=at_aim)
        experiment = model.experiment
        assert experiment.skin.id is not None
        self._skin, self._frequency = experiment.skin.id, recorded.frequency_hz
        self._expected = true.lines(self._frequency)
        self._whiten = Whitener(
            np.tile(np.sqrt(recorded.line_variance), 2), _scatter(true, self._expected, self._frequency)
        )
        self._cached: dict[tuple[float, ...], Complexes] = {}
        effects = parameters_of_effects(experiment, self._skin) if free else ()
        self._shape = (f"{self._skin}/modulus", f"{self._skin}/thickness", *effects)
        ids = [sensor[0] for sensor in experiment.skin.sensors]
        self._gains = tuple(f"{self._skin}/gain {ids[number]}" for number in true.plan.sensor)
        self.parameters = (*self._shape, f"{self._skin}/d33", *sorted(set(self._gains)))
        self.count = 2 * self._expected.size

    def residuals(self, values: Mapping[str, float]) -> Floats:
        """Expected lines less the model's, real and imaginary parts, over their noise."""
        gain = np.exp(values[f"{self._skin}/d33"] + np.array([values[name] for name in self._gains]))
        return self._whiten(_parts(self._expected - gain[:, None] * self._lines(values))).ravel()

    def _lines(self, values: Mapping[str, float]) -> Complexes:
        key = tuple(values[name] for name in self._shape)
        if key not in self._cached:
            experiment = scaled(self._model.experiment, self._skin, values)
            self._cached[key] = replace(self._model, experiment=experiment).lines(self._frequency)
        return self._cached[key]


def _scatter(true: TrueResponse, lines: Complexes, frequency_hz: Floats) -> Floats:
    """Scatter of gain and of position, as directions (1 or 3, rows, parts)."""
    noise = true.experiment.noise
    along = [noise.gain * lines]
    if noise.position_mm:
        along += [
            (true.elsewhere(step * np.ones_like(true.missed_mm)).lines(frequency_hz) - lines)
            * (noise.position_mm / _SMALL_MM)
            for step in _SMALL_MM * np.eye(2)
        ]
    return _parts(np.stack(along))


def _parts(values: Complexes) -> Floats:
    return np.concatenate([values.real, values.imag], axis=-1)
