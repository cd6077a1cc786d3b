"""The mechanism `instrument_compliance`."""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from underskin.mechanisms.base import Kind, Mechanism, Normal, Parameter, Stage, Values
from underskin.mechanisms.models.curve_state import Curve
from underskin.recordings.campaign import Conditions, IndentationConditions

_REASON = (
    "an instrument is about as stiff as what it presses: stages of spheres of millimetres 10 to 1000 N/mm, those "
    "of spheres of micrometres 0.1 to 1000 N/m; 30 N/mm for each mm of radius, within a factor of 20; under a block or "
    "strip 70 N/mm, of a cell that gives 0.2 mm at 15 N, to 8000 of a machine's frame: 750, within a factor of 3.3"
)
_OF_RADIUS, _USUAL_RADIUS_MM = 30.0, 5.0  # N/mm for each mm
_OF_FRAMES, _SD_OF_FRAMES = 750.0, 1.2  # N/mm
_SOFTEST_FRAME = 10.0  # N/mm, of a cell of 1 N that gives 0.1 mm
_SD = 3.0


class InstrumentCompliance(Mechanism):
    """A stage or frame that gives way under the force."""

    name = "instrument_compliance"
    plain = """The stage or the frame gives way under the force, so the displacement read off it is larger than the
    indentation, or the shortening of a block, and the sample looks too soft, most of all at high force."""
    law = """measured displacement = indentation (of a block or strip: shortening or extension) + F/k, with the F that
    is measured: relaxed, and adhesive."""
    assumptions = "a linear stage, the same in all recordings of a kind; without friction or backlash."
    source = "Oliver & Pharr, J. Mater. Res. 7 (1992) 1564 (frame compliance)."
    stage = Stage.CURVE
    order = 10
    of = "rig"
    kinds = ("indentation", "compression")
    axes = ("force_n", "sample_height_mm", "sample_diameter_mm")
    parameters_stated = (
        Parameter(
            "stage_stiffness",
            "N/mm",
            1e-6,
            1e5,
            Normal(math.log(_OF_RADIUS * _USUAL_RADIUS_MM), _SD),
            "log",
            limit=math.inf,
            shown=20.0,
            reason=_REASON,
        ),
    )

    def parameters(
        self, conditions: Conditions, kind: Kind = "indentation", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        """The stiffness, expected for the spheres of the recordings, or of the frames that press blocks."""
        radii = [recording.indenter_radius_mm for recording in conditions.of(IndentationConditions)]
        (stiffness,) = self.parameters_stated
        if kind == "compression":
            return (replace(stiffness, prior=Normal(math.log(_OF_FRAMES), _SD_OF_FRAMES), low=_SOFTEST_FRAME),)
        if radii:
            return (replace(stiffness, prior=Normal(math.log(_OF_RADIUS * float(np.median(radii))), _SD)),)
        return self.parameters_stated

    def act(self, state: Curve, values: Values) -> None:
        """Let the stage give."""
        state.stage_stiffness = 1e3 * values["stage_stiffness"]
