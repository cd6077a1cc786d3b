"""The mechanism `preload_dependent_d33`."""

import numpy as np

from underskin.autodiff import chain
from underskin.mechanisms.base import HeavyTailed, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.contact_state import FrfState

_SLOPE = "the paper's array, 14 to 22 pC/N from 1 to 3 N, needs 5 to 6 per MPa; ceramics about -0.01"
_SATURATION = "no saturation has been published; 1 MPa is ten times the stress of a firm touch"


class PreloadDependentD33(Mechanism):
    """A d33 that depends on the static stress on the sensor."""

    name = "preload_dependent_d33"
    plain = """The preload squeezes the sensor itself and changes how strongly it answers, so d33 comes out different at
    each preload and under each sphere."""
    law = """d33 = d0 (1 + β T0/(1 + |T0|/Ts)), T0 = 3Fσ/(2πh²) > 0 in compression; linear as Ts → ∞, saturating at 1 +
    β Ts."""
    assumptions = """d33(T0) is the tangent coefficient, felt by the small oscillation; T0 is the mean over the sensor,
    of the static σ at its own offset. The same law for all sensors."""
    source = "Seminara 2018, section 3.2 (22 pC/N at 3 N against 14 pC/N at 1 N on the array)."
    stage = Stage.SENSOR
    order = 10
    axes = ("preload_n", "indenter_radius_mm", "position_mm", "sensor")
    parameters_stated = (
        Parameter(
            "stress_coefficient",
            "1/MPa",
            -8.0,
            15.0,
            HeavyTailed(0.0, 3.0),
            "linear",
            limit=0.0,
            shown=2.0,
            reason=_SLOPE,
        ),
        Parameter(
            "saturation_stress",
            "MPa",
            0.02,
            20.0,
            Normal(0.0, 1.5),
            "log",
            limit=None,
            shown=1.0,
            reason=_SATURATION,
        ),
    )

    def act(self, state: FrfState, values: Values) -> None:
        """1 + β T0/(1 + |T0|/Ts)."""
        stress = 1e-6 * state.mean_stress
        size = chain(np.abs(stress.value), (np.sign(stress.value), stress))
        state.factor = 1.0 + values["stress_coefficient"] * stress / (1.0 + size / values["saturation_stress"])
