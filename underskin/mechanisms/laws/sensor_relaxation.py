"""The mechanism `sensor_relaxation`."""

import numpy as np

from underskin.autodiff import exp
from underskin.mechanisms.base import HeavyTailed, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState

_REFERENCE = 30.0  # Hz
_EXPONENT = "tan δ of PVDF and its copolymers is 0.02 to 0.2, and n is 2/π of it"
_STEP = "a relaxation inside the band changes d33 by some tens of percent"
_FREQUENCY = "it must lie in or near the band of measurement to be seen; 20 Hz within a factor of 4.5"


class SensorRelaxation(Mechanism):
    """Dielectric relaxation of the sensor's material."""

    name = "sensor_relaxation"
    plain = """The sensor's material follows a change only with delay, so the response falls with rising frequency and
    the charge lags behind the force."""
    law = "(iω/ω_ref)^(−n) · (1 + s/(1 + iω/ω_s)), n ≥ 0, s ≥ 0, ω_ref = 2π · 30 Hz: a power law, a step, or both."
    assumptions = """linear, the same for all sensors and preloads; causal, so that real and imaginary part belong
    together."""
    source = "Jonscher, Dielectric Relaxation in Solids (1983), chapters 3 and 5 (Debye's step, universal power law)."
    stage = Stage.LINES
    order = 20
    axes = ("frequency_hz", "phase")
    parameters_stated = (
        Parameter("exponent", "-", 0.0, 0.4, HeavyTailed(0.0, 0.08), "linear", limit=0.0, shown=0.03, reason=_EXPONENT),
        Parameter("step", "-", 0.0, 3.0, HeavyTailed(0.0, 0.4), "linear", limit=0.0, shown=0.1, reason=_STEP),
        Parameter(
            "step_frequency",
            "Hz",
            0.05,
            3000.0,
            Normal(3.0, 1.5),
            "log",
            limit=None,
            shown=20.0,
            reason=_FREQUENCY,
        ),
    )

    def act(self, state: FrfState, values: Values) -> None:
        """(iω/ω_ref)^(−n) (1 + s/(1 + iω/ω_s))."""
        frequency = state.design.line_frequency
        power = exp(-np.log(1j * frequency / _REFERENCE) * values["exponent"])
        step = values["step"] / (1.0 + 1j * frequency / values["step_frequency"])
        state.factor = power * (1.0 + step)
