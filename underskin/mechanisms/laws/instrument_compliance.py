"""The mechanism `instrument_compliance`."""

import math

from underskin.mechanisms.base import Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.curve_state import Curve

_REASON = "robot stages 10 to 100 N/mm, testing machines 1000 to 50000; 150 within a factor of 7"


class InstrumentCompliance(Mechanism):
    """A stage that gives way under the force."""

    name = "instrument_compliance"
    plain = """The stage gives way under the force, so the displacement read off it is larger than the indentation and
    the sample looks too soft, most of all at high force."""
    law = "measured displacement = indentation + F/k, with the F that is measured: relaxed, and adhesive."
    assumptions = "a linear stage, the same in all recordings; without friction or backlash."
    source = "Oliver & Pharr, J. Mater. Res. 7 (1992) 1564 (frame compliance)."
    stage = Stage.CURVE
    order = 10
    kinds = ("indentation",)
    axes = ("force_n",)
    parameters_stated = (
        Parameter(
            "stage_stiffness", "N/mm", 0.01, 1e5, Normal(5.0, 2.0), "log", limit=math.inf, shown=20.0, reason=_REASON
        ),
    )

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Let the stage give."""
        curve.stage_stiffness = 1e3 * values["stage_stiffness"]
